"""Raman: spectra of a hot plate and of a tip in, temperatures with their errors out."""

from __future__ import annotations

import csv
import io
from collections.abc import Awaitable
from dataclasses import replace
from functools import partial
from typing import Any

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages import plots
from hotlever.app.pages.frame import (
    FIGURE_FILES,
    ErrorBanner,
    caption,
    download_button,
    drop_zone,
    figure,
    flat_button,
    say_refused,
    small_button,
    table,
    two_columns,
)
from hotlever.app.pages.page import Page, Work
from hotlever.app.session import Session
from hotlever.colours import BLUE, GREEN, VERMILION
from hotlever.errors import HotleverError
from hotlever.raman import Correction, read_corrections
from hotlever.raman.tables import corrections_text

_TIP, _PLATE = "tip", "hot-plate"
_TABLE, _SAVED, _FIGURE = "tip.raman.csv", "raman.json", "raman"
_LAWS = {"anharmonic": "anharmonic", "linear": "linear, as in the paper"}
_FIGURE_ALT = "Spectra by temperature, the calibration and its residuals"
#: The table of corrections, in the folder of the project.
_CORRECTIONS = "raman.corrections.csv"
_SPECTRUM_ALT = "Counts of the spectrum, and the fitted line"
_HELP = "Click where the line is, or type it. Drag across the part that is to be fitted."
_FIELDS = {"start": "Line near", "low": "Fit from", "high": "Fit to"}
#: Counts, fitted line, background, and cosmic rays.
_QUIET = {"hoverinfo": "skip"}
_TRACES = [
    plots.dots(plots.INK, 4),
    plots.line(BLUE) | _QUIET,
    plots.line(GREEN, width=1, dash="dot") | _QUIET,
    plots.dots(VERMILION, 8, symbol="x-thin-open") | _QUIET,
]
#: Over the whole height: what is not fitted, and the place of the line.
_HIGH = {"yref": "paper", "y0": 0, "y1": 1}
_SHADE = {"type": "rect", **_HIGH, "line": {"width": 0}, "fillcolor": plots.SHADE.format(0.25)}
_PLACE = {"type": "line", **_HIGH, "line": {"color": VERMILION, "width": 1, "dash": "dash"}}


