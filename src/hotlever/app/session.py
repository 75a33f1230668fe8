"""What all pages of a running app share: the project, its processes, and what was chosen last."""

from __future__ import annotations

import asyncio
from typing import Any

from hotlever.app.choices import Keeper, read_choices
from hotlever.app.jobs import Jobs
from hotlever.app.project import Project
from hotlever.app.workers import Desk

#: Seconds after which a process is made ready for the first command: the page comes first.
_LATER_S = 1.5


class Session:
    """One user, one folder, any number of tabs and reloads.

    Attributes
    ----------
    project : Project
    jobs : Jobs
    quick, full, making : Desk
        Where levers answer sliders while they move, where the full lever and results are read, and
        where reduced levers are made.
    reduced : dict
        Whether the reduced lever of a geometry has been made, or is only asked for.
    chosen : dict
        What was chosen last in each room, by names such as ``fit.data``, be it before the app was
        started.
    remark : str
        Why what was chosen before cannot be read, until a page has said it.
    """

    def __init__(self, project: Project) -> None:
        self.project, self.jobs = project, Jobs(project.folder)
        self.chosen: dict[str, Any]
        self.chosen, self.remark = read_choices(project.hidden)
        self.keep = Keeper(project.hidden, self.chosen).keep
        self.reduced: dict[Any, bool] = {}
        self._desks: dict[str, Desk] = {}
        self._preparing: asyncio.Task[None] | None = None

    def told_of(self, file: str | None) -> dict[str, Any]:
        """Return what was told of a measurement file: its columns, the pulse that was measured."""
        told: dict[str, Any] = self.chosen.setdefault("files", {})
        return told.setdefault(file, {}) if file else {}

    @property
    def quick(self) -> Desk:
        """The process for what moves."""
        return self._desk("quick")

    @property
    def full(self) -> Desk:
        """The process for what is exact."""
        return self._desk("full")

    @property
    def making(self) -> Desk:
        """The process for reduced levers, which take some ten seconds."""
        return self._desk("making")

    def _desk(self, name: str) -> Desk:
        if name not in self._desks:
            self._desks[name] = Desk()
        return self._desks[name]

    async def start(self) -> None:
        """Start the processes, so that they are ready when they are asked."""
        self._preparing = asyncio.create_task(self._prepare())

    async def _prepare(self) -> None:
        self._desk("full")
        self._desk("quick")
        await asyncio.sleep(_LATER_S)
        self.jobs.prepare()
