"""``hotlever calibrate``: the tip temperature of one lever from its I-V curve."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hotlever.cli.app import app, note, progress, stdout
from hotlever.cli.options import MediumOption, check_medium, check_output, load_probe
from hotlever.errors import InputError
from hotlever.files import write_text


@app.command()
def calibrate(
    data: Annotated[
        Path, typer.Argument(metavar="IV.csv", help="Measurement file with V_b and I_h.")
    ],
    fit_file: Annotated[
        Path | None, typer.Option("--fit", help="A fit of this lever (hotlever fit -o).")
    ] = None,
    probe_file: Annotated[
        Path | None,
        typer.Option("--probe", help="Probe like this lever; the reference probe if left out."),
    ] = None,
    power_law: Annotated[
        Path | None,
        typer.Option("--power-law", help="Power law in vacuum (JSON), or a calibration file."),
    ] = None,
    medium: MediumOption = None,
    tolerance: Annotated[
        float, typer.Option(help="Relative standard error of the lever's dimensions.")
    ] = 0.05,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Calibration file (JSON).")
    ] = None,
    table: Annotated[
        Path | None, typer.Option(help="Write the table for an instrument to this CSV file.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw to this file: .png, .svg or .pdf.")
    ] = None,
) -> None:
    """Find the tip temperature of a lever from its I-V curve, with its error."""
    from hotlever.calibration.budget import Tolerances
    from hotlever.calibration.calibrate import calibrate as run_calibration
    from hotlever.calibration.power_law import read_power_law
    from hotlever.fitting import read_measurement
    from hotlever.fitting.fit_file import read_fit
    from hotlever.report.calibration_report import calibration_figure, calibration_text
    from hotlever.report.style import FIGURE_TYPES, save_figure

    given = {"--fit": fit_file, "--probe": probe_file, "--power-law": power_law}
    several = [name for name, path in given.items() if path is not None]
    if len(several) > 1:
        raise InputError(f"{' and '.join(several)}: expected at most one of {', '.join(given)}")
    check_medium(medium)
    check_output(output)
    check_output(table, ".csv")
    check_output(plot, *FIGURE_TYPES)
    measurement = read_measurement(data)
    if "current" not in measurement.observables:
        raise InputError(f"{data}: no values of I_h, which a calibration needs beside V_b")
    probe = None if probe_file is None else load_probe(probe_file)
    fit = None if fit_file is None else read_fit(fit_file)
    law = None if power_law is None else read_power_law(power_law)
    tolerances = Tolerances(geometry=tolerance)
    with progress("calibrate") as update:
        result = run_calibration(
            measurement,
            probe=probe,
            fit=fit,
            law=law,
            medium=medium,
            tolerances=tolerances,
            progress=update,
        )
    for text in result.notes:
        note(text)
    stdout.print(calibration_text(result), markup=False)
    if output is not None:
        result.write(output)
    if table is not None:
        write_text(table, result.table_csv())
    if plot is not None:
        save_figure(calibration_figure(result), plot)
