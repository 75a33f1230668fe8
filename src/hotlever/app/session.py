"""What all pages of a running app share: the state of the project, and its processes."""

from __future__ import annotations

import asyncio
from typing import Any

from hotlever.app.history import History
from hotlever.app.jobs import Jobs
from hotlever.app.project import Project
from hotlever.app.workers import Heard, Worker

#: Seconds after which a process is made ready for the first task: the page comes first.
_LATER_S = 1.5


class Session(History):
    """One user, one folder, any number of tabs and reloads.

    Attributes
    ----------
    project : Project
    jobs : Jobs
    workers : dict of str to Worker
        ``quick`` answers sliders while they move, ``full`` solves the full lever and reads results,
        ``making`` makes reduced levers, which take some ten seconds; ``beside`` solves a lever that
        is compared.
    reduced : dict
        Whether the reduced lever of a geometry has been made, or is only asked for.
    """

    def __init__(self, project: Project) -> None:
        super().__init__(project.hidden)
        self.project, self.jobs = project, Jobs(project.folder)
        self.workers: dict[str, Worker] = {}
        self.reduced: dict[Any, bool] = {}
        self._preparing: asyncio.Task[None] | None = None

    # --- processes --------------------------------------------------------------------------------

    async def start(self) -> None:
        """Start the processes, so that they are ready when they are asked."""
        self._preparing = asyncio.create_task(self._prepare())

    async def _prepare(self) -> None:
        self._worker("full")
        self._worker("quick")
        await asyncio.sleep(_LATER_S)
        self.jobs.prepare()

    def _worker(self, name: str) -> Worker:
        if name not in self.workers:
            self.workers[name] = Worker(self.project.folder)
        return self.workers[name]

    async def ask(
        self, worker: str, function: str, *arguments: Any, heard: Heard | None = None
    ) -> Any:
        """Call ``module:function`` of the app in a process.

        Raises
        ------
        HotleverError
            As the function says, or if the process died.
        """
        name = f"hotlever.app.{function}"
        return await self._worker(worker).call(name, *arguments, heard=heard)
