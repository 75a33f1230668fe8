"""The sliders of the room Simulate: of the bias, and of each parameter of a probe."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import named
from hotlever.app.page import Complaint
from hotlever.app.rooms.room import choice, probe_names
from hotlever.app.session import Session
from hotlever.errors import HotleverError

LIVE = "hotlever.app.live"
#: What is chosen at first; `most` is the highest bias of the slider (V).
FIRST: dict[str, Any] = {"probe": None, "changes": {}, "bias": 8.0, "most": 12.0}
_GROUPS = {"material": "Material", "dimensions": "Dimensions", "circuit": "Circuit"}


def stem(chosen: dict[str, Any]) -> str:
    """Return what names of files begin with."""
    return Path(chosen["probe"] or "reference.toml").stem


def options(chosen: dict[str, Any]) -> list[str]:
    """Return the words of a command line that name the probe that is chosen."""
    words = [named(chosen["probe"])] if chosen["probe"] else []
    for name, value in sorted(chosen["changes"].items()):
        text = "none" if value is None else f"{value!r}" if value != str(value) else value
        words += ["--medium", text] if name == "medium" else ["--set", f"{name}={text}"]
    return words


def in_python(chosen: dict[str, Any]) -> str:
    """Return what makes the probe that is chosen in Python."""
    name, changes = chosen["probe"], dict(sorted(chosen["changes"].items()))
    made = f"Probe.from_file({name!r})" if name else "Probe.reference()"
    if not changes:
        return made
    if all(name.isidentifier() for name in changes):
        return f"{made}.with_({', '.join(f'{key}={value!r}' for key, value in changes.items())})"
    return f"{made}.with_(**{changes!r})"


class Sliders:
    """What can be moved; `moved` is called when something was.

    Attributes
    ----------
    free : set of str
        What may change without another reduced lever.
    of_bias : ui.element
        The slider of the bias, which is not of the probe.
    """

    def __init__(
        self,
        session: Session,
        complaint: Complaint,
        chosen: dict[str, Any],
        moved: Callable[[], None],
    ) -> None:
        self._session, self._complaint, self._chosen = session, complaint, chosen
        self._moved, self.free = moved, set[str]()
        names, probe = probe_names(session), chosen["probe"] or ""
        choice("Probe", names, probe, lambda event: self._take(event.value or None))
        self._around()
        self._bias()
        self._of_probe = ui.column().classes("w-full gap-1")

    def _around(self) -> None:
        with ui.row().classes("items-center w-full no-wrap"):
            ui.label("in")
            self._medium = ui.toggle(
                ["vacuum", "air"],
                value=self._chosen["changes"].get("medium", "vacuum"),
                on_change=lambda event: self._change("medium", event.value),
            ).props("no-caps dense unelevated")
            self._gap = ui.number(
                "surface (µm)",
                value=self._chosen["changes"].get("surface_gap_um"),
                min=0.01,
                max=1e4,
                on_change=lambda event: self._change("surface_gap_um", event.value),
            ).props("dense outlined clearable placeholder=none stack-label")
            self._gap.bind_visibility_from(self._medium, "value", value="air")

    def _bias(self) -> None:
        with ui.column().classes("w-full gap-0") as self.of_bias:
            with ui.row().classes("w-full items-center no-wrap justify-between"):
                ui.label("Bias V_b").classes("text-bold")
                number = ui.number(format="%.3f", min=0.0, step=0.05).classes("w-28")
                number.props('dense outlined suffix=V aria-label="Bias in volts"')
            slider = ui.slider(
                min=0.0, max=self._chosen["most"], step=0.01, value=self._chosen["bias"]
            ).props('aria-label="Bias"')
            number.bind_value(slider)
            self._slider_of_bias = slider
            slider.on_value_change(lambda event: self._move_bias(event.value))

    async def open(self) -> None:
        """Show the sliders of the probe, and say that they have moved."""
        try:
            found = await self._session.quick.call(
                f"{LIVE}:described", self._session.project.folder, self._chosen["probe"]
            )
        except HotleverError as error:
            self._complaint.say(str(error))
            return
        if "medium" not in self._chosen["changes"]:
            self._medium.set_value(found["medium"])
        if found["gap_um"] is not None and "surface_gap_um" not in self._chosen["changes"]:
            self._gap.set_value(found["gap_um"])
        self._of_probe.clear()
        with self._of_probe:
            for group, title in _GROUPS.items():
                with (
                    ui.expansion(title, value=group == "material")
                    .classes("w-full")
                    .props("dense dense-toggle header-class=text-bold")
                ):
                    for slider in found["sliders"]:
                        if slider[0] == group:
                            self._slider(*slider[1:])
            ui.button("All as in the probe file", on_click=self._reset).props(
                "flat dense no-caps icon=restart_alt"
            )
        of_material = [slider[1] for slider in found["sliders"] if slider[0] == "material"]
        self.free = {*of_material, "series_resistance_ohm"} if found["reduced"] else set()
        self._moved()

    def _slider(
        self, name: str, value: float, low: float, high: float, unit: str, meaning: str
    ) -> None:
        """Show the slider of a parameter, and its number."""
        now = self._chosen["changes"].get(name, value)
        unit = "" if unit == "1" else unit
        with ui.column().classes("w-full gap-0"):
            with ui.row().classes("w-full items-center no-wrap justify-between"):
                ui.label(name).classes("text-sm").tooltip(meaning)
                number = ui.number(format="%.4g").classes("w-36")
                number.props(f'dense borderless suffix="{unit}" input-class=text-right')
                number.props(f'aria-label="{name}, {meaning}"')
            slider = ui.slider(min=low, max=high, step=(high - low) / 400, value=now)
            slider.props(f'dense aria-label="{meaning}"')
            number.bind_value(slider)
            slider.on_value_change(lambda event: self._change(name, event.value, value))

    async def _take(self, name: str | None) -> None:
        self._chosen |= {"probe": name, "changes": {}}
        await self.open()

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

    def _change(self, name: str, value: Any, of_probe: Any = None) -> None:
        if value is None and name != "surface_gap_um":
            return
        changes = dict(self._chosen["changes"])
        if value == of_probe:
            changes.pop(name, None)
        else:
            changes[name] = value
        self._chosen["changes"] = changes
        self._moved()
