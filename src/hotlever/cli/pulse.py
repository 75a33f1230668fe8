"""``hotlever pulse``: a lever in time, under a bias that changes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from typer import Option

from hotlever.cli import output as terminal
from hotlever.cli.application import app
from hotlever.cli.options import (
    DataOutput,
    File,
    MediumOption,
    PlotFile,
    ProbeFile,
    SettingsOption,
    check_medium,
    load_probe,
    make_lever,
    with_groups,
)
from hotlever.cli.waveforms import Drive
from hotlever.errors import InputError
from hotlever.files import Outputs
from hotlever.units import setting

#: Times that may be asked for.
MOST_TIMES = 10_000


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
    from hotlever.tasks.simulating import Files, simulate_in_time

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
    files = Files(output, plot, fields).checked(outputs)
    lever = make_lever(load_probe(probe_file, settings, medium))
    simulate_in_time(terminal, lever, wave, end, times, outputs, files)


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
    with terminal.progress("sections") as update:
        page = transient_page(lever, update)
    with outputs.together():
        written = page.write(folder)
    terminal.give(f"{written}\n")
