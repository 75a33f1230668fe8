"""Drawings of a probe, of what a file holds, with where it is at fault, and of designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.tri import Triangulation

from hotlever.figures.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    axis_label,
    entitle,
    figure,
)
from hotlever.materials import HIGH_DOPED
from hotlever.probe import Layout, ProbeMesh, Region
from hotlever.studies.design import label_of

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.studies.optimisation import OptimalDesign


def probe_drawing(layout: Layout, title: str = "", *, mesh: ProbeMesh | None = None) -> Figure:
    """Draw a probe from above, with heater, reader, terminals and tip marked, or its mesh too."""
    with figure(7.0, 3.4) as (fig, axes):
        handles: dict[str, Patch | Line2D] = {**filled_regions(axes, layout)}
        if mesh is not None:
            x, y = mesh.elements.p
            axes.triplot(Triangulation(x, y, mesh.elements.t.T), color="0.25", lw=0.25)
        low, high = layout.box
        margin = 0.04 * max(high - low)
        # beside a lever that is as wide as long names take more of its size
        name_um = max(5 * margin, 0.33 * (high - low)[1]), 5 * margin
        room = np.full((2, 2), margin)  # before and behind, in x and y
        for name, edges in groupby(layout.terminals, lambda terminal: terminal.name):
            ends = np.array([(edge.start, edge.end) for edge in edges])
            axes.plot(*ends.T, color=BLUE, lw=4, solid_capstyle="butt")
            at, middle = ends.mean(axis=(0, 1)), (low + high) / 2
            # away from the middle of the lever, along the nearer axis
            along = int(np.argmax(np.abs(at - middle) / (high - low)))
            side = int(at[along] >= middle[along])
            room[side, along] = name_um[along]
            shift = np.zeros(2)
            shift[along] = (-8, 8)[side]
            beside: Any = {"ha": ("right", "left")[side], "va": "center"}
            if along == 1:
                beside = {"ha": "center", "va": ("top", "bottom")[side]}
            axes.annotate(name, at, xytext=shift, textcoords="offset points", color=BLUE, **beside)
        handles["terminal"] = Line2D([], [], color=BLUE, lw=4, label="terminal (base temperature)")
        (handles["tip"],) = axes.plot(*layout.tip, "^", color=BLACK, label="tip")
        (left, below), (right, above) = low - room[0], high + room[1]
        _show_plane(axes, xlim=(left, right), ylim=(below, above))
        if title:
            fig.suptitle(_wrapped(title), x=0.01, ha="left", fontsize=9, parse_math=False)
        fig.legend(handles=list(handles.values()), loc="outside lower center", ncols=3)
    return fig


def filled_regions(axes: Axes, layout: Layout) -> dict[str, Patch]:
    """Draw the regions of a layout in the colours of what they are; return a key by label."""
    handles: dict[str, Patch] = {}
    for region in layout.regions:
        colour, label = _shown_as(region)
        axes.add_patch(_patch(region, facecolor=colour, edgecolor="0.55", lw=0.6))
        handles.setdefault(label, Patch(facecolor=colour, edgecolor="0.55", label=label))
    return handles


def _shown_as(region: Region) -> tuple[str, str]:
    """Return colour and label of a region in a drawing of its probe."""
    heats = region.part == "heater"
    if region.insulates:
        return "0.93", f"{region.stack[-1].material} (insulates)"
    if region.films:
        top = region.films[-1].material
        return (VERMILION, f"heater ({top})") if heats else (ORANGE, top)
    if region.taper is not None:
        name = "heater" if heats else "reader"
        return VERMILION if heats else SKY, f"{name} (low-doped)"
    material = region.material
    label = "high-doped silicon" if material == HIGH_DOPED else material
    return (VERMILION, f"heater ({label})") if heats else ("0.82", label)


def _patch(region: Region, **style: Any) -> PathPatch:
    """Return a region as it is drawn, its holes left out."""
    rings = [Path([*ring, ring[0]], closed=True) for ring in region.rings]
    return PathPatch(Path.make_compound_path(*rings), **style)


def outlines(axes: Axes, layout: Layout) -> None:
    """Draw the regions and the tip of a lever over a map of it."""
    for region in layout.regions:
        axes.add_patch(_patch(region, fill=False, edgecolor="0.45", lw=0.4))
    tip: Any = {"marker": "^", "mfc": "white", "mec": "black", "ms": 4, "ls": "none"}
    axes.plot(*layout.tip, label="tip", **tip)
    _show_plane(axes)
    axes.grid(False)


def _show_plane(axes: Axes, **limits: Any) -> None:
    axes.set(aspect="equal", xlabel="x (µm)", ylabel="y (µm)", **limits)


def _wrapped(title: str) -> str:
    """Break a title into lines that have room above a drawing."""
    return fill(title, 90)


def outlines_drawing(
    outlines: Mapping[str, Sequence[Sequence[tuple[float, float]]]],
    title: str = "",
    *,
    tip: tuple[float, float] | None = None,
    fault: str = "",
    fault_at: tuple[float, float] | None = None,
) -> Figure:
    """Draw outlines by what they are, the largest at the bottom.

    Parameters
    ----------
    outlines : mapping of str to sequence of rings
        µm; two points are a line.
    title : str
    tip : tuple of float, optional
    fault : str
        What is wrong, told above the drawing.
    fault_at : tuple of float, optional
        Where it is wrong: marked.
    """
    rings = {name: [np.array(ring) for ring in group] for name, group in outlines.items() if group}
    extents = {name: np.ptp(np.concatenate(group), axis=0).prod() for name, group in rings.items()}
    with figure(7.0, 4.2) as (fig, axes):
        for number, name in enumerate(sorted(rings, key=lambda name: -extents[name])):
            colour = "0.6" if number == 0 else COLOURS[(number - 1) % len(COLOURS)]
            areas = [ring for ring in rings[name] if len(ring) > 2]
            lines = [ring for ring in rings[name] if len(ring) == 2]
            style: Any = {"facecolor": colour, "edgecolor": colour, "alpha": 0.45, "lw": 1.2}
            axes.add_collection(PolyCollection(areas, label=name if areas else None, **style))
            label = None if areas else name
            axes.add_collection(LineCollection(lines, colors=colour, lw=3, label=label))
        if tip is not None:
            axes.plot(*tip, marker="^", color=BLACK, ls="none", label="tip")
        points = np.concatenate([ring for group in rings.values() for ring in group])
        if fault_at is not None:
            points = np.vstack([points, fault_at])
            ring: Any = {"mec": VERMILION, "mfc": "none", "ms": 18, "mew": 2, "ls": "none"}
            axes.plot(*fault_at, marker="o", label="at fault", **ring)
            axes.plot(*fault_at, marker="+", color=VERMILION, ms=8, mew=1.5)
        margin = 0.06 * np.ptp(points, axis=0).max()
        (left, below), (right, above) = points.min(axis=0) - margin, points.max(axis=0) + margin
        _show_plane(axes, xlim=(left, right), ylim=(below, above))
        axes.set_title(_wrapped(fault) if fault else title, color=VERMILION if fault else BLACK)
        fig.legend(loc="outside lower center", ncols=4)
    return fig


# --- designs --------------------------------------------------------------------------------------


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
