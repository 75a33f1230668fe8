"""``hotlever spectrum``: what a lever answers to small signals at an operating point."""

from __future__ import annotations

from typing import TYPE_CHECKING

from typer import Option

from hotlever.cli.application import app
from hotlever.cli.options import (
    DataOutput,
    MediumOption,
    PlotFile,
    ProbeFile,
    SettingsOption,
    check_medium,
    check_plot,
    load_probe,
    make_lever,
)
from hotlever.cli.output import give, progress
from hotlever.errors import InputError, shown
from hotlever.files import Outputs
from hotlever.units import bias_setting, setting

if TYPE_CHECKING:
    from hotlever.types import Array

#: Frequencies that may be asked for.
MOST_FREQUENCIES = 10_000


@app.command("spectrum")
def spectrum_command(
    probe_file: ProbeFile = None,
    bias: str = Option(..., metavar="V", help="Of the operating point."),
    frequency: str = Option(
        "1Hz:10MHz:71", metavar="START:STOP:COUNT", help="Spaced evenly in the logarithm."
    ),
    amplitude: str | None = Option(
        None, metavar="V", help="Of a sine about the bias: harmonics of V_l instead (3ω method)."
    ),
    medium: MediumOption = None,
    settings: SettingsOption = None,
    output: DataOutput = None,
    plot: PlotFile = None,
) -> None:
    """Show impedance and thermal response to small signals at a bias, or harmonics."""
    from hotlever.datasets import csv_text, write_dataset
    from hotlever.lever.transient.sinusoidal import HARMONIC_COLUMNS, harmonics
    from hotlever.lever.transient.small_signals import SPECTRUM_COLUMNS, spectrum

    swing = None if amplitude is None else bias_setting(amplitude, "--amplitude")
    volts, frequencies = bias_setting(bias, "--bias"), _frequencies(frequency)
    check_medium(medium)
    outputs = Outputs(probe_file)
    outputs.file(output, ".csv", ".nc")
    check_plot(outputs, plot)
    lever = make_lever(load_probe(probe_file, settings, medium))
    with progress("spectrum") as update:
        if swing is None:
            (state,) = lever.solve([volts], update)
            data = spectrum(state, frequencies)
        else:
            data = harmonics(lever, volts, swing, frequencies, update)
    columns = SPECTRUM_COLUMNS if swing is None else HARMONIC_COLUMNS
    with outputs.together():
        if output is not None:
            write_dataset(data, output, columns)
        if plot is not None:
            from hotlever import figures

            draw = figures.small_signals if swing is None else figures.harmonics
            figures.save_figure(draw(data), plot)
    if output is None:
        give(csv_text(data, columns))


def _frequencies(text: str) -> Array:
    """Parse ``START:STOP:COUNT`` with units.

    Examples
    --------
    >>> _frequencies("1Hz:1kHz:4").round(6).tolist()
    [1.0, 10.0, 100.0, 1000.0]
    """
    import numpy as np

    where, parts = f"--frequency {shown(text)}", text.split(":")
    if len(parts) != 3:
        raise InputError(f"{where}: expected START:STOP:COUNT such as 1Hz:10MHz:71")
    start, stop = (setting(part, "Hz", where) for part in parts[:2])
    count = int(parts[2]) if parts[2].isdecimal() and len(parts[2]) < 9 else 0
    if not 1 <= count <= MOST_FREQUENCIES:
        raise InputError(f"{where}: expected a COUNT from 1 to {MOST_FREQUENCIES}")
    if not 0 < start <= stop or (count == 1) != (start == stop):
        raise InputError(f"{where}: expected 0 < START < STOP, or START = STOP with COUNT 1")
    return np.geomspace(start, stop, count)
