"""Figures of estimates: fits and calibrations, of one lever or many, and what to measure next."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from scipy.ndimage import gaussian_filter
from scipy.special import chdtri, ndtri

from hotlever.estimate.estimate import Estimate
from hotlever.estimate.many import tips_along
from hotlever.estimate.next_measurement import SURE, Plan
from hotlever.estimate.options import DiagnosisOptions
from hotlever.estimate.tip_table import PulseCalibration
from hotlever.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    LINES,
    MEASURED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    are_numbered,
    axis_label,
    curve,
    entitle,
    figure,
    from_zero,
    panel_letters,
    parameter_label,
    settled,
    values_by_lever,
)
from hotlever.materials.parameters import parameter_named
from hotlever.quantities import FITTED, OBSERVABLES
from hotlever.studies.simulation_based_calibration import ESTIMATE, LEVELS, WAYS
from hotlever.text import BAND, value_with_error
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr


def data_and_model(
    measured: xr.Dataset, model: xr.Dataset, fitted: Sequence[str], band: xr.Dataset | None = None
) -> Figure:
    """Draw measured and modelled observables, and their difference (paper's Figs. 3 and 4).

    Parameters
    ----------
    measured : xarray.Dataset
        From `Measurement.dataset`, along the bias or in time.
    model : xarray.Dataset
        The fitted lever at the measured biases or times, in the same order.
    fitted : sequence of str
        The observables that entered the fit.
    band : xarray.Dataset, optional
        `Estimate.band`: of the tip, which is then drawn with it, measured or not.
    """
    (along,) = map(str, measured.sizes)
    in_time = along == "time"
    # in time what was measured and the tip; else what the lever has, such as a reader
    data = measured if in_time else model
    panels = {
        name: column.name
        for name, column in FITTED.items()
        # what a contact shows is there if it was measured
        if (column.name in (data if name in OBSERVABLES else measured) and column.name in model)
        and (data[column.name].notnull().any() or (in_time and name == "tip"))
    }
    size, heights = (3.4 if in_time else 2.8) * len(panels), (1.8, 1.0)
    with figure(size, 4.6, 2, len(panels), sharex=True, height_ratios=heights) as (fig, grid):
        for (upper, lower), (name, column) in zip(grid.T, panels.items(), strict=True):
            seen = column in measured and measured[column].notnull().any()
            complete = model.dropna(along, subset=[column])
            if band is not None and name == "tip":
                complete = band
                if _stated(band):
                    width = BAND * band.tip_stderr_K
                    low, high = band.tip_K - width, band.tip_K + width
                    upper.fill_between(band.time, low, high, color=SKY, label="95 %")
            curve(upper, complete, along, column, color=BLUE, label="model")
            if seen:
                points = {**MEASURED, "ms": 2.5, "zorder": 1} if in_time else MEASURED
                curve(upper, measured, along, column, **points)
                _differences(lower, measured, model, name)
            elif band is not None and _stated(band):
                curve(lower, band, along, "tip_stderr_K", color=VERMILION)
                lower.set(ylabel="standard error (K)", ylim=(0, None))
            if name not in fitted:
                where: Any = {"xycoords": "axes fraction", "ha": "right", "color": "0.4"}
                upper.annotate("not fitted", (0.96, 0.05), **where)
            lower.set(xlabel=axis_label(along))
        if in_time and settled(measured):
            grid[0, 0].set_xscale("log")
        entitle(fig, model, is_described=band is None or _stated(band))
        panel_letters(grid[0])
        # the tip has a band of its own
        for axes in {grid[0, 0], grid[0, 0 if band is None else list(panels).index("tip")]}:
            axes.legend(loc="best")
    return fig


def _differences(axes: Axes, measured: xr.Dataset, model: xr.Dataset, name: str) -> None:
    """Draw data minus model of an observable, and mark what is off by more than is usual."""
    (along,), column, (unit, factor) = measured.sizes, FITTED[name].name, FITTED[name].small
    x, data = measured[along].values, measured[column].values
    difference = data - model[column].values
    axes.axhline(0, color="0.4", lw=0.8)
    axes.set(ylabel=f"data − model ({unit})")
    if along == "time":
        axes.plot(x, difference * factor, "o", color=VERMILION, ms=2)
        return
    axes.plot(x, difference * factor, "o-", color=VERMILION, lw=0.8, ms=3.5)
    if unit == "K":
        # rows without a temperature would cut the errors of the others into lines
        seen = np.isfinite(difference)
        error = measured[column.replace("_K", "_error_K")].values[seen]
        axes.fill_between(x[seen], -error, error, color="0.9", label="± dT")
        return
    usual = DiagnosisOptions.usual_scatter
    off = np.abs(difference) > usual * np.nanmax(np.abs(data), initial=0.0)
    if off.any():
        style: Any = {"mfc": "none", "label": f"off by more than {usual:.1%}"}
        axes.plot(x[off], difference[off] * factor, "o", ms=5.5, color=BLACK, **style)
        axes.legend(loc="best")


def _stated(band: xr.Dataset) -> bool:
    """Whether a band has errors: there are none of a lever that does not show its data."""
    return bool(band.tip_stderr_K.notnull().any())


def correlation_matrix(names: Sequence[str], correlation: Array, lever: str = "") -> Figure:
    """Draw the correlation of fitted parameters (paper's Fig. 4 d-f), titled by the lever."""
    count = len(names)
    with figure(1.2 + 0.52 * count, 0.6 + 0.52 * count) as (fig, axes):
        image = axes.imshow(correlation, cmap="PuOr", vmin=-1, vmax=1)
        symbols = [parameter_named(name).symbol for name in names]
        # names of dimensions are long
        axes.set_xticks(range(count), symbols, rotation=90 if max(map(len, symbols)) > 4 else 0)
        axes.set_yticks(range(count), symbols)
        axes.grid(False)
        for (row, column), value in np.ndenumerate(correlation):
            colour = "white" if abs(value) > 0.7 else "black"
            style: Any = {"ha": "center", "va": "center", "fontsize": 7.5}
            axes.text(column, row, f"{round(value, 2) + 0.0:.2f}", color=colour, **style)
        fig.colorbar(image, label="correlation (1)", shrink=0.9)
        entitle(fig, more=lever)
    return fig


def tip_band(band: xr.Dataset, measured: xr.Dataset | None = None) -> Figure:
    """Draw the band of predicted tip temperature against bias and power, and its width.

    Errors of a fit are those at a bias, by the power too; a posterior has those at a power. Of a
    lever that does not show its data the tip temperature alone is drawn, and the title says so.

    Parameters
    ----------
    band : xarray.Dataset
        `Estimate.band`, or from `hotlever.estimate.sampling.predictive_band`.
    measured : xarray.Dataset, optional
        From `Measurement.dataset`; drawn as points.
    """
    stated, at = True, ""
    if "quantile" in band.coords:
        by_bias, by_power, middle_name = band.tip_K.values, band.tip_at_power_K.values, "median"
    else:
        # at a power, of which the bias is not quite known, errors are others
        at = " at a bias"
        stated = _stated(band)
        away = ndtri((0.025, 0.16, 0.5, 0.84, 0.975))[:, None] * band.tip_stderr_K.values
        by_bias = by_power = band.tip_K.values + away
        by_bias[2] = band.tip_K.values  # where no error is stated too
        middle_name = "prediction" if stated else "the nearest lever"
    panels = [("bias", by_bias, "bias V$_b$ (V)")]
    # with held supplies there may be several temperatures at one power
    if np.all(np.diff(band.power_mW.values) >= 0):
        panels.append(("power_mW", by_power, "power P$_l$ (mW)"))
    ratios = (1.8, 1.0) if stated else (1.0,)
    shape: Any = {"sharex": "col", "height_ratios": ratios, "squeeze": False}
    size = 3.7 * len(panels), 5.0 if stated else 3.6
    with figure(*size, len(ratios), len(panels), letters=True, **shape) as (fig, grid):
        entitle(fig, band, is_described=stated)
        for (upper, *lower), (name, rows, label) in zip(grid.T, panels, strict=True):
            x = band[name].values
            upper.plot(x, rows[2], color=BLUE, label=middle_name)
            if stated:
                _band(upper, x, rows, 0.0)
                upper.fill_between([], [], color=BLUE, alpha=0.55, label=f"68 %{at}")
                upper.fill_between([], [], color=BLUE, alpha=0.25, label=f"95 %{at}")
            for axes in lower:
                _band(axes, x, rows, rows[2])
                axes.axhline(0, color=BLUE, lw=0.8)
                axes.set(ylabel=f"T$_{{tip}}$ − {middle_name} (K)")
            if measured is not None:
                upper.plot(measured[name], measured.tip_K, **MEASURED, ms=3.5)
            upper.set(ylabel="tip temperature (K)")
            [upper, *lower][-1].set(xlabel=label, xlim=from_zero(x))
        grid[0, 0].legend(loc="upper left")
    return fig


def _band(axes: Axes, x: Array, rows: Array, zero: Array | float) -> None:
    """Fill what 68 and 95 % lie between, of five quantiles (5, n), beside a line or as they are."""
    low95, low68, _, high68, high95 = rows - zero
    axes.fill_between(x, low95, high95, color=BLUE, alpha=0.25, lw=0)
    axes.fill_between(x, low68, high68, color=BLUE, alpha=0.45, lw=0)


def profile_curves(profiles: Sequence[xr.Dataset]) -> Figure:
    """Draw profile likelihoods beside the parabolas of the standard errors.

    Parameters
    ----------
    profiles : sequence of xarray.Dataset
        From `hotlever.estimate.uncertainty.profile_likelihood`.
    """
    columns = min(3, len(profiles))
    rows = math.ceil(len(profiles) / columns)
    width, height = 2.9 * columns + 0.3, 2.6 * rows + 0.4
    with figure(width, height, rows, columns, squeeze=False) as (fig, grid):
        panels = grid.ravel()[: len(profiles)]
        for axes, profile in zip(panels, profiles, strict=True):
            _profile(axes, profile)
        for axes in grid.ravel()[len(profiles) :]:
            axes.remove()
        panel_letters(panels)
        entitle(fig, *profiles)
        grid[0, 0].legend(loc="upper center", frameon=True, facecolor="white", edgecolor="none")
    return fig


def _profile(axes: Axes, profile: xr.Dataset) -> None:
    label, unit = parameter_label(profile.attrs["quantity"])
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
        limit = chdtri(1, 1.0 - level)
        axes.axhline(limit, color="0.4", lw=0.8, ls=":")
        where: Any = {"xycoords": ("axes fraction", "data"), "ha": "center", "va": "bottom"}
        axes.annotate(f"{100 * level:.0f} %", (0.5, limit), color="0.4", fontsize=8, **where)
    axes.set(xlabel=label, ylabel="Δχ²", ylim=(0, 8))
    axes.xaxis.set_major_locator(MaxNLocator(4))


def posterior_corner(posterior: xr.Dataset, optimum: Mapping[str, float] | None = None) -> Figure:
    """Draw the posterior of each quantity, and of each pair with its 68 and 95 % regions.

    Parameters
    ----------
    posterior : xarray.Dataset
        From `hotlever.estimate.sampling.sample_posterior`.
    optimum : mapping of str to float, optional
        Value of each quantity to mark.
    """
    names = posterior.quantity.values.tolist()
    labels = {name: parameter_label(name) for name in names}
    values = {name: posterior[name].values.ravel() / labels[name][1] for name in names}
    marks = {name: value / labels[name][1] for name, value in (optimum or {}).items()}
    # blue over white, as transparent colours cannot be stacked in filled contours
    light, dark = "#BFDBEB", "#5DA5CC"
    size = 1.3 * len(names) + 0.8
    with figure(size, size, len(names), len(names), squeeze=False) as (fig, grid):
        for (row, column), axes in np.ndenumerate(grid):
            down, across = names[row], names[column]
            if column > row:
                axes.remove()
                continue
            if row == column:
                _histogram(axes, values[across])
            else:
                _pair(axes, values[across], values[down], (light, dark))
                axes.set(xlim=_range(values[across]), ylim=_range(values[down]))
                axes.yaxis.set_major_locator(MaxNLocator(3))
            axes.grid(False)
            axes.xaxis.set_major_locator(MaxNLocator(3))
            axes.tick_params(axis="x", labelrotation=45)
            left, bottom = column == 0 and row > 0, row == len(names) - 1
            axes.tick_params(labelbottom=bottom, labelleft=left)
            if marks:
                axes.axvline(marks[across], color=VERMILION, lw=0.8)
                if row != column:
                    axes.axhline(marks[down], color=VERMILION, lw=0.8)
            if bottom:
                axes.set_xlabel(labels[across][0])
            if left:
                axes.set_ylabel(labels[down][0])
        fig.align_labels()
        entitle(fig, posterior)
        handles = [Patch(color=dark, label="68 %"), Patch(color=light, label="95 %")]
        if marks:
            handles.append(Patch(color=VERMILION, label="optimum of the fit"))
        fig.legend(handles=handles, loc="upper right", fontsize=10)
    return fig


def _histogram(axes: Axes, values: Array) -> None:
    axes.hist(values, bins=30, color=SKY)
    low, middle, high = np.percentile(values, (16, 50, 84))
    axes.axvspan(low, high, color="0.9", zorder=0)
    axes.set_title(value_with_error(middle, (high - low) / 2.0, bounds=(-math.inf, math.inf)))
    axes.set(yticks=[], xlim=_range(values))


def _range(values: Array) -> tuple[float, float]:
    low, high = np.percentile(values, (0.2, 99.8))
    margin = 0.1 * (high - low)
    return float(low - margin), float(high + margin)


def _pair(axes: Axes, x: Array, y: Array, colours: tuple[str, str]) -> None:
    """Draw the smallest regions that hold 95 and 68 % of the samples."""
    counts, x_edges, y_edges = np.histogram2d(x, y, bins=40, range=(_range(x), _range(y)))
    smooth = gaussian_filter(counts, 1.5)
    falling = np.sort(smooth.ravel())[::-1]
    share = np.cumsum(falling) / falling.sum()
    outer, inner = (falling[np.searchsorted(share, level)] for level in (0.95, 0.68))
    middles = [(edges[1:] + edges[:-1]) / 2 for edges in (x_edges, y_edges)]
    if 0.0 < outer < inner < falling[0]:
        levels = [outer, inner, falling[0]]
        axes.contourf(*middles, smooth.T, levels=levels, colors=colours)


def lever_parameters(levers: xr.Dataset) -> Figure:
    """Draw each quantity by lever with its standard error, and mean and scatter of the levers.

    Parameters
    ----------
    levers : xarray.Dataset
        From `hotlever.estimate.many.compare_levers`; without what was held.
    """
    count = levers.sizes["lever"]
    many = are_numbered(count)
    determined = (np.isfinite(levers.stderr) & levers.counts).any("lever")
    free = levers.quantity.values[determined.values].tolist()
    height, shape = 1.2 * len(free) + (0.8 if many else 1.2), {"sharex": True, "squeeze": False}
    with figure(7.4, height, len(free), 1, letters=True, **shape) as (fig, grid):
        column = grid[:, 0]
        for name, axes in zip(free, column, strict=True):
            quantity = levers.sel(quantity=name)
            label, scale = parameter_label(name)
            values_by_lever(axes, quantity, scale)
            # a unit below the symbol, as the panels are low
            axes.set_ylabel(label.replace(" (", "\n(", 1))
        if many:
            column[-1].set(xlabel="lever", xlim=(0, count + 1))
        else:
            named: Any = {"rotation": 45, "ha": "right", "parse_math": False}
            column[-1].set_xticks(np.arange(1, count + 1), levers.lever.values, **named)
            column[-1].set_xlim(0.5, count + 0.5)
        fig.align_ylabels()
        handles, labels = column[0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return fig


def calibration_curves(calibration: Estimate) -> Figure:
    """Draw the tip temperature against power and bias with its band, the knee and the budget.

    Where the lever does not show what was measured, the difference stands in place of the budget,
    with the rows marked that are off, no band is drawn, and the title says so. The peak of a pulse,
    if calibrated, stands beside the static curve.
    """
    table, knee, described = calibration.table, calibration.knee, calibration.describes_data
    power = table.power_mW
    measured = calibration.measurement.dataset(calibration.probe.circuit)
    of_the_contact = {"apex_K": ("apex", GREEN), "surface_K": ("the sample under it", VERMILION)}
    with figure(8.0, 6.0, 2, 2, letters=True) as (fig, grid):
        by_power, by_bias, iv, budget = grid.ravel()
        entitle(fig, more=calibration.probe.title, is_described=bool(described))
        # at a power, of which the bias is not quite known, errors are others
        name = "calibration, 95 % at a bias" if described else "the nearest lever"
        if described and "apex_K" in table:
            name = "tip, 95 % at a bias"
        for axes, along in ((by_power, "power_mW"), (by_bias, "bias_V")):
            if described:
                low, high = table.tip_low_K, table.tip_high_K
                axes.fill_between(table[along], low, high, color=SKY, alpha=0.6, lw=0)
            curve(axes, table, along, "tip_K", color=BLUE, label=name)
            curve(axes, measured, along, "tip_K", **MEASURED)
            for column, (label, colour) in of_the_contact.items():
                if column in table:
                    curve(axes, table, along, column, color=colour, label=label)
                if column in measured:
                    curve(axes, measured, along, column, **MEASURED | {"mfc": colour})
            if "apex_K" in table:
                axes.set_ylabel("temperature (K)")
        if calibration.power_law is not None and np.isfinite(calibration.k):
            law = calibration.power_law.scaled(calibration.k)
            expected = law.tip_temperature(power, calibration.base_temperature_K)
            by_power.plot(power, expected, "--", color=ORANGE, label="power law at P$_l$/k")
        if knee.power_mW <= power.max():
            by_power.axvline(knee.power_mW, color=VERMILION, lw=0.9, ls=":")
            base = calibration.base_temperature_K
            by_power.annotate(" knee", (knee.power_mW, base), color=VERMILION)
        by_power.legend(loc="upper left")
        if calibration.pulse is not None:
            _pulse(by_bias, calibration.pulse)
        curve(iv, measured, "lever_V", "current_mA", **MEASURED)
        name = "calibrated lever" if described else "the nearest lever"
        curve(iv, table, "lever_V", "current_mA", color=BLUE, label=name)
        if calibration.knee_measured:
            across, up = BAND * knee.lever_V_stderr, BAND * knee.current_mA_stderr
            label = "knee, 95 %" if described else "its knee"
            style: Any = {"fmt": "s", "color": VERMILION, "label": label}
            iv.errorbar(knee.lever_V, knee.current_mA, xerr=across, yerr=up, **style)
        iv.set(xlim=from_zero(table.lever_V), ylim=from_zero(table.current_mA))
        iv.legend(loc="upper left")
        if described:
            _budget(budget, table)
        else:
            _difference(budget, calibration, measured)
    return fig


def calibrated_levers(calibrations: Mapping[str, Estimate], levers: xr.Dataset) -> Figure:
    """Draw where the calibrations of several levers differ.

    Parameters
    ----------
    calibrations : mapping of str to Estimate
        By lever; those whose data are not described are left out.
    levers : xarray.Dataset
        From `hotlever.estimate.many.compare_levers`.
    """
    along, count = levers.attrs["along"], levers.sizes["lever"]
    tips, many = tips_along(calibrations, along), count > len(LINES)
    # one alone differs from no mean
    several = tips.tip_K.notnull().sum("lever") > 1
    mean = tips.tip_K.mean("lever").where(several)
    named: Any = {"rotation": 45, "ha": "right", "parse_math": False, "fontsize": 7}
    with figure(8.0, 7.6, 3, 2, letters=True) as (fig, grid):
        curves, differences, *by_lever = grid.ravel()
        for tip, (line, colour) in zip(tips.tip_K, cycle(LINES), strict=False):
            style: Any = {"color": colour, "ls": line, "lw": 0.8 if many else 1.2}
            curves.plot(tips[along], tip, label=tip.lever.item(), **style)
            differences.plot(tips[along], tip - mean, **style)
        half = BAND * tips.tip_stderr_K.mean("lever")
        band: Any = {"color": "0.88", "lw": 0, "label": "95 % of a lever"}
        differences.fill_between(tips[along], -half, half, **band)
        differences.legend(loc="upper left")
        curves.set(ylabel=axis_label("tip_K"))
        differences.set(ylabel="difference from the mean (K)")
        for axes in (curves, differences):
            axes.axvline(levers[along].values[0], color="0.6", lw=0.8, ls=":")
            axes.set(xlabel=axis_label(along))
        if not many:
            fig.legend(*curves.get_legend_handles_labels(), loc="outside lower center", ncols=6)
        for name, axes in zip(
            ("tip_K", "knee_lever_V", "knee_current_mA", "knee_power_mW"), by_lever, strict=True
        ):
            values_by_lever(axes, levers.sel(quantity=name))
            axes.set(ylabel=levers.heading.sel(quantity=name).item(), xlim=(0.5, count + 0.5))
            if many:
                axes.set(xlabel="lever")
            else:
                axes.set_xticks(np.arange(1, count + 1), levers.lever.values, **named)
    return fig


def judged_calibrations(judged: xr.Dataset) -> Figure:
    """Draw how wrong each way of calibrating is, and whether the stated errors hold.

    Parameters
    ----------
    judged : xarray.Dataset
        From `hotlever.studies.simulation_based_calibration.concatenated`.
    """
    largest, other = abs(judged.off_K).max("row"), judged.other_law.values
    ratio = (judged.off_K.sel(way=ESTIMATE) / judged.stated_K).transpose("lever", "row")
    laws = [law for law in (False, True) if law in other]
    colours = (BLUE, GREEN, ORANGE, VERMILION)
    with figure(8.0, 3.8, 1, 2, letters=True) as (fig, (by_way, by_bias)):
        beside: Any = {"transform": by_way.get_yaxis_transform(), "va": "center", "fontsize": 8}
        for row, (way, colour) in enumerate(zip(WAYS, colours, strict=True)):
            for law in laws:
                at = row + (0.2 if law else -0.2) * (len(laws) - 1)
                here = largest.sel(way=way).values[other == law]
                marks: Any = {"color": colour, "mfc": "white" if law else colour}
                by_way.plot(here, np.linspace(-0.12, 0.12, here.size) + at, "o", ms=4, **marks)
                middle = float(np.nanmedian(here))
                by_way.plot([middle] * 2, [at - 0.18, at + 0.18], color=BLACK, lw=2)
                by_way.text(1.01, at, f"{middle:.0f} K", **beside)
        by_way.set(xscale="log", xlabel="largest error above 400 K (K); bar, right: median")
        by_way.set(yticks=range(len(WAYS)), ylim=(len(WAYS) - 0.4, -0.6))
        by_way.set_yticklabels([way.replace(" at ", "\nat ") for way in WAYS])
        by_way.xaxis.set_major_formatter("{x:g}")
        for level, limit in reversed(LEVELS.items()):
            by_bias.axhspan(-limit, limit, color=SKY, alpha=0.3, lw=0)
            by_bias.annotate(f"stated {level:.0%} ", (1, limit), ha="right", va="top", fontsize=7)
        for law in laws:
            marks = {"color": BLACK, "mfc": "white" if law else BLACK, "ls": "--" if law else "-"}
            label = "another law" if law else "mobility of Eq. 8"
            by_way.plot([], [], "o", label=label, **{**marks, "ls": "none"})
            for errors in ratio.values[other == law]:
                finite = errors[np.isfinite(errors)]
                share = np.linspace(0.0, 1.0, finite.size)
                by_bias.plot(share, finite, color=colours[0], ls=marks["ls"], lw=0.9)
            by_bias.plot([], [], color=colours[0], ls=marks["ls"], label=label)
        by_bias.axhline(0.0, color=BLACK, lw=0.8)
        by_bias.set(xlim=(0, 1), xlabel="bias V$_b$ (above 400 K)")
        by_bias.set(ylabel="error of the estimate (stated errors)")
        by_bias.set_xticks([0, 1], ["400 K", "hottest"])
        for axes in (by_way, by_bias):
            axes.legend(loc="lower left", bbox_to_anchor=(0.1, 1.0), ncols=2, borderpad=0.1)
    return fig


def _pulse(axes: Axes, pulse: PulseCalibration) -> None:
    """Draw the peak of a pulse by its height, with its band."""
    table = pulse.table
    axes.fill_between(table.height_V, table.peak_low_K, table.peak_high_K, color=ORANGE, alpha=0.4)
    axes.plot(table.height_V, table.peak_K, color=VERMILION, label=f"peak of {pulse.timing.text}")
    axes.legend(loc="upper left")


def _budget(axes: Axes, table: xr.Dataset) -> None:
    """Draw the standard error of the tip temperature by source."""
    # black is that of all together
    lines = cycle((line, colour) for line, colour in LINES if colour != BLACK)
    for source, (line, colour) in zip(table.source.values, lines, strict=False):
        part = table.budget_K.sel(source=source)
        axes.plot(table.tip_K, part, ls=line, color=colour, label=source)
    axes.plot(table.tip_K, table.tip_stderr_K, color=BLACK, lw=2.0, label="together")
    axes.set(xlabel=axis_label("tip_K"), ylabel="standard error (K)", ylim=(0, None))
    axes.legend(loc="upper left")


def _difference(axes: Axes, calibration: Estimate, measured: xr.Dataset) -> None:
    """Draw data minus the nearest lever, and mark the rows that are off."""
    table, data = calibration.table, measured.dropna("bias", subset=["current_mA"])
    expected = np.interp(data.bias_V, table.bias_V, table.current_mA)
    share = 100 * (data.current_mA - expected) / float(np.abs(data.current_mA).max())
    usual = 100 * DiagnosisOptions.usual_scatter
    off = np.abs(share) > usual
    axes.axhspan(-usual, usual, color="0.9", lw=0, label="as usual")
    axes.plot(data.bias_V, share, "o", color=BLACK, ms=3.0, label="measured")
    axes.plot(data.bias_V[off], share[off], "o", color=VERMILION, ms=5.0, label="off")
    axes.set(xlabel=axis_label("bias_V"), ylabel="I$_h$: data − lever (% of the largest)")
    axes.legend(loc="best")


def planned_measurements(plan: Plan) -> Figure:
    """Draw the error by temperature now and after more measurements, and how hot the tip may get.

    The proposed measurements are marked, with how often each is proposed, and the limit.
    """
    errors, proposals = plan.errors, plan.proposals
    finite = np.isfinite(errors.tip_limit_K.values)
    at_bias = proposals.isel(proposal=np.isfinite(proposals.bias_V.values))
    kinds = at_bias.what.values.tolist()
    counts = Counter(zip(kinds, at_bias.bias_V.values.tolist(), strict=True))
    style_by_kind = {
        "bias": {"marker": "o", "color": BLUE},
        "reader": {"marker": "s", "color": GREEN},
        "spectra": {"marker": "^", "color": PURPLE},
    }
    with figure(8.0, 3.8, 1, 2, letters=True) as (fig, (by_tip, by_bias)):
        entitle(fig, more=plan.lever)
        for added, colour in zip(
            errors.added.values.tolist(), cycle((BLACK, ORANGE, GREEN, BLUE, SKY)), strict=False
        ):
            label = f"after {added} more" if added else "now"
            stderr = errors.tip_stderr_K.sel(added=added)
            by_tip.plot(errors.tip_K[finite], stderr[finite], color=colour, label=label)
        last = errors.tip_stderr_K.isel(added=-1)
        by_tip.axvline(plan.at_K, color="0.6", lw=0.9, ls=":")
        above: Any = {"xycoords": by_tip.get_xaxis_transform(), "color": "0.4", "fontsize": 7}
        by_tip.annotate(plan.aim, (plan.at_K, 1.0), **above)
        by_bias.plot(errors.bias[finite], errors.tip_K[finite], color=BLACK, label="expected")
        limit: Any = {"color": VERMILION, "label": f"no hotter, by {SURE:.0%}"}
        by_bias.plot(errors.bias[finite], errors.tip_limit_K[finite], "--", **limit)
        by_bias.axvspan(plan.safe_V, float(errors.bias[finite].max()), color="0.92", lw=0)
        if plan.stay_below_K is not None:
            by_bias.axhline(plan.stay_below_K, color=VERMILION, lw=0.9)
            text = f" limit {plan.stay_below_K:.0f} K"
            by_bias.annotate(text, (errors.bias.values[0], plan.stay_below_K), va="bottom")
        for (kind, bias), times in counts.items():
            tip = float(np.interp(bias, errors.bias, errors.tip_K))
            stderr_K = float(np.interp(bias, errors.bias, last))
            style = {"ls": "none", "ms": 7.0, "mec": "white", **style_by_kind[kind], "zorder": 3}
            for axes, at in ((by_bias, (bias, tip)), (by_tip, (tip, stderr_K))):
                axes.plot(*at, **style)
                if times > 1:
                    axes.annotate(f" {times}×", at, fontsize=7, va="top")
        for kind in dict.fromkeys(kinds):
            by_bias.plot([], [], ls="none", label=f"{kind}, proposed", **style_by_kind[kind])
        by_tip.set(xlabel=axis_label("tip_K"), ylabel="standard error (K)", ylim=(0, None))
        by_bias.set(xlabel=axis_label("bias_V"), ylabel=axis_label("tip_K"))
        for axes in (by_tip, by_bias):
            axes.legend(loc="upper left")
    return fig
