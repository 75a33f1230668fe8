"""What all pages of a running app share: the project, its processes, and what was chosen last.

What is chosen on the pages is kept in the project's hidden folder from one start to the next; the
models here are the schema of that file. What a page keeps beyond it, such as a result that is
shown, is of one run of the app.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, Field, ValidationError

from hotlever.app.jobs import Jobs
from hotlever.app.project import Project
from hotlever.app.workers import Heard, Worker
from hotlever.errors import HotleverError, InputError
from hotlever.files import json_text, output_folder, read_json, write_text
from hotlever.probe.physics import Physics

#: Seconds after which a process is made ready for the first task: the page comes first.
_LATER_S = 1.5
#: The file of choices, in the hidden folder of a project, and the version of its schema.
CHOICES, SCHEMA = "choices.json", 1
#: What a measurement was made in; empty for what its file says.
Medium = Literal["", "vacuum", "air", "unknown"]
_MEDIUM, _GAP = "medium", "surface_gap_um"
# Values that are changed of a probe, by name: numbers, switches and words.
Changes = dict[str, bool | float | str | None]


def _fit_together(changes: Changes) -> Changes:
    """Check that only what may be a word, a switch or nothing is one."""
    for name, value in changes.items():
        if name in Physics.model_fields:
            fits = isinstance(value, bool)
        elif name == _MEDIUM:
            fits = value in ("vacuum", "air")
        else:
            fits = isinstance(value, float) or (value is None and name == _GAP)
        if not fits:
            raise ValueError(f"{name} = {value}")
    return changes


class Lever(BaseModel):
    """The page Lever: a shape with its changes, or the text of a probe file, and its name.

    The text is None while a parametric shape is open, empty while nothing is; ``saved`` tells the
    file as it was when it was opened or saved here; ``drawing`` is one whose probe file is not
    shown yet.
    """

    shape: Literal["three-leg", "u-shape"] = "three-leg"
    changes: dict[str, float] = {}
    text: str | None = None
    name: str = "my-lever.toml"
    saved: str = ""
    drawing: str | None = None
    mesh: bool = False


class Simulate(BaseModel):
    """The page Simulate: a probe, its sliders, the bias, and the slider's highest (V)."""

    probe: str | None = None
    changes: Annotated[Changes, AfterValidator(_fit_together)] = {}
    bias: float = 8.0
    most: float = 12.0
    view: Literal["rest", "time"] = "rest"


class Pulse(BaseModel):
    """The wave form on the page Simulate: V, µs."""

    kind: Literal["pulse", "train", "step"] = "pulse"
    height: float | None = 10.0
    length: float | None = 5.0
    period: float | None = 20.0
    count: float | None = 5
    until: float | None = None


class Raman(BaseModel):
    """The page Raman."""

    calibration: str = ""
    law: Literal["anharmonic", "linear"] = "anharmonic"
    spectrum: str = ""


class Fit(BaseModel):
    """The page Fit."""

    data: str | None = None
    probe: str | None = None
    without: list[str] = []
    robust: bool = False
    drift: bool = False
    profiles: bool = False
    posterior: bool = False
    medium: Medium = ""
    fixed: str = ""
    free: str = ""
    priors: str = ""


class Calibrate(BaseModel):
    """The page Calibrate."""

    data: str | None = None
    rests: Annotated[str, Field(pattern="^(probe|fit|law):")] = "probe:"
    medium: Medium = ""
    priors: str = ""
    pulse: str = ""


class Levers(BaseModel):
    """The page Levers."""

    data: list[str] | None = None
    probe: str | None = None


class Told(BaseModel):
    """What was told of a measurement file that the file does not say."""

    columns: list[str] = []
    waveform: str = ""


class Choices(BaseModel):
    """All that is chosen, by page; `files` by the name of a measurement, `asked` by quantity."""

    dark: bool = False
    lever: Lever = Lever()
    simulate: Simulate = Simulate()
    pulse: Pulse = Pulse()
    raman: Raman = Raman()
    fit: Fit = Fit()
    calibrate: Calibrate = Calibrate()
    levers: Levers = Levers()
    files: dict[str, Told] = {}
    asked: dict[str, float] = {"tip_K": 600.0, "bias_V": 8.0, "power_mW": 2.0}


class Session:
    """One user, one folder, any number of tabs and reloads.

    Attributes
    ----------
    project : Project
    jobs : Jobs
    workers : dict of str to Worker
        ``quick`` answers sliders while they move, ``full`` solves the full lever and reads results,
        ``making`` makes reduced levers, which take some ten seconds.
    reduced : dict
        Whether the reduced lever of a geometry has been made, or is only asked for.
    shown : dict
        Results that pages show, of this run of the app.
    chosen : dict
        What was chosen last on each page, by the names of `Choices`, be it before the app was
        started.
    remark : str
        Why what was chosen before cannot be read, until a page has said it.
    """

    def __init__(self, project: Project) -> None:
        self.project, self.jobs = project, Jobs(project.folder)
        self.workers: dict[str, Worker] = {}
        self.reduced: dict[Any, bool] = {}
        self.shown: dict[str, Any] = {}
        self.chosen: dict[str, Any] = {}
        self.remark = ""
        self._read_choices()
        self._kept = self._choices_text()
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
            self.workers[name] = Worker()
        return self.workers[name]

    async def ask(
        self, worker: str, function: str, *arguments: Any, heard: Heard | None = None
    ) -> Any:
        """Call ``module:function`` of the app in a process, with the folder of the project.

        Raises
        ------
        HotleverError
            As the function says, or if the process died.
        """
        name, folder = f"hotlever.app.{function}", self.project.folder
        return await self._worker(worker).call(name, folder, *arguments, heard=heard)

    # --- choices ----------------------------------------------------------------------------------

    def choices(self, page: str) -> dict[str, Any]:
        """Return what was chosen last on a page; what never was is as at first."""
        chosen: dict[str, Any] = self.chosen.setdefault(page, {})
        first = Choices().model_dump()[page]
        chosen.update({name: value for name, value in first.items() if name not in chosen})
        return chosen

    def told_of(self, file: str | None) -> dict[str, Any]:
        """Return what was told of a measurement file: its columns, the pulse that was measured."""
        told: dict[str, Any] = self.chosen.setdefault("files", {})
        return told.setdefault(file, Told().model_dump()) if file else Told().model_dump()

    def keep(self) -> None:
        """Write what is chosen, if that has changed; a folder that cannot be written is no end."""
        text = self._choices_text()
        if text != self._kept:
            self._kept = text
            with suppress(HotleverError):
                write_text(output_folder(self.project.hidden) / CHOICES, text)

    def _choices_text(self) -> str:
        return json_text({"schema": SCHEMA, "chosen": self.chosen})

    def _read_choices(self) -> None:
        """Read what was chosen when the app ran last; a file that cannot be read is put aside."""
        path = self.project.hidden / CHOICES
        if not path.exists():
            return
        try:
            content = read_json(path)
            if content.get("schema") != SCHEMA:
                schema = str(content.get("schema"))[:20]
                raise InputError(f"{path}: found schema {schema}, expected {SCHEMA}")
            choices = Choices.model_validate(content.get("chosen"))
            self.chosen = choices.model_dump(exclude_unset=True)
            return
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(part) for part in first["loc"]) or "chosen"
            reason = f"{path}: {where}: {first['msg'][:1].lower()}{first['msg'][1:]}"
        except InputError as error:
            reason = str(error)
        aside = path.with_suffix(".unread.json")
        with suppress(OSError):
            path.replace(aside)
        self.remark = f"{reason}; kept as {aside.name}, what was chosen on the pages begins anew"
