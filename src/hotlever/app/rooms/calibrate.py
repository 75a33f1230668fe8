"""Calibrate: an I-V curve in; what to set for a temperature, and how sure that is, out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, named
from hotlever.app.page import Complaint, Work, command_shown, framed, two_columns
from hotlever.app.project import CALIBRATION, TABLE
from hotlever.app.rooms.measured import REFERENCE, Measured
from hotlever.app.rooms.results import SHOWING, download_button, show_result
from hotlever.app.session import Session
from hotlever.errors import HotleverError

#: What a calibration rests on: the option of the command, and what it is called.
_RESTS = {"probe": "--probe", "fit": "--fit", "law": "--power-law"}
_ASKED = {
    "tip_K": ("tip temperature", "K", 600.0),
    "bias_V": ("bias", "V", 8.0),
    "power_mW": ("power", "mW", 2.0),
}


async def calibrate(session: Session) -> None:
    """Fill the page."""
    with framed(session, "/calibrate") as complaint:
        room = _Room(session, complaint)
    await room.measured.read()


class _Room:
    """One tab of the room."""

    def __init__(self, session: Session, complaint: Complaint) -> None:
        self._session, self._complaint = session, complaint
        self._chosen = session.chosen.setdefault("calibrate", {})
        self.measured = Measured(session, complaint, self._chosen, self._understood)
        with two_columns() as (left, right):
            with left:
                self.measured.controls()
                self._options()
                self._button = ui.button("Calibrate", icon="straighten", on_click=self._start)
                self._button.classes("w-full").props("no-caps")
                self._button.disable()  # until there is something understood
            with right:
                self._work = Work(session, "calibrate", self._calibrated, notes=False)
                self._result = ui.column().classes("w-full gap-2")
                self.measured.shown()
                self._command = ui.column().classes("w-full gap-0")

    def _options(self) -> None:
        project, chosen = self._session.project, self._chosen
        rests = {"probe:": REFERENCE}
        rests |= {f"probe:{name}": name for name in project.probes}
        rests |= {f"fit:{name}": f"fit {name}" for name in project.fits}
        rests |= {f"law:{name}": f"power law of {name}" for name in project.laws}
        if chosen.get("rests") not in rests:
            chosen["rests"] = "probe:"
        self._rests = ui.select(
            rests, label="Rests on", value=chosen["rests"], on_change=self._choose
        )
        self._rests.classes("w-full").props("dense outlined")
        self._medium = ui.select(
            {"": "as the files say", "vacuum": "vacuum", "air": "air"},
            label="Medium",
            value=chosen.get("medium", ""),
            on_change=self._choose,
        )
        self._medium.classes("w-full").props("dense outlined")
        self._priors = ui.input(
            "Known beforehand (n_d=3.3e17±15%)",
            value=chosen.get("priors", ""),
            on_change=self._choose,
        )
        self._priors.classes("w-full").props("dense outlined")
        self._pulse = ui.input(
            "For pulses too (5us or 5us,100us)",
            value=chosen.get("pulse", ""),
            on_change=self._choose,
        )
        self._pulse.classes("w-full").props("dense outlined")

    def _choose(self) -> None:
        self._chosen |= {"rests": self._rests.value, "medium": self._medium.value}
        self._chosen |= {"priors": self._priors.value or "", "pulse": self._pulse.value or ""}
        self._show_command()

    async def _understood(self, found: dict[str, Any] | None) -> None:
        self._button.set_enabled(found is not None)
        self._show_command()
        # who comes from a fit has asked for this already
        if found is not None and self._chosen.pop("run", False):
            self._start()
        await self._show_calibration()

    @property
    def _stem(self) -> str:
        return Path(self._chosen["data"]).stem

    @property
    def _output(self) -> str:
        return f"{self._stem}{CALIBRATION}"

    def _arguments(self) -> list[str]:
        """Return the command that makes the calibration."""
        chosen = self._chosen
        arguments = ["calibrate", named(chosen["data"])]
        kind, _, name = chosen["rests"].partition(":")
        if name:
            arguments += [_RESTS[kind], named(name)]
        for column in chosen.get("columns", []):
            arguments += ["--column", column]
        if chosen.get("medium"):
            arguments += ["--medium", chosen["medium"]]
        for one in filter(None, (p.strip() for p in chosen.get("priors", "").split(","))):
            arguments += ["--prior", one]
        if chosen.get("pulse"):
            arguments += ["--pulse", chosen["pulse"].replace(" ", "")]
        return [*arguments, "-o", self._output, "--table", f"{self._stem}{TABLE}"]

    def _show_command(self) -> None:
        self._command.clear()
        if self._chosen.get("data"):
            with self._command:
                command_shown(self._arguments(), str(self._session.project.folder))

    def _start(self) -> None:
        with self._complaint.caught():
            self._session.jobs.start("calibrate", self._arguments())
            self._result.clear()

    async def _calibrated(self, job: Job) -> None:
        await self._show_calibration()

    async def _show_calibration(self) -> None:
        self._result.clear()
        if not self._chosen.get("data") or self._session.jobs.running("calibrate"):
            return
        name = self._output
        if not self._session.project.stamp(name):
            return
        with self._result:
            with ui.row().classes("items-center"):
                ui.label(name).classes("text-lg text-bold")
                table = f"{self._stem}{TABLE}"
                if self._session.project.stamp(table):
                    download_button(self._session, table, "Table (CSV)")
                download_button(self._session, name, "Calibration (JSON)")
            await self._questions(name)
            await show_result(self._session, self._complaint, "calibration", name)

    async def _questions(self, name: str) -> None:
        """Show what to set for a temperature, and what a bias or a power gives."""
        with ui.card().classes("w-full").props("flat bordered"):
            ui.label("What do I set?").classes("text-bold")
            asked = [_Question(self._session, name, along) for along in _ASKED]
        for one in asked:
            await one.answer()


class _Question:
    """A number that is asked, and its answer from the calibration."""

    def __init__(self, session: Session, name: str, along: str) -> None:
        self._session, self._name, self._along = session, name, along
        title, unit, start = _ASKED[along]
        with ui.row().classes("w-full items-center no-wrap"):
            value = session.chosen.setdefault("asked", {}).get(along, start)
            self._number = ui.number(f"For a {title} of", value=value, on_change=self.answer)
            self._number.props(f"dense outlined suffix={unit} debounce=150").classes("w-48")
            self._answer = ui.label().classes("remark").props("aria-live=polite")
            self._answer.props(f"data-answer={along}")

    async def answer(self) -> None:
        """Answer for the number that stands there."""
        value = self._number.value
        if value is None:
            self._answer.set_text("")
            return
        self._session.chosen["asked"][self._along] = value
        call, folder = f"{SHOWING}:settings", self._session.project.folder
        try:
            row = await self._session.full.call(call, folder, self._name, self._along, value)
        except HotleverError as error:
            self._answer.set_text(str(error))
            return
        self._answer.set_text("outside of what was calibrated" if row is None else _answer(row))


def _answer(row: dict[str, float]) -> str:
    low, high = row["tip_low_K"], row["tip_high_K"]
    return (
        f"set a bias of {row['bias_V']:.3f} V: lever {row['lever_V']:.3f} V, "
        f"{row['current_mA']:.4f} mA, {row['power_mW']:.3f} mW; tip {row['tip_K']:.0f} K "
        f"± {row['tip_stderr_K']:.0f} K (95 %: {low:.0f} to {high:.0f} K)"
    )
