"""``hotlever fit``: material parameters from a measurement."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hotlever.cli.app import app, note, progress, stdout
from hotlever.cli.options import MediumOption, check_medium, check_output, load_probe, parse_fixed


@app.command()
def fit(
    data: Annotated[Path, typer.Argument(metavar="DATA.csv", help="Measurement file.")],
    probe_file: Annotated[
        Path | None, typer.Option("--probe", help="Probe file; the reference probe if left out.")
    ] = None,
    observables: Annotated[
        str | None,
        typer.Option(help="Some of current,reader,tip; all that the file has if left out."),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option("--fix", metavar="NAME[=VALUE]", help="Hold a parameter."),
    ] = None,
    robust: Annotated[
        bool, typer.Option("--robust", help="Lessen the weight of points far off the others.")
    ] = False,
    medium: MediumOption = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Fit file (JSON).")] = None,
    report: Annotated[
        Path | None, typer.Option(help="Write a page with figures to this folder.")
    ] = None,
) -> None:
    """Find the material parameters that make the model match a measurement."""
    from hotlever.fitting import fit as run_fit
    from hotlever.fitting import read_measurement
    from hotlever.report.fit_report import fit_page, fit_text

    check_medium(medium)
    check_output(output)
    fixed = parse_fixed(fix or [])
    measurement = read_measurement(data)
    for column in measurement.ignored:
        note(f"{data}: column '{column}' is not used")
    probe = load_probe(probe_file)
    with progress("fit") as update:
        result = run_fit(
            measurement,
            probe,
            observables=None if observables is None else observables.split(","),
            fixed=fixed,
            robust=robust,
            medium=medium,
            progress=update,
        )
    for text in result.notes:
        note(text)
    stdout.print(fit_text(result), markup=False)
    if output is not None:
        result.write(output)
    if report is not None:
        stdout.print(f"report: {fit_page(result).write(report)}", markup=False)
