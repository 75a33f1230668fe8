"""A drawing in the room Lever becomes a probe file, unless it has one already."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, named
from hotlever.app.session import Session


class Imports:
    """Drawings that are opened: each is shown as its probe file, which is proposed if need be.

    Parameters
    ----------
    session : Session
    chosen : dict
        What was chosen last in the room; ``drawing`` is one whose probe file is not shown yet.
    run : callable
        Runs a command of the room; returns whether it runs.
    begin : callable
        Shows no lever until there is one.
    show : callable
        Shows a probe file, and what a drawing holds: the listing, and the file of its picture.
    """

    def __init__(
        self,
        session: Session,
        chosen: dict[str, Any],
        run: Callable[[list[str]], bool],
        begin: Callable[[], None],
        show: Callable[..., Awaitable[None]],
    ) -> None:
        self._session, self._chosen = session, chosen
        self._run, self._begin, self._show = run, begin, show
        self._awaited = ""
        self._kept = ui.row().classes("items-center w-full")

    def clear(self) -> None:
        """Wait for none: something else is open."""
        self._awaited, self._chosen["drawing"] = "", None
        self._kept.clear()

    async def open(self, drawing: str, job: Job | None) -> None:
        """Show the probe file of a drawing; if there is none, have one proposed.

        `job` is the command of the room that ran last, be it before the page was opened.
        """
        if job is not None and job.standing == "running" and _drawing(job) == named(drawing):
            self._await(drawing)
            return
        name, is_there = self._session.project.probe_of_drawing(drawing)
        if not is_there:
            self._propose(drawing, name)
            return
        await self._show(name)
        with self._kept:
            ui.label(f"{name} is there already, and was kept as it is.").classes("remark")
            again = ui.button("Propose anew", on_click=lambda: self._propose(drawing, name))
            again.props("outline dense no-caps").classes("q-px-sm")
            again.tooltip(f"Writes what the drawing proposes over {name}")

    def _propose(self, drawing: str, name: str) -> None:
        plot = f"{Path(name).stem}.svg"
        arguments = ["probe", "import", named(drawing), "-o", named(name), "--plot", named(plot)]
        if self._run(arguments):
            self._await(drawing)

    def _await(self, drawing: str) -> None:
        self._begin()
        # whoever leaves before it is there, and comes back, is shown it
        self._awaited = self._chosen["drawing"] = drawing

    async def done(self, job: Job) -> None:
        """Show what was proposed for the drawing that is waited for."""
        if not self._awaited or _drawing(job) != named(self._awaited):
            return  # something else was opened meanwhile
        if job.standing == "done":
            _, _, _, _, output, _, plot = job.arguments
            await self._show(Path(output).name, job.result, plot)
        else:
            self._begin()


def _drawing(job: Job) -> str:
    """Return the drawing that a command imports, as it is named there."""
    return job.arguments[2]
