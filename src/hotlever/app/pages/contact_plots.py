"""The picture of a tip in contact, with the temperature along its axis, and curves by bias."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import ui

from hotlever.app.pages.frame import caption
from hotlever.app.pages.plots import INK, axes, filled, outlined, plotted, short, side_by_side
from hotlever.colours import BLUE, PURPLE, VERMILION
from hotlever.contact.picture import ContactPicture

_FILL = "rgba(128,128,128,{:.2f})"
_ABOUT = (
    "Heights and radii in proportion near the contact, by decades away from it. Under the contact "
    "the temperature is that along its axis."
)
_BIAS, _HEIGHT = "bias V<sub>b</sub> (V)", 420
#: Heat (mW) that is none but for rounding.
_NONE_MW = 1e-9
#: Plots by bias: title, and for each line its column, factor, colour and name.
_CURVES: tuple[tuple[str, tuple[tuple[str, float, str, str], ...]], ...] = (
    (
        "temperature (K)",
        (("tip_K", 1.0, VERMILION, "tip at the lever"), ("apex_K", 1.0, PURPLE, "apex")),
    ),
    (
        "heat into the sample (µW)",
        (
            ("sample_mW", 1e3, VERMILION, "through the contact"),
            ("beside_mW", 1e3, BLUE, "through air"),
        ),
    ),
    ("change of I<sub>h</sub> (µA)", (("current_change_mA", 1e3, BLUE, "change of I_h"),)),
)


class ContactPlots:
    """What a tip in contact shows: `show` is given the answers of `hotlever.app.touching`."""

    def __init__(self) -> None:
        layout = axes("", "", _HEIGHT, normal="xy")
        layout["margin"] = {"l": 62, "r": 8, "t": 24, "b": 42}
        layout["yaxis"] |= {"showgrid": False, "ticks": "outside", "tickcolor": INK}
        layout["xaxis"] |= {"domain": [0.0, 0.54], "showgrid": False, "showticklabels": False}
        layout["xaxis2"] = axes("temperature (K)", "", 0)["xaxis"]
        layout["xaxis2"] |= {"domain": [0.58, 1.0], "anchor": "y", "rangemode": "normal"}
        layout["xaxis2"] |= {"nticks": 4}
        line = {"type": "scatter", "mode": "lines", "line": {"color": VERMILION, "width": 2}}
        dots: dict[str, Any] = {"type": "scatter", "mode": "markers", "xaxis": "x2"}
        dots["marker"] = {"color": VERMILION, "size": 9}
        alt = "Tip, contact and sample coloured by temperature, and the temperature along the axis"
        # the axis of the picture is drawn for what has values on it
        nothing = {"type": "scatter", "x": [None], "y": [None], "hoverinfo": "skip"}
        self._picture = plotted([nothing, line | {"xaxis": "x2"}, dots], layout, alt)
        caption(_ABOUT)
        self._by_bias: list[ui.plotly] = []
        with side_by_side():
            for title, lines in _CURVES:
                data: list[dict[str, Any]] = []
                for _, _, colour, name in lines:
                    data += [
                        line | {"line": {"color": colour, "width": 2}, "name": name},
                        {"mode": "markers", "marker": {"color": colour, "size": 10}, "name": name},
                    ]
                layout = axes(_BIAS, title, 240, normal="y")
                if len(lines) > 1:
                    above = {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom"}
                    layout |= {"showlegend": True, "legend": above}
                    layout["margin"]["t"] = 30
                    for dot in data[1::2]:
                        dot["showlegend"] = False
                self._by_bias.append(plotted(data, layout, f"{title} by bias"))

    def show(self, answer: dict[str, Any]) -> None:
        """Draw an answer; one while sliders move has no curves, and those of before go."""
        self._draw(answer["picture"], answer["colours"], answer["now"], answer["base_K"])
        curves, now = answer["curves"] or {}, answer["now"]
        for plot, (_, lines) in zip(self._by_bias, _CURVES, strict=True):
            for number, (key, factor, _, _) in enumerate(lines):
                values = factor * np.asarray(curves.get(key, ()))
                shown = key != "beside_mW" or now[key] > _NONE_MW
                drawn = {"x": short(curves.get("bias_V", ())), "y": short(values)}
                plot.figure["data"][2 * number] |= drawn | {"visible": shown}
                dot = {"x": [now["bias_V"]], "y": short([factor * now[key]])}
                plot.figure["data"][2 * number + 1] |= dot | {"visible": shown}
            plot.update()

    def _draw(
        self, drawn: ContactPicture, colours: Any, now: dict[str, float], base_K: float
    ) -> None:
        figure, width = self._picture.figure, drawn.half_width
        shapes = []
        for number, (_, top, bottom) in enumerate(drawn.layers):
            corners = [(-width, top), (width, top), (width, bottom), (-width, bottom)]
            shapes.append(filled(corners, _FILL.format(0.12 + 0.16 * (number % 2))))
        for (corners, _), colour in zip(drawn.pieces, colours, strict=True):
            shapes.append(filled(corners, colour))
        shapes += [outlined(line, closed=False) for line in drawn.outlines]
        names = [
            _words(
                -0.97 * width,
                (top + bottom) / 2.0,
                name.replace("\n", "<br>").replace(", ", "<br>"),
            )
            for name, top, bottom in drawn.layers
        ]
        layout = figure["layout"]
        layout |= {"shapes": shapes, "annotations": names}
        layout["xaxis"]["range"] = [-1.02 * width, 1.02 * width]
        heights, texts = zip(*drawn.ticks, strict=True)
        layout["yaxis"] |= {"range": [drawn.bottom, drawn.top]}
        layout["yaxis"] |= {"tickvals": list(heights), "ticktext": list(texts)}
        span = max(now["tip_K"] - base_K, 1.0)
        layout["xaxis2"]["range"] = [base_K - 0.06 * span, base_K + 1.06 * span]
        figure["data"][1] |= {"x": short(drawn.temperature_K), "y": short(drawn.height)}
        ends = [0, drawn.apex, drawn.apex + 1]
        figure["data"][2] |= {
            "x": short(drawn.temperature_K[ends]),
            "y": short(drawn.height[ends]),
            "hovertext": ["tip at the lever", "apex", "sample under the middle of the contact"],
        }
        self._picture.update()


def _words(x: float, y: float, text: str) -> dict[str, Any]:
    return {"x": x, "y": y, "text": text, "xanchor": "left", "showarrow": False, "align": "left"}
