"""Start: three sentences, something to try, what lies in the folder, and questions."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from nicegui import app, ui

from hotlever.app import live, showing
from hotlever.app.pages.frame import (
    PAGES,
    ErrorBanner,
    caption,
    drop_zone,
    flat_button,
    opened_dialog,
    small_button,
)
from hotlever.app.pages.lever_page import LeverPage, proposal
from hotlever.app.pages.measurements import MeasurementsPage
from hotlever.app.pages.simulate import SimulatePage
from hotlever.app.pages.task_page import TaskPage
from hotlever.app.project import DRAWINGS, EXAMPLES
from hotlever.app.session import Session
from hotlever.errors import HotleverError


@dataclass(frozen=True)
class Opened:
    """A page, and how it is set up.

    Attributes
    ----------
    page : str
    chosen : dict
        What is chosen there; the rest is as at first.
    example : str
        A file of the examples that is copied into the project, or a folder of folders.
    """

    page: str
    chosen: Mapping[str, Any] = field(default_factory=dict)
    example: str = ""

    def set_up(self, session: Session) -> None:
        """Take the example, and choose."""
        if self.example.endswith((".csv", ".toml", *DRAWINGS)):
            choose_file(session, session.project.take_example(self.example))
        elif self.example:
            inside = (EXAMPLES / self.example).iterdir()
            folders = sorted(path.name for path in inside if path.is_dir())
            session.project.take_example_folders(self.example, *folders)
        elif self.page == SimulatePage.name:
            session.choose_lever("")
        # on these pages all is as at first but what is set up
        first_of = {page.name: page.first for page in (SimulatePage, MeasurementsPage)}
        first = first_of.get(self.page, {})
        of_file = {"data"} if self.example else set()
        chosen = {key: value for key, value in first.items() if key not in of_file}
        session.choices(self.page, first).update({**chosen, **self.chosen})

    def open(self, session: Session, banner: ErrorBanner) -> None:
        """Set the page up, and go there."""
        with banner.caught():
            self.set_up(session)
            ui.navigate.to(f"/{self.page}")


def choose_file(session: Session, name: str) -> str:
    """Choose a file of the project for the page that it belongs to; return the page's name."""
    if name.lower().endswith(DRAWINGS):
        task = proposal(session, name)
        session.jobs.start(LeverPage.name, task)
        session.choices(LeverPage.name, LeverPage.first)["awaited"] = task.options["output"]
        return LeverPage.name
    if name.lower().endswith(".toml"):
        session.choose_lever(name)
        return SimulatePage.name
    chosen = session.choices(MeasurementsPage.name, MeasurementsPage.first)
    chosen |= {"data": [name], "opened": ""}  # no result of another one
    return MeasurementsPage.name


#: Questions by the names of their scripts, in the order of the documentation; None has no page.
QUESTIONS: dict[str, Opened | None] = {
    "knee": Opened("simulate", {"bias": 8.3}),
    "how_sure": Opened("measurements", {"kind": "calibrate", "run": True}, "lever-a.csv"),
    "fit_my_data": Opened("measurements", {"kind": "fit"}, "lever-a.csv"),
    "raman_to_temperature": Opened("raman", {"calibration": ""}, "raman"),
    "what_air_takes": Opened("simulate", {"changes": {"medium": "air"}}),
    "where_the_heat_goes": None,
    "pulse_in_air": Opened("simulate", {"view": "time", "changes": {"medium": "air"}}),
    "five_us_pulse": Opened("simulate", {"view": "time"}),
    "heat_the_reader": None,
    "heater_width": None,
    "metal_film": Opened("simulate", {"bias": 0.5, "most": 1.0}, "palladium-on-nitride.toml"),
    "turned_on_the_wafer": None,
}


def serve_pictures() -> None:
    """Have the server give the pictures of the questions."""
    app.add_static_files("/gallery", EXAMPLES / "gallery")


