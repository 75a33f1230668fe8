"""The figures that move with sliders: drawn in the browser, each changed by its data alone."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from hotlever.app.pages.frame import caption
from hotlever.figures.style import BLUE, HEAT, VERMILION
from hotlever.quantities import OBSERVABLES, QUANTITIES

#: What is drawn on a light page and on a dark one.
INK = "#8a8a8a"


def shade(opacity: float) -> str:
    """Return a grey that lets through what is behind it."""
    return f"rgba(128,128,128,{opacity:.2f})"


def axes(x: str, y: str, height: int, normal: str = "") -> dict[str, Any]:
    """Return how a plot looks; its axes begin at zero but for those that are `normal`."""
    layout: dict[str, Any] = {
        "height": height,
        "margin": {"l": 55, "r": 12, "t": 8, "b": 42},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": INK, "size": 12},
        "showlegend": False,
    }
    for name, title in (("x", x), ("y", y)):
        layout[f"{name}axis"] = {
            "title": {"text": title, "standoff": 6},
            "rangemode": "normal" if name in normal else "tozero",
            "gridcolor": shade(0.25),
            "zeroline": False,
            "linecolor": INK,
        }
    return layout


def title_of(name: str) -> str:
    """Return what an axis is called along which a quantity is drawn.

    Examples
    --------
    >>> title_of("lever_V")
    'lever voltage V<sub>l</sub> (V)'
    """
    return re.sub(r"\$_\{?(\w+)\}?\$", r"<sub>\1</sub>", QUANTITIES[name].axis_label)


def line(colour: str, **how: Any) -> dict[str, Any]:
    """Return a trace that is a line; `how` says how it is drawn, such as ``dash``."""
    return {"type": "scatter", "mode": "lines", "line": {"color": colour, "width": 2} | how}


def dots(colour: Any, size: int, **how: Any) -> dict[str, Any]:
    """Return a trace that is dots; `how` says how they are drawn, such as ``symbol``."""
    return {"type": "scatter", "mode": "markers", "marker": {"color": colour, "size": size, **how}}


def plotted(data: list[dict[str, Any]], layout: dict[str, Any], alt: str) -> ui.plotly:
    """Show a plot of some traces; `alt` says what it shows."""
    config = {"displaylogo": False, "responsive": True, "displayModeBar": False}
    plot = ui.plotly({"data": deepcopy(data), "layout": layout, "config": config})
    return plot.classes("w-full").props(f'role=img aria-label="{alt}"')


def points(x: Any, y: Any) -> dict[str, list[float]]:
    """Return the points of a trace, with as many digits as a screen shows.

    Examples
    --------
    >>> points([0, 1], [0.123456, 2])
    {'x': [0.0, 1.0], 'y': [0.12346, 2.0]}
    """
    return {"x": _short(x), "y": _short(y)}


def _short(values: Any) -> list[float]:
    return [float(f"{value:.5g}") for value in np.atleast_1d(values).tolist()]


def redraw(element: ui.element) -> None:
    """Have the plots of a page drawn anew: what was hidden had no size that they could have."""
    resize = "setTimeout(() => window.dispatchEvent(new Event('resize')))"
    element.client.run_javascript(resize)


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

    def __init__(self) -> None:
        data = dots(BLUE, 6, symbol="circle-open") | {"name": "measured"}
        model = line(VERMILION, shape="spline") | {"name": "model"}
        self._plots: dict[str, tuple[ui.element, ui.plotly]] = {}
        # once for all measurements: a browser takes long to make them
        with side_by_side():
            for name in OBSERVABLES:
                with ui.element("div") as around:
                    layout = axes("", title_of(OBSERVABLES[name].name), 240, normal="xy")
                    plot = plotted([data, model], layout, f"Measured {name}, and the lever fitted")
                self._plots[name] = around, plot
        self._legend = caption("")

    def measured(self, data: dict[str, list[float]], observables: Sequence[str]) -> None:
        """Draw a measurement."""
        for name, (around, plot) in self._plots.items():
            around.set_visibility(name in observables)
            if name in observables:
                x, y = self._along(name, data), OBSERVABLES[name].name
                measured, model = plot.figure["data"]
                measured |= points(data[x], data[y])
                model |= points([], [])
                layout = plot.figure["layout"]
                layout["xaxis"]["title"]["text"] = title_of(x)
                # of the data alone, so that the lever moves and not the axes
                layout["xaxis"]["range"] = _range(data[x])
                layout["yaxis"]["range"] = _range(data[y])
                plot.update()
        self._legend.set_text("")

    def approach(self, curve: dict[str, list[float]]) -> None:
        """Draw the lever that was found so far."""
        for name, (around, plot) in self._plots.items():
            if around.visible:
                x, y = self._along(name, curve), OBSERVABLES[name].name
                plot.figure["data"][1] |= points(curve[x], curve[y])
                plot.update()
        self._legend.set_text("Dots: measured. Line: the lever as the fit has it.")

    @staticmethod
    def _along(observable: str, columns: dict[str, list[float]]) -> str:
        """Return by what an observable is drawn: what was measured in time by the time."""
        if "time_us" in columns:
            return "time_us"
        return "lever_V" if observable == "current" else "bias_V"


class RampPlots:
    """A lever while it is measured: its curve, and its tip with the limit that it stays below."""

    def __init__(self) -> None:
        band = {"type": "scatter", "mode": "none", "fill": "toself", "name": "95 %"}
        measured = dots(BLUE, 7, symbol="circle-open") | {"name": "measured"}
        before = dots(INK, 8, symbol="triangle-down-open") | {"name": "below with 99 %, foretold"}
        traces = [band, line(BLUE) | {"name": "tip"}, before, line(VERMILION, dash="dash")]
        with side_by_side():
            layout = axes(title_of("bias_V"), title_of("current_mA"), 270)
            self._current = plotted([measured], layout, "Measured current against bias")
            layout = axes(title_of("bias_V"), title_of("tip_K"), 270, normal="y")
            self._tip = plotted(traces, layout, "Tip temperature with its band, and the limit")
        self._legend = caption("")

    def show(self, rows: dict[str, Any] | None) -> None:
        """Draw the rows so far, as `hotlever.tasks.measuring` shows them; nothing where none is."""
        if rows is None:
            return
        band, tip, before, limit = self._tip.figure["data"]
        self._current.figure["data"][0] |= points(rows["bias_V"], rows["current_mA"])
        along = rows["band_V"]
        band |= points([*along, *along[::-1]], [*rows["low_K"], *rows["high_K"][::-1]])
        band["fillcolor"] = shade(0.3)
        tip |= points(along, rows["tip_K"])
        before |= points(rows["bias_V"], rows["foretold_K"])
        limit |= points([0.0, max(rows["bias_V"])], [rows["limit_K"]] * 2)
        for plot in (self._current, self._tip):
            plot.update()
        last = f"{rows['bias_V'][-1]:.4g} V, {rows['current_mA'][-1]:.4g} mA"
        where = ""
        if along:
            where = (
                f", tip at {rows['tip_K'][-1]:.0f} K "
                f"(95 %: {rows['low_K'][-1]:.0f} to {rows['high_K'][-1]:.0f} K)"
            )
        self._legend.set_text(
            f"Row {len(rows['bias_V'])}: {last}{where}. Grey: 95 % by the rows so far. Triangles: "
            f"not above with 99 %, foretold. Dashed: the limit, {rows['limit_K']:.0f} K."
        )


def _range(values: list[float]) -> list[float]:
    """Return the ends of an axis that shows some values, and a little more."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = 0.07 * (high - low or abs(high) or 1.0)
    return [low - margin, high + margin]


