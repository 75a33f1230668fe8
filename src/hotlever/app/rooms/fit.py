"""Fit: a measurement in, material parameters with their errors out."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from hotlever.app.jobs import named
from hotlever.app.project import FIT, FITS
from hotlever.app.rooms.measured import MeasuredRoom
from hotlever.app.rooms.results import download_button
from hotlever.app.rooms.room import MEDIA, choice, field, several

_OBSERVABLES = {"current": "current I_h", "reader": "reader V_r", "tip": "tip temperature"}
_OPTIONS = {
    "robust": ("robust", "Lessen the weight of points far off the others"),
    "drift": ("drifting zeros", "Let the zeros of I_h and V_r drift along the file"),
    "profiles": ("profiles", "Profile the likelihood of each parameter (some 10 s, on a page)"),
    "posterior": ("posterior", "Sample the posterior (half a minute, on a page of its own)"),
}


class FitRoom(MeasuredRoom):
    """One tab of the room."""

    name, kind, ending = "fit", "fit", FIT
    button, icon = "Fit", "query_stats"
    tellable = ("columns", "waveform")

    def options(self) -> None:
        """Show what is fitted, and how."""
        self.probe_choice()
        chosen = self.chosen
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
            self._medium = choice("Medium", MEDIA, chosen.get("medium", ""), self._choose)
            self._fixed = field("Hold (n_d=3.3e17, p)", chosen.get("fixed", ""), self._choose)
            pulse = "Pulse of a file in time (10V,20us)"
            self._waveform = field(pulse, self.told.get("waveform", ""), self._tell_waveform)
            self._waveform.props("debounce=600")
            self._free = field("Vary too (film.tcr)", chosen.get("free", ""), self._choose)
            known = "Known beforehand (n_d=3.3e17±15%)"
            self._priors = field(known, chosen.get("priors", ""), self._choose)

    def _choose(self) -> None:
        boxes = self._observables.items()
        self.chosen["without"] = [name for name, box in boxes if not box.value]
        self.chosen |= {name: box.value for name, box in self._flags.items()}
        self.chosen |= {"medium": self._medium.value, "fixed": self._fixed.value}
        self.chosen |= {"free": self._free.value, "priors": self._priors.value}
        self.show_command()

    async def _tell_waveform(self, event: Any) -> None:
        waveform = (event.value or "").replace(" ", "")
        if waveform != self.told.get("waveform", ""):  # typed, and not shown for another file
            self.told["waveform"] = waveform
            await self.read()

    def show_told(self) -> None:
        """Show what was told of the measurement that is chosen."""
        super().show_told()
        self._waveform.set_value(self.told.get("waveform", ""))

    def understood(self) -> None:
        """Offer what was measured."""
        for name, box in self._observables.items():
            box.set_visibility(name in self.has)

    def arguments(self) -> list[str]:
        """Return the command that makes the fit."""
        chosen = self.chosen
        if not chosen.get("data"):
            return []
        arguments = ["fit", named(chosen["data"])]
        if chosen.get("probe"):
            arguments += ["--probe", named(chosen["probe"])]
        kept = [name for name in self.has if name not in chosen.get("without", [])]
        if kept != self.has:
            arguments += ["--observables", ",".join(kept)]
        arguments += self.column_options()
        arguments += several("--fix", chosen.get("fixed"))
        if self.told.get("waveform"):
            arguments += ["--pulse", self.told["waveform"]]
        if chosen.get("free"):
            arguments += ["--free", chosen["free"].replace(" ", "")]
        arguments += several("--prior", chosen.get("priors"))
        if chosen.get("medium"):
            arguments += ["--medium", chosen["medium"]]
        flags = [name for name in _OPTIONS if chosen.get(name)]
        arguments += [f"--{name}" for name in flags] + ["-o", self.output]
        if {"profiles", "posterior"} & set(flags):
            arguments += ["--report", self._report]
        return arguments

    @property
    def _report(self) -> str:
        return f"{self.stem}-report"

    def results(self) -> list[str]:
        """Return where a fit may lie: of this measurement alone, or one among many levers."""
        return [self.output, f"{FITS}/{self.stem}.json"]

    async def show(self, name: str) -> None:
        """Show where to go on with the fit."""
        with ui.row().classes("items-center"):
            ui.label(name).classes("text-lg text-bold")
            on = ui.button("Calibrate with this fit", icon="straighten").props("no-caps dense")
            on.classes("q-px-sm").on_click(lambda: self._calibrate(name))
            download_button(self.session, name, "Fit (JSON)")
            page = f"{self._report}/index.html"
            if self.session.project.stamp(page):
                download_button(self.session, page, "Page (HTML)")

    def _calibrate(self, name: str) -> None:
        rest = {"data": self.chosen["data"], "rests": f"fit:{name}", "run": True}
        self.session.chosen.setdefault("calibrate", {}).update(rest)
        ui.navigate.to("/calibrate")
