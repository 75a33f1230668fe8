"""What rooms share: a form that writes a command line, and the command run."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from nicegui import ui

from hotlever.app.page import Complaint, command_shown, framed, python_shown
from hotlever.app.session import Session

REFERENCE = "reference probe"
MEDIA = {
    "": "as the files say",
    "vacuum": "vacuum",
    "air": "air",
    "unknown": "not known: either is tried",
}


class Room(ABC):
    """One tab of a room, or of a part of one.

    Attributes
    ----------
    name : str
        Its address, under which also its work runs, and what was chosen is kept.
    chosen : dict
        What was chosen last, in whatever tab.
    """

    name = ""

    @classmethod
    async def fill(cls, session: Session) -> None:
        """Fill the page of the room."""
        with framed(session, f"/{cls.name}") as complaint:
            room = cls(session, complaint)
        await room.open()

    def __init__(self, session: Session, complaint: Complaint) -> None:
        self.session, self.complaint = session, complaint
        self.chosen: dict[str, Any] = session.chosen.setdefault(self.name, {})
        self._command: ui.column | None = None
        self._shown: list[str] = []

    async def open(self) -> None:  # noqa: B027 (not every room has something to wait for)
        """Show what takes a moment, once the page is there."""

    @abstractmethod
    def arguments(self) -> list[str]:
        """Return the command that does what is chosen, without the word hotlever."""

    def command(self) -> None:
        """Show the command line here, whenever `show_command` is called."""
        self._command, self._shown = ui.column().classes("w-full gap-0"), []

    def show_command(self) -> None:
        """Show the command line of what is chosen now."""
        arguments = self.arguments()
        if self._command is not None and arguments != self._shown:
            self._command.clear()
            self._shown = arguments
            if arguments:
                with self._command:
                    command_shown(arguments, str(self.session.project.folder))
                    if lines := self.python():
                        python_shown(lines)

    def python(self) -> str:
        """Return the lines of Python that do the same, if there are short ones."""
        return ""

    def start(self) -> bool:
        """Run the command; return whether it runs."""
        return self.run(self.arguments())

    def run(self, arguments: list[str]) -> bool:
        """Run a command of the room; return whether it runs."""
        with self.complaint.caught():
            self.session.jobs.start(self.name, arguments)
            return True
        return False


def several(option: str, text: str | None) -> list[str]:
    """Return an option repeated for each of the parts of a text, between commas."""
    parts = filter(None, (part.strip() for part in (text or "").split(",")))
    return [word for part in parts for word in (option, part)]


def probe_names(session: Session) -> dict[str, str]:
    """Return the probes to choose from, none being the reference probe."""
    return {"": REFERENCE} | {name: name for name in session.project.probes}


def choice(label: str, options: Any, value: Any, changed: Any) -> ui.select:
    """Show a choice, the first option if there is none.

    A file that is not there any more stays chosen and is said to be missing: in its place another
    would give other numbers without a word.
    """
    if value is None:
        value = next(iter(options), None)
    elif value not in options:
        options = {**options, value: f"{value} (not in the folder)"}
    select = ui.select(options, label=label, value=value, on_change=changed)
    return select.classes("w-full").props("dense outlined")


def field(label: str, value: str, changed: Any) -> ui.input:
    """Show a line to type in."""
    return ui.input(label, value=value, on_change=changed).classes("w-full").props("dense outlined")