def compare_histories(first: Path, second: Path) -> None:
    """Show two levers in time in the same plots, of the tables that were written of them."""
    tables = [np.genfromtxt(path, delimiter=",", names=True) for path in (first, second)]
    lines = [line(BLUE), line(INK, dash="dash")]
    with side_by_side():
        for name in ("tip_K", "current_mA", "lever_V"):
            drawn = [
                how | points(table["time_us"], table[name])
                for how, table in zip(lines, tables, strict=True)
            ]
            plotted(
                drawn,
                axes(title_of("time_us"), title_of(name), 240, normal="y"),
                f"{name} of two levers",
            )


class LivePlots:
    """Temperature map, I-V curve, temperature by power, and the profile along the current.

    Beside them may be drawn what another lever shows.
    """

    def __init__(self) -> None:
        self._beside_label = ui.label().classes("text-sm remark").props("data-number=beside")
        now = dots(VERMILION, 11) | {"name": "now"}
        knee = dots(BLUE, 11, symbol="diamond-open", line={"width": 2}) | {"name": "knee"}
        beside = line(INK, dash="dash") | {"name": "beside"}
        beside_now = dots(INK, 10, symbol="square-open") | {"name": "beside, now"}
        curves = [line(BLUE), knee, now, beside, beside_now]
        self._heat = _map_of_temperatures()
        with side_by_side():
            layout = axes(title_of("lever_V"), title_of("current_mA"), 270)
            current = plotted(curves, layout, "Current against lever voltage, with the knee")
            layout = axes(title_of("power_mW"), title_of("tip_K"), 270, normal="y")
            tip = plotted(curves, layout, "Tip temperature against power")
            layout = axes("along the current (µm)", "temperature (K)", 270, normal="xy")
            alt = "Temperature along the current from the supply through the tip to the ground"
            self._profile = plotted([line(BLUE), beside], layout, alt)
        self._by_columns = {current: ("lever_V", "current_mA"), tip: ("power_mW", "tip_K")}
        # before its first plot a browser takes whole figures only
        self._ready: set[ui.plotly] = set()
        for plot in (self._heat, current, tip, self._profile):
            plot.on("plotly_afterplot", lambda _, p=plot: self._ready.add(p), [], throttle=1.0)
        self._curves: Any = None
        self._beside: Any = None
        self._map: Any = None
        #: By trace of the profile, base and hottest temperature, and how long the current's way is.
        self._reach: dict[int, Any] = {}

    def show(self, answer: dict[str, Any]) -> None:
        """Draw an answer of the live lever; what is as before is not sent again."""
        curves, now = answer["curves"], answer["now"]
        knee = curves["knee"] or dict.fromkeys(("lever_V", "current_mA", "power_mW", "tip_K"))
        for plot, (x, y) in self._by_columns.items():
            plot.figure["data"][1] |= {"x": [knee[x]], "y": [knee[y]]}
        self._draw(0, 2, curves, now, self._curves)
        self._draw_profile(0, answer)
        self._show_map(answer["box"], answer["outline"], now["scale_K"], now["picture"])
        self._curves = curves

    def beside(self, answer: dict[str, Any] | None, text: str) -> None:
        """Draw an answer of the lever beside, and say what it is; nothing if there is none."""
        self._beside_label.set_text(text)
        if answer is None and self._beside is None:
            return
        curves, now = (answer["curves"], answer["now"]) if answer else ({}, {})
        self._draw(3, 4, curves, now, self._beside)
        self._draw_profile(1, answer)
        self._beside = curves or None

    def _draw_profile(self, trace: int, answer: dict[str, Any] | None) -> None:
        """Draw the profile of one lever as a trace, on axes that hold both whole."""
        profile, reach = points([], []), None
        if answer:
            profile = points(answer["along"], answer["now"]["line"])
            # of one height for all biases, so that the profile moves and not its axis
            reach = answer["base_K"], answer["curves"]["hottest_K"], answer["along"][-1]
        if reach == self._reach.get(trace):
            self._move(self._profile, trace, profile)
            return
        self._reach[trace] = reach
        self._profile.figure["data"][trace] |= profile
        lowest, highest, along = zip(*filter(None, self._reach.values()), strict=True)
        layout = self._profile.figure["layout"]
        layout["yaxis"]["range"] = [min(lowest), max(highest)]
        layout["xaxis"]["range"] = [0.0, max(along)]
        self._profile.update()

    def _draw(
        self, curve: int, dot: int, curves: dict[str, Any], now: dict[str, Any], before: Any
    ) -> None:
        """Draw curves and a state on them as traces; only the state, if they are as before."""
        same = bool(before and curves) and all(
            np.array_equal(before[name], curves[name]) for name in ("lever_V", "tip_K")
        )
        for plot, (x, y) in self._by_columns.items():
            here = {"x": [now.get(x)], "y": [now.get(y)]}
            if same:
                self._move(plot, dot, here)
            else:
                plot.figure["data"][curve] |= points(curves.get(x, []), curves.get(y, []))
                plot.figure["data"][dot] |= here
                plot.update()

    def _show_map(
        self, box: list[float], outline: Any, scale: tuple[float, float], picture: bytes
    ) -> None:
        """Show the picture of the map in its place, the lever's outline, and the colours' bar."""
        left, right, bottom, top = box
        source = f"data:image/png;base64,{b64encode(picture).decode('ascii')}"
        layout = self._heat.figure["layout"]
        layout["images"][0]["source"] = source
        # cold legs are as dark as a dark page, the hottest places nearly as light as a light one
        layout["shapes"] = [outlined(ring) for ring in outline]
        now = box, scale, layout["shapes"]
        if now == self._map and self._heat in self._ready:
            self._heat.run_plot_method("relayout", {"images[0].source": source})
            return
        self._map = now
        size = {"sizex": right - left, "sizey": top - bottom}
        layout["images"][0] |= {"x": left, "y": top, **size}
        layout["xaxis"]["range"] = [left, right]
        layout["yaxis"]["range"] = [bottom, top]
        self._heat.figure["data"][0]["marker"] |= {"cmin": scale[0], "cmax": scale[1]}
        self._heat.update()

    def _move(self, plot: ui.plotly, trace: int, values: dict[str, Any]) -> None:
        """Move a trace, with all else as it is."""
        plot.figure["data"][trace] |= values
        if plot in self._ready:
            at_once = {"transition": {"duration": 0}, "frame": {"duration": 0, "redraw": False}}
            plot.run_plot_method("animate", {"data": [values], "traces": [trace]}, at_once)
        else:
            plot.update()


def _map_of_temperatures() -> ui.plotly:
    """Show where a picture of the map goes, and a point beside it that brings the colours' bar."""
    # a page that needs none of them need not wait for this
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    shares = np.linspace(0.0, 1.0, 32).tolist()
    colours = [[share, to_hex(colormaps[HEAT](share))] for share in shares]
    bar = {"title": {"text": "K", "side": "top"}, "thickness": 12, "outlinewidth": 0}
    point = dots([0], 6, colorscale=colours, showscale=True, colorbar=bar)
    point |= {"x": [None], "y": [None], "hoverinfo": "skip"}
    layout = axes("x (µm)", "y (µm)", 300)
    layout["yaxis"] |= {"scaleanchor": "x", "constrain": "domain"}
    layout["xaxis"] |= {"constrain": "domain"}
    picture = {"xref": "x", "yref": "y", "sizing": "stretch", "layer": "below", "source": ""}
    layout["images"] = [picture | {"xanchor": "left", "yanchor": "top"}]
    return plotted([point], layout, "Map of the temperature")
