"""What pages have in common: what is chosen, the task that follows from it, and its work."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app import showing
from hotlever.app.pages.frame import (
    ErrorBanner,
    figure,
    framed,
    hand_over,
    lines_shown,
    number_shown,
    small_button,
    text_shown,
)
from hotlever.app.session import Job, Session, Task
from hotlever.errors import InputError

MEDIA = {
    "": "as the files say",
    "vacuum": "vacuum",
    "air": "air",
    "unknown": "not known: either is tried",
}
#: What a task that writes tables, figures and fields may be asked for.
KINDS = {
    "CSV": "the table",
    "NetCDF": "the table with units and all that is known",
    "SVG": "the figure",
    "PNG": "the figure",
    "PDF": "the figure",
    "VTU": "the fields, for ParaView",
}


class TaskPage:
    """One tab of a page, or of a part of one.

    Attributes
    ----------
    name : str
        Its address, under which also its work runs, and what was chosen is kept.
    chosen : dict
        What was chosen last, in whatever tab.
    """

    name = ""
    #: What is chosen at first.
    first: ClassVar[dict[str, Any]] = {}
    #: What its task may be asked for as.
    kinds: ClassVar = {kind: meaning for kind, meaning in KINDS.items() if kind != "VTU"}

    @classmethod
    async def fill(cls, session: Session) -> None:
        """Fill the page."""
        with framed(session, cls.name) as banner:
            page = cls(session, banner)
        await page.open()

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        self.session, self.banner = session, banner
        self.chosen = session.choices(self.name, self.first)
        self._command: ui.column | None = None
        self._command_line = ""
        self._origin: tuple[Job, ui.label] | None = None

    async def open(self) -> None:
        """Show what takes a moment, once the page is there."""

    # --- what is asked ----------------------------------------------------------------------------

    def changed(self) -> Awaitable[None] | None:
        """Follow what was chosen."""
        self.show_command()
        return None

    def _keep(self, key: str, without: Any = None) -> Callable[[Any], Awaitable[None] | None]:
        def keep(event: Any) -> Awaitable[None] | None:
            self.chosen[key] = without if event.value in (None, "") else event.value
            return self.changed()

        return keep

    def choice(self, key: str, label: str, options: dict[str, str]) -> ui.select:
        """Ask for one of some options; one that is not there any more stays chosen, as missing."""
        value = self.chosen[key]
        keep = self._keep(key, "")
        options = _with_missing(options, value)
        return ui.select(options, label=label, value=value, on_change=keep).classes("w-full")

    def lever_choice(self) -> ui.select:
        """Ask for the lever of all pages: the reference probe or a probe file of the project.

        What is chosen in another tab is followed.
        """
        session, project = self.session, self.session.project

        def options() -> dict[str, str]:
            probes = {"": "reference probe"} | {name: name for name in project.probes}
            return _with_missing(probes, session.probe)

        def chosen(event: Any) -> Awaitable[None] | None:
            session.choose_lever(event.value)
            return self.changed()

        def follow() -> None:
            select.set_options(options(), value=session.probe)

        select = ui.select(options(), label="Lever", value=session.probe, on_change=chosen)
        session.followers.append(follow)
        ui.context.client.on_delete(lambda: session.followers.remove(follow))
        return select.classes("w-full").tooltip("The lever of all pages")

    @property
    def probe(self) -> str:
        """The probe file of the lever; empty for the reference probe."""
        return self.session.probe

    @property
    def probe_files(self) -> tuple[str, ...]:
        """The files that a task of the lever is given."""
        return (self.probe,) if self.probe else ()

    @property
    def stem(self) -> str:
        """What names of files begin with, of the lever."""
        return Path(self.probe or "reference.toml").stem

    def text(self, key: str, label: str) -> ui.input:
        """Ask for a line of text."""
        field = ui.input(label, value=self.chosen[key], on_change=self._keep(key, ""))
        return field.classes("w-full").props("debounce=200")

    def number(self, key: str, label: str, unit: str = "", empty: str = "") -> ui.number:
        """Ask for a number; `empty` is what counts where there is none."""
        number = ui.number(label, value=self.chosen[key], on_change=self._keep(key))
        number.props(f"debounce=200 suffix={unit.replace('u', 'µ')}" if unit else "debounce=200")
        if empty:
            number.props(f'clearable stack-label placeholder="{empty}"')
        return number.classes("w-36")

    def checkbox(self, key: str, label: str, meaning: str) -> ui.checkbox:
        """Ask whether something is wanted."""
        box = ui.checkbox(label, value=self.chosen[key], on_change=self._keep(key, False))
        return box.tooltip(meaning)

    # --- what is done -----------------------------------------------------------------------------

    def task(self) -> Task | None:
        """Return the task that does what is chosen, and writes new files.

        Raises
        ------
        InputError
            If something is missing.
        """
        return None

    def outputs(self, stem: str, what: str, kind: str) -> dict[str, str]:
        """Return the options that have a task write one of `KINDS` or a film, under a new name."""
        endings = [f".{what}{Path(name).suffix}" for name in outputs("file", kind).values()]
        return outputs(f"{self.session.project.free(stem, *endings)}.{what}", kind)

    def python(self) -> str:
        """Return the lines of Python that do the same, if there are short ones."""
        return ""

    def command(self) -> None:
        """Show the command line here, whenever `show_command` is called."""
        self._command, self._command_line = ui.column().classes("w-full gap-0"), ""

    def _task_now(self) -> Task | None:
        with suppress(InputError):
            return self.task()
        return None

    def show_command(self) -> None:
        """Show the command line of what is chosen now, and mark a result of something else."""
        task = self._task_now()
        self._mark(task)
        line = "" if task is None else task.line
        if self._command is not None and line != self._command_line:
            self._command.clear()
            self._command_line = line
            if line:
                with self._command:
                    where = f"The same on the command line, in {self.session.project.folder}"
                    lines_shown(line, "command line", where)
                    if lines := self.python():
                        lines_shown(lines, "lines of Python", "The same in Python")

    def start(self) -> bool:
        """Have the task done; return whether it runs."""
        with self.banner.caught():
            task = self.task()
            return task is not None and self.run(task)
        return False

    def run(self, task: Task) -> bool:
        """Have a task of the page done; return whether it runs."""
        with self.banner.caught():
            self.session.jobs.start(self.name, task)
            return True
        return False

    # --- what came out ----------------------------------------------------------------------------

    def result_of(self, job: Job) -> None:
        """Show here that what is below is of a job: its command line, and a mark once it is old."""
        mark = ui.label("Something else is chosen now; this is still the result of:")
        mark.classes("banner w-full").props("role=status data-other=1")
        self._origin = job, mark
        with ui.element("pre").classes("command w-full"):
            ui.label(job.task.line).props("data-origin=1")
        self._mark(self._task_now())

    def _mark(self, now: Task | None) -> None:
        """Mark the result if something else is chosen, or one of its files has changed."""
        if self._origin is not None:
            job, mark = self._origin
            asked = now is not None and now.question == job.task.question
            mark.set_visibility(not asked or self._latest(job.task) > job.began)

    def _latest(self, task: Task) -> float:
        """Return when the latest of the files was written that a task reads."""
        with suppress(InputError, OSError, ValueError):
            return max(map(self.session.project.stamp, task.read), default=0.0)
        return 0.0

    def kind_buttons(self, on_click: Callable[[str], Any]) -> None:
        """Show a button for each kind of file."""
        with ui.row().classes("items-center"):
            for kind, meaning in self.kinds.items():
                small_button(kind, lambda _, to=kind: on_click(to)).tooltip(meaning)

    def written(self, job: Job) -> bool:
        """Return whether a job has written what was asked for, be it in part."""
        return self.session.project.stamp(job.task.written) >= job.began

    async def give(self, job: Job) -> None:
        """Give what a job has written, several files as one."""
        if not self.written(job):
            return
        path = self.session.project.path(job.task.written)
        if path.is_dir():
            new = sorted(path.iterdir())
            if len(new) > 1:
                packed = self.session.ask("full", showing.packed, new)
                await hand_over(packed, f"{path.name}.zip")
                return
            path = new[0]
        ui.download.file(path)


def _with_missing(options: dict[str, str], value: str) -> dict[str, str]:
    """Return options with one that is chosen, be its file gone: another would be a wrong one."""
    return options if value in options else {**options, value: f"{value} (not in the folder)"}


def several(text: str) -> list[str]:
    """Return the parts of a text, between commas."""
    return [part.strip() for part in text.split(",") if part.strip()]


def outputs(stem: str, kind: str) -> dict[str, str]:
    """Return the options that have a task write one of `KINDS` or a film, whose name stands last.

    Examples
    --------
    >>> outputs("a", "PDF"), outputs("a", "VTU")
    ({'output': 'a.csv', 'plot': 'a.pdf'}, {'fields': 'a.fields'})
    """
    if kind == "film":
        return {"film": f"{stem}.gif"}
    if kind == "VTU":
        return {"fields": f"{stem}.fields"}
    tables = {"CSV": "csv", "NetCDF": "nc"}
    if kind in tables:
        return {"output": f"{stem}.{tables[kind]}"}
    return {"output": f"{stem}.csv", "plot": f"{stem}.{kind.lower()}"}


class JobView:
    """The job that runs for a page, or ran last: progress, notes, its line, and cancelling.

    Parameters
    ----------
    session : Session
    page : str
    then : callable
        Called with the job when it has ended while the page is open.
    during : callable, optional
        Called with the job whenever there is something new of it.
    notes : bool
        Whether what the task notes is shown here, and not with its result.
    stops : bool
        Whether it is stopped, as what owns an instrument, and not cancelled.
    """

    def __init__(
        self,
        session: Session,
        page: str,
        then: Callable[[Job], Awaitable[None]],
        *,
        during: Callable[[Job], None] | None = None,
        notes: bool = True,
        stops: bool = False,
    ) -> None:
        self._session, self._page, self._then, self._during = session, page, then, during
        self._seen: tuple[int, int] = (0, -1)
        end, way = ("Stop", session.jobs.stop) if stops else ("Cancel", session.jobs.cancel)

        async def stop() -> None:
            await way(page)
            self._look()

        with ui.column().classes("w-full gap-1") as self._all:
            with ui.row().classes("w-full items-center no-wrap") as self._running:
                self._bar = ui.linear_progress(show_value=False, size="10px").props("rounded")
                self._text = ui.label().classes("text-xs no-wrap").props("aria-live=polite")
                ui.button(end, on_click=stop).props("dense outline color=negative")
            self._message = ui.label().classes("banner w-full").props("role=alert")
            self._notes = ui.column().classes("w-full gap-0 text-sm remark")
            self._notes.set_visibility(notes)
        self._reported_job = self._job if self._has_ended else None
        self._look()
        ui.timer(0.1, self._tell)

    @property
    def _job(self) -> Job | None:
        return next(iter(self._session.jobs.of(self._page)), None)

    @property
    def _has_ended(self) -> bool:
        return self._job is not None and self._job.standing != "running"

    async def _tell(self) -> None:
        self._look()
        job = self._job
        if job is not None and self._has_ended and self._reported_job is not job:
            self._reported_job = job
            await self._then(job)

    def _look(self) -> None:
        job = self._job
        self._all.set_visibility(job is not None)
        if job is None:
            return
        running = job.standing == "running"
        self._running.set_visibility(running)
        if running:
            self._bar.props(**{"remove" if job.share else "add": "indeterminate"})
            self._bar.set_value(job.share or 0.0)
            left = job.left_s
            more = "" if left is None else f", some {max(1.0, left):.0f} s left"
            what = job.label or ("at work" if job.contents else "starting")
            self._text.set_text(f"{what}{more}")
        if self._seen == (id(job), job.version):
            return
        self._seen = (id(job), job.version)
        cancelled = job.standing == "cancelled"
        message = "cancelled: only what was done before is written" if cancelled else job.message
        self._message.set_text("" if running else message)
        self._message.set_visibility(not running and bool(message))
        self._notes.clear()
        with self._notes:
            for text in job.notes:
                ui.label(f"• {text}")
        if self._during is not None:
            self._during(job)


class DrawnPage(TaskPage):
    """A page, or a part of one, that shows the figure of its task and gives what it computed."""

    #: What the figure shows.
    alt = ""

    def show_result(self) -> None:
        """Show the work here, what it drew last, and the command line."""
        JobView(self.session, self.name, self._ended)
        self._result = ui.column().classes("w-full gap-3")
        self.command()
        self._show()

    async def _ended(self, job: Job) -> None:
        if job.task.written.endswith(".svg"):
            self._show()
        else:
            await self.give(job)
        self.show_command()

    def drawn_job(self) -> Job | None:
        """Return the last job that drew a figure, which is still there."""
        drawn = (job for job in self.session.jobs.of(self.name) if job.standing != "running")
        drawn = (job for job in drawn if job.task.written.endswith(".svg"))
        return next((job for job in drawn if self.written(job)), None)

    def _show(self) -> None:
        """Show what was computed last, with the figure that was drawn, and give it."""
        self._result.clear()
        self._origin = None
        job = self.drawn_job()
        if job is None:
            return
        path = self.session.project.path(job.task.written)
        with self._result:
            self.result_of(job)
            if numbers := job.contents.get("table"):
                with ui.row().classes("w-full items-end gap-6"):
                    for title, value in numbers:
                        number_shown(title, title, value)
            text_shown(job.contents.get("result", ""))
            self.show_figure(job, path)
            self.kind_buttons(partial(self._ask, job.task, path))

    def show_figure(self, job: Job, path: Path) -> None:
        """Show the figure that a job drew."""
        figure(path.read_text(encoding="utf-8"), self.alt, wide=True)

    def _ask(self, task: Task, path: Path, kind: str) -> None:
        """Give a file that there is, or have it written."""
        if kind in ("CSV", "SVG"):
            ui.download.file(path.with_suffix(f".{kind.lower()}"))
        else:
            stem, _, what = path.stem.rpartition(".")
            self.run(task.writing(self.outputs(stem, what, kind)))
