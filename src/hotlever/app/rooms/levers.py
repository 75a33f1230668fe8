"""Levers: many measurements are fitted, and a table fills with what was found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, named
from hotlever.app.page import (
    Complaint,
    Work,
    command_shown,
    drop_zone,
    framed,
    table,
    two_columns,
)
from hotlever.app.project import FITS
from hotlever.app.rooms.measured import REFERENCE
from hotlever.app.rooms.results import SHOWING, download_button
from hotlever.app.session import Session
from hotlever.errors import HotleverError

#: Folder of the page of the fits.
_REPORT = "levers"
_LOOK_S = 1.0


async def levers(session: Session) -> None:
    """Fill the page."""
    with framed(session, "/levers") as complaint:
        room = _Room(session, complaint)
    await room.look()


class _Room:
    """One tab of the room."""

    def __init__(self, session: Session, complaint: Complaint) -> None:
        self._session, self._complaint = session, complaint
        self._chosen = session.chosen.setdefault("levers", {})
        self._seen: Any = None
        with two_columns() as (left, right):
            with left:
                drop_zone(
                    session, complaint, "Drop measurements here, one for each lever", self._dropped
                )
                self._files = ui.select(
                    session.project.data,
                    label="Levers",
                    multiple=True,
                    value=[
                        one
                        for one in self._chosen.get("data", session.project.data[:1])
                        if one in session.project.data
                    ],
                    on_change=self._choose,
                )
                self._files.classes("w-full").props("dense outlined use-chips")
                with ui.row():
                    ui.button(
                        "All", on_click=lambda: self._files.set_value(session.project.data)
                    ).props("flat dense no-caps")
                    ui.button("None", on_click=lambda: self._files.set_value([])).props(
                        "flat dense no-caps"
                    )
                names = {"": REFERENCE} | {name: name for name in session.project.probes}
                value = self._chosen.get("probe") or ""
                self._probe = ui.select(
                    names,
                    label="Probe",
                    value=value if value in names else "",
                    on_change=self._choose,
                )
                self._probe.classes("w-full").props("dense outlined")
                ui.button("Fit all", icon="table_rows", on_click=self._start).classes(
                    "w-full"
                ).props("no-caps")
                ui.label(
                    "What was fitted before, of the same data, is not fitted again: a run that was "
                    "cancelled goes on where it was."
                ).classes("text-xs opacity-70")
            with right:
                Work(session, "levers", self._fitted)
                self._result = ui.column().classes("w-full gap-2")
                self._command = ui.column().classes("w-full gap-0")
        self._show_command()
        ui.timer(_LOOK_S, self.look)

    async def _dropped(self, names: list[str]) -> None:
        self._files.set_options(self._session.project.data)
        known = set(self._session.project.data)
        refused = [name for name in names if name not in known]
        if refused:
            self._complaint.say(f"{', '.join(refused)}: unknown type of file for a measurement")
        taken = [name for name in names if name in known]
        self._files.set_value(list(dict.fromkeys([*self._files.value, *taken])))

    def _choose(self) -> None:
        self._chosen |= {"data": self._files.value, "probe": self._probe.value or None}
        self._show_command()

    def _arguments(self) -> list[str]:
        arguments = ["fit", *(named(name) for name in self._files.value)]
        if self._probe.value:
            arguments += ["--probe", named(self._probe.value)]
        return [*arguments, "-o", FITS, "--report", _REPORT]

    def _show_command(self) -> None:
        self._command.clear()
        with self._command:
            command_shown(self._arguments(), str(self._session.project.folder))

    def _start(self) -> None:
        with self._complaint.caught():
            if len(self._files.value) < 2:
                raise HotleverError("choose two measurements or more; the room Fit fits one")
            self._session.jobs.start("levers", self._arguments())

    async def _fitted(self, job: Job) -> None:
        await self.look()

    async def look(self) -> None:
        """Show the fits that are there, when there is a new one."""
        folder = self._session.project.path(FITS)
        there = sorted(folder.glob("*.json")) if folder.is_dir() else []
        pages = [folder / "levers.csv", self._session.project.path(f"{_REPORT}/index.html")]
        seen = [(path.name, path.stat().st_mtime) for path in (*there, *pages) if path.is_file()]
        if seen == self._seen:
            return
        self._seen = seen
        call = f"{SHOWING}:levers"
        names = [f"{FITS}/{path.name}" for path in there]
        with self._complaint.caught():
            found = await self._session.full.call(call, self._session.project.folder, names)
            self._show(names, found)

    def _show(self, names: list[str], found: dict[str, Any]) -> None:
        self._result.clear()
        if not names:
            return
        with self._result:
            with ui.row().classes("items-center"):
                for name, label in (
                    (f"{FITS}/levers.csv", "Table (CSV)"),
                    (f"{_REPORT}/index.html", "Page (HTML)"),
                ):
                    if self._session.project.stamp(name):
                        download_button(self._session, name, label)
            shown = table(found["head"], found["rows"])
            shown.on("rowClick", lambda event: self._open(event.args[1]["0"]))
            shown.classes("cursor-pointer")
            ui.label("A click on a lever opens it in the room Fit.").classes("text-xs opacity-70")

    def _open(self, stem: str) -> None:
        """Open one lever in the room Fit, with the fit that was made here."""
        source = next(
            (name for name in self._session.project.data if Path(name).stem == stem), None
        )
        if source is None:
            self._complaint.say(f"{stem}: its measurement is not in the folder any more")
            return
        self._session.chosen.setdefault("fit", {})["data"] = source
        ui.navigate.to("/fit")
