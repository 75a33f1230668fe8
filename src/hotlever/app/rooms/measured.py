"""What the rooms Fit and Calibrate begin with: a measurement, dropped or chosen, and understood."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, named
from hotlever.app.page import Complaint, Work, drop_zone, table, two_columns
from hotlever.app.project import DATA
from hotlever.app.rooms.plots import MeasuredPlots
from hotlever.app.rooms.results import SHOWING, show_result
from hotlever.app.rooms.room import Room, choice, probe_names
from hotlever.app.session import Session
from hotlever.errors import HotleverError, InputError

_DROP = "Drop a measurement here (bias, current and what else there is), or press +"


class MeasuredRoom(Room):
    """A room that begins with a measurement, makes a file of it, and shows that."""

    #: What is made: its kind, and what its name ends with.
    kind, ending = "", ""
    #: Of the button that makes it.
    button, icon = "", ""
    #: What its command takes of what can be told of a file, see `Session.told_of`.
    tellable: tuple[str, ...] = ("columns",)

    def __init__(self, session: Session, complaint: Complaint) -> None:
        super().__init__(session, complaint)
        self.has: list[str] = []
        self._reads = self._shows = 0
        with two_columns() as (left, right):
            with left:
                self.controls()
                self.options()
                self._button = ui.button(self.button, icon=self.icon, on_click=self.start)
                self._button.classes("w-full").props("no-caps")
                self._button.disable()  # until there is something understood
            with right:
                Work(session, self.name, self._ended, during=self._follow, notes=False)
                self._result = ui.column().classes("w-full gap-2")
                self._understood = _Understood()
                self.command()

    async def open(self) -> None:
        """Read the measurement that was chosen last."""
        await self.read()

    def options(self) -> None:
        """Show what else can be chosen."""

    def understood(self) -> None:
        """Follow what was understood of a measurement."""

    def results(self) -> list[str]:
        """Return the files that show what was made of this measurement, the first best."""
        return [self.output]

    async def show(self, name: str) -> None:
        """Show a result above its page."""

    @property
    def stem(self) -> str:
        """What names of files begin with."""
        return Path(self.chosen["data"]).stem

    @property
    def output(self) -> str:
        """The file that is made."""
        return f"{self.stem}{self.ending}"

    def start(self) -> bool:
        """Run the command; what it replaces is not shown any more."""
        started = super().start()
        if started:
            self._result.clear()
        return started

    def _follow(self, job: Job) -> None:
        """Draw how near to the data the lever is that is being fitted, or was."""
        curve = job.shown.get("curve")
        if curve and self.has and job.arguments[1] == named(self.chosen["data"]):
            self._understood.plots.approach(curve)

    async def _ended(self, job: Job) -> None:
        await self._show_result()

    async def _show_result(self) -> None:
        self._shows += 1
        this, project = self._shows, self.session.project
        self._result.clear()
        if not self.chosen.get("data") or self.session.jobs.running(self.name):
            return
        name = next((name for name in self.results() if project.stamp(name)), None)
        if name is None:
            return
        with self._result:
            await self.show(name)
            if this == self._shows:
                await show_result(self.session, self.complaint, self.kind, name)

    def controls(self) -> None:
        """Show where a measurement is dropped or chosen."""
        drop_zone(self.session, self.complaint, _DROP, self._dropped)
        names = self.session.project.data
        if self.chosen.get("data") not in names:
            self.chosen["data"] = names[0] if names else None
        self._select = choice("Measurement", names, self.chosen["data"], self._picked)
        if not names:
            ui.button("Try the example", icon="science", on_click=self._example).props(
                "outline no-caps dense"
            )
        with ui.expansion("Columns with other names").classes("w-full").props("dense"):
            self._columns = ui.textarea(
                value=self._columns_told(), placeholder="I_h (uA)=Current", on_change=self._tell
            )
            label = "Which column is which, one on a line"
            self._columns.props(f'dense outlined autogrow aria-label="{label}"')
            ui.label("One on a line: QUANTITY (UNIT)=NAME of the column, or its number.").classes(
                "text-xs opacity-70"
            )

    def probe_choice(self) -> None:
        """Show which probe it is a measurement of."""

        async def pick(event: Any) -> None:
            self.chosen["probe"] = event.value or None
            await self.read()

        choice("Probe", probe_names(self.session), self.chosen.get("probe") or "", pick)

    async def _dropped(self, names: list[str]) -> None:
        self._select.set_options(self.session.project.data)
        if names[-1] not in self._select.options:
            raise InputError(f"{names[-1]}: no measurement by its name, expected {', '.join(DATA)}")
        self._select.set_value(names[-1])
        if self.chosen.get("data") == names[-1]:
            await self.read()

    async def _example(self) -> None:
        with self.complaint.caught():
            await self._dropped([self.session.project.take_example("lever-a.csv")])

    async def _picked(self, event: Any) -> None:
        self.chosen["data"] = event.value
        self.show_told()
        await self.read()

    @property
    def told(self) -> dict[str, Any]:
        """What was told of this measurement, in whatever room; see `Session.told_of`."""
        return self.session.told_of(self.chosen.get("data"))

    def column_options(self) -> list[str]:
        """Return the options of a command that say which column is which."""
        columns = self.told.get("columns", [])
        return [word for column in columns for word in ("--column", column)]

    def _columns_told(self) -> str:
        return "\n".join(self.told.get("columns", []))

    async def _tell(self, event: Any) -> None:
        lines = (line.strip() for line in (event.value or "").splitlines())
        columns = [line for line in lines if line]
        if columns != self.told.get("columns", []):  # typed, and not shown for another file
            self.told["columns"] = columns
            await self.read()

    def show_told(self) -> None:
        """Show what was told of the measurement that is chosen."""
        self._columns.set_value(self._columns_told())

    async def read(self) -> None:
        """Read the measurement, and show what was understood, and what was made of it before."""
        self._reads += 1
        this, found, name = self._reads, None, self.chosen.get("data")
        self.complaint.clear()
        if name is not None:
            call, folder = f"{SHOWING}:understood", self.session.project.folder
            told = {key: self.told.get(key) for key in self.tellable}
            told["probe"] = self.chosen.get("probe")
            try:
                found = await self.session.full.call(call, folder, name, told)
            except HotleverError as error:
                if this == self._reads:
                    self.complaint.say(str(error))
        if this != self._reads:  # something else has been chosen meanwhile
            return
        self._understood.show(found)
        self.has = [] if found is None else found["observables"]
        if job := self.session.jobs.by_room.get(self.name):
            self._follow(job)
        self._button.set_enabled(found is not None)
        self.understood()
        self.show_command()
        await self._show_result()


class _Understood:
    """What a file was understood as; hidden while there is none.

    Attributes
    ----------
    plots : MeasuredPlots
    """

    def __init__(self) -> None:
        self._opened = ui.expansion("What was understood", value=True).classes("w-full")
        self._opened.props("dense header-class=text-bold").set_visibility(False)
        with self._opened, ui.column().classes("w-full gap-2"):
            self.plots = MeasuredPlots()
            self._rows = ui.column().classes("w-full gap-2")

    def show(self, found: dict[str, Any] | None) -> None:
        """Show what was found in a file; nothing, if that was no measurement."""
        self._opened.set_visibility(found is not None)
        self._rows.clear()
        if found is None:
            return
        self.plots.measured(found["data"], found["observables"])
        with self._rows:
            head, *rows = found["rows"]
            table(head, rows)
            for note in found["notes"]:
                ui.label(f"• {note}").classes("text-sm remark")
