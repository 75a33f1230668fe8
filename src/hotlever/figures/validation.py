"""What was predicted of published numbers, and what was published."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from hotlever.colours import BLACK, GREEN, ORANGE, VERMILION
from hotlever.figures.style import figure
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr

_COLOURS = {"inside 68 %": GREEN, "inside 95 %": ORANGE, "outside": VERMILION}
_TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
#: Inches for each case, and above and below them.
_EACH, _MORE = 0.24, 0.9


def predicted_and_published(cases: xr.Dataset) -> Figure:
    """Draw bands of predictions and published values, each over the predicted median.

    Parameters
    ----------
    cases : xarray.Dataset
        From `hotlever.studies.validation.prediction.comparison`.
    """
    cases = cases.sortby("group")
    with figure(7.4, _EACH * cases.sizes["case"] + _MORE) as (made, axes):
        rows = np.arange(cases.sizes["case"])[::-1]
        low, high, middle = (
            (cases[name] / cases.predicted).values for name in ("low_95", "high_95", "published")
        )
        axes.hlines(rows, low, high, color="0.75", lw=6, label="predicted, 95 %")
        axes.plot(np.ones_like(middle), rows, "|", color=BLACK, ms=9, label="predicted median")
        error = (cases.published_error / cases.predicted).values
        # as a share, below and above, so that what is uncertain to all of it stays on the page
        lower = middle - middle / (1.0 + error / middle)
        for verdict, colour in _COLOURS.items():
            of = (cases.verdict == verdict).values
            axes.errorbar(
                middle[of],
                rows[of],
                xerr=[lower[of], error[of]],
                fmt="o",
                color=colour,
                lw=1.2,
                label=f"published, {verdict}",
            )
        axes.axvline(1.0, color="0.5", lw=0.6)
        axes.set(xscale="log", xlabel="over the predicted median", ylim=(-0.6, len(rows) - 0.4))
        ticks = [tick for tick in _TICKS if low.min() < tick < high.max()]
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.set_xticks([], minor=True)
        axes.set_yticks(rows, cases.case.values)
        axes.grid(False, axis="y")
        made.legend(loc="outside upper center", ncols=3)
    return made


def residuals_of_current(bias_V: Array, residuals_uA: Array, error_uA: float) -> Figure:
    """Draw measured less calibrated currents (µA) and the error of reading them off."""
    with figure(7.4, 2.4) as (made, axes):
        axes.axhspan(-error_uA, error_uA, color="0.9")
        axes.axhline(0.0, color="0.5", lw=0.6)
        axes.plot(bias_V, residuals_uA, "o", color=BLACK, ms=4)
        axes.set(xlabel="V$_b$ (V)", ylabel="residual of I$_h$ (µA)")
    return made
