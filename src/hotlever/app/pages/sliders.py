"""A lever that follows sliders: those of the bias and of each parameter, its numbers and plots.

While sliders move a quick lever answers, then the full one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from nicegui import ui

from hotlever.app.pages.beside import beside_in_words, lever_beside
from hotlever.app.pages.following import Follower, slider
from hotlever.app.pages.frame import flat_button, number_shown
from hotlever.app.pages.page import Page
from hotlever.app.pages.plots import LivePlots
from hotlever.errors import HotleverError
from hotlever.materials.parameters import label
from hotlever.probe.physics import Physics

_GROUPS = {"material": "Material", "dimensions": "Dimensions", "circuit": "Circuit"}
#: What is chosen of a lever, which has to be solved for it, and of a state.
_OF_LEVER, _OF_BIAS = ("probe", "changes"), ("bias", "most")
#: What surrounds a lever: each combination gets a reduced lever of its own.
_AROUND = {"medium", "surface_gap_um"}
_MODELS = {
    "full lever": "full lever: the numbers of hotlever sweep",
    "reduced lever": "moving: reduced lever, within some 0.1 K",
    "coarse lever": "moving: coarse lever, within some 2 K",
}
_NUMBERS = {
    "tip_K": ("tip", "{:.1f} K"),
    "current_mA": ("current I_h", "{:.4f} mA"),
    "lever_V": ("lever voltage V_l", "{:.4f} V"),
    "power_mW": ("power P_l", "{:.4f} mW"),
    "reader_V": ("reader V_r", "{:.4f} V"),
}


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


class LiveView:
    """What the lever that is chosen shows at the bias that is chosen."""

    def __init__(self, page: Page) -> None:
        self._session, self._banner, self._chosen = page.session, page.banner, page.chosen
        self._free: set[str] = set()
        with ui.row().classes("w-full items-end gap-6 numbers"):
            self._numbers = {key: number_shown(key, title) for key, (title, _) in _NUMBERS.items()}
            self._knee = number_shown("knee", "knee of the I-V curve")
        self._model = ui.label("starting").classes("text-xs opacity-70").props("aria-live=polite")
        self._follower = Follower(self._model, self._show, self._prepare)
        self._notes = ui.label().classes("text-sm remark")
        self._beside = ui.label().classes("text-sm remark").props("data-number=beside")
        with ui.column().classes("w-full") as self._drawn:
            self._plots = LivePlots()

    def follow(self, free: set[str]) -> None:
        """Have the lever follow what is chosen."""
        self._free = free
        chosen = ({key: self._chosen[key] for key in keys} for keys in (_OF_LEVER, _OF_BIAS))
        self._follower.follow(*chosen)

    async def _show(self, lever: dict[str, Any], at: dict[str, Any], quick: bool) -> bool:
        probe, changes = lever["probe"], lever["changes"]
        ask = {**at, "quick": quick}
        ask["reduced"] = self._session.reduced.get(self._geometry(probe, changes), False)
        worker = "quick" if quick else "full"
        try:
            answer = await self._session.ask(worker, "live:answer", probe, changes, ask)
        except HotleverError as error:
            if not self._model.is_deleted:
                self._blank()
                self._banner.say(str(error))
            return False
        if self._model.is_deleted:  # the tab was closed meanwhile
            return False
        if not quick and not self._follower.is_wanted(lever):
            return False  # parameters have moved on while the full lever was solved
        self._banner.clear()
        self._drawn.set_visibility(True)
        now, knee = answer["now"], answer["curves"]["knee"]
        for key, (_, form) in _NUMBERS.items():
            value = now[key]
            self._numbers[key].set_text("none" if math.isnan(value) else form.format(value))
        at_knee = "none" if knee is None else f"{knee['tip_K']:.0f} K, {knee['lever_V']:.3f} V"
        self._knee.set_text(at_knee)
        self._model.set_text(_MODELS[answer["model"]])
        self._notes.set_text("; ".join(now["notes"]))
        self._plots.show(answer)
        await self._show_beside(ask)
        return True

    async def _show_beside(self, ask: dict[str, Any]) -> None:
        """Show the lever beside, at the same bias, once that of the page rests."""
        lever, answer, text = lever_beside(self._chosen), None, ""
        if lever is not None and not ask["quick"]:
            text = f"Dashed: {beside_in_words(self._chosen)}"
            asked = lever["probe"], lever["changes"], {**ask, "reduced": False}
            try:
                answer = await self._session.ask("beside", "live:answer", *asked)
                now = answer["now"]
                numbers = (
                    f"{title} {'none' if math.isnan(now[key]) else form.format(now[key])}"
                    for key, (title, form) in _NUMBERS.items()
                )
                text = f"{text}: {', '.join(numbers)}"
            except HotleverError as error:
                text = f"{text}: {error}"
            if self._model.is_deleted or lever != lever_beside(self._chosen):
                return
        self._beside.set_text(text)
        self._plots.beside(answer)

    def _blank(self) -> None:
        """Show no numbers where there are none: the last ones were of another state."""
        for number in (*self._numbers.values(), self._knee):
            number.set_text("–")
        self._model.set_text("no state is shown")
        self._notes.set_text("")
        self._drawn.set_visibility(False)

    def _geometry(self, probe: str | None, changes: dict[str, Any]) -> Any:
        """Return what a reduced lever belongs to."""
        fixed = {name: value for name, value in changes.items() if name not in self._free}
        return probe, tuple(sorted(fixed.items(), key=str))

    async def _prepare(self) -> None:
        """Have the reduced lever of the geometry made, so that sliders are answered by it."""
        probe, reduced = self._chosen["probe"], self._session.reduced
        geometry = self._geometry(probe, self._chosen["changes"])
        around = dict(geometry[1])
        if not self._free or geometry in reduced or set(around) - _AROUND:
            return
        reduced[geometry] = False
        with suppress(HotleverError):
            reduced[geometry] = await self._session.ask("making", "live:prepare", probe, around)
