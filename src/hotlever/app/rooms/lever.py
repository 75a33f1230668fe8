"""Lever: a parametric shape or a drawing becomes a probe, with its picture while it does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, named
from hotlever.app.page import Complaint, Work, drop_zone, hand_over, two_columns
from hotlever.app.project import DRAWINGS, safe_name
from hotlever.app.rooms.drawn import Fields, Picture
from hotlever.app.rooms.results import FIGURE_FILES, SHOWING
from hotlever.app.rooms.room import Room
from hotlever.app.session import Session
from hotlever.errors import HotleverError
from hotlever.files import read_text, write_text

_SHAPES = {"three-leg": "three legs", "u-shape": "two legs (U)"}
_FILE = "a probe file or a drawing"
_DROP = "Drop a drawing here (GDSII, OASIS, DXF), or a probe file"


#: Bytes that a probe file may have.
_LARGEST = 1_000_000


class LeverRoom(Room):
    """One tab of the room."""

    name = "lever"

    def __init__(self, session: Session, complaint: Complaint) -> None:
        super().__init__(session, complaint)
        start: dict[str, Any] = {"shape": "three-leg", "changes": {}, "text": None}
        self.chosen |= start | self.chosen
        self._shown_text, self._fault = "", ""
        with two_columns() as (left, right):
            with left:
                drop_zone(session, complaint, _DROP, self._dropped)
                self._pick = ui.select(
                    self._files, label="Open", on_change=self._picked, clearable=True
                )
                self._pick.classes("w-full").props("dense outlined")
                self._shape = ui.toggle(
                    _SHAPES, value=self.chosen["shape"], on_change=self._take_shape
                ).props("no-caps dense unelevated")
                self._fields = Fields(self._change)
            with right:
                Work(session, self.name, self._imported)
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
            self._name = ui.input("Save as", value=self.chosen.get("name", "my-lever.toml"))
            self._name.props("dense outlined")
            ui.button("Save", icon="save", on_click=self._write).props("no-caps")
            ui.button("Simulate", icon="tune", on_click=self._simulate).props("no-caps outline")
            for suffix in FIGURE_FILES:
                ui.button(suffix[1:].upper(), on_click=lambda _, s=suffix: self._give(s)).props(
                    "flat dense no-caps"
                )

    async def open(self) -> None:
        """Show what was open last; a drawing that was just dropped is imported."""
        drawing = self.chosen.pop("drawing", None)
        if drawing is not None:
            self._import(drawing)
            return
        if self.chosen["text"] is not None:
            self._quietly(self.chosen["text"])
        await self._draw(fields=True)

    # --- parametric -------------------------------------------------------------------------------

    async def _take_shape(self, event: Any) -> None:
        if event.value is None:  # a file is open
            return
        self.chosen |= {"shape": event.value, "changes": {}, "text": None}
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
        try:
            if text is not None:
                folder = self.session.project.folder
                drawn = await self._picture.of("probe_of_text", folder, text, title)
            else:
                values = chosen["shape"], chosen["changes"]
                drawn = await self._picture.of("probe_of_values", *values, title)
            self._fault = drawn["fault"]
        except HotleverError as error:
            self._fault = str(error)
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
        if names[-1] in self._files:
            self._pick.set_value(names[-1])
        else:
            self.complaint.say(f"{names[-1]}: unknown type of file, expected {_FILE}")

    async def _picked(self, event: Any) -> None:
        name = event.value
        if name is None:
            return
        self.complaint.clear()
        if name.lower().endswith(DRAWINGS):
            self._import(name)
            return
        with self.complaint.caught():
            path = self.session.project.path(name)
            text = read_text(path, largest=_LARGEST)
            self._name.set_value(path.name)
            self._fields.clear()
            self.chosen["text"] = text
            self._quietly(text)
            await self._draw()

    def _import(self, drawing: str) -> None:
        """Have a probe file proposed for a drawing."""
        stem = Path(drawing).stem
        arguments = ["probe", "import", named(drawing), "-o", f"{stem}.toml"]
        if self.run([*arguments, "--plot", f"{stem}.svg"]):
            self.chosen["name"] = f"{stem}.toml"
            self._name.set_value(f"{stem}.toml")

    async def _imported(self, job: Job) -> None:
        if job.standing != "done":
            return
        output = job.arguments[job.arguments.index("-o") + 1]
        path = self.session.project.path(output)
        self._pick.set_options(self._files)
        self._fields.clear()
        self.chosen["text"] = path.read_text(encoding="utf-8")
        self._quietly(self.chosen["text"])
        await self._draw()
        outlines = self.session.project.path(f"{path.stem}.svg").read_text(encoding="utf-8")
        self._picture.add(job.result, outlines)

    async def _edited(self, event: Any) -> None:
        if event.value != self._shown_text:
            self.chosen["text"] = self._shown_text = event.value
            self._fields.clear()
            self._shape.set_value(None)
            await self._draw()

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

    def _write(self) -> bool:
        if self._fault and self.chosen["text"] is None:
            self.complaint.say(self._fault)
            return False
        with self.complaint.caught():
            name = safe_name(self._name.value or "")
            name = name if name.endswith(".toml") else f"{name}.toml"
            write_text(self.session.project.path(name), self._shown_text)
            self._name.set_value(name)
            self.chosen["name"] = name
            self._pick.set_options(self._files)
            ui.notify(f"{name} is written", type="positive")
            return True
        return False

    def _simulate(self) -> None:
        if self._write():
            self.session.chosen["simulate"] = {"probe": self._name.value}
            ui.navigate.to("/simulate")

    async def _give(self, suffix: str) -> None:
        if self._write():
            with self.complaint.caught():
                call, folder = f"{SHOWING}:probe_file", self.session.project.folder
                name = self._name.value
                asked = folder, name, suffix, self.chosen["mesh"]
                made = self.session.quick.call(call, *asked)
                await hand_over(made, f"{Path(name).stem}{suffix}")
