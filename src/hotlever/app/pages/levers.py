"""Levers: many measurements are fitted or calibrated, and a table fills with what was found."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages.frame import (
    PAGES,
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
from hotlever.app.project import CALIBRATIONS, FITS
from hotlever.app.session import Session
from hotlever.errors import InputError

_DROP = "Drop measurements here, one for each lever"
_GOES_ON = (
    "What was made before, of the same data, is not made again: a run that was cancelled goes on "
    "where it was."
)


@dataclass(frozen=True)
class _BatchOutputs:
    """What is made of all measurements: a folder of results, a table in it, and a report."""

    folder: str
    table: str
    report: str

    @property
    def files(self) -> dict[str, str]:
        """What is made beside the results."""
        table, page = f"{self.folder}/{self.table}", f"{self.report}/index.html"
        return {table: "Table (CSV)", page: "Page (HTML)"}


#: By command, which is also the name of one lever's page.
_OUTPUTS = {
    "fit": _BatchOutputs(FITS, "levers.csv", "levers"),
    "calibrate": _BatchOutputs(CALIBRATIONS, "calibrations.csv", "levers-calibrated"),
}
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
                with ui.row().classes("w-full"):
                    for command in _OUTPUTS:
                        start = ui.button(f"{command.capitalize()} all", icon="table_rows")
                        start.classes("col").on_click(partial(self._make, command))
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
        self._take(await self.session.ask("full", "showing:measurements", names, len(names)))

    async def _dropped(self, names: list[str]) -> None:
        self._take(names)
        await say_refused(self.session, self.banner, names, spectra=False)

    def _take(self, names: list[str]) -> None:
        """Choose files beside those that are chosen."""
        # others may have been dropped meanwhile
        data = self.session.project.data
        self._files.set_options(data)
        measurements = [name for name in names if name in data]
        self._files.set_value(list(dict.fromkeys([*self._files.value, *measurements])))

    @property
    def _page(self) -> str:
        """The title of the page of one lever."""
        title, _ = PAGES[self.chosen["command"]]
        return title

    @property
    def _outputs(self) -> _BatchOutputs:
        return _OUTPUTS[self.chosen["command"]]

    def task(self) -> Task:
        """Return the task that fits or calibrates all.

        Raises
        ------
        InputError
            If these are not several.
        """
        outputs, data = self._outputs, tuple(self._files.value)
        if len(data) < 2:
            raise InputError(f"choose two measurements or more; the page {self._page} takes one")
        options = {
            "probe": self.chosen["probe"],
            "output": outputs.folder,
            "report": outputs.report,
        }
        return Task(self.chosen["command"], data, options)

    def _make(self, command: str) -> None:
        self.chosen["command"] = command
        self.show_command()
        self.start()

    async def _fitted(self, job: Job) -> None:
        await self.open()

    async def open(self) -> None:
        """Show the results that are there, when there is a new one; first, take measurements."""
        if self.chosen["data"] is None:
            self.chosen["data"] = []
            await self._take_all()
        project, outputs = self.session.project, self._outputs
        names = [
            f"{outputs.folder}/{path.name}"
            for path in sorted(project.path(outputs.folder).glob("*.json"))
        ]
        seen = [(name, project.stamp(name)) for name in (*names, *outputs.files)]
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
            for name, label in self._outputs.files.items():
                download_button(self.session, name, label)
        table(levers["head"], levers["rows"], self._open)
        caption(f"A click on a lever opens it on the page {self._page}.")

    def _open(self, stem: str) -> None:
        """Open one lever on its page, with what was made of it here."""
        source = next((name for name in self.session.project.data if Path(name).stem == stem), None)
        if source is None:
            self.banner.say(f"{stem}: its measurement is not in the folder any more")
            return
        page = self.chosen["command"]
        self.session.choices(page)["data"] = source
        ui.navigate.to(f"/{page}")
