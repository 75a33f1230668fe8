"""Reader: a lever that reads its distance to a surface, which follows sliders."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
from nicegui import ui

from hotlever.app import approaching
from hotlever.app.pages import plots
from hotlever.app.pages.frame import caption
from hotlever.app.pages.live_page import LivePage
from hotlever.app.session import Task
from hotlever.figures.style import BLUE, VERMILION, apart_at_turns


class ReaderPlots:
    """A lever over a surface from the side, and what it reads by the distance.

    `show` is given the answers of `hotlever.app.approaching`.
    """

    def __init__(self) -> None:
        layout = plots.axes("along the lever (µm)", "height (µm)", 260, normal="xy")
        layout["xaxis"]["showgrid"] = layout["yaxis"]["showgrid"] = False
        alt = "The lever from the side, coloured by temperature, over the surface"
        traces = [plots.line(plots.INK), plots.line(VERMILION, dash="dash")]
        self._picture = plots.plotted(traces, layout, alt)
        caption(
            "From the side, heights to a scale of their own; each piece of the lever in the "
            "colour of its hottest place. The dashed line is the distance."
        )
        # title, column, factor, and whether the axis is logarithmic
        curves = (
            ("voltage (V)", "reader_V", 1.0, False),
            ("|d ln R/dz| (10<sup>−4</sup>/nm)", "dlnR_dz_per_um", 10.0, True),
            ("resolution (pm/√Hz)", "resolution_nm_per_rtHz", 1e3, True),
        )
        self._curves: list[tuple[ui.plotly, str, float, bool]] = []
        values = [float(f"{digit}e{power}") for power in range(-6, 7) for digit in (1, 2, 5)]
        ticks = {"tickvals": values, "ticktext": [f"{value:g}" for value in values]}
        with plots.side_by_side():
            for title, key, factor, by_decades in curves:
                layout = plots.axes("distance to the surface (µm)", title, 250, normal="xy")
                for axis in ("xaxis", "yaxis")[: 1 + by_decades]:
                    layout[axis] |= {"type": "log", **ticks}
                traces = [plots.line(BLUE), plots.dots(VERMILION, 10)]
                plot = plots.plotted(traces, layout, f"{title} by distance")
                self._curves.append((plot, key, factor, by_decades))

    def show(self, answer: dict[str, Any]) -> None:
        """Draw an answer."""
        self._draw(answer)
        for plot, key, factor, by_decades in self._curves:
            for number, columns in enumerate((answer["curves"], answer["now"])):
                x, values = columns["surface_gap_um"], factor * np.asarray(columns[key])
                if by_decades and number == 0:
                    x, values = apart_at_turns(columns["dlnR_dz_per_um"], x, np.abs(values))
                elif by_decades:
                    values = np.abs(values)
                plot.figure["data"][number] |= plots.points(x, values)
            plot.update()

    def _draw(self, answer: dict[str, Any]) -> None:
        """Draw lever, tip and surface from the side."""
        start, at_tip, end = answer["ends"]
        thick, gap = answer["thickness_um"], answer["now"]["surface_gap_um"]
        shapes = []
        edges = np.linspace(start, end, len(answer["colours"]) + 1)
        for left, colour in zip(edges.tolist(), answer["colours"], strict=False):
            # the next one is drawn over what is beyond, so that no gap shows between them
            box = [(left, 0.0), (end, 0.0), (end, thick), (left, thick)]
            shapes.append(plots.filled(box, colour))
        outline = [(start, 0.0), (end, 0.0), (end, thick), (start, thick)]
        if answer["tip"] is not None:
            height, radius = answer["tip"]
            cone = [(at_tip - radius, 0.0), (at_tip + radius, 0.0), (at_tip, -height)]
            shapes.append(plots.filled(cone, plots.INK))
        margin = 0.04 * (end - start)
        sides = np.array([start - margin, end + margin])
        surface = -gap + answer["slope"] * (sides - at_tip)
        low = float(surface.min())
        # share of the height that is shown around it
        above = 0.25
        bottom = low - above * (thick - low)
        corners = [*zip(sides.tolist(), surface.tolist(), strict=True)]
        below = [*corners, (sides[1], bottom), (sides[0], bottom)]
        shapes += [plots.filled(below, plots.shade(0.35)), plots.outlined(outline)]
        figure = self._picture.figure
        figure["layout"]["shapes"] = shapes
        figure["layout"]["xaxis"]["range"] = sides.tolist()
        figure["layout"]["yaxis"]["range"] = [bottom, thick + above * (thick - low)]
        figure["data"][0] |= plots.points(sides, surface)
        figure["data"][1] |= plots.points([at_tip, at_tip], [0.0, -gap])
        self._picture.update()


class ReaderPage(LivePage):
    """One tab of the page."""

    name, plots_of = "reader", ReaderPlots
    live: ClassVar = approaching
    #: Distances of a table that is written.
    distances = 10
    # each distance is another lever
    solved_once = False
    first: ClassVar = {
        "distance_um": 0.5,
        "tilt_deg": None,
        "accommodation": None,
        "amplifier_nV": 5.0,
        "hooge": 0.0,
        "bias": 9.0,
        "most": 12.0,
    }
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
    #: The last answers of the coarse and the full lever, and as at what the air jumps for curves.
    _coarse: Mapping[str, Any] = MappingProxyType({})
    _full: Mapping[str, Any] = MappingProxyType({})
    _jump_K: float | None = None

    def controls(self) -> None:
        """Ask for tilt and accommodation, of which each value needs other levers."""
        with ui.row().classes("w-full no-wrap gap-1"):
            tilt = self.number("tilt_deg", "Tilt", "°", "as the file says")
            tilt.tooltip("surface_tilt_deg: of the surface; positive: the base is farther")
            share = self.number("accommodation", "Accommodation", "", "as the file says")
            share.tooltip("for the temperature jump at surfaces, 0.01 to 1")
            for field in (tilt, share):
                field.classes("col", remove="w-36")

    async def described(self) -> dict[str, Any]:
        """Return which distances there are, and what the file says of the surroundings."""
        self._coarse, self._jump_K = {}, None
        request = approaching.described, self.probe, self.chosen["tilt_deg"]
        answer: dict[str, Any] = await self.session.ask("quick", *request)
        nearest, farthest = answer["nearest_um"], answer["farthest_um"]
        self.chosen["distance_um"] = min(max(self.chosen["distance_um"], nearest), farthest)
        return answer

    def show_sliders(self) -> None:
        """Show distance, bias and noise."""
        ends = self.of_file["nearest_um"], self.of_file["farthest_um"]
        below = "surface_gap_um: lower face of the lever to the surface, at the tip"
        self.slider("distance_um", "distance to the surface", *ends, "µm", below, by_decades=True)
        self.slider_of_bias(0.1)
        self.slider("amplifier_nV", "noise of the amplifier", 0.0, 20.0, "nV/√Hz")
        hooge = "of the silicon, for 1/f noise; none at the lowest"
        words = "Hooge's parameter"
        self.slider("hooge", words, 1e-8, 1e-3, "", hooge, by_decades=True, from_zero=True)

    def of_lever(self) -> Task:
        """Return the command of the reader at the bias, whatever the distance."""
        nearest, farthest = self.of_file["nearest_um"], self.of_file["farthest_um"]
        tilt, accommodation = self.chosen["tilt_deg"], self.chosen["accommodation"]
        changes = {} if tilt is None else {"surface_tilt_deg": tilt}
        if accommodation is not None:
            changes["accommodation"] = accommodation
        options = {
            "distance": f"{nearest:.12g}um:{farthest:.12g}um:{self.distances}",
            "medium": "air",
            "set": [f"{name}={value:.12g}" for name, value in changes.items()],
            "amplifier": f"{self.chosen['amplifier_nV']:.12g}nV",
            "hooge": self.chosen["hooge"] or None,
            "bias": f"{self.chosen['bias']:.12g}V",
        }
        return Task("reader", self.probe_files, options)

    def also_asked(self) -> tuple[float | None]:
        """Return as at which temperature the air jumps, at the tip of the full lever."""
        return (self._jump_K,)

    def completed(self, answer: dict[str, Any], quick: bool) -> dict[str, Any]:
        """Return an answer with the curves, which are of the coarse lever."""
        if quick:
            self._coarse = answer
        return {**self._coarse, **answer}

    async def follow_answer(self, at: list[float], quick: bool) -> None:
        """Have the curves follow, too, if the air jumps as at another temperature by now."""
        jump_K = self._full.get("jump_K")
        # with a jump as at a temperature 2 K away the voltage is the same within 0.1 %
        if quick or jump_K is None or abs(jump_K - (self._jump_K or 0.0)) <= 2.0:
            return
        self._jump_K, wanted = jump_K, (self.of_lever(), at)
        with self.banner.caught():
            request = approaching.answer, *wanted[:1], *at, True, jump_K
            coarse = await self.session.ask("quick", *request)
            if not self.is_gone and self._follower.last == wanted:
                self.draw({**self.completed(coarse, True), **self._full}, False)

    def model_and_remark(self, answer: dict[str, Any], quick: bool) -> tuple[str, str]:
        """Return whose numbers these are, where they are read, and how far curves are off."""
        remark = "; ".join([f"Read at the terminal {answer['read_at']}", *answer["on_curves"]])
        if quick:
            coarse_lever = "coarse lever, while the full one is solved"
            return f"{coarse_lever}; the air's temperature jumps as at the bias before", remark
        self._full = {key: answer[key] for key in ("now", "jump_K", "read_at")}
        coarse, now = self._coarse["now"], answer["now"]
        shown = {"reader_V": "voltage", "reader_ohm": "resistance", "dlnR_dz_per_um": "d ln R/dz"}
        off = (f"{100 * (coarse[key] / now[key] - 1):+.2g} % in {shown[key]}" for key in shown)
        return (
            "full lever: the numbers of hotlever reader",
            f"{remark}; curves: coarse lever, here {', '.join(off)}",
        )
