"""Figures of how sure a fit is, from its posterior, profiles and band; nothing is solved here."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.stats import chi2

from hotlever.fitting.fit import Fit
from hotlever.fitting.measurement import Measurement
from hotlever.materials import PARAMETERS
from hotlever.report.style import (
    BLACK,
    BLUE,
    ORANGE,
    SKY,
    VERMILION,
    figure,
    panel_letter,
)

Array = NDArray[np.float64]

#: Blue over white, as transparent colours cannot be stacked in filled contours.
_LIGHT, _DARK = "#BFDBEB", "#5DA5CC"


def posterior_corner(posterior: xr.Dataset, result: Fit | None = None) -> Figure:
    """Draw the posterior of each quantity, and of each pair with its 68 and 95 % regions.

    Parameters
    ----------
    posterior : xarray.Dataset
        From `hotlever.fitting.posterior.sample_posterior`.
    result : Fit, optional
        Its optimum is marked.
    """
    names = posterior.quantity.values.tolist()
    shown = {name: axis_label(name) for name in names}
    values = {name: posterior[name].values.ravel() / shown[name][1] for name in names}
    size = 1.3 * len(names) + 0.8
    with figure(size, size) as made:
        grid = made.subplots(len(names), len(names), squeeze=False)
        for row, down in enumerate(names):
            for column, across in enumerate(names):
                axes = grid[row, column]
                if column > row:
                    axes.remove()
                    continue
                if row == column:
                    axes.hist(values[across], bins=30, color=SKY)
                    low, middle, high = np.percentile(values[across], (16, 50, 84))
                    axes.axvspan(low, high, color="0.9", zorder=0)
                    digits = max(0, 1 - math.floor(math.log10(max(high - low, 1e-12))))
                    axes.set_title(f"{middle:.{digits}f} ± {(high - low) / 2:.{digits}f}")
                    axes.set(yticks=[], xlim=_range(values[across]))
                else:
                    _pair(axes, values[across], values[down])
                    axes.set(xlim=_range(values[across]), ylim=_range(values[down]))
                    axes.yaxis.set_major_locator(MaxNLocator(3))
                axes.grid(False)
                axes.xaxis.set_major_locator(MaxNLocator(3))
                axes.tick_params(axis="x", labelrotation=45)
                axes.tick_params(
                    labelbottom=row == len(names) - 1, labelleft=column == 0 and row > 0
                )
                if result is not None:
                    _mark(axes, result, across, down if row != column else None)
                if row == len(names) - 1:
                    axes.set_xlabel(shown[across][0])
                if column == 0 and row > 0:
                    axes.set_ylabel(shown[down][0])
        made.align_labels()
        handles = [
            Patch(color=_DARK, label="68 %"),
            Patch(color=_LIGHT, label="95 %"),
        ]
        if result is not None:
            handles.append(Patch(color=VERMILION, label="optimum of the fit"))
        made.legend(handles=handles, loc="upper right", fontsize=10)
    return made


def profile_curves(profiles: Sequence[xr.Dataset]) -> Figure:
    """Draw profile likelihoods beside the parabolas of the standard errors.

    Parameters
    ----------
    profiles : sequence of xarray.Dataset
        From `hotlever.fitting.profile.profile_likelihood`.
    """
    columns = min(3, len(profiles))
    rows = math.ceil(len(profiles) / columns)
    with figure(2.9 * columns + 0.3, 2.6 * rows + 0.4) as made:
        grid = made.subplots(rows, columns, squeeze=False)
        for place, axes in enumerate(grid.ravel()):
            if place >= len(profiles):
                axes.remove()
                continue
            profile = profiles[place]
            label, unit = axis_label(profile.attrs["parameter"])
            value, optimum = profile.value.values / unit, profile.attrs["optimum"] / unit
            fine = np.linspace(value.min(), value.max(), 200)
            away = np.abs(value - optimum).argmax()
            curvature = profile.parabola.values[away] / (value[away] - optimum) ** 2
            axes.plot(fine, curvature * (fine - optimum) ** 2, "--", color=ORANGE, label="parabola")
            # the root of a near-parabola is nearly straight on either side of the optimum
            side = np.where(value < optimum, -1.0, 1.0)
            root = side * np.sqrt(np.maximum(profile.delta_chi_square.values, 0.0))
            axes.plot(fine, np.interp(fine, value, root) ** 2, color=BLUE, label="profile")
            axes.plot(value, root**2, "o", color=BLUE)
            axes.axvline(optimum, color=VERMILION, lw=0.8)
            for level in profile.level.values:
                limit = chi2.ppf(level, 1)
                axes.axhline(limit, color="0.4", lw=0.8, ls=":")
                axes.annotate(
                    f"{100 * level:.0f} %",
                    (0.5, limit),
                    xycoords=("axes fraction", "data"),
                    ha="center",
                    va="bottom",
                    color="0.4",
                    fontsize=8,
                )
            axes.set(xlabel=label, ylabel="Δχ²", ylim=(0, 8))
            axes.xaxis.set_major_locator(MaxNLocator(4))
            panel_letter(axes, "abcdefghijkl"[place])
        grid[0, 0].legend(loc="upper center", frameon=True, facecolor="white", edgecolor="none")
    return made


def predictive_bands(
    band: xr.Dataset,
    measurement: Measurement | None = None,
    series_resistance_ohm: float | None = None,
) -> Figure:
    """Draw the band of predicted tip temperature against bias and power, and its width.

    Parameters
    ----------
    band : xarray.Dataset
        From `hotlever.fitting.posterior.predictive_band`.
    measurement : Measurement, optional
        Its temperatures are drawn as points.
    series_resistance_ohm : float, optional
        To draw them against the power; that of the measurement by default.
    """
    with figure(7.4, 5.0) as made:
        grid = made.subplots(2, 2, sharex="col", height_ratios=(1.8, 1.0))
        for place, (x, name, label) in enumerate(
            (
                (band.bias_V.values, "tip_K", "bias V$_b$ (V)"),
                (band.power_mW.values, "tip_at_power_K", "power P$_l$ (mW)"),
            )
        ):
            upper, lower = grid[:, place]
            low95, low68, middle, high68, high95 = band[name].values
            upper.plot(x, middle, color=BLUE, label="median")
            for axes, zero in ((upper, 0.0), (lower, middle)):
                axes.fill_between(x, low95 - zero, high95 - zero, color=BLUE, alpha=0.25, lw=0)
                axes.fill_between(x, low68 - zero, high68 - zero, color=BLUE, alpha=0.45, lw=0)
            upper.fill_between([], [], color=BLUE, alpha=0.55, label="68 %")
            upper.fill_between([], [], color=BLUE, alpha=0.25, label="95 %")
            lower.axhline(0, color=BLUE, lw=0.8)
            if measurement is not None:
                at = _abscissa(measurement, place, series_resistance_ohm)
                if at is not None:
                    upper.plot(
                        at,
                        measurement.tip_K,
                        "o",
                        mfc="none",
                        color=BLACK,
                        ms=3.5,
                        label="measured",
                    )
            upper.set(ylabel="tip temperature (K)")
            lower.set(xlabel=label, ylabel="T$_{tip}$ − median (K)", xlim=(0, None))
            panel_letter(upper, "ab"[place])
            panel_letter(lower, "cd"[place])
        grid[0, 0].legend(loc="upper left")
    return made


def axis_label(name: str) -> tuple[str, float]:
    """Return a quantity's axis label and the unit (of its own) that it is drawn in."""
    if name == "inversion_temperature":
        return "T$_i$ (K)", 1.0
    known = PARAMETERS[name]
    unit = "" if known.unit == "1" else known.unit
    if known.scale != 1.0:
        unit = f"10$^{{{math.log10(known.scale):.0f}}}$ {unit}"
    symbol, _, index = known.symbol.partition("_")
    symbol += f"$_{{{index}}}$" if index else ""
    return f"{symbol} ({unit})" if unit else symbol, known.scale


