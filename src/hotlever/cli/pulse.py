"""``hotlever pulse``: a lever in time, under a bias that changes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import count as count_up
from pathlib import Path
from typing import TYPE_CHECKING

from typer import Option

from hotlever.cli.application import app
from hotlever.cli.options import (
    DataOutput,
    File,
    MediumOption,
    PlotFile,
    ProbeFile,
    SettingsOption,
    check_medium,
    check_plot,
    load_probe,
    make_lever,
    with_groups,
)
from hotlever.cli.output import give, note, progress, tell_table
from hotlever.cli.waveforms import Drive
from hotlever.errors import HistoryEndError, InputError
from hotlever.files import Outputs, output_folder
from hotlever.units import setting

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever import Lever, State

#: Times that may be asked for; and points of a curve for each step of the solver.
MOST_TIMES, _CURVE = 10_000, 8


@app.command("pulse")
@with_groups
def pulse_command(
    drive: Drive,
    probe_file: ProbeFile = None,
    until: str | None = Option(None, metavar="TIME", help="When to stop."),
    at: str | None = Option(
        None, metavar="TIME,...", help="Times to report; where the solver stepped if left out."
    ),
    medium: MediumOption = None,
    settings: SettingsOption = None,
    output: DataOutput = None,
    plot: PlotFile = None,
    fields: File = Option(None, help="Write the fields as a series of VTU to this folder."),
    report: File = Option(
        None, help="Folder for a page of the lever in time; goes without a wave form."
    ),
) -> None:
    """Follow a lever in time: steps, pulses, ramps, sines, or what a file says."""
    from hotlever.lever.transient import history_csv, simulate, with_times, write_history

    if report is not None:
        others = {**drive.options, "--until": until, "--at": at}
        others |= {"--output": output, "--plot": plot, "--fields": fields}
        _report(report, others, probe_file, medium, settings)
        return
    wave = drive.need()
    end = None if until is None else setting(until, "us", "--until")
    times = None if at is None else [setting(one, "us", "--at") for one in at.split(",")]
    if times is not None and len(times) > MOST_TIMES:
        raise InputError(f"--at: found {len(times)} times, expected at most {MOST_TIMES}")
    check_medium(medium)
    outputs = Outputs(probe_file, drive.waveform)
    outputs.file(output, ".csv", ".nc")
    check_plot(outputs, plot)
    outputs.folder(fields)
    probe = load_probe(probe_file, settings, medium)
    failure: HistoryEndError | None = None
    # figures and rise times are of smooth curves, the table of the steps alone
    per_step = _CURVE if times is None else 1
    states: list[tuple[float, State]] = []
    ends: list[State] = []
    told = count_up()
    lever = make_lever(probe)
    with progress("pulse") as update:

        def keep(t: float, state: State) -> None:
            ends[1:] = [state]
            if next(told) % per_step == 0 and fields is not None:
                states.append((t, state))

        try:
            curve = simulate(
                lever, wave, end, times, per_step=per_step, progress=update, callback=keep
            )
        except HistoryEndError as error:
            curve, failure = error.partial, error
    if ends:
        curve = with_times(curve, ends[0], ends[-1], resolved=times is None)
    data = curve.isel(time=slice(None, None, per_step))
    note(*filter(None, data.attrs["notes"].split("\n")))
    tell_table(_times(data))
    with outputs.together():
        if output is not None:
            write_history(data, output)
        if plot is not None and data.sizes["time"]:
            from hotlever import figures

            figures.save_figure(figures.history_overview(curve), plot)
        if fields is not None:
            _write_fields(lever, states, output_folder(fields))
    if output is None:
        give(history_csv(data))
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
            listed = ", ".join(f"{one:.3g}" for one in constants)
            rows.append([f"time constants at the {name}", f"{listed} µs"])
    return rows


def _report(
    folder: Path,
    others: Mapping[str, object],
    probe_file: Path | None,
    medium: str | None,
    settings: list[str] | None,
) -> None:
    """Write the page of a lever in time."""
    from hotlever.report.transient_pages import transient_page

    given = [name for name, value in others.items() if value is not None]
    if given:
        raise InputError(f"{given[0]}: does not go with --report, which has wave forms of its own")
    check_medium(medium)
    outputs = Outputs(probe_file)
    outputs.folder(folder)
    lever = make_lever(load_probe(probe_file, settings, medium))
    with progress("sections") as update:
        page = transient_page(lever, update)
    with outputs.together():
        written = page.write(folder)
    give(f"{written}\n")


def _write_fields(lever: Lever, states: list[tuple[float, State]], folder: Path) -> None:
    """Write the fields of states in time to a folder, with their index."""
    from hotlever.lever.fields import FieldMapper, write_pvd, write_vtu

    mapper = FieldMapper(lever)
    names = [f"fields_{place:04d}.vtu" for place in range(len(states))]
    for name, (_, state) in zip(names, states, strict=True):
        write_vtu(mapper.map(state), folder / name)
    write_pvd([t for t, _ in states], names, folder / "fields.pvd")
