"""Figures of a design: curves along one number, maps over two, the best beside the start."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from hotlever.colours import BLUE, GREEN, ORANGE, PURPLE, VERMILION
from hotlever.figures.probe_figures import filled_regions
from hotlever.figures.style import axis_label, entitle, figure
from hotlever.studies.design import label_of

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.studies.optimisation import OptimalDesign


def design_study(data: xr.Dataset) -> Figure:
    """Draw what follows from a design against the number, or the two, that were varied.

    Parameters
    ----------
    data : xarray.Dataset
        From `hotlever.studies.design.vary`.
    """
    last = "k" if data.k.notnull().any() else "cold_ohm"
    labels = {
        "knee_K": "tip temperature at the knee (K)",
        "knee_mW": "power of the knee (mW)",
        "tip_K": f"tip temperature at {data.attrs['power_mW']:g} mW (K)",
        "k": "k, power in air / in vacuum",
        "cold_ohm": "cold resistance (Ω)",
    }
    del labels["cold_ohm" if last == "k" else "k"]
    fig = (_map if len(data.dims) == 2 else _curves)(data, labels)
    entitle(fig, data)
    return fig


def _map(data: xr.Dataset, labels: dict[str, str]) -> Figure:
    """Draw contour maps; what cannot be made or has no such value is hatched."""
    across, up = map(str, data.knee_K.dims)
    base = [data[name].attrs["base_value"] for name in (across, up)]
    inside = all(
        data[name].values.min() <= value <= data[name].values.max()
        for name, value in zip((across, up), base, strict=True)
    )
    star: Any = {"color": VERMILION, "ms": 11, "mec": "white", "ls": "", "label": "the design"}
    with figure(8.4, 6.4, 2, 2, sharex=True, sharey=True, letters=True) as (fig, grid):
        for axes, (name, label) in zip(grid.ravel(), labels.items(), strict=True):
            _contours(fig, axes, data[name].transpose(up, across), label)
            if inside:
                axes.plot(*base, "*", **star)
            axes.grid(False)
        marks = [Patch(fc="white", ec="0.6", hatch="////", label="no such lever, or no such value")]
        fig.legend(handles=[*grid[0, 0].lines, *marks], loc="outside upper center", ncols=2)
        for axes in grid[1]:
            axes.set(xlabel=label_of(across))
        for axes in grid[:, 0]:
            axes.set(ylabel=label_of(up))
    return fig


def _contours(fig: Figure, axes: Axes, values: xr.DataArray, label: str) -> None:
    up, across = (values[name].values for name in values.dims)
    is_known = np.isfinite(values.values)
    hatched: Any = {"hatch": "////", "cmap": ListedColormap(["white"]), "edgecolor": "0.6"}
    missing = np.ma.masked_where(is_known, np.zeros(is_known.shape))
    axes.pcolor(across, up, missing, shading="nearest", lw=0.0, **hatched)
    if np.ptp(values.values[is_known]) > 0.0:
        levels: Any = {"levels": 8}
        filled = axes.contourf(across, up, values.values, **levels)
        lines = axes.contour(across, up, values.values, colors="white", linewidths=0.7, **levels)
        axes.clabel(lines, fontsize=7)
        fig.colorbar(filled, ax=axes, label=label)


def _curves(data: xr.Dataset, labels: dict[str, str]) -> Figure:
    (name,) = data.knee_K.dims
    along = data[name]
    with figure(8.0, 5.6, 2, 2, sharex=True, letters=True) as (fig, grid):
        temperature, power, volts, loss = grid.ravel()
        temperature.plot(along, data.knee_K, "o-", color=VERMILION, label="knee")
        temperature.plot(along, data.inversion_K, "--", color=ORANGE, label="inversion T$_i$")
        tip = f"tip at {data.attrs['power_mW']:g} mW"
        temperature.plot(along, data.tip_K, "s-", color=BLUE, label=tip)
        temperature.set(ylabel="tip temperature (K)")
        temperature.legend()
        power.plot(along, data.knee_mW, "o-", color=BLUE)
        power.set(ylabel=labels["knee_mW"])
        volts.plot(along, data.knee_V, "o-", color=BLUE, label="lever V$_l$ (V)")
        volts.plot(along, data.knee_bias_V, "s-", color=GREEN, label="bias V$_b$ (V)")
        volts.plot(along, data.knee_mA, "^-", color=PURPLE, label="current I$_h$ (mA)")
        volts.set(ylabel="at the knee (V, mA)", ylim=(0, None))
        volts.legend()
        last = "k" if "k" in labels else "cold_ohm"
        loss.plot(along, data[last], "o-", color=BLUE)
        loss.set(ylabel=labels[last])
        for axes in grid.ravel():
            axes.axvline(along.attrs["base_value"], color="0.6", lw=0.8, ls=":")
        for axes in grid[1]:
            axes.set(xlabel=label_of(str(name)))
    return fig


def design_optimum(optimum: OptimalDesign) -> Figure:
    """Draw the best design within bounds beside the one it began with, and their I-V curves."""
    designs = {"start": (optimum.start, BLUE), "best": (optimum.best, VERMILION)}
    with figure(9.0, 4.6, 2, 2, width_ratios=(1.1, 1.0)) as (fig, grid):
        curves = fig.add_subplot(grid[0, 0].get_gridspec()[:, 1])
        for axes in grid[:, 1]:
            axes.remove()
        handles: dict[str, Patch] = {}
        boxes = [solved.probe.layout().box for solved, _ in designs.values()]
        low, high = np.min([box[0] for box in boxes], 0), np.max([box[1] for box in boxes], 0)
        for axes, (name, (solved, colour)) in zip(grid[:, 0], designs.items(), strict=True):
            handles |= filled_regions(axes, solved.probe.layout())
            value = f"{optimum.quantity} = {solved.value(optimum.quantity):.4g}"
            axes.set_title(f"{name}: {value}", color=colour, parse_math=False)
            axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
            axes.set(ylabel="y (µm)")
            axes.grid(False)
            u = np.linspace(0.0, solved.branch.end_u, 200)
            outputs = solved.branch.electrical_outputs(u)
            curves.plot(outputs["lever_V"], outputs["current_mA"], color=colour, label=name)
            marks = {"working point": (solved.u, "o"), "knee": (solved.branch.knee_u, "^")}
            for label, (at_u, mark) in marks.items():
                if at_u is not None:
                    at = solved.branch.point(at_u)
                    curves.plot(
                        at.lever_V, at.current_mA, mark, color=colour, label=f"{name}, {label}"
                    )
        grid[1, 0].set(xlabel="x (µm)")
        curves.set(xlabel=axis_label("lever_V"), ylabel=axis_label("current_mA"), ylim=(0.0, None))
        curves.legend()
        fig.legend(handles=list(handles.values()), loc="outside lower center", ncols=4)
        limits = "; ".join(optimum.limits) or "no bound"
        title = f"at {optimum.point}, limited by {limits}"
        fig.suptitle(title, x=0.01, ha="left", wrap=True, parse_math=False)
    return fig
