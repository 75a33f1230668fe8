"""One spectrum of the page Raman: its counts and the fitted line, and what is corrected by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from nicegui import ui

from hotlever.app.pages.frame import caption, flat_button
from hotlever.app.pages.page import Page
from hotlever.app.pages.plots import INK, axes, plotted, short
from hotlever.colours import BLUE, GREEN, VERMILION
from hotlever.errors import HotleverError
from hotlever.raman import Correction, read_corrections
from hotlever.raman.tables import corrections_text

#: The table of corrections, in the folder of the project.
CORRECTIONS = "raman.corrections.csv"
_ALT = "Counts of the spectrum, and the fitted line"
_HELP = "Click where the line is, or type it. Drag across the part that is to be fitted."
_FIELDS = {"start": "Line near", "low": "Fit from", "high": "Fit to"}
_LINE = {"type": "scatter", "mode": "lines", "hoverinfo": "skip"}
_DOTS = {"type": "scatter", "mode": "markers"}
#: Counts, fitted line, background, and cosmic rays.
_TRACES = [
    {**_DOTS, "marker": {"color": INK, "size": 4}},
    {**_LINE, "line": {"color": BLUE, "width": 2}},
    {**_LINE, "line": {"color": GREEN, "width": 1, "dash": "dot"}},
    {
        **_DOTS,
        "marker": {"color": VERMILION, "size": 8, "symbol": "x-thin-open"},
        "hoverinfo": "skip",
    },
]
#: Over the whole height: what is not fitted, and the place of the line.
_HIGH = {"yref": "paper", "y0": 0, "y1": 1}
_SHADE = {"type": "rect", **_HIGH, "line": {"width": 0}, "fillcolor": "rgba(128,128,128,.25)"}
_PLACE = {"type": "line", **_HIGH, "line": {"color": VERMILION, "width": 1, "dash": "dash"}}


class OneSpectrum:
    """A spectrum chosen by name, and its correction, which the table of the project keeps.

    Parameters
    ----------
    page : Page
        Under whose ``spectrum`` the name is chosen.
    thermometer : callable
        Returns the options of the thermometer; see `hotlever.app.spectra.measured`.
    corrected : callable
        Called when something has been corrected.
    """

    def __init__(
        self,
        page: Page,
        thermometer: Callable[[], dict[str, str]],
        corrected: Callable[[], None],
    ) -> None:
        self._page, self._thermometer, self._corrected = page, thermometer, corrected
        self._turn, self._quiet = 0, False
        with ui.card().classes("w-full gap-1").props("flat bordered") as self._all:
            with ui.row().classes("w-full items-center no-wrap"):
                self._select = ui.select([], label="Spectrum", on_change=self._pick).classes("col")
                before, after = partial(self._move, -1), partial(self._move, 1)
                flat_button("", before, icon="chevron_left", label="Spectrum before")
                flat_button("", after, icon="chevron_right", label="Next spectrum")
            layout = axes("Raman shift (cm⁻¹)", "counts", 300, normal="xy")
            layout |= {"hovermode": "x", "dragmode": "select", "selectdirection": "h"}
            self._plot = plotted(_TRACES, layout, _ALT)
            self._plot.on("plotly_click", self._click, ["points"])
            self._plot.on("plotly_selected", self._drag, ["range"])
            self._text = ui.label().classes("remark").props("aria-live=polite data-spectrum=1")
            with ui.row().classes("w-full items-center"):
                self._numbers = {}
                for key, label in _FIELDS.items():
                    number = ui.number(label, on_change=self._type, format="%.6g")
                    number.props("clearable suffix=cm⁻¹ debounce=600")
                    self._numbers[key] = number.classes("w-36")
                self._out = ui.checkbox("Leave out", on_change=self._type)
                flat_button("As found", self._reset, icon="restart_alt")
            caption(_HELP)
        # the frame's head covers the top of what is scrolled to
        self._all.style("scroll-margin-top: 4rem").set_visibility(False)

    @property
    def _name(self) -> str:
        return str(self._select.value or "")

    def _corrections(self) -> dict[str, Correction]:
        path = self._page.session.project.path(CORRECTIONS)
        return read_corrections(path) if path.is_file() else {}

    async def look(self, folders: list[str]) -> None:
        """Offer the spectra of some folders, and show the one that was chosen last."""
        names = await self._page.session.ask("full", "spectra:names", folders)
        if self._all.is_deleted:
            return
        self._all.set_visibility(bool(names))
        chosen = self._page.chosen["spectrum"]
        self._quiet = True
        self._select.set_options(names, value=chosen if chosen in names else (names or [None])[0])
        self._quiet = False
        await self.show_chosen()

    async def show(self, name: str) -> None:
        """Show a spectrum, if there is one of this name, and go there."""
        if name in self._select.options:
            self._select.set_value(name)
            ui.run_javascript(f"getHtmlElement({self._all.id}).scrollIntoView()")

    async def _pick(self) -> None:
        if not self._quiet:
            self._page.chosen["spectrum"] = self._name
            await self.show_chosen()

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
        with self._page.banner.caught():
            corrections = self._corrections()
            before = corrections.pop(self._name, Correction())
            after = replace(before, **what)
            if after == before:
                return
            if after != Correction():
                corrections[self._name] = after
            project = self._page.session.project
            if corrections:
                text = corrections_text(corrections)
                project.write(CORRECTIONS, text, f"corrected {self._name}")
            else:
                project.changes.remove(project.path(CORRECTIONS))
            await self.show_chosen()
            self._corrected()

    # --- what is shown ----------------------------------------------------------------------------

    async def show_chosen(self) -> None:
        """Show the spectrum that is chosen, by what is asked of the thermometer now."""
        self._turn += 1
        turn, name = self._turn, self._name
        if not name:
            return
        try:
            correction = self._corrections().get(name, Correction())
            asked = name, self._thermometer()
            spectrum = await self._page.session.ask("full", "spectra:measured", *asked)
        except HotleverError as error:
            if not self._all.is_deleted:
                self._text.set_text(str(error).replace(f"{self._page.session.project.folder}/", ""))
            return
        if turn != self._turn or self._all.is_deleted:  # another one has been chosen meanwhile
            return
        self._quiet = True
        for key, number in self._numbers.items():
            number.set_value(getattr(correction, key))
        self._out.set_value(not correction.use)
        self._quiet = False
        self._text.set_text(spectrum["text"])
        self._draw(spectrum)

    def _draw(self, spectrum: dict[str, Any]) -> None:
        figure: Any = self._plot.figure
        for trace, (x, y) in zip(figure["data"], spectrum["curves"], strict=True):
            trace |= {"x": short(x), "y": short(y)}
        low, high = spectrum["ends"]
        first, last = spectrum["window"]
        shapes: list[dict[str, Any]] = [
            {**_SHADE, "layer": "below", "x0": x0, "x1": x1}
            for x0, x1 in ((low, first), (last, high))
            if x1 > x0
        ]
        if spectrum["centre"] is not None:
            shapes.append({**_PLACE, "x0": spectrum["centre"], "x1": spectrum["centre"]})
        figure["layout"] |= {"shapes": shapes, "selections": []}
        figure["layout"]["xaxis"]["range"] = [low, high]
        figure["layout"]["yaxis"] |= {"range": spectrum["heights"], "autorange": False}
        self._plot.update()
