"""Contact: a tip that touches a sample, which follows sliders."""

from __future__ import annotations

import math
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.contact_plots import ContactPlots
from hotlever.app.pages.drawn import probe_files, stem
from hotlever.app.pages.following import Follower, slider
from hotlever.app.pages.frame import (
    ErrorBanner,
    caption,
    flat_button,
    number_shown,
    two_columns,
)
from hotlever.app.pages.page import KINDS, MEDIA, Page, Work, outputs
from hotlever.app.pages.sample import SampleLayers
from hotlever.app.session import Session
from hotlever.errors import HotleverError

#: Biases of a table that is written.
_BIASES = 25
#: Sliders: what is chosen, in words, ends, unit, and the name in files; the lowest bias (V).
_OF_THE_CONTACT = (
    ("radius_nm", "radius of the contact", (1.0, 1000.0), "nm", "apex_radius_um: of the flat end"),
    (
        "interface",
        "resistance of the interface",
        (1e4, 1e10),
        "K/W",
        "interface_K_per_mW: thermal resistance between apex and sample, a thousandth of this",
    ),
)
_LEAST_BIAS = 0.1
_NUMBERS = {
    "tip_K": ("tip at the lever", "{:.1f} K", 1.0),
    "apex_K": ("apex", "{:.1f} K", 1.0),
    "sample_mW": ("heat into the sample", "{:.3g} µW", 1e3),
    "tip_change_K": ("the contact changes the tip by", "{:.3g} K", 1.0),
    "current_change_mA": ("and the current I_h by", "{:.3g} µA", 1e3),
}
_RESISTANCES = {
    "tip_K_per_mW": "cone",
    "interface_K_per_mW": "interface",
    "spreading_K_per_mW": "spreading in the sample",
}
_MOVING = "moving: coarse lever, within some 2 K, changes within some 10 %"
_AT_REST = "full lever: the numbers of hotlever contact"


