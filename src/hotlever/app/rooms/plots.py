"""The figures that move with sliders: drawn in the browser, each changed by its data alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from nicegui import ui

from hotlever.figures.style import BLUE, VERMILION

_INK, _GRID = "#8a8a8a", "rgba(128,128,128,.25)"
#: The map's colours span this (K) at least, so that a cold lever does not look hot.
_LEAST_SPAN_K = 50.0
_CONFIG = {"displaylogo": False, "responsive": True, "displayModeBar": False}


def _layout(x: str, y: str, height: int, normal: str = "") -> dict[str, Any]:
    """Return how a plot looks; its axes begin at zero but for those that are `normal`."""
    axis = {"gridcolor": _GRID, "zeroline": False, "linecolor": _INK}
    starts = {name: "normal" if name in normal else "tozero" for name in "xy"}
    return {
        "height": height,
        "margin": {"l": 55, "r": 12, "t": 8, "b": 42},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": _INK, "size": 12},
        "showlegend": False,
        "xaxis": {**axis, "title": {"text": x, "standoff": 6}, "rangemode": starts["x"]},
        "yaxis": {**axis, "title": {"text": y, "standoff": 6}, "rangemode": starts["y"]},
    }


def _plot(data: list[dict[str, Any]], layout: dict[str, Any], alt: str) -> ui.plotly:
    made = ui.plotly({"data": data, "layout": layout, "config": _CONFIG}).classes("w-full")
    made.props(f'role=img aria-label="{alt}"')
    return made


class LivePlots:
    """Temperature map, I-V curve, temperature by power, and the profile through the tip."""

    def __init__(self) -> None:
        line: Any = {"type": "scatter", "mode": "lines", "line": {"color": BLUE, "width": 2}}
        dot: Any = {"type": "scatter", "mode": "markers"}
        here = {**dot, "marker": {"color": VERMILION, "size": 11}, "name": "now"}
        knee = {
            **dot,
            "marker": {"color": BLUE, "size": 11, "symbol": "diamond-open", "line": {"width": 2}},
            "name": "knee",
        }
        heat = {
            "type": "heatmap",
            "colorscale": _colours("inferno"),
            "colorbar": {"title": {"text": "K", "side": "top"}, "thickness": 12, "outlinewidth": 0},
            "hovertemplate": "x %{x:.1f} µm, y %{y:.1f} µm: %{z:.0f} K<extra></extra>",
        }
        square = _layout("x (µm)", "y (µm)", 300, normal="xy")
        square["yaxis"] |= {"scaleanchor": "x", "constrain": "domain"}
        square["xaxis"] |= {"constrain": "domain"}
        self._heat = _plot([heat], square, "Map of the temperature")
        with (
            ui.element("div")
            .classes("w-full grid gap-2")
            .style("grid-template-columns: repeat(auto-fit, minmax(250px, 1fr))")
        ):
            self._iv = _plot(
                [line, knee, here],
                _layout("lever voltage V<sub>l</sub> (V)", "current I<sub>h</sub> (mA)", 270),
                "Current against lever voltage, with the knee",
            )
            self._tp = _plot(
                [line, knee, here],
                _layout("power P<sub>l</sub> (mW)", "tip temperature (K)", 270, normal="y"),
                "Tip temperature against power",
            )
            profile = _layout("x (µm)", "temperature (K)", 270, normal="xy")
            self._profile = _plot([line], profile, "Temperature along the lever, through the tip")
        # before its first plot a browser takes whole figures only
        self._ready: set[ui.plotly] = set()
        for plot in (self._heat, self._iv, self._tp, self._profile):
            plot.on("plotly_afterplot", lambda _, p=plot: self._ready.add(p), [], throttle=1.0)
        self._curves: Any = None
        self._grid: Any = None

    def show(self, answer: dict[str, Any]) -> None:
        """Draw an answer of the live lever; what is as before is not sent again."""
        curves, now, grid = answer["curves"], answer["now"], answer["grid"]
        knee = curves["knee"] or dict.fromkeys(("lever_V", "current_mA", "power_mW", "tip_K"))
        same = self._curves is not None and _same(self._curves, curves)
        for plot, x, y in (
            (self._iv, "lever_V", "current_mA"),
            (self._tp, "power_mW", "tip_K"),
        ):
            traces = {2: {"x": [now[x]], "y": [now[y]]}}
            if not same:
                traces[0] = {"x": _short(curves[x]), "y": _short(curves[y])}
                traces[1] = {"x": [knee[x]], "y": [knee[y]]}
            self._change(plot, traces)
        heat: dict[str, Any] = {
            "z": _rows(now["cells"]),
            "zmin": answer["base_K"],
            "zmax": max(now["hottest_K"], answer["base_K"] + _LEAST_SPAN_K),
        }
        line: dict[str, Any] = {"y": _short(now["line"])}
        if self._grid is None or any(
            not np.array_equal(self._grid[axis], grid[axis]) for axis in grid
        ):
            heat |= {"x": _short(grid["x"]), "y": _short(grid["y"])}
            line["x"] = _short(grid["along"])
        self._change(self._heat, {0: heat})
        self._change(self._profile, {0: line})
        self._curves, self._grid = curves, grid

    def _change(self, plot: ui.plotly, traces: dict[int, dict[str, Any]]) -> None:
        """Give traces of a plot new data."""
        figure: Any = plot.figure
        for place, values in traces.items():
            figure["data"][place] |= values
        if plot not in self._ready:
            plot.update()
            return
        keys = dict.fromkeys(key for values in traces.values() for key in values)
        changed = {key: [values[key] for values in traces.values()] for key in keys}
        plot.run_plot_method("restyle", changed, list(traces))


def _colours(name: str) -> list[list[Any]]:
    """Return one of matplotlib's colour maps, as the figures have it."""
    shares = np.linspace(0.0, 1.0, 32)
    return [[share, to_hex(colormaps[name](share))] for share in shares.tolist()]


def _same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return all(np.array_equal(one[name], other[name]) for name in ("lever_V", "tip_K"))


def _short(values: Any) -> list[float]:
    """Return numbers with as many digits as a screen shows."""
    return [float(f"{value:.5g}") for value in np.asarray(values).tolist()]


def _rows(cells: Any) -> list[list[float | None]]:
    """Return cells to a tenth of a kelvin; None beside the lever."""
    rounded = np.round(np.asarray(cells), 1)
    return [[None if value != value else value for value in row] for row in rounded.tolist()]
