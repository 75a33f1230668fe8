"""Raman: spectra of a hot plate and of a tip in, temperatures with their errors out."""

from __future__ import annotations

import csv
import io
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job
from hotlever.app.page import (
    Complaint,
    Work,
    drop_zone,
    figure,
    table,
    two_columns,
)
from hotlever.app.rooms.results import FIGURE_FILES, download_button, say_refused
from hotlever.app.rooms.room import Room, choice
from hotlever.app.rooms.spectrum import CORRECTIONS, OneSpectrum
from hotlever.app.session import Session

_TIP, _PLATE = "tip", "hot-plate"
_TABLE, _SAVED, _FIGURE = "tip.raman.csv", "raman.json", "raman"
_LAWS = {"anharmonic": "anharmonic", "linear": "linear, as in the paper"}


class RamanRoom(Room):
    """One tab of the room."""

    name = "raman"

    def __init__(self, session: Session, complaint: Complaint) -> None:
        super().__init__(session, complaint)
        self._plot, self._given, self._again = ".svg", False, False
        with two_columns() as (left, right):
            with left:
                self._folder(_PLATE, "Drop the spectra of the hot plate here (temperatures known)")
                self._folder(_TIP, "Drop the spectra to be measured here")
                self._options()
                ui.button("Measure", icon="thermostat", on_click=self.start).classes(
                    "w-full"
                ).props("no-caps")
            with right:
                Work(session, self.name, self._measured)
                self._one = OneSpectrum(
                    session, complaint, self.chosen, self._thermometer, self._corrected
                )
                self._result = ui.column().classes("w-full gap-2")
                self.command()
        self.show_command()
        if not session.jobs.running(self.name):
            self._show()

    async def open(self) -> None:
        """Show one of the spectra that are there."""
        await self._one.look([_PLATE, _TIP])

    def _folder(self, folder: str, label: str) -> None:
        counted = ui.label().classes("text-sm")

        def count() -> None:
            number = len(self.session.project.spectra(folder))
            counted.set_text(f"{folder}: {number or 'no'} {'file' if number == 1 else 'files'}")

        async def dropped(names: list[str]) -> None:
            count()
            self.show_command()
            await say_refused(self.session, self.complaint, names, spectra=True)
            await self.open()

        drop_zone(self.session, self.complaint, label, dropped, folder)
        counted.move(target_index=-1)
        if folder == _TIP and not self.session.project.spectra(_TIP):

            def example() -> None:
                with self.complaint.caught():
                    self.session.project.take_example_folders("raman", _PLATE, _TIP)
                    ui.navigate.reload()

            ui.button("Try the example", icon="science", on_click=example).props(
                "outline no-caps dense"
            )
        count()

    def _options(self) -> None:
        saved = self.session.project.raman_calibrations
        names = {"": f"the spectra in {_PLATE}"} | {name: name for name in saved}
        saved_one = self.chosen.get("calibration", "")
        self._calibration = choice("Calibrated by", names, saved_one, self._choose)
        self._law = choice("Law", _LAWS, self.chosen.get("law"), self._choose)

    async def _choose(self) -> None:
        self.chosen |= {"calibration": self._calibration.value, "law": self._law.value}
        self.show_command()
        await self._one.refresh()

    def _thermometer(self) -> dict[str, Any]:
        """Return the options of the thermometer."""
        project, calibration = self.session.project, self.chosen.get("calibration")
        plate = _PLATE if not calibration and project.spectra(_PLATE) else None
        by_hand = CORRECTIONS if project.stamp(CORRECTIONS) else None
        law = self.chosen.get("law", "anharmonic")
        return {
            "calibration": calibration or None,
            "calibrate_from": plate,
            "law": law,
            "corrections": by_hand,
        }

    def _corrected(self) -> None:
        """Measure anew, once what runs has ended."""
        self.show_command()
        if self.session.jobs.running(self.name):
            self._again = True
        else:
            self.start()

    def arguments(self) -> list[str]:
        """Return the command that measures the spectra."""
        arguments, asked = ["raman", _TIP], self._thermometer()
        if asked["calibration"]:
            arguments += ["--calibration", asked["calibration"]]
        elif asked["calibrate_from"]:
            arguments += ["--calibrate-from", _PLATE, "--save-calibration", _SAVED]
        if asked["law"] != "anharmonic":
            arguments += ["--law", asked["law"]]
        if asked["corrections"]:
            arguments += ["--corrections", asked["corrections"]]
        return [*arguments, "-o", _TABLE, "--plot", f"{_FIGURE}{self._plot}"]

    async def _measured(self, job: Job) -> None:
        if self._again:
            self._again = False
            self.start()
            return
        if job.standing != "done":
            return
        if self._given:
            ui.download.file(self.session.project.path(job.arguments[-1]))
        else:
            self._show()
        self._plot, self._given = ".svg", False

    def _give(self, suffix: str) -> None:
        """Have the figure written as a file, and given."""
        self._plot, self._given = suffix, True
        self.start()

    def _show(self) -> None:
        self._result.clear()
        project = self.session.project
        if not project.stamp(_TABLE):
            return
        with self._result, self.complaint.caught():
            text = project.path(_TABLE).read_text(encoding="utf-8")
            head, *rows = [*csv.reader(io.StringIO(text))] or [[]]
            with ui.row().classes("items-center"):
                download_button(self.session, _TABLE, "Temperatures (CSV)")
                if project.stamp(_SAVED):
                    download_button(self.session, _SAVED, "Calibration (JSON)")
                for suffix in FIGURE_FILES:
                    ui.button(suffix[1:].upper(), on_click=lambda _, s=suffix: self._give(s)).props(
                        "flat dense no-caps"
                    )
            if project.stamp(f"{_FIGURE}.svg"):
                drawn = project.path(f"{_FIGURE}.svg").read_text(encoding="utf-8")
                figure(
                    drawn, "Spectra by temperature, the calibration and its residuals", wide=True
                )
            shown = table(head, rows, pagination=20).classes("cursor-pointer")
            shown.on("rowClick", lambda event: self._one.show(f"{_TIP}/{event.args[1]['0']}"))
            ui.label("A click on a row shows its spectrum above.").classes("text-xs opacity-70")
