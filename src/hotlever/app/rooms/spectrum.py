"""One spectrum of the room Raman: its counts and the fitted line, and what is corrected by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from nicegui import ui

from hotlever.app.page import Complaint
from hotlever.app.rooms.plots import INK, axes, plotted, short
from hotlever.app.session import Session
from hotlever.colours import BLUE, GREEN, VERMILION
from hotlever.errors import HotleverError
from hotlever.raman import Correction, read_corrections
from hotlever.raman.correction import corrections_text

_SPECTRA = "hotlever.app.spectra"
#: The table of corrections, in the folder of the project.
CORRECTIONS = "raman.corrections.csv"
_ALT = "Counts of the spectrum, and the fitted line"
_HELP = "Click where the line is, or type it. Drag across the part that is to be fitted."
_FIELDS = {"start": "Line near", "low": "Fit from", "high": "Fit to"}


class OneSpectrum:
    """A spectrum chosen by name, and its correction, which the table of the project keeps.

    Parameters
    ----------
    session : Session
    complaint : Complaint
    chosen : dict
        What was chosen last in the room; ``spectrum`` is the name.
    thermometer : callable
        Returns the options of the thermometer; see `hotlever.app.spectra.one`.
    changed : callable
        Called when something has been corrected.
    """

    def __init__(
        self,
        session: Session,
        complaint: Complaint,
        chosen: dict[str, Any],
        thermometer: Callable[[], dict[str, Any]],
        changed: Callable[[], None],
    ) -> None:
        self._session, self._complaint, self._chosen = session, complaint, chosen
        self._thermometer, self._changed = thermometer, changed
        self._asked, self._quiet = 0, False
        with ui.card().classes("w-full gap-1").props("flat bordered") as self._all:
            with ui.row().classes("w-full items-center no-wrap"):
                self._select = ui.select([], label="Spectrum", on_change=self._pick)
                self._select.props("dense outlined").classes("col")
                for icon, step, label in (
                    ("chevron_left", -1, "Spectrum before"),
                    ("chevron_right", 1, "Next spectrum"),
                ):
                    button = ui.button(icon=icon, on_click=lambda _, s=step: self._move(s))
                    button.props(f'flat dense aria-label="{label}"')
            layout = axes("Raman shift (cm⁻¹)", "counts", 300, normal="xy")
            layout |= {"hovermode": "x", "dragmode": "select", "selectdirection": "h"}
            line = {"type": "scatter", "mode": "lines", "hoverinfo": "skip"}
            hit = {"color": VERMILION, "size": 8, "symbol": "x-thin-open"}
            self._plot = plotted(
                [
                    {"type": "scatter", "mode": "markers", "marker": {"color": INK, "size": 4}},
                    {**line, "line": {"color": BLUE, "width": 2}},
                    {**line, "line": {"color": GREEN, "width": 1, "dash": "dot"}},
                    {"type": "scatter", "mode": "markers", "marker": hit, "hoverinfo": "skip"},
                ],
                layout,
                _ALT,
            )
            self._plot.on("plotly_click", self._click, ["points"])
            self._plot.on("plotly_selected", self._drag, ["range"])
            self._said = ui.label().classes("remark").props("aria-live=polite data-spectrum=1")
            with ui.row().classes("w-full items-center"):
                self._numbers = {}
                for key, label in _FIELDS.items():
                    number = ui.number(label, on_change=self._type, format="%.6g")
                    number.props("dense outlined clearable suffix=cm⁻¹ debounce=600")
                    self._numbers[key] = number.classes("w-36")
                self._out = ui.checkbox("Leave out", on_change=self._type).props("dense")
                ui.button("As found", icon="restart_alt", on_click=self._reset).props(
                    "flat dense no-caps"
                )
            ui.label(_HELP).classes("text-xs opacity-70")
        # the frame's head covers the top of what is scrolled to
        self._all.style("scroll-margin-top: 4rem").set_visibility(False)

    @property
    def _name(self) -> str:
        return str(self._select.value or "")

    def _corrections(self) -> dict[str, Correction]:
        path = self._session.project.path(CORRECTIONS)
        return read_corrections(path) if path.is_file() else {}

    async def look(self, folders: list[str]) -> None:
        """Offer the spectra of some folders, and show the one that was chosen last."""
        call, folder = f"{_SPECTRA}:names", self._session.project.folder
        names = await self._session.full.call(call, folder, folders)
        if self._all.is_deleted:
            return
        self._all.set_visibility(bool(names))
        chosen = self._chosen.get("spectrum")
        self._quiet = True
        self._select.set_options(names, value=chosen if chosen in names else (names or [None])[0])
        self._quiet = False
        await self._show()

    async def show(self, name: str) -> None:
        """Show a spectrum, if there is one of this name, and go there."""
        if name in self._select.options:
            self._select.set_value(name)
            ui.run_javascript(f"getHtmlElement({self._all.id}).scrollIntoView()")

    async def refresh(self) -> None:
        """Show it by what is asked of the thermometer now."""
        await self._show()

    async def _pick(self) -> None:
        if not self._quiet:
            self._chosen["spectrum"] = self._name
            await self._show()

    def _move(self, step: int) -> None:
        names = list(self._select.options)
        if names:
            self._select.set_value(names[(names.index(self._name) + step) % len(names)])

    # --- by hand ----------------------------------------------------------------------------------

    async def _click(self, event: Any) -> None:
        points = event.args.get("points") or []
        if points:
            await self._correct(start=round(float(points[0]["x"]), 2))

    async def _drag(self, event: Any) -> None:
        x = (event.args.get("range") or {}).get("x")
        if x:
            low, high = sorted(round(float(end), 1) for end in x)
            await self._correct(low=low, high=high)

    async def _type(self) -> None:
        if not self._quiet:
            numbers = {key: number.value for key, number in self._numbers.items()}
            await self._correct(**numbers, use=not self._out.value)

    async def _reset(self) -> None:
        await self._correct(start=None, low=None, high=None, use=True)

    async def _correct(self, **what: Any) -> None:
        """Keep a correction in the table, and have everything follow."""
        with self._complaint.caught():
            known = self._corrections()
            before = known.pop(self._name, Correction())
            after = replace(before, **what)
            if after == before:
                return
            if after != Correction():
                known[self._name] = after
            project = self._session.project
            if known:
                project.write(CORRECTIONS, corrections_text(known), f"corrected {self._name}")
            else:
                project.changes.remove(project.path(CORRECTIONS))
            await self._show()
            self._changed()

    # --- what is shown ----------------------------------------------------------------------------

    async def _show(self) -> None:
        self._asked += 1
        this, name = self._asked, self._name
        if not name:
            return
        call, folder = f"{_SPECTRA}:one", self._session.project.folder
        try:
            correction = self._corrections().get(name, Correction())
            found = await self._session.full.call(call, folder, name, self._thermometer())
        except HotleverError as error:
            if not self._all.is_deleted:
                self._said.set_text(str(error).replace(f"{folder}/", ""))
            return
        if this != self._asked or self._all.is_deleted:  # another one has been chosen meanwhile
            return
        self._quiet = True
        for key, number in self._numbers.items():
            number.set_value(getattr(correction, key))
        self._out.set_value(not correction.use)
        self._quiet = False
        self._said.set_text(found["said"])
        self._draw(found)

    def _draw(self, found: dict[str, Any]) -> None:
        figure = self._plot.figure
        for trace, (x, y) in zip(figure["data"], found["curves"], strict=True):
            trace |= {"x": short(x), "y": short(y)}
        low, high = found["ends"]
        shade = {"type": "rect", "yref": "paper", "y0": 0, "y1": 1, "line": {"width": 0}}
        shade |= {"fillcolor": "rgba(128,128,128,.25)", "layer": "below"}
        shapes = [
            {**shade, "x0": x0, "x1": x1}
            for x0, x1 in ((low, found["window"][0]), (found["window"][1], high))
            if x1 > x0
        ]
        line = {"type": "line", "yref": "paper", "y0": 0, "y1": 1}
        if found["centre"] is not None:
            at = found["centre"]
            dash = {"color": VERMILION, "width": 1, "dash": "dash"}
            shapes.append({**line, "x0": at, "x1": at, "line": dash})
        figure["layout"] |= {"shapes": shapes, "selections": []}
        figure["layout"]["xaxis"]["range"] = [low, high]
        figure["layout"]["yaxis"] |= {"range": found["heights"], "autorange": False}
        self._plot.update()
