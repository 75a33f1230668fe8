"""What all pages of a running app share: the lever, what was chosen on them, and processes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from copy import deepcopy
from typing import Any

from hotlever.app.jobs import Jobs
from hotlever.app.project import Project
from hotlever.app.workers import Heard, Worker


class Session:
    """One user, one folder, any number of tabs and reloads.

    Nothing of it is written: it ends with the app, and the files of the folder stay.

    Attributes
    ----------
    project : Project
    jobs : Jobs
    probe : str
        The file of the lever that is chosen for all pages; empty for the reference probe.
    followers : list of callable
        Told when another lever is chosen: the fields of all tabs in which it stands.
    chosen : dict of str to dict
        What was chosen last on each page. Pages hold these dictionaries, which are therefore
        changed and not replaced.
    dark : bool
    workers : dict of str to Worker
        ``quick`` answers sliders while they move, ``full`` solves the full lever and reads results,
        ``making`` makes reduced levers, which take some ten seconds; ``beside`` solves a lever that
        is compared.
    reduced : dict
        Whether the reduced lever of a geometry has been made, or is only asked for.
    """

    def __init__(self, project: Project) -> None:
        self.project, self.jobs = project, Jobs(project.folder)
        self.probe = ""
        self.followers: list[Callable[[], None]] = []
        self.chosen: dict[str, dict[str, Any]] = {}
        self.dark = False
        self.workers: dict[str, Worker] = {}
        self.reduced: dict[Any, bool] = {}
        self._preparing: asyncio.Task[None] | None = None

    def choose_lever(self, probe: str) -> None:
        """Have another lever, on all pages."""
        if probe != self.probe:
            self.probe = probe
            for follow in list(self.followers):
                follow()

    def choices(self, page: str, first: dict[str, Any]) -> dict[str, Any]:
        """Return what was chosen last on a page; what never was is as at `first`."""
        chosen = self.chosen.setdefault(page, {})
        chosen.update({key: deepcopy(first[key]) for key in first if key not in chosen})
        return chosen

    # --- processes --------------------------------------------------------------------------------

    async def start(self) -> None:
        """Start the processes, so that they are ready when they are asked."""
        self._preparing = asyncio.create_task(self._prepare())

    async def _prepare(self) -> None:
        self._worker("full")
        self._worker("quick")
        # the page comes first
        await asyncio.sleep(1.5)
        self.jobs.prepare()

    def _worker(self, name: str) -> Worker:
        if name not in self.workers:
            self.workers[name] = Worker(self.project.folder)
        return self.workers[name]

    async def ask(
        self,
        worker: str,
        function: Callable[..., Any],
        *arguments: Any,
        heard: Heard | None = None,
    ) -> Any:
        """Call a function of a `Report` and some arguments in a process.

        Raises
        ------
        HotleverError
            As the function says, or if the process died.
        """
        return await self._worker(worker).call(function, *arguments, heard=heard)
