"""Contact: a tip that touches a sample, which follows sliders."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.contact_plots import ContactPlots
from hotlever.app.pages.drawn import probe_files
from hotlever.app.pages.frame import ErrorBanner, flat_button
from hotlever.app.pages.live_page import LEAST_BIAS_V, LivePage
from hotlever.app.pages.page import MEDIA
from hotlever.app.pages.sample import SampleLayers
from hotlever.app.session import Session

#: Biases of a table that is written.
_BIASES = 25
#: Sliders: what is chosen, in words, ends, unit, and the name in files.
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
_RESISTANCES = {
    "tip_K_per_mW": "cone",
    "interface_K_per_mW": "interface",
    "spreading_K_per_mW": "spreading in the sample",
}
_MOVING = (
    "moving: coarse lever, within some 2 K, 10 K near the knee; changes within some 10 % unless "
    "they are about to turn"
)
_AT_REST = "full lever: the numbers of hotlever contact"


class ContactPage(LivePage):
    """One tab of the page."""

    name, live = "contact", "touching"
    numbers: ClassVar = {
        "tip_K": ("tip at the lever", "{:.1f} K", 1.0),
        "apex_K": ("apex", "{:.1f} K", 1.0),
        "sample_mW": ("heat into the sample", "{:.3g} µW", 1e3),
        "tip_change_K": ("the contact changes the tip by", "{:.3g} K", 1.0),
        "current_change_mA": ("and the current I_h by", "{:.3g} µA", 1e3),
    }
    state = ("bias", "most")

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner, ContactPlots)

    def controls(self) -> None:
        """Ask for what is around the lever."""
        media = {name: words for name, words in MEDIA.items() if name != "unknown"}
        self.choice("medium", "Around it", {**media, "": "as the probe file says"})

    async def described(self) -> dict[str, Any]:
        """Return radius, interface and sample of the probe's file."""
        asked = "touching:described", self.chosen["probe"]
        answer: dict[str, Any] = await self.session.ask("quick", *asked)
        return answer

    def show_sliders(self) -> None:
        """Show bias, radius, interface, and the layers of the sample."""
        self.slider_of_bias(LEAST_BIAS_V)
        for key, words, ends, unit, hint in _OF_THE_CONTACT:
            zero = key == "interface"
            self.slider(key, words, *ends, unit, hint, by_decades=True, from_zero=zero)
        ui.label("Sample, from the top").classes("text-bold")
        SampleLayers(lambda text: self.set_value("sample", text)).show(self.value("sample"))
        flat_button("All as in the probe file", self._reset, icon="restart_alt")

    async def _reset(self) -> None:
        self.chosen |= {"sample": "", "radius_nm": None, "interface": None}
        await self.open()

    def of_lever(self) -> Task:
        """Return the command of the contact, whatever the bias."""
        radius, interface = self.chosen["radius_nm"], self.chosen["interface"]
        options = {
            "sample": self.value("sample"),
            "radius": "" if radius is None else f"{radius:.12g}nm",
            "interface": "" if interface is None else f"{interface:.12g}K/W",
            "medium": self.chosen["medium"],
        }
        return Task("contact", probe_files(self.chosen), options)

    def of_table(self, kind: str) -> dict[str, Any]:
        """Return the biases of a table."""
        most = self.chosen["most"]
        return {"bias": f"{most / _BIASES:.12g}:{most:.12g}:{_BIASES}"}

    def said(self, answer: dict[str, Any], quick: bool) -> tuple[str, str]:
        """Return whose numbers these are, and the resistances."""
        now = answer["now"]
        shown = (f"{words} {_per_watt(now[key])}" for key, words in _RESISTANCES.items())
        return _MOVING if quick else _AT_REST, f"Thermal resistances: {', '.join(shown)}"


def _per_watt(resistance_K_per_mW: float) -> str:
    if math.isnan(resistance_K_per_mW):
        return "not known without heat"
    return f"{1e3 * resistance_K_per_mW:.3g} K/W" if resistance_K_per_mW else "none"
