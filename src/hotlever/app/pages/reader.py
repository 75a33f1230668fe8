"""Reader: a lever that reads its distance to a surface, which follows sliders."""

from __future__ import annotations

from typing import Any, ClassVar

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.drawn import probe_files
from hotlever.app.pages.frame import ErrorBanner
from hotlever.app.pages.live_page import LEAST_BIAS_V, LivePage
from hotlever.app.pages.reader_plots import ReaderPlots
from hotlever.app.session import Session

#: Distances of a table that is written.
_DISTANCES = 10
#: What is chosen of the surface, in words, unit, and what it is.
_OF_THE_SURFACE = (
    ("tilt_deg", "Tilt", "°", "surface_tilt_deg: of the surface; positive: the base is farther"),
    ("accommodation", "Accommodation", "", "for the temperature jump at surfaces, 0.01 to 1"),
)
_MOVING = (
    "moving: coarse lever, the air's temperature jumps as at the bias before: within some 5 %, and "
    "10 % for slope and resolution"
)
_AT_REST = (
    "coarse lever: voltage and resistance within some 0.1 %, the rest within 1 %, and 10 % where "
    "the voltage turns with the distance; the files below are of the full lever"
)


class ReaderPage(LivePage):
    """One tab of the page."""

    name, live = "reader", "approaching"
    # levers at some distances are kept in one process, which answers from them
    workers = "quick", "quick"
    numbers: ClassVar = {
        "resolution_nm_per_rtHz": ("resolution", "{:.3g} pm/√Hz", 1e3),
        "dlnR_dz_per_um": ("d ln R/dz", "{:.3g}·10⁻⁴/nm", 10.0),
        "dV_dz_V_per_um": ("dV/dz", "{:.3g} µV/nm", 1e3),
        "reader_V": ("voltage", "{:.4f} V", 1.0),
        "reader_ohm": ("resistance", "{:.1f} Ω", 1.0),
        "noise_V_per_rtHz": ("noise", "{:.3g} nV/√Hz", 1e9),
        "tip_K": ("tip", "{:.1f} K", 1.0),
    }
    state = ("distance_um",)

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner, ReaderPlots)

    def controls(self) -> None:
        """Ask for tilt and accommodation, of which each value needs other levers."""
        with ui.row().classes("w-full no-wrap gap-1"):
            for key, words, unit, hint in _OF_THE_SURFACE:
                field = self.number(key, words, unit, "as the file says")
                field.classes("col", remove="w-36").tooltip(hint)

    async def described(self) -> dict[str, Any]:
        """Return which distances there are, and what the file says of the surroundings."""
        asked = "approaching:described", self.chosen["probe"], self.chosen["tilt_deg"]
        answer: dict[str, Any] = await self.session.ask("quick", *asked)
        nearest, farthest = answer["nearest_um"], answer["farthest_um"]
        self.chosen["distance_um"] = min(max(self.chosen["distance_um"], nearest), farthest)
        return answer

    def show_sliders(self) -> None:
        """Show distance, bias and noise."""
        ends = self.of_file["nearest_um"], self.of_file["farthest_um"]
        below = "surface_gap_um: lower face of the lever to the surface, at the tip"
        self.slider("distance_um", "distance to the surface", *ends, "µm", below, by_decades=True)
        self.slider_of_bias(LEAST_BIAS_V)
        self.slider("amplifier_nV", "noise of the amplifier", 0.0, 20.0, "nV/√Hz")
        hooge = "of the silicon, for 1/f noise; none at the lowest"
        words = "Hooge's parameter"
        self.slider("hooge", words, 1e-8, 1e-3, "", hooge, by_decades=True, from_zero=True)

    def of_lever(self) -> Task:
        """Return the command of the reader at the bias, whatever the distance."""
        nearest, farthest = self.of_file["nearest_um"], self.of_file["farthest_um"]
        tilt, accommodation = self.chosen["tilt_deg"], self.chosen["accommodation"]
        changes = [f"surface_gap_um={nearest:.12g}"] if tilt is not None else []
        changes += [] if tilt is None else [f"surface_tilt_deg={tilt:.12g}"]
        changes += [] if accommodation is None else [f"accommodation={accommodation:.12g}"]
        options = {
            "distance": f"{nearest:.12g}um:{farthest:.12g}um:{_DISTANCES}",
            "medium": "air",
            "set": changes,
            "amplifier": f"{self.chosen['amplifier_nV']:.12g}nV",
            "hooge": self.chosen["hooge"] or None,
            "bias": f"{self.chosen['bias']:.12g}V",
        }
        return Task("reader", probe_files(self.chosen), options)

    def of_table(self, kind: str) -> dict[str, Any]:
        """Return nothing more: the table is of all distances."""
        return {}

    def said(self, answer: dict[str, Any], quick: bool) -> tuple[str, str]:
        """Return whose numbers these are, and where they are read."""
        return _MOVING if quick else _AT_REST, f"Read at the terminal {answer['read_at']}"
