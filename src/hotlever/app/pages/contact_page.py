"""Contact: a tip that touches a sample, which follows sliders."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import numpy as np
from nicegui import ui

from hotlever.app import touching
from hotlever.app.pages import plots
from hotlever.app.pages.frame import caption, flat_button
from hotlever.app.pages.live_page import LivePage, slider
from hotlever.app.pages.task_page import MEDIA
from hotlever.app.session import Task
from hotlever.contact.picture import ContactPicture
from hotlever.errors import InputError
from hotlever.figures.style import BLUE, PURPLE, VERMILION
from hotlever.materials.catalogue import sample_names
from hotlever.probe.tip import parsed_layers


class ContactPlots:
    """A tip in contact, with the temperature along its axis, and curves by bias.

    `show` is given the answers of `hotlever.app.touching`.
    """

    def __init__(self) -> None:
        layout = plots.axes("", "", 420, normal="xy")
        layout["margin"] = {"l": 62, "r": 8, "t": 24, "b": 42}
        layout["yaxis"] |= {"showgrid": False, "ticks": "outside", "tickcolor": plots.INK}
        layout["xaxis"] |= {"domain": [0.0, 0.54], "showgrid": False, "showticklabels": False}
        layout["xaxis2"] = plots.axes("temperature (K)", "", 0, normal="x")["xaxis"]
        layout["xaxis2"] |= {"domain": [0.58, 1.0], "anchor": "y", "nticks": 4}
        along = [
            plots.line(VERMILION) | {"xaxis": "x2"},
            plots.dots(VERMILION, 9) | {"xaxis": "x2"},
        ]
        alt = "Tip, contact and sample coloured by temperature, and the temperature along the axis"
        # the axis of the picture is drawn for what has values on it
        nothing = {"type": "scatter", "x": [None], "y": [None], "hoverinfo": "skip"}
        self._picture = plots.plotted([nothing, *along], layout, alt)
        caption(
            "Heights and radii in proportion near the contact, by decades away from it. Under "
            "the contact the temperature is that along its axis."
        )
        # by title the lines: column, factor, colour and name
        curves = {
            "temperature (K)": (
                ("tip_K", 1.0, VERMILION, "tip at the lever"),
                ("apex_K", 1.0, PURPLE, "apex"),
            ),
            "heat into the sample (µW)": (
                ("sample_mW", 1e3, VERMILION, "through the contact"),
                ("beside_mW", 1e3, BLUE, "through air"),
            ),
            "change of I<sub>h</sub> (µA)": (("current_change_mA", 1e3, BLUE, "change of I_h"),),
        }
        self._by_bias: list[tuple[ui.plotly, Any]] = []
        with plots.side_by_side():
            for title, lines in curves.items():
                layout = plots.axes(plots.title_of("bias_V"), title, 240, normal="y")
                if len(lines) > 1:
                    above = {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom"}
                    layout |= {"showlegend": True, "legend": above}
                    layout["margin"]["t"] = 30
                data = []
                for _, _, colour, name in lines:
                    data.append(plots.line(colour) | {"name": name})
                    data.append(plots.dots(colour, 10) | {"name": name, "showlegend": False})
                self._by_bias.append((plots.plotted(data, layout, f"{title} by bias"), lines))

    def show(self, answer: dict[str, Any]) -> None:
        """Draw an answer; one while sliders move has no curves, and those of before go."""
        self._draw(answer["picture"], answer["colours"], answer["now"], answer["base_K"])
        curves, now = answer["curves"] or {}, answer["now"]
        for plot, lines in self._by_bias:
            for number, (key, factor, _, _) in enumerate(lines):
                # less heat (mW) is none but for rounding
                visibility = {"visible": key != "beside_mW" or now[key] > 1e-9}
                for place, columns in enumerate((curves, now)):
                    values = factor * np.asarray(columns.get(key, ()))
                    drawn = plots.points(columns.get("bias_V", ()), values)
                    plot.figure["data"][2 * number + place] |= drawn | visibility
            plot.update()

    def _draw(
        self, drawn: ContactPicture, colours: Any, now: dict[str, float], base_K: float
    ) -> None:
        figure, width = self._picture.figure, drawn.half_width
        shapes, names = [], []
        words = {"x": -0.97 * width, "xanchor": "left", "showarrow": False, "align": "left"}
        for number, (name, top, bottom) in enumerate(drawn.layers):
            corners = [(-width, top), (width, top), (width, bottom), (-width, bottom)]
            shapes.append(plots.filled(corners, plots.shade(0.12 + 0.16 * (number % 2))))
            text = name.replace("\n", "<br>").replace(", ", "<br>")
            names.append({"y": (top + bottom) / 2.0, "text": text, **words})
        for (corners, _), colour in zip(drawn.pieces, colours, strict=True):
            shapes.append(plots.filled(corners, colour))
        shapes += [plots.outlined(outline, closed=False) for outline in drawn.outlines]
        layout = figure["layout"]
        layout |= {"shapes": shapes, "annotations": names}
        layout["xaxis"]["range"] = [-1.02 * width, 1.02 * width]
        heights, texts = zip(*drawn.ticks, strict=True)
        layout["yaxis"] |= {"range": [drawn.bottom, drawn.top]}
        layout["yaxis"] |= {"tickvals": list(heights), "ticktext": list(texts)}
        span = max(now["tip_K"] - base_K, 1.0)
        layout["xaxis2"]["range"] = [base_K - 0.06 * span, base_K + 1.06 * span]
        figure["data"][1] |= plots.points(drawn.temperature_K, drawn.height)
        ends = [0, drawn.apex, drawn.apex + 1]
        figure["data"][2] |= plots.points(drawn.temperature_K[ends], drawn.height[ends])
        under = "sample under the middle of the contact"
        figure["data"][2]["hovertext"] = ["tip at the lever", "apex", under]
        self._picture.update()


class SampleLayers:
    """Fields for the layers of a sample, from the top: materials, and thicknesses but for the last.

    `changed` is called with what they say, as a command does. A text that is none is shown as it
    is.
    """

    def __init__(self, changed: Callable[[str], None]) -> None:
        self._changed = changed
        #: Materials and thicknesses (nm); the last counts for nothing.
        self._layers: list[tuple[str, float]] = []
        self._column = ui.column().classes("w-full gap-1")

    def show(self, text: str) -> None:
        """Show the fields of a text such as ``polymer, 100nm, silicon``."""
        try:
            layers = parsed_layers(text, "")
        except InputError:
            layers = ()
        self._layers = [(layer.material, 1e3 * (layer.thickness_um or 0.0)) for layer in layers]
        self._column.clear()
        with self._column:
            if not layers:
                field = ui.input("Sample", value=text).classes("w-full")
                field.on_value_change(lambda event: self._changed(event.value))
                return
            for number, (material, thickness) in enumerate(self._layers):
                self._layer(number, material, thickness)
            flat_button("A layer on top", self._add, icon="add")

    def _layer(self, number: int, material: str, thickness: float) -> None:
        last = number == len(self._layers) - 1
        where = "substrate" if last else f"layer {number + 1}"
        names = list(dict.fromkeys((*sample_names(), material)))
        with ui.row().classes("w-full items-center no-wrap gap-1"):
            chosen = ui.select(names, label=where, value=material, with_input=True)
            chosen.classes("col").props("new-value-mode=add-unique")
            chosen.tooltip("A material, or its thermal conductivity in W/(m K)")
            chosen.on_value_change(lambda event: self._set(number, material=event.value))
            if not last:
                remove = partial(self._remove, number)
                flat_button("", remove, icon="close", label=f"Remove {where}")
        if not last:
            words = f"thickness of {where}"
            field = slider(words, thickness, 1.0, 1e4, "nm", by_decades=True)
            field.on_value_change(lambda event: self._set(number, thickness=event.value))

    def _set(
        self, number: int, material: str | None = None, thickness: float | None = None
    ) -> None:
        before = self._layers[number]
        self._layers[number] = material or before[0], thickness or before[1]
        self._changed(self._text())

    def _add(self) -> None:
        self._layers.insert(0, (self._layers[0][0], 100.0))
        self._changed(self._text())
        self.show(self._text())

    def _remove(self, number: int) -> None:
        del self._layers[number]
        self._changed(self._text())
        self.show(self._text())

    def _text(self) -> str:
        *films, (substrate, _) = self._layers
        return ", ".join([*(f"{name}, {thickness:g}nm" for name, thickness in films), substrate])


class ContactPage(LivePage):
    """One tab of the page."""

    name, plots_of = "contact", ContactPlots
    live: ClassVar = touching
    #: What is None or empty is what the probe file says, or what is usual.
    first: ClassVar = {
        "medium": "",
        "sample": "",
        "radius_nm": None,
        "interface": None,
        "bias": 8.0,
        "most": 12.0,
    }
    numbers: ClassVar = {
        "tip_K": ("tip at the lever", "{:.1f} K", 1.0),
        "apex_K": ("apex", "{:.1f} K", 1.0),
        "sample_mW": ("heat into the sample", "{:.3g} µW", 1e3),
        "tip_change_K": ("the contact changes the tip by", "{:.3g} K", 1.0),
        "current_change_mA": ("and the current I_h by", "{:.3g} µA", 1e3),
    }
    state = ("bias", "most")

    def controls(self) -> None:
        """Ask for what is around the lever."""
        media = {name: words for name, words in MEDIA.items() if name != "unknown"}
        self.choice("medium", "Around it", {**media, "": "as the probe file says"})

    def show_sliders(self) -> None:
        """Show bias, radius, interface, and the layers of the sample."""
        self.slider_of_bias(0.1)
        hint = "apex_radius_um: of the flat end"
        words = "radius of the contact"
        self.slider("radius_nm", words, 1.0, 1000.0, "nm", hint, by_decades=True)
        hint = (
            "interface_K_per_mW: thermal resistance between apex and sample, a thousandth of this"
        )
        how: dict[str, Any] = {"by_decades": True, "from_zero": True}
        self.slider("interface", "resistance of the interface", 1e4, 1e10, "K/W", hint, **how)
        ui.label("Sample, from the top").classes("text-bold")
        SampleLayers(partial(self.set_value, "sample")).show(self.value("sample"))
        flat_button("All as in the probe file", self._reset, icon="restart_alt")

    async def _reset(self) -> None:
        self.chosen |= {"sample": "", "radius_nm": None, "interface": None}
        await self.open()

    def of_lever(self) -> Task:
        """Return the command of the contact, whatever the bias."""
        radius, interface = self.chosen["radius_nm"], self.chosen["interface"]
        options = {
            "sample": self.value("sample"),
            "radius": "" if radius is None else f"{radius:.12g}nm",
            "interface": "" if interface is None else f"{interface:.12g}K/W",
            "medium": self.chosen["medium"],
        }
        return Task("contact", self.probe_files, options)

    def of_table(self, kind: str) -> dict[str, Any]:
        """Return the biases of a table."""
        most = self.chosen["most"]
        return {"bias": f"{most / 25:.12g}:{most:.12g}:25"}

    def model_and_remark(self, answer: dict[str, Any], quick: bool) -> tuple[str, str]:
        """Return whose numbers these are, and the resistances."""
        now = answer["now"]
        names = {
            "tip_K_per_mW": "cone",
            "interface_K_per_mW": "interface",
            "spreading_K_per_mW": "spreading in the sample",
        }
        resistances = (f"{words} {_per_watt(now[key])}" for key, words in names.items())
        model = "full lever: the numbers of hotlever contact"
        if quick:
            model = (
                "moving: coarse lever, within some 2 K, 10 K near the knee; changes within some "
                "10 % unless they are about to turn"
            )
        return model, f"Thermal resistances: {', '.join(resistances)}"


def _per_watt(resistance_K_per_mW: float) -> str:
    if math.isnan(resistance_K_per_mW):
        return "not known without heat"
    return f"{1e3 * resistance_K_per_mW:.3g} K/W" if resistance_K_per_mW else "none"
