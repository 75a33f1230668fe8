"""The page of published numbers: what was predicted of them, what came out, and a real curve."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever.estimate import Estimate, calibrate
from hotlever.estimate.summary import calibration_parts
from hotlever.estimate.tip_table import rms
from hotlever.probe import Probe
from hotlever.processes import PROCESSORS, local_processes
from hotlever.report.report_page import Page
from hotlever.studies.validation.case import Case, cases, sought
from hotlever.studies.validation.prediction import (
    DRAWS,
    OUTSIDE,
    PredictedNumber,
    comparison,
    computed,
    predict,
)
from hotlever.text import value_with_error
from hotlever.types import Array, Progress


def validation_page(progress: Progress | None = None) -> tuple[Page, xr.Dataset]:
    """Predict all published numbers, and compare them.

    Parameters
    ----------
    progress : callable, optional
        Called with the cases and curves done and their number.

    Returns
    -------
    page : Page
    compared : xarray.Dataset
        See `hotlever.studies.validation.prediction.comparison`.
    """
    # what else the lever of the real curve may be, and its changes
    other_levers: dict[str, dict[str, Any]] = {
        "as assumed, a U-shape of 120 µm in air": {},
        "in vacuum": {"medium": "vacuum"},
        "1.5 µm above a cold surface": {"surface_gap_um": 1.5},
        "twice as long": {"length_um": 240.0},
    }
    every = cases()
    tasks: list[tuple[Any, ...]] = [(predict, case) for case in every]
    tasks += [(_calibrated, changes) for changes in other_levers.values()]
    with local_processes(PROCESSORS) as run:
        results = run(operator.call, tasks, progress)
    now, calibrations = results[: len(every)], results[len(every) :]
    compared = comparison(every)
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
    _lost_draws_and_changes(page, every, now)
    _outside(page, every, compared)
    _bases(page, every)
    _real_curve(page, dict(zip(other_levers, calibrations, strict=True)))
    page.heading("Sought in vain")
    page.table(("source", "wanted", "tried"), sought(), prose=True)
    return page, compared


def _summary(compared: xr.Dataset) -> str:
    verdicts, count = compared.verdict.values.tolist(), compared.sizes["case"]
    groups = len(set(compared.group.values.tolist()))
    outside = verdicts.count(OUTSIDE)
    narrow_factor = 2.0
    narrow = (compared.high_95 <= narrow_factor * compared.predicted) & (
        narrow_factor * compared.low_95 >= compared.predicted
    )
    return (
        f"{count} published numbers of {groups} groups. Of each is known what its source states; "
        "what it does not state is assumed, with a spread, and a band follows by drawing "
        f"{DRAWS} times from these priors. {verdicts.count('inside 68 %')} of the published values "
        "are within 68 % of what prediction and published error leave, "
        f"{count - outside} within 95 %, {outside} outside; where bands are right "
        f"{0.68 * count:.0f} and {0.95 * count:.0f} would be within. {narrow.sum().item()} of the "
        f"bands are narrow, within a factor of {narrow_factor:g} of the median: these test the "
        "model, the others that it is not far off. "
        "Those who wrote the inputs had read the abstracts and so were no strangers to the "
        "published values; the bands follow from the inputs alone."
    )


def _number(value: float, digits: int = 3) -> str:
    """Return a number of some digits: 1060, 2.54e+07."""
    return f"{float(f'{value:.{digits}g}'):g}"


def _unbroken(text: str) -> str:
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def _row(case: Case, row: xr.Dataset) -> list[str]:
    low, high = _number(row.low_95.item()), _number(row.high_95.item())
    return [
        case.name,
        case.definition.meaning,
        _unbroken(case.definition.unit),
        f"{_number(row.predicted.item())} {_unbroken(f'({low} to {high})')}",
        _unbroken(f"{_number(row.published.item(), 4)} ± {_number(row.published_error.item(), 2)}"),
        _unbroken(row.verdict.item()),
    ]


def _lost_draws_and_changes(
    page: Page, every: Sequence[Case], now: Sequence[PredictedNumber]
) -> None:
    """Say which draws did not count, and where a prediction is another than was written down."""
    for draws, are in (
        ("impossible", "are no lever that can be drawn, or beyond what a parameter may be"),
        ("silent", "do not show the quantity"),
    ):
        lost = [(getattr(today, draws), case.name) for case, today in zip(every, now, strict=True)]
        text = ", ".join(f"{count} for {name}" for count, name in lost if count)
        page.text(f"Of the {DRAWS} draws these are left out as they {are}: {text or 'none'}.")
    changes = []
    for case, today in zip(every, now, strict=True):
        assert case.prediction is not None
        before = PredictedNumber.as_stored(case.prediction, case.definition.is_share)
        # told from this share of its own standard deviations on
        if abs(today.centre - before.centre) > 0.2 * before.spread:
            changes.append(
                f"{case.name}: {_number(before.median)} then, {_number(today.median)} now"
            )
    page.text(
        f"Predicted anew, some are others by now: {'; '.join(changes)}."
        if changes
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
        page.table(("assumption", f"{case.definition.meaning} ({case.definition.unit})"), rows)


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


def _calibrated(changes: dict[str, Any]) -> Estimate:
    """Calibrate the one real I-V curve of the examples, with a lever that is other than assumed."""
    curve = "uiuc-lever"
    with resources.as_file(resources.files("hotlever") / "examples") as folder:
        probe = Probe.from_file(folder / f"{curve}.toml")
        other = probe.with_(**changes) if changes else probe
        return calibrate(folder / f"{curve}.csv", probe=other)


def _real_curve(page: Page, calibrations: Mapping[str, Estimate]) -> None:
    """Show what the real curve says of its lever, and what to believe of that."""
    page.heading("A real curve")
    calibration = next(iter(calibrations.values()))
    off = _differences(calibration)
    last = calibration.table.isel(bias=-1)
    tips = [other.table.tip_K[-1].item() for other in calibrations.values()]
    # reading error of the curve
    read_uA = 4.0
    page.text(
        "The I-V curve of a silicon lever of the University of Illinois, digitised from a "
        f"published picture, {off.size} points. Lever, surroundings and temperatures are not "
        "stated with it. Calibrated with what is usual of such levers, the model follows the "
        f"current to {rms(off):.1f} µA (rms), at worst {np.abs(off).max():.1f} µA; reading it off "
        f"was good to {read_uA:g} µA. At the last point, {last.power_mW.item():.2f} mW, the tip "
        f"is at {last.tip_K.item():.0f} K, with 95 % from {last.tip_low_K.item():.0f} to "
        f"{last.tip_high_K.item():.0f} K."
    )
    page.figure(
        "real_curve",
        figures.calibration_curves(calibration),
        "Tip temperature of the real lever with its 95 % band, its I-V curve, and the standard "
        "error by source.",
    )
    page.figure(
        "real_curve_residuals",
        figures.residuals_of_current(calibration.measurement.bias_V, off, read_uA),
        "Measured less calibrated currents, and the error of reading them off (grey).",
    )
    page.sentences(*calibration_parts(calibration).before)
    page.table(
        ("parameter", "assumed", "by the curve"),
        [
            [name, use.stated, value_with_error(use.posterior_value, use.posterior_spread)]
            for name, use in calibration.priors.items()
            if use.spread_ratio < 0.8
        ],
        "What the curve tells of the lever: parameters whose spread it lessens by a fifth or more. "
        "All others stay what was assumed.",
    )
    page.table(
        ("lever", "rms of the current (µA)", "tip at the last point (K)", "95 % (K)"),
        [
            [
                name,
                f"{rms(_differences(other)):.1f}",
                f"{row.tip_K.item():.0f}",
                f"{row.tip_low_K.item():.0f} to {row.tip_high_K.item():.0f}",
            ]
            for name, other in calibrations.items()
            for row in [other.table.isel(bias=-1)]
        ],
        "The same curve, calibrated as that of other levers.",
    )
    page.text(
        "What to believe: the laws of silicon, with a doping that the data find, follow this curve "
        "as closely as it could be read. All of these levers do, so that it does not tell them "
        "apart: neither length nor surroundings can be had from it. The temperature is nearly the "
        f"same in all, {min(tips):.0f} to {max(tips):.0f} K, since it follows from how far the "
        "resistance rose. What not to believe without more: that it is right to fewer kelvin than "
        "the band is wide. Nothing in the picture is a thermometer, and the laws are common to all "
        "rows. The knee lies beyond the measured range, and is an extrapolation."
    )


def _differences(calibration: Estimate) -> Array:
    """Return measured less calibrated currents (µA)."""
    measured, table = calibration.measurement, calibration.table
    model = np.interp(measured.bias_V, table.bias_V.values, table.current_mA.values)
    return np.asarray(1e3 * (measured.current_mA - model))
