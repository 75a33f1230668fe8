"""Figures of the air around a lever, and of what it costs."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import SymLogNorm
from matplotlib.figure import Figure

from hotlever.air.panels import Panels
from hotlever.colours import BLACK, BLUE, HEAT, ORANGE, VERMILION
from hotlever.figures.drawing import outlines
from hotlever.figures.style import COLOURS, LINES, axis_label, beside, entitle, figure
from hotlever.probe import Layout
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr


#: Rises above the base temperature at which isotherms are drawn, as a share of the tip's.
ISOTHERMS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)


def air_loss(
    layout: Layout, panels: Panels, flux: Array, shares: xr.Dataset, title: str = ""
) -> Figure:
    """Draw the heat flux from the top face, and heat into air by region along a sweep.

    Parameters
    ----------
    layout : Layout
    panels : Panels
    flux : ndarray, shape (len(panels),)
        mW/µm², of one state.
    shares : xarray.Dataset
        See `hotlever.lever.air_fields.AirFields.shares`.
    title : str
        Of the map.
    """
    heights = panels.corners[..., 2]
    top = heights.min(axis=1) > heights.max() * (1 - 1e-9)
    values = 1e3 * flux[top]
    strongest = float(np.abs(values).max())
    with figure(7.0, 6.0, 2, 1, height_ratios=(1.5, 1.0), letters=True) as (made, (upper, lower)):
        scale = SymLogNorm(0.01 * strongest, vmin=-strongest, vmax=strongest)
        style: Any = {"cmap": "RdBu_r", "norm": scale, "edgecolors": "face", "linewidths": 0.2}
        cells = PolyCollection(list(panels.corners[top][:, :, :2]), array=values, **style)
        cells.set_rasterized(True)
        upper.add_collection(cells)
        outlines(upper, layout)
        upper.autoscale_view()
        label = "heat flux from the top (µW/µm²)"
        # powers of ten that the linear middle of the scale does not press together
        powers = 10.0 ** np.arange(np.ceil(np.log10(0.02 * strongest)), np.log10(strongest))
        ticks = [*-powers[::-1], 0.0, *powers]
        bar: dict[str, Any] = {"location": "bottom", "shrink": 0.8, "aspect": 40, "ticks": ticks}
        made.colorbar(cells, ax=upper, label=label, **bar)
        upper.set_title(title, loc="right")
        colours = [colour for colour in COLOURS if colour != BLACK] + ["0.5"]
        names = shares.region.values.tolist()
        for name, colour in zip(names, cycle(colours), strict=False):
            share = 100 * shares.air_heat_mW.sel(region=name) / shares.power_mW
            lower.plot(shares.tip_K, share, label=name, color=colour, marker=".")
        whole = 100 * shares.air_heat_mW.sum("region") / shares.power_mW
        lower.plot(shares.tip_K, whole, color=BLACK, ls="--", label="whole lever")
        lower.axhline(0.0, color="0.6", lw=0.6)
        lower.set(xlabel=axis_label("tip_K"), ylabel="share of the power\nlost to air (%)")
        beside(lower)
        entitle(made, shares)
    return made


def temperature_slices(slices: xr.Dataset) -> Figure:
    """Draw the temperature of the air along and across a lever, far and near.

    Parameters
    ----------
    slices : xarray.Dataset
        From `hotlever.lever3d.fields.temperature_slices`.
    """
    base, tip = slices.attrs["base_K"], slices.attrs["tip_K"]
    levels = [base + share * (tip - base) for share in ISOTHERMS]
    with figure(7.2, 6.4, 2, 2, letters=True) as (made, grid):
        for axes, name in zip(grid.ravel(), slices.slice.values, strict=True):
            cut = slices.sel(slice=name)
            at: Any = (cut.along_um, cut.z_um, cut.temperature)
            image = axes.pcolormesh(*at, cmap=HEAT, vmin=base, vmax=tip, rasterized=True)
            lines = axes.contour(*at, levels=levels, colors="white", linewidths=0.5)
            axes.clabel(lines, fmt="%.0f", fontsize=6)
            axes.set(aspect="equal", xlabel=f"{cut.axis.item()} (µm)", ylabel="z (µm)")
            axes.grid(False)
            axes.set_title(name, loc="center")
        made.colorbar(image, ax=grid, label="temperature (K)", shrink=0.7)
        entitle(made, slices, more=f"bias {slices.attrs['bias_V']:.3g} V, tip at {tip:.0f} K")
    return made


def disc_between_planes(loss: xr.Dataset) -> Figure:
    """Draw the loss of a disc between two planes over their distance (paper's Fig. 8)."""
    distance = loss.distance.values
    with figure(4.4, 3.2) as (made, axes):
        axes.plot(distance, loss.loss, color=BLUE, label="exact")
        axes.plot(distance, loss.near, "--", color=ORANGE, label="near planes, 2π r/h")
        axes.plot(distance, loss.far, ":", color=VERMILION, label="free space, 8")
        axes.axhline(4.0, color="0.6", lw=0.8)
        where: Any = {"xytext": (4, 3), "textcoords": "offset points"}
        axes.annotate("4 (one face)", (distance[0], 4.0), color="0.4", fontsize=8, **where)
        axes.set(xscale="log", yscale="log", ylim=(3.0, 1.2 * float(loss.loss.max())))
        axes.set(xlabel="distance of the planes over radius, h/r", ylabel="heat loss / (κ r ΔT)")
        axes.legend()
    return made


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
    with figure(6.4 if many else 4.4, 3.4) as (made, axes):
        for (name, k), (line, colour) in zip(curves.items(), cycle(LINES), strict=False):
            axes.plot(k.tip_K, k, line, color=colour, label=name)
        axes.axhline(published, color="0.5", ls=":", label=f"paper, {published}")
        axes.set(xlabel=axis_label("tip_K"), ylabel="k = P$_{air}$ / P$_{vacuum}$")
        if many:
            beside(axes)
        else:
            axes.legend(loc="upper left")
    return made
