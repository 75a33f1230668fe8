"""``hotlever calibrate``: the tip temperature of one lever from its I-V curve."""

from __future__ import annotations

from pathlib import Path

from typer import Argument, Option

from hotlever.cli import output as terminal
from hotlever.cli.commands import app
from hotlever.cli.options import (
    ColumnOption,
    File,
    MeasuredMediumOption,
    PlotFile,
    PriorOption,
    check_medium,
    column_files,
)
from hotlever.errors import InputError
from hotlever.files import FIGURE_TYPES, Outputs
from hotlever.tasks.probes import read_probe
from hotlever.tasks.texts import parse_timing


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
    from hotlever.estimation.options import UNKNOWN_MEDIUM
    from hotlever.measurement import parse_columns
    from hotlever.tasks.calibrating import Tables, calibrate_file

    sources = {"--fit": fit_file, "--probe": probe_file, "--power-law": power_law}
    several = [name for name, path in sources.items() if path is not None]
    if len(several) > 1:
        raise InputError(f"{' and '.join(several)}: expected at most one of {', '.join(sources)}")
    check_medium(medium, UNKNOWN_MEDIUM)
    timing = None if pulse is None else parse_timing(pulse)
    columns = parse_columns(column or [])
    outputs = Outputs(data, *sources.values(), *column_files(column))
    outputs.file(output)
    outputs.file(table, ".csv")
    outputs.file(plot, *FIGURE_TYPES)
    calibrate_file(
        terminal,
        data,
        columns,
        read_probe(terminal, probe_file) if fit_file is None else None,
        fit_file,
        power_law,
        prior,
        outputs,
        Tables(output, table, plot),
        medium=medium,
        pulse=timing,
        samples=samples if posterior else 0,
    )