class ContactPage(Page):
    """One tab of the page."""

    name = "contact"

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        #: What the probe's file says of the contact, or what is usual.
        self._of_file: dict[str, Any] = {}
        with two_columns("live") as (left, right):
            with left:
                self.probe_choice()
                media = {name: words for name, words in MEDIA.items() if name != "unknown"}
                self.choice("medium", "Around it", {**media, "": "as the probe file says"})
                self._sliders = ui.column().classes("w-full gap-1")
            with right, ui.column().classes("w-full gap-3 parts"):
                with ui.row().classes("w-full items-end gap-6 numbers"):
                    self._numbers = {
                        key: number_shown(key, title) for key, (title, *_) in _NUMBERS.items()
                    }
                self._model = caption("starting").props("aria-live=polite")
                self._remarks = ui.label().classes("text-sm remark")
                with ui.column().classes("w-full gap-1") as self._drawn:
                    self._plots = ContactPlots()
                with ui.card().classes("w-full last").props("flat bordered"):
                    ui.label("Take it with you").classes("text-bold")
                    self.kind_buttons(
                        lambda kind: self.run(self._sweep(kind)),
                        {kind: words for kind, words in KINDS.items() if kind != "VTU"},
                    )
                    Work(session, self.name, self.give)
                    self.command()
        self._follower = Follower(self._model, self._show)

    async def open(self) -> None:
        """Show the sliders of the probe, and so the first state."""
        with self.banner.caught():
            probe = self.chosen["probe"]
            self._of_file = await self.session.ask("quick", "touching:described", probe)
            self._sliders.clear()
            with self._sliders:
                self._show_sliders()
            self._moved()
            return
        self._blank()

    async def changed(self) -> None:
        """Show another probe or medium."""
        await self.open()

    def _show_sliders(self) -> None:
        chosen, most = self.chosen, self.chosen["most"]
        bias = slider("Bias V_b", chosen["bias"], _LEAST_BIAS, most, "V")
        bias.on_value_change(lambda event: self._set("bias", event.value))
        for key, words, ends, unit, hint in _OF_THE_CONTACT:
            options: Any = {"by_decades": True, "from_zero": key == "interface"}
            number = slider(words, self._value(key), *ends, unit, hint, **options)
            number.on_value_change(lambda event, key=key: self._set(key, event.value))
        ui.label("Sample, from the top").classes("text-bold")
        SampleLayers(lambda text: self._set("sample", text)).show(self._value("sample"))
        flat_button("All as in the probe file", self._reset, icon="restart_alt")

    async def _reset(self) -> None:
        self.chosen |= {"sample": "", "radius_nm": None, "interface": None}
        await self.open()

    def _value(self, key: str) -> Any:
        """Return what is chosen, or what the probe's file says."""
        chosen = self.chosen[key]
        return self._of_file[key] if chosen in (None, "") else chosen

    def _set(self, key: str, value: Any) -> None:
        if value is None:
            return
        self.chosen[key] = value
        if key == "bias" and value > self.chosen["most"]:
            self.chosen["most"] = float(math.ceil(value))
        self._moved()

    def _moved(self) -> None:
        self.show_command()
        at = {key: self.chosen[key] for key in ("bias", "most")}
        self._follower.follow(self._touching(), at)

    def _touching(self) -> Task:
        """Return the command of the contact, whatever the bias."""
        radius, interface = self.chosen["radius_nm"], self.chosen["interface"]
        options = {
            "sample": self._value("sample"),
            "radius": "" if radius is None else f"{radius:g}nm",
            "interface": "" if interface is None else f"{interface:g}K/W",
            "medium": self.chosen["medium"],
        }
        return Task("contact", probe_files(self.chosen), options)

    def task(self) -> Task | None:
        """Return the task that writes the table of a range of bias."""
        return self._sweep("CSV") if self._of_file else None

    def _sweep(self, kind: str) -> Task:
        task, most = self._touching(), self.chosen["most"]
        options = {"bias": f"{most / _BIASES:g}:{most:g}:{_BIASES}", **task.options}
        files = outputs(f"{stem(self.chosen)}.contact", kind)
        return Task(task.command, task.files, {**options, **files})

    async def _show(self, task: Task, at: dict[str, float], quick: bool) -> bool:
        worker, notes = "quick" if quick else "full", dict[str, None]()

        def heard(kind: str, content: Any) -> None:
            if kind == "note" and content:
                notes[content] = None

        try:
            asked = task, at["bias"], at["most"], quick
            answer = await self.session.ask(worker, "touching:answer", *asked, heard=heard)
        except HotleverError as error:
            if not self._model.is_deleted:
                self._blank()
                self.banner.say(str(error))
            return False
        if self._model.is_deleted or (not quick and not self._follower.is_wanted(task)):
            return False
        self.banner.clear()
        now = answer["now"]
        for key, (_, form, factor) in _NUMBERS.items():
            self._numbers[key].set_text(form.format(factor * now[key]))
        shown = (f"{words} {_per_watt(now[key])}" for key, words in _RESISTANCES.items())
        self._remarks.set_text("; ".join([f"Thermal resistances: {', '.join(shown)}", *notes]))
        self._model.set_text(_MOVING if quick else _AT_REST)
        self._drawn.set_visibility(True)
        self._plots.show(answer)
        return True

    def _blank(self) -> None:
        """Show no numbers where there are none: the last ones were of another state."""
        for number in self._numbers.values():
            number.set_text("–")
        self._model.set_text("no state is shown")
        self._remarks.set_text("")
        self._drawn.set_visibility(False)


def _per_watt(resistance_K_per_mW: float) -> str:
    if math.isnan(resistance_K_per_mW):
        return "not known without heat"
    return f"{1e3 * resistance_K_per_mW:.3g} K/W" if resistance_K_per_mW else "none"
