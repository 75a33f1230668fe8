"""What all pages of a running app share: the lever, what was chosen on them, and their work.

Each page does one task after the other, each in a process of its own. The options of a task have
the names and texts that the command line has. What is done in the process is said here too: `run`,
and what else takes a task there.
"""

from __future__ import annotations

import asyncio
import shlex
import time
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from hotlever.app.project import Project
from hotlever.app.workers import Heard, Report, Worker
from hotlever.errors import HotleverError
from hotlever.probe import Probe
from hotlever.tasks.arguments import LeverArguments, read_surrounded_probe
from hotlever.tasks.commands import COMMANDS, run_command, written_by


@dataclass(frozen=True)
class Task:
    """What is done, as one would type it: a command, its files, and its options.

    Attributes
    ----------
    command : str
        Such as ``fit``; see `hotlever.tasks.commands`.
    files : tuple of str
    options : dict
        By their names, in the order in which they are typed.

    Examples
    --------
    >>> task = Task("fit", ("my data.csv",), {"fix": ["p"], "robust": True, "output": "a.json"})
    >>> print(task.line)
    hotlever fit 'my data.csv' --fix p --robust -o a.json
    """

    command: str
    files: tuple[str, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def effective_options(self) -> dict[str, Any]:
        """The options that say something: a 0 does, an empty text or list says nothing."""
        return {
            name: value
            for name, value in self.options.items()
            if value is not None and value is not False and value not in ("", [])
        }

    @property
    def words(self) -> list[str]:
        """The words of the command line that does the same."""
        files = (f"./{name}" if name.startswith("-") else name for name in self.files)
        words = [*self.command.split(), *files]
        for name, value in self.effective_options.items():
            option = "-o" if name == "output" else f"--{name.replace('_', '-')}"
            if value is True:
                words.append(option)
            else:
                values = value if isinstance(value, list) else [value]
                words += [word for text in values for word in (option, str(text))]
        return words

    @property
    def line(self) -> str:
        """This command line."""
        return shlex.join(["hotlever", *self.words])

    def writing(self, files: Mapping[str, str]) -> Task:
        """Return the same that writes other files."""
        written = written_by(COMMANDS[self.command])
        options = {name: value for name, value in self.options.items() if name not in written}
        return replace(self, options={**options, **files})

    @property
    def question(self) -> Task:
        """What it asks, whatever it is written to."""
        asked = self.writing({})
        return replace(asked, options=asked.effective_options)

    @property
    def written(self) -> str:
        """The file or folder that shows whether it has written what was asked for."""
        return str([value for value in self.options.values() if value][-1])

    @property
    def read(self) -> list[str]:
        """What may be files that it reads."""
        values = self.question.options.values()
        lists = (value if isinstance(value, list) else [value] for value in values)
        return [*self.files, *(str(value) for each in lists for value in each)]


@dataclass
class Job:
    """A task and how far it is.

    Attributes
    ----------
    task : Task
    message : str
        In one line, why it failed.
    notes : list of str
    label, done, total
        Of the last progress told.
    contents : dict
        What it told last, by what it is: the ``result``, the ``curve`` of a fit, a ``table``.
    began : float
        When, as files are stamped.
    version : int
        Counts the changes, for pages to see that there is something new.
    """

    task: Task
    standing: Literal["running", "done", "failed", "cancelled"] = "running"
    message: str = ""
    notes: list[str] = field(default_factory=list)
    label: str = ""
    done: int = 0
    total: int = 0
    contents: dict[str, Any] = field(default_factory=dict)
    version: int = 0
    began: float = field(default_factory=time.time)

    @property
    def share(self) -> float | None:
        """Share of the work that is done; None if nobody knows."""
        return min(1.0, self.done / self.total) if self.total else None

    @property
    def left_s(self) -> float | None:
        """Seconds that it may still take, by what it took so far."""
        share = self.share
        # before that it tells nothing: work may begin slowly
        if share is None or share < 0.03 or self.standing != "running":
            return None
        return (time.time() - self.began) * (1.0 - share) / share

    def hear(self, kind: str, content: Any) -> None:
        """Take in what the task tells."""
        if kind == "progress":
            self.label, self.done, self.total = content
        elif kind == "note":
            self.notes = [*self.notes, content][-200:]  # the last ones
        elif kind == "failure":
            self.message = content
        else:
            self.contents[kind] = content
        self.version += 1

    def end(self, standing: Literal["done", "failed", "cancelled"], message: str = "") -> None:
        """Note how it ended, for good."""
        if self.standing == "running":
            self.standing, self.message = standing, message or self.message
            self.version += 1


class Jobs:
    """The jobs of a project by the names of their pages; a process is kept ready for the next."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._spare: Worker | None = None
        self._workers: dict[str, Worker] = {}
        self._running: set[asyncio.Task[None]] = set()
        self._by_page: dict[str, list[Job]] = {}

    def prepare(self) -> None:
        """Have a process ready."""
        if self._spare is None or self._spare.lost:
            self._spare = Worker(self._folder)

    def add(self, page: str, job: Job) -> Job:
        """Count a job to a page."""
        jobs = self._by_page.setdefault(page, [])
        jobs.insert(0, job)
        del jobs[50:]
        return job

    def of(self, page: str) -> list[Job]:
        """Return the jobs of a page, the latest first."""
        return self._by_page.get(page, [])

    def running(self, page: str) -> bool:
        """Return whether a page has work."""
        return any(job.standing == "running" for job in self.of(page)[:1])

    def start(self, page: str, task: Task) -> Job:
        """Have a task done for a page.

        Raises
        ------
        HotleverError
            If the page has work already.
        """
        if self.running(page):
            raise HotleverError("this is being worked on already; cancel it first")
        job = self.add(page, Job(task))
        self.prepare()
        assert self._spare is not None
        self._workers[page], self._spare = self._spare, None
        running = asyncio.create_task(self._run(page, job, self._workers[page]))
        # a task that nobody holds may be collected
        self._running.add(running)
        running.add_done_callback(self._running.discard)
        return job

    async def _run(self, page: str, job: Job, worker: Worker) -> None:
        try:
            await worker.call(run, job.task, heard=job.hear)
            job.end("failed" if job.message else "done")
        except HotleverError as error:
            # what was reached may be written; the message says where it stopped
            job.end("failed", str(error))
        if worker.lost or job.standing == "cancelled" or self._spare is not None:
            worker.kill()
        else:
            self._spare = worker
        if self._workers.get(page) is worker:
            del self._workers[page]
        self.prepare()

    async def cancel(self, page: str) -> None:
        """End what a page works on."""
        if self.running(page):
            self.of(page)[0].end("cancelled")
            await self._workers[page].end()

    async def stop(self, page: str) -> None:
        """Have a page's work end by itself: it turns off what it turned on, and says how it ended.

        What does not end is killed.
        """
        if not self.running(page):
            return
        job, worker = self.of(page)[0], self._workers[page]
        job.hear("progress", ("stopping", 0, 0))
        worker.interrupt()
        # half a minute to turn off what it turned on
        for _ in range(300):
            if job.standing != "running":
                return
            await asyncio.sleep(0.1)
        job.end(
            "failed",
            "it did not end by itself and was killed: see whether the output of the instrument is "
            "off",
        )
        worker.kill()


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
        self, worker: str, function: Callable[..., Any], *arguments: Any, heard: Heard | None = None
    ) -> Any:
        """Call a function of a `Report` and some arguments in a process.

        Raises
        ------
        HotleverError
            As the function says, or if the process died.
        """
        return await self._worker(worker).call(function, *arguments, heard=heard)


# --- in the process -------------------------------------------------------------------------------


def run(report: Report, task: Task) -> None:
    """Do a task.

    Raises
    ------
    HotleverError
        If it cannot be done, or only in part.
    """
    run_command(task.words, report)


def lever_told(told: Mapping[str, Any]) -> LeverArguments:
    """Return the lever of a command whose arguments are given by name."""
    return LeverArguments(told["probe"], told["medium"], told["set"], told["physics"])


def surrounded_probe(report: Report, told: Mapping[str, Any]) -> Probe:
    """Return the probe, in its medium, of a command whose arguments are given by name."""
    return read_surrounded_probe(report, lever_told(told))


def probe_of(name: str) -> Probe:
    """Return the probe of a file, the reference probe where none is named."""
    return Probe.from_file(name) if name else Probe.reference()
