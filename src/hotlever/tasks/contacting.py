"""Levers whose tip touches a sample: a table and a figure, at rest or in time."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hotlever.datasets import csv_text, write_dataset
from hotlever.errors import InputError, as_far_as_possible, shown
from hotlever.probe.tip import EXAMPLE, interface_of, length_um, parsed_layers
from hotlever.tasks.files import draw
from hotlever.tasks.probes import make_lever
from hotlever.tasks.ranges import parse_bias
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import ContactRequest

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.probe import Probe

#: Radii that a contact may have (µm).
_SMALLEST, _LARGEST = 1e-4, 10.0
#: How well a change of the current is known, for the note on what it tells, over the current.
_CURRENT_KNOWN = 1e-4


def touch(reporter: Reporter, request: ContactRequest) -> None:
    """Solve a lever in contact over a range of bias, or in time.

    Raises
    ------
    ComputationError
        If it has no state at some of them; what was reached is written.
    """
    from hotlever.lever.contact import (
        CONTACT_COLUMNS,
        HISTORY_COLUMNS,
        history_in_contact,
        sweep_in_contact,
    )

    outputs = request.outputs()
    waveform = request.read_waveform()
    if waveform is not None and request.bias is not None:
        raise InputError("--bias: does not go with a wave form, which has biases of its own")
    if waveform is None:
        request.refuse(["until", "at"], "goes with a wave form, such as --pulse")
    probe = probe_in_contact(reporter, request)
    biases = parse_bias(request.bias, probe.lowest_bias_V)
    lever = make_lever(reporter, probe)
    with reporter.progress("contact") as update:
        if waveform is None:
            columns, solve = CONTACT_COLUMNS, partial(sweep_in_contact, lever, biases)
        else:
            times = waveform, request.end_us, request.times_us
            columns, solve = HISTORY_COLUMNS, partial(history_in_contact, lever, *times)
        data, failure = as_far_as_possible(lambda: solve(progress=update))
    if failure is not None and not data.tip_K.size:
        raise failure
    reporter.note(*notes_of(data))
    with outputs.together():
        if request.output is not None:
            write_dataset(data, request.output, columns)
        draw(request.plot, lambda figures: figures.contact_overview(data, probe))
    if request.output is None:
        reporter.give(csv_text(data, columns))
    if failure is not None:
        raise failure


def probe_in_contact(reporter: Reporter, request: ContactRequest) -> Probe:
    """Read the probe, and have its tip touch the sample.

    Raises
    ------
    InputError
        If there is no sample, or what is asked for cannot be.
    """
    probe = request.read_probe(reporter)
    changes: dict[str, Any] = {}
    tip = probe.tip or EXAMPLE
    radius = tip.apex_radius_um
    if probe.tip is None:
        changes["tip.height_um"] = tip.height_um
    if request.radius is not None:
        stated = length_um(request.radius)
        if stated is None or not _SMALLEST <= stated <= _LARGEST:
            raise InputError(
                f"--radius: found '{shown(request.radius)}', expected a length from "
                f"{1e3 * _SMALLEST:g} nm to {_LARGEST:g} µm, such as 5nm"
            )
        changes["tip.apex_radius_um"] = radius = stated
    if request.sample is not None:
        parsed_layers(request.sample, "--sample")
        changes["sample"] = request.sample
    elif probe.contact is None:
        raise InputError(
            "--sample: found none, expected layers such as polymer,100nm,silicon, or a probe file "
            "with a section [contact]"
        )
    if request.interface is not None:
        resistance = interface_of(request.interface, radius, "--interface")
        changes["interface_K_per_mW"] = resistance
    if probe.surroundings.medium == "air" and probe.surroundings.surface_gap_um is None:
        changes["surface_gap_um"] = tip.height_um
    touching = probe.with_(**changes) if changes else probe
    if probe.tip is None:
        reporter.note(
            f"the probe has no [tip]: a cone {tip.height_um:g} µm high, of half-angle "
            f"{tip.half_angle_deg:g}°"
        )
    return touching


def notes_of(data: xr.Dataset) -> list[str]:
    """Return what should be known of a lever in contact, by the bias or in time."""
    told = what_the_current_tells(data) if "current_by_resistance" in data else ""
    return list(filter(None, [*data.attrs["notes"].split("\n"), told]))


def what_the_current_tells(data: xr.Dataset) -> str:
    """Say how well the sum of resistances is known by the current, where it tells most of it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        error = _CURRENT_KNOWN * np.abs(data.current_mA / data.current_by_resistance)
        whole = data.tip_K_per_mW + data.interface_K_per_mW + data.spreading_K_per_mW
        relative = (error / whole).values
    if not np.isfinite(relative).any():
        return ""
    best = int(np.nanargmin(relative))
    share = relative[best]
    accuracy = f"to {share:.2g} of it" if share < 1 else f"no better than {share:.2g} times over"
    return (
        f"a change of I_h known to {_CURRENT_KNOWN:g} of I_h tells the sum of resistances, "
        f"{1e3 * whole.values[best]:.3g} K/W, best at {data.bias_V.values[best]:.4g} V: {accuracy}"
    )
