"""What the page Lever is made of: a probe file, its picture, and drawings."""

from __future__ import annotations

import hashlib
from collections.abc import Awaitable, Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages.frame import asked, caption, figure, small_button, table
from hotlever.app.pages.page import Page
from hotlever.app.project import LARGEST_PROBE, safe_name
from hotlever.errors import HotleverError, InputError
from hotlever.files import read_text
from hotlever.probe import Probe
from hotlever.tasks.design_requests import NEW_PROBES


class ProbeFile:
    """The text of a probe file that is edited, and the file of its name: no edits are lost.

    What is chosen of it on the page is told by `hotlever.app.state.Lever`.
    """

    def __init__(self, page: Page) -> None:
        self._session, self._chosen = page.session, page.chosen

    @property
    def is_edited(self) -> bool:
        """Whether there are edits of a text that are not saved."""
        text = self._chosen["text"]
        return bool(text) and not self._is_saved and text not in map(new_probe, NEW_PROBES)

    @property
    def _is_saved(self) -> bool:
        return _digest(self._chosen["text"]) == self._chosen["saved"]

    def open(self, name: str) -> str:
        """Read a file of the project; return its text.

        Raises
        ------
        InputError
            If it is no text file, or too large for a probe file.
        """
        text = read_text(self._session.project.path(name), largest=LARGEST_PROBE)
        self._chosen |= {"name": name, "text": text, "saved": _digest(text)}
        return text

    def take_up(self) -> None:
        """Take the file as it is now, unless it was edited here: others may have changed it.

        Raises
        ------
        InputError
            As `open`.
        """
        name = self._chosen["name"]
        if self._chosen["text"] and self._is_saved and self._session.project.stamp(name):
            self.open(name)

    async def may_go(self) -> bool:
        """Ask whether edits that are not saved may go, if there are any."""
        question = "The probe file that is open here has edits that are not saved."
        return not self.is_edited or await asked(question, "Drop them", "Go on with it")

    async def save(self, name: str, text: str) -> str | None:
        """Write a text; ask before another file of its name is replaced.

        Returns
        -------
        str or None
            The name that it has now; None if it was not to be written.

        Raises
        ------
        InputError
            If there is nothing to be written, or what is there is no probe file.
        """
        if not text.strip():
            raise InputError("there is no probe here yet: drop a drawing, or choose a shape")
        project = self._session.project
        name = safe_name(name)
        name = name if name.endswith(".toml") else f"{name}.toml"
        path = project.path(name)
        there = read_text(path, largest=LARGEST_PROBE) if path.exists() else None
        if there not in (None, text):
            is_own = name == self._chosen["name"] and _digest(there) == self._chosen["saved"]
            question = f"{name} is there already, and holds something else than was opened here."
            if not is_own and not await asked(question, "Replace it", "Keep it"):
                return None
        if there != text:
            project.write(name, text, f"saved {name}")
        self._chosen |= {"name": name, "saved": _digest(text)}
        return name


@cache
def new_probe(shape: str) -> str:
    """Return the probe file that a parametric shape begins with."""
    probe: Probe = getattr(Probe, NEW_PROBES[shape])()
    return probe.to_toml()


def _digest(text: str | None) -> str:
    """Return what tells whether a text is as it was."""
    return "" if text is None else hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()


class Picture:
    """The lever from above, and what there is to know of it; `redraw` is called for another one."""

    def __init__(self, page: Page, redraw: Callable[[], Awaitable[None]]) -> None:
        self._session, self._chosen = page.session, page.chosen

        async def switch(event: Any) -> None:
            self._chosen["mesh"] = event.value
            await redraw()

        mesh = ui.switch("mesh", value=self._chosen["mesh"], on_change=switch)
        mesh.tooltip("The triangles that the lever is solved on")
        self._column = ui.column().classes("w-full gap-1")
        self._latest = 0

    def clear(self) -> None:
        """Show none, nor one that is being drawn."""
        self._latest += 1
        self._column.clear()

    async def of(self, text: str, title: str) -> dict[str, Any] | None:
        """Have a probe drawn by its file.

        Returns
        -------
        dict or None
            What the worker says of it; None if another picture was asked for meanwhile.

        Raises
        ------
        HotleverError
            If it cannot be drawn. No picture is shown then: the last one is of another probe.
        """
        self._latest += 1
        turn, mesh = self._latest, self._chosen["mesh"]
        drawn: dict[str, Any] = {}
        failure: HotleverError | None = None
        try:
            drawn = await self._session.ask("quick", "showing:probe_of_text", text, title, mesh)
        except HotleverError as error:
            failure = error
        if turn != self._latest:
            return None
        self._column.clear()
        if failure is not None:
            raise failure
        with self._column:
            figure(drawn["figure"], "The lever from above: regions, terminals and tip", wide=True)
            if not drawn["fault"]:
                table(("region", "part", "area"), drawn["rows"])
                if mesh:
                    caption(f"mesh: {drawn['triangles']} triangles")
        return drawn

    def add(self, listing: str, outlines: str) -> None:
        """Show below what a drawing holds, and the picture of all of it."""
        with self._column, ui.expansion("What the drawing holds"):
            ui.label(listing).classes("lines")
            figure(outlines, "All outlines of the drawing, by layer")


class Drawings:
    """Drawings that are opened: each is shown as its probe file, which is proposed if need be.

    Parameters
    ----------
    page : Page
    begin : callable
        Shows no lever until there is one.
    show : callable
        Shows a probe file, and what a drawing holds: the listing, and the file of its picture.
    """

    def __init__(
        self, page: Page, begin: Callable[[], None], show: Callable[..., Awaitable[None]]
    ) -> None:
        self._page, self._begin, self._show = page, begin, show
        self._awaited = ""
        self._kept = ui.row().classes("items-center w-full")

    def clear(self) -> None:
        """Wait for none: something else is open."""
        self._awaited, self._page.chosen["drawing"] = "", None
        self._kept.clear()

    async def open(self, drawing: str) -> None:
        """Show the probe file of a drawing; if there is none, have one proposed."""
        job = self._page.session.jobs.by_page.get(self._page.name)
        if job is not None and job.standing == "running" and job.task.files == (drawing,):
            self._await(drawing)  # since before the page was opened
            return
        name, is_there = self._page.session.project.probe_of_drawing(drawing)
        if not is_there:
            self._propose(drawing, name)
            return
        await self._show(name)
        with self._kept:
            ui.label(f"{name} is there already, and was kept as it is.").classes("remark")
            again = small_button("Propose anew", partial(self._propose, drawing, name))
            again.tooltip(f"Writes what the drawing proposes over {name}")

    def _propose(self, drawing: str, name: str) -> None:
        files = {"output": name, "plot": f"{Path(name).stem}.svg"}
        if self._page.run(Task("probe import", (drawing,), files)):
            self._await(drawing)

    def _await(self, drawing: str) -> None:
        self._begin()
        # whoever leaves before it is there, and comes back, is shown it
        self._awaited = self._page.chosen["drawing"] = drawing

    async def done(self, job: Job) -> None:
        """Show what was proposed for the drawing that is waited for."""
        if not self._awaited or job.task.files != (self._awaited,):
            return  # something else was opened meanwhile
        if job.standing == "done":
            files = job.task.options
            await self._show(files["output"], job.shown["result"], files["plot"])
        else:
            self._begin()
