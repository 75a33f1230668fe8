"""The picture of a lever over a surface, and what it reads by the distance."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import ui

from hotlever.app.pages.frame import caption
from hotlever.app.pages.plots import INK, axes, filled, outlined, plotted, short, side_by_side
from hotlever.colours import BLUE, VERMILION

_ABOUT = (
    "From the side, heights to a scale of their own; each piece of the lever in the colour of its "
    "hottest place. The dashed line is the distance."
)
_SURFACE = "rgba(128,128,128,.35)"
#: Plots by distance: title, column, factor, and whether the axis is logarithmic.
_CURVES = (
    ("voltage (V)", "reader_V", 1.0, False),
    ("|d ln R/dz| (10<sup>−4</sup>/nm)", "dlnR_dz_per_um", 10.0, True),
    ("resolution (pm/√Hz)", "resolution_nm_per_rtHz", 1e3, True),
)
#: Values that are named on logarithmic axes.
_TICKS = [float(f"{digit}e{power}") for power in range(-6, 7) for digit in (1, 2, 5)]
#: Share of the lever's length, and of the height, that is shown around it.
_AROUND, _ABOVE = 0.04, 0.25


class ReaderPlots:
    """What a reader shows: `show` is given the answers of `hotlever.app.approaching`."""

    def __init__(self) -> None:
        layout = axes("along the lever (µm)", "height (µm)", 260, normal="xy")
        layout["xaxis"]["showgrid"] = layout["yaxis"]["showgrid"] = False
        line: dict[str, Any] = {
            "type": "scatter",
            "mode": "lines",
            "line": {"color": INK, "width": 2},
        }
        distance = {**line, "line": {"color": VERMILION, "width": 2, "dash": "dash"}}
        alt = "The lever from the side, coloured by temperature, over the surface"
        self._picture = plotted([line, distance], layout, alt)
        caption(_ABOUT)
        self._curves: list[ui.plotly] = []
        with side_by_side():
            for title, _, _, by_decades in _CURVES:
                curve = {**line, "line": {"color": BLUE, "width": 2}}
                marker = {"color": VERMILION, "size": 10}
                dot = {"type": "scatter", "mode": "markers", "marker": marker}
                layout = axes("distance to the surface (µm)", title, 250, normal="xy")
                for axis in ("xaxis", "yaxis")[: 1 + by_decades]:
                    texts = [f"{value:g}" for value in _TICKS]
                    layout[axis] |= {"type": "log", "tickvals": _TICKS, "ticktext": texts}
                self._curves.append(plotted([curve, dot], layout, f"{title} by distance"))

    def show(self, answer: dict[str, Any]) -> None:
        """Draw an answer."""
        self._draw(answer)
        curves, now = answer["curves"], answer["now"]
        for plot, (_, key, factor, by_decades) in zip(self._curves, _CURVES, strict=True):
            for number, columns in enumerate((curves, now)):
                values = factor * np.atleast_1d(columns[key])
                values = np.abs(values) if by_decades else values
                z = np.atleast_1d(columns["surface_gap_um"])
                plot.figure["data"][number] |= {"x": short(z), "y": short(values)}
            plot.update()

    def _draw(self, answer: dict[str, Any]) -> None:
        """Draw lever, tip and surface from the side."""
        start, at_tip, end = answer["ends"]
        thick, gap = answer["thickness_um"], answer["now"]["surface_gap_um"]
        shapes = []
        edges = np.linspace(start, end, len(answer["colours"]) + 1)
        for left, colour in zip(edges.tolist(), answer["colours"], strict=False):
            # the next one is drawn over what is beyond, so that no gap shows between them
            box = [(left, 0.0), (end, 0.0), (end, thick), (left, thick)]
            shapes.append(filled(box, colour))
        outline = [(start, 0.0), (end, 0.0), (end, thick), (start, thick)]
        if answer["tip"] is not None:
            height, radius = answer["tip"]
            shapes.append(
                filled([(at_tip - radius, 0.0), (at_tip + radius, 0.0), (at_tip, -height)], INK)
            )
        margin = _AROUND * (end - start)
        sides = np.array([start - margin, end + margin])
        surface = -gap + answer["slope"] * (sides - at_tip)
        low = float(surface.min())
        bottom = low - _ABOVE * (thick - low)
        corners = [*zip(sides.tolist(), surface.tolist(), strict=True)]
        shapes.append(filled([*corners, (sides[1], bottom), (sides[0], bottom)], _SURFACE))
        shapes.append(outlined(outline))
        figure = self._picture.figure
        figure["layout"]["shapes"] = shapes
        figure["layout"]["xaxis"]["range"] = sides.tolist()
        figure["layout"]["yaxis"]["range"] = [bottom, thick + _ABOVE * (thick - low)]
        figure["data"][0] |= {"x": short(sides), "y": short(surface)}
        figure["data"][1] |= {"x": short([at_tip, at_tip]), "y": short([0.0, -gap])}
        self._picture.update()
