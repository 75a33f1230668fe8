"""Fits of measurement files, of one lever or many."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimation import FitOptions, Measurement, fit, read_measurement
from hotlever.estimation.batch import Batch, fit_many
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.levers import compare_levers, levers_csv, levers_text
from hotlever.estimation.summary import fit_text
from hotlever.estimation.uncertainty import Uncertainty, examine
from hotlever.files import Outputs, write_text
from hotlever.lever.transient import Waveform
from hotlever.probe import Probe
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.texts import USUAL, parse_number, parse_pairs, parse_priors

#: Points of a curve that is shown while the fit goes on.
_DRAWN = 200
#: The table of many levers, in the folder of their fits.
LEVERS_TABLE = "levers.csv"


class Destination(NamedTuple):
    """Where fits are written to: a file or a folder, and the folder of a page."""

    outputs: Outputs
    output: Path | None
    report: Path | None


def fit_options(
    probe: Probe,
    observables: str | None = None,
    fix: Sequence[str] | None = None,
    free: str | None = None,
    prior: Sequence[str] | None = None,
    **others: Any,
) -> FitOptions:
    """Return what a fit is asked, of what was typed."""
    usual = USUAL in (prior or [])
    given = parse_priors(prior, probe)
    stated = probe.stated_priors
    return FitOptions(
        observables=None if observables is None else observables.split(","),
        fixed={
            name: parse_number(text, f"--fix {name}") if text else None
            for name, text in parse_pairs("--fix", fix, bare=True).items()
        },
        priors=stated if given is None else {**stated, **given} if given or usual else {},
        usual_priors=usual,
        free=() if free is None else tuple(name.strip() for name in free.split(",")),
        **others,
    )


def fit_one(
    reporter: Reporter,
    data: Path,
    columns: dict[str, str],
    waveform: Waveform | None,
    probe: Probe,
    options: FitOptions,
    examined: dict[str, Any],
    to: Destination,
) -> None:
    """Fit one lever; `examined` are the options of `hotlever.estimation.uncertainty.examine`.

    Raises
    ------
    ComputationError
        If no lever shows these data; what the search ended at is written.
    """
    to.outputs.file(to.output)
    to.outputs.folder(to.report)
    measurement = read_measurement(data, columns, probe.circuit, waveform)
    if examined["samples"] or examined["profiles"]:
        measurement.need_rest("--posterior" if examined["samples"] else "--profiles")
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes)
    with reporter.progress("fit") as update:
        seen = partial(_show_curve, reporter)
        result = fit(measurement, probe, options, progress=update, seen=seen)
    reporter.note(*result.notes)
    texts = [fit_text(result)]
    uncertainty: Uncertainty | None = None
    failure: HotleverError | KeyboardInterrupt | None = None
    if not result.describes_data and (examined["samples"] or examined["profiles"]):
        reporter.note("no posterior and no profiles of a lever that does not show these data")
    elif examined["samples"] or examined["profiles"]:
        try:
            labels = "profiles", "posterior", "band"
            with reporter.progress_bars(*labels) as (profiling, sampling, banding):
                bars: Any = {"profiling": profiling, "sampling": sampling, "banding": banding}
                uncertainty = examine(result, **examined, **bars)
            reporter.note(*uncertainty.statements())
            texts.append(uncertainty.text())
        except (HotleverError, KeyboardInterrupt) as error:
            # the fit is there; what ends this is said when it is written
            failure = error
    with to.outputs.together():
        if to.output is not None:
            write_text(to.output, (uncertainty or result).to_json())
        if to.report is not None:
            from hotlever.report.fit_pages import fit_page

            texts.append(f"report: {fit_page(result, uncertainty).write(to.report)}")
    reporter.give("\n".join([*texts, ""]))
    if failure is not None:
        raise failure
    if not result.describes_data:
        raise ComputationError(f"{data}: {result.doubt}")


def _show_curve(reporter: Reporter, prediction: Prediction) -> None:
    """Show how near to the data the lever is that was found so far."""
    columns = prediction.columns
    along, *_ = columns.values()
    some = along.argsort()[:: max(1, along.size // _DRAWN)]
    reporter.show("curve", {name: values[some].tolist() for name, values in columns.items()})


def fit_several(
    reporter: Reporter,
    data: Sequence[Path],
    columns: dict[str, str],
    probe: Probe,
    options: FitOptions,
    to: Destination,
    **where: Any,
) -> Batch:
    """Fit many levers in parallel, and compare them; the same again goes on where it was stopped.

    `where` are the options ``processes`` and ``scheduler`` of `hotlever.estimation.batch.fit_many`.
    """
    outputs, output, report = to
    scheduler = where.get("scheduler")
    if scheduler is not None and _is_open(scheduler):
        reporter.note(
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
        outputs.file(folder / LEVERS_TABLE)
    done = 0
    with reporter.progress_bars("levers", "geometry") as (fitting, reducing):

        def update(count: int, total: int) -> None:
            nonlocal done
            done = count
            fitting(count, total)

        def read(measurement: Measurement) -> None:
            (name, *_, rows), *quantities = measurement.understood
            columns_read = "; ".join(f"{what} {value}" for what, value, _ in quantities)
            reporter.tell(f"{name}: {rows}; {columns_read}")
            reporter.note(*measurement.notes)

        bars: Any = {"reading": read, "reducing": reducing, "progress": update}
        try:
            batch = fit_many(data, folder, probe, options, columns=columns, **where, **bars)
        except KeyboardInterrupt:
            raise ComputationError(
                f"stopped by the user after {done} of {len(data)} files; the same command goes "
                "on from there"
            ) from None
    if batch.reused:
        count = len(batch.fits) + len(batch.failures)
        reporter.note(f"{batch.reused} of {count} levers were fitted before, from the same data")
    if batch.fits:
        table = compare_levers(batch.fits)
        texts = [levers_text(table)]
        with outputs.together():
            write_text(folder / LEVERS_TABLE, levers_csv(table))
            if report is not None:
                from hotlever.report.fit_pages import levers_page

                texts.append(f"report: {levers_page(batch).write(report)}")
        reporter.give("\n".join([*texts, ""]))
    for failure in (*map(str, batch.failures.values()), *batch.undescribed.values()):
        reporter.fail(failure)
    return batch


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
