"""Levers: many measurements are fitted, and a table fills with what was found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, named
from hotlever.app.page import Complaint, Work, drop_zone, table, two_columns
from hotlever.app.project import FITS
from hotlever.app.rooms.results import SHOWING, download_button, say_refused
from hotlever.app.rooms.room import Room, choice, probe_names
from hotlever.app.session import Session

#: Folder of the page of the fits.
_REPORT = "levers"
_LOOK_S = 1.0


class LeversRoom(Room):
    """One tab of the room."""

    name = "levers"

    def __init__(self, session: Session, complaint: Complaint) -> None:
        super().__init__(session, complaint)
        self._seen: Any = None
        data = session.project.data
        chosen = [one for one in self.chosen.get("data", data[:1]) if one in data]
        with two_columns() as (left, right):
            with left:
                drop_zone(
                    session, complaint, "Drop measurements here, one for each lever", self._dropped
                )
                self._files = ui.select(
                    data, label="Levers", multiple=True, value=chosen, on_change=self._choose
                )
                self._files.classes("w-full").props("dense outlined use-chips")
                with ui.row():
                    for label, every in (("All", True), ("None", False)):
                        ui.button(label, on_click=lambda _, e=every: self._all(e)).props(
                            "flat dense no-caps"
                        )
                chosen_probe = self.chosen.get("probe") or ""
                names = probe_names(session)
                self._probe = choice("Probe", names, chosen_probe, self._choose)
                ui.button("Fit all", icon="table_rows", on_click=self.start).classes(
                    "w-full"
                ).props("no-caps")
                ui.label(
                    "What was fitted before, of the same data, is not fitted again: a run that was "
                    "cancelled goes on where it was."
                ).classes("text-xs opacity-70")
            with right:
                Work(session, self.name, self._fitted)
                self._result = ui.column().classes("w-full gap-2")
                self.command()
        self.show_command()
        ui.timer(_LOOK_S, self.look)

    async def open(self) -> None:
        """Show the fits that are there."""
        await self.look()

    async def _dropped(self, names: list[str]) -> None:
        self._files.set_options(self.session.project.data)
        taken = [name for name in names if name in self._files.options]
        self._files.set_value(list(dict.fromkeys([*self._files.value, *taken])))
        await say_refused(self.session, self.complaint, names, spectra=False)

    def _choose(self) -> None:
        self.chosen |= {"data": self._files.value, "probe": self._probe.value or None}
        self.show_command()

    def _all(self, every: bool) -> None:
        self._files.set_value(self.session.project.data if every else [])

    def arguments(self) -> list[str]:
        """Return the command that fits all."""
        arguments = ["fit", *(named(name) for name in self._files.value)]
        if self._probe.value:
            arguments += ["--probe", named(self._probe.value)]
        return [*arguments, "-o", FITS, "--report", _REPORT]

    def start(self) -> bool:
        """Fit all, if these are several."""
        if len(self._files.value) < 2:
            self.complaint.say("choose two measurements or more; the room Fit fits one")
            return False
        return super().start()

    async def _fitted(self, job: Job) -> None:
        await self.look()

    async def look(self) -> None:
        """Show the fits that are there, when there is a new one."""
        folder = self.session.project.path(FITS)
        there = sorted(folder.glob("*.json")) if folder.is_dir() else []
        pages = [folder / "levers.csv", self.session.project.path(f"{_REPORT}/index.html")]
        seen = [(path.name, path.stat().st_mtime) for path in (*there, *pages) if path.is_file()]
        if seen == self._seen:
            return
        self._seen = seen
        call = f"{SHOWING}:levers"
        names = [f"{FITS}/{path.name}" for path in there]
        with self.complaint.caught():
            found = await self.session.full.call(call, self.session.project.folder, names)
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
                    if self.session.project.stamp(name):
                        download_button(self.session, name, label)
            shown = table(found["head"], found["rows"])
            shown.on("rowClick", lambda event: self._open(event.args[1]["0"]))
            shown.classes("cursor-pointer")
            ui.label("A click on a lever opens it in the room Fit.").classes("text-xs opacity-70")

    def _open(self, stem: str) -> None:
        """Open one lever in the room Fit, with the fit that was made here."""
        source = next((name for name in self.session.project.data if Path(name).stem == stem), None)
        if source is None:
            self.complaint.say(f"{stem}: its measurement is not in the folder any more")
            return
        self.session.chosen.setdefault("fit", {})["data"] = source
        ui.navigate.to("/fit")
