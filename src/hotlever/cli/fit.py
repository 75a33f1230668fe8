"""``hotlever fit``: material parameters from measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer
from typer import Argument, Option

from hotlever.cli.application import app
from hotlever.cli.options import (
    USUAL,
    ColumnOption,
    File,
    MeasuredMediumOption,
    PriorOption,
    check_number,
    column_files,
    load_probe,
    parse_priors,
    parse_values,
    with_groups,
)
from hotlever.cli.output import fail, give, note, progress, progress_bars, show, tell, tell_table
from hotlever.cli.waveforms import Drive
from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.files import Outputs, write_text

if TYPE_CHECKING:
    from hotlever.estimation import FitOptions, Measurement
    from hotlever.estimation.experiment import Prediction
    from hotlever.estimation.uncertainty import Uncertainty
    from hotlever.lever.transient import Waveform
    from hotlever.probe import Probe

#: Points of a curve that is shown while the fit goes on.
_DRAWN = 200
#: The table of many levers, in the folder of their fits.
_TABLE = "levers.csv"


@app.command("fit")
@with_groups
def fit_command(
    drive: Drive,
    data: list[Path] = Argument(
        metavar="DATA.csv...", help="Measurement files, one for each lever."
    ),
    probe_file: File = Option(None, "--probe", help="Probe file; the reference probe if left out."),
    observables: str | None = Option(
        None, help="Some of current,reader,tip; all that the file has if left out."
    ),
    fix: list[str] | None = Option(None, metavar="NAME[=VALUE]", help="Hold a parameter."),
    free: str | None = Option(
        None,
        metavar="NAME[,...]",
        help="Vary more than is usual: any parameter of a material, as film.lorenz_ratio, or of "
        "the probe.",
    ),
    robust: bool = Option(
        False, "--robust", help="Lessen the weight of points far off the others."
    ),
    drift: bool = Option(
        False, "--drift", help="Let the zeros of I_h and V_r drift along the file."
    ),
    weights: str = Option(
        "maximum", help="maximum: of each observable, as in the paper; or errors, as measured."
    ),
    column: ColumnOption = None,
    prior: PriorOption = None,
    medium: MeasuredMediumOption = None,
    output: File = Option(
        None, "-o", "--output", help="Fit file (JSON); a folder of them with several data files."
    ),
    report: File = Option(None, help="Write a page with figures to this folder."),
    posterior: bool = Option(
        False, "--posterior", help="Sample the posterior; predict the tip with its band."
    ),
    samples: int = Option(10_000, metavar="N", help="Of the posterior, at least."),
    profiles: bool = Option(False, "--profiles", help="Profile the likelihood of each parameter."),
    processes: int | None = Option(
        None, metavar="N", help="Local processes; one for each processor if left out."
    ),
    scheduler: str | None = Option(
        None, metavar="ADDRESS", help="Dask scheduler for several data files, as tls://HOST:8786."
    ),
) -> None:
    """Find the material parameters that make the model match a measurement.

    Of what was measured in time, a file with a column as 'time (us)', the heat capacity, and what
    else is free; the wave form is the column V_b, or what is told.

    With several data files: of each lever, in parallel, and how the levers scatter. The same
    command again goes on where it was stopped.
    """
    from hotlever.estimation import FitOptions
    from hotlever.measurement import parse_columns

    check_number("--samples", samples, 1, 1_000_000)
    check_number("--processes", processes, 1, 256)
    if processes is not None and scheduler is not None:
        raise InputError("--processes and --scheduler: expected one of them, not both")
    if len(data) > 1 and (posterior or profiles):
        raise InputError("--posterior and --profiles: expected a single data file")
    if len(data) > 1 and drive.options:
        raise InputError(f"{next(iter(drive.options))}: expected a single data file")
    if len(data) == 1 and scheduler is not None:
        raise InputError("--scheduler: expected several data files")
    chosen: Any = {"weights": weights, "medium": medium, "robust": robust, "drift": drift}
    probe = load_probe(probe_file)
    usual = USUAL in (prior or [])
    given = parse_priors(prior, probe)
    stated = probe.stated_priors
    options = FitOptions(
        observables=None if observables is None else observables.split(","),
        fixed=parse_values("--fix", fix, bare=True),
        priors=stated if given is None else {**stated, **given} if given or usual else {},
        usual_priors=usual,
        free=() if free is None else tuple(name.strip() for name in free.split(",")),
        **chosen,
    )
    columns = parse_columns(column or [])
    outputs = Outputs(*data, probe_file, *column_files(column), drive.waveform)
    to = Destination(outputs, output, report)
    where: Any = {"processes": processes}
    if len(data) > 1:
        where |= {"scheduler": scheduler, "columns": columns}
        _fit_several(data, probe, options, where, to)
    else:
        asked = {"samples": samples if posterior else None, "profiles": profiles}
        _fit_one(data[0], columns, drive.read(), probe, options, where | asked, to)


class Destination(NamedTuple):
    """Where fits are written to."""

    outputs: Outputs
    output: File
    report: File


def _fit_one(
    data: Path,
    columns: dict[str, str],
    waveform: Waveform | None,
    probe: Probe,
    options: FitOptions,
    examined: dict[str, Any],
    to: Destination,
) -> None:
    from hotlever.estimation import fit, read_measurement
    from hotlever.estimation.words import fit_text, uncertainty_text

    to.outputs.file(to.output)
    to.outputs.folder(to.report)
    measurement = read_measurement(data, columns, probe.circuit, waveform)
    if examined["samples"] or examined["profiles"]:
        measurement.need_rest("--posterior" if examined["samples"] else "--profiles")
    tell_table(measurement.understood)
    note(*measurement.notes)
    with progress("fit") as update:
        result = fit(measurement, probe, options, progress=update, seen=_show_curve)
    note(*result.notes)
    texts = [fit_text(result)]
    found: Uncertainty | None = None
    failure: HotleverError | KeyboardInterrupt | None = None
    if not result.describes_data and (examined["samples"] or examined["profiles"]):
        note("no posterior and no profiles of a lever that does not show these data")
    elif examined["samples"] or examined["profiles"]:
        from hotlever.estimation.uncertainty import examine

        try:
            with progress_bars("profiles", "posterior", "band") as (profiling, sampling, banding):
                bars: Any = {"profiling": profiling, "sampling": sampling, "banding": banding}
                found = examine(result, **examined, **bars)
            note(*found.statements())
            texts.append(uncertainty_text(found))
        except (HotleverError, KeyboardInterrupt) as error:
            # the fit is there; what ends this is said when it is written
            failure = error
    with to.outputs.together():
        if to.output is not None:
            write_text(to.output, (found or result).to_json())
        if to.report is not None:
            from hotlever.report.fit_pages import fit_page

            texts.append(f"report: {fit_page(result, found).write(to.report)}")
    give("\n".join([*texts, ""]))
    if failure is not None:
        raise failure
    if not result.describes_data:
        raise ComputationError(f"{data}: {result.doubt}")


def _show_curve(prediction: Prediction) -> None:
    """Show how near to the data the lever is that was found so far."""
    columns = prediction.columns()
    along, *_ = columns.values()
    some = along.argsort()[:: max(1, along.size // _DRAWN)]
    show("curve", {name: values[some].tolist() for name, values in columns.items()})


def _fit_several(
    data: list[Path], probe: Probe, options: FitOptions, where: dict[str, Any], to: Destination
) -> None:
    from hotlever.estimation.batch import fit_many
    from hotlever.estimation.levers import compare_levers, levers_csv
    from hotlever.estimation.words import levers_text

    outputs, output, report = to
    scheduler = where["scheduler"]
    if scheduler is not None and _is_open(scheduler):
        note(
            f"--scheduler {scheduler}: without TLS whoever reaches this address can have its "
            "workers run any code"
        )
    if output is None and report is None:
        raise InputError(
            f"{len(data)} data files: expected -o FOLDER or --report DIR to write their fits to"
        )
    folder = output or Path(str(report), "fits")
    outputs.folder(folder)
    outputs.folder(report)
    if folder.is_dir():
        outputs.file(folder / _TABLE)
    done = 0
    with progress_bars("levers", "geometry") as (fitting, reducing):

        def update(count: int, total: int) -> None:
            nonlocal done
            done = count
            fitting(count, total)

        def show(measurement: Measurement) -> None:
            (name, *_, rows), *found = measurement.understood
            tell(f"{name}: {rows}; {'; '.join(f'{what} {value}' for what, value, _ in found)}")
            note(*measurement.notes)

        bars: Any = {"reading": show, "reducing": reducing, "progress": update}
        try:
            batch = fit_many(data, folder, probe, options, **where, **bars)
        except KeyboardInterrupt:
            raise ComputationError(
                f"stopped by the user after {done} of {len(data)} files; the same command goes "
                "on from there"
            ) from None
    if batch.reused:
        count = len(batch.fits) + len(batch.failures)
        note(f"{batch.reused} of {count} levers were fitted before, from the same data")
    if batch.fits:
        table = compare_levers(batch.fits)
        texts = [levers_text(table)]
        with outputs.together():
            write_text(folder / _TABLE, levers_csv(table))
            if report is not None:
                from hotlever.report.fit_pages import levers_page

                texts.append(f"report: {levers_page(batch).write(report)}")
        give("\n".join([*texts, ""]))
    for said in (*map(str, batch.failures.values()), *batch.undescribed.values()):
        fail(said)
    raise typer.Exit(batch.exit_status)


def _is_open(address: str) -> bool:
    """Whether anybody on the network who finds a scheduler may use it, and its workers.

    Examples
    --------
    >>> [_is_open(one) for one in ("tcp://node7:8786", "tls://node7:8786", "tcp://127.0.0.1:8786")]
    [True, False, False]
    """
    scheme, _, rest = address.rpartition("://")
    host = rest.rpartition(":")[0].strip("[]")
    return scheme != "tls" and not (host in ("localhost", "::1") or host.startswith("127."))
