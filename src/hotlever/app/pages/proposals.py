"""What to measure next, asked beside a calibration."""

from __future__ import annotations

from typing import ClassVar

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.drawn import DrawnPage
from hotlever.app.pages.frame import ErrorBanner
from hotlever.app.pages.page import outputs
from hotlever.app.session import Session

#: What can be told: where the error counts, what the tip is to stay below, and what counts without.
_TOLD = {"at": ("Sure at", "hottest measured"), "stay_below": ("Stay below", "what melts")}


class Proposals(DrawnPage):
    """A card in the element that is open, of a calibration file; what it makes begins with a stem.

    Each calibration has proposals of its own.
    """

    name = "next"
    alt = "Error by temperature now and after more measurements; tip temperature by bias"
    kinds: ClassVar = {kind: text for kind, text in DrawnPage.kinds.items() if kind != "NetCDF"}

    def __init__(self, session: Session, banner: ErrorBanner, calibration: str, stem: str) -> None:
        super().__init__(session, banner)
        self.name, self._calibration, self._stem = f"next {calibration}", calibration, stem
        with ui.card().classes("w-full").props("flat bordered data-proposals"):
            ui.label("What do I measure next?").classes("text-bold")
            with ui.row().classes("w-full items-center"):
                for key, (title, empty) in _TOLD.items():
                    self.number(key, title, "K", empty).classes("w-44", remove="w-36")
                ui.space()
                ui.button("Propose", icon="add_location_alt", on_click=self.start)
            self.show_result()
        self.show_command()

    def task(self) -> Task:
        """Return the task that writes the proposals as a table and a figure."""
        told = {key: self.chosen[key] for key in _TOLD}
        kelvins = {key: "" if T is None else f"{T:.12g}K" for key, T in told.items()}
        files = outputs(f"{self._stem}.next", "SVG")
        return Task("next", (self._calibration,), {**kelvins, **files})
