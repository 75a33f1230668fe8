"""Reader: a lever that reads its distance to a surface, which follows sliders."""

from __future__ import annotations

from typing import Any, ClassVar

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.drawn import probe_files
from hotlever.app.pages.frame import ErrorBanner
from hotlever.app.pages.live_page import LiveTaskPage
from hotlever.app.pages.reader_plots import ReaderPlots
from hotlever.app.session import Session
from hotlever.app.workers import Heard

#: Distances of a table that is written.
_DISTANCES = 10
#: What is chosen of the surface, in words, unit, and what it is.
_OF_THE_SURFACE = (
    ("tilt_deg", "Tilt", "°", "surface_tilt_deg: of the surface; positive: the base is farther"),
    ("accommodation", "Accommodation", "", "for the temperature jump at surfaces, 0.01 to 1"),
)
_MODEL = (
    "coarse lever: voltage and resistance within some 0.1 %, the rest within 1 %, and 10 % where "
    "the voltage turns with the distance; the files below are of the full lever"
)


class ReaderPage(LiveTaskPage):
    """One tab of the page."""

    name = "reader"
    numbers: ClassVar = {
        "resolution_nm_per_rtHz": ("resolution", "{:.3g} pm/√Hz", 1e3),
        "dlnR_dz_per_um": ("d ln R/dz", "{:.3g}·10⁻⁴/nm", 10.0),
        "dV_dz_V_per_um": ("dV/dz", "{:.3g} µV/nm", 1e3),
        "reader_V": ("voltage", "{:.4f} V", 1.0),
        "reader_ohm": ("resistance", "{:.1f} Ω", 1.0),
        "noise_V_per_rtHz": ("noise", "{:.3g} nV/√Hz", 1e9),
        "tip_K": ("tip", "{:.1f} K", 1.0),
    }
    state = ("bias", "distance_um")

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
        self.slider_of_bias()
        self.slider("amplifier_nV", "noise of the amplifier", 0.0, 20.0, "nV/√Hz")
        hooge = "of the silicon, for 1/f noise; none at the lowest"
        words = "Hooge's parameter"
        self.slider("hooge", words, 1e-8, 1e-3, "", hooge, by_decades=True, from_zero=True)

    def of_lever(self) -> Task:
        """Return the command of the reader, whatever bias and distance."""
        nearest, farthest = self.of_file["nearest_um"], self.of_file["farthest_um"]
        tilt, accommodation = self.chosen["tilt_deg"], self.chosen["accommodation"]
        changes = [f"surface_gap_um={nearest:g}"] if tilt is not None else []
        changes += [] if tilt is None else [f"surface_tilt_deg={tilt:g}"]
        changes += [] if accommodation is None else [f"accommodation={accommodation:g}"]
        options = {
            "distance": f"{nearest:g}um:{farthest:g}um:{_DISTANCES}",
            "medium": "air",
            "set": changes,
            "amplifier": f"{self.chosen['amplifier_nV']:g}nV",
            "hooge": self.chosen["hooge"] or None,
        }
        return Task("reader", probe_files(self.chosen), options)

    def of_table(self, task: Task) -> dict[str, Any]:
        """Return the bias of a table."""
        return {"bias": f"{self.chosen['bias']:g}:{self.chosen['bias']:g}:1"}

    async def ask(self, lever: Task, at: list[float], quick: bool, heard: Heard) -> dict[str, Any]:
        """Return what the reader shows; levers are solved in one process, be it quick or not."""
        asked = "quick", "approaching:answer"
        answer: dict[str, Any] = await self.session.ask(*asked, lever, *at, heard=heard)
        return answer

    def said(self, answer: dict[str, Any], quick: bool) -> tuple[str, str]:
        """Return whose numbers these are, and where they are read."""
        return _MODEL, f"Read at the terminal {answer['read_at']}"
