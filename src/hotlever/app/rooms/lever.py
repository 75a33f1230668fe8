"""Lever: a parametric shape or a drawing becomes a probe, with its picture while it does."""

from __future__ import annotations

from collections.abc import Awaitable
from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, named
from hotlever.app.page import Complaint, Work, drop_zone, hand_over, two_columns
from hotlever.app.project import DRAWINGS
from hotlever.app.rooms.drawn import Fields, Picture
from hotlever.app.rooms.imported import Imports
from hotlever.app.rooms.probe_file import ProbeFile
from hotlever.app.rooms.results import FIGURE_FILES, SHOWING
from hotlever.app.rooms.room import Room
from hotlever.app.session import Session
from hotlever.errors import HotleverError, InputError

_SHAPES = {"three-leg": "three legs", "u-shape": "two legs (U)"}
_FILE = "a probe file or a drawing"
_NEW = "my-lever.toml"
_DROP = "Drop a drawing here (GDSII, OASIS, DXF), or a probe file"


class LeverRoom(Room):
    """One tab of the room."""

    name = "lever"

    def __init__(self, session: Session, complaint: Complaint) -> None:
        super().__init__(session, complaint)
        start: dict[str, Any] = {"shape": "three-leg", "changes": {}, "text": None}
        self.chosen |= start | {"name": _NEW, "saved": ""} | self.chosen
        self._file = ProbeFile(session, self.chosen)
        self._shown_text, self._fault = "", ""
        with two_columns() as (left, right):
            with left:
                drop_zone(session, complaint, _DROP, self._dropped)
                self._pick = ui.select(self._files, label="Open")
                self._pick.on_value_change(lambda event: self._open(event.value))
                self._pick.classes("w-full").props("dense outlined clearable")
                self._shape = ui.toggle(
                    _SHAPES, value=self.chosen["shape"], on_change=self._take_shape
                ).props("no-caps dense unelevated")
                self._fields = Fields(self._change)
            with right:
                self._work = Work(session, self.name, self._ended)
                self._imports = Imports(session, self.chosen, self.run, self._begin, self._show)
                self._picture = Picture(session, self.chosen, self._draw)
                self._save()
                with ui.expansion("The probe file").classes("w-full").props("dense"):
                    self._text = ui.textarea(on_change=self._edited).classes("w-full")
                    self._text.props('outlined autogrow debounce=400 aria-label="Probe file"')
                    self._text.props("input-class=font-mono input-style=font-size:.8rem")
                self.command()

    @property
    def _files(self) -> list[str]:
        project = self.session.project
        return [*project.probes, *project.drawings]

    def _save(self) -> None:
        with ui.row().classes("items-center w-full"):
            self._name = ui.input("Save as", value=self.chosen["name"])
            self._name.props("dense outlined")
            ui.button("Save", icon="save", on_click=self._write).props("no-caps")
            ui.button("Simulate", icon="tune", on_click=self._simulate).props("no-caps outline")
            for suffix in FIGURE_FILES:
                ui.button(suffix[1:].upper(), on_click=lambda _, s=suffix: self._give(s)).props(
                    "flat dense no-caps"
                )

    async def open(self) -> None:
        """Show what was open last; a drawing that was just dropped is opened."""
        with self.complaint.caught():
            self._file.take_up()
        self._quietly(self.chosen["text"] or "")
        await self._draw(fields=True)
        await self._open(self.chosen.get("drawing"))

    # --- parametric -------------------------------------------------------------------------------

    async def _take_shape(self, event: Any) -> None:
        if event.value is None:  # a file is open
            return
        self._work.hide()
        name = self._name.value if self.chosen["text"] is None else _NEW
        self.chosen |= {"shape": event.value, "changes": {}}
        self._begin(name, None)
        self._pick.set_value(None)
        await self._draw(fields=True)

    async def _change(self, name: str, value: float | None) -> None:
        if value is None:
            self.complaint.say(f"{name}: expected a number")
            return
        self.chosen["changes"] = {**self.chosen["changes"], name: value}
        self.chosen["text"] = None
        await self._draw()

    async def _draw(self, fields: bool = False) -> None:
        """Draw what is chosen."""
        chosen, title = self.chosen, self._name.value
        text = chosen["text"]
        if text == "":  # nothing is open
            self._picture.clear()
            return
        try:
            if text is not None:
                folder = self.session.project.folder
                drawn = await self._picture.of("probe_of_text", folder, text, title)
            else:
                values = chosen["shape"], chosen["changes"]
                drawn = await self._picture.of("probe_of_values", *values, title)
            if drawn is None:
                return
            self._fault = drawn["fault"]
        except HotleverError as error:
            drawn, self._fault = {}, str(error)
        if text is None and not self._fault:
            self._quietly(drawn["text"])
            if fields:
                self._fields.show(drawn["values"])
        self._fields.mark(self._fault)
        self.complaint.say(self._fault)
        self.show_command()

    # --- a file -----------------------------------------------------------------------------------

    async def _dropped(self, names: list[str]) -> None:
        self._pick.set_options(self._files)
        if names[-1] not in self._files:
            self.complaint.say(f"{names[-1]}: unknown type of file, expected {_FILE}")
        elif self._pick.value == names[-1]:  # dropped again
            await self._open(names[-1])
        else:
            self._pick.set_value(names[-1])

    async def _open(self, name: str | None) -> None:
        """Show a probe file, or the probe of a drawing."""
        if name is None:
            return
        if not await self._file.may_go():
            self._imports.clear()
            self._pick.set_value(None)
            return
        self.complaint.clear()
        self._work.hide()
        if name.lower().endswith(DRAWINGS):
            await self._imports.open(name, self.session.jobs.by_room.get(self.name))
        else:
            await self._show(name)

    def _begin(self, name: str = "", text: str | None = "") -> None:
        """Show no lever until another one is there: none may stand under the other's name."""
        self._fault = ""
        self.chosen |= {"name": name, "text": text, "saved": ""}
        self._name.set_value(name)
        self._fields.clear()
        self._picture.clear()
        self._imports.clear()
        self._quietly("")
        self.show_command()

    async def _show(self, name: str, listing: str = "", plot: str = "") -> None:
        """Show a probe file, and what the drawing holds that it was proposed for."""
        self._begin(name)
        with self.complaint.caught():
            self._quietly(self._file.open(name))
            await self._draw()
            if plot:
                outlines = self.session.project.path(plot).read_text(encoding="utf-8")
                self._picture.add(listing, outlines)

    async def _ended(self, job: Job) -> None:
        self._pick.set_options(self._files)
        await self._imports.done(job)

    def _edited(self, event: Any) -> Awaitable[None] | None:
        """Take what was typed, at once: later the text may be another one, which nobody typed."""
        if event.value == self._shown_text:
            return None
        self.chosen["text"] = self._shown_text = event.value
        self._fields.clear()
        self._shape.set_value(None)
        return self._draw()

    def _quietly(self, text: str) -> None:
        """Show a probe file that nobody typed."""
        self._shown_text = text
        self._text.set_value(text)
        if self.chosen["text"] is not None:
            self._shape.set_value(None)

    # --- what is shown and written ----------------------------------------------------------------

    def arguments(self) -> list[str]:
        """Return the command that draws the probe."""
        name = self._name.value or "lever"
        mesh = ["--mesh"] if self.chosen["mesh"] else []
        return ["probe", "show", named(name), "--plot", f"{Path(name).stem}.svg", *mesh]

    async def _write(self) -> bool:
        """Write the probe file; return whether it is there now."""
        with self.complaint.caught():
            if self._fault and self.chosen["text"] is None:
                raise InputError(self._fault)
            name = await self._file.save(self._name.value or "", self._shown_text)
            if name is None:
                return False
            self._name.set_value(name)
            self._pick.set_options(self._files)
            ui.notify(f"{name} is written", type="positive")
            return True
        return False

    async def _simulate(self) -> None:
        if await self._write():
            self.session.chosen["simulate"] = {"probe": self._name.value}
            ui.navigate.to("/simulate")

    async def _give(self, suffix: str) -> None:
        if await self._write():
            with self.complaint.caught():
                name, folder = self._name.value, self.session.project.folder
                asked = folder, name, suffix, self.chosen["mesh"]
                made = self.session.quick.call(f"{SHOWING}:probe_file", *asked)
                await hand_over(made, f"{Path(name).stem}{suffix}")
