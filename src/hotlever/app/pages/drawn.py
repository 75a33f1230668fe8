"""What pages have in common whose task computes a table and draws it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages.frame import caption, figure, number_shown, text_shown
from hotlever.app.pages.page import KINDS, Page, Work, outputs
from hotlever.app.state import Result


def stem(lever: Mapping[str, Any]) -> str:
    """Return what names of files begin with, of the lever that is chosen."""
    return Path(lever["probe"] or "reference.toml").stem


def probe_files(lever: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the files that a task of the lever is given."""
    return (lever["probe"],) if lever["probe"] else ()


def settings(lever: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a task that say what is changed of a probe."""
    texts = {None: "none", True: "true", False: "false"}
    changes = {
        name: texts[value] if value is None or isinstance(value, bool) else value
        for name, value in lever["changes"].items()
    }
    medium = changes.pop("medium", None)
    return {"medium": medium, "set": [f"{name}={changes[name]}" for name in sorted(changes)]}


def sweep_of(lever: Mapping[str, Any]) -> Task:
    """Return the task of a sweep of the lever that is chosen, whatever the biases."""
    return Task("sweep", probe_files(lever), settings(lever))


def in_python(lever: Mapping[str, Any], last: str, *imports: str) -> str:
    """Return lines of Python that end with what is done with the lever that is chosen.

    Examples
    --------
    >>> print(in_python({"probe": None, "changes": {"n_d": 5e17}}, "sweep = lever.sweep([8.0])"))
    from hotlever import Lever, Probe
    <BLANKLINE>
    lever = Lever(Probe.reference().with_(n_d=5e+17))
    sweep = lever.sweep([8.0])
    """
    name, changes = lever["probe"], dict(sorted(lever["changes"].items()))
    probe = f"Probe.from_file({name!r})" if name else "Probe.reference()"
    if changes and all(name.isidentifier() for name in changes):
        probe += f".with_({', '.join(f'{key}={value!r}' for key, value in changes.items())})"
    elif changes:
        probe += f".with_(**{changes!r})"
    heads = sorted(["from hotlever import Lever, Probe", *imports], key=lambda line: line[0] == "f")
    return "\n".join([*heads, "", f"lever = Lever({probe})", last])


def result_of(task: Task, numbers: list[Any], stamp: float, text: str = "") -> Result:
    """Return a task as what is kept of its result."""
    return Result(
        command=task.command,
        files=list(task.files),
        options=dict(task.options),
        numbers=numbers,
        text=text,
        stamp=stamp,
    )


class DrawnPage(Page):
    """A page, or a part of one, that shows the figure of its task and gives what it computed."""

    #: What the figure shows, and what it may be asked for as.
    alt = ""
    kinds: ClassVar[Mapping[str, str]] = {
        kind: meaning for kind, meaning in KINDS.items() if kind != "VTU"
    }

    def show_result(self) -> None:
        """Show the work here, what it drew last, and the command line."""
        Work(self.session, self.name, self._ended)
        self._result = ui.column().classes("w-full gap-3")
        self.command()
        self._keep_result(self.session.jobs.by_page.get(self.name))
        self._show()

    async def _ended(self, job: Job) -> None:
        if self._keep_result(job):
            self._show()
        else:
            await self.give(job)

    def _keep_result(self, job: Job | None) -> bool:
        """Keep what is to be shown of a job, if it drew that; return whether it did."""
        if job is None or not job.task.written.endswith(".svg"):
            return False
        if self.written(job):
            stamp = self.session.project.stamp(job.task.written)
            told = job.shown.get("table", []), stamp, job.shown.get("result", "")
            self.session.results[self.name] = result_of(job.task, *told)
        return True

    def _show(self) -> None:
        """Show what was computed last, with the figure that was drawn, and give it."""
        self._result.clear()
        result = self.session.results.get(self.name)
        if result is None:
            return
        task = Task(result.command, tuple(result.files), result.options)
        path, stamp = self.session.project.path(task.written), self.session.project.stamp
        latest = max(map(stamp, task.files), default=0.0)
        if stamp(task.written) != result.stamp or latest > result.stamp:
            return  # it is gone, or another one by now, or of files that have changed since
        with self._result:
            if result.numbers:
                with ui.row().classes("w-full items-end gap-6"):
                    for title, value in result.numbers:
                        number_shown(title, title, value)
            text_shown(result.text)
            self.show_figure(path)
            with ui.row().classes("w-full items-center"):
                caption(task.writing({}).line).classes("remark col min-w-60")
                self.kind_buttons(partial(self._ask, task, path), self.kinds)

    def show_figure(self, path: Path) -> None:
        """Show the figure that was drawn."""
        figure(path.read_text(encoding="utf-8"), self.alt, wide=True)

    def _ask(self, task: Task, path: Path, kind: str) -> None:
        """Give a file that there is, or have it written."""
        if kind in ("CSV", "SVG"):
            ui.download.file(path.with_suffix(f".{kind.lower()}"))
        else:
            self.run(task.writing(outputs(path.stem, kind)))
