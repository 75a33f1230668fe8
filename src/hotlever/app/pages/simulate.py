"""Simulate: a lever that follows sliders, at a bias or in time."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app import live
from hotlever.app.jobs import Task
from hotlever.app.pages.chosen_lever import (
    NOW,
    beside_in_words,
    in_python,
    lever_beside,
    options_beside,
    sweep_of,
)
from hotlever.app.pages.driven import Pulses, SmallSignals
from hotlever.app.pages.frame import flat_button
from hotlever.app.pages.live_page import LivePage, texts_of
from hotlever.app.pages.plots import LivePlots, redraw
from hotlever.app.pages.task_page import KINDS
from hotlever.errors import HotleverError, InputError
from hotlever.lever.set_points import HELD
from hotlever.materials.parameters import label
from hotlever.probe.surroundings import Physics
from hotlever.tasks.parsing import parse_set_points

#: Numbers of a state, those of the lever beside too.
_NUMBERS = {
    "tip_K": ("tip", "{:.1f} K", 1.0),
    "current_mA": ("current I_h", "{:.4f} mA", 1.0),
    "lever_V": ("lever voltage V_l", "{:.4f} V", 1.0),
    "power_mW": ("power P_l", "{:.4f} mW", 1.0),
    "reader_V": ("reader V_r", "{:.4f} V", 1.0),
}
#: Biases of a sweep that is written.
_BIASES = 49
#: What surrounds a lever: each combination gets a reduced lever of its own.
_MEDIUM, _GAP = _AROUND = "medium", "surface_gap_um"
_MODELS = {
    "full lever": "full lever: the numbers of hotlever sweep",
    "reduced lever": "moving: reduced lever, within some 0.1 K",
    "coarse lever": "moving: coarse lever, within some 2 K",
}
#: What a table is of, and examples of set points.
_TABLES = {"": "by the bias", "resistance": "held at a resistance", "power": "held at a power"}
_SET_POINTS = {"resistance": "2.5kohm:3kohm:6", "power": "1mW:4mW:7"}
_VIEWS = {"rest": "at a bias", "time": "in time", "signals": "small signals"}
#: Sliders of the probe.
_GROUPS = {"material": "Material", "dimensions": "Dimensions", "circuit": "Circuit"}


class SimulatePage(LivePage):
    """One tab of the page."""

    name, plots_of = "simulate", LivePlots
    live: ClassVar = live
    first: ClassVar = {
        "probe": "",
        "changes": {},
        "beside": "",
        "kept": {"probe": "", "changes": {}},
        "bias": 8.0,
        "most": 12.0,
        "view": "rest",
        "held": "",
        "set_points": "",
    }
    numbers = _NUMBERS | {"knee": ("knee of the I-V curve", "{:.0f} K, {knee_V:.3f} V", 1.0)}
    state = ("bias", "most")
    kinds = KINDS

    # --- what is shown ----------------------------------------------------------------------------

    def controls(self) -> None:
        """Ask for a lever to be compared."""
        self._beside = self.chosen["beside"]
        self.choice("beside", "Compare with", options_beside(self.session.project.probes))

    def results(self) -> None:
        """Show the lever at a bias, in time, or under small signals."""
        self._view = ui.toggle(_VIEWS, value=self.chosen["view"])
        self._view.props('aria-label="What is shown"').on_value_change(self._viewed)
        with ui.column().classes("w-full gap-3 parts") as rest:
            super().results()
        with ui.column().classes("w-full gap-3 last") as time:
            self._pulses = Pulses(self.session, self.banner, self.chosen)
        with ui.column().classes("w-full gap-3") as signals:
            self._signals = SmallSignals(self.session, self.banner, self.chosen)
        for name, column in (("rest", rest), ("time", time), ("signals", signals)):
            column.bind_visibility_from(self._view, "value", value=name)

    def _viewed(self, event: Any) -> None:
        self.chosen["view"] = event.value
        redraw(self._view)

    async def changed(self) -> None:
        """Show another probe, as it stands in its file, another one beside, or another table."""
        before, self._beside = self._beside, self.chosen["beside"]
        if self._beside == NOW != before:
            self.chosen["kept"] = {key: self.chosen[key] for key in ("probe", "changes")}
        if self.opened_for == self.probe:
            self.refresh()
        else:
            await self.open()

    async def _reset(self) -> None:
        self.chosen["changes"] = {}
        await self.open()

    def refresh(self) -> None:
        """Follow what was moved, in all views."""
        super().refresh()
        self._pulses.show_command()
        self._signals.show_command()

    # --- what is moved ----------------------------------------------------------------------------

    async def described(self) -> dict[str, Any]:
        """Return what the probe's file says of all that can be moved."""
        if self.chosen["probe"] != self.probe:  # what was changed is of another one
            self.chosen |= {"probe": self.probe, "changes": {}}
        probe = await self.session.ask("quick", live.described, self.probe)
        self._of_probe = probe
        values = {name: value for group in _GROUPS for name, value, *_ in probe["sliders"][group]}
        of_material = {name for name, *_ in probe["sliders"]["material"]}
        #: What may change without another reduced lever; nothing if there can be none.
        self._free = of_material | {"series_resistance_ohm"} if probe["reduced"] else set[str]()
        return {**values, **probe["around"]}

    def show_sliders(self) -> None:
        """Show what is around the lever, the bias, and all numbers of the probe."""
        with ui.row().classes("items-center w-full no-wrap"):
            ui.label("in")
            medium = self._field(_MEDIUM, ui.toggle(["vacuum", "air"]))
            gap = self._field(_GAP, ui.number("surface (µm)", min=0.01, max=1e4))
            gap.props("clearable placeholder=none stack-label")
            gap.bind_visibility_from(medium, "value", value="air")
        with ui.row().classes("items-center w-full"):
            for effect, meaning in Physics.description().items():
                self._field(effect, ui.checkbox(effect).tooltip(meaning))
        with ui.column().classes("w-full gap-0") as of_bias:
            self.slider_of_bias()
        of_bias.bind_visibility_from(self._view, "value", backward=lambda name: name != "time")
        meanings = self._of_probe["meanings"]
        for group, title in _GROUPS.items():
            opened = ui.expansion(title, value=group == "material")
            with opened.props("dense-toggle header-class=text-bold"):
                for name, _, low, high, unit in self._of_probe["sliders"][group]:
                    hint = f"{name}: {meanings[name]}" if name in meanings else name
                    unit = "" if unit == "1" else unit
                    self.slider(name, label(name), low, high, unit, hint)
        flat_button("All as in the probe file", self._reset, icon="restart_alt")

    def _field(self, name: str, field: Any) -> Any:
        field.set_value(self.value(name))
        field.on_value_change(lambda event: self.set_value(name, event.value))
        return field

    def value(self, key: str) -> Any:
        """Return a value of the probe as it is changed, or the bias."""
        return self.chosen["changes"].get(key, self.of_file[key])

    def set_value(self, key: str, value: Any) -> None:
        """Change a value of the probe; what is as in its file is no change."""
        if value is None and key != _GAP:
            return
        changes = {name: old for name, old in self.chosen["changes"].items() if name != key}
        if value != self.of_file[key]:
            changes[key] = value
        if changes != self.chosen["changes"]:
            self.chosen["changes"] = changes
            self.refresh()

    # --- a lever at a bias ------------------------------------------------------------------------

    def of_lever(self) -> Task:
        """Return the command of a sweep, whatever the biases."""
        return sweep_of(self.chosen)

    def also_asked(self) -> tuple[bool]:
        """Return whether the reduced lever of the geometry has been made."""
        return (self.session.reduced.get(self._geometry(), False),)

    def model_and_remark(self, answer: dict[str, Any], quick: bool) -> tuple[str, str]:
        """Return of which lever the numbers are."""
        return _MODELS[answer["model"]], ""

    async def follow_answer(self, at: list[float], quick: bool) -> None:
        """Show the lever beside, once the other rests."""
        lever, answer, text = lever_beside(self.chosen), None, ""
        if lever is not None and not quick:
            text = f"Dashed: {beside_in_words(self.chosen)}"
            try:
                arguments = sweep_of(lever), *at, False
                answer = await self.session.ask("beside", live.answer, *arguments)
                texts = texts_of(answer["now"], _NUMBERS)
                text += ": " + ", ".join(f"{_NUMBERS[key][0]} {texts[key]}" for key in texts)
            except HotleverError as error:
                text = f"{text}: {error}"
            if self.is_gone or lever != lever_beside(self.chosen):
                return
        self.plots.beside(answer, text)

    def _geometry(self) -> Any:
        """Return what a reduced lever belongs to."""
        changes = self.chosen["changes"].items()
        fixed = {name: value for name, value in changes if name not in self._free}
        return self.chosen["probe"], tuple(sorted(fixed.items(), key=str))

    async def rested(self) -> None:
        """Have the reduced lever of the geometry made, so that sliders are answered by it."""
        geometry, reduced = self._geometry(), self.session.reduced
        around = dict(geometry[1])
        if not self._free or geometry in reduced or set(around) - set(_AROUND):
            return
        reduced[geometry] = False
        task = sweep_of({"probe": geometry[0], "changes": around})
        with suppress(HotleverError):
            reduced[geometry] = await self.session.ask("making", live.prepare, task)

    # --- the table --------------------------------------------------------------------------------

    def about_table(self) -> None:
        """Ask what the table is of."""

        with ui.row().classes("w-full items-end"):
            held = self.choice("held", "A table of states", _TABLES)
            held.classes("w-48", remove="w-full")
            points = self.text("set_points", "Set points").props("debounce=200 stack-label")
            examples = (f"{what}: {text}" for what, text in _SET_POINTS.items())
            points.props(f'placeholder="{", ".join(examples)}"').classes("col", remove="w-full")
            points.bind_visibility_from(held, "value")

    @property
    def _set_points(self) -> str:
        """What states are held at, as the options of commands have it."""
        return self.chosen["set_points"] or _SET_POINTS[self.chosen["held"]]

    def of_table(self, kind: str) -> dict[str, Any]:
        """Return what a table is of; the fields are those at the bias that is shown."""
        chosen = self.chosen
        if held := chosen["held"]:
            return {f"hold_{held}": self._set_points}
        table = f"0:{chosen['most']:.12g}:{_BIASES}"
        return {"bias": f"{chosen['bias']:.12g}V" if kind == "VTU" else table}

    def python(self) -> str:
        """Return the lines of Python that make the sweep."""
        if not (held := self.chosen["held"]):
            last = f"sweep = lever.sweep(np.linspace(0, {self.chosen['most']:g}, {_BIASES}))"
            return in_python(self.chosen, last, "import numpy as np")
        unit = HELD[held].unit
        try:
            points = parse_set_points(self._set_points, unit, "set points").tolist()
        except InputError:
            return ""  # the command will say what is wrong
        last = f'data = hold(lever, "{held}", {points}).data  # {unit}'
        return in_python(self.chosen, last, "from hotlever.lever.set_points import hold")
