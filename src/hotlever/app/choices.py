"""What is chosen on the pages of a project, kept in its hidden folder from one start to the next.

The models here are the schema of that file. What a page keeps beyond it, such as a result that is
shown, is of one run of the app.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, Field, ValidationError

from hotlever.errors import HotleverError, InputError
from hotlever.files import json_text, output_folder, read_json, write_text

#: The file, in the hidden folder of a project.
CHOICES = "choices.json"
#: Version of the schema below.
SCHEMA = 1
#: What a measurement was made in; empty for what its file says.
Medium = Literal["", "vacuum", "air", "unknown"]
_MEDIUM, _GAP = "medium", "surface_gap_um"


def _fit_together(changes: dict[str, float | str | None]) -> dict[str, float | str | None]:
    """Check that only what may be a word, or nothing, is one."""
    for name, value in changes.items():
        if name == _MEDIUM:
            fits = value in ("vacuum", "air")
        else:
            fits = isinstance(value, float) or (value is None and name == _GAP)
        if not fits:
            raise ValueError(f"{name} = {value}")
    return changes


class Lever(BaseModel):
    """The room Lever: a shape with its changes, or the text of a probe file, and its name."""

    shape: Literal["three-leg", "u-shape"] = "three-leg"
    changes: dict[str, float] = {}
    text: str | None = None
    name: str = ""
    saved: str = ""
    drawing: str | None = None
    mesh: bool = False


class Simulate(BaseModel):
    """The room Simulate: a probe, its sliders, and the bias."""

    probe: str | None = None
    changes: Annotated[dict[str, float | str | None], AfterValidator(_fit_together)] = {}
    bias: float = 0.0
    most: float = 0.0
    view: Literal["rest", "time"] = "rest"


class Pulse(BaseModel):
    """The wave form in the room Simulate."""

    kind: Literal["pulse", "train", "step"] = "pulse"
    height: float | None = None
    length: float | None = None
    period: float | None = None
    count: float | None = None
    until: float | None = None


class Raman(BaseModel):
    """The room Raman."""

    calibration: str = ""
    law: Literal["anharmonic", "linear"] = "anharmonic"
    spectrum: str = ""


class Fit(BaseModel):
    """The room Fit."""

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
    """The room Calibrate."""

    data: str | None = None
    rests: Annotated[str, Field(pattern="^(probe|fit|law):")] = "probe:"
    medium: Medium = ""
    priors: str = ""
    pulse: str = ""


class Levers(BaseModel):
    """The room Levers."""

    data: list[str] = []
    probe: str | None = None


class Told(BaseModel):
    """What was told of a measurement file that the file does not say."""

    columns: list[str] = []
    waveform: str = ""


class Choices(BaseModel):
    """All that is chosen, by room; `files` by the name of a measurement, `asked` by quantity."""

    dark: bool = False
    lever: Lever = Lever()
    simulate: Simulate = Simulate()
    pulse: Pulse = Pulse()
    raman: Raman = Raman()
    fit: Fit = Fit()
    calibrate: Calibrate = Calibrate()
    levers: Levers = Levers()
    files: dict[str, Told] = {}
    asked: dict[str, float] = {}


def read_choices(folder: Path) -> tuple[dict[str, Any], str]:
    """Return what was chosen when the app ran last, and a line if that cannot be read.

    A file that cannot be read is put aside, and nothing is chosen.

    Parameters
    ----------
    folder : path
        The hidden folder of the project.
    """
    path = folder / CHOICES
    if not path.exists():
        return {}, ""
    try:
        content = read_json(path)
        if content.get("schema") != SCHEMA:
            found = str(content.get("schema"))[:20]
            raise InputError(f"{path}: found schema {found}, expected {SCHEMA}")
        return Choices.model_validate(content.get("chosen")).model_dump(exclude_unset=True), ""
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "chosen"
        said = f"{path}: {where}: {first['msg'][:1].lower()}{first['msg'][1:]}"
    except InputError as error:
        said = str(error)
    aside = path.with_suffix(".unread.json")
    with suppress(OSError):
        path.replace(aside)
    return {}, f"{said}; kept as {aside.name}, what was chosen on the pages begins anew"


class Keeper:
    """Writes what is chosen whenever it is other than what was written last.

    Parameters
    ----------
    folder : path
        The hidden folder of the project; made when there is something to keep.
    chosen : dict
        What is chosen, as the pages change it.
    """

    def __init__(self, folder: Path, chosen: dict[str, Any]) -> None:
        self._folder, self._chosen = folder, chosen
        self._written = self._text()

    def keep(self) -> None:
        """Write what is chosen, if that has changed; a folder that cannot be written is no end."""
        text = self._text()
        if text != self._written:
            self._written = text
            with suppress(HotleverError):
                write_text(output_folder(self._folder) / CHOICES, text)

    def _text(self) -> str:
        return json_text({"schema": SCHEMA, "chosen": self._chosen})
