"""Drawings: a probe from above, and what a file holds, with where it is at fault."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.tri import Triangulation

from hotlever.colours import BLACK, BLUE, ORANGE, SKY, VERMILION
from hotlever.figures.style import COLOURS, figure
from hotlever.materials import HIGH_DOPED
from hotlever.probe import Layout, ProbeMesh, Region


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
