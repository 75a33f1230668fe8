"""Start: three sentences, something to try, and what lies in the folder."""

from __future__ import annotations

from functools import partial

from nicegui import ui

from hotlever.app.page import Complaint, drop_zone, framed
from hotlever.app.project import DRAWINGS
from hotlever.app.rooms.gallery import Opened, questions
from hotlever.app.rooms.results import SHOWING
from hotlever.app.session import Session
from hotlever.errors import HotleverError

_SENTENCES = (
    "hotlever tells how hot the tip of a Joule-heated cantilever is, and how sure that is.",
    "Drop a measurement (bias and current, and what else you have) and press Fit or Calibrate; or "
    "go to Simulate and move the sliders of the reference probe.",
    "Everything lies as files in the folder named above, and each room shows the command line "
    "that does the same.",
)
_TRY = {
    "A measured lever": (
        "Bias, current, reader voltage, tip temperature",
        Opened("/fit", example="lever-a.csv", key="data"),
    ),
    "A lever with a tip": (
        "The same, of a lever that the model lacks",
        Opened("/fit", example="lever-b.csv", key="data"),
    ),
    "A drawing": (
        "The reference lever as GDSII",
        Opened("/lever", example="reference-probe.gds", key="drawing"),
    ),
    "Raman spectra": ("A hot plate and a tip", Opened("/raman", example="raman")),
}
_KINDS = {
    "Probes": ("probes", "/simulate", "simulate", "probe"),
    "Measurements": ("data", "/fit", "fit", "data"),
    "Drawings": ("drawings", "/lever", "lever", "drawing"),
}
_SHOWN = 12


async def fill(session: Session) -> None:
    """Fill the page."""
    with framed(session, "/") as complaint, ui.column().classes("w-full max-w-5xl mx-auto gap-4"):
        for sentence in _SENTENCES:
            ui.label(sentence).classes("text-base")
        drop_zone(
            session,
            complaint,
            "Drop anything here: a measurement, a drawing (GDSII, OASIS, DXF), a probe file",
            lambda names: _sort(session, complaint, names),
        )
        ui.label("Try it").classes("text-lg text-bold")
        with ui.row().classes("w-full gap-3"):
            for title, (text, opened) in _TRY.items():
                with ui.card().props("flat bordered").classes("w-56 gap-1"):
                    ui.label(title).classes("text-bold")
                    ui.label(text).classes("text-sm opacity-70")
                    button = ui.button("Try", on_click=partial(opened.open, session, complaint))
                    button.props(f'outline dense no-caps aria-label="Try: {title}"')
                    button.classes("q-px-md")
        _listed(session)
        ui.label("Or begin with a question").classes("text-lg text-bold")
        questions(session, complaint)


def _listed(session: Session) -> None:
    """Show what lies in the folder, each with the way to its room."""
    with ui.row().classes("w-full gap-8 items-start"):
        for title, (kind, to, room, key) in _KINDS.items():
            names = getattr(session.project, kind)
            if not names:
                continue
            with ui.column().classes("gap-0"):
                ui.label(title).classes("text-bold")
                for name in names[:_SHOWN]:
                    opened = partial(_open, session, to, room, key, name)
                    ui.button(name, on_click=opened).props("flat dense no-caps align=left")
                if len(names) > _SHOWN:
                    ui.label(f"and {len(names) - _SHOWN} more").classes("text-xs opacity-70")


def _open(session: Session, to: str, room: str, key: str, name: str) -> None:
    if room == "simulate":  # what was moved is of another probe
        session.chosen[room] = {}
    session.chosen.setdefault(room, {})[key] = name
    ui.navigate.to(to)


async def _sort(session: Session, complaint: Complaint, names: list[str]) -> None:
    """Bring dropped files to the room that they belong to."""
    name = names[-1]
    if name.lower().endswith(DRAWINGS):
        _open(session, "/lever", "lever", "drawing", name)
    elif name.lower().endswith(".toml"):
        await session.quick.call(f"{SHOWING}:probe_page", session.project.folder, name)
        _open(session, "/simulate", "simulate", "probe", name)
    elif name.lower().endswith(".json"):
        complaint.say(f"{name}: kept in the folder; the rooms Fit and Calibrate find it there")
    else:
        folder = session.project.folder
        try:
            call = f"{SHOWING}:understood"
            await session.full.call(call, folder, name)
        except HotleverError as error:
            if not await session.full.call(f"{SHOWING}:is_spectrum", folder, name):
                complaint.say(str(error))
                return
            complaint.say(
                f"{name} is a spectrum: please drop it in the room Raman, as tip or plate"
            )
            return
        _open(session, "/fit", "fit", "data", name)
