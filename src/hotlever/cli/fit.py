"""``hotlever fit``: material parameters from measurements."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hotlever.cli.app import app, fail, note, progress, progress_bars, stdout
from hotlever.cli.options import check_medium, check_output, load_probe, parse_fixed
from hotlever.errors import ComputationError, InputError
from hotlever.probe import Probe


@app.command()
def fit(
    data: Annotated[
        list[Path],
        typer.Argument(metavar="DATA.csv...", help="Measurement files, one for each lever."),
    ],
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
    medium: Annotated[str, typer.Option(help="vacuum.")] = "vacuum",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="Fit file (JSON); a folder of them with several data files."
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Write a page with figures to this folder.")
    ] = None,
    processes: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Local processes for several data files; one for each processor if left out.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Dask scheduler for several data files, as tcp://HOST:8786."
        ),
    ] = None,
) -> None:
    """Find the material parameters that make the model match a measurement.

    With several data files: of each lever, in parallel, and how the levers scatter. The same
    command again goes on where it was stopped.
    """
    check_medium(medium)
    fixed = parse_fixed(fix or [])
    chosen = None if observables is None else tuple(observables.split(","))
    if len(data) > 1:
        if processes is not None and scheduler is not None:
            raise InputError("--processes and --scheduler: expected one of them, not both")
        probe = load_probe(probe_file)
        _fit_several(data, probe, chosen, fixed, robust, output, report, processes, scheduler)
    else:
        check_output(output)
        _fit_one(data[0], probe_file, chosen, fixed, robust, output, report)


def _fit_one(
    data: Path,
    probe_file: Path | None,
    observables: tuple[str, ...] | None,
    fixed: dict[str, float | None],
    robust: bool,
    output: Path | None,
    report: Path | None,
) -> None:
    from hotlever.fitting import fit as run_fit
    from hotlever.fitting import read_measurement
    from hotlever.report.fit_report import fit_page, fit_text

    measurement = read_measurement(data)
    for column in measurement.ignored:
        note(f"{data}: column '{column}' is not used")
    probe = load_probe(probe_file)
    with progress("fit") as update:
        result = run_fit(
            measurement,
            probe,
            observables=observables,
            fixed=fixed,
            robust=robust,
            progress=update,
        )
    for text in result.notes:
        note(text)
    stdout.print(fit_text(result), markup=False)
    if output is not None:
        result.write(output)
    if report is not None:
        stdout.print(f"report: {fit_page(result).write(report)}", markup=False)


def _fit_several(
    data: list[Path],
    probe: Probe,
    observables: tuple[str, ...] | None,
    fixed: dict[str, float | None],
    robust: bool,
    output: Path | None,
    report: Path | None,
    processes: int | None,
    scheduler: str | None,
) -> None:
    from hotlever.files import write_text
    from hotlever.fitting.batch import FitRequest, fit_many
    from hotlever.fitting.levers import compare_levers, levers_csv
    from hotlever.report.levers_report import levers_page, levers_text

    if output is None and report is None:
        raise InputError(
            f"{len(data)} data files: expected -o FOLDER or --report DIR to write their fits to"
        )
    folder = output or Path(str(report), "fits")
    done = 0

    with progress_bars("levers", "geometry") as (fitting, reducing):

        def update(count: int, total: int) -> None:
            nonlocal done
            done = count
            fitting(count, total)

        try:
            batch = fit_many(
                data,
                folder,
                FitRequest(probe, observables, fixed, robust),
                processes=processes,
                scheduler=scheduler,
                reducing=reducing,
                progress=update,
            )
        except KeyboardInterrupt:
            raise ComputationError(
                f"stopped by the user after {done} of {len(data)} files; the same command goes "
                "on from there"
            ) from None
    if batch.reused:
        note(f"{batch.reused} of {len(data)} levers were fitted before, from the same data")
    if batch.fits:
        table = compare_levers({name: one.content for name, one in batch.fits.items()})
        stdout.print(levers_text(table), markup=False)
        write_text(folder / "levers.csv", levers_csv(table))
        if report is not None:
            stdout.print(f"report: {levers_page(batch).write(report)}", markup=False)
    for error in batch.failures.values():
        fail(str(error))
    raise typer.Exit(batch.exit_status)
