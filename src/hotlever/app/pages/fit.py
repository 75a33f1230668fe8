"""Fit: a measurement in, material parameters with their errors out."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.frame import download_button
from hotlever.app.pages.measured import MeasuredPage
from hotlever.app.pages.page import MEDIA, several
from hotlever.app.project import FIT, FITS
from hotlever.quantities import FITTED

_FLAGS = {
    "robust": ("robust", "Lessen the weight of points far off the others"),
    "drift": ("drifting zeros", "Let the zeros of I_h, V_r and V_bridge drift along the file"),
    "profiles": ("profiles", "Profile the likelihood of each parameter (some 10 s, on a page)"),
    "posterior": ("posterior", "Sample the posterior (half a minute, on a page of its own)"),
}
_PULSE = "Pulse of a file in time (10V,20us)"


class FitPage(MeasuredPage):
    """One tab of the page."""

    name, kind, ending, folder = "fit", "fit", FIT, FITS
    tellable = ("columns", "waveform")

    def options(self) -> None:
        """Show what is fitted, and how."""
        self.probe_choice()
        with ui.column().classes("gap-0"):
            ui.label("Fitted").classes("text-sm text-bold")
            self._boxes = {}
            for name, measurand in FITTED.items():
                label, fitted = f"{name} {measurand.symbol}", name not in self.chosen["without"]
                self._boxes[name] = ui.checkbox(label, value=fitted, on_change=self._choose)
        with ui.expansion("More"):
            for name, (label, meaning) in _FLAGS.items():
                self.checkbox(name, label, meaning)
            self.choice("medium", "Medium", MEDIA)
            self.text("fixed", "Hold (n_d=3.3e17, p)")
            self._waveform = ui.input(
                _PULSE,
                value=self.metadata["waveform"],
                on_change=lambda event: self.tell("waveform", (event.value or "").replace(" ", "")),
            )
            self._waveform.classes("w-full").props("debounce=600")
            self.text("free", "Vary too (film.tcr)")
            self.text("priors", "Known beforehand (n_d=3.3e17±15%)")

    def _choose(self) -> None:
        self.chosen["without"] = [name for name, box in self._boxes.items() if not box.value]
        self.show_command()

    def show_metadata(self) -> None:
        """Show what was told of the measurement that is chosen."""
        super().show_metadata()
        self._waveform.set_value(self.metadata["waveform"])

    def understood(self) -> None:
        """Offer what was measured."""
        for name, box in self._boxes.items():
            box.set_visibility(name in self.observables)

    def task(self) -> Task | None:
        """Return the task that makes the fit."""
        chosen = self.chosen
        if not chosen["data"]:
            return None
        fitted = [name for name in self.observables if name not in chosen["without"]]
        options: dict[str, Any] = {
            "probe": chosen["probe"],
            "observables": "" if fitted == self.observables else ",".join(fitted),
            "column": self.metadata["columns"],
            "fix": several(chosen["fixed"]),
            "pulse": self.metadata["waveform"],
            "free": chosen["free"].replace(" ", ""),
            "prior": several(chosen["priors"]),
            "medium": chosen["medium"],
            **{name: chosen[name] for name in _FLAGS},
            "output": self.output,
            "report": self._report if chosen["profiles"] or chosen["posterior"] else "",
        }
        return Task("fit", (chosen["data"],), options)

    @property
    def _report(self) -> str:
        return f"{self.stem}-report"

    async def show(self, name: str) -> None:
        """Show where to go on with the fit."""
        with ui.row().classes("items-center"):
            ui.label(name).classes("text-lg text-bold")
            on = ui.button("Calibrate with this fit", icon="straighten").props("dense")
            on.classes("q-px-sm").on_click(lambda: self._calibrate(name))
            download_button(self.session, name, "Fit (JSON)")
            download_button(self.session, f"{self._report}/index.html", "Page (HTML)")

    def _calibrate(self, name: str) -> None:
        chosen = {"data": self.chosen["data"], "rests": f"fit:{name}", "run": True}
        self.session.chosen.setdefault("calibrate", {}).update(chosen)
        ui.navigate.to("/calibrate")
