"""The lever of the page Simulate in time, under a wave form, and under small signals."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from operator import contains
from pathlib import Path
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages.chosen_lever import (
    beside_in_words,
    files_of,
    in_python,
    lever_beside,
    settings,
)
from hotlever.app.pages.frame import ErrorBanner, caption, figure
from hotlever.app.pages.plots import compare_histories
from hotlever.app.pages.task_page import FILM, KINDS, DrawnPage, JobView
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
#: Options of a task that say how a lever is driven, and the name of the work on the lever beside.
_WAVE = ("pulse", "step", "period", "count", "until")
_BESIDE = "pulse-beside"
_ABOUT_SIGNALS = (
    "Impedance at the bias of the lever, and how its tip follows power and bias; with an amplitude "
    "the harmonics of the lever voltage (3ω method)."
)


class Pulses(DrawnPage):
    """What the lever shows in time, as `hotlever pulse` computes it."""

    name = "pulse"
    first: ClassVar = {
        "kind": "pulse",
        "height": 10.0,
        "length": 5.0,
        "period": 20.0,
        "count": 5,
        "until": None,
    }
    alt = "Voltages, current, tip temperature and heat in time"
    kinds: ClassVar = {**KINDS, **FILM}

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
                for key, (label, unit, kinds, empty) in _FIELDS.items():
                    field = self.number(key, label, unit, empty)
                    field.bind_visibility_from(kind, "value", backward=partial(contains, kinds))
        JobView(session, _BESIDE, self._beside_ended)
        self.show_result()

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
        return self._task(self._lever, self.outputs(self.stem, "pulse", "SVG"))

    def _task(self, lever: Mapping[str, Any], files: dict[str, str]) -> Task:
        """Return the task that simulates a lever under the wave form that is chosen."""
        values = self._values()
        texts = {key: f"{value}{_FIELDS[key][1]}" for key, value in values.items()}
        height = texts.pop("height")
        if self.chosen["kind"] == "step":
            wave = {"step": values["height"]}
        else:
            wave = {"pulse": f"{height},{texts.pop('length')}"}
        return Task("pulse", files_of(lever), {**settings(lever), **wave, **texts, **files})

    def start(self) -> bool:
        """Simulate the lever, and that beside it at the same time."""
        other = lever_beside(self._lever)
        with self.banner.caught():
            beside = None
            if other is not None:
                beside = self._task(other, self.outputs(self.stem, "beside.pulse", "CSV"))
            if started := super().start():
                job = self.session.jobs.of(self.name)[0]
                # what is beside it stays so, whatever is chosen by the time it is shown
                job.contents["beside"] = beside and (beside.written, beside_in_words(self._lever))
                if beside is not None:
                    self.session.jobs.start(_BESIDE, beside)
            return started
        return False

    def python(self) -> str:
        """Return the lines of Python that simulate the lever."""
        values, form = self._values(), "step" if self.chosen["kind"] == "step" else "pulse"
        until = f", until={values.pop('until')}" if "until" in values else ""
        last = f"history = simulate(lever, {form}({', '.join(values.values())}){until})"
        imported = f"from hotlever.lever.transient import {form}, simulate"
        return in_python(self._lever, last, imported)

    def show_figure(self, job: Job, path: Path) -> None:
        """Show the figure that was drawn, the lever beside, and the film if there is one."""
        super().show_figure(job, path)
        beside, words = job.contents.get("beside") or ("", "")
        if beside and self.session.project.stamp(beside) >= job.began:
            compare_histories(path.with_suffix(".csv"), self.session.project.path(beside))
            caption(f"Line: the lever. Dashed: {words}.").classes("remark")
        films = (film for film in self.session.jobs.of(self.name) if "film" in film.task.options)
        same = (film for film in films if film.task.question == job.task.question)
        if film := next(filter(self.written, same), None):
            content = self.session.project.path(film.task.written).read_bytes()
            figure(content, "The temperature map in time", wide=True)

    async def _beside_ended(self, job: Job) -> None:
        self._show()

    async def _ended(self, job: Job) -> None:
        if "film" in job.task.options:
            self._show()
        else:
            await super()._ended(job)


class SmallSignals(DrawnPage):
    """What the lever shows under small signals, or its harmonics, as `hotlever spectrum` does."""

    name = "signals"
    first: ClassVar = {"lowest_Hz": 1.0, "highest_Hz": 1e7, "count": 71, "amplitude_V": None}
    alt = "Impedance, and how the tip follows, against the frequency"

    def __init__(self, session: Session, banner: ErrorBanner, lever: dict[str, Any]) -> None:
        super().__init__(session, banner)
        self._lever = lever
        with ui.card().classes("w-full").props("flat bordered"):
            caption(_ABOUT_SIGNALS)
            with ui.row().classes("w-full items-center"):
                self.number("lowest_Hz", "From", "Hz")
                self.number("highest_Hz", "to", "Hz")
                self.number("count", "Frequencies")
                self.number("amplitude_V", "Amplitude", "V", "small")
                ui.space()
                ui.button("Respond", icon="graphic_eq", on_click=self.start)
        self.show_result()

    def _range(self) -> list[str]:
        values = [self.chosen[key] for key in ("lowest_Hz", "highest_Hz", "count")]
        if None in values:
            raise InputError("frequencies: expected lowest, highest and their count")
        return [f"{value:.12g}" for value in values]

    def task(self) -> Task:
        """Return the task that writes table and figure."""
        low, high, count = self._range()
        amplitude = self.chosen["amplitude_V"]
        options = {
            "bias": f"{self._lever['bias']:.12g}",
            "frequency": f"{low}Hz:{high}Hz:{count}",
            "amplitude": "" if amplitude is None else f"{amplitude:.12g}",
        }
        options |= {**settings(self._lever), **self.outputs(self.stem, "spectrum", "SVG")}
        return Task("spectrum", files_of(self._lever), options)

    def python(self) -> str:
        """Return the lines of Python that do the same."""
        low, high, count = self._range()
        bias, swing = self._lever["bias"], self.chosen["amplitude_V"]
        frequencies = f"np.geomspace({low}, {high}, {count})"
        function, call = "spectrum", f"spectrum(lever.solve([{bias:.12g}])[0], {frequencies})"
        if swing is not None:
            function = "harmonics"
            call = f"harmonics(lever, {bias:.12g}, {swing:.12g}, {frequencies})"
        module = "hotlever.lever.transient.frequency_domain"
        imports = "import numpy as np", f"from {module} import {function}"
        return in_python(self._lever, f"response = {call}", *imports)
