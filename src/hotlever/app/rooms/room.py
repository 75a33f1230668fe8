"""What rooms share: a form that writes a command line, and the command run."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from nicegui import ui

from hotlever.app.page import Complaint, command_shown
from hotlever.app.session import Session

MEDIA = {"": "as the files say", "vacuum": "vacuum", "air": "air"}


class Room(ABC):
    """One tab of a room.

    Attributes
    ----------
    name : str
        Under which its work runs, and what was chosen is kept.
    chosen : dict
        What was chosen last, in whatever tab.
    """

    name = ""

    def __init__(self, session: Session, complaint: Complaint) -> None:
        self.session, self.complaint = session, complaint
        self.chosen: dict[str, Any] = session.chosen.setdefault(self.name, {})
        self._command: ui.column | None = None
        self._shown: list[str] = []

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

    def start(self) -> bool:
        """Run the command; return whether it runs."""
        with self.complaint.caught():
            self.session.jobs.start(self.name, self.arguments())
            return True
        return False


def several(option: str, text: str | None) -> list[str]:
    """Return an option repeated for each of the parts of a text, between commas."""
    parts = filter(None, (part.strip() for part in (text or "").split(",")))
    return [word for part in parts for word in (option, part)]


def choice(label: str, options: Any, value: Any, changed: Any) -> ui.select:
    """Show a choice; one that is no option any more is the first."""
    value = value if value in options else next(iter(options), None)
    select = ui.select(options, label=label, value=value, on_change=changed)
    return select.classes("w-full").props("dense outlined")


def field(label: str, value: str, changed: Any) -> ui.input:
    """Show a line to type in."""
    return ui.input(label, value=value, on_change=changed).classes("w-full").props("dense outlined")
