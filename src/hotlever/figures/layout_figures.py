"""Figures of the paper's lever: the layouts that what is printed leaves, and what they show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from hotlever import spieser2017 as paper
from hotlever.colours import BLACK, BLUE, GREEN, ORANGE, VERMILION
from hotlever.figures.style import beside, figure, parameter_label
from hotlever.studies.published_lever.ensemble import ANY, Ensemble
from hotlever.studies.published_lever.layouts import REFERENCE
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr


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
        See `hotlever.studies.published_lever.knee_suspects.carried`.
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
