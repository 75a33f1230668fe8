"""Start: three sentences, something to try, what lies in the folder, and questions."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from nicegui import app, ui

from hotlever.app.pages.frame import (
    PAGES,
    ErrorBanner,
    caption,
    drop_zone,
    flat_button,
    opened_dialog,
    small_button,
)
from hotlever.app.pages.page import Page
from hotlever.app.project import DRAWINGS, EXAMPLES
from hotlever.app.session import Session
from hotlever.app.state import Simulate
from hotlever.errors import HotleverError

_SENTENCES = (
    "hotlever tells how hot the tip of a Joule-heated cantilever is, and how sure that is.",
    "Drop a measurement (bias and current, and what else you have) and press Fit or Calibrate; or "
    "go to Simulate and move the sliders of the reference probe.",
    "Everything lies as files in {folder}, and each page shows the command line that does the "
    "same.",
)
_DROP = "Drop anything here: a measurement, a drawing (GDSII, OASIS, DXF), a probe file"
#: Kinds of files of a project, and the page and the name there under which one is chosen.
_KINDS = {
    "probes": ("Probes", "simulate", "probe"),
    "data": ("Measurements", "fit", "data"),
    "drawings": ("Drawings", "lever", "drawing"),
}
_MOST_FILES = 12
_SCRIPTS, _ADDRESS = EXAMPLES / "gallery", "/gallery"
#: The page Simulate as at first, whatever was chosen there.
_SIMULATE = Simulate().model_dump()
_IN_TIME = _SIMULATE | {"view": "time"}


@dataclass(frozen=True)
class Opened:
    """A page, and how it is set up.

    Attributes
    ----------
    page : str
    chosen : dict
        What is chosen there.
    example : str
        A file of the examples, or a folder of folders, that is copied into the project.
    key : str
        Under which the name of that file is chosen.
    """

    page: str
    chosen: Mapping[str, Any] = field(default_factory=dict)
    example: str = ""
    key: str = ""

    def set_up(self, session: Session) -> None:
        """Take the example, and choose."""
        chosen = deepcopy(dict(self.chosen))
        if self.key:
            chosen[self.key] = session.project.take_example(self.example)
        elif self.example:
            inside = (EXAMPLES / self.example).iterdir()
            folders = sorted(path.name for path in inside if path.is_dir())
            session.project.take_example_folders(self.example, *folders)
        session.chosen.setdefault(self.page, {}).update(chosen)

    def open(self, session: Session, banner: ErrorBanner) -> None:
        """Set the page up, and go there."""
        with banner.caught():
            self.set_up(session)
            ui.navigate.to(f"/{self.page}")


_TRY = {
    "A measured lever": (
        "Bias, current, reader voltage, tip temperature",
        Opened("fit", example="lever-a.csv", key="data"),
    ),
    "A lever with a tip": (
        "The same, of a lever that the model lacks",
        Opened("fit", example="lever-b.csv", key="data"),
    ),
    "A drawing": (
        "The reference lever as GDSII",
        Opened("lever", example="reference-probe.gds", key="drawing"),
    ),
    "Raman spectra": ("A hot plate and a tip", Opened("raman", example="raman")),
}
#: Questions by the names of their scripts, in the order of the documentation; None has no page.
QUESTIONS: dict[str, Opened | None] = {
    "knee": Opened("simulate", {**_SIMULATE, "bias": 8.3}),
    "how_sure": Opened("calibrate", {"rests": "probe:", "run": True}, "lever-a.csv", "data"),
    "fit_my_data": Opened("fit", {"probe": None}, "lever-a.csv", "data"),
    "raman_to_temperature": Opened("raman", {"calibration": ""}, "raman"),
    "what_air_takes": Opened("simulate", {**_SIMULATE, "changes": {"medium": "air"}}),
    "where_the_heat_goes": None,
    "pulse_in_air": Opened("simulate", {**_IN_TIME, "changes": {"medium": "air"}}),
    "five_us_pulse": Opened("simulate", _IN_TIME),
    "heat_the_reader": None,
    "heater_width": None,
    "metal_film": Opened(
        "simulate", {**_SIMULATE, "bias": 0.5, "most": 1.0}, "palladium-on-nitride.toml", "probe"
    ),
    "turned_on_the_wafer": None,
}


def serve_pictures() -> None:
    """Have the server give the pictures of the questions."""
    app.add_static_files(_ADDRESS, _SCRIPTS)


class StartPage(Page):
    """One tab of the page."""

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        with ui.column().classes("w-full max-w-5xl mx-auto gap-4"):
            for sentence in _SENTENCES:
                words = sentence.format(folder=session.project.folder)
                ui.label(words).classes("text-base remark")
            drop_zone(session, banner, _DROP, self._sort)
            ui.label("Try it").classes("text-lg text-bold")
            with ui.row().classes("w-full gap-3"):
                for title, (text, opened) in _TRY.items():
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
        with ui.row().classes("w-full gap-8 items-start"):
            for kind, (title, page, key) in _KINDS.items():
                names = getattr(self.session.project, kind)
                if not names:
                    continue
                with ui.column().classes("gap-0"):
                    ui.label(title).classes("text-bold")
                    for name in names[:_MOST_FILES]:
                        go = flat_button(name, partial(self._open, page, key, name))
                        go.props("align=left")
                    if len(names) > _MOST_FILES:
                        caption(f"and {len(names) - _MOST_FILES} more")

    def _open(self, page: str, key: str, name: str) -> None:
        # sliders that were moved are of another probe
        chosen = {**_SIMULATE, key: name} if page == "simulate" else {key: name}
        Opened(page, chosen).open(self.session, self.banner)

    async def _sort(self, names: list[str]) -> None:
        """Bring dropped files to the page that they belong to."""
        name, session = names[-1], self.session
        if name.lower().endswith(DRAWINGS):
            self._open("lever", "drawing", name)
        elif name.lower().endswith(".toml"):
            await session.ask("quick", "live:described", name)
            self._open("simulate", "probe", name)
        elif name.lower().endswith(".json"):
            self.banner.say(
                f"{name}: kept in the folder; the pages Fit and Calibrate find it there"
            )
        else:
            try:
                await session.ask("full", "showing:understood", name)
            except HotleverError:
                if await session.ask("full", "showing:refused", [name], True):
                    raise
                self.banner.say(
                    f"{name} is a spectrum: please drop it on the page Raman, as tip or plate"
                )
            else:
                self._open("fit", "data", name)

    def _card(self, name: str, opened: Opened | None) -> None:
        """Show a question with its picture, the page that answers it, and its script."""
        code = (_SCRIPTS / f"{name}.py").read_text(encoding="utf-8")
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
    image.props["src"], image.props["alt"] = f"{_ADDRESS}/{name}.png", f"The figure of: {question}"
    return image


def _show_script(name: str, question: str, code: str) -> None:
    """Show a script and its figure."""
    with opened_dialog(question, "52rem") as buttons:
        with buttons:
            small_button("Copy", partial(ui.clipboard.write, code), icon="content_copy")
        with ui.element("pre").classes("command w-full"):
            ui.label(code)
        if "examples/" in code:
            caption(f"What it reads is in {EXAMPLES}").classes("remark")
        with ui.element("div").classes("paper w-full"):
            _picture(name, question)