class RamanPage(Page):
    """One tab of the page."""

    name = "raman"

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        self._again = False
        with two_columns() as (left, right):
            with left:
                self._folder(_PLATE, "Drop the spectra of the hot plate here (temperatures known)")
                self._folder(_TIP, "Drop the spectra to be measured here")
                names = {"": f"the spectra in {_PLATE}"}
                names |= {name: name for name in session.project.raman_calibrations}
                self.choice("calibration", "Calibrated by", names)
                self.choice("law", "Law", _LAWS)
                measure = ui.button("Measure", icon="thermostat", on_click=self.start)
                measure.classes("w-full")
            with right:
                Work(session, self.name, self._measured)
                self._spectrum = OneSpectrum(self)
                self._result = ui.column().classes("w-full gap-2")
                self.command()
        self.show_command()
        if not session.jobs.running(self.name):
            self._show()

    async def open(self) -> None:
        """Show one of the spectra that are there."""
        await self._spectrum.look([_PLATE, _TIP])

    def _folder(self, folder: str, label: str) -> None:
        """Show where spectra are dropped, and how many there are."""

        def count() -> None:
            number = len(self.session.project.spectra(folder))
            counted.set_text(f"{folder}: {number or 'no'} {'file' if number == 1 else 'files'}")

        async def dropped(names: list[str]) -> None:
            count()
            self.show_command()
            await say_refused(self.session, self.banner, names, spectra=True)
            await self.open()

        drop_zone(self.session, self.banner, label, dropped, folder)
        counted = ui.label().classes("text-sm")
        if folder == _TIP and not self.session.project.spectra(_TIP):
            small_button("Try the example", self._example, icon="science")
        count()

    def _example(self) -> None:
        with self.banner.caught():
            self.session.project.take_example_folders("raman", _PLATE, _TIP)
            ui.navigate.reload()

    def changed(self) -> Awaitable[None]:
        """Show the spectrum by what is asked of the thermometer now."""
        self.show_command()
        return self._spectrum.show_chosen()

    def task(self, suffix: str = ".svg") -> Task:
        """Return the task that measures the spectra, and draws them."""
        project, calibration, law = (
            self.session.project,
            self.chosen["calibration"],
            self.chosen["law"],
        )
        with_plate = not calibration and bool(project.spectra(_PLATE))
        options = {
            "calibration": calibration,
            "calibrate_from": [_PLATE] if with_plate else [],
            "save_calibration": _SAVED if with_plate else "",
            "law": "" if law == "anharmonic" else law,
            "corrections": _CORRECTIONS if project.stamp(_CORRECTIONS) else "",
            "output": _TABLE,
            "plot": f"{_FIGURE}{suffix}",
        }
        return Task("raman", (_TIP,), options)

    def corrected(self) -> None:
        """Measure anew, once what runs has ended."""
        self.show_command()
        if self.session.jobs.running(self.name):
            self._again = True
        else:
            self.start()

    async def _measured(self, job: Job) -> None:
        if self._again:
            self._again = False
            self.start()
        elif not job.task.written.endswith(FIGURE_FILES[0]):
            await self.give(job)
        elif job.standing == "done":
            self._show()

    def _give(self, suffix: str) -> None:
        """Give the figure that there is, or have it written as another file."""
        if suffix == FIGURE_FILES[0]:
            ui.download.file(self.session.project.path(f"{_FIGURE}{suffix}"))
        else:
            self.run(self.task(suffix))

    def _show(self) -> None:
        self._result.clear()
        project = self.session.project
        if not project.stamp(_TABLE):
            return
        with self._result, self.banner.caught():
            text = project.path(_TABLE).read_text(encoding="utf-8")
            head, *rows = [*csv.reader(io.StringIO(text))] or [[]]
            with ui.row().classes("items-center"):
                download_button(self.session, _TABLE, "Temperatures (CSV)")
                download_button(self.session, _SAVED, "Calibration (JSON)")
                for suffix in FIGURE_FILES:
                    flat_button(suffix[1:].upper(), partial(self._give, suffix))
            if project.stamp(f"{_FIGURE}.svg"):
                drawn = project.path(f"{_FIGURE}.svg").read_text(encoding="utf-8")
                figure(drawn, _FIGURE_ALT, wide=True)
            table(head, rows, lambda name: self._spectrum.show(f"{_TIP}/{name}"), pagination=20)
            caption("A click on a name shows its spectrum above.")


class OneSpectrum:
    """A spectrum chosen by name, and its correction by hand, which a table of the project keeps.

    The name is chosen under the page's ``spectrum``.
    """

    def __init__(self, page: RamanPage) -> None:
        self._page = page
        self._turn, self._quiet = 0, False
        with ui.card().classes("w-full gap-1").props("flat bordered") as self._all:
            with ui.row().classes("w-full items-center no-wrap"):
                self._select = ui.select([], label="Spectrum", on_change=self._pick).classes("col")
                before, after = partial(self._move, -1), partial(self._move, 1)
                flat_button("", before, icon="chevron_left", label="Spectrum before")
                flat_button("", after, icon="chevron_right", label="Next spectrum")
            layout = plots.axes("Raman shift (cm⁻¹)", "counts", 300, normal="xy")
            layout |= {"hovermode": "x", "dragmode": "select", "selectdirection": "h"}
            self._plot = plots.plotted(_TRACES, layout, _SPECTRUM_ALT)
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
        path = self._page.session.project.path(_CORRECTIONS)
        return read_corrections(path) if path.is_file() else {}

    async def look(self, folders: list[str]) -> None:
        """Offer the spectra of some folders, and show the one that was chosen last."""
        names = await self._page.session.ask("full", "showing:spectra", folders)
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
                project.write(_CORRECTIONS, text, f"corrected {self._name}")
            else:
                project.changes.remove(project.path(_CORRECTIONS))
            await self.show_chosen()
            self._page.corrected()

    # --- what is shown ----------------------------------------------------------------------------

    async def show_chosen(self) -> None:
        """Show the spectrum that is chosen, by what is asked of the thermometer now."""
        self._turn += 1
        turn, name = self._turn, self._name
        if not name:
            return
        try:
            correction = self._corrections().get(name, Correction())
            arguments = name, self._page.task()
            spectrum = await self._page.session.ask("full", "showing:spectrum", *arguments)
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
            trace |= plots.points(x, y)
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
