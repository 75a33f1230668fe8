"""Commands that run for the app, one process each: their progress, notes, end, and cancelling."""

from __future__ import annotations

import asyncio
import shlex
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from hotlever.app.workers import Worker
from hotlever.errors import HotleverError

Standing = Literal["running", "done", "failed", "cancelled"]

#: Lines kept of what a command says.
_MOST_LINES = 200
#: Share of the work from which on it tells how long the rest takes: it may begin slowly.
_TELLING = 0.03
_NOTE, _FAILURE = "note: ", "hotlever: "


@dataclass
class Job:
    """A command and how far it is.

    Attributes
    ----------
    arguments : list of str
        Of the command line, without the word ``hotlever``.
    result : str
        What it wrote to standard output.
    message : str
        In one line, why it failed.
    notes : list of str
    label, done, total
        Of the last progress told.
    shown : dict
        What it showed last, by what it is: the ``curve`` of a fit, a ``table``.
    began : float
        When, as files are stamped.
    version : int
        Counts the changes, for pages to see that there is something new.
    """

    arguments: list[str]
    standing: Standing = "running"
    result: str = ""
    message: str = ""
    notes: list[str] = field(default_factory=list)
    label: str = ""
    done: int = 0
    total: int = 0
    shown: dict[str, Any] = field(default_factory=dict)
    version: int = 0
    started: float = field(default_factory=time.monotonic)
    began: float = field(default_factory=time.time)
    seconds: float = 0.0

    @property
    def command(self) -> str:
        """The command line that does the same."""
        return command_line(self.arguments)

    @property
    def share(self) -> float | None:
        """Share of the work that is done; None if nobody knows."""
        return min(1.0, self.done / self.total) if self.total else None

    @property
    def left_s(self) -> float | None:
        """Seconds that it may still take, by what it took so far."""
        share = self.share
        if share is None or share < _TELLING or self.standing != "running":
            return None
        return (time.monotonic() - self.started) * (1.0 - share) / share

    def hear(self, message: tuple[Any, ...]) -> None:
        """Take in what the command says."""
        kind, *content = message
        if kind == "progress":
            self.label, self.done, self.total = content
        elif kind == "shown":
            self.shown[content[0]] = content[1]
        elif content[0].startswith(_NOTE):
            self.notes = [*self.notes, content[0].removeprefix(_NOTE)][-_MOST_LINES:]
        elif content[0].startswith(_FAILURE):
            self.message = content[0].removeprefix(_FAILURE)
        self.version += 1

    def end(self, standing: Standing, message: str = "") -> None:
        """Note how it ended, for good."""
        if self.standing != "running":
            return
        self.standing, self.message = standing, message or self.message
        self.seconds = time.monotonic() - self.started
        self.version += 1


def command_line(arguments: list[str]) -> str:
    """Return a command as it is typed in a shell."""
    return shlex.join(["hotlever", *arguments])


def named(name: str) -> str:
    """Return a file's name as an argument that is no option."""
    return f"./{name}" if name.startswith("-") else name


class Jobs:
    """The commands of a project: one at a time in each room, each in a process of its own.

    A process is kept ready for the next.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._spare: Worker | None = None
        self._workers: dict[str, Worker] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self.by_room: dict[str, Job] = {}

    def prepare(self) -> None:
        """Have a process ready."""
        if self._spare is None or self._spare.lost:
            self._spare = Worker()

    def running(self, room: str) -> bool:
        """Return whether a room has work."""
        return room in self.by_room and self.by_room[room].standing == "running"

    def start(
        self, room: str, arguments: list[str], then: Callable[[Job], None] | None = None
    ) -> Job:
        """Run a command for a room.

        Raises
        ------
        HotleverError
            If the room has work already.
        """
        if self.running(room):
            raise HotleverError("this is being worked on already; cancel it first")
        job = self.by_room[room] = Job(arguments)
        self.prepare()
        assert self._spare is not None
        worker, self._spare = self._spare, None
        self._workers[room] = worker
        task = asyncio.create_task(self._run(room, job, worker, then))
        # a task that nobody holds may be collected
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return job

    async def _run(
        self, room: str, job: Job, worker: Worker, then: Callable[[Job], None] | None
    ) -> None:
        call = f"{_COMMANDS}:run_command"
        try:
            status, job.result = await worker.call(
                call, job.arguments, self._folder, heard=job.hear
            )
            # 1: what was reached is written, and the message says where it stopped
            job.end("done" if status == 0 else "failed")
        except HotleverError as error:
            job.end("failed", str(error))
        if worker.lost or job.standing == "cancelled" or self._spare is not None:
            worker.kill()
        else:
            self._spare = worker
        if self._workers.get(room) is worker:
            del self._workers[room]
        self.prepare()
        if then is not None and job.standing != "cancelled":
            then(job)

    async def cancel(self, room: str) -> None:
        """End what a room works on."""
        if self.running(room):
            self.by_room[room].end("cancelled")
            await self._workers[room].end()


_COMMANDS = "hotlever.app.commands"
