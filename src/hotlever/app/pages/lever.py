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
    caption,
    drop_zone,
    figure,
    flat_button,
    hand_over,
    small_button,
    table,
    two_columns,
)
from hotlever.app.pages.page import Page, Work
from hotlever.app.pages.probe_file import ProbeFields, ProbeFile, ProbeText, new_probe
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


class Picture:
    """The lever from above, and what there is to know of it."""

    def __init__(self, page: LeverPage) -> None:
        self._page, self._latest = page, 0
        mesh = ui.switch("mesh", value=page.chosen["mesh"], on_change=self._switch)
        mesh.tooltip("The triangles that the lever is solved on")
        self._column = ui.column().classes("w-full gap-1")

    async def _switch(self, event: Any) -> None:
        self._page.chosen["mesh"] = event.value
        await self._page.draw()

    def clear(self) -> None:
        """Show none, nor one that is being drawn."""
        self._latest += 1
        self._column.clear()

    async def show(self, text: str, title: str) -> str | None:
        """Show the picture of a probe by its file; return what is wrong with the probe.

        None if another picture was asked for meanwhile. There is no picture of what cannot be
        drawn: the last one is of another probe.
        """
        self._latest += 1
        turn, mesh, drawn = self._latest, self._page.chosen["mesh"], None
        try:
            what = text, title, mesh
            drawn = await self._page.session.ask("quick", "probe_files:drawn_text", *what)
            fault: str = drawn["fault"]
        except HotleverError as error:
            fault = str(error)
        if turn != self._latest:
            return None
        self._column.clear()
        if drawn is not None:
            alt = "The lever from above: regions, terminals and tip"
            with self._column:
                figure(drawn["figure"], alt, wide=True)
                if not fault:
                    table(("region", "part", "area"), drawn["rows"])
                    if mesh:
                        caption(f"mesh: {drawn['triangles']} triangles")
        return fault

    def add(self, listing: str, outlines: str) -> None:
        """Show below what a drawing holds, and the picture of all of it."""
        with self._column, ui.expansion("What the drawing holds"):
            ui.label(listing).classes("lines")
            figure(outlines, "All outlines of the drawing, by layer")


