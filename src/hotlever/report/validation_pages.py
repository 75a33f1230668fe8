"""The page of published numbers: what was predicted of them, what came out, and a real curve."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever.calibration import Calibration, calibrate
from hotlever.calibration.summary import calibration_parts
from hotlever.materials.parameters import sentence
from hotlever.report.page import Page
from hotlever.steps import each
from hotlever.studies.validation.case import Case, cases, sought
from hotlever.studies.validation.prediction import (
    DRAWS,
    OUTSIDE,
    Prediction,
    comparison,
    computed,
    predict,
)
from hotlever.types import Array, Progress

_CURVE = "uiuc-lever"
#: Change of a prediction since it was written down that is told, in its own standard deviations.
_MOVED = 0.2
#: Reading error of the curve (µA).
_READ_UA = 4.0


def validation_page(
    progress: Progress | None = None, within: Progress | None = None
) -> tuple[Page, xr.Dataset]:
    """Predict all published numbers, and compare them.

    Parameters
    ----------
    progress, within : callable, optional
        Called with the cases done and their number, and with the draws of a case.

    Returns
    -------
    page : Page
    compared : xarray.Dataset
        See `hotlever.studies.validation.prediction.comparison`.
    """
    every = cases()
    now = [predict(case, within) for case in each(every, progress)]
    compared = comparison(every, now)
    page = Page("Published numbers, predicted and compared", _summary(compared))
    page.figure(
        "predicted_and_published",
        figures.predicted_and_published(compared),
        "What was predicted and what is published, over the predicted median. A wide band says "
        "that little was known of the lever: to be inside one says little for the model.",
    )
    page.heading("What came out")
    page.table(
        ("case", "quantity", "unit", "predicted (95 %)", "published", "verdict"),
        [_row(case, compared.sel(case=case.name)) for case in every],
        "The prediction is the one that was written down before the published value; which of the "
        "two came first is in the history of the project's files.",
    )
    _moved(page, every, now)
    _outside(page, every, compared)
    _bases(page, every)
    _real_curve(page)
    page.heading("Sought in vain")
    page.table(("source", "wanted", "tried"), sought(), prose=True)
    return page, compared


def _summary(compared: xr.Dataset) -> str:
    verdicts, count = compared.verdict.values.tolist(), compared.sizes["case"]
    groups = len(set(compared.group.values.tolist()))
    outside = verdicts.count(OUTSIDE)
    return (
        f"{count} published numbers of {groups} groups. Of each is known what its source states; "
        "what it does not state is assumed, with a spread, and a band follows by drawing "
        f"{DRAWS} times from these priors. {verdicts.count('inside 68 %')} of the published values "
        "are within 68 % of what prediction and published error leave, "
        f"{count - outside} within 95 %, {outside} outside; where bands are right, 5 % would be. "
        "Those who wrote the inputs had read the abstracts and so were no strangers to the "
        "published values; the bands follow from the inputs alone."
    )


def _number(value: float) -> str:
    """Return a number of three digits: 1060, 2.54e+07."""
    return f"{float(f'{value:.3g}'):g}"


def _row(case: Case, row: xr.Dataset) -> list[str]:
    low, high = _number(row.low_95.item()), _number(row.high_95.item())
    return [
        case.name,
        case.asked.meaning,
        case.asked.unit,
        f"{_number(row.predicted.item())} ({low} to {high})",
        f"{_number(row.published.item())} ± {row.published_error.item():.2g}",
        row.verdict.item().replace(" %", "\N{NO-BREAK SPACE}%"),
    ]


def _moved(page: Page, every: Sequence[Case], now: Sequence[Prediction]) -> None:
    """Say which draws did not count, and where a prediction is another than was written down."""
    lost = [f"{today.missing} for {case.name}" for case, today in zip(every, now, strict=True)]
    lost = [text for text in lost if not text.startswith("0 ")]
    if lost:
        page.text(
            f"Of the {DRAWS} draws some are left out, which are no lever that can be drawn, or one "
            f"that does not show the quantity: {', '.join(lost)}."
        )
    told = []
    for case, today in zip(every, now, strict=True):
        assert case.prediction is not None
        before = Prediction.as_stored(case.prediction, case.asked.is_share)
        if abs(today.centre - before.centre) > _MOVED * before.spread:
            told.append(f"{case.name}: {_number(before.median)} then, {_number(today.median)} now")
    page.text(
        f"Predicted anew, some are others by now: {'; '.join(told)}."
        if told
        else "Predicted anew today, all are the same within a fifth of their standard deviations."
    )


def _outside(page: Page, every: Sequence[Case], compared: xr.Dataset) -> None:
    """Say why values are outside, with what was tried."""
    page.heading("Outside, and why")
    for case in every:
        if compared.verdict.sel(case=case.name).item() != OUTSIDE:
            continue
        page.text(f"{case.name}: {case.outside}")
        rows = [["as assumed", _number(computed(case))]]
        rows += [
            [variant.why, _number(computed(case, dict(variant.changes)))]
            for variant in case.variants.values()
        ]
        page.table(("assumption", f"{case.asked.meaning} ({case.asked.unit})"), rows)


def _bases(page: Page, every: Sequence[Case]) -> None:
    """Show what each prediction rests on."""
    page.heading("What each rests on")
    page.table(
        ("case", "stated, assumed, published"),
        [
            [
                case.name,
                f"{case.group}. Stated: {case.stated}. Assumed: {case.assumed}. "
                f"Published: {case.published.says}. {case.remark} Source: {case.source}.",
            ]
            for case in every
            if case.published is not None
        ],
        prose=True,
    )


def _real_curve(page: Page) -> None:
    """Calibrate the one real I-V curve of the examples."""
    page.heading("A real curve")
    folder = resources.files("hotlever") / "examples"
    with (
        resources.as_file(folder / f"{_CURVE}.csv") as data,
        resources.as_file(folder / f"{_CURVE}.toml") as probe,
    ):
        calibration = calibrate(data, probe=probe)
    off = _differences(calibration)
    last = calibration.table.isel(bias=-1)
    worst, biggest = np.abs(off).max(), np.sqrt(np.mean(off**2))
    page.text(
        "The I-V curve of a silicon lever of the University of Illinois, digitised from a "
        f"published picture, {off.size} points. Lever, surroundings and temperatures are not "
        "stated with it. Calibrated with what is usual of such levers, the model follows the "
        f"current to {biggest:.1f} µA (rms), at worst {worst:.1f} µA; reading it off was good to "
        f"{_READ_UA:g} µA. At the last point, {last.power_mW.item():.2f} mW, the tip is at "
        f"{last.tip_K.item():.0f} K, with 95 % from {last.tip_low_K.item():.0f} to "
        f"{last.tip_high_K.item():.0f} K."
    )
    page.text(
        "What to believe: the shape. The laws of silicon, with a doping that the data find, are "
        f"{'as close to' if worst < 2 * _READ_UA else 'farther from'} this curve "
        f"{'as' if worst < 2 * _READ_UA else 'than'} it could be read. What not to believe without "
        "more: the temperature. Nothing in the picture is a thermometer, and the band holds for "
        "levers like the assumed one, in air and far from a surface. The knee lies beyond the "
        "measured range, and is an extrapolation."
    )
    page.table(
        ("V_b (V)", "I_h measured (mA)", "measured less calibrated (µA)"),
        [
            [f"{bias:.2f}", f"{current:.4f}", f"{difference:+.1f}"]
            for bias, current, difference in zip(
                calibration.measurement.bias_V, calibration.measurement.current_mA, off, strict=True
            )
        ],
    )
    for text in calibration_parts(calibration).before:
        page.text(sentence(text))
    page.figure(
        "real_curve",
        figures.calibration_curves(calibration),
        "Tip temperature of the real lever with its 95 % band, its I-V curve, and the standard "
        "error by source.",
    )


def _differences(calibration: Calibration) -> Array:
    """Return measured less calibrated currents (µA)."""
    measured, table = calibration.measurement, calibration.table
    model = np.interp(measured.bias_V, table.bias_V.values, table.current_mA.values)
    return np.asarray(1e3 * (measured.current_mA - model))
