"""Fits of measurement files, of one lever or many."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimation import FitOptions, Measurement, fit
from hotlever.estimation.batch import Batch, fit_many
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.levers import compare_levers, levers_csv, levers_text
from hotlever.estimation.summary import fit_text
from hotlever.estimation.uncertainty import Uncertainty, examine
from hotlever.files import write_text
from hotlever.measurement import read_measurement_of
from hotlever.probe import Probe
from hotlever.tasks.measured_requests import FitRequest
from hotlever.tasks.probes import read_probe
from hotlever.tasks.reporter import Reporter

#: Points of a curve that is shown while the fit goes on.
_DRAWN = 200
#: The table of many levers, in the folder of their fits.
LEVERS_TABLE = "levers.csv"


def fit_files(reporter: Reporter, request: FitRequest) -> int:
    """Fit one lever or many; return the exit status.

    Raises
    ------
    ComputationError
        If no lever shows the data of a single one; what the search ended at is written.
    """
    request.check()
    probe = request.with_physics(read_probe(reporter, request.probe))
    options, columns = request.options(probe), request.columns
    if len(request.data) > 1:
        return _fit_several(reporter, request, probe, options, columns).exit_status
    _fit_one(reporter, request, probe, options, columns)
    return 0


def _fit_one(
    reporter: Reporter,
    request: FitRequest,
    probe: Probe,
    options: FitOptions,
    columns: dict[str, str],
) -> None:
    outputs, (data,), waveform = request.outputs(), request.data, request.read_waveform()
    samples = request.samples if request.posterior else None
    outputs.file(request.output, ".json")
    outputs.folder(request.report)
    measurement = read_measurement_of(probe, data, columns, waveform)
    if samples or request.profiles:
        measurement.need_rest("--posterior" if samples else "--profiles")
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes)
    with reporter.progress("fit") as update:
        seen = partial(_show_curve, reporter)
        result = fit(measurement, probe, options, progress=update, seen=seen)
    reporter.note(*result.notes)
    texts = [fit_text(result)]
    uncertainty: Uncertainty | None = None
    failure: HotleverError | KeyboardInterrupt | None = None
    if not result.describes_data and (samples or request.profiles):
        reporter.note("no posterior and no profiles of a lever that does not show these data")
    elif samples or request.profiles:
        try:
            labels = "profiles", "posterior", "band"
            with reporter.progress_bars(*labels) as (profiling, sampling, banding):
                bars: Any = {"profiling": profiling, "sampling": sampling, "banding": banding}
                asked: Any = {"profiles": request.profiles, "processes": request.processes}
                uncertainty = examine(result, samples=samples, **asked, **bars)
            reporter.note(*uncertainty.statements())
            texts.append(uncertainty.text())
        except (HotleverError, KeyboardInterrupt) as error:
            # the fit is there; what ends this is said when it is written
            failure = error
    with outputs.together():
        if request.output is not None:
            write_text(request.output, (uncertainty or result).to_json())
        if request.report is not None:
            from hotlever.report.fit_pages import fit_page

            texts.append(f"report: {fit_page(result, uncertainty).write(request.report)}")
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


def _fit_several(
    reporter: Reporter,
    request: FitRequest,
    probe: Probe,
    options: FitOptions,
    columns: dict[str, str],
) -> Batch:
    """Fit many levers in parallel, and compare them.

    The same again goes on where it was stopped.
    """
    data, output, report = request.data, request.output, request.report
    outputs, scheduler = request.outputs(), request.scheduler
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

        where: Any = {"processes": request.processes, "scheduler": scheduler}
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
