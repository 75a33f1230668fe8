"""The report pages of calibrations: of one lever, and of many."""

from __future__ import annotations

from collections.abc import Callable

import xarray as xr

from hotlever import figures
from hotlever.calibration import Calibration
from hotlever.calibration.levers import calibration_rows, calibration_statements, law_rows
from hotlever.calibration.summary import calibration_parts
from hotlever.calibration.table import OF_THE_CONTACT, STATED, TABLE_COLUMNS, even_rows
from hotlever.datasets import QUANTITIES
from hotlever.estimation.batch import Batch
from hotlever.report.budget_pages import add_largest
from hotlever.report.fit_pages import add_remarks
from hotlever.report.page import Block, Page

#: Rows of a calibration's table that are shown, about.
_ROWS = 15


def calibration_page(
    calibration: Calibration, added: Callable[[Block], None] | None = None
) -> Page:
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
    shown = even_rows(calibration.heating, names, "tip_K", fewest=_ROWS)
    page.table(
        [f"{QUANTITIES[name][1]} ({QUANTITIES[name][0]})" for name in names],
        [[f"{value:.4g}" for value in row] for row in zip(*shown.values(), strict=True)],
        "Some rows of the table "
        + ("for the instrument." if described else "of the nearest lever, not for an instrument."),
    )
    if calibration.gum is not None:
        add_largest(page, calibration.gum)
    page.sentences(*calibration.notes)
    return page


def calibrations_page(batch: Batch[Calibration], levers: xr.Dataset) -> Page:
    """Return the report page of many levers, of which one is calibrated or more.

    Parameters
    ----------
    batch : Batch
    levers : xarray.Dataset
        From `hotlever.calibration.levers.compare_calibrations`.
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
