"""What the app wrote into a project, and what was there before, so that it can be undone.

Every file that the app makes, replaces or removes is one of a `Change`: a click, or a command that
a room ran. The version before is copied into the project's hidden folder first.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from hotlever.errors import InputError
from hotlever.files import Outputs, kept_before_writing, output_folder, whole_file

#: Folder of a project for what is the app's own.
HIDDEN = ".hotlever"
_FOLDER, _LIST = "changes", "files.jsonl"
_SCHEMA = 1
#: Changes that are kept, and bytes of all that was there before them; the oldest go first.
_MOST, _MOST_BYTES = 200, 2**29
_UNDONE, _AGAIN = "undone: ", "done again: "


class _Head(BaseModel):
    """The first line of the list of a change."""

    schema_: Literal[1] = Field(alias="schema")
    what: str


class _Entry(BaseModel):
    """A file of a change; names of ours are numbers: another would lead out of the folder."""

    file: str
    before: Annotated[str, Field(pattern=r"^[0-9]+$")] | None


@dataclass
class Change:
    """Files that were written together.

    Attributes
    ----------
    folder : path
        Where the versions before are kept; its name is the time in nanoseconds.
    what : str
        The click, or the command line.
    before : dict
        Name of the version before by the name of a file in the project; None if there was none.
    """

    folder: Path
    what: str
    before: dict[str, str | None] = field(default_factory=dict)

    @property
    def time_s(self) -> float:
        """When it began, as files are stamped."""
        return int(self.folder.name) / 1e9

    @classmethod
    def from_folder(cls, folder: Path) -> Change | None:
        """Read a change; None if the folder holds none that can be understood."""
        try:
            head, *entries = (folder / _LIST).read_text(encoding="utf-8").splitlines()
            change = cls(folder, _Head.model_validate_json(head).what)
            for entry in map(_Entry.model_validate_json, entries):
                change.before[entry.file] = entry.before
        except (OSError, ValueError):
            return None
        return change if folder.name.isdecimal() else None

    def add(self, name: str, path: Path) -> None:
        """Keep the version that is there of a file, if this change has none of it yet."""
        if name in self.before:
            return
        if not self.before:
            output_folder(self.folder)
            self._append({"schema": _SCHEMA, "what": self.what})
        version = str(len(self.before)) if path.exists() else None
        if version is not None:
            shutil.copyfile(path, self.folder / version)
        self._append({"file": name, "before": version})
        self.before[name] = version

    def _append(self, line: dict[str, object]) -> None:
        with (self.folder / _LIST).open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


class Changes:
    """The changes of a project, whichever process made them.

    Parameters
    ----------
    folder : path
        Of the project.
    """

    def __init__(self, folder: Path) -> None:
        self._project = folder.resolve()
        self._folder = self._project / HIDDEN / _FOLDER

    @contextmanager
    def recorded(self, what: str) -> Iterator[None]:
        """Keep what was there of all files that are written or removed inside the block.

        A block inside of another belongs to the change of the outer one.
        """
        if _running.get() is not None:
            yield
            return
        change = Change(self._folder / str(time.time_ns()), what)
        before = _running.set(change)
        try:
            with kept_before_writing(self._keep):
                yield
        finally:
            _running.reset(before)
            if change.before:
                self._forget_oldest()

    def remove(self, path: Path) -> None:
        """Remove a file of the project, if it is there; what it held is kept."""
        if path.is_file():
            with self.recorded(f"removed {path.name}"):
                self._keep(path)
                path.unlink()

    def _keep(self, path: Path) -> None:
        change = _running.get()
        hidden = path.is_relative_to(self._project / HIDDEN)
        if change is not None and path.is_relative_to(self._project) and not hidden:
            change.add(path.relative_to(self._project).as_posix(), path)

    def latest(self, most: int = _MOST) -> list[Change]:
        """Return the changes, the latest first."""
        changes = map(Change.from_folder, reversed(self._folders()))
        return [change for change in changes if change is not None and change.before][:most]

    def undo(self, change: Change) -> None:
        """Make the files of a change what they were before it; itself a change.

        Raises
        ------
        InputError
            If a version that was there before is not kept any more, or one of the files is not in
            the folder of the project.
        """
        what = change.what
        again = what.startswith(_UNDONE)
        what = f"{_AGAIN if again else _UNDONE}{what.removeprefix(_UNDONE).removeprefix(_AGAIN)}"
        paths = {name: (self._project / name).resolve() for name in change.before}
        for name, path in paths.items():
            version = change.before[name]
            if not path.is_relative_to(self._project):
                raise InputError(f"{name}: is not in the folder of the project")
            if version is not None and not (change.folder / version).is_file():
                raise InputError(f"{name}: what was there before is not kept any more")
        with self.recorded(what):
            with Outputs().together():
                for name, version in change.before.items():
                    if version is not None:
                        output_folder(paths[name].parent)
                        with whole_file(paths[name]) as temporary:
                            shutil.copyfile(change.folder / version, temporary)
            for name, version in change.before.items():
                if version is None:
                    self.remove(paths[name])

    def _folders(self) -> list[Path]:
        """Return the folders of the changes, the oldest first."""
        folders = (path for path in self._folder.glob("*") if path.name.isdecimal())
        return sorted(folders, key=lambda path: int(path.name))

    def _forget_oldest(self) -> None:
        size = 0
        for number, folder in enumerate(reversed(self._folders())):
            with suppress(OSError):  # another process may be as far
                size += sum(path.stat().st_size for path in folder.iterdir())
            if number and (number >= _MOST or size > _MOST_BYTES):
                shutil.rmtree(folder, ignore_errors=True)


#: The change that is being made.
_running: ContextVar[Change | None] = ContextVar("change", default=None)
