"""The lever of the page Simulate in time: a pulse, a train of pulses or a step, simulated."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages.frame import ErrorBanner, caption, figure, number_shown
from hotlever.app.pages.page import Page, Work, outputs
from hotlever.app.session import Session
from hotlever.errors import InputError

_KINDS = {"pulse": "one pulse", "train": "several pulses", "step": "a step that stays"}
#: Fields by name: label, unit, kinds that have it, and what stands there if nothing does.
_FIELDS: dict[str, tuple[str, str, tuple[str, ...], str]] = {
    "height": ("Height", "V", ("pulse", "train", "step"), ""),
    "length": ("Length", "us", ("pulse", "train"), ""),
    "period": ("Period", "us", ("train",), ""),
    "count": ("Pulses", "", ("train",), ""),
    "until": ("Follow until", "us", ("pulse", "train", "step"), "its end"),
}
_ALT = "Voltages, current, tip temperature and heat in time"


def stem(lever: dict[str, Any]) -> str:
    """Return what names of files begin with, of the lever that is chosen."""
    return Path(lever["probe"] or "reference.toml").stem


def settings(lever: dict[str, Any]) -> dict[str, Any]:
    """Return the options of a task that say what is changed of a probe."""
    texts = {None: "none", True: "true", False: "false"}
    changes = {
        name: texts[value] if value is None or isinstance(value, bool) else value
        for name, value in lever["changes"].items()
    }
    medium = changes.pop("medium", None)
    return {"medium": medium, "set": [f"{name}={changes[name]}" for name in sorted(changes)]}


def in_python(lever: dict[str, Any]) -> str:
    """Return what makes the probe that is chosen in Python."""
    name, changes = lever["probe"], dict(sorted(lever["changes"].items()))
    made = f"Probe.from_file({name!r})" if name else "Probe.reference()"
    if not changes:
        return made
    if all(name.isidentifier() for name in changes):
        return f"{made}.with_({', '.join(f'{key}={value!r}' for key, value in changes.items())})"
    return f"{made}.with_(**{changes!r})"


class Pulses(Page):
    """What the lever shows in time, as `hotlever pulse` computes it."""

    name = "pulse"

    def __init__(self, session: Session, banner: ErrorBanner, lever: dict[str, Any]) -> None:
        super().__init__(session, banner)
        self._lever = lever
        with ui.card().classes("w-full").props("flat bordered"):
            with ui.row().classes("w-full items-center"):
                kind = ui.toggle(_KINDS, value=self.chosen["kind"], on_change=self._keep("kind"))
                kind.props('aria-label="Wave form"')
                ui.space()
                ui.button("Follow", icon="timeline", on_click=self.start)
            with ui.row().classes("w-full items-center"):
                self._fields = {key: self._field(key) for key in _FIELDS}
        Work(session, self.name, self._ended)
        self._result = ui.column().classes("w-full gap-3")
        self.command()
        self._offer()
        self._keep_result(session.jobs.by_page.get(self.name))
        self._show()

    def _field(self, key: str) -> ui.number:
        label, unit, _, placeholder = _FIELDS[key]
        least = 1 if key == "count" else None
        number = ui.number(label, value=self.chosen[key], min=least, on_change=self._keep(key))
        number.props(f"debounce=200 suffix={unit.replace('u', 'µ')}" if unit else "debounce=200")
        if placeholder:
            number.props(f'clearable stack-label placeholder="{placeholder}"')
        return number.classes("w-36")

    def changed(self) -> None:
        """Follow what was chosen of the wave form."""
        self._offer()
        self.show_command()

    def _offer(self) -> None:
        """Show the fields that the wave form has."""
        for key, field in self._fields.items():
            field.set_visibility(self.chosen["kind"] in _FIELDS[key][2])

    def _values(self) -> dict[str, str]:
        """Return what is set of the wave form.

        Raises
        ------
        InputError
            If something is missing.
        """
        values = {}
        for key, (label, _, kinds, placeholder) in _FIELDS.items():
            if self.chosen["kind"] in kinds:
                if self.chosen[key] is not None:
                    values[key] = f"{self.chosen[key]:.12g}"
                elif not placeholder:
                    raise InputError(f"{label}: expected a number")
        return values

    def task(self) -> Task:
        """Return the task that simulates the lever, and writes table and figure."""
        values = self._values()
        texts = {key: f"{value}{_FIELDS[key][1]}" for key, value in values.items()}
        height = texts.pop("height")
        if self.chosen["kind"] == "step":
            wave = {"step": values["height"]}
        else:
            wave = {"pulse": f"{height},{texts.pop('length')}"}
        files = outputs(f"{stem(self._lever)}.pulse", "SVG")
        probe = (self._lever["probe"],) if self._lever["probe"] else ()
        return Task("pulse", probe, {**settings(self._lever), **wave, **texts, **files})

    def python(self) -> str:
        """Return the lines of Python that simulate the lever."""
        values, form = self._values(), "step" if self.chosen["kind"] == "step" else "pulse"
        until = f", until={values.pop('until')}" if "until" in values else ""
        return "\n".join(
            [
                "from hotlever import Lever, Probe, simulate",
                f"from hotlever.lever.transient import {form}",
                "",
                f"lever = Lever({in_python(self._lever)})",
                f"history = simulate(lever, {form}({', '.join(values.values())}){until})",
            ]
        )

    async def _ended(self, job: Job) -> None:
        if self._keep_result(job):
            self._show()
        else:
            await self.give(job)

    def _keep_result(self, job: Job | None) -> bool:
        """Keep what is to be shown of a job, if it simulated the lever; return whether it did."""
        if job is None or not job.task.written.endswith(".svg"):
            return False
        if self.written(job):
            self.session.shown[self.name] = job.task, job.shown.get("table", [])
        return True

    def _show(self) -> None:
        """Show what was simulated last, with the figure that was drawn, and give it."""
        self._result.clear()
        if self.name not in self.session.shown:
            return
        task, numbers = self.session.shown[self.name]
        path = self.session.project.path(task.written)
        if not path.is_file():
            return
        with self._result:
            with ui.row().classes("w-full items-end gap-6"):
                for title, value in numbers:
                    number_shown(title, title, value)
            figure(path.read_text(encoding="utf-8"), _ALT, wide=True)
            with ui.row().classes("w-full items-center"):
                caption(task.writing({}).line).classes("remark col")
                self.kind_buttons(partial(self._ask, task, path))

    def _ask(self, task: Task, path: Path, kind: str) -> None:
        """Give a file that there is, or have it written."""
        if kind in ("CSV", "SVG"):
            ui.download.file(path.with_suffix(f".{kind.lower()}"))
        else:
            self.run(task.writing(outputs(path.stem, kind)))
