"""The report pages of calibrations: of one lever with its uncertainty budget, and of many."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever.errors import InputError
from hotlever.estimate import Estimate
from hotlever.estimate.calibration_summary import calibration_parts, linear_words
from hotlever.estimate.gum import Budget, InputQuantity
from hotlever.estimate.levers import calibration_rows, calibration_statements, law_rows
from hotlever.estimate.many import Batch
from hotlever.estimate.tip_table import OF_THE_CONTACT, STATED, TABLE_COLUMNS, even_rows
from hotlever.estimate.uncertainty_budget import TemperatureBudget
from hotlever.materials.parameters import sentence
from hotlever.quantities import QUANTITIES
from hotlever.report.fit_pages import add_remarks
from hotlever.report.report_page import Block, Page
from hotlever.text import significant, with_unit
from hotlever.types import Array

#: Rows of a calibration's table that are shown, about.
_ROWS = 15
#: Rows of an uncertainty budget that the page of a calibration shows, the others together.
_CONTRIBUTIONS = 10
_HEAD = ["quantity", "estimate", "u", "type", "distribution", "sensitivity", "in K", "dof"]


def calibration_page(calibration: Estimate, added: Callable[[Block], None] | None = None) -> Page:
    """Return the report page of a calibration, which two sheets of paper hold.

    ``added`` is called with each block as soon as it is there.
    """
    described = calibration.describes_data
    page = Page(f"Calibration of {calibration.measurement.path}", added=added)
    parts = calibration_parts(calibration)
    page.sentences("; ".join(parts.before), *parts.after)
    for caption, (head, *rows) in parts.tables:
        page.table(head, rows, caption or "The standard error of the tip temperature, by source.")
    page.figure(
        "calibration",
        figures.calibration_curves(calibration),
        "Tip temperature against power and bias with its 95 % band, the I-V curve with its knee, "
        "and the standard error by source."
        if described
        else "The nearest lever, which is no estimate: tip temperature against power and bias, the "
        "I-V curve, and what the data differ by.",
    )
    names = [
        name
        for name in (*TABLE_COLUMNS, *OF_THE_CONTACT)
        if name in calibration.table and (described or not (name in STATED or "stderr" in name))
    ]
    columns = even_rows(calibration.heating, names, "tip_K", fewest=_ROWS)
    page.table(
        [f"{QUANTITIES[name].meaning} ({QUANTITIES[name].unit})" for name in names],
        [[f"{value:.4g}" for value in row] for row in zip(*columns.values(), strict=True)],
        "Some rows of the table "
        + ("for the instrument." if described else "of the nearest lever, not for an instrument."),
    )
    if calibration.gum is not None:
        _add_largest(page, calibration.gum)
    page.sentences(*calibration.notes)
    return page


def calibrations_page(batch: Batch, levers: xr.Dataset) -> Page:
    """Return the report page of many levers, of which one is calibrated or more.

    Parameters
    ----------
    batch : Batch
    levers : xarray.Dataset
        From `hotlever.estimate.levers.compare_calibrations`.
    """
    page = Page(
        f"Calibrations of {levers.sizes['lever']} levers",
        "Tip temperatures of levers from their I-V curves, and where they differ.",
    )
    page.sentences(*calibration_statements(levers))
    page.figure(
        "calibrated_levers",
        figures.calibrated_levers(batch.results, levers),
        "Tip temperatures of the levers, how far each is from their mean, and what they are "
        "compared by, with standard errors.",
    )
    head, *rows = calibration_rows(levers)
    page.table(head, rows, "Standard errors in units of the last digits.")
    head, *rows = law_rows(levers)
    page.table(head, rows, "Power laws in vacuum.")
    add_remarks(page, batch, "calibration", "calibrated")
    return page


def budget_page(calibration: Estimate) -> Page:
    """Return the uncertainty budget of a temperature, with nothing left out.

    Raises
    ------
    InputError
        If the calibration has none.
    """
    stated = calibration.gum
    if stated is None:
        raise InputError(
            "an uncertainty budget: expected a calibration that describes its data, by a probe or "
            "a fit (of a tip or apex at rest; the errors of a pulse by source are in its table)"
        )
    budget = stated.budget.largest_first()
    page = Page(f"Uncertainty budget of {calibration.measurement.path}", one_sheet=True)
    page.table(
        ["", ""],
        [
            ["measurand", f"{stated.measurand}, at rest"],
            ["probe", calibration.probe.title],
            ["estimate", f"{stated.estimate_K:.1f} K"],
            ["combined standard uncertainty", f"{significant(budget.u)} K"],
            ["effective degrees of freedom", _dof(budget.dof) or "not known: rows are correlated"],
            ["coverage factor", f"{budget.coverage_factor():.2f}, for 95 %"],
            ["expanded uncertainty", f"{significant(budget.expanded())} K"],
            ["Monte Carlo method", _linear(stated) or "not done"],
        ],
        prose=True,
    )
    _add_rows(page, budget)
    if budget.correlation is not None:
        _add_correlation(page, budget, budget.correlation)
    page.text(
        "Evaluated after the GUM (JCGM 100:2008), linearised, and checked after JCGM 101:2008. "
        "Sensitivities are in K per unit of the quantity; u of an infinite number of degrees of "
        "freedom is taken as exact. No traceability to standards and no accreditation is claimed."
    )
    return page


def _add_largest(page: Page, stated: TemperatureBudget) -> None:
    """Add the largest contributions of an uncertainty budget."""
    budget = stated.budget.largest_first()
    free = f"{_dof(budget.dof)} effective degrees of freedom, " if np.isfinite(budget.dof) else ""
    _add_rows(
        page,
        budget,
        f"The uncertainty budget after the GUM (JCGM 100) of the {stated.measurand}, "
        f"{stated.estimate_K:.1f} K: standard uncertainty {significant(budget.u)} K, {free}"
        f"k = {budget.coverage_factor():.2f}, expanded uncertainty "
        f"{significant(budget.expanded())} K (95 %). {_linear(stated)}".rstrip(),
        most=_CONTRIBUTIONS,
    )


def _linear(stated: TemperatureBudget) -> str:
    words = linear_words(stated)
    return words and sentence(words)


def _add_rows(page: Page, budget: Budget, caption: str = "", most: int | None = None) -> None:
    """Add the rows of a budget, but for `most` of them together; with degrees of freedom.

    Of rows that are correlated these would say nothing.
    """
    cells = [_cells(row) for row in budget.inputs[:most]]
    rest = budget.part(np.arange(len(cells), len(budget.inputs)))
    if rest.inputs:
        cells.append([f"{len(rest.inputs)} more, together", *[""] * 5, f"{rest.u:.1f}", ""])
    columns = len(_HEAD) if budget.correlation is None else -1
    page.table(_HEAD[:columns], [row[:columns] for row in cells], caption)


def _cells(row: InputQuantity) -> list[str]:
    return [
        row.quantity,
        with_unit(f"{row.estimate:.4g}", row.unit),
        with_unit(significant(row.u), row.unit),
        row.type,
        row.distribution,
        with_unit(f"{row.sensitivity:.3g}", _per(row.unit)),
        f"{row.contribution:.1f}",
        _dof(row.dof),
    ]


def _dof(dof: float) -> str:
    return f"{dof:.0f}" if np.isfinite(dof) else "∞" if np.isinf(dof) else ""


def _per(unit: str) -> str:
    """Return the unit of kelvins per another one."""
    return {"K": "1", "1": "K"}.get(unit, f"K/({unit})" if " " in unit else f"K/{unit}")


def _add_correlation(page: Page, budget: Budget, correlation: Array) -> None:
    """Add the correlation of those rows that are not independent of all others."""
    numbers = np.flatnonzero(np.count_nonzero(correlation, axis=0) > 1)
    among = correlation[np.ix_(numbers, numbers)]
    page.table(
        ["", *(str(number) for number in range(1, numbers.size + 1))],
        [
            [
                f"{number} {budget.inputs[row].quantity}",
                *(str(round(100.0 * value)) for value in values),
            ]
            for number, (row, values) in enumerate(zip(numbers, among, strict=True), start=1)
        ],
        "Correlation in hundredths; all other rows are independent of each other and of these.",
    )
