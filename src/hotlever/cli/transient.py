"""``hotlever pulse`` and ``hotlever spectrum``: a lever in time, and under small signals."""

from __future__ import annotations

from pathlib import Path

from typer import Option

from hotlever.cli import output as terminal
from hotlever.cli.commands import app
from hotlever.cli.options import (
    Drive,
    File,
    LeverOptions,
    TableOptions,
    parse_frequencies,
    with_groups,
)
from hotlever.errors import InputError
from hotlever.files import Outputs
from hotlever.tasks.files import Files, draw
from hotlever.tasks.probes import make_lever
from hotlever.units import bias_setting, setting

#: Times that may be asked for.
MOST_TIMES = 10_000


@app.command("pulse")
@with_groups
def pulse_command(
    drive: Drive,
    options: LeverOptions,
    table: TableOptions,
    until: str | None = Option(None, metavar="TIME", help="When to stop."),
    at: str | None = Option(
        None, metavar="TIME,...", help="Times to report; where the solver stepped if left out."
    ),
    fields: File = Option(None, help="Write the fields as a series of VTU to this folder."),
    report: File = Option(
        None, help="Folder for a page of the lever in time; goes without a wave form."
    ),
) -> None:
    """Follow a lever in time: steps, pulses, ramps, sines, or what a file says."""
    from hotlever.tasks.simulating import simulate_in_time

    if report is not None:
        others = {"--until": until, "--at": at, "--output": table.output, "--plot": table.plot}
        others |= {"--fields": fields}
        for name in (*drive.options, *(name for name, value in others.items() if value)):
            raise InputError(f"{name}: does not go with --report, which has wave forms of its own")
        _report(report, options)
        return
    waveform = drive.required()
    end = None if until is None else setting(until, "us", "--until")
    times = None if at is None else [setting(time, "us", "--at") for time in at.split(",")]
    if times is not None and len(times) > MOST_TIMES:
        raise InputError(f"--at: found {len(times)} times, expected at most {MOST_TIMES}")
    outputs = table.outputs(options.probe_file, drive.waveform)
    outputs.folder(fields)
    lever = make_lever(terminal, options.probe())
    files = Files(table.output, table.plot, fields)
    simulate_in_time(terminal, lever, waveform, end, times, outputs, files)


@app.command("spectrum")
@with_groups
def spectrum_command(
    options: LeverOptions,
    table: TableOptions,
    bias: str = Option(..., metavar="V", help="Of the operating point."),
    frequency: str = Option(
        "1Hz:10MHz:71", metavar="START:STOP:COUNT", help="Spaced evenly in the logarithm."
    ),
    amplitude: str | None = Option(
        None, metavar="V", help="Of a sine about the bias: harmonics of V_l instead (3ω method)."
    ),
) -> None:
    """Show impedance and thermal response to small signals at a bias, or harmonics."""
    from hotlever.datasets import csv_text, write_dataset
    from hotlever.lever.transient.frequency_domain import (
        HARMONIC_COLUMNS,
        SPECTRUM_COLUMNS,
        harmonics,
        spectrum,
    )

    swing = None if amplitude is None else bias_setting(amplitude, "--amplitude")
    volts, frequencies = bias_setting(bias, "--bias"), parse_frequencies(frequency)
    outputs = table.outputs(options.probe_file)
    lever = make_lever(terminal, options.probe())
    with terminal.progress("spectrum") as update:
        if swing is None:
            (state,) = lever.solve([volts], update)
            data = spectrum(state, frequencies)
        else:
            data = harmonics(lever, volts, swing, frequencies, update)
    columns = SPECTRUM_COLUMNS if swing is None else HARMONIC_COLUMNS
    with outputs.together():
        if table.output is not None:
            write_dataset(data, table.output, columns)
        draw(
            table.plot,
            lambda figures: (figures.small_signals if swing is None else figures.harmonics)(data),
        )
    if table.output is None:
        terminal.give(csv_text(data, columns))


def _report(folder: Path, options: LeverOptions) -> None:
    """Write the page of a lever in time."""
    from hotlever.report.transient_pages import transient_page

    outputs = Outputs(options.probe_file)
    outputs.folder(folder)
    lever = make_lever(terminal, options.probe())
    with terminal.progress("sections") as update:
        page = transient_page(lever, update)
    with outputs.together():
        written = page.write(folder)
    terminal.give(f"{written}\n")
