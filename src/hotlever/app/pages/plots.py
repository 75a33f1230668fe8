"""The figures that move with sliders: drawn in the browser, each changed by its data alone."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from nicegui import ui

from hotlever.colours import BLUE, HEAT, VERMILION

INK, _GRID = "#8a8a8a", "rgba(128,128,128,.25)"
#: Beyond the data, as a share of what they extend over.
_MARGIN = 0.07
_LEVER_V, _CURRENT = "lever voltage V<sub>l</sub> (V)", "current I<sub>h</sub> (mA)"
_BIAS, _TIP = "bias V<sub>b</sub> (V)", "tip temperature (K)"
_CONFIG = {"displaylogo": False, "responsive": True, "displayModeBar": False}


def axes(x: str, y: str, height: int, normal: str = "") -> dict[str, Any]:
    """Return how a plot looks; its axes begin at zero but for those that are `normal`."""
    axis = {"gridcolor": _GRID, "zeroline": False, "linecolor": INK}
    starts = {name: "normal" if name in normal else "tozero" for name in "xy"}
    return {
        "height": height,
        "margin": {"l": 55, "r": 12, "t": 8, "b": 42},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": INK, "size": 12},
        "showlegend": False,
        "xaxis": {**axis, "title": {"text": x, "standoff": 6}, "rangemode": starts["x"]},
        "yaxis": {**axis, "title": {"text": y, "standoff": 6}, "rangemode": starts["y"]},
    }


def plotted(data: list[dict[str, Any]], layout: dict[str, Any], alt: str) -> ui.plotly:
    made = ui.plotly({"data": deepcopy(data), "layout": layout, "config": _CONFIG}).classes(
        "w-full"
    )
    made.props(f'role=img aria-label="{alt}"')
    return made


def side_by_side() -> ui.element:
    """Return where plots stand beside one another, as many as there is room for."""
    columns = "grid-template-columns: repeat(auto-fit, minmax(250px, 1fr))"
    return ui.element("div").classes("w-full grid gap-2").style(columns)


def filled(corners: Sequence[tuple[float, float]], colour: str | Sequence[int]) -> dict[str, Any]:
    """Return a polygon of a plot, without an outline; its colour may be bytes of red, green, blue.

    Examples
    --------
    >>> filled([(0, 0), (1, 0), (0, 1)], (255, 0, 0, 255))["fillcolor"]
    'rgb(255,0,0)'
    """
    if not isinstance(colour, str):
        colour = f"rgb({','.join(str(int(part)) for part in colour[:3])})"
    return {"type": "path", "path": _path(corners), "fillcolor": colour, "line": {"width": 0}}


def outlined(corners: Any, *, closed: bool = True) -> dict[str, Any]:
    """Return the line through some corners of a plot."""
    path = _path(corners, "Z" if closed else "")
    return {"type": "path", "path": path, "line": {"color": INK, "width": 1.5}}


def _path(corners: Any, end: str = "Z") -> str:
    return "M" + "L".join(f"{x:.5g},{y:.5g}" for x, y in corners) + end


class MeasuredPlots:
    """A measurement, by observable, and a lever that is brought near to it."""

    #: Columns along both axes, and what those are called; what was measured in time has its times
    #: along the first.
    _AXES: ClassVar = {
        "current": (("lever_V", _LEVER_V), ("current_mA", _CURRENT)),
        "reader": (("bias_V", _BIAS), ("reader_V", "reader voltage V<sub>r</sub> (V)")),
        "bridge": (
            ("bias_V", _BIAS),
            ("bridge_output_V", "bridge voltage V<sub>bridge</sub> (V)"),
        ),
        "tip": (("bias_V", _BIAS), ("tip_K", _TIP)),
    }

    def __init__(self) -> None:
        dots: Any = {"type": "scatter", "mode": "markers", "name": "measured"}
        dots["marker"] = {"color": BLUE, "size": 6, "symbol": "circle-open"}
        line = {"mode": "lines", "line": {"color": VERMILION, "width": 2, "shape": "spline"}}
        model = {"type": "scatter", "name": "model", **line}
        self._plots: dict[str, tuple[ui.element, ui.plotly]] = {}
        # once for all measurements: a browser takes long to make them
        with side_by_side():
            for name, ((_, along), (_, title)) in self._AXES.items():
                with ui.element("div") as around:
                    layout = axes(along, title, 240, normal="xy")
                    made = plotted([dots, model], layout, f"Measured {name}, and the lever fitted")
                self._plots[name] = around, made
        self._said = ui.label().classes("text-xs opacity-70")

    def measured(self, data: dict[str, list[float]], observables: Sequence[str]) -> None:
        """Draw a measurement."""
        for name, (around, plot) in self._plots.items():
            around.set_visibility(name in observables)
            if name in observables:
                (x, along), (y, _) = self._along(data, name)
                dots, model = plot.figure["data"]
                dots |= {"x": short(data[x]), "y": short(data[y])}
                model |= {"x": [], "y": []}
                plot.figure["layout"]["xaxis"]["title"]["text"] = along
                # of the data alone, so that the lever moves and not the axes
                plot.figure["layout"]["xaxis"]["range"] = _range(data[x])
                plot.figure["layout"]["yaxis"]["range"] = _range(data[y])
                plot.update()
        self._said.set_text("")

    def _along(self, data: dict[str, list[float]], name: str) -> Any:
        along, across = self._AXES[name]
        return (("time_us", "time (µs)") if "time_us" in data else along), across

    def approach(self, curve: dict[str, list[float]]) -> None:
        """Draw the lever that was found so far."""
        for name, (around, plot) in self._plots.items():
            if around.visible:
                (x, _), (y, _) = self._along(curve, name)
                plot.figure["data"][1] |= {"x": short(curve[x]), "y": short(curve[y])}
                plot.update()
        self._said.set_text("Dots: measured. Line: the lever as the fit has it.")


def compare_histories(first: Path, second: Path) -> None:
    """Show two levers in time in the same plots, of the tables that were written of them."""
    tables = [np.genfromtxt(path, delimiter=",", names=True) for path in (first, second)]
    lines: list[dict[str, Any]] = [{"color": BLUE}, {"color": INK, "dash": "dash"}]
    with side_by_side():
        for name, title in (("tip_K", _TIP), ("current_mA", _CURRENT), ("lever_V", _LEVER_V)):
            drawn: list[dict[str, Any]] = []
            for table, line in zip(tables, lines, strict=True):
                values = {"x": short(table["time_us"]), "y": short(table[name])}
                drawn.append(values | {"mode": "lines", "line": line | {"width": 2}})
            plotted(drawn, axes("time (µs)", title, 240, normal="y"), f"{name} of two levers")


class LivePlots:
    """Temperature map, I-V curve, temperature by power, and the profile along the current."""

    def __init__(self) -> None:
        line: Any = {"type": "scatter", "mode": "lines", "line": {"color": BLUE, "width": 2}}
        dot: Any = {"type": "scatter", "mode": "markers"}
        here = {**dot, "marker": {"color": VERMILION, "size": 11}, "name": "now"}
        knee = {
            **dot,
            "marker": {"color": BLUE, "size": 11, "symbol": "diamond-open", "line": {"width": 2}},
            "name": "knee",
        }
        # the lever beside, and its state
        other = {**line, "line": {"color": INK, "width": 2, "dash": "dash"}, "name": "beside"}
        there = {**dot, "marker": {"color": INK, "size": 10, "symbol": "square-open"}}
        there["name"] = "beside, now"
        # the picture of the map, and a point beside it that brings the bar of its colours
        bar = {
            **dot,
            "x": [None],
            "y": [None],
            "hoverinfo": "skip",
            "marker": {
                "color": [0],
                "colorscale": _colours(),
                "showscale": True,
                "colorbar": {
                    "title": {"text": "K", "side": "top"},
                    "thickness": 12,
                    "outlinewidth": 0,
                },
            },
        }
        square = axes("x (µm)", "y (µm)", 300)
        square["yaxis"] |= {"scaleanchor": "x", "constrain": "domain"}
        square["xaxis"] |= {"constrain": "domain"}
        picture = {"xref": "x", "yref": "y", "sizing": "stretch", "layer": "below"}
        square["images"] = [picture | {"xanchor": "left", "yanchor": "top", "source": ""}]
        self._heat = plotted([bar], square, "Map of the temperature")
        with side_by_side():
            self._iv = plotted(
                [line, knee, here, other, there],
                axes(_LEVER_V, _CURRENT, 270),
                "Current against lever voltage, with the knee",
            )
            self._tp = plotted(
                [line, knee, here, other, there],
                axes("power P<sub>l</sub> (mW)", _TIP, 270, normal="y"),
                "Tip temperature against power",
            )
            profile = axes("along the current (µm)", "temperature (K)", 270, normal="xy")
            alt = "Temperature along the current from the supply through the tip to the ground"
            self._profile = plotted([line, other], profile, alt)
        self._by_columns = {
            self._iv: ("lever_V", "current_mA"),
            self._tp: ("power_mW", "tip_K"),
        }
        # before its first plot a browser takes whole figures only
        self._ready: set[ui.plotly] = set()
        for plot in (self._heat, self._iv, self._tp, self._profile):
            plot.on("plotly_afterplot", lambda _, p=plot: self._ready.add(p), [], throttle=1.0)
        self._curves: Any = None
        self._beside: Any = None
        self._along: Any = None
        self._map: Any = None

    def show(self, answer: dict[str, Any]) -> None:
        """Draw an answer of the live lever; what is as before is not sent again."""
        curves, now = answer["curves"], answer["now"]
        knee = curves["knee"] or dict.fromkeys(("lever_V", "current_mA", "power_mW", "tip_K"))
        for plot, (x, y) in self._by_columns.items():
            plot.figure["data"][1] |= {"x": [knee[x]], "y": [knee[y]]}
        same = self._draw(0, 2, curves, now, self._curves)
        line = {"x": short(answer["along"]), "y": short(now["line"])}
        if same and np.array_equal(self._along, answer["along"]):
            self._move(self._profile, 0, line)
        else:
            # of one height for all biases, so that the profile moves and not its axis
            highest = float(np.max(curves["tip_K"]))
            self._profile.figure["layout"]["yaxis"]["range"] = [answer["base_K"], highest]
            self._profile.figure["layout"]["xaxis"]["range"] = [0.0, answer["along"][-1]]
            self._profile.figure["data"][0] |= line
            self._profile.update()
        self._show_map(answer["box"], answer["outline"], now["scale_K"], now["picture"])
        self._curves, self._along = curves, answer["along"]

    def beside(self, answer: dict[str, Any] | None) -> None:
        """Draw an answer of the lever beside; nothing of it if there is none."""
        if answer is None and self._beside is None:
            return
        curves, now = (answer["curves"], answer["now"]) if answer else ({}, {})
        self._draw(3, 4, curves, now, self._beside)
        line = {"x": short(answer["along"]), "y": short(now["line"])} if answer else {}
        self._move(self._profile, 1, line or {"x": [], "y": []})
        self._beside = curves or None

    def _draw(
        self, line: int, dot: int, curves: dict[str, Any], now: dict[str, Any], before: Any
    ) -> bool:
        """Draw curves and a state on them as traces; return whether only the state has moved."""
        same = bool(before and curves) and _same(before, curves)
        for plot, (x, y) in self._by_columns.items():
            here = {"x": [now.get(x)], "y": [now.get(y)]}
            if same:
                self._move(plot, dot, here)
            else:
                drawn = {"x": short(curves.get(x, [])), "y": short(curves.get(y, []))}
                plot.figure["data"][line] |= drawn
                plot.figure["data"][dot] |= here
                plot.update()
        return same

    def _show_map(
        self, box: list[float], outline: Any, scale: tuple[float, float], picture: bytes
    ) -> None:
        """Show the picture of the map in its place, the lever's outline, and the colours' bar."""
        left, right, bottom, top = box
        source = f"data:image/png;base64,{b64encode(picture).decode('ascii')}"
        figure = self._heat.figure
        figure["layout"]["images"][0]["source"] = source
        if (box, scale) == self._map and self._heat in self._ready:
            self._heat.run_plot_method("relayout", {"images[0].source": source})
            return
        self._map = (box, scale)
        size = {"sizex": right - left, "sizey": top - bottom}
        figure["layout"]["images"][0] |= {"x": left, "y": top, **size}
        figure["layout"]["xaxis"]["range"] = [left, right]
        figure["layout"]["yaxis"]["range"] = [bottom, top]
        # cold legs are as dark as a dark page, the hottest places nearly as light as a light one
        figure["layout"]["shapes"] = [outlined(ring) for ring in outline]
        figure["data"][0]["marker"] |= {"cmin": scale[0], "cmax": scale[1]}
        self._heat.update()

    def _move(self, plot: ui.plotly, trace: int, values: dict[str, Any]) -> None:
        """Move a trace, with all else as it is."""
        plot.figure["data"][trace] |= values
        if plot in self._ready:
            at_once = {"transition": {"duration": 0}, "frame": {"duration": 0, "redraw": False}}
            plot.run_plot_method("animate", {"data": [values], "traces": [trace]}, at_once)
        else:
            plot.update()


def _colours() -> list[list[Any]]:
    """Return the colours of temperatures, as the figures have them."""
    # a page that needs none of them need not wait for this
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    shares = np.linspace(0.0, 1.0, 32)
    return [[share, to_hex(colormaps[HEAT](share))] for share in shares.tolist()]


def _range(values: list[float]) -> list[float]:
    """Return the ends of an axis that shows some values, and a little more."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = _MARGIN * (high - low or abs(high) or 1.0)
    return [low - margin, high + margin]


def _same(first: dict[str, Any], second: dict[str, Any]) -> bool:
    return all(np.array_equal(first[name], second[name]) for name in ("lever_V", "tip_K"))


def short(values: Any) -> list[float]:
    """Return numbers with as many digits as a screen shows."""
    return [float(f"{value:.5g}") for value in np.asarray(values).tolist()]
