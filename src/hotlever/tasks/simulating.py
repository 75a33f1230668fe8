"""Levers over a range of bias, and in time: tables, figures and fields.

What draws, and the full 3-D, are imported where they are needed: a sweep is there at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import count as count_up
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from hotlever.errors import ComputationError, HistoryEndError
from hotlever.files import Outputs, output_folder
from hotlever.lever import Lever, State, sweep_csv, write_sweep
from hotlever.lever.fields import FieldMapper, write_pvd, write_vtu
from hotlever.lever.transient import (
    Waveform,
    history_csv,
    simulate,
    with_times,
    write_history,
)
from hotlever.tasks.files import draw
from hotlever.tasks.reporter import Reporter
from hotlever.types import Array

#: Points of a curve for each step of the solver.
_CURVE = 8


class Files(NamedTuple):
    """What is written: a table (CSV or NetCDF), a figure, and a folder of fields (VTU)."""

    output: Path | None = None
    plot: Path | None = None
    fields: Path | None = None


def sweep(reporter: Reporter, lever: Lever, biases: Array, outputs: Outputs, files: Files) -> None:
    """Solve a lever over a range of bias (V).

    Raises
    ------
    ComputationError
        If it has no state at some of them; what was reached is written.
    """
    states: list[State] = []
    with reporter.progress("sweep") as update:
        data, failure = _reached(lambda: lever.sweep(biases, progress=update))
        if failure is not None and not data.bias.size:
            raise failure
        if files.fields is not None:
            states, ended = _reached(lambda: lever.solve(data.bias_V.values, update))
            failure = failure or ended
    reporter.note(*filter(None, data.attrs["notes"].split("\n")))
    with outputs.together():
        if files.output is not None:
            write_sweep(data, files.output)
        draw(files.plot, lambda figures: figures.sweep_overview(data))
        if files.fields is not None:
            _write_fields(lever, states, output_folder(files.fields))
    if files.output is None:
        reporter.give(sweep_csv(data))
    if failure is not None:
        raise failure


def _reached(work: Callable[[], Any]) -> tuple[Any, ComputationError | None]:
    """Return what a computation gives; if it fails, what it reached, and the failure."""
    try:
        return work(), None
    except ComputationError as error:
        if error.partial is None:
            raise
        return error.partial, error


def simulate_in_time(
    reporter: Reporter,
    lever: Lever,
    waveform: Waveform,
    until: float | None,
    times: list[float] | None,
    outputs: Outputs,
    files: Files,
) -> None:
    """Solve a lever in time, up to a time and at some times (µs) if these are given.

    Raises
    ------
    HistoryEndError
        If it has no state any more; what was reached is written.
    """
    failure: HistoryEndError | None = None
    # figures and rise times are of smooth curves, the table of the steps alone
    per_step = _CURVE if times is None else 1
    states: list[tuple[float, State]] = []
    ends: list[State] = []
    told = count_up()
    with reporter.progress("pulse") as update:

        def keep(t: float, state: State) -> None:
            ends[1:] = [state]
            if next(told) % per_step == 0 and files.fields is not None:
                states.append((t, state))

        options: Any = {"per_step": per_step, "progress": update, "callback": keep}
        try:
            curve = simulate(lever, waveform, until, times, **options)
        except HistoryEndError as error:
            curve, failure = error.partial, error
    if ends:
        curve = with_times(curve, ends[0], ends[-1], resolved=times is None)
    data = curve.isel(time=slice(None, None, per_step))
    reporter.note(*filter(None, data.attrs["notes"].split("\n")))
    reporter.tell_table(_times(data))
    with outputs.together():
        if files.output is not None:
            write_history(data, files.output)
        if data.sizes["time"]:
            draw(files.plot, lambda figures: figures.history_overview(curve))
        if files.fields is not None:
            _write_fields_in_time(lever, states, output_folder(files.fields))
    if files.output is None:
        reporter.give(history_csv(data))
    if failure is not None:
        raise failure


def _times(data: xr.Dataset) -> list[list[str]]:
    """Return rows that say how hot the tip gets, and how fast."""
    rows, of = [], data.attrs
    if "tip_mean_K" in of:
        highest = f"{of['tip_highest_K']:.1f} K at {of['tip_highest_at_us']:.4g} µs"
        end = f"{data.tip_K[-1].item():.1f} K at {data.time[-1].item():.4g} µs"
        rows += [["tip, highest", highest], ["tip, at the end", end]]
        took = data.time[-1].item() - data.time[0].item()
        rows += [["tip, mean", f"{of['tip_mean_K']:.1f} K over {took:.4g} µs"]]
    for name in ("heating", "cooling"):
        time = data.attrs.get(f"{name}_us", math.nan)
        if not math.isnan(time):
            rows.append([f"{name}, 10 to 90 %", f"{time:.3g} µs"])
    for name in ("start", "end"):
        constants = data.attrs.get(f"time_constants_us_at_{name}", ())
        if len(constants):
            listed = ", ".join(f"{time:.3g}" for time in constants)
            rows.append([f"time constants at the {name}", f"{listed} µs"])
    return rows


def _write_fields(lever: Lever, states: list[State], folder: Path) -> None:
    """Write the fields of states to a folder, those of the air too where there is some."""

    def name(state: State, suffix: str) -> Path:
        return folder / f"bias_{state.bias_V:08.4f}V{suffix}"

    from hotlever.lever3d import SolidLever

    if isinstance(lever, SolidLever):
        from hotlever.lever3d.fields import write_solid_vtu

        for state in states:
            write_solid_vtu(state, name(state, ".vtu"))
            if lever.medium == "air":
                _draw_slices(state, name(state, ".png"))
        return

    from hotlever.lever.air_fields import AirFields

    mapper, air = FieldMapper(lever), AirFields(lever) if lever.medium == "air" else None
    for state in states:
        write_vtu(mapper.map(state), name(state, ".vtu"))
        if air is not None:
            air.write_vtu(state, name(state, "_air.vtu"))


def _draw_slices(state: State, path: Path) -> None:
    from hotlever.lever3d.fields import temperature_slices

    draw(path, lambda figures: figures.temperature_slices(temperature_slices(state)))


def _write_fields_in_time(lever: Lever, states: list[tuple[float, State]], folder: Path) -> None:
    """Write the fields of states in time to a folder, with their index."""
    mapper = FieldMapper(lever)
    names = [f"fields_{index:04d}.vtu" for index in range(len(states))]
    for name, (_, state) in zip(names, states, strict=True):
        write_vtu(mapper.map(state), folder / name)
    write_pvd([t for t, _ in states], names, folder / "fields.pvd")
