"""Simulate: a lever that follows sliders, at a bias or in time."""

from __future__ import annotations

from collections.abc import Awaitable
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.beside import Beside
from hotlever.app.pages.drawn import in_python, probe_files, settings, stem
from hotlever.app.pages.frame import ErrorBanner, two_columns
from hotlever.app.pages.page import Page, Work, outputs
from hotlever.app.pages.pulses import Pulses
from hotlever.app.pages.sliders import LiveView, Sliders
from hotlever.app.pages.small_signals import SmallSignals
from hotlever.app.session import Session

#: Biases of a sweep that is written.
_BIASES = 49
_VIEWS = {"rest": "at a bias", "time": "in time", "signals": "small signals"}


class SimulatePage(Page):
    """One tab of the page."""

    name = "simulate"

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
                    self._live = LiveView(self)
                    with ui.card().classes("w-full last").props("flat bordered"):
                        ui.label("Take it with you").classes("text-bold")
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
        self._live.follow(self._sliders.free)
        self.show_command()
        self._pulses.show_command()
        self._signals.show_command()

    def task(self) -> Task:
        """Return the task that writes the table of a sweep."""
        return self._sweep("CSV")

    def _sweep(self, kind: str) -> Task:
        """Return the task that writes a sweep, or the fields at the bias that is shown."""
        chosen = self.chosen
        bias = f"{chosen['bias']:g}:{chosen['bias']:g}:1"
        bias = bias if kind == "VTU" else f"0:{chosen['most']:g}:{_BIASES}"
        files = outputs(f"{stem(chosen)}.sweep", kind)
        return Task("sweep", probe_files(chosen), {"bias": bias, **settings(chosen), **files})

    def python(self) -> str:
        """Return the lines of Python that make the sweep."""
        return "\n".join(
            [
                "import numpy as np",
                "from hotlever import Lever, Probe",
                "",
                f"lever = Lever({in_python(self.chosen)})",
                f"sweep = lever.sweep(np.linspace(0, {self.chosen['most']:g}, {_BIASES}))",
            ]
        )
