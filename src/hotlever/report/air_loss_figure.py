"""Where a lever loses heat to the air: a map of the flux, and the share of each region."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.collections import PolyCollection
from matplotlib.colors import SymLogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from hotlever.air.panels import Panels
from hotlever.probe import Layout
from hotlever.report.style import BLACK, COLOURS, figure, panel_letter

Array = NDArray[np.float64]


def air_loss_figure(
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
    top = (panels.flat_axis == 2) & (panels.centres[:, 2] > 0)
    outlines, values = panels.corners[top][:, :, :2], 1e3 * flux[top]
    strongest = float(np.abs(values).max())
    with figure(7.0, 6.0) as made:
        upper, lower = made.subplots(2, 1, height_ratios=(1.5, 1.0))
        cells = PolyCollection(
            list(outlines),
            array=values,
            cmap="RdBu_r",
            norm=SymLogNorm(0.01 * strongest, vmin=-strongest, vmax=strongest),
            edgecolors="face",
            linewidths=0.2,
        )
        cells.set_rasterized(True)
        upper.add_collection(cells)
        for region in layout.regions:
            upper.add_patch(Polygon(region.outline, fill=False, edgecolor="0.45", lw=0.4))
        upper.plot(*layout.tip, marker="^", mfc="white", mec="black", ms=4)
        upper.set(aspect="equal", xlabel="x (µm)", ylabel="y (µm)")
        upper.autoscale_view()
        upper.grid(False)
        made.colorbar(
            cells,
            ax=upper,
            location="bottom",
            label="heat flux from the top (µW/µm²)",
            shrink=0.8,
            aspect=40,
        )
        panel_letter(upper, "a")
        upper.set_title(title, loc="right")
        colours = [colour for colour in COLOURS if colour != BLACK] + ["0.5"]
        for number, name in enumerate(shares.region.values.tolist()):
            share = 100 * shares.air_heat_mW.sel(region=name) / shares.power_mW
            lower.plot(
                shares.tip_K, share, label=name, color=colours[number % len(colours)], marker="."
            )
        whole = 100 * shares.air_heat_mW.sum("region") / shares.power_mW
        lower.plot(shares.tip_K, whole, color=BLACK, ls="--", label="whole lever")
        lower.axhline(0.0, color="0.6", lw=0.6)
        lower.set(xlabel="tip temperature (K)", ylabel="share of the power\nlost to air (%)")
        lower.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        panel_letter(lower, "b")
    return made
