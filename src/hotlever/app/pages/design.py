"""Design: what a change of one or two numbers of a probe does."""

from __future__ import annotations

from collections.abc import Awaitable
from functools import partial
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.chosen_lever import probe_files, stem
from hotlever.app.pages.frame import ErrorBanner, caption, two_columns
from hotlever.app.pages.page import DrawnPage, outputs
from hotlever.app.session import Session
from hotlever.errors import InputError
from hotlever.materials.parameters import label
from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S

_ABOUT = "Each value is a lever that is solved, in air too for k: some seconds each."
#: How the silicon was annealed whose Δ the probe has: label, unit, and what counts without.
_ANNEALING = {
    "annealing_K": ("Annealed at", "K", ANNEALING_K),
    "annealing_min": ("for", "min", ANNEALING_S / 60.0),
}
#: Shares of a value between which it is varied at first.
_FROM, _TO = 0.7, 1.4


class DesignPage(DrawnPage):
    """One tab of the page."""

    name = "design"
    alt = "Knee, tip temperature and loss to air by design"

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        self._values: dict[str, float] = {}
        self._probe: str | None = None
        with two_columns() as (left, right):
            with left:
                self.probe_choice()
                self._picked = {key: self._varied(key) for key in ("first", "second")}
                self.number("power", "Tip temperature at", "mW")
                with ui.row().classes("w-full no-wrap gap-1") as self._annealing:
                    for key, (words, unit, usual) in _ANNEALING.items():
                        field = self.number(key, words, unit, f"{usual:g}")
                        field.classes("col", remove="w-36")
                meaning = "The power of the knee in air over that in vacuum"
                self.checkbox("air", "in air too", meaning)
                ui.button("Vary", icon="insights", on_click=self.start).classes("w-full")
                caption(_ABOUT)
            with right:
                self.show_result()
        self.show_command()

    def _varied(self, key: str) -> dict[str, Any]:
        """Ask for a number of the probe, and for its values."""
        title = "Vary" if key == "first" else "and, as a map"
        name = ui.select({}, label=title, with_input=True, clearable=key == "second")
        name.classes("w-full").on_value_change(partial(self._pick, key))
        with ui.row().classes("w-full no-wrap gap-1") as row:
            ends = {end: self.number(f"{key}_{end}", end) for end in ("from", "to", "count")}
            for field in ends.values():
                field.classes("col", remove="w-36")
        row.bind_visibility_from(name, "value", backward=bool)
        return {"name": name, **ends}

    async def open(self) -> None:
        """Offer the numbers of the probe."""
        with self.banner.caught():
            self._probe = probe = self.chosen["probe"]
            self._values = await self.session.ask("full", "showing:design_numbers", probe)
        self._annealing.set_visibility(bool(_ANNEALING.keys() & self._values.keys()))
        for key, fields in self._picked.items():
            chosen = self.chosen[key]
            names = [*self._values, *([chosen] if chosen else [])]
            options = {name: label(name) for name in names}
            fields["name"].set_options(options, value=chosen)

    def changed(self) -> Awaitable[None] | None:
        """Offer the numbers of another probe."""
        self.show_command()
        return self.open() if self.chosen["probe"] != self._probe else None

    def _pick(self, key: str, event: Any) -> None:
        """Vary another number, about its value in the probe."""
        if event.value == self.chosen[key]:
            return
        self.chosen[key] = event.value
        if event.value in self._values:
            value = self._values[event.value]
            self._picked[key]["from"].set_value(float(f"{_FROM * value:.3g}"))
            self._picked[key]["to"].set_value(float(f"{_TO * value:.3g}"))
        self.show_command()

    def _texts(self) -> list[str]:
        texts = []
        for key in self._picked:
            if name := self.chosen[key]:
                ends = [self.chosen[f"{key}_{end}"] for end in ("from", "to", "count")]
                if None in ends:
                    raise InputError(f"{name}: expected the first and the last value, and a count")
                texts.append(f"{name}={ends[0]:.12g}:{ends[1]:.12g}:{ends[2]:g}")
        if not texts:
            raise InputError("choose what is varied")
        return texts

    def task(self) -> Task:
        """Return the task that varies the design, and writes table and figure."""
        options = {"vary": self._texts(), "power": self.chosen["power"]}
        options |= {key: self.chosen[key] for key in _ANNEALING}
        options |= {"no_air": not self.chosen["air"]}
        files = outputs(f"{stem(self.chosen)}.design", "SVG")
        return Task("design", probe_files(self.chosen), {**options, **files})
