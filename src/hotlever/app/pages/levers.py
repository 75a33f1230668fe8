"""Levers: many measurements are fitted, and a table fills with what was found."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages.frame import (
    ErrorBanner,
    caption,
    download_button,
    drop_zone,
    flat_button,
    say_refused,
    table,
    two_columns,
)
from hotlever.app.pages.page import Page, Work
from hotlever.app.project import FITS
from hotlever.app.session import Session
from hotlever.errors import InputError

_DROP = "Drop measurements here, one for each lever"
_GOES_ON = (
    "What was fitted before, of the same data, is not fitted again: a run that was cancelled goes "
    "on where it was."
)
#: Folder of the page of the fits, and files that are made beside them.
_REPORT = "levers"
_FILES = {f"{FITS}/levers.csv": "Table (CSV)", f"{_REPORT}/index.html": "Page (HTML)"}
_LOOK_S = 1.0


class LeversPage(Page):
    """One tab of the page."""

    name = "levers"

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        self._seen: Any = None
        data = session.project.data
        chosen = [name for name in self.chosen["data"] or () if name in data]
        with two_columns() as (left, right):
            with left:
                drop_zone(session, banner, _DROP, self._dropped)
                self._files = ui.select(
                    data,
                    label="Levers",
                    multiple=True,
                    value=chosen,
                    on_change=self._keep("data", []),
                )
                self._files.classes("w-full").props("use-chips")
                with ui.row():
                    flat_button("All", self._take_all)
                    flat_button("None", partial(self._files.set_value, []))
                self.probe_choice()
                start = ui.button("Fit all", icon="table_rows", on_click=self.start)
                start.classes("w-full")
                caption(_GOES_ON)
            with right:
                Work(session, self.name, self._fitted)
                self._result = ui.column().classes("w-full gap-2")
                self.command()
        self.show_command()
        ui.timer(_LOOK_S, self.open)

    async def _take_all(self) -> None:
        """Choose all measurements of levers that lie in the folder."""
        names = self.session.project.data
        measured = await self.session.ask("full", "showing:measurements", names, len(names))
        self._files.set_options(names)
        self._files.set_value(measured)

    async def _dropped(self, names: list[str]) -> None:
        self._files.set_options(self.session.project.data)
        taken = [name for name in names if name in self._files.options]
        self._files.set_value(list(dict.fromkeys([*self._files.value, *taken])))
        await say_refused(self.session, self.banner, names, spectra=False)

    def task(self) -> Task:
        """Return the task that fits all."""
        options = {"probe": self.chosen["probe"], "output": FITS, "report": _REPORT}
        return Task("fit", tuple(self._files.value), options)

    def start(self) -> bool:
        """Fit all, if these are several."""
        with self.banner.caught():
            if len(self._files.value) < 2:
                raise InputError("choose two measurements or more; the page Fit fits one")
            return super().start()
        return False

    async def _fitted(self, job: Job) -> None:
        await self.open()

    async def open(self) -> None:
        """Show the fits that are there, when there is a new one; first, take the measurements."""
        if self.chosen["data"] is None:
            self.chosen["data"] = []
            await self._take_all()
        project = self.session.project
        names = [f"{FITS}/{path.name}" for path in sorted(project.path(FITS).glob("*.json"))]
        seen = [(name, project.stamp(name)) for name in (*names, *_FILES)]
        if seen == self._seen:
            return
        self._seen = seen
        with self.banner.caught():
            levers = await self.session.ask("full", "showing:levers", names)
            self._result.clear()
            if names:
                with self._result:
                    self._show(levers)

    def _show(self, levers: dict[str, Any]) -> None:
        with ui.row().classes("items-center"):
            for name, label in _FILES.items():
                download_button(self.session, name, label)
        table(levers["head"], levers["rows"], self._open)
        caption("A click on a lever opens it on the page Fit.")

    def _open(self, stem: str) -> None:
        """Open one lever on the page Fit, with the fit that was made here."""
        source = next((name for name in self.session.project.data if Path(name).stem == stem), None)
        if source is None:
            self.banner.say(f"{stem}: its measurement is not in the folder any more")
            return
        self.session.chosen.setdefault("fit", {})["data"] = source
        ui.navigate.to("/fit")
