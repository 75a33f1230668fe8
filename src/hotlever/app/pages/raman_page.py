"""Raman: spectra of a hot plate and of a tip in, temperatures with their errors out."""

from __future__ import annotations

import csv
import io
from collections.abc import Awaitable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app import showing
from hotlever.app.pages import plots
from hotlever.app.pages.frame import (
    ErrorBanner,
    caption,
    download_button,
    drop_zone,
    flat_button,
    say_refused,
    small_button,
    table,
    two_columns,
)
from hotlever.app.pages.task_page import DrawnPage
from hotlever.app.project import CORRECTIONS
from hotlever.app.session import Job, Session, Task
from hotlever.errors import HotleverError
from hotlever.figures.style import BLUE, GREEN, VERMILION
from hotlever.raman import SpectrumCorrection, read_corrections
from hotlever.raman.spectrum_tables import corrections_text


class RamanPage(DrawnPage):
    """One tab of the page."""

    name = "raman"
    #: The folders in which spectra are kept.
    tip, plate = "tip", "hot-plate"
    alt = "Spectra by temperature, the calibration and its residuals"
    kinds: ClassVar = {kind: text for kind, text in DrawnPage.kinds.items() if kind != "NetCDF"}
    #: Corrections by the name of a spectrum, the file that they are in, and what that holds.
    first: ClassVar = {
        "calibration": "",
        "law": "anharmonic",
        "spectrum": "",
        "corrections": {},
        "corrected_by": None,
        "written": {},
    }

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        project = session.project
        self._taken = self.chosen["corrected_by"]
        if self._taken is None:
            self._take_corrections(next(iter(project.names(CORRECTIONS)), ""))
        with two_columns() as (left, right):
            with left:
                self._folder(
                    self.plate, "Drop the spectra of the hot plate here (temperatures known)"
                )
                self._folder(self.tip, "Drop the spectra to be measured here")
                names = {"": f"the spectra in {self.plate}"}
                names |= {name: name for name in project.raman_calibrations}
                self.choice("calibration", "Calibrated by", names)
                laws = {"anharmonic": "anharmonic", "linear": "linear, as in the paper"}
                self.choice("law", "Law", laws)
                self._corrected_by = self.choice("corrected_by", "Corrected by hand in", {})
                self._offer_corrections()
                measure = ui.button("Measure", icon="thermostat", on_click=self.start)
                measure.classes("w-full")
            with right:
                self._spectrum = OneSpectrum(self)
                self.show_result()
        self.show_command()

    async def open(self) -> None:
        """Show one of the spectra that are there."""
        await self._spectrum.look([self.plate, self.tip])

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
        if folder == self.tip and not self.session.project.spectra(self.tip):
            small_button("Try the example", self._example, icon="science")
        count()

    def _example(self) -> None:
        with self.banner.caught():
            self.session.project.take_example_folders("raman", self.plate, self.tip)
            ui.navigate.reload()

    # --- corrections ------------------------------------------------------------------------------

    def _take_corrections(self, file: str) -> None:
        """Take the corrections of a file of the project, or none."""
        with self.banner.caught():
            path = self.session.project.path(file)
            corrections = read_corrections(path) if file else {}
            self.chosen |= {"corrections": corrections, "written": corrections}
            self._taken = self.chosen["corrected_by"] = file

    def _offer_corrections(self) -> None:
        names = {"": "nothing"} | {name: name for name in self.session.project.names(CORRECTIONS)}
        self._corrected_by.set_options(names, value=self.chosen["corrected_by"])

    @property
    def _corrections_file(self) -> str:
        """The file of the corrections, a new one if they have changed; empty without any."""
        if self.chosen["corrections"] == self.chosen["written"]:
            return str(self.chosen["corrected_by"] or "")
        name = f"{self.session.project.free(self.tip, CORRECTIONS)}{CORRECTIONS}"
        return name if self.chosen["corrections"] else ""

    # --- what is asked ----------------------------------------------------------------------------

    async def changed(self) -> None:
        """Show the spectrum by what is asked of the thermometer now."""
        if self._corrected_by.value != self._taken:
            self._taken = self._corrected_by.value
            self._take_corrections(self._taken)
        await self.follow_corrections()

    async def follow_corrections(self) -> None:
        """Show the spectrum and the command with the corrections as they are."""
        self.show_command()
        await self._spectrum.show_chosen()

    def task(self) -> Task:
        """Return the task that measures the spectra, and draws them."""
        project, calibration, law = (
            self.session.project,
            self.chosen["calibration"],
            self.chosen["law"],
        )
        with_plate = not calibration and bool(project.spectra(self.plate))
        stem = project.free(self.tip, ".raman.csv", ".raman.svg", ".raman.json")
        options = {
            "calibration": calibration,
            "calibrate_from": [self.plate] if with_plate else [],
            "law": "" if law == "anharmonic" else law,
            "corrections": self._corrections_file,
            "save_calibration": f"{stem}.raman.json" if with_plate else "",
            "output": f"{stem}.raman.csv",
            "plot": f"{stem}.raman.svg",
        }
        return Task("raman", (self.tip,), options)

    def start(self) -> bool:
        """Write the corrections, if they are new, and measure."""
        with self.banner.caught():
            file, corrections = self._corrections_file, self.chosen["corrections"]
            if corrections != self.chosen["written"] and file:
                self.session.project.write(file, corrections_text(corrections))
            self._taken = file
            self.chosen |= {"corrected_by": file, "written": corrections}
            self._offer_corrections()
            return super().start()
        return False

    def show_figure(self, job: Job, path: Path) -> None:
        """Show the figure, and the table whose rows lead to the spectra."""
        with self.banner.caught():
            super().show_figure(job, path)
            text = path.with_suffix(".csv").read_text(encoding="utf-8")
            head, *rows = [*csv.reader(io.StringIO(text))] or [[]]
            saved = job.task.options.get("save_calibration")
            if saved:
                download_button(self.session, saved, "Calibration (JSON)")
            table(head, rows, lambda name: self._spectrum.show(f"{self.tip}/{name}"), pagination=20)
            caption("A click on a name shows its spectrum above.")


