"""Calibrations of measurement files, of one lever or many."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hotlever.calibration import Calibration
from hotlever.calibration.levers import (
    Setting,
    calibrate_many,
    calibrations_csv,
    calibrations_text,
    compare_calibrations,
)
from hotlever.calibration.power_law import read_power_law
from hotlever.calibration.procedure import calibrate
from hotlever.calibration.summary import calibration_text
from hotlever.errors import ComputationError, InputError
from hotlever.estimation import read_fit
from hotlever.estimation.batch import Batch
from hotlever.files import TABLE, Outputs, write_text
from hotlever.measurement import read_measurement_of
from hotlever.tasks.batches import Summary, estimate_several
from hotlever.tasks.files import draw
from hotlever.tasks.measured_requests import CalibrateRequest
from hotlever.tasks.probes import read_probe
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.texts import parse_priors, parse_setting, parse_timing

if TYPE_CHECKING:
    from hotlever.report.page import Page

#: The table of many levers, in the folder of their calibrations.
CALIBRATIONS_TABLE = "calibrations.csv"


def calibrate_files(reporter: Reporter, request: CalibrateRequest) -> int:
    """Calibrate one lever or many; return the exit status.

    Raises
    ------
    ComputationError
        If no lever shows the data of a single one; what the search ended at is written.
    """
    request.check()
    law = None if request.power_law is None else read_power_law(request.power_law)
    fit = None if request.fit is None else read_fit(request.fit)
    like = fit.probe if fit else request.with_physics(read_probe(reporter, request.probe))
    how: dict[str, Any] = {
        "probe": like if fit is None and law is None else None,
        "law": law,
        "priors": parse_priors(request.prior, like),
        "medium": request.medium,
        "budget_of": request.budget_of,
        "pulse": None if request.pulse is None else parse_timing(request.pulse),
        "samples": request.samples if request.posterior else 0,
    }
    outputs = request.outputs()
    if request.several:
        at = None if request.at is None else Setting(*parse_setting(request.at))
        make = partial(calibrate_many, **how)
        summarise = partial(_summary, at, request.table_options())
        names = "calibrations", CALIBRATIONS_TABLE
        return estimate_several(reporter, request, outputs, *names, make, summarise)
    (data,) = request.data
    measurement = read_measurement_of(like, data, request.columns)
    reporter.tell_table(measurement.understood)
    reporter.note(*measurement.notes, *measurement.unused)
    with reporter.progress("calibrate") as update:
        at_V = None if request.at is None else parse_setting(request.at)[1]
        result = calibrate(measurement, fit=fit, at_V=at_V, progress=update, **how)
    _write(reporter, request, outputs, result)
    if not result.describes_data:
        raise ComputationError(f"{data}: {result.doubt}")
    return 0


def _write(
    reporter: Reporter, request: CalibrateRequest, outputs: Outputs, result: Calibration
) -> None:
    reporter.note(*result.notes)
    texts = [calibration_text(result)]
    with outputs.together():
        if request.output is not None:
            result.write(request.output)
        if request.table is not None:
            write_text(request.table, result.table_csv(**request.table_options()))
        draw(request.plot, lambda figures: figures.calibration_curves(result))
        if request.report is not None:
            texts.append(f"report: {_report(result, request.report)}")
    reporter.give("\n".join([*texts, ""]))


def _report(result: Calibration, folder: Path) -> Path:
    """Write the page of a calibration, and that of its uncertainty budget; return the former."""
    from hotlever.report.budget_pages import budget_page
    from hotlever.report.calibration_pages import calibration_page

    page = calibration_page(result)
    if result.gum is not None:
        budget_page(result).write(folder, "budget")
        page.text("The whole uncertainty budget, as one sheet to print: budget.html.")
    return page.write(folder)


def _summary(at: Setting | None, table: dict[str, Any], batch: Batch[Calibration]) -> Summary:
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

    return Summary("\n".join([calibrations_text(levers), *without]), page, files)
