"""Figures of claims: the paper's of its levers, layouts and air, and what others published."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotlever import spieser2017 as paper
from hotlever.figures.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    LINES,
    ORANGE,
    PURPLE,
    VERMILION,
    axis_label,
    beside,
    figure,
    parameter_label,
)
from hotlever.studies.linear_branch import Regression
from hotlever.studies.published_lever.ensemble import ANY, REFERENCE, Ensemble
from hotlever.studies.simulation_based_calibration import largest_deviation
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr


def disc_between_planes(loss: xr.Dataset) -> Figure:
    """Draw the loss of a disc between two planes over their distance (paper's Fig. 8)."""
    distance = loss.distance.values
    with figure(4.4, 3.2) as (fig, axes):
        axes.plot(distance, loss.loss, color=BLUE, label="exact")
        axes.plot(distance, loss.near, "--", color=ORANGE, label="near planes, 2π r/h")
        axes.plot(distance, loss.far, ":", color=VERMILION, label="free space, 8")
        axes.axhline(4.0, color="0.6", lw=0.8)
        where: Any = {"xytext": (4, 3), "textcoords": "offset points"}
        axes.annotate("4 (one face)", (distance[0], 4.0), color="0.4", fontsize=8, **where)
        axes.set(xscale="log", yscale="log", ylim=(3.0, 1.2 * float(loss.loss.max())))
        axes.set(xlabel="distance of the planes over radius, h/r", ylabel="heat loss / (κ r ΔT)")
        axes.legend()
    return fig


def scale_factor(curves: Mapping[str, xr.DataArray], published: float) -> Figure:
    """Draw k over the tip temperature for some surroundings.

    Parameters
    ----------
    curves : mapping of str to xarray.DataArray
        k on ``tip_K``, see `hotlever.studies.air_scaling`.
    published : float
        The paper's single k.
    """
    many = len(curves) > 1
    with figure(6.4 if many else 4.4, 3.4) as (fig, axes):
        for (name, k), (line, colour) in zip(curves.items(), cycle(LINES), strict=False):
            axes.plot(k.tip_K, k, line, color=colour, label=name)
        axes.axhline(published, color="0.5", ls=":", label=f"paper, {published}")
        axes.set(xlabel=axis_label("tip_K"), ylabel="k = P$_{air}$ / P$_{vacuum}$")
        if many:
            beside(axes)
        else:
            axes.legend(loc="upper left")
    return fig


def linear_branches(study: xr.Dataset, regression: Regression, spread_K: float) -> Figure:
    """Draw how straight T(P) is above the knee on many levers, and what its slope follows.

    Parameters
    ----------
    study : xarray.Dataset
        See `hotlever.studies.linear_branch.linear_branch_study`.
    regression : Regression
        Of its slopes.
    spread_K : float
        How closely the paper's law is said to hold.
    """
    with figure(7.6, 3.6, 1, 2, letters=True) as (fig, (off, slope)):
        _by_kind(off, study, study.knee_K, study.straight_K, fill=True)
        _by_kind(off, study, study.knee_K, study.proportional_K, fill=False)
        off.axhline(spread_K, color="0.5", ls=":")
        off.set(xlabel=axis_label("knee_K"), ylabel="largest distance from a line (K)")
        off.set_ylim(0.0, 1.25 * float(study.proportional_K.max()))
        handles = [
            off.plot([], [], ls="none", marker="o", color="0.4", mfc=face, label=label)[0]
            for face, label in (("0.4", "a line of its own"), ("none", "a line through T$_{RT}$"))
        ]
        off.legend(handles=handles, loc="upper right", ncols=2)
        expected = regression.factor * np.prod(
            [study[name] ** power for name, power in regression.exponents.items()], axis=0
        )
        _by_kind(slope, study, expected, study.slope_K_per_mW, fill=True)
        ends = [np.nanmin(expected), np.nanmax(expected)]
        slope.plot(ends, ends, color="0.5", lw=0.8)
        slope.set(xscale="log", yscale="log")
        ticks = [
            tick
            for tick in (50, 100, 150, 200, 300, 400, 600, 800)
            if ends[0] < 1.2 * tick and tick < 1.2 * ends[1]
        ]
        for axis in (slope.xaxis, slope.yaxis):
            axis.set_ticks(ticks, [f"{tick}" for tick in ticks])
            axis.set_ticks([], minor=True)
        slope.set(xlabel="slope by the regression (K/mW)", ylabel="slope (K/mW)")
        for shape, mark, dopant, colour in _kinds():
            name = f"{shape}, {dopant}-type"
            slope.plot([], [], ls="none", marker=mark, color=colour, label=name)
        slope.legend(loc="upper left")
    return fig


def _by_kind(axes: Axes, study: xr.Dataset, x: Any, y: Any, *, fill: bool) -> None:
    """Mark points by shape and dopant."""
    for shape, mark, dopant, colour in _kinds():
        here = ((study["shape"] == shape) & (study.dopant == dopant)).values
        face = colour if fill else "none"
        style: Any = {"ls": "none", "marker": mark, "color": colour, "mfc": face, "alpha": 0.8}
        axes.plot(np.asarray(x)[here], np.asarray(y)[here], **style)


def _kinds() -> list[tuple[str, str, str, str]]:
    """Return shapes with their markers, each with types of the heater and their colours."""
    shapes, dopants = (("three-leg", "o"), ("u-shape", "s")), (("n", BLUE), ("p", VERMILION))
    return [(*shape, *dopant) for shape in shapes for dopant in dopants]


def parameter_deviations(study: xr.Dataset, published: xr.Dataset, claimed: float) -> Figure:
    """Draw how far levers of one material are from their mean, by parameter and model error.

    Parameters
    ----------
    study, published : xarray.Dataset
        See `hotlever.studies.simulation_based_calibration`.
    claimed : float
        The paper's limit, a share of the mean.
    """
    ours, theirs = 100 * largest_deviation(study), 100 * largest_deviation(published)
    symbols = [parameter_label(name)[0].partition(" (")[0] for name in study.parameter.values]
    position = np.arange(len(symbols))
    shape: Any = {"sharey": True, "squeeze": False}
    with figure(8.4, 3.6, 1, study.sizes["doping"], letters=True, **shape) as (fig, [panels]):
        for axes, doping in zip(panels, study.doping.values, strict=True):
            columns = [
                (str(name), ours.sel(error=name, doping=doping)) for name in study.error.values
            ]
            columns.append(("the paper's four levers", theirs.sel(doping=doping)))
            colours = [*COLOURS[: len(columns) - 1], BLACK]
            beside_each = np.linspace(-0.3, 0.3, len(columns))
            for (name, values), colour, aside in zip(columns, colours, beside_each, strict=True):
                at, positive = position + aside, values.where(values > 0)
                axes.plot(at, positive, "_" if colour == BLACK else "o", color=colour, label=name)
            axes.axhline(100 * claimed, color=ORANGE, ls=":")
            axes.set_xticks(position, symbols)
            axes.set_title(str(doping), loc="center")
            axes.set_ylim(0.0, None)
        panels[0].set(ylabel="largest distance from the mean (%)")
        beside(panels[-1])
    return fig


def radiated_shares(levers: Mapping[str, xr.Dataset]) -> Figure:
    """Draw how much of their power levers radiate, and how much cooler that makes their tips.

    Parameters
    ----------
    levers : mapping of str to xarray.Dataset
        See `hotlever.studies.radiation.radiated_heat`.
    """
    with figure(7.6, 3.4, 1, 2, letters=True) as (fig, (share, fall)):
        for name, data in levers.items():
            share.plot(data.tip, 100.0 * data.radiated_mW / data.power_mW, label=name)
            fall.plot(data.tip, data.cooler_K, label=name)
        share.set(ylabel="share of the power (%)")
        fall.set(ylabel="fall of the tip at the same power (K)")
        for axes in (share, fall):
            axes.set(xlabel=axis_label("tip_K"), yscale="log")
        share.set_ylim(top=10.0 * share.get_ylim()[1])  # for the legend
        share.legend(loc="upper left")
    return fig


def thermoelectric_shift(shift: xr.Dataset, other: xr.Dataset | None = None) -> Figure:
    """Draw where the hot spot is for either polarity, and which heat moves it.

    Parameters
    ----------
    shift : xarray.Dataset
        From `hotlever.studies.thermoelectric_shift.shift_by_heat`.
    other : xarray.Dataset, optional
        The same of a lever with carriers of the other sign.
    """
    by_heat = shift.share_nm.sum("side").sel(polarity=1)
    with figure(7.6, 3.4, 1, 2, letters=True) as (fig, (position, displacement)):
        without = "without thermoelectricity"
        position.plot(shift.bias, shift.plain_um, ":", color=BLACK, label=without)
        for polarity, mark, colour in ((1, "o-", BLUE), (-1, "s-", ORANGE)):
            label = f"{'positive' if polarity > 0 else 'negative'} bias"
            at_um = shift.at_um.sel(polarity=polarity)
            position.plot(shift.bias, at_um, mark, color=colour, label=label)
        position.axhline(0.0, color=BLACK, lw=0.6)
        position.set(xlabel="size of the bias (V)", ylabel="hot spot: supply ←   (µm)   → ground")
        position.legend()
        whole = shift.moved_nm.sel(polarity=1)
        displacement.plot(shift.bias, whole, "o-", color=BLUE, label="all")
        for heat, colour in (("Peltier", VERMILION), ("Thomson", GREEN)):
            values = by_heat.sel(heat=heat)
            displacement.plot(shift.bias, values, "--", color=colour, label=f"{heat} heat")
        if other is not None:
            values = other.moved_nm.sel(polarity=1)
            displacement.plot(other.bias, values, "^-", color=PURPLE, label="all, with boron")
        displacement.axhline(0.0, color=BLACK, lw=0.6)
        displacement.set(
            xlabel="bias (V)", ylabel=axis_label("moved_nm").replace(" in the", "\nin the")
        )
        displacement.legend()
    return fig


def predicted_and_published(cases: xr.Dataset) -> Figure:
    """Draw bands of predictions and published values, each over the predicted median.

    Parameters
    ----------
    cases : xarray.Dataset
        From `hotlever.studies.validation.prediction.comparison`.
    """
    cases = cases.sortby("group")
    colour_by_verdict = {"inside 68 %": GREEN, "inside 95 %": ORANGE, "outside": VERMILION}
    # so many inches for each published number, and some above and below them
    with figure(7.4, 0.24 * cases.sizes["case"] + 0.9) as (fig, axes):
        rows = np.arange(cases.sizes["case"])[::-1]
        low, high, middle = (
            (cases[name] / cases.predicted).values for name in ("low_95", "high_95", "published")
        )
        axes.hlines(rows, low, high, color="0.75", lw=6, label="predicted, 95 %")
        axes.plot(np.ones_like(middle), rows, "|", color=BLACK, ms=9, label="predicted median")
        error = (cases.published_error / cases.predicted).values
        # as a share, below and above, so that what is uncertain to all of it stays on the page
        lower = middle - middle / (1.0 + error / middle)
        for verdict, colour in colour_by_verdict.items():
            of = (cases.verdict == verdict).values
            style: Any = {"fmt": "o", "color": colour, "lw": 1.2, "label": f"published, {verdict}"}
            axes.errorbar(middle[of], rows[of], xerr=[lower[of], error[of]], **style)
        axes.axvline(1.0, color="0.5", lw=0.6)
        axes.set(xscale="log", xlabel="over the predicted median", ylim=(-0.6, len(rows) - 0.4))
        ticks = [
            tick
            for tick in (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
            if low.min() < tick < high.max()
        ]
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.set_xticks([], minor=True)
        axes.set_yticks(rows, cases.case.values)
        axes.grid(False, axis="y")
        fig.legend(loc="outside upper center", ncols=3)
    return fig


def residuals_of_current(bias_V: Array, residuals_uA: Array, error_uA: float) -> Figure:
    """Draw measured less calibrated currents (µA) and the error of reading them off."""
    with figure(7.4, 2.4) as (fig, axes):
        axes.axhspan(-error_uA, error_uA, color="0.9")
        axes.axhline(0.0, color="0.5", lw=0.6)
        axes.plot(bias_V, residuals_uA, "o", color=BLACK, ms=4)
        axes.set(xlabel="V$_b$ (V)", ylabel="residual of I$_h$ (µA)")
    return fig


def printed_statements(found: Ensemble) -> Figure:
    """Draw how far layouts are from each statement of the paper.

    Parameters
    ----------
    found : Ensemble
    """
    deviations = abs(found.deviations)
    names = [str(name) for name in deviations.statement.values]
    rows = np.arange(len(names))
    drawn = found.numbers.drawn.values
    areas = _areas(found)
    with figure(7.6, _height(names)) as (fig, axes):
        for row, name in enumerate(names):
            values = deviations.sel(statement=name).values[drawn]
            style: Any = {"color": BLUE, "alpha": 0.35, "edgecolors": "none"}
            label = "layouts, by weight" if row == 0 else None
            axes.scatter(values, np.full(values.size, row), areas, label=label, **style)
        others = ((found.nearest, "D", ORANGE), (REFERENCE, "x", BLACK))
        for name, marker, colour in others:
            axes.plot(deviations.sel(layout=name), rows, marker, color=colour, label=name)
        axes.axvline(1.0, color=BLACK, lw=0.8, ls=":")
        axes.set_yticks(rows, names)
        axes.invert_yaxis()
        axes.set_xlabel("distance from what is printed, over what it may be off by")
        axes.legend(loc="lower right")
    return fig


def layouts_by_length(found: Ensemble) -> Figure:
    """Draw widths of the layouts by their length, and k in air, of which only the size decides.

    Parameters
    ----------
    found : Ensemble
    """
    numbers, drawn = found.numbers, found.numbers.drawn.values
    areas = _areas(found)
    length = numbers.length_um.values
    nearest, reference = (found.names.index(name) for name in (found.nearest, REFERENCE))
    lengths = (25, 40, 60, 100)
    marked = (1.5, 2, 3, 5, 10)
    marks = {
        "centre_leg_width_um": ("o", BLUE),
        "outer_leg_width_um": ("s", GREEN),
        "heater_width_um": ("^", VERMILION),
    }
    with figure(8.4, 3.4, 1, 2, letters=True) as (fig, (widths, air)):
        for name, (marker, colour) in marks.items():
            values = numbers[name].values
            label = parameter_label(name)[0].partition(" (")[0]
            style: Any = {"color": colour, "alpha": 0.5, "edgecolors": "none"}
            widths.scatter(length[drawn], values[drawn], areas, marker=marker, label=label, **style)
            widths.plot(length[nearest], values[nearest], "D", color=ORANGE)
            widths.plot(length[reference], values[reference], "x", color=BLACK)
        widths.set(xscale="log", yscale="log", xlabel="length (µm)", ylabel="width (µm)")
        widths.set_yticks(marked, map(str, marked))
        widths.legend()
        columns = {
            "k_400": ("400 K", BLUE),
            "k_893": (f"{paper.KNEE_PREDICTED_K:.0f} K", GREEN),
            "k_1150": ("1150 K", VERMILION),
            "eq12_k": ("best with Eq. 12", ORANGE),
        }
        for name, (label, colour) in columns.items():
            order = np.argsort(length[drawn])
            x, y = length[drawn][order], numbers[name].values[drawn][order]
            air.plot(x, y, "o-" if name == "eq12_k" else ".-", color=colour, label=label)
        air.axhline(paper.K_IN_AIR, color=BLACK, lw=0.8, ls=":", label="the paper")
        air.axvline(paper.SPHERE_UM, color="0.6", lw=0.8)
        air.set(xscale="log", xlabel="length (µm)", ylabel="power in air over that in vacuum")
        for axes in (widths, air):
            axes.set_xticks(lengths, map(str, lengths))
            axes.minorticks_off()
        beside(air)
    return fig


def _areas(found: Ensemble) -> Array:
    """Return the areas of the markers of layouts that are drawn, by their weight."""
    return np.asarray(8.0 + 600.0 * found.weights.sel(size=ANY).values[found.numbers.drawn.values])


def _height(rows: Sequence[str]) -> float:
    """Return how high (inches) a figure of some rows is."""
    return 0.27 * len(rows) + 1.0


def knee_carried(carried: xr.Dataset, nearest: str, discrepancy_K: float) -> Figure:
    """Draw what carries how much of the knee's discrepancy, in some layouts.

    Parameters
    ----------
    carried : xarray.Dataset
        On ``layout`` and ``suspect``: ``moved_K``, ``shift_K`` and ``ramp_K``, see
        `hotlever.studies.knee_study.Carried`.
    nearest : str
        The layout whose values are bars.
    discrepancy_K : float
        The paper's.
    """
    names = [str(name) for name in carried.suspect.values]
    rows = np.arange(len(names))
    with figure(7.8, _height(names)) as (fig, axes):
        for column, aside, colour, label in (
            ("moved_K", -0.2, "0.7", "model not fitted"),
            ("shift_K", 0.2, BLUE, "model fitted"),
        ):
            values = carried[column]
            own = values.sel(layout=nearest).values
            away = np.stack([own - values.min("layout").values, values.max("layout").values - own])
            style: Any = {"color": colour, "ecolor": BLACK, "capsize": 2}
            error = {"elinewidth": 0.8}
            axes.barh(rows + aside, own, 0.38, xerr=away, label=label, error_kw=error, **style)
        off_the_ramp = carried.ramp_K.sel(layout=nearest)
        axes.plot(off_the_ramp, rows, "D", ms=4, color=ORANGE, label="fitted, off the ramp")
        axes.axvline(0.0, color=BLACK, lw=0.6)
        axes.axvline(discrepancy_K, color=BLACK, lw=0.8, ls=":", label="in the paper")
        axes.set_yticks(rows, names)
        axes.invert_yaxis()
        axes.set_xlabel("knee as read less that of the model (K)")
        axes.legend(loc="lower right")
    return fig
