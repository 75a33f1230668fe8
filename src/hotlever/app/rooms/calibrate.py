"""Calibrate: an I-V curve in; what to set for a temperature, and how sure that is, out."""

from __future__ import annotations

from nicegui import ui

from hotlever.app.jobs import named
from hotlever.app.project import CALIBRATION, TABLE
from hotlever.app.rooms.measured import MeasuredRoom
from hotlever.app.rooms.results import SHOWING, download_button
from hotlever.app.rooms.room import MEDIA, REFERENCE, choice, field, several
from hotlever.app.session import Session
from hotlever.errors import HotleverError
from hotlever.materials.parameters import sentence
from hotlever.text import value_with_error

#: What a calibration rests on: the option of the command, and what it is called.
_RESTS = {"probe": "--probe", "fit": "--fit", "law": "--power-law"}
_ASKED = {
    "tip_K": ("tip temperature", "K", 600.0),
    "bias_V": ("bias", "V", 8.0),
    "power_mW": ("power", "mW", 2.0),
}


class CalibrateRoom(MeasuredRoom):
    """One tab of the room."""

    name, kind, ending = "calibrate", "calibration", CALIBRATION
    button, icon = "Calibrate", "straighten"

    def options(self) -> None:
        """Show what the calibration rests on, and what is known beforehand."""
        project, chosen = self.session.project, self.chosen
        rests = {"probe:": REFERENCE}
        rests |= {f"probe:{name}": name for name in project.probes}
        rests |= {f"fit:{name}": f"fit {name}" for name in project.fits}
        rests |= {f"law:{name}": f"power law of {name}" for name in project.laws}
        self._rests = choice("Rests on", rests, chosen.get("rests"), self._choose)
        chosen["rests"] = self._rests.value
        self._medium = choice("Medium", MEDIA, chosen.get("medium", ""), self._choose)
        known = "Known beforehand (n_d=3.3e17±15%)"
        self._priors = field(known, chosen.get("priors", ""), self._choose)
        pulses = "For pulses too (5us or 5us,100us)"
        self._pulse = field(pulses, chosen.get("pulse", ""), self._choose)

    def _choose(self) -> None:
        self.chosen |= {"rests": self._rests.value, "medium": self._medium.value}
        self.chosen |= {"priors": self._priors.value, "pulse": self._pulse.value}
        self.show_command()

    def understood(self) -> None:
        """Begin at once if who comes from a fit has asked for it."""
        if self.chosen.pop("run", False) and self.has:
            self.start()

    @property
    def _table_file(self) -> str:
        return f"{self.stem}{TABLE}"

    def arguments(self) -> list[str]:
        """Return the command that makes the calibration."""
        chosen = self.chosen
        if not chosen.get("data"):
            return []
        arguments = ["calibrate", named(chosen["data"])]
        kind, _, name = chosen["rests"].partition(":")
        if name:
            arguments += [_RESTS[kind], named(name)]
        arguments += self.column_options()
        if chosen.get("medium"):
            arguments += ["--medium", chosen["medium"]]
        arguments += several("--prior", chosen.get("priors"))
        if chosen.get("pulse"):
            arguments += ["--pulse", chosen["pulse"].replace(" ", "")]
        return [*arguments, "-o", self.output, "--table", self._table_file]

    async def show(self, name: str) -> None:
        """Show what to set for a temperature."""
        with ui.row().classes("items-center"):
            ui.label(name).classes("text-lg text-bold")
            if self.session.project.stamp(self._table_file):
                download_button(self.session, self._table_file, "Table (CSV)")
            download_button(self.session, name, "Calibration (JSON)")
        await self._questions(name)

    async def _questions(self, name: str) -> None:
        """Show what to set for a temperature, and what a bias or a power gives, or why not."""
        doubt: str | None = None
        with self.complaint.caught():
            call, folder = f"{SHOWING}:doubted", self.session.project.folder
            doubt = await self.session.full.call(call, folder, name)
        if doubt is None:
            return
        with ui.card().classes("w-full").props("flat bordered"):
            ui.label("What do I set?").classes("text-bold")
            if doubt:
                said = f"This calibration does not tell. {sentence(doubt)}"
                ui.label(said).classes("remark").props("data-answer=none")
                return
            asked = [_Question(self.session, name, along) for along in _ASKED]
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
        f"{row['current_mA']:.4f} mA, {row['power_mW']:.3f} mW; tip "
        f"{value_with_error(row['tip_K'], row['tip_stderr_K'])} K (95 %: {low:.0f} to {high:.0f} K)"
    )
