"""The state of a project: the record of all that is chosen on its pages, and of results.

`Choices` is a step of its history (`hotlever.app.session`). What pages have chosen as at first is
its defaults.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, Field

from hotlever.probe.surroundings import Physics

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
    """The page Lever: the text of a probe file, and its name.

    The text is None before the page is opened, empty while nothing is open; ``saved`` tells the
    file as it was when it was opened or saved here, ``save_as`` the name that was typed;
    ``drawing`` is one whose probe file is not shown yet.
    """

    text: str | None = None
    name: str = "my-lever.toml"
    save_as: str = ""
    saved: str = ""
    drawing: str | None = None
    mesh: bool = False


class ChangedProbe(BaseModel):
    """A lever of the page Simulate: a probe and its sliders."""

    probe: str | None = None
    changes: Annotated[Changes, AfterValidator(_fit_together)] = {}


class Simulate(ChangedProbe):
    """The page Simulate: a lever, the bias, and the slider's highest (V); and one beside it.

    That is in another medium, of another probe, or one that is ``kept``. A table is by the bias, or
    of states that are ``held`` at set points of a resistance or a power.
    """

    beside: Annotated[str, Field(pattern="^(|vacuum|air|now|probe:.*)$")] = ""
    kept: ChangedProbe = ChangedProbe()
    bias: float = 8.0
    most: float = 12.0
    view: Literal["rest", "time", "signals"] = "rest"
    held: Literal["", "resistance", "power"] = ""
    set_points: str = ""


class Pulse(BaseModel):
    """The wave form on the page Simulate: V, µs."""

    kind: Literal["pulse", "train", "step"] = "pulse"
    height: float | None = 10.0
    length: float | None = 5.0
    period: float | None = 20.0
    count: float | None = 5
    until: float | None = None


class Signals(BaseModel):
    """Small signals on the page Simulate, or the amplitude of those that are not."""

    lowest_Hz: float | None = 1.0
    highest_Hz: float | None = 1e7
    count: float | None = 71
    amplitude_V: float | None = None


class Contact(BaseModel):
    """The page Contact: a probe, what its tip touches, the bias, and the slider's highest (V).

    What is None or empty is what the probe file says, or what is usual.
    """

    probe: str | None = None
    medium: Literal["", "vacuum", "air"] = ""
    sample: str = ""
    radius_nm: float | None = None
    interface: float | None = None
    bias: float = 8.0
    most: float = 12.0


class Reader(BaseModel):
    """The page Reader: a probe over a surface, the bias (V), the slider's highest, and noise.

    What is None is what the probe file says, or what is usual.
    """

    probe: str | None = None
    distance_um: float = 0.5
    tilt_deg: float | None = None
    accommodation: float | None = None
    amplifier_nV: float = 5.0
    hooge: float = 0.0
    bias: float = 9.0
    most: float = 12.0


class Design(BaseModel):
    """The page Design: one or two numbers of a probe that are varied, and the power (mW)."""

    probe: str | None = None
    first: str | None = "heater_length_um"
    first_from: float | None = 3.0
    first_to: float | None = 6.0
    first_count: float | None = 5
    second: str | None = None
    second_from: float | None = None
    second_to: float | None = None
    second_count: float | None = 5
    power: float | None = 2.0
    annealing_K: float | None = None
    annealing_min: float | None = None
    air: bool = True


class Materials(BaseModel):
    """The page Materials: of which probe file; empty for all that levers can be made of."""

    probe: str | None = None


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


class Next(BaseModel):
    """What to measure next: where the error counts (K), and what the tip is to stay below."""

    at: float | None = None
    stay_below: float | None = None


class Levers(BaseModel):
    """The page Levers."""

    data: list[str] | None = None
    probe: str | None = None
    command: Literal["fit", "calibrate"] = "fit"


class FileMetadata(BaseModel):
    """What was told of a measurement file that the file does not say."""

    columns: list[str] = []
    waveform: str = ""


class Choices(BaseModel):
    """All that is chosen, by page; `files` by the name of a measurement, `asked` by quantity."""

    lever: Lever = Lever()
    simulate: Simulate = Simulate()
    pulse: Pulse = Pulse()
    signals: Signals = Signals()
    contact: Contact = Contact()
    reader: Reader = Reader()
    design: Design = Design()
    materials: Materials = Materials()
    raman: Raman = Raman()
    fit: Fit = Fit()
    calibrate: Calibrate = Calibrate()
    next: Next = Next()
    levers: Levers = Levers()
    files: dict[str, FileMetadata] = {}
    asked: dict[str, float] = {"tip_K": 600.0, "bias_V": 8.0, "power_mW": 2.0}


class Result(BaseModel):
    """What a task drew last for a page: the task, what it told, and when its figure was drawn.

    A result is of its files, which are not undone with what is chosen.
    """

    command: str
    files: list[str]
    options: dict[str, Any]
    numbers: list[tuple[str, str]]
    text: str = ""
    stamp: float