class OneSpectrum:
    """A spectrum chosen by name, and its correction by hand.

    The name is chosen under the page's ``spectrum``.
    """

    def __init__(self, page: RamanPage) -> None:
        self._page = page
        self._turn, self._quiet = 0, False
        quiet = {"hoverinfo": "skip"}
        # counts, fitted line, background, and cosmic rays
        traces = [
            plots.dots(plots.INK, 4),
            plots.line(BLUE) | quiet,
            plots.line(GREEN, width=1, dash="dot") | quiet,
            plots.dots(VERMILION, 8, symbol="x-thin-open") | quiet,
        ]
        with ui.card().classes("w-full gap-1").props("flat bordered") as self._all:
            with ui.row().classes("w-full items-center no-wrap"):
                self._select = ui.select([], label="Spectrum", on_change=self._pick).classes("col")
                before, after = partial(self._move, -1), partial(self._move, 1)
                flat_button("", before, icon="chevron_left", label="Spectrum before")
                flat_button("", after, icon="chevron_right", label="Next spectrum")
            layout = plots.axes("Raman shift (cm⁻¹)", "counts", 300, normal="xy")
            layout |= {"hovermode": "x", "dragmode": "select", "selectdirection": "h"}
            alt = "Counts of the spectrum, and the fitted line"
            self._plot = plots.plotted(traces, layout, alt)
            self._plot.on("plotly_click", self._click, ["points"])
            self._plot.on("plotly_selected", self._drag, ["range"])
            self._text = ui.label().classes("remark").props("aria-live=polite data-spectrum=1")
            with ui.row().classes("w-full items-center"):
                self._numbers = {}
                labels = {"start": "Line near", "low": "Fit from", "high": "Fit to"}
                for key, label in labels.items():
                    number = ui.number(label, on_change=self._type, format="%.6g")
                    number.props("clearable suffix=cm⁻¹ debounce=600")
                    self._numbers[key] = number.classes("w-36")
                self._out = ui.checkbox("Leave out", on_change=self._type)
                flat_button("As found", self._reset, icon="restart_alt")
            caption(
                "Click where the line is, or type it. Drag across the part that is to be fitted."
            )
        # the frame's head covers the top of what is scrolled to
        self._all.style("scroll-margin-top: 4rem").set_visibility(False)

    @property
    def _name(self) -> str:
        return str(self._select.value or "")

    async def look(self, folders: list[str]) -> None:
        """Offer the spectra of some folders, and show the one that was chosen last."""
        names = await self._page.session.ask("full", showing.spectra, folders)
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

    # at once: what was asked for before may be shown in the fields until it is done

    def _click(self, event: Any) -> Awaitable[None] | None:
        points = event.args.get("points") or []
        return self._correct(start=round(float(points[0]["x"]), 2)) if points else None

    def _drag(self, event: Any) -> Awaitable[None] | None:
        x = (event.args.get("range") or {}).get("x")
        if not x:
            return None
        low, high = sorted(round(float(end), 1) for end in x)
        return self._correct(low=low, high=high)

    def _type(self) -> Awaitable[None] | None:
        if self._quiet:
            return None
        numbers = {key: number.value for key, number in self._numbers.items()}
        return self._correct(**numbers, use=not self._out.value)

    def _reset(self) -> Awaitable[None] | None:
        return self._correct(start=None, low=None, high=None, use=True)

    def _correct(self, **what: Any) -> Awaitable[None] | None:
        """Take a correction, which is written when all are measured, and show what follows."""
        corrections = dict(self._page.chosen["corrections"])
        before = corrections.pop(self._name, SpectrumCorrection())
        after = replace(before, **what)
        if after == before:
            return None
        if after != SpectrumCorrection():
            corrections[self._name] = after
        self._page.chosen["corrections"] = corrections
        self._turn += 1
        return self._page.follow_corrections()

    # --- what is shown ----------------------------------------------------------------------------

    async def show_chosen(self) -> None:
        """Show the spectrum that is chosen, by what is asked of the thermometer now."""
        self._turn += 1
        turn, name = self._turn, self._name
        if not name:
            return
        try:
            corrections = self._page.chosen["corrections"]
            arguments = name, self._page.task(), corrections
            spectrum = await self._page.session.ask("full", showing.spectrum, *arguments)
        except HotleverError as error:
            if not self._all.is_deleted:
                self._text.set_text(str(error).replace(f"{self._page.session.project.folder}/", ""))
            return
        if turn != self._turn or self._all.is_deleted:  # another one has been chosen meanwhile
            return
        correction = corrections.get(name, SpectrumCorrection())
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
        # over the whole height: what is not fitted, and the place of the line
        tall = {"yref": "paper", "y0": 0, "y1": 1}
        shade = {"type": "rect", **tall, "line": {"width": 0}, "layer": "below"}
        shapes: list[dict[str, Any]] = [
            {**shade, "fillcolor": plots.shade(0.25), "x0": x0, "x1": x1}
            for x0, x1 in ((low, first), (last, high))
            if x1 > x0
        ]
        if (centre := spectrum["centre"]) is not None:
            dashed = {"color": VERMILION, "width": 1, "dash": "dash"}
            shapes.append({"type": "line", **tall, "line": dashed, "x0": centre, "x1": centre})
        figure["layout"] |= {"shapes": shapes, "selections": []}
        figure["layout"]["xaxis"]["range"] = [low, high]
        figure["layout"]["yaxis"] |= {"range": spectrum["heights"], "autorange": False}
        self._plot.update()
