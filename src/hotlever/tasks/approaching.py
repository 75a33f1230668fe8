"""Levers that read their distance to a surface: a table and a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hotlever.datasets import csv_text, write_dataset
from hotlever.errors import ComputationError, InputError, shown
from hotlever.probe.surroundings import Surroundings
from hotlever.probe.tip import length_um
from hotlever.tasks.files import draw
from hotlever.tasks.probes import make_lever
from hotlever.tasks.ranges import parse_bias, parse_distances, parse_pressures
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import ReaderRequest
from hotlever.tasks.texts import parse_band
from hotlever.types import Array
from hotlever.units import setting

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever import Lever
    from hotlever.lever.noise import NoiseOptions
    from hotlever.probe import Probe

#: Up to this bias (V) the best one is looked for.
_HIGHEST_V = 11.0
#: What probe files have where they do not state of what temperature the jumping air is (K).
_USUAL_K = Surroundings.model_fields["jump_temperature_K"].default


def approach(reporter: Reporter, request: ReaderRequest) -> None:
    """Read a lever at distances to a surface, over biases and pressures.

    Raises
    ------
    ComputationError
        If it has no state at any of them.
    """
    from hotlever.lever.reader import Reader, best_bias, over_surface, rows_of

    outputs = request.outputs()
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
        raise ComputationError(data.attrs["notes"].split("\n")[0])
    if not reader.is_held and probe.circuit.swept != "reader":
        reporter.note(
            "no supply heats the terminal reader ([circuit.reader]): the heater itself is read, "
            f"behind {probe.circuit.series_resistance_ohm:g} ohm"
        )
    reporter.note(*filter(None, data.attrs["notes"].split("\n")))
    reporter.note("that films bend the lever when it gets warm is left out")
    reporter.tell_table(best_resolved(data, noise))
    rows = rows_of(data)
    columns = [str(name) for name in rows.data_vars]
    with outputs.together():
        if request.output is not None:
            whole = request.output.suffix.lower() == ".nc"
            write_dataset(data if whole else rows, request.output, columns)
        draw(request.plot, lambda figures: figures.reader_overview(data))
    if request.output is None:
        reporter.give(csv_text(rows, columns))


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

    low, high = parse_band(request.bandwidth)
    amplifier = setting(request.amplifier, "V", "--amplifier")
    vibration = 0.0 if request.vibration is None else length_um(request.vibration)
    if vibration is None or not 0.0 <= vibration <= 1.0:
        raise InputError(
            f"--vibration: found '{shown(str(request.vibration))}', expected a length up to 1um, "
            "such as 1pm"
        )
    if not 0.0 <= amplifier <= 1.0:
        raise InputError(f"--amplifier: found {amplifier:g} V, expected 0 to 1 V, such as 5nV")
    if not 0.0 <= request.hooge <= 1.0:
        raise InputError(f"--hooge {request.hooge:g}: expected a number from 0 to 1, such as 1e-5")
    return NoiseOptions(low, high, amplifier, request.hooge, 1e3 * vibration)


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
