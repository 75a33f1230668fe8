"""The sliders of the page Simulate: bias, parameters, and what is around the lever."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from nicegui import ui

from hotlever.app.pages.following import slider
from hotlever.app.pages.frame import flat_button
from hotlever.app.pages.page import Page
from hotlever.errors import HotleverError
from hotlever.materials.parameters import label
from hotlever.probe.physics import Physics

_GROUPS = {"material": "Material", "dimensions": "Dimensions", "circuit": "Circuit"}


class Sliders:
    """What can be moved; `moved` is called when something was.

    Attributes
    ----------
    free : set of str
        What may change without another reduced lever.
    of_bias : ui.element
        The slider of the bias, which is not of the probe.
    """

    def __init__(self, page: Page, moved: Callable[[], None]) -> None:
        self._session, self._banner, self._chosen = page.session, page.banner, page.chosen
        self._moved = moved
        self.free = set[str]()
        # medium, surface and physics: what the probe's file says of them, and the fields
        self._of_file: dict[str, Any] = {}
        self._around: dict[str, Any] = {}
        self._show_surroundings()
        self._show_physics()
        self._show_bias()
        self._of_probe = ui.column().classes("w-full gap-1")

    def _show_surroundings(self) -> None:
        with ui.row().classes("items-center w-full no-wrap"):
            ui.label("in")
            medium = self._add_around("medium", ui.toggle(["vacuum", "air"], value="vacuum"))
            gap = ui.number("surface (µm)", min=0.01, max=1e4)
            gap.props("clearable placeholder=none stack-label")
            gap.bind_visibility_from(medium, "value", value="air")
            self._add_around("surface_gap_um", gap)

    def _show_physics(self) -> None:
        with ui.row().classes("items-center w-full"):
            for effect, meaning in Physics.description().items():
                self._add_around(effect, ui.checkbox(effect).tooltip(meaning))

    def _add_around(self, name: str, field: Any) -> Any:
        self._around[name] = field
        field.on_value_change(lambda event: self._change(name, event.value, self._of_file))
        return field

    def _show_bias(self) -> None:
        with ui.column().classes("w-full gap-0") as self.of_bias:
            with ui.row().classes("w-full items-center no-wrap justify-between"):
                ui.label("Bias V_b").classes("text-bold")
                number = ui.number(format="%.3f", min=0.0, step=0.05).classes("w-28")
                number.props('suffix=V aria-label="Bias in volts"')
            bias, most = self._chosen["bias"], self._chosen["most"]
            self._slider_of_bias = ui.slider(min=0.0, max=most, step=0.01, value=bias)
            number.bind_value(self._slider_of_bias.props('aria-label="Bias"'))
            self._slider_of_bias.on_value_change(lambda event: self._move_bias(event.value))

    async def open(self) -> None:
        """Show the sliders of the probe, and say that they have moved."""
        try:
            probe = await self._session.ask("quick", "live:described", self._chosen["probe"])
        except HotleverError as error:
            self._banner.say(str(error))
            return
        changes = self._chosen["changes"]
        self._of_file = probe["around"]
        for name, field in self._around.items():
            field.set_value(changes.get(name, self._of_file[name]))
        self._of_probe.clear()
        with self._of_probe:
            for group, title in _GROUPS.items():
                opened = ui.expansion(title, value=group == "material")
                with opened.props("dense-toggle header-class=text-bold"):
                    for slider in probe["sliders"][group]:
                        self._slider(probe["meanings"].get(slider[0], ""), *slider)
            flat_button("All as in the probe file", self._reset, icon="restart_alt")
        of_material = {name for name, *_ in probe["sliders"]["material"]}
        self.free = of_material | {"series_resistance_ohm"} if probe["reduced"] else set()
        self._moved()

    def _slider(
        self, meaning: str, name: str, value: float, low: float, high: float, unit: str
    ) -> None:
        """Show the slider of a parameter; its name in files on hover."""
        words, hint = label(name), f"{name}: {meaning}" if meaning else name
        now = self._chosen["changes"].get(name, value)
        number = slider(words, now, low, high, "" if unit == "1" else unit, hint)
        number.on_value_change(lambda event: self._change(name, event.value, {name: value}))

    async def _reset(self) -> None:
        self._chosen["changes"] = {}
        await self.open()

    def _move_bias(self, value: float | None) -> None:
        if value is not None:
            self._chosen["bias"] = float(value)
            if value > self._chosen["most"]:
                # one may type more than the slider has, and the curves go as far
                self._chosen["most"] = float(math.ceil(value))
                self._slider_of_bias.props(f"max={self._chosen['most']:g}")
            self._moved()

    def _change(self, name: str, value: Any, of_file: dict[str, Any]) -> None:
        if name not in of_file or (value is None and name != "surface_gap_um"):
            return
        changes = {key: old for key, old in self._chosen["changes"].items() if key != name}
        if value != of_file[name]:
            changes[name] = value
        if changes != self._chosen["changes"]:
            self._chosen["changes"] = changes
            self._moved()
