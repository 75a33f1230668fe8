"""Lever: a parametric shape or a drawing becomes a probe, with its picture while it does."""

from __future__ import annotations

from collections.abc import Awaitable
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages.frame import (
    FIGURE_FILES,
    ErrorBanner,
    drop_zone,
    flat_button,
    hand_over,
    small_button,
    two_columns,
)
from hotlever.app.pages.page import Page, Work
from hotlever.app.pages.probe_fields import ProbeFields
from hotlever.app.pages.probe_files import Drawings, Picture, ProbeFile, new_probe
from hotlever.app.project import DATA, DRAWINGS
from hotlever.app.session import Session
from hotlever.app.state import Lever, Simulate
from hotlever.errors import HotleverError, InputError

_SHAPES = {"three-leg": "New: three legs", "u-shape": "New: two legs (U)"}
_FILE = "a probe file or a drawing"
_NEW = Lever().name
#: Pages that go on with the probe.
_ON = {"simulate": "tune", "calibrate": "straighten"}
_DROP = "Drop a drawing here (GDSII, OASIS, DXF) or a probe file, and tables of materials"


class LeverPage(Page):
    """One tab of the page."""

    name = "lever"

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        self._file = ProbeFile(self)
        self._shown_text = ""
        with two_columns() as (left, right):
            with left:
                drop_zone(session, banner, _DROP, self._dropped)
                self._pick = ui.select(self._files, label="Open")
                self._pick.on_value_change(lambda event: self._open(event.value))
                self._pick.classes("w-full").props("clearable")
                with ui.row():
                    for shape, words in _SHAPES.items():
                        small_button(words, partial(self._take_shape, shape))
                self._fields = ProbeFields(self, self._set)
            with right:
                self._work = Work(session, self.name, self._ended)
                self._drawings = Drawings(self, self._begin, self._show)
                self._picture = Picture(self, self._draw)
                with ui.row().classes("items-center w-full"):
                    name = self.chosen["save_as"] or self.chosen["name"]
                    self._name = ui.input(
                        "Save as", value=name, on_change=self._keep("save_as", "")
                    )
                    ui.button("Save", icon="save", on_click=self._write)
                    for page, icon in _ON.items():
                        go = ui.button(page.capitalize(), icon=icon)
                        go.props("outline").on_click(partial(self._go_on, page))
                    for suffix in FIGURE_FILES:
                        flat_button(suffix[1:].upper(), partial(self._give, suffix))
                with ui.expansion("The probe file"):
                    self._text = ui.textarea(on_change=self._edited).classes("w-full")
                    self._text.props('outlined autogrow debounce=400 aria-label="Probe file"')
                    self._text.props("input-class=font-mono input-style=font-size:.8rem")
                self.command()

    @property
    def _files(self) -> list[str]:
        project = self.session.project
        return [*project.probes, *project.drawings]

    async def open(self) -> None:
        """Show what was open last; a drawing that was just dropped is opened."""
        with self.banner.caught():
            self._file.take_up()
        if self.chosen["text"] is None:
            self.chosen["text"] = new_probe(next(iter(_SHAPES)))
        self._quietly(self.chosen["text"])
        await self._draw()
        await self._open(self.chosen["drawing"])

    async def _take_shape(self, shape: str) -> None:
        """Begin with the probe file of a shape."""
        if not await self._file.may_go():
            return
        self._work.hide()
        self._begin(_NEW)
        self._pick.set_value(None)
        await self._set(new_probe(shape))

    async def _draw(self) -> None:
        """Draw what is open, and show its fields."""
        text = self.chosen["text"]
        if not text:
            self._picture.clear()
            await self._fields.show("", "")
            return
        try:
            drawn = await self._picture.of(text, self._name.value)
            if drawn is None:
                return
            fault = drawn["fault"]
        except HotleverError as error:
            fault = str(error)
        self.banner.say(fault)
        await self._fields.show(text, fault)
        self.show_command()

    # --- a file -----------------------------------------------------------------------------------

    async def _dropped(self, names: list[str]) -> None:
        self._pick.set_options(self._files)
        opened = [name for name in names if name in self._files]
        if opened and self._pick.value == opened[-1]:  # dropped again
            await self._open(opened[-1])
        elif opened:
            self._pick.set_value(opened[-1])
        elif names[-1].lower().endswith(DATA):
            await self._draw()
            self.banner.say(f"{names[-1]}: kept in the folder; a material's property may name it")
        else:
            raise InputError(f"{names[-1]}: unknown type of file, expected {_FILE}")

    async def _open(self, name: str | None) -> None:
        """Show a probe file, or the probe of a drawing."""
        if name is None:
            return
        if not await self._file.may_go():
            self._drawings.clear()
            self._pick.set_value(None)
            return
        self.banner.clear()
        self._work.hide()
        if name.lower().endswith(DRAWINGS):
            await self._drawings.open(name)
        else:
            await self._show(name)

    def _begin(self, name: str = "") -> None:
        """Show no lever until another one is there: none may stand under the other's name."""
        self.chosen |= {"name": name, "text": "", "saved": ""}
        self._name.set_value(name)
        self._picture.clear()
        self._drawings.clear()
        self._quietly("")
        self.show_command()

    async def _show(self, name: str, listing: str = "", plot: str = "") -> None:
        """Show a probe file, and what the drawing holds that it was proposed for."""
        self._begin(name)
        with self.banner.caught():
            self._quietly(self._file.open(name))
            await self._draw()
            if plot:
                outlines = self.session.project.path(plot).read_text(encoding="utf-8")
                self._picture.add(listing, outlines)

    async def _ended(self, job: Job) -> None:
        self._pick.set_options(self._files)
        await self._drawings.done(job)

    def _edited(self, event: Any) -> Awaitable[None] | None:
        """Take what was typed, at once: later the text may be another one, which nobody typed."""
        if event.value == self._shown_text:
            return None
        self.chosen["text"] = self._shown_text = event.value
        return self._draw()

    async def _set(self, text: str) -> None:
        """Take a text in which a field was set."""
        self.chosen["text"] = text
        self._work.hide()
        self._quietly(text)
        await self._draw()

    def _quietly(self, text: str) -> None:
        """Show a probe file that nobody typed."""
        self._shown_text = text
        self._text.set_value(text)

    # --- what is shown and written ----------------------------------------------------------------

    def task(self) -> Task:
        """Return the command that draws the probe."""
        name = self._name.value or "lever"
        options = {"plot": f"{Path(name).stem}.svg", "mesh": self.chosen["mesh"]}
        return Task("probe show", (name,), options)

    async def _write(self) -> bool:
        """Write the probe file; return whether it is there now."""
        with self.banner.caught():
            name = await self._file.save(self._name.value or "", self._shown_text)
            if name is None:
                return False
            self._name.set_value(name)
            self._pick.set_options(self._files)
            ui.notify(f"{name} is written", type="positive")
            return True
        return False

    async def _go_on(self, page: str) -> None:
        """Go on with the probe on another page."""
        if await self._write():
            name = self._name.value
            set_up = {"rests": f"probe:{name}"}
            if page == "simulate":
                set_up = Simulate(probe=name).model_dump()
            self.session.choices(page).update(set_up)
            ui.navigate.to(f"/{page}")

    async def _give(self, suffix: str) -> None:
        if await self._write():
            with self.banner.caught():
                name, mesh = self._name.value, self.chosen["mesh"]
                drawn = self.session.ask("quick", "showing:probe_file", name, suffix, mesh)
                await hand_over(drawn, f"{Path(name).stem}{suffix}")
