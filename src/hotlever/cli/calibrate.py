"""``hotlever calibrate``: the tip temperature of one lever from its I-V curve."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from typer import Argument, Option

from hotlever.cli.application import app
from hotlever.cli.options import (
    ColumnOption,
    File,
    MeasuredMediumOption,
    PlotFile,
    PriorOption,
    check_medium,
    check_plot,
    column_files,
    load_probe,
    parse_priors,
)
from hotlever.cli.output import give, note, progress, tell_table
from hotlever.errors import ComputationError, InputError
from hotlever.files import Outputs, write_text
from hotlever.units import setting

if TYPE_CHECKING:
    from hotlever.calibration.pulses import PulseTiming


@app.command("calibrate")
def calibrate_command(
    data: Path = Argument(metavar="IV.csv", help="Measurement file with V_b and I_h."),
    fit_file: File = Option(None, "--fit", help="A fit of this lever (hotlever fit -o)."),
    probe_file: File = Option(
        None, "--probe", help="Probe like this lever; the reference probe if left out."
    ),
    power_law: File = Option(None, help="Power law in vacuum (JSON), or a calibration file."),
    column: ColumnOption = None,
    medium: MeasuredMediumOption = None,
    prior: PriorOption = None,
    pulse: str | None = Option(
        None, metavar="TIME[,PERIOD]", help="Calibrate a pulse too, such as 5us or 5us,100us."
    ),
    posterior: bool = Option(
        False, "--posterior", help="Take the limits from samples of the posterior."
    ),
    samples: int = Option(4_000, metavar="N", min=1, help="Of the posterior, at least."),
    output: File = Option(None, "-o", "--output", help="Calibration file (JSON)."),
    table: File = Option(
        None, help="Write the table for an instrument, or for its pulses, to this CSV file."
    ),
    plot: PlotFile = None,
) -> None:
    """Find the tip temperature of a lever from its I-V curve, with its error."""
    from hotlever.calibration.power_law import read_power_law
    from hotlever.calibration.procedure import calibrate
    from hotlever.calibration.summary import calibration_text
    from hotlever.estimation import read_fit, read_measurement
    from hotlever.estimation.options import UNKNOWN_MEDIUM
    from hotlever.measurement import parse_columns

    given = {"--fit": fit_file, "--probe": probe_file, "--power-law": power_law}
    several = [name for name, path in given.items() if path is not None]
    if len(several) > 1:
        raise InputError(f"{' and '.join(several)}: expected at most one of {', '.join(given)}")
    check_medium(medium, UNKNOWN_MEDIUM)
    timing = None if pulse is None else _timing(pulse)
    columns = parse_columns(column or [])
    outputs = Outputs(data, *given.values(), *column_files(column))
    outputs.file(output)
    outputs.file(table, ".csv")
    check_plot(outputs, plot)
    fit = None if fit_file is None else read_fit(fit_file)
    probe = load_probe(probe_file) if fit is None else fit.probe
    priors = parse_priors(prior, probe)
    measurement = read_measurement(data, columns, probe.circuit)
    tell_table(measurement.understood)
    note(*measurement.notes)
    if "current" not in measurement.observables:
        raise InputError(f"{data}: no values of I_h, which a calibration needs beside V_b")
    with progress("calibrate") as update:
        result = calibrate(
            measurement,
            probe=probe if fit is None and power_law is None else None,
            fit=fit,
            law=None if power_law is None else read_power_law(power_law),
            medium=medium,
            priors=priors,
            pulse=timing,
            samples=samples if posterior else 0,
            progress=update,
        )
    note(*result.notes)
    with outputs.together():
        if output is not None:
            result.write(output)
        if table is not None:
            write_text(table, result.table_csv())
        if plot is not None:
            from hotlever import figures

            figures.save_figure(figures.calibration_curves(result), plot)
    give(calibration_text(result) + "\n")
    if not result.describes_data:
        raise ComputationError(f"{data}: {result.doubt}")


def _timing(text: str) -> PulseTiming:
    """Parse ``5us`` or ``5us,100us``.

    Examples
    --------
    >>> _timing("5us,0.1ms")
    PulseTiming(length_us=5.0, period_us=100.0)
    """
    from hotlever.calibration.pulses import PulseTiming

    length, comma, period = text.partition(",")
    each = setting(period, "us", "--pulse") if comma else None
    try:
        return PulseTiming(setting(length, "us", "--pulse"), each)
    except InputError as error:
        raise error if str(error).startswith("--") else InputError(f"--pulse: {error}") from None
