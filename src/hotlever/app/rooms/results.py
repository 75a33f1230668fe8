"""How the page of a result is shown, and its figures leave as files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import ui

from hotlever.app.page import Complaint, figure, hand_over, table
from hotlever.app.session import Session

SHOWING = "hotlever.app.showing"
FIGURE_FILES = (".svg", ".png", ".pdf")
#: Refused files that are named.
_SAID = 5


async def show_result(session: Session, complaint: Complaint, kind: str, name: str) -> None:
    """Show the page of a fit or a calibration in the element that is open, as it is drawn."""
    shown = ui.row().classes("w-full gap-3 items-start")
    waiting = ui.spinner(size="lg")

    def hear(message: tuple[str, Any]) -> None:
        if message[0] == "block" and not shown.is_deleted:
            with shown:
                _show(session, complaint, kind, name, message[1])

    with complaint.caught():
        call = f"{SHOWING}:page"
        await session.full.call(call, session.project.folder, kind, name, heard=hear)
    if not waiting.is_deleted:
        waiting.delete()


def _show(
    session: Session, complaint: Complaint, kind: str, name: str, block: dict[str, Any]
) -> None:
    if block["kind"] == "heading":
        ui.label(block["text"]).classes("w-full text-lg text-bold")
    elif block["kind"] == "text":
        lines = "\n" in block["text"]
        ui.label(block["text"]).classes("w-full lines" if lines else "w-full remark")
    elif block["kind"] == "table":
        table(block["columns"], block["rows"])
        ui.label(block["caption"]).classes("w-full text-xs opacity-70")
    else:
        with ui.column().classes("gap-0"):
            figure(block["figure"], block["caption"])
            with ui.row().classes("items-center w-full no-wrap"):
                ui.label(block["caption"]).classes("text-xs opacity-70 remark caption col")
                figure_files(session, complaint, kind, name, block["name"])


def figure_files(session: Session, complaint: Complaint, kind: str, name: str, shown: str) -> None:
    """Offer a figure of a result as a file."""

    async def draw(suffix: str) -> None:
        with complaint.caught():
            call, folder = f"{SHOWING}:drawn", session.project.folder
            drawn = session.full.call(call, folder, kind, name, shown, suffix)
            await hand_over(drawn, f"{Path(name).name.split('.')[0]}-{shown}{suffix}")

    for suffix in FIGURE_FILES:
        ui.button(suffix[1:].upper(), on_click=lambda _, to=suffix: draw(to)).props(
            f'flat dense no-caps size=sm aria-label="{shown} as {suffix[1:].upper()}"'
        )


def download_button(session: Session, name: str, label: str) -> None:
    """Offer a file of the project."""
    ui.button(
        label, icon="download", on_click=lambda: ui.download.file(session.project.path(name))
    ).props("outline dense no-caps").classes("q-px-sm")


async def say_refused(
    session: Session, complaint: Complaint, names: list[str], *, spectra: bool
) -> None:
    """Say which of some files are no measurements, or no spectra; they stay in the folder."""
    call, folder = f"{SHOWING}:refused", session.project.folder
    lines = await session.full.call(call, folder, names, spectra)
    more = f"\nand {len(lines) - _SAID} more such files" if len(lines) > _SAID else ""
    complaint.say("\n".join(lines[:_SAID]) + more)