class LeverPage(Page):
    """One tab of the page."""

    name = "lever"

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        self._file = ProbeFile(self)
        self._awaited: str | None = None
        with two_columns() as (left, right):
            with left:
                drop_zone(session, banner, _DROP, self._dropped)
                self._pick = ui.select(self._files, label="Open").classes("w-full")
                self._pick.props("clearable").on_value_change(lambda event: self._open(event.value))
                with ui.row():
                    for shape, words in _SHAPES.items():
                        small_button(words, partial(self._take_shape, shape))
                self._fields = ProbeFields(self, self._set)
            with right:
                self._work = Work(session, self.name, self._ended)
                self._existing_notice = ui.row().classes("items-center w-full")
                self._picture = Picture(self)
                with ui.row().classes("items-center w-full"):
                    name = self.chosen["save_as"] or self.chosen["name"]
                    keep = self._keep("save_as", "")
                    self._name = ui.input("Save as", value=name, on_change=keep)
                    ui.button("Save", icon="save", on_click=self._write)
                    for page, icon in _ON.items():
                        go = ui.button(page.capitalize(), icon=icon)
                        go.props("outline").on_click(partial(self._go_on, page))
                    for suffix in FIGURE_FILES:
                        flat_button(suffix[1:].upper(), partial(self._give, suffix))
                self._text = ProbeText(self._edited)
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
        self._text.put(self.chosen["text"])
        await self.draw()
        await self._open(self.chosen["drawing"])

    async def _take_shape(self, shape: str) -> None:
        """Begin with the probe file of a shape."""
        if not await self._file.may_go():
            return
        self._work.hide()
        self._begin(_NEW)
        self._pick.set_value(None)
        await self._set(new_probe(shape))

    async def draw(self) -> None:
        """Draw what is open, and show its fields."""
        text = self.chosen["text"]
        if not text:
            self._picture.clear()
            await self._fields.show("", "")
            return
        fault = await self._picture.show(text, self._name.value)
        if fault is not None:
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
            await self.draw()
            self.banner.say(f"{names[-1]}: kept in the folder; a material's property may name it")
        else:
            raise InputError(f"{names[-1]}: unknown type of file, expected {_FILE}")

    async def _open(self, name: str | None) -> None:
        """Show a probe file, or the probe of a drawing; if there is none, have one proposed."""
        if name is None:
            return
        if not await self._file.may_go():
            self._awaited = self.chosen["drawing"] = None
            self._existing_notice.clear()
            self._pick.set_value(None)
            return
        self.banner.clear()
        self._work.hide()
        if not name.lower().endswith(DRAWINGS):
            await self._show(name)
            return
        job = self.session.jobs.by_page.get(self.name)
        if job is not None and job.standing == "running" and job.task.files == (name,):
            self._begin(drawing=name)  # it is being proposed since before the page was opened
            return
        probe, is_there = self.session.project.probe_of_drawing(name)
        if not is_there:
            self._propose(name, probe)
            return
        await self._show(probe)
        with self._existing_notice:
            ui.label(f"{probe} is there already, and was kept as it is.").classes("remark")
            again = small_button("Propose anew", partial(self._propose, name, probe))
            again.tooltip(f"Writes what the drawing proposes over {probe}")

    def _propose(self, drawing: str, name: str) -> None:
        """Have a probe file proposed for a drawing."""
        files = {"output": name, "plot": f"{Path(name).stem}.svg"}
        if self.run(Task("probe import", (drawing,), files)):
            self._begin(drawing=drawing)

    def _begin(self, name: str = "", drawing: str | None = None) -> None:
        """Show no lever until another one is there: none may stand under the other's name."""
        self.chosen |= {"name": name, "text": "", "saved": ""}
        # whoever leaves before the probe file of a drawing is there, and comes back, is shown it
        self._awaited = self.chosen["drawing"] = drawing
        self._name.set_value(name)
        self._picture.clear()
        self._existing_notice.clear()
        self._text.put("")
        self.show_command()

    async def _show(self, name: str, listing: str = "", plot: str = "") -> None:
        """Show a probe file, and what the drawing holds that it was proposed for."""
        self._begin(name)
        with self.banner.caught():
            self._text.put(self._file.open(name))
            await self.draw()
            if plot:
                outlines = self.session.project.path(plot).read_text(encoding="utf-8")
                self._picture.add(listing, outlines)

    async def _ended(self, job: Job) -> None:
        """Show what was proposed for the drawing that is waited for, if nothing else is open."""
        self._pick.set_options(self._files)
        if job.task.files != (self._awaited,):
            return
        if job.standing == "done":
            files = job.task.options
            await self._show(files["output"], job.contents["result"], files["plot"])
        else:
            self._begin()

    def _edited(self, text: str) -> Awaitable[None]:
        """Take what was typed, at once: later the text may be another one, which nobody typed."""
        self.chosen["text"] = text
        return self.draw()

    async def _set(self, text: str) -> None:
        """Take a text in which a field was set."""
        self.chosen["text"] = text
        self._work.hide()
        self._text.put(text)
        await self.draw()

    # --- what is shown and written ----------------------------------------------------------------

    def task(self) -> Task:
        """Return the command that draws the probe."""
        name = self._name.value or "lever"
        options = {"plot": f"{Path(name).stem}.svg", "mesh": self.chosen["mesh"]}
        return Task("probe show", (name,), options)

    async def _write(self) -> bool:
        """Write the probe file; return whether it is there now."""
        with self.banner.caught():
            name = await self._file.save(self._name.value or "", self._text.text)
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
                drawn = self.session.ask("quick", "probe_files:drawn_file", name, suffix, mesh)
                await hand_over(drawn, f"{Path(name).stem}{suffix}")
