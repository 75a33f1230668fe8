"""Simulate: a lever that follows sliders, at a bias or in time."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.beside import NUMBERS, Beside, PlotsWithBeside
from hotlever.app.pages.drawn import in_python, probe_files, settings, stem
from hotlever.app.pages.frame import ErrorBanner, two_columns
from hotlever.app.pages.live_page import LivePage
from hotlever.app.pages.page import Work, outputs
from hotlever.app.pages.pulses import Pulses
from hotlever.app.pages.sliders import Sliders
from hotlever.app.pages.small_signals import SmallSignals
from hotlever.app.session import Session
from hotlever.app.workers import Heard
from hotlever.errors import HotleverError, InputError
from hotlever.lever.set_points import HELD
from hotlever.tasks.ranges import parse_set_points

#: Biases of a sweep that is written.
_BIASES = 49
#: What is chosen of a lever, which has to be solved for it, and of a state.
_STATE = ("probe", "changes"), ("bias", "most")
#: What surrounds a lever: each combination gets a reduced lever of its own.
_AROUND = {"medium", "surface_gap_um"}
_NUMBERS = NUMBERS | {"knee": ("knee of the I-V curve", "{:.0f} K, {knee_V:.3f} V", 1.0)}
_MODELS = {
    "full lever": "full lever: the numbers of hotlever sweep",
    "reduced lever": "moving: reduced lever, within some 0.1 K",
    "coarse lever": "moving: coarse lever, within some 2 K",
}
#: What a table is of, and examples of set points.
_TABLES = {"": "by the bias", "resistance": "held at a resistance", "power": "held at a power"}
_SET_POINTS = {"resistance": "2.5kohm:3kohm:6", "power": "1mW:4mW:7"}
_VIEWS = {"rest": "at a bias", "time": "in time", "signals": "small signals"}


class SimulatePage(LivePage):
    """One tab of the page."""

    name = "simulate"
    numbers = _NUMBERS

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        with two_columns("live") as (left, right):
            with left:
                self.probe_choice()
                Beside(self, self._moved)
                self._sliders = Sliders(self, self._moved)
            with right:
                view = ui.toggle(_VIEWS, value=self.chosen["view"])
                view.props('aria-label="What is shown"').on_value_change(self._view)
                with ui.column().classes("w-full gap-3 parts") as rest:
                    self.show_live(self._make_plots)
                    with ui.card().classes("w-full last").props("flat bordered"):
                        ui.label("Take it with you").classes("text-bold")
                        self._show_table()
                        self.kind_buttons(lambda kind: self.run(self._sweep(kind)))
                        Work(session, self.name, self.give)
                        self.command()
                with ui.column().classes("w-full gap-3 last") as time:
                    self._pulses = Pulses(session, banner, self.chosen)
                with ui.column().classes("w-full gap-3") as signals:
                    self._signals = SmallSignals(session, banner, self.chosen)
                for name, shown in (("rest", rest), ("time", time), ("signals", signals)):
                    shown.bind_visibility_from(view, "value", value=name)
                of_bias = self._sliders.of_bias
                of_bias.bind_visibility_from(view, "value", backward=lambda name: name != "time")

    async def open(self) -> None:
        """Ask for the sliders of the probe, and so for the first state."""
        await self._sliders.open()

    def changed(self) -> Awaitable[None]:
        """Show another probe, as it stands in its file."""
        self.chosen["changes"] = {}
        return self.open()

    def _view(self, event: Any) -> None:
        self.chosen["view"] = event.value
        # what was hidden had no size that figures could be drawn for
        ui.run_javascript("setTimeout(() => window.dispatchEvent(new Event('resize')))")

    def _moved(self) -> None:
        self.follow(*({key: self.chosen[key] for key in keys} for keys in _STATE))
        self.show_command()
        self._pulses.show_command()
        self._signals.show_command()

    # --- at a bias --------------------------------------------------------------------------------

    def _make_plots(self) -> PlotsWithBeside:
        self._beside = PlotsWithBeside(self)
        return self._beside

    def _asked(self, lever: dict[str, Any], at: dict[str, Any], quick: bool) -> dict[str, Any]:
        """Return what `hotlever.app.live.answer` is asked of a lever."""
        reduced = self.session.reduced.get(self._geometry(**lever), False)
        return {**at, "quick": quick, "reduced": reduced}

    async def ask(
        self, lever: dict[str, Any], at: dict[str, Any], quick: bool, heard: Heard
    ) -> dict[str, Any]:
        """Return what a lever shows at a bias."""
        asked = lever["probe"], lever["changes"], self._asked(lever, at, quick)
        worker = "quick" if quick else "full"
        answer: dict[str, Any] = await self.session.ask(worker, "live:answer", *asked, heard=heard)
        return answer

    def said(self, answer: dict[str, Any], quick: bool) -> tuple[str, str]:
        """Return of which lever the numbers are, and its notes."""
        return _MODELS[answer["model"]], "; ".join(answer["now"]["notes"])

    async def shown(self, lever: dict[str, Any], at: dict[str, Any], quick: bool) -> None:
        """Show the lever beside."""
        await self._beside.show_beside(self._asked(lever, at, quick))

    def _geometry(self, probe: str | None, changes: dict[str, Any]) -> Any:
        """Return what a reduced lever belongs to."""
        free = self._sliders.free
        fixed = {name: value for name, value in changes.items() if name not in free}
        return probe, tuple(sorted(fixed.items(), key=str))

    async def rested(self) -> None:
        """Have the reduced lever of the geometry made, so that sliders are answered by it."""
        probe, reduced = self.chosen["probe"], self.session.reduced
        geometry = self._geometry(probe, self.chosen["changes"])
        around = dict(geometry[1])
        if not self._sliders.free or geometry in reduced or set(around) - _AROUND:
            return
        reduced[geometry] = False
        with suppress(HotleverError):
            reduced[geometry] = await self.session.ask("making", "live:prepare", probe, around)

    # --- the table --------------------------------------------------------------------------------

    def _show_table(self) -> None:
        """Ask what the table is of."""

        def keep(key: str) -> Callable[[Any], None]:
            def keep_value(event: Any) -> None:
                self.chosen[key] = event.value
                self.show_command()

            return keep_value

        with ui.row().classes("w-full items-end"):
            held = ui.select(_TABLES, label="A table of states", value=self.chosen["held"])
            held.on_value_change(keep("held")).classes("w-48")
            points = ui.input("Set points", value=self.chosen["set_points"])
            points.on_value_change(keep("set_points")).props("debounce=200 stack-label")
            examples = (f"{what}: {text}" for what, text in _SET_POINTS.items())
            points.props(f'placeholder="{", ".join(examples)}"').classes("col")
            points.bind_visibility_from(held, "value")

    @property
    def _set_points(self) -> str:
        """What states are held at, as the options of commands have it."""
        return self.chosen["set_points"] or _SET_POINTS[self.chosen["held"]]

    def task(self) -> Task:
        """Return the task that writes the table of a sweep."""
        return self._sweep("CSV")

    def _sweep(self, kind: str) -> Task:
        """Return the task that writes a sweep, or the fields at the bias that is shown."""
        chosen = self.chosen
        bias = f"{chosen['bias']:g}:{chosen['bias']:g}:1"
        bias = bias if kind == "VTU" else f"0:{chosen['most']:g}:{_BIASES}"
        files = outputs(f"{stem(chosen)}.sweep", kind)
        held = chosen["held"]
        states = {f"hold_{held}": self._set_points} if held else {"bias": bias}
        return Task("sweep", probe_files(chosen), {**states, **settings(chosen), **files})

    def python(self) -> str:
        """Return the lines of Python that make the sweep."""
        held = self.chosen["held"]
        if held:
            unit = HELD[held].unit
            try:
                points = parse_set_points(self._set_points, unit, "set points").tolist()
            except InputError:
                return ""  # the command will say what is wrong
            return "\n".join(
                [
                    "from hotlever import Lever, Probe",
                    "from hotlever.lever.set_points import hold",
                    "",
                    f"lever = Lever({in_python(self.chosen)})",
                    f'data = hold(lever, "{held}", {points}).data  # {unit}',
                ]
            )
        return "\n".join(
            [
                "import numpy as np",
                "from hotlever import Lever, Probe",
                "",
                f"lever = Lever({in_python(self.chosen)})",
                f"sweep = lever.sweep(np.linspace(0, {self.chosen['most']:g}, {_BIASES}))",
            ]
        )
