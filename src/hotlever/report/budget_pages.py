"""The uncertainty budget of a calibration, as a page that one sheet of paper holds."""

from __future__ import annotations

import numpy as np

from hotlever.calibration import Calibration
from hotlever.calibration.summary import linear_words
from hotlever.calibration.uncertainty_budget import TemperatureBudget
from hotlever.errors import InputError
from hotlever.estimation.gum import Budget, InputQuantity
from hotlever.materials.parameters import sentence
from hotlever.report.page import Page
from hotlever.text import significant, with_unit
from hotlever.types import Array

#: Rows that the page of a calibration shows, of which the others are shown together.
_CONTRIBUTIONS = 10
_HEAD = ["quantity", "estimate", "u", "type", "distribution", "sensitivity", "in K", "dof"]


def budget_page(calibration: Calibration) -> Page:
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


def add_largest(page: Page, stated: TemperatureBudget) -> None:
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
