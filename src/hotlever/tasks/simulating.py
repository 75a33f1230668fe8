"""Levers in time: a table, a figure and fields."""

from __future__ import annotations

import math
from itertools import count as count_up
from pathlib import Path
from typing import Any

import xarray as xr

from hotlever.errors import HistoryEndError
from hotlever.files import Outputs, output_folder
from hotlever.lever import State
from hotlever.lever.fields import write_fields_in_time
from hotlever.lever.transient import (
    history_csv,
    simulate,
    with_times,
    write_history,
)
from hotlever.tasks.files import draw
from hotlever.tasks.probes import make_lever
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import PulseRequest

#: Points of a curve for each step of the solver.
_CURVE = 8


def simulate_in_time(reporter: Reporter, request: PulseRequest) -> None:
    """Solve a lever in time, or write the page of it.

    Raises
    ------
    HistoryEndError
        If it has no state any more; what was reached is written.
    """
    if request.report is not None:
        request.need_no_waveform()
        _write_page(reporter, request, request.report)
        return
    waveform, until, times = request.required_waveform(), request.end_us, request.times_us
    outputs = request.outputs(request.probe, request.waveform)
    outputs.folder(request.fields)
    lever = make_lever(reporter, request.read_probe(reporter))
    failure: HistoryEndError | None = None
    # figures and rise times are of smooth curves, the table of the steps alone
    per_step = _CURVE if times is None else 1
    kept_at: list[float] = []
    states: list[State] = []
    ends: list[State] = []
    told = count_up()
    with reporter.progress("pulse") as update:

        def keep(t: float, state: State) -> None:
            ends[1:] = [state]
            if next(told) % per_step == 0 and request.fields is not None:
                kept_at.append(t)
                states.append(state)

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
        if request.output is not None:
            write_history(data, request.output)
        if data.sizes["time"]:
            draw(request.plot, lambda figures: figures.history_overview(curve))
        if request.fields is not None:
            write_fields_in_time(lever, kept_at, states, output_folder(request.fields))
    if request.output is None:
        reporter.give(history_csv(data))
    if failure is not None:
        raise failure


def _write_page(reporter: Reporter, request: PulseRequest, folder: Path) -> None:
    """Write the page of a lever in time."""
    from hotlever.report.transient_pages import transient_page

    outputs = Outputs(request.probe)
    outputs.folder(folder)
    lever = make_lever(reporter, request.read_probe(reporter))
    with reporter.progress("sections") as update:
        page = transient_page(lever, update)
    with outputs.together():
        written = page.write(folder)
    reporter.give(f"{written}\n")


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
