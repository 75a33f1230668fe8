"""The questions of the gallery as starting points: a room that is set up, or the script."""

from __future__ import annotations

import ast
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from nicegui import app, ui

from hotlever.app.page import ROOMS, Complaint
from hotlever.app.project import EXAMPLES
from hotlever.app.rooms.sliders import FIRST
from hotlever.app.session import Session

_SCRIPTS, _ADDRESS = EXAMPLES / "gallery", "/gallery"
_SIMULATE = FIRST | {"view": "rest"}
_IN_TIME = _SIMULATE | {"view": "time"}


@dataclass(frozen=True)
class Opened:
    """A room, and how it is set up.

    Attributes
    ----------
    room : str
        Its address.
    chosen : dict
        What is chosen there.
    example : str
        A file of the examples, or a folder of folders, that is copied into the project.
    key : str
        Under which the name of that file is chosen.
    """

    room: str
    chosen: dict[str, Any] = field(default_factory=dict)
    example: str = ""
    key: str = ""

    def set_up(self, session: Session) -> None:
        """Take the example, and choose."""
        chosen = deepcopy(self.chosen)
        if self.key:
            chosen[self.key] = session.project.take_example(self.example)
        elif self.example:
            inside = (EXAMPLES / self.example).iterdir()
            folders = sorted(one.name for one in inside if one.is_dir())
            session.project.take_example_folders(self.example, *folders)
        session.chosen.setdefault(self.room.strip("/"), {}).update(chosen)

    def open(self, session: Session, complaint: Complaint) -> None:
        """Set the room up, and go there."""
        with complaint.caught():
            self.set_up(session)
            ui.navigate.to(self.room)


#: Questions by the names of their scripts, in the order of the documentation; None has no room.
QUESTIONS: dict[str, Opened | None] = {
    "knee": Opened("/simulate", {**_SIMULATE, "bias": 8.3}),
    "how_sure": Opened("/calibrate", {"rests": "probe:", "run": True}, "lever-a.csv", "data"),
    "fit_my_data": Opened("/fit", {"probe": None}, "lever-a.csv", "data"),
    "raman_to_temperature": Opened("/raman", {"calibration": ""}, "raman"),
    "what_air_takes": Opened("/simulate", {**_SIMULATE, "changes": {"medium": "air"}}),
    "where_the_heat_goes": None,
    "pulse_in_air": Opened("/simulate", {**_IN_TIME, "changes": {"medium": "air"}}),
    "five_us_pulse": Opened("/simulate", _IN_TIME),
    "heat_the_reader": None,
    "heater_width": None,
    "metal_film": Opened(
        "/simulate",
        {**_SIMULATE, "bias": 0.5, "most": 1.0},
        "palladium-on-nitride.toml",
        "probe",
    ),
    "turned_on_the_wafer": None,
}


def serve_pictures() -> None:
    """Have the server give the pictures."""
    app.add_static_files(_ADDRESS, _SCRIPTS)


def questions(session: Session, complaint: Complaint) -> None:
    """Show all questions, each with its picture."""
    with ui.row().classes("w-full gap-3 items-stretch"):
        for name, opened in QUESTIONS.items():
            _card(session, complaint, name, opened)


def _card(session: Session, complaint: Complaint, name: str, opened: Opened | None) -> None:
    code = (_SCRIPTS / f"{name}.py").read_text(encoding="utf-8")
    question = ast.get_docstring(ast.parse(code)) or name
    with ui.card().props("flat bordered").classes("w-56 gap-1 p-2"):
        with ui.element("div").classes("paper w-full p-1"):
            _picture(name, question).style("width: 100%; height: 8rem; object-fit: contain")
        ui.label(question).classes("text-sm text-bold")
        ui.space()
        with ui.row().classes("w-full gap-1"):
            if opened is not None:
                title = ROOMS[opened.room][0]
                go = ui.button(title, on_click=partial(opened.open, session, complaint))
                go.props(f'outline dense no-caps aria-label="{title}: {question}"')
                go.classes("q-px-sm")
            script = ui.button("Script", on_click=partial(_script, name, question, code))
            script.props(f'flat dense no-caps aria-label="Script: {question}"').classes("q-px-sm")


def _picture(name: str, question: str) -> ui.element:
    image = ui.element("img").props("loading=lazy")
    image.props["src"], image.props["alt"] = f"{_ADDRESS}/{name}.png", f"The figure of: {question}"
    return image


def _script(name: str, question: str, code: str) -> None:
    """Show a script and its figure."""
    with ui.dialog(value=True) as dialog, ui.card().classes("w-full").style("max-width: 52rem"):
        with ui.row().classes("w-full items-center no-wrap"):
            ui.label(question).classes("text-lg text-bold col")
            copy = ui.button("Copy", icon="content_copy")
            copy.on_click(lambda: ui.clipboard.write(code)).props("outline dense no-caps")
            close = ui.button(icon="close", on_click=dialog.close)
            close.props('flat dense aria-label="Close"')
        with ui.element("pre").classes("command w-full"):
            ui.label(code)
        if "examples/" in code:
            ui.label(f"What it reads is in {EXAMPLES}").classes("text-xs opacity-70 remark")
        with ui.element("div").classes("paper w-full"):
            _picture(name, question)
    dialog.on("hide", dialog.delete)
