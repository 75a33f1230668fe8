"""Lever: a parametric shape or a drawing becomes a probe, with its picture while it does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, named
from hotlever.app.page import Complaint, Work, drop_zone, figure, table, two_columns
from hotlever.app.project import DRAWINGS, safe_name
from hotlever.app.rooms.results import FIGURE_FILES, SHOWING
from hotlever.app.rooms.room import Room
from hotlever.app.session import Session
from hotlever.files import write_text

_SHAPES = {"three-leg": "three legs", "u-shape": "two legs (U)"}
_FILE = "a probe file or a drawing"
_DROP = "Drop a drawing here (GDSII, OASIS, DXF), or a probe file"


class LeverRoom(Room):
    """One tab of the room."""

    name = "lever"

    def __init__(self, session: Session, complaint: Complaint) -> None:
        super().__init__(session, complaint)
        start: dict[str, Any] = {"shape": "three-leg", "changes": {}, "text": None}
        self.chosen |= start | self.chosen
        self._shown_text = ""
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
                self._fields = ui.column().classes("w-full gap-1")
            with right:
                Work(session, self.name, self._imported)
                self._picture = ui.column().classes("w-full gap-1")
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
                ui.button(suffix[1:].upper(), on_click=lambda _, s=suffix: self._draw(s)).props(
                    "flat dense no-caps"
                )

    async def open(self) -> None:
        """Show what was open last; a drawing that was just dropped is imported."""
        drawing = self.chosen.pop("drawing", None)
        if drawing is not None:
            self._import(drawing)
        elif self.chosen["text"] is not None:
            self._quietly(self.chosen["text"])
            await self._show_text()
        else:
            await self._show_values()

    # --- parametric -------------------------------------------------------------------------------

    async def _take_shape(self, event: Any) -> None:
        if event.value is None:  # a file is open
            return
        self.chosen |= {"shape": event.value, "changes": {}, "text": None}
        self._pick.set_value(None)
        await self._show_values()

    async def _change(self, name: str, value: float | None) -> None:
        if value is None:
            self.complaint.say(f"{name}: expected a number")
            return
        self.chosen["changes"] = {**self.chosen["changes"], name: value}
        self.chosen["text"] = None
        await self._show_values(fields=False)

    async def _show_values(self, fields: bool = True) -> None:
        call = f"{SHOWING}:probe_of_values"
        chosen = self.chosen
        with self.complaint.caught():
            found = await self.session.quick.call(
                call, chosen["shape"], chosen["changes"], self._name.value
            )
            self._show(found)
            self._quietly(found["text"])
            if fields:
                self._show_fields(found["values"])

    def _show_fields(self, values: dict[str, tuple[float, str]]) -> None:
        self._fields.clear()
        with self._fields:
            for name, (value, meaning) in values.items():
                number = ui.number(name, value=value, format="%.4g", step=value / 50)
                number.props(f'dense outlined suffix=µm debounce=200 aria-label="{meaning}"')
                number.classes("w-full").tooltip(meaning)
                number.on_value_change(lambda event, n=name: self._change(n, event.value))

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
            found = await self.session.quick.call(
                f"{SHOWING}:probe_page", self.session.project.folder, name
            )
            self._name.set_value(path.name)
            self._fields.clear()
            self._show(found)
            self.chosen["text"] = found["text"]
            self._quietly(found["text"])

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
        await self._show_text()
        with self._picture, ui.expansion("What the drawing holds").classes("w-full"):
            ui.label(job.result).classes("lines")
            picture = self.session.project.path(f"{path.stem}.svg")
            figure(picture.read_text(encoding="utf-8"), "All outlines of the drawing, by layer")

    async def _edited(self, event: Any) -> None:
        if event.value != self._shown_text:
            self.chosen["text"] = self._shown_text = event.value
            self._fields.clear()
            self._shape.set_value(None)
            await self._show_text()

    async def _show_text(self) -> None:
        call, folder = f"{SHOWING}:probe_of_text", self.session.project.folder
        with self.complaint.caught():
            text = self.chosen["text"] or ""
            found = await self.session.quick.call(call, folder, text, self._name.value)
            self._show(found)

    def _quietly(self, text: str) -> None:
        """Show a probe file that nobody typed."""
        self._shown_text = text
        self._text.set_value(text)
        if self.chosen["text"] is not None:
            self._shape.set_value(None)

    # --- what is shown and written ----------------------------------------------------------------

    def _show(self, found: dict[str, Any]) -> None:
        self._picture.clear()
        with self._picture:
            figure(found["figure"], "The lever from above: regions, terminals and tip", wide=True)
            if found["fault"]:
                self.complaint.say(found["fault"])
            else:
                table(("region", "part", "area"), found["rows"])
                ui.label(f"mesh: {found['triangles']} triangles").classes("text-xs opacity-70")
        self.show_command()

    def arguments(self) -> list[str]:
        """Return the command that draws the probe."""
        name = self._name.value or "lever"
        return ["probe", "show", named(name), "--plot", f"{Path(name).stem}.svg"]

    def _write(self) -> bool:
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

    async def _draw(self, suffix: str) -> None:
        if self._write():
            with self.complaint.caught():
                call, folder = f"{SHOWING}:probe_file", self.session.project.folder
                name = self._name.value
                content = await self.session.quick.call(call, folder, name, suffix)
                ui.download.content(content, f"{Path(name).stem}{suffix}")
