"""The probe file that is open in the room Lever: nobody's edits are lost to another one."""

from __future__ import annotations

import hashlib
from typing import Any

from hotlever.app.page import asked
from hotlever.app.project import LARGEST_PROBE, safe_name
from hotlever.app.session import Session
from hotlever.errors import InputError
from hotlever.files import read_text


class ProbeFile:
    """What is chosen of a probe file, and the file of that name in the project.

    Parameters
    ----------
    session : Session
    chosen : dict
        What was chosen last in the room: ``name``, ``text`` (None while a parametric shape is
        open, empty while nothing is), and ``saved``, which tells the file as it was when it was
        opened or saved here.
    """

    def __init__(self, session: Session, chosen: dict[str, Any]) -> None:
        self._session, self._chosen = session, chosen

    @property
    def text(self) -> str | None:
        """The text as it is edited."""
        text: str | None = self._chosen["text"]
        return text

    @property
    def is_edited(self) -> bool:
        """Whether there are edits of a text that are not saved."""
        return bool(self.text) and _digest(self.text) != self._chosen.get("saved")

    def open(self, name: str) -> str:
        """Read a file of the project; return its text.

        Raises
        ------
        InputError
            If it is no text file, or too large for a probe file.
        """
        text = read_text(self._session.project.path(name), largest=LARGEST_PROBE)
        self._chosen |= {"name": name, "text": text, "saved": _digest(text)}
        return text

    def take_up(self) -> None:
        """Take the file as it is now, unless it was edited here: others may have changed it.

        Raises
        ------
        InputError
            As `open`.
        """
        name = self._chosen.get("name")
        if self.text and not self.is_edited and name and self._session.project.stamp(name):
            self.open(name)

    async def may_go(self) -> bool:
        """Ask whether edits that are not saved may go, if there are any."""
        question = "The probe file that is open here has edits that are not saved."
        return not self.is_edited or await asked(question, "Drop them", "Go on with it")

    async def save(self, name: str, text: str) -> str | None:
        """Write a text; ask before another file of its name is replaced.

        Returns
        -------
        str or None
            The name that it has now; None if it was not to be written.

        Raises
        ------
        InputError
            If there is nothing to be written, or what is there is no probe file.
        """
        if not text.strip():
            raise InputError("there is no probe here yet: drop a drawing, or choose a shape")
        project = self._session.project
        name = safe_name(name)
        name = name if name.endswith(".toml") else f"{name}.toml"
        path = project.path(name)
        there = read_text(path, largest=LARGEST_PROBE) if path.exists() else None
        if there not in (None, text):
            is_own = name == self._chosen.get("name") and _digest(there) == self._chosen["saved"]
            question = f"{name} is there already, and holds something else than was opened here."
            if not is_own and not await asked(question, "Replace it", "Keep it"):
                return None
        if there != text:
            project.write(name, text, f"saved {name}")
        self._chosen |= {"name": name, "saved": _digest(text)}
        return name


def _digest(text: str | None) -> str:
    """Return what tells whether a text is as it was."""
    return "" if text is None else hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()
