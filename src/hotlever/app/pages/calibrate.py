"""Calibrate: an I-V curve in; what to set for a temperature, and how sure that is, out."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.frame import ErrorBanner, download_button, hand_over, small_button
from hotlever.app.pages.measured import MeasuredPage
from hotlever.app.pages.page import MEDIA, REFERENCE, DrawnPage, outputs, several
from hotlever.app.project import CALIBRATIONS
from hotlever.app.session import Session
from hotlever.errors import HotleverError
from hotlever.files import CALIBRATION, TABLE
from hotlever.materials.parameters import sentence
from hotlever.text import value_with_error

#: What a calibration rests on, and the option that says so.
_RESTS = {"probe": "probe", "fit": "fit", "law": "power_law"}
_QUANTITIES = {
    "tip_K": ("tip temperature", "K"),
    "bias_V": ("bias", "V"),
    "power_mW": ("power", "mW"),
}
#: What can be told: where the error counts, what the tip is to stay below, and what counts without.
_TEMPERATURES = {"at": ("Sure at", "hottest measured"), "stay_below": ("Stay below", "what melts")}


class CalibratePage(MeasuredPage):
    """One tab of the page."""

    name, kind, ending, folder = "calibrate", "calibration", CALIBRATION, CALIBRATIONS

    def options(self) -> None:
        """Show what the calibration rests on, and what is known beforehand."""
        project = self.session.project
        rests = {"probe:": REFERENCE}
        rests |= {f"probe:{name}": name for name in project.probes}
        rests |= {f"fit:{name}": f"fit {name}" for name in project.fits}
        rests |= {f"law:{name}": f"power law of {name}" for name in project.laws}
        self.choice("rests", "Rests on", rests)
        self.choice("medium", "Medium", MEDIA)
        self.text("priors", "Known beforehand (n_d=3.3e17±15%)")
        self.text("pulse", "For pulses too (5us or 5us,100us)")

    def understood(self) -> None:
        """Begin at once if who comes from a fit has asked for it."""
        if self.chosen.pop("run", False) and self.observables:
            self.start()

    @property
    def _table_file(self) -> str:
        return f"{self.stem}{TABLE}"

    def task(self) -> Task | None:
        """Return the task that makes the calibration."""
        chosen = self.chosen
        if not chosen["data"]:
            return None
        kind, _, name = chosen["rests"].partition(":")
        options = {
            _RESTS[kind]: name,
            "column": self.metadata["columns"],
            "medium": chosen["medium"],
            "prior": several(chosen["priors"]),
            "pulse": chosen["pulse"].replace(" ", ""),
            "output": self.output,
            "table": self._table_file,
        }
        return Task("calibrate", (chosen["data"],), options)

    async def show(self, name: str) -> None:
        """Show what to set for a temperature, and what a bias or a power gives, or why not."""
        with ui.row().classes("items-center"):
            ui.label(name).classes("text-lg text-bold")
            download_button(self.session, self._table_file, "Table (CSV)")
            download_button(self.session, name, "Calibration (JSON)")
            give = partial(self._give_budget, name)
            small_button("Uncertainty budget (one sheet)", give, icon="print")
        doubt: str | None = None
        with self.banner.caught():
            doubt = await self.session.ask("full", "showing:doubted", name)
        if doubt is None:
            return
        with ui.card().classes("w-full").props("flat bordered"):
            ui.label("What do I set?").classes("text-bold")
            if doubt:
                refusal = f"This calibration does not tell. {sentence(doubt)}"
                ui.label(refusal).classes("remark").props("data-answer=none")
                return
            questions = [_Question(self.session, name, along) for along in _QUANTITIES]
        Proposals(self.session, self.banner, name, self.stem)
        for question in questions:
            await question.answer()

    async def _give_budget(self, name: str) -> None:
        """Hand over the uncertainty budget, to print it."""
        with self.banner.caught():
            page = self.session.ask("full", "showing:budget", name)
            await hand_over(page, f"{self.stem}-budget.html")


class _Question:
    """A number that is asked, and its answer from the calibration."""

    def __init__(self, session: Session, name: str, along: str) -> None:
        self._session, self._name, self._along = session, name, along
        self._targets = session.choices("asked")
        title, unit = _QUANTITIES[along]
        with ui.row().classes("w-full items-center"):
            value = self._targets[along]
            self._number = ui.number(f"For a {title} of", value=value, on_change=self.answer)
            self._number.props(f"suffix={unit} debounce=150").classes("w-60")
            self._answer = ui.label().classes("remark col min-w-60").props("aria-live=polite")
            self._answer.props(f"data-answer={along}")

    async def answer(self) -> None:
        """Answer for the number that stands there."""
        value, text = self._number.value, ""
        if value is not None:
            self._targets[self._along] = value
            try:
                arguments = self._name, self._along, value
                row = await self._session.ask("full", "showing:settings", *arguments)
                text = (
                    "outside of what was calibrated, or in a jump" if row is None else _answer(row)
                )
            except HotleverError as error:
                text = str(error)
        self._answer.set_text(text)


def _answer(row: dict[str, float]) -> str:
    low, high = row["tip_low_K"], row["tip_high_K"]
    apex = ""
    if "apex_K" in row:
        apex = f", apex {value_with_error(row['apex_K'], row['apex_stderr_K'])} K"
    return (
        f"set a bias of {row['bias_V']:.3f} V: lever {row['lever_V']:.3f} V, "
        f"{row['current_mA']:.4f} mA, {row['power_mW']:.3f} mW; tip "
        f"{value_with_error(row['tip_K'], row['tip_stderr_K'])} K "
        f"(95 %: {low:.0f} to {high:.0f} K){apex}"
    )


class Proposals(DrawnPage):
    """A card in the element that is open, of a calibration file; what it makes begins with a stem.

    Each calibration has proposals of its own.
    """

    name = "next"
    alt = "Error by temperature now and after more measurements; tip temperature by bias"
    kinds: ClassVar = {kind: text for kind, text in DrawnPage.kinds.items() if kind != "NetCDF"}

    def __init__(self, session: Session, banner: ErrorBanner, calibration: str, stem: str) -> None:
        super().__init__(session, banner)
        self.name, self._calibration, self._stem = f"next {calibration}", calibration, stem
        with ui.card().classes("w-full").props("flat bordered data-proposals"):
            ui.label("What do I measure next?").classes("text-bold")
            with ui.row().classes("w-full items-center"):
                for key, (title, empty) in _TEMPERATURES.items():
                    self.number(key, title, "K", empty).classes("w-44", remove="w-36")
                ui.space()
                ui.button("Propose", icon="add_location_alt", on_click=self.start)
            self.show_result()
        self.show_command()

    def task(self) -> Task:
        """Return the task that writes the proposals as a table and a figure."""
        temperatures = {key: self.chosen[key] for key in _TEMPERATURES}
        kelvins = {key: "" if T is None else f"{T:.12g}K" for key, T in temperatures.items()}
        files = outputs(f"{self._stem}.next", "SVG")
        return Task("next", (self._calibration,), {**kelvins, **files})