class StartPage(TaskPage):
    """One tab of the page."""

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        sentences = (
            "hotlever tells how hot the tip of a Joule-heated cantilever is, and how sure that is.",
            "Drop a measurement (bias and current, and what else you have) and press Calibrate or "
            "Fit; or go to Simulate and move the sliders of the reference probe.",
            "Everything lies as files in {folder}, and each page shows the command line that does "
            "the same.",
        )
        to_try = {
            "A measured lever": (
                "Bias, current, reader voltage, tip temperature",
                Opened("measurements", example="lever-a.csv"),
            ),
            "A lever with a tip": (
                "The same, of a lever that the model lacks",
                Opened("measurements", example="lever-b.csv"),
            ),
            "A drawing": (
                "The reference lever as GDSII",
                Opened("lever", example="reference-probe.gds"),
            ),
            "Raman spectra": ("A hot plate and a tip", Opened("raman", example="raman")),
        }
        with ui.column().classes("w-full max-w-5xl mx-auto gap-4"):
            for sentence in sentences:
                words = sentence.format(folder=session.project.folder)
                ui.label(words).classes("text-base remark")
            drop_zone(
                session,
                banner,
                "Drop anything here: a measurement, a drawing (GDSII, OASIS, DXF), a probe file",
                self._sort,
            )
            ui.label("Try it").classes("text-lg text-bold")
            with ui.row().classes("w-full gap-3"):
                for title, (text, opened) in to_try.items():
                    with ui.card().props("flat bordered").classes("w-56 gap-1"):
                        ui.label(title).classes("text-bold")
                        ui.label(text).classes("text-sm opacity-70")
                        small_button("Try", self._opening(opened), label=f"Try: {title}")
            self._list_files()
            ui.label("Or begin with a question").classes("text-lg text-bold")
            with ui.row().classes("w-full gap-3 items-stretch"):
                for name, question in QUESTIONS.items():
                    self._card(name, question)

    def _opening(self, opened: Opened) -> Any:
        return partial(opened.open, self.session, self.banner)

    def _list_files(self) -> None:
        """Show what lies in the folder, each with the way to its page."""
        titles = {"probes": "Levers", "data": "Measurements", "drawings": "Drawings"}
        most = 12
        with ui.row().classes("w-full gap-8 items-start"):
            for kind, title in titles.items():
                names = getattr(self.session.project, kind)
                if not names:
                    continue
                with ui.column().classes("gap-0"):
                    ui.label(title).classes("text-bold")
                    for name in names[:most]:
                        go = flat_button(name, partial(self._open, name))
                        go.props("align=left")
                    if len(names) > most:
                        caption(f"and {len(names) - most} more")

    def _open(self, name: str) -> None:
        with self.banner.caught():
            ui.navigate.to(f"/{choose_file(self.session, name)}")

    async def _sort(self, names: list[str]) -> None:
        """Bring dropped files to the page that they belong to."""
        name, session = names[-1], self.session
        if name.lower().endswith(".toml"):
            await session.ask("quick", live.described, name)
        elif name.lower().endswith(".json"):
            self.banner.say(f"{name}: kept in the folder; the page Measurements finds it there")
            return
        elif not name.lower().endswith(DRAWINGS):
            try:
                await session.ask("full", showing.understood, name, {})
            except HotleverError:
                if await session.ask("full", showing.refused, [name], True):
                    raise
                self.banner.say(
                    f"{name} is a spectrum: please drop it on the page Raman, as tip or plate"
                )
                return
        self._open(name)

    def _card(self, name: str, opened: Opened | None) -> None:
        """Show a question with its picture, the page that answers it, and its script."""
        code = (EXAMPLES / "gallery" / f"{name}.py").read_text(encoding="utf-8")
        question = ast.get_docstring(ast.parse(code)) or name
        with ui.card().props("flat bordered").classes("w-56 gap-1 p-2"):
            with ui.element("div").classes("paper w-full p-1"):
                _picture(name, question).style("width: 100%; height: 8rem; object-fit: contain")
            ui.label(question).classes("text-sm text-bold")
            ui.space()
            with ui.row().classes("w-full gap-1"):
                if opened is not None:
                    title = PAGES[opened.page][0]
                    small_button(title, self._opening(opened), label=f"{title}: {question}")
                script = partial(_show_script, name, question, code)
                flat_button("Script", script, label=f"Script: {question}").classes("q-px-sm")


def _picture(name: str, question: str) -> ui.element:
    image = ui.element("img").props("loading=lazy")
    image.props["src"], image.props["alt"] = f"/gallery/{name}.png", f"The figure of: {question}"
    return image


def _show_script(name: str, question: str, code: str) -> None:
    """Show a script and its figure."""
    with opened_dialog(question, "52rem") as (_, buttons):
        with buttons:
            small_button("Copy", partial(ui.clipboard.write, code), icon="content_copy")
        with ui.element("pre").classes("command w-full"):
            ui.label(code)
        if "examples/" in code:
            caption(f"What it reads is in {EXAMPLES}").classes("remark")
        with ui.element("div").classes("paper w-full"):
            _picture(name, question)
