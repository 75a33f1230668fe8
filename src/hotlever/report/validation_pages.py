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
from hotlever.report.report_page import Page, filled, texts
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
    page.draw("predicted_and_published", figures.predicted_and_published(compared))
    page.heading("What came out")
    columns = ("case", "quantity", "unit", "predicted (95 %)", "published", "verdict")
    rows = [_row(case, compared.sel(case=case.name)) for case in every]
    page.tabulate("predicted_and_published", columns, rows)
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
    return filled(
        texts()["paragraphs"]["validation"],
        count=count,
        groups=groups,
        draws=DRAWS,
        inside=(verdicts.count("inside 68 %"), count - outside),
        outside=outside,
        expected=(0.68 * count, 0.95 * count),
        narrow=narrow.sum(),
        factor=narrow_factor,
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
    if changes:
        page.say("predicted_others", changes="; ".join(changes))
    else:
        page.say("predicted_the_same")


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
    worst = np.abs(off).max()
    page.say("real_curve", points=off.size, rms=rms(off), worst=worst, read_uA=read_uA, last=last)
    page.draw("real_curve", figures.calibration_curves(calibration))
    bias = calibration.measurement.bias_V
    page.draw("real_curve_residuals", figures.residuals_of_current(bias, off, read_uA))
    words, *_ = calibration_parts(calibration)
    page.sentences(*words)
    told = [
        [name, use.stated, value_with_error(use.posterior_value, use.posterior_spread)]
        for name, use in calibration.priors.items()
        if use.spread_ratio < 0.8
    ]
    page.tabulate("real_curve", ("parameter", "assumed", "by the curve"), told)
    rows = []
    for name, other in calibrations.items():
        end = other.table.isel(bias=-1)
        band = f"{end.tip_low_K:.0f} to {end.tip_high_K:.0f}"
        rows.append([name, f"{rms(_differences(other)):.1f}", f"{end.tip_K:.0f}", band])
    columns = ("lever", "rms of the current (µA)", "tip at the last point (K)", "95 % (K)")
    page.tabulate("other_levers", columns, rows)
    page.say("believed", least=min(tips), most=max(tips))


def _differences(calibration: Estimate) -> Array:
    """Return measured less calibrated currents (µA)."""
    measured, table = calibration.measurement, calibration.table
    model = np.interp(measured.bias_V, table.bias_V.values, table.current_mA.values)
    return np.asarray(1e3 * (measured.current_mA - model))
