"""Levers near a surface: in contact with a sample, or reading their distance to it.

Tables and figures, at rest or in time.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hotlever.errors import ComputationError, InputError, as_far_as_possible, excerpt
from hotlever.probe.surroundings import Surroundings
from hotlever.probe.tip import EXAMPLE, interface_of, parsed_layers
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import ContactRequest, ReaderRequest
from hotlever.tasks.shared import draw, make_lever, notes_of, write_table
from hotlever.tasks.texts import parse_bias, parse_distances, parse_pressures
from hotlever.types import Array
from hotlever.units import setting

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever import Lever
    from hotlever.lever.noise import NoiseOptions
    from hotlever.probe import Probe

#: Radii that a contact may have (µm).
_SMALLEST, _LARGEST = 1e-4, 10.0
#: How well a change of the current is known, for the note on what it tells, over the current.
_CURRENT_KNOWN = 1e-4
#: Up to this bias (V) the best one for a reader is looked for.
_HIGHEST_V = 11.0
#: What probe files have where they do not state of what temperature the jumping air is (K).
_USUAL_K = Surroundings.model_fields["jump_temperature_K"].default


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

    request.check_outputs()
    waveform = request.read_waveform()
    if waveform is None:
        request.refuse("until", "at", why="goes with a wave form, such as --pulse")
    else:
        request.refuse("bias", why="does not go with a wave form, which has biases of its own")
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
    reporter.note(*contact_notes(data))
    text = write_table(request.output, data, columns)
    draw(request.plot, lambda figures: figures.contact_overview(data, probe))
    if text:
        reporter.give(text)
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
        radius = setting(request.radius, "um", "--radius")
        if not _SMALLEST <= radius <= _LARGEST:
            raise InputError(
                f"--radius: found '{excerpt(request.radius)}', expected a length from "
                f"{1e3 * _SMALLEST:g} nm to {_LARGEST:g} µm, such as 5nm"
            )
        changes["tip.apex_radius_um"] = radius
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


def contact_notes(data: xr.Dataset) -> list[str]:
    """Return what should be known of a lever in contact, by the bias or in time."""
    note = what_the_current_tells(data) if "current_by_resistance" in data else ""
    return [*notes_of(data), *([note] if note else [])]


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


def approach(reporter: Reporter, request: ReaderRequest) -> None:
    """Read a lever at distances to a surface, over biases and pressures.

    Raises
    ------
    ComputationError
        If it has no state at any of them.
    """
    from hotlever.lever.reader import Reader, best_bias, over_surface, rows_of

    request.check_outputs()
    distances, noise = parse_distances(request.distance), noise_of(request)
    pressures = None if request.pressure is None else parse_pressures(request.pressure)
    probe = probe_over_surface(reporter, request, distances)
    biases = None if request.bias is None else parse_bias(request.bias, probe.lowest_bias_V)
    reader = Reader(probe, noise)
    lever = make_lever(reporter, probe)
    with reporter.progress_bars("best bias", "distances") as (trying, update):
        if biases is None:
            best_V = best_bias(lever, distances[[0, -1]], _HIGHEST_V, noise, trying)
            biases = np.array([best_V])
            reporter.note(
                f"of all biases up to {_HIGHEST_V:g} V {biases.item():.4g} V resolves these "
                "distances best (--bias chooses others)"
            )
        if needs_jump(probe):
            lever = jumping_at_tip(reporter, lever, float(biases[biases.size // 2]))
        data = over_surface(lever, distances, biases, noise, pressures, progress=update)
    if not data.tip_K.notnull().any():
        raise ComputationError(notes_of(data)[0])
    if not reader.is_held and probe.circuit.swept != "reader":
        reporter.note(
            "no supply heats the terminal reader ([circuit.reader]): the heater itself is read, "
            f"behind {probe.circuit.series_resistance_ohm:g} ohm"
        )
    reporter.note(*notes_of(data), "that films bend the lever when it gets warm is left out")
    reporter.tell_table(best_resolved(data, noise))
    rows = rows_of(data)
    columns = [str(name) for name in rows.data_vars]
    whole = request.output is not None and request.output.suffix.lower() == ".nc"
    text = write_table(request.output, data if whole else rows, columns)
    draw(request.plot, lambda figures: figures.reader_overview(data))
    if text:
        reporter.give(text)


def probe_over_surface(reporter: Reporter, request: ReaderRequest, distances: Array) -> Probe:
    """Read the probe, in air over a surface at the nearest of some distances (µm)."""
    from hotlever.lever.reader import check_distances

    probe = request.read_probe(reporter)
    check_distances(probe, distances)
    around = probe.surroundings
    changes: dict[str, Any] = {"surface_gap_um": float(distances.min())}
    if request.medium is None and around.medium == "vacuum":
        reporter.note("in vacuum a reader sees no surface: the lever is taken in air")
        changes["medium"] = "air"
    if around.accommodation is None:
        changes["accommodation"] = around.with_jump.accommodation
        reporter.note(
            "no accommodation is stated: it is taken as 1 (--set accommodation=0.9 states one)"
        )
    return probe.with_(**changes)


def needs_jump(probe: Probe) -> bool:
    """Return whether a probe leaves it open of which temperature the air is that jumps."""
    return probe.surroundings.jump_temperature_K == _USUAL_K


def jumping_at_tip(reporter: Reporter, lever: Lever, bias_V: float) -> Lever:
    """Return a lever with the jump of the air as at the temperature of its tip at a bias.

    The same lever where there is no state at this bias.
    """
    try:
        (state,) = lever.solve([bias_V])
    except ComputationError:
        return lever
    T = round(state.tip_K)
    reporter.note(
        f"the air's temperature jumps as at {T} K, the tip's at {bias_V:.4g} V "
        f"(--set jump_temperature_K=... states another one than {_USUAL_K:g})"
    )
    return lever.with_probe(lever.probe.with_(jump_temperature_K=T))


def noise_of(request: ReaderRequest) -> NoiseOptions:
    """Return what is known of noise beside the lever.

    Raises
    ------
    InputError
        If a value makes no sense.
    """
    from hotlever.lever.noise import NoiseOptions

    low, _, high = request.bandwidth.partition(":")
    return NoiseOptions(
        setting(low, "Hz", "--bandwidth"),
        setting(high, "Hz", "--bandwidth"),
        setting(request.amplifier, "V", "--amplifier"),
        request.hooge,
        0.0 if request.vibration is None else setting(request.vibration, "nm", "--vibration"),
    )


def best_resolved(data: xr.Dataset, noise: NoiseOptions) -> list[list[str]]:
    """Return rows that say how well the best distance and bias are resolved, and by what."""
    density = data.resolution_nm_per_rtHz
    if not density.notnull().any():
        return []
    best = data.isel(density.argmin(...))
    resolution = float(best.resolution_nm_per_rtHz)
    whole = resolution * np.sqrt(noise.high_Hz - noise.low_Hz)
    where = f"{float(best.surface_gap_um):.4g} µm, {float(best.bias_V):.4g} V"
    rows = [
        ["resolved best", f"{where}, tip at {float(best.tip_K):.0f} K"],
        ["resolution", f"{1e3 * resolution:.3g} pm/√Hz, {whole:.3g} nm in the band"],
        ["noise", f"{1e9 * float(best.noise_V_per_rtHz):.3g} nV/√Hz, of its square"],
    ]
    for source in best.source.values.tolist():
        share = float((best.source_V_per_rtHz.sel(source=source) / best.noise_V_per_rtHz) ** 2)
        if share:
            rows.append([f"  {source}", f"{100 * share:.3g} %"])
    if not noise.hooge:
        rows.append(["  1/f noise", "not counted (--hooge)"])
    if np.isfinite(best.crosstalk_V_per_V):
        per_V, per_mW = float(best.crosstalk_V_per_V), float(best.crosstalk_V_per_mW)
        rows.append(["cross-talk of the heater", f"{per_V:.3g} V/V, {per_mW:.3g} V/mW"])
    return rows
