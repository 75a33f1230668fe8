"""The lever of the page Simulate under small signals, or its harmonics."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.drawn import DrawnPage, in_python, probe_files, settings, stem
from hotlever.app.pages.frame import ErrorBanner, caption
from hotlever.app.pages.page import outputs
from hotlever.app.session import Session
from hotlever.errors import InputError

_ABOUT = (
    "Impedance at the bias of the lever, and how its tip follows power and bias; with an amplitude "
    "the harmonics of the lever voltage (3ω method)."
)


class SmallSignals(DrawnPage):
    """What the lever shows under small signals, as `hotlever spectrum` computes it."""

    name = "signals"
    alt = "Impedance, and how the tip follows, against the frequency"

    def __init__(self, session: Session, banner: ErrorBanner, lever: dict[str, Any]) -> None:
        super().__init__(session, banner)
        self._lever = lever
        with ui.card().classes("w-full").props("flat bordered"):
            caption(_ABOUT)
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
        files = outputs(f"{stem(self._lever)}.spectrum", "SVG")
        probe = probe_files(self._lever)
        return Task("spectrum", probe, {**options, **settings(self._lever), **files})

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
