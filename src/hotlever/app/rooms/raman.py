"""Raman: spectra of a hot plate and of a tip in, temperatures with their errors out."""

from __future__ import annotations

import csv
import io

from nicegui import ui

from hotlever.app.jobs import Job
from hotlever.app.page import (
    Complaint,
    Work,
    command_shown,
    drop_zone,
    figure,
    framed,
    table,
    two_columns,
)
from hotlever.app.rooms.results import FIGURE_FILES, download_button
from hotlever.app.session import Session

_TIP, _PLATE = "tip", "hot-plate"
_TABLE, _SAVED, _FIGURE = "tip.raman.csv", "raman.json", "raman"
_LAWS = {"anharmonic": "anharmonic", "linear": "linear, as in the paper"}


async def raman(session: Session) -> None:
    """Fill the page."""
    with framed(session, "/raman") as complaint:
        _Room(session, complaint)


class _Room:
    """One tab of the room."""

    def __init__(self, session: Session, complaint: Complaint) -> None:
        self._session, self._complaint = session, complaint
        self._chosen = session.chosen.setdefault("raman", {})
        with two_columns() as (left, right):
            with left:
                self._folder(_PLATE, "Drop the spectra of the hot plate here (temperatures known)")
                self._folder(_TIP, "Drop the spectra to be measured here")
                self._options()
                ui.button("Measure", icon="thermostat", on_click=self._start).classes(
                    "w-full"
                ).props("no-caps")
            with right:
                Work(session, "raman", self._measured)
                self._result = ui.column().classes("w-full gap-2")
                self._command = ui.column().classes("w-full gap-0")
        self._show_command()
        if not session.jobs.running("raman"):
            self._show()

    def _folder(self, folder: str, label: str) -> None:
        counted = ui.label().classes("text-sm")

        def count() -> None:
            number = len(self._session.project.spectra(folder))
            counted.set_text(f"{folder}: {number or 'no'} {'file' if number == 1 else 'files'}")

        async def dropped(names: list[str]) -> None:
            count()
            self._show_command()

        drop_zone(self._session, self._complaint, label, dropped, folder)
        counted.move(target_index=-1)
        if folder == _TIP and not self._session.project.spectra(_TIP):

            def example() -> None:
                with self._complaint.caught():
                    for one in (_PLATE, _TIP):
                        list(self._session.project.take_example_folder(f"raman/{one}", one))
                    ui.navigate.reload()

            ui.button("Try the example", icon="science", on_click=example).props(
                "outline no-caps dense"
            )
        count()

    def _options(self) -> None:
        saved = self._session.project.raman_calibrations
        names = {"": f"the spectra in {_PLATE}"} | {name: name for name in saved}
        value = self._chosen.get("calibration", "")
        self._calibration = ui.select(
            names,
            label="Calibrated by",
            value=value if value in names else "",
            on_change=self._choose,
        )
        self._calibration.classes("w-full").props("dense outlined")
        self._law = ui.select(
            _LAWS, label="Law", value=self._chosen.get("law", "anharmonic"), on_change=self._choose
        )
        self._law.classes("w-full").props("dense outlined")

    def _choose(self) -> None:
        self._chosen |= {"calibration": self._calibration.value, "law": self._law.value}
        self._show_command()

    def _arguments(self, plot: str = ".svg") -> list[str]:
        """Return the command that measures the spectra."""
        arguments = ["raman", _TIP]
        calibration = self._chosen.get("calibration")
        if calibration:
            arguments += ["--calibration", calibration]
        elif self._session.project.spectra(_PLATE):
            arguments += ["--calibrate-from", _PLATE, "--save-calibration", _SAVED]
        if self._chosen.get("law", "anharmonic") != "anharmonic":
            arguments += ["--law", self._chosen["law"]]
        return [*arguments, "-o", _TABLE, "--plot", f"{_FIGURE}{plot}"]

    def _show_command(self) -> None:
        self._command.clear()
        with self._command:
            command_shown(self._arguments(), str(self._session.project.folder))

    def _start(self, plot: str = ".svg") -> None:
        with self._complaint.caught():
            self._session.jobs.start("raman", self._arguments(plot))

    async def _measured(self, job: Job) -> None:
        if job.standing != "done":
            return
        plot = job.arguments[-1]
        if plot.endswith(".svg") and not self._chosen.pop("give", False):
            self._show()
        else:
            ui.download.file(self._session.project.path(plot))

    def _give(self, suffix: str) -> None:
        """Have the figure written as a file, and given."""
        self._chosen["give"] = True
        self._start(suffix)

    def _show(self) -> None:
        self._result.clear()
        project = self._session.project
        if not project.stamp(_TABLE):
            return
        with self._result, self._complaint.caught():
            text = project.path(_TABLE).read_text(encoding="utf-8")
            head, *rows = csv.reader(io.StringIO(text))
            with ui.row().classes("items-center"):
                download_button(self._session, _TABLE, "Temperatures (CSV)")
                if project.stamp(_SAVED):
                    download_button(self._session, _SAVED, "Calibration (JSON)")
                for suffix in FIGURE_FILES:
                    ui.button(suffix[1:].upper(), on_click=lambda _, s=suffix: self._give(s)).props(
                        "flat dense no-caps"
                    )
            if project.stamp(f"{_FIGURE}.svg"):
                drawn = project.path(f"{_FIGURE}.svg").read_text(encoding="utf-8")
                figure(
                    drawn, "Spectra by temperature, the calibration and its residuals", wide=True
                )
            table(head, rows, pagination=20)
