"""Simulate: a lever that follows sliders, at a bias or in time."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from hotlever.app.page import Complaint, Work, two_columns
from hotlever.app.rooms.following import Following
from hotlever.app.rooms.pulses import Pulses
from hotlever.app.rooms.sliders import FIRST, Sliders, in_python, options, stem
from hotlever.app.rooms.written import WritingRoom, outputs
from hotlever.app.session import Session

#: Biases of a sweep that is written.
_BIASES = 49
_VIEWS = {"rest": "at a bias", "time": "in time"}


class SimulateRoom(WritingRoom):
    """One tab of the room."""

    name = "simulate"

    def __init__(self, session: Session, complaint: Complaint) -> None:
        super().__init__(session, complaint)
        self.chosen |= FIRST | self.chosen
        with two_columns() as (left, right):
            with left:
                self._sliders = Sliders(session, complaint, self.chosen, self._moved)
            with right:
                view = ui.toggle(_VIEWS, value=self.chosen.get("view", "rest"))
                view.props('no-caps dense unelevated aria-label="What is shown"')
                view.on_value_change(self._view)
                with ui.column().classes("w-full gap-3") as rest:
                    self._following = Following(session, complaint, self.chosen)
                    with ui.card().classes("w-full").props("flat bordered"):
                        ui.label("Take it with you").classes("text-bold")
                        self.buttons(self.ask)
                        Work(session, self.name, self.give)
                        self.command()
                with ui.column().classes("w-full gap-3") as time:
                    self._pulses = Pulses(session, complaint, self.chosen)
                for name, shown in (
                    ("rest", rest),
                    ("rest", self._sliders.of_bias),
                    ("time", time),
                ):
                    shown.bind_visibility_from(view, "value", value=name)

    async def open(self) -> None:
        """Ask for the sliders of the probe, and so for the first state."""
        await self._sliders.open()

    def _view(self, event: Any) -> None:
        self.chosen["view"] = event.value
        # what was hidden had no size that figures could be drawn for
        ui.run_javascript("setTimeout(() => window.dispatchEvent(new Event('resize')))")

    def _moved(self) -> None:
        self._following.follow(self._sliders)
        self.show_command()
        self._pulses.show_command()

    def writing(self, kind: str) -> list[str]:
        """Return the command that writes a sweep, or the fields at the bias that is shown."""
        chosen = self.chosen
        bias = f"{chosen['bias']:g}:{chosen['bias']:g}:1"
        bias = bias if kind == "VTU" else f"0:{chosen['most']:g}:{_BIASES}"
        probe, *settings = options(chosen) if chosen["probe"] else ["", *options(chosen)]
        words = ["sweep", *filter(None, [probe]), "--bias", bias, *settings]
        return [*words, *outputs(f"{stem(chosen)}.sweep", kind)]

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
