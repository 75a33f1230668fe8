"""Figures of the sections on air."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hotlever.report.style import BLUE, COLOURS, ORANGE, VERMILION, figure

Array = NDArray[np.float64]


def disc_figure(distance: Array, loss: Array, near: Array, far: Array) -> Figure:
    """Draw the loss of a disc between two planes over their distance (paper's Fig. 8)."""
    with figure(4.4, 3.2) as made:
        axes = made.add_subplot()
        axes.plot(distance, loss, color=BLUE, label="exact")
        axes.plot(distance, near, "--", color=ORANGE, label="near planes, 2π r/h")
        axes.plot(distance, far, ":", color=VERMILION, label="free space, 8")
        axes.axhline(4.0, color="0.6", lw=0.8)
        axes.annotate(
            "4 (one face)",
            (distance[0], 4.0),
            xytext=(4, 3),
            color="0.4",
            textcoords="offset points",
            fontsize=8,
        )
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="distance of the planes over radius, h/r",
            ylabel="heat loss / (κ r ΔT)",
            ylim=(3.0, 1.2 * float(loss.max())),
        )
        axes.legend()
    return made


def iv_in_both_media(
    vacuum: xr.Dataset, air: xr.Dataset, knee: xr.Dataset, air_knee: xr.Dataset
) -> Figure:
    """Draw I-V curves in vacuum and air with their knees (paper's Fig. 10a)."""
    with figure(4.4, 3.4) as made:
        axes = made.add_subplot()
        for data, at, name, colour in (
            (vacuum, knee, "vacuum", BLUE),
            (air, air_knee, "air", VERMILION),
        ):
            axes.plot(data.lever_V, data.current_mA, color=colour, label=name)
            label = f"knee {at.tip_K.item():.0f} K"
            axes.plot(at.lever_V, at.current_mA, "o", color=colour, label=label)
        axes.set(
            xlabel="lever voltage V$_l$ (V)",
            ylabel="heater current I$_h$ (mA)",
            xlim=(0, None),
            ylim=(0, None),
        )
        axes.legend(loc="upper left")
    return made


def scale_factor_figure(curves: Mapping[str, tuple[Array, Array]], published: float) -> Figure:
    """Draw k over the tip temperature for some surroundings.

    Parameters
    ----------
    curves : mapping of str to (ndarray, ndarray)
        Tip temperature (K) and k.
    published : float
        The paper's single k.
    """
    many = len(curves) > 1
    with figure(6.4 if many else 4.4, 3.4) as made:
        axes = made.add_subplot()
        for number, (name, (tip, k)) in enumerate(curves.items()):
            style = "-" if number < len(COLOURS) else "--"
            axes.plot(tip, k, style, color=COLOURS[number % len(COLOURS)], label=name)
        axes.axhline(published, color="0.5", ls=":", label=f"paper, {published}")
        axes.set(xlabel="tip temperature (K)", ylabel="k = P$_{air}$ / P$_{vacuum}$")
        if many:
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        else:
            axes.legend(loc="upper left")
    return made