def _range(values: Array) -> tuple[float, float]:
    low, high = np.percentile(values, (0.2, 99.8))
    margin = 0.1 * (high - low)
    return float(low - margin), float(high + margin)


def _pair(axes: Axes, x: Array, y: Array) -> None:
    """Draw the smallest regions that hold 68 and 95 % of the samples."""
    counts, x_edges, y_edges = np.histogram2d(x, y, bins=40, range=(_range(x), _range(y)))
    smooth = gaussian_filter(counts, 1.5)
    falling = np.sort(smooth.ravel())[::-1]
    share = np.cumsum(falling) / falling.sum()
    outer, inner = (falling[np.searchsorted(share, level)] for level in (0.95, 0.68))
    middles = [(edges[1:] + edges[:-1]) / 2 for edges in (x_edges, y_edges)]
    if 0.0 < outer < inner < falling[0]:
        levels = [outer, inner, falling[0]]
        axes.contourf(*middles, smooth.T, levels=levels, colors=[_LIGHT, _DARK])


def _mark(axes: Axes, result: Fit, across: str, down: str | None) -> None:
    """Mark the optimum of a fit."""
    axes.axvline(_optimum(result, across), color=VERMILION, lw=0.8)
    if down is not None:
        axes.axhline(_optimum(result, down), color=VERMILION, lw=0.8)


def _optimum(result: Fit, name: str) -> float:
    if name == "inversion_temperature":
        return result.inversion_temperature_K
    return result.parameters[name].value / axis_label(name)[1]


def _abscissa(measurement: Measurement, place: int, series_ohm: float | None) -> Array | None:
    """Return the bias (place 0) or the power of a measurement; None if R_s is not known."""
    if place == 0:
        return measurement.bias_V
    resistance = measurement.series_resistance_ohm if series_ohm is None else series_ohm
    if resistance is None:
        return None
    current = measurement.current_mA
    power: Array = (measurement.bias_V - resistance / 1000.0 * current) * current
    return power
