"""Levers never seen: the estimate with priors beside the paper's ways to the temperature."""

from __future__ import annotations

import xarray as xr

from hotlever import figures
from hotlever.report.reproduce.findings import Findings
from hotlever.steps import each
from hotlever.studies.simulation_based_calibration import (
    DEPARTURES,
    ESTIMATE,
    LEVELS,
    WAYS,
    concatenated,
    judge,
    summary,
)

#: Levers of the page, and of its quick form; each is made with either law of the mobility.
_MANY, _FEW = 12, 2
#: What a lever departs in that has the mobility of the model.
_EQ8 = tuple(name for name in DEPARTURES if name != "mobility")
#: Less than this of the true temperatures in the 95 % band: the band is too narrow.
_TOO_FEW = 0.85


def many_levers_section(page: Findings) -> None:
    """Levers with more physics than the model, calibrated from their I-V curve."""
    _compare_ways(page, _MANY)


def few_levers_section(page: Findings) -> None:
    """The same with fewer levers."""
    _compare_ways(page, _FEW)


def _compare_ways(page: Findings, count: int) -> None:
    page.text(
        "In use nobody sees how hot a tip is. It is inferred from voltage and current, and what "
        "counts is how wrong that is on the next lever, which differs from its drawing and from "
        f"any model. Therefore {count} levers were made up and solved, half of them U-shaped, each "
        "with a material and dimensions of its own, a tip and a finer mesh, once with the mobility "
        "of Eq. 8 and once with that of MINIMOS, where impurities scatter less when it is hot; "
        "they were measured with noise, drift and some outliers. Each way of calibrating is given "
        "the drawing, the nominal doping and the I-V curve."
    )
    cases = [(number, law) for law in (_EQ8, tuple(DEPARTURES)) for number in range(count)]
    judged = concatenated(
        [judge(number, departures=law) for number, law in each(cases, page.progress)]
    )
    by_law = [summary(judged.isel(lever=judged.other_law.values == law)) for law in (False, True)]
    for total, law in zip(by_law, ("the mobility of Eq. 8", "the other law"), strict=True):
        page.text(_sentence(total, law))
    page.figure(
        "simulated-levers",
        figures.judged_calibrations(judged),
        "(a) Largest error above 400 K of each lever, by the way of calibrating. (b) Error of the "
        "estimate along the bias, in units of the error that it states; one line for each lever.",
    )
    rows = []
    for way in WAYS:
        cells = [f"{value:.0f}" for total in by_law for value in total.largest_K.sel(way=way)]
        rows.append((way, *cells, "no" if way == ESTIMATE else "yes"))
    columns = [
        f"{law}{name}" for law in ("", "other law, ") for name in ("median", "90 %", "worst")
    ]
    page.table(
        ("largest error (K)", *columns, "needs a knee"),
        rows,
        "Of the tip temperature above 400 K: half of the levers, 90 % of them, and the worst, "
        "as far as a way gave an answer. k is "
        "the power at the lever's knee over that of the reference; with the knee at T_i, of the "
        "nominal doping, the temperature rises in proportion to the power. "
        "benchmarks/twins.py makes 200 levers, also in air and with Raman temperatures.",
    )


def _sentence(total: xr.Dataset, law: str) -> str:
    """How wrong the ways are with a law of the mobility, and whether the stated errors hold."""
    median = {way: total.largest_K.sel(way=way, percentile=50).item() for way in WAYS}
    best, *_, worst = sorted(WAYS[1:], key=median.__getitem__)
    coverage = [total.coverage.sel(level=level).mean().item() for level in LEVELS]
    text = (
        f"With {law} the largest error of the estimate is {median[ESTIMATE]:.0f} K on the median "
        f"lever, against {median[best]:.0f} K by the best of the other ways ({best}) and "
        f"{median[worst]:.0f} K by the worst ({worst}). Of the true temperatures {coverage[0]:.0%} "
        f"are in its 68 % band and {coverage[1]:.0%} in its 95 % band; the others state none"
    )
    narrow = "; the stated errors do not cover this departure from the model"
    return f"{text}{narrow if coverage[1] < _TOO_FEW else ''}."
