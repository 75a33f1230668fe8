"""Raman: spectra of a hot plate and of a tip in, temperatures with their errors out."""

from __future__ import annotations

import csv
import io
from collections.abc import Awaitable
from functools import partial

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages.frame import (
    FIGURE_FILES,
    ErrorBanner,
    caption,
    download_button,
    drop_zone,
    figure,
    flat_button,
    say_refused,
    small_button,
    table,
    two_columns,
)
from hotlever.app.pages.page import Page, Work
from hotlever.app.pages.spectrum import CORRECTIONS, OneSpectrum
from hotlever.app.session import Session

_TIP, _PLATE = "tip", "hot-plate"
_TABLE, _SAVED, _FIGURE = "tip.raman.csv", "raman.json", "raman"
_LAWS = {"anharmonic": "anharmonic", "linear": "linear, as in the paper"}
_ALT = "Spectra by temperature, the calibration and its residuals"


class RamanPage(Page):
    """One tab of the page."""

    name = "raman"

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        self._again = False
        with two_columns() as (left, right):
            with left:
                self._folder(_PLATE, "Drop the spectra of the hot plate here (temperatures known)")
                self._folder(_TIP, "Drop the spectra to be measured here")
                names = {"": f"the spectra in {_PLATE}"}
                names |= {name: name for name in session.project.raman_calibrations}
                self.choice("calibration", "Calibrated by", names)
                self.choice("law", "Law", _LAWS)
                measure = ui.button("Measure", icon="thermostat", on_click=self.start)
                measure.classes("w-full")
            with right:
                Work(session, self.name, self._measured)
                self._spectrum = OneSpectrum(self, self.thermometer, self._corrected)
                self._result = ui.column().classes("w-full gap-2")
                self.command()
        self.show_command()
        if not session.jobs.running(self.name):
            self._show()

    async def open(self) -> None:
        """Show one of the spectra that are there."""
        await self._spectrum.look([_PLATE, _TIP])

    def _folder(self, folder: str, label: str) -> None:
        """Show where spectra are dropped, and how many there are."""

        def count() -> None:
            number = len(self.session.project.spectra(folder))
            counted.set_text(f"{folder}: {number or 'no'} {'file' if number == 1 else 'files'}")

        async def dropped(names: list[str]) -> None:
            count()
            self.show_command()
            await say_refused(self.session, self.banner, names, spectra=True)
            await self.open()

        drop_zone(self.session, self.banner, label, dropped, folder)
        counted = ui.label().classes("text-sm")
        if folder == _TIP and not self.session.project.spectra(_TIP):
            small_button("Try the example", self._example, icon="science")
        count()

    def _example(self) -> None:
        with self.banner.caught():
            self.session.project.take_example_folders("raman", _PLATE, _TIP)
            ui.navigate.reload()

    def changed(self) -> Awaitable[None]:
        """Show the spectrum by what is asked of the thermometer now."""
        self.show_command()
        return self._spectrum.show_chosen()

    def thermometer(self) -> dict[str, str]:
        """Return the options of the thermometer."""
        project, calibration = self.session.project, self.chosen["calibration"]
        return {
            "calibration": calibration,
            "calibrate_from": _PLATE if not calibration and project.spectra(_PLATE) else "",
            "law": self.chosen["law"],
            "corrections": CORRECTIONS if project.stamp(CORRECTIONS) else "",
        }

    def task(self, suffix: str = ".svg") -> Task:
        """Return the task that measures the spectra, and draws them."""
        asked = self.thermometer()
        options = {
            "calibration": asked["calibration"],
            "calibrate_from": [asked["calibrate_from"]] if asked["calibrate_from"] else [],
            "save_calibration": _SAVED if asked["calibrate_from"] else "",
            "law": asked["law"] if asked["law"] != "anharmonic" else "",
            "corrections": asked["corrections"],
            "output": _TABLE,
            "plot": f"{_FIGURE}{suffix}",
        }
        return Task("raman", (_TIP,), options)

    def _corrected(self) -> None:
        """Measure anew, once what runs has ended."""
        self.show_command()
        if self.session.jobs.running(self.name):
            self._again = True
        else:
            self.start()

    async def _measured(self, job: Job) -> None:
        if self._again:
            self._again = False
            self.start()
        elif not job.task.written.endswith(FIGURE_FILES[0]):
            await self.give(job)
        elif job.standing == "done":
            self._show()

    def _give(self, suffix: str) -> None:
        """Give the figure that there is, or have it written as another file."""
        if suffix == FIGURE_FILES[0]:
            ui.download.file(self.session.project.path(f"{_FIGURE}{suffix}"))
        else:
            self.run(self.task(suffix))

    def _show(self) -> None:
        self._result.clear()
        project = self.session.project
        if not project.stamp(_TABLE):
            return
        with self._result, self.banner.caught():
            text = project.path(_TABLE).read_text(encoding="utf-8")
            head, *rows = [*csv.reader(io.StringIO(text))] or [[]]
            with ui.row().classes("items-center"):
                download_button(self.session, _TABLE, "Temperatures (CSV)")
                download_button(self.session, _SAVED, "Calibration (JSON)")
                for suffix in FIGURE_FILES:
                    flat_button(suffix[1:].upper(), partial(self._give, suffix))
            if project.stamp(f"{_FIGURE}.svg"):
                drawn = project.path(f"{_FIGURE}.svg").read_text(encoding="utf-8")
                figure(drawn, _ALT, wide=True)
            table(head, rows, lambda name: self._spectrum.show(f"{_TIP}/{name}"), pagination=20)
            caption("A click on a name shows its spectrum above.")
