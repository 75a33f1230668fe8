"""Fits and calibrations of measurement files, of one lever or many, and what to measure next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimate import (
    Calibration,
    Fit,
    FitOptions,
    fit,
    plan_next,
    read_calibration,
    read_fit,
)
from hotlever.estimate.batch import Batch, fit_many
from hotlever.estimate.calibration_summary import calibration_text
from hotlever.estimate.experiment import Prediction
from hotlever.estimate.fit_summary import (
    compare_levers,
    fit_text,
    lever_rows,
    levers_csv,
    statements,
    table_text,
)
from hotlever.estimate.levers import (
    Setting,
    calibrate_many,
    calibrations_csv,
    calibrations_text,
    compare_calibrations,
)
from hotlever.estimate.outcome import Result
from hotlever.estimate.power_law import read_power_law
from hotlever.estimate.procedure import calibrate
from hotlever.files import FOLDER, TABLE, check_outputs, write_text
from hotlever.measurement import Measurement, read_measurement_of
from hotlever.probe import Probe
from hotlever.tasks.measured_requests import CalibrateRequest, FitRequest, LeversRequest
from hotlever.tasks.planning_requests import NextRequest
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.shared import draw, read_probe
from hotlever.tasks.texts import parse_priors, parse_setting, parse_timing

if TYPE_CHECKING:
    from hotlever.estimate.uncertainty import Uncertainty
    from hotlever.report.page import Page

#: Points of a curve that is shown while a fit goes on.
_DRAWN = 200
#: The tables of many levers, in the folders of their fits or calibrations.
LEVERS_TABLE, CALIBRATIONS_TABLE = "levers.csv", "calibrations.csv"


def fit_files(reporter: Reporter, request: FitRequest) -> int:
    """Fit one lever or many; return the exit status.

    Raises
    ------
    ComputationError
        If no lever shows the data of a single one; what the search ended at is written.
    """
    request.check()
    probe = request.with_physics(read_probe(reporter, request.probe))
    options = request.options(probe)
    request.check_outputs()
    if not request.several:
        _fit_one(reporter, request, probe, options)
        return 0
    make = partial(fit_many, probe=probe, options=options)
    return _estimate_several(reporter, request, "fits", LEVERS_TABLE, make, _of_fits)


def _fit_one(reporter: Reporter, request: FitRequest, probe: Probe, options: FitOptions) -> None:
    (data,), waveform = request.data, request.read_waveform()
    measurement = read_measurement_of(probe, data, request.columns, waveform)
    analyses = [name for name in ("--posterior", "--profiles") if getattr(request, name[2:])]
    if analyses:
        measurement.need_rest(analyses[0])
    options.of(probe, in_time=measurement.time_us is not None)  # raises before anything is said
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes, *measurement.unused)
    with reporter.progress("fit") as update:
        seen = partial(_show_curve, reporter)
        result = fit(measurement, probe, options, progress=update, seen=seen)
    reporter.note(*result.notes)
    texts = [fit_text(result)]
    uncertainty: Uncertainty | None = None
    failure: HotleverError | KeyboardInterrupt | None = None
    if analyses and not result.describes_data:
        reporter.note("no posterior and no profiles of a lever that does not show these data")
    elif analyses:
        try:
            uncertainty = _examine(reporter, request, result)
            reporter.note(*uncertainty.statements())
            texts.append(uncertainty.text())
        except (HotleverError, KeyboardInterrupt) as error:
            # the fit is there; what ends this is said when it is written
            failure = error
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


def _examine(reporter: Reporter, request: FitRequest, result: Fit) -> Uncertainty:
    """Sample the posterior of a fit, and profile its parameters, as is asked."""
    from hotlever.estimate.uncertainty import examine  # brings scipy's statistics along

    with reporter.progress_bars("profiles", "posterior", "band") as (profiling, sampling, banding):
        return examine(
            result,
            samples=request.samples if request.posterior else None,
            profiles=request.profiles,
            processes=request.processes,
            profiling=profiling,
            sampling=sampling,
            banding=banding,
        )


def calibrate_files(reporter: Reporter, request: CalibrateRequest) -> int:
    """Calibrate one lever or many; return the exit status.

    Raises
    ------
    ComputationError
        If no lever shows the data of a single one; what the search ended at is written.
    """
    request.check()
    law = None if request.power_law is None else read_power_law(request.power_law)
    of_lever = None if request.fit is None else read_fit(request.fit)
    if of_lever is None:
        like = request.with_physics(read_probe(reporter, request.probe))
    else:
        like = of_lever.probe
    how: dict[str, Any] = {
        "probe": like if of_lever is None and law is None else None,
        "law": law,
        "priors": parse_priors(request.beforehand, like),
        "medium": request.medium,
        "budget_of": request.budget_of,
        "pulse": None if request.pulse is None else parse_timing(request.pulse),
        "samples": request.samples if request.posterior else 0,
    }
    at = None if request.at is None else Setting(*parse_setting(request.at))
    request.check_outputs()
    if request.several:
        make = partial(calibrate_many, **how)
        summarise = partial(_of_calibrations, at, request.table_options())
        names = "calibrations", CALIBRATIONS_TABLE
        return _estimate_several(reporter, request, *names, make, summarise)
    (data,) = request.data
    measurement = read_measurement_of(like, data, request.columns)
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes, *measurement.unused)
    with reporter.progress("calibrate") as update:
        at_V = None if at is None else at.value
        result = calibrate(measurement, fit=of_lever, at_V=at_V, progress=update, **how)
    reporter.note(*result.notes)
    texts = [calibration_text(result)]
    if request.output is not None:
        result.write(request.output)
    if request.table is not None:
        write_text(request.table, result.table_csv(**request.table_options()))
    draw(request.plot, lambda figures: figures.calibration_curves(result))
    if request.report is not None:
        texts.append(f"report: {_write_pages(result, request.report)}")
    reporter.give("\n".join([*texts, ""]))
    if not result.describes_data:
        raise ComputationError(f"{data}: {result.doubt}")
    return 0


def _write_pages(result: Calibration, folder: Path) -> Path:
    """Write the page of a calibration, and that of its uncertainty budget; return the former."""
    from hotlever.report.calibration_pages import budget_page, calibration_page

    page = calibration_page(result)
    if result.gum is not None:
        budget_page(result).write(folder, "budget")
        page.text("The whole uncertainty budget, as one sheet to print: budget.html.")
    return page.write(folder)


def propose(reporter: Reporter, request: NextRequest) -> None:
    """Say what to measure next, or first.

    Raises
    ------
    InputError
        If the data are not described, so that nothing follows from them.
    """
    request.check()
    choices = request.choices()
    request.check_outputs()
    beforehand: dict[str, Any] = {}
    if request.calibrated:
        assert request.data is not None
        beforehand["calibration"] = read_calibration(request.data)
    else:
        probe = request.with_physics(read_probe(reporter, request.probe))
        if request.data is not None:
            beforehand["calibration"] = _calibrated_first(reporter, request, request.data, probe)
        else:
            probe = probe if request.medium is None else probe.in_medium(request.medium)
            beforehand |= {"probe": probe, "priors": parse_priors(request.beforehand, probe)}
    with reporter.progress("next"):
        plan = plan_next(**beforehand, **choices)
    reporter.note(*plan.notes)
    if request.output is not None:
        write_text(request.output, plan.to_csv())
    draw(request.plot, lambda figures: figures.planned_measurements(plan))
    reporter.give(plan.text() + "\n")


def _calibrated_first(
    reporter: Reporter, request: NextRequest, data: Path, like: Probe
) -> Calibration:
    measurement = read_measurement_of(like, data, request.columns)
    reporter.note(*measurement.notes)
    priors = parse_priors(request.beforehand, like)
    with reporter.progress("calibrate") as update:
        result = calibrate(
            measurement, probe=like, priors=priors, medium=request.medium, progress=update
        )
    reporter.note(f"{data} was calibrated first, which a file of hotlever calibrate -o saves")
    return result


# --- many levers --------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Summary:
    """What is told of the results of a batch together.

    Attributes
    ----------
    text : str
    page : callable
        Makes the report page.
    files : dict of str to str
        Texts by the names of files beside the results.
    """

    text: str
    page: Callable[[], Page]
    files: dict[str, str] = field(default_factory=dict)


def _estimate_several(
    reporter: Reporter,
    request: LeversRequest,
    results: str,
    table: str,
    make: Callable[..., Batch[Result]],
    summarise: Callable[[Batch[Result]], _Summary],
) -> int:
    """Make a result of each of many measurements and compare them; return the exit status.

    The same again goes on where it was stopped.

    Parameters
    ----------
    reporter : Reporter
    request : LeversRequest
    results, table : str
        What the results are called, as their folder beside a page, and the table of all of them.
    make : callable
        Takes data files, a folder, and how they are worked on: see `estimate_many`.
    summarise : callable

    Raises
    ------
    InputError
        If nothing says where the results go.
    ComputationError
        If it is stopped.
    """
    data, output, report = request.data, request.output, request.report
    scheduler = request.scheduler
    if scheduler is not None and _is_open(scheduler):
        reporter.note(
            f"--scheduler {scheduler}: without TLS whoever reaches this address can have its "
            "workers run any code"
        )
    if output is None and report is None:
        raise InputError(
            f"{len(data)} data files: expected -o FOLDER or --report DIR to write their {results} "
            "to"
        )
    folder = output or Path(str(report), results)
    if output is None:
        check_outputs([(folder, FOLDER)])
    if folder.is_dir():
        check_outputs([(folder / table, (".csv",))], data)
    done = 0
    with reporter.progress_bars("levers", "geometry") as (estimating, reducing):

        def update(count: int, total: int) -> None:
            nonlocal done
            done = count
            estimating(count, total)

        def read(measurement: Measurement) -> None:
            (name, *_, rows), *quantities = measurement.understood
            columns_read = "; ".join(f"{what} {value}" for what, value, _ in quantities)
            reporter.tell(f"{name}: {rows}; {columns_read}")
            reporter.note(*measurement.notes, *measurement.unused)

        where: Any = {"processes": request.processes, "scheduler": scheduler}
        bars: Any = {"reading": read, "reducing": reducing, "progress": update}
        try:
            batch = make(data, folder, columns=request.columns, **where, **bars)
        except KeyboardInterrupt:
            raise ComputationError(
                f"stopped by the user after {done} of {len(data)} files; the same command goes "
                "on from there"
            ) from None
    if batch.reused:
        count = len(batch.results) + len(batch.failures)
        reporter.note(
            f"{batch.reused} of {count} levers have their {results} from before, of the same data"
        )
    if batch.results:
        summary = summarise(batch)
        texts = [summary.text]
        for name, text in summary.files.items():
            write_text(folder / name, text)
        if report is not None:
            texts.append(f"report: {summary.page().write(report)}")
        reporter.give("\n".join([*texts, ""]))
    for failure in (*map(str, batch.failures.values()), *batch.undescribed.values()):
        reporter.fail(failure)
    return batch.exit_status


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


def _of_fits(batch: Batch[Fit]) -> _Summary:
    from hotlever.report.fit_pages import levers_page

    table = compare_levers(batch.results)
    files = {LEVERS_TABLE: levers_csv(table)}
    text = table_text(lever_rows(table), statements(table))
    return _Summary(text, lambda: levers_page(batch), files)


def _of_calibrations(
    at: Setting | None, table: dict[str, Any], batch: Batch[Calibration]
) -> _Summary:
    levers = compare_calibrations(batch.results, at)
    files, without = {CALIBRATIONS_TABLE: calibrations_csv(levers, batch.failures)}, []
    for name, each in batch.results.items():
        try:
            files[f"{name}{TABLE}"] = each.table_csv(**table)
        except InputError as error:
            without.append(f"{name}: {error}")

    def page() -> Page:
        from hotlever.report.calibration_pages import calibrations_page

        return calibrations_page(batch, levers)

    return _Summary("\n".join([calibrations_text(levers), *without]), page, files)
