"""``hotlever fit``: material parameters from measurements."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from hotlever.cli.app import app, fail, note, progress, progress_bars, stdout
from hotlever.cli.options import MediumOption, check_medium, check_output, load_probe, parse_fixed
from hotlever.errors import ComputationError, HotleverError, InputError, unknown_name
from hotlever.files import write_text

if TYPE_CHECKING:
    from hotlever.fitting import Fit
    from hotlever.fitting.least_squares import Weights
    from hotlever.fitting.uncertainty import Uncertainty


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
    drift: Annotated[
        bool, typer.Option("--drift", help="Let the zeros of I_h and V_r drift along the file.")
    ] = False,
    weights: Annotated[
        str,
        typer.Option(help="maximum: of each observable, as in the paper; or errors, as measured."),
    ] = "maximum",
    medium: MediumOption = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="Fit file (JSON); a folder of them with several data files."
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Write a page with figures to this folder.")
    ] = None,
    posterior: Annotated[
        bool,
        typer.Option("--posterior", help="Sample the posterior; predict the tip with its band."),
    ] = False,
    samples: Annotated[int, typer.Option(metavar="N", help="Of the posterior, at least.")] = 10_000,
    profiles: Annotated[
        bool, typer.Option("--profiles", help="Profile the likelihood of each parameter.")
    ] = False,
    processes: Annotated[
        int | None,
        typer.Option(metavar="N", help="Local processes; one for each processor if left out."),
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
    for name, number in (("samples", samples), ("processes", processes)):
        if number is not None and number < 1:
            raise InputError(f"--{name} {number}: expected 1 or more")
    if processes is not None and scheduler is not None:
        raise InputError("--processes and --scheduler: expected one of them, not both")
    request = _Request(
        probe_file,
        None if observables is None else tuple(observables.split(",")),
        parse_fixed(fix or []),
        robust,
        drift,
        _weights(weights),
        medium,
    )
    if len(data) > 1:
        if posterior or profiles:
            raise InputError("--posterior and --profiles: expected a single data file")
        _fit_several(data, request, output, report, processes, scheduler)
    else:
        if scheduler is not None:
            raise InputError("--scheduler: expected several data files")
        check_output(output)
        examination = _Examination(samples if posterior else None, profiles, processes)
        _fit_one(data[0], request, output, report, examination)


@dataclass(frozen=True)
class _Request:
    """What is asked of each fit."""

    probe_file: Path | None
    observables: tuple[str, ...] | None
    fixed: dict[str, float | None]
    robust: bool
    drift: bool
    weights: Weights
    medium: str | None


def _weights(name: str) -> Weights:
    if name not in ("maximum", "errors"):
        raise unknown_name("weights", name, ("maximum", "errors"))
    return cast("Weights", name)


@dataclass(frozen=True)
class _Examination:
    """What is asked about the uncertainty of one fit."""

    samples: int | None
    profiles: bool
    processes: int | None


def _fit_one(
    data: Path,
    request: _Request,
    output: Path | None,
    report: Path | None,
    examination: _Examination,
) -> None:
    from hotlever.fitting import fit as run_fit
    from hotlever.fitting import read_measurement
    from hotlever.report.fit_report import fit_page, fit_text

    measurement = read_measurement(data)
    for column in measurement.ignored:
        note(f"{data}: column '{column}' is not used")
    probe = load_probe(request.probe_file)
    with progress("fit") as update:
        result = run_fit(
            measurement,
            probe,
            observables=request.observables,
            fixed=request.fixed,
            robust=request.robust,
            drift=request.drift,
            weights=request.weights,
            medium=request.medium,
            progress=update,
        )
    for text in result.notes:
        note(text)
    stdout.print(fit_text(result), markup=False)
    if output is not None:
        result.write(output)
    found, failure = None, None
    if examination.samples is not None or examination.profiles:
        try:
            found = _examine(result, examination)
        except HotleverError as error:
            failure = error
    if found is not None and output is not None:
        write_text(output, found.to_json())
    if report is not None:
        from hotlever.report.uncertainty_report import add_uncertainty

        page = fit_page(result)
        if found is not None:
            add_uncertainty(page, found)
        stdout.print(f"report: {page.write(report)}", markup=False)
    if failure is not None:
        raise failure


def _examine(result: Fit, examination: _Examination) -> Uncertainty:
    """Sample and profile, with progress; print what was found."""
    from dask.system import CPU_COUNT

    from hotlever.fitting.uncertainty import examine
    from hotlever.report.uncertainty_report import uncertainty_text

    with progress_bars("profiles", "posterior", "band") as (profiling, sampling, banding):
        found = examine(
            result,
            samples=examination.samples,
            profiles=examination.profiles,
            processes=examination.processes or CPU_COUNT,
            sampling=sampling,
            banding=banding,
            profiling=profiling,
        )
    for text in found.statements():
        note(text)
    stdout.print(uncertainty_text(found), markup=False)
    return found


def _fit_several(
    data: list[Path],
    request: _Request,
    output: Path | None,
    report: Path | None,
    processes: int | None,
    scheduler: str | None,
) -> None:
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
                FitRequest(
                    load_probe(request.probe_file),
                    request.observables,
                    request.fixed,
                    request.robust,
                    request.drift,
                    request.weights,
                    request.medium,
                ),
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
