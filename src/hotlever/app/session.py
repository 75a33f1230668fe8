"""What all pages of a running app share: what is chosen on them, with its history, and processes.

The history is a list of records. Undo, redo and the next start of the app take a record of the
list, which is one file in the project's hidden folder.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, ValidationError

from hotlever.app.jobs import Jobs
from hotlever.app.project import Project
from hotlever.app.state import Choices, FileMetadata, Result
from hotlever.app.workers import Heard, Worker
from hotlever.errors import HotleverError, InputError
from hotlever.files import output_folder, read_json, without_nan, write_text
from hotlever.records import explained

#: The file of the history, in the hidden folder of a project, and the version of its schema.
CHOICES, SCHEMA = "choices.json", 2
#: Records that are kept, and characters of all of them; the oldest go first.
_MOST, _MOST_TEXT = 100, 2**21
#: Seconds within which what goes on changing, as under a slider, is one change.
_MOVING_S = 3.0
#: Seconds after which a process is made ready for the first task: the page comes first.
_LATER_S = 1.5
#: What files were when they were opened or saved: undoing a choice undoes no saving.
_OF_FILES = ("saved",)


class _File(BaseModel):
    """The file of a history: its records, the oldest first, and the number of the one shown."""

    dark: bool = False
    results: dict[str, Result] = {}
    shown: Annotated[int, Field(ge=0)] = 0
    history: Annotated[list[Choices], Field(min_length=1)]


#: Of each page, what is chosen and is not as at first.
Record = dict[str, dict[str, Any]]
_AT_FIRST = Choices().model_dump()


class History:
    """What is chosen in a project, and its history.

    Parameters
    ----------
    hidden : path
        Folder of the project for what is the app's own; it may not exist yet.

    Attributes
    ----------
    results : dict of str to Result
        What was drawn last, by page.
    chosen : dict
        What was chosen last on each page, by the names of `Choices`, be it before the app was
        started. Pages hold its dictionaries, which are therefore changed and not replaced.
    dark : bool
        How pages look: kept, but no step of the history.
    remark : str
        What a page is to say once: what was undone, or why a history cannot be read.
    """

    def __init__(self, hidden: Path) -> None:
        self._path = hidden / CHOICES
        self.chosen: Record = {}
        self.results: dict[str, Result] = {}
        self.dark, self.remark = False, ""
        self._history: list[Record] = [{}]
        self._position = 0
        #: What moved last, and when.
        self._last_move: tuple[set[str], float] = set(), 0.0
        self._read()
        self._written = self._beside()

    def choices(self, page: str) -> dict[str, Any]:
        """Return what was chosen last on a page; what never was is as at first."""
        chosen = self.chosen.setdefault(page, {})
        first = deepcopy(_AT_FIRST[page])
        chosen.update({name: value for name, value in first.items() if name not in chosen})
        return chosen

    def metadata_of(self, file: str | None) -> dict[str, Any]:
        """Return what was told of a measurement file: its columns, the pulse that was measured."""
        first = FileMetadata().model_dump()
        return self.chosen.setdefault("files", {}).setdefault(file, first) if file else first

    # --- history ----------------------------------------------------------------------------------

    def keep(self) -> None:
        """Take what has changed as a step of the history; what goes on changing is one step."""
        record, now = _record(self.chosen), time.monotonic()
        before = self._history[self._position]
        what = _differing(before, record)
        if what:
            del self._history[self._position + 1 :]
            if (
                self._last_move[0] == what
                and now - self._last_move[1] < _MOVING_S
                and self._position
            ):
                del self._history[-1]
            if record != self._history[-1]:  # it may have moved back
                self._history.append(record)
            self._last_move = what, now
            self._forget_oldest()
            self._position = len(self._history) - 1
        else:
            self._history[self._position] = record
        if record != before or self._written != self._beside():
            self._write()

    def settle(self) -> None:
        """Count what a page chose by itself, while it was opened, to the last step."""
        record = _record(self.chosen)
        if record != self._history[self._position]:
            self._history[self._position] = record
            self._write()

    def step(self, by: int) -> set[str]:
        """Go back by one step (-1), or on again (1).

        Returns
        -------
        set of str
            The names in `Choices` of what has changed; none at the end of the history.
        """
        self.keep()
        to = self._position + by
        if not 0 <= to < len(self._history):
            self.remark = f"There is nothing to {'undo' if by < 0 else 'do again'}."
            return set()
        what = _differing(self._history[self._position], self._history[to])
        self._position, self._last_move = to, (set(), 0.0)
        for page in {*self.chosen, *self._history[to]}:
            values = self.chosen.setdefault(page, {})
            of_files = {key: values[key] for key in _OF_FILES if key in values}
            values.clear()
            values.update(deepcopy(_AT_FIRST[page] | self._history[to].get(page, {})) | of_files)
        self.remark = f"{'Undone' if by < 0 else 'Done again'}: {', '.join(sorted(what))}."
        self._write()
        return {name.partition(",")[0] for name in what}

    def _forget_oldest(self) -> None:
        sizes = [len(str(record)) for record in self._history]
        while len(sizes) > 1 and (len(sizes) > _MOST or sum(sizes) > _MOST_TEXT):
            del sizes[0], self._history[0]

    # --- its file ---------------------------------------------------------------------------------

    def _write(self) -> None:
        """Write the history; a folder that cannot be written is no end."""
        self._written = self._beside()
        content = {**self._written, "shown": self._position, "history": self._history}
        text = json.dumps(without_nan({"schema": SCHEMA, **content}), ensure_ascii=False)
        with suppress(HotleverError):
            write_text(output_folder(self._path.parent) / CHOICES, text)

    def _beside(self) -> dict[str, Any]:
        """Return what is kept and is no step of the history."""
        results = {page: result.model_dump() for page, result in self.results.items()}
        return {"dark": self.dark, "results": results}

    def _read(self) -> None:
        """Read the history when the app starts; a file that cannot be read is put aside."""
        if not self._path.exists():
            return
        try:
            content = read_json(self._path)
            if content.get("schema") == 1:  # of a former version, which had the last record alone
                chosen = content.get("chosen")
                dark = isinstance(chosen, dict) and chosen.pop("dark", False)
                content = {"schema": SCHEMA, "dark": dark, "history": [chosen]}
            if content.get("schema") != SCHEMA:
                schema = str(content.get("schema"))[:20]
                raise InputError(f"{self._path}: found schema {schema}, expected {SCHEMA}")
            read = _File.model_validate(content)
            self._history = [_record(record.model_dump()) for record in read.history]
            self._position = min(read.shown, len(self._history) - 1)
            self.chosen = deepcopy(self._history[self._position])
            self.dark, self.results = read.dark, read.results
            return
        except ValidationError as error:
            reason = str(explained(error, _File, str(self._path)))
        except InputError as error:
            reason = str(error)
        aside = self._path.with_suffix(".unread.json")
        with suppress(OSError):
            self._path.replace(aside)
        self.remark = f"{reason}; kept as {aside.name}, what was chosen on the pages begins anew"


def _record(chosen: Mapping[str, Any]) -> Record:
    """Return what is chosen, without what is as at first."""
    record = {}
    for page, values in chosen.items():
        first = _AT_FIRST.get(page, {})
        if page == "files":
            first = dict.fromkeys(values, FileMetadata().model_dump())
        others = {key: value for key, value in values.items() if key in first}
        others = {key: deepcopy(value) for key, value in others.items() if value != first[key]}
        if others:
            record[page] = others
    return record


def _differing(first: Record, second: Record) -> set[str]:
    """Return what differs between two records, in words: the page, and what of it."""
    return {
        f"{page}, {key.replace('_', ' ')}"
        for page in {*first, *second}
        for key in _keys(first.get(page, {}), second.get(page, {}))
    }


def _keys(first: Mapping[str, Any], second: Mapping[str, Any]) -> Iterator[str]:
    """Return the keys of different values, those of values that are themselves of several."""
    for key in {*first, *second}:
        mine, others = first.get(key), second.get(key)
        if key in _OF_FILES:
            continue
        if key == "changes":
            yield from _keys(mine or {}, others or {})
        elif mine != others:
            yield key


class Session(History):
    """One user, one folder, any number of tabs and reloads.

    Attributes
    ----------
    project : Project
    jobs : Jobs
    workers : dict of str to Worker
        ``quick`` answers sliders while they move, ``full`` solves the full lever and reads results,
        ``making`` makes reduced levers, which take some ten seconds; ``beside`` solves a lever that
        is compared.
    reduced : dict
        Whether the reduced lever of a geometry has been made, or is only asked for.
    """

    def __init__(self, project: Project) -> None:
        super().__init__(project.hidden)
        self.project, self.jobs = project, Jobs(project.folder)
        self.workers: dict[str, Worker] = {}
        self.reduced: dict[Any, bool] = {}
        self._preparing: asyncio.Task[None] | None = None

    # --- processes --------------------------------------------------------------------------------

    async def start(self) -> None:
        """Start the processes, so that they are ready when they are asked."""
        self._preparing = asyncio.create_task(self._prepare())

    async def _prepare(self) -> None:
        self._worker("full")
        self._worker("quick")
        await asyncio.sleep(_LATER_S)
        self.jobs.prepare()

    def _worker(self, name: str) -> Worker:
        if name not in self.workers:
            self.workers[name] = Worker(self.project.folder)
        return self.workers[name]

    async def ask(
        self, worker: str, function: str, *arguments: Any, heard: Heard | None = None
    ) -> Any:
        """Call ``module:function`` of the app in a process.

        Raises
        ------
        HotleverError
            As the function says, or if the process died.
        """
        name = f"hotlever.app.{function}"
        return await self._worker(worker).call(name, *arguments, heard=heard)
