"""Fit: a measurement in, material parameters with their errors out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, named
from hotlever.app.page import Complaint, Work, command_shown, framed, two_columns
from hotlever.app.project import FIT, FITS
from hotlever.app.rooms.measured import Measured
from hotlever.app.rooms.results import download_button, show_result
from hotlever.app.session import Session

_OBSERVABLES = {"current": "current I_h", "reader": "reader V_r", "tip": "tip temperature"}
_OPTIONS = {
    "robust": ("robust", "Lessen the weight of points far off the others"),
    "drift": ("drifting zeros", "Let the zeros of I_h and V_r drift along the file"),
    "profiles": ("profiles", "Profile the likelihood of each parameter (some 10 s, on a page)"),
    "posterior": ("posterior", "Sample the posterior (half a minute, on a page of its own)"),
}


async def fit(session: Session) -> None:
    """Fill the page."""
    with framed(session, "/fit") as complaint:
        room = _Room(session, complaint)
    await room.measured.read()


class _Room:
    """One tab of the room."""

    def __init__(self, session: Session, complaint: Complaint) -> None:
        self._session, self._complaint = session, complaint
        self._chosen = session.chosen.setdefault("fit", {})
        self._has: list[str] = []
        self.measured = Measured(session, complaint, self._chosen, self._understood)
        with two_columns() as (left, right):
            with left:
                self.measured.controls()
                self.measured.probe_choice()
                self._options()
                self._button = ui.button("Fit", icon="query_stats", on_click=self._start)
                self._button.classes("w-full").props("no-caps")
                self._button.disable()  # until there is something understood
            with right:
                self._work = Work(session, "fit", self._fitted, notes=False)
                self._result = ui.column().classes("w-full gap-2")
                self.measured.shown()
                self._command = ui.column().classes("w-full gap-0")

    def _options(self) -> None:
        chosen = self._chosen
        with ui.column().classes("gap-0"):
            ui.label("Fitted").classes("text-sm text-bold")
            self._observables = {}
            for name, label in _OBSERVABLES.items():
                box = ui.checkbox(label, value=name not in chosen.get("without", []))
                box.props("dense").on_value_change(self._choose)
                self._observables[name] = box
        with ui.expansion("More").classes("w-full").props("dense"):
            self._flags = {}
            for name, (label, meaning) in _OPTIONS.items():
                box = ui.checkbox(label, value=bool(chosen.get(name))).props("dense")
                box.tooltip(meaning).on_value_change(self._choose)
                self._flags[name] = box
            self._medium = ui.select(
                {"": "as the files say", "vacuum": "vacuum", "air": "air"},
                label="Medium",
                value=chosen.get("medium", ""),
                on_change=self._choose,
            ).props("dense outlined")
            self._medium.classes("w-full")
            self._fixed = ui.input(
                "Hold (n_d=3.3e17, p)", value=chosen.get("fixed", ""), on_change=self._choose
            ).props("dense outlined")
            self._fixed.classes("w-full")
            self._priors = ui.input(
                "Known beforehand (n_d=3.3e17±15%)",
                value=chosen.get("priors", ""),
                on_change=self._choose,
            ).props("dense outlined")
            self._priors.classes("w-full")

    def _choose(self) -> None:
        self._chosen["without"] = [name for name, box in self._observables.items() if not box.value]
        self._chosen |= {name: box.value for name, box in self._flags.items()}
        self._chosen |= {"medium": self._medium.value, "fixed": self._fixed.value or ""}
        self._chosen["priors"] = self._priors.value or ""
        self._show_command()

    async def _understood(self, found: dict[str, Any] | None) -> None:
        """Show what can be fitted, and the fit of this measurement if there is one."""
        self._button.set_enabled(found is not None)
        self._has = [] if found is None else found["observables"]
        for name, box in self._observables.items():
            box.set_visibility(name in self._has)
        self._show_command()
        await self._show_fit()

    @property
    def _output(self) -> str:
        return f"{Path(self._chosen['data']).stem}{FIT}"

    def _arguments(self) -> list[str]:
        """Return the command that makes the fit."""
        chosen = self._chosen
        arguments = ["fit", named(chosen["data"])]
        if chosen.get("probe"):
            arguments += ["--probe", named(chosen["probe"])]
        without = set(chosen.get("without", [])) & set(self._has)
        if without:
            kept = [name for name in self._has if name not in without]
            arguments += ["--observables", ",".join(kept)]
        for column in chosen.get("columns", []):
            arguments += ["--column", column]
        for option, text in (("--fix", chosen.get("fixed")), ("--prior", chosen.get("priors"))):
            for one in filter(None, (part.strip() for part in (text or "").split(","))):
                arguments += [option, one]
        if chosen.get("medium"):
            arguments += ["--medium", chosen["medium"]]
        flags = [name for name in _OPTIONS if chosen.get(name)]
        arguments += [f"--{name}" for name in flags] + ["-o", self._output]
        if {"profiles", "posterior"} & set(flags):
            arguments += ["--report", self._report]
        return arguments

    @property
    def _report(self) -> str:
        return f"{Path(self._chosen['data']).stem}-report"

    def _show_command(self) -> None:
        self._command.clear()
        if self._chosen.get("data"):
            with self._command:
                command_shown(self._arguments(), str(self._session.project.folder))

    def _start(self) -> None:
        with self._complaint.caught():
            self._session.jobs.start("fit", self._arguments())
            self._result.clear()

    async def _fitted(self, job: Job) -> None:
        await self._show_fit()

    async def _show_fit(self) -> None:
        self._result.clear()
        if not self._chosen.get("data") or self._session.jobs.running("fit"):
            return
        # a fit of this measurement alone goes before one among many levers
        stem, project = Path(self._chosen["data"]).stem, self._session.project
        names = [name for name in (self._output, f"{FITS}/{stem}.json") if project.stamp(name)]
        if not names:
            return
        name = names[0]
        with self._result:
            with ui.row().classes("items-center"):
                ui.label(name).classes("text-lg text-bold")
                ui.button(
                    "Calibrate with this fit",
                    icon="straighten",
                    on_click=lambda: self._calibrate(name),
                ).props("no-caps dense").classes("q-px-sm")
                download_button(self._session, name, "Fit (JSON)")
                page = f"{self._report}/index.html"
                if self._session.project.stamp(page):
                    download_button(self._session, page, "Page (HTML)")
            await show_result(self._session, self._complaint, "fit", name)

    def _calibrate(self, name: str) -> None:
        rest = {"data": self._chosen["data"], "rests": f"fit:{name}", "run": True}
        self._session.chosen.setdefault("calibrate", {}).update(rest)
        ui.navigate.to("/calibrate")
