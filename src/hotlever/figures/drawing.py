"""Figures of drawings: what a file holds, and where it is at fault."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from hotlever.figures.style import BLACK, COLOURS, VERMILION, figure

Ring = Sequence[tuple[float, float]]
#: Beyond this share of the drawing's extent a place is marked outside of it.
_MARGIN = 0.06


def outlines_drawing(
    outlines: Mapping[str, Sequence[Ring]],
    title: str = "",
    *,
    tip: tuple[float, float] | None = None,
    fault: str = "",
    place: tuple[float, float] | None = None,
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
    place : tuple of float, optional
        Where it is wrong: marked.
    """
    rings = {name: [np.array(ring) for ring in group] for name, group in outlines.items() if group}
    extents = {name: np.ptp(np.concatenate(group), axis=0).prod() for name, group in rings.items()}
    with figure(7.0, 4.2) as (made, axes):
        for number, name in enumerate(sorted(rings, key=lambda one: -extents[one])):
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
        if place is not None:
            points = np.vstack([points, place])
            ring: Any = {"mec": VERMILION, "mfc": "none", "ms": 18, "mew": 2, "ls": "none"}
            axes.plot(*place, marker="o", label="at fault", **ring)
            axes.plot(*place, marker="+", color=VERMILION, ms=8, mew=1.5)
        low, high = points.min(axis=0), points.max(axis=0)
        margin = _MARGIN * max(high - low)
        axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
        axes.set(aspect="equal", xlabel="x (µm)", ylabel="y (µm)")
        axes.set_title(fill(fault, 90) if fault else title, color=VERMILION if fault else BLACK)
        made.legend(loc="outside lower center", ncols=4)
    return made
