"""Arguments and options that several commands share, each declared once.

A single one is the type of a parameter; those that belong together are the fields of a dataclass,
and a parameter of this type stands for all of them. Beside what the command line says of it stands,
with one that names what is written, what that is (`Written`).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol, get_args

from typer import Argument, Option

from hotlever.errors import InputError, excerpt, unknown_name
from hotlever.files import FIGURE_TYPES, FOLDER
from hotlever.tasks.parsing import parse_priors, parse_settings

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from hotlever.lever import Lever
    from hotlever.lever.transient import Waveform
    from hotlever.probe import Probe
    from hotlever.types import Progress


@dataclass(frozen=True)
class Written:
    """Marks a parameter that names a file which is written, or a folder.

    Attributes
    ----------
    types : tuple of str
        How the name of the file may end; `FOLDER` for a folder.
    types_of : callable, optional
        Tells this where it depends on other parameters, of whose values by name it is given all.
    """

    types: tuple[str, ...] = FOLDER
    types_of: Callable[[Mapping[str, Any]], tuple[str, ...]] | None = None


# --- of several commands ------------------------------------------------------------------------

ProbeFile = Annotated[
    Path | None,
    Argument(metavar="[PROBE.toml]", help="Probe file; the reference probe if left out."),
]
Physics = Annotated[
    str | None,
    Option(
        metavar="EFFECT,...",
        help="thermoelectric, radiation or both: effects that count beyond the paper's, or none; "
        "what the probe file says if left out.",
    ),
]
Plot = Annotated[
    Path | None, Option(help="Draw to this file: .png, .svg or .pdf."), Written(FIGURE_TYPES)
]
Table = Annotated[
    Path | None,
    Option("-o", "--output", help="FILE.csv or FILE.nc; standard output if left out."),
    Written((".csv", ".nc")),
]


@dataclass(frozen=True)
class LeverArguments:
    """A lever that is solved: a probe, and what is changed of it.

    Attributes
    ----------
    medium
        vacuum or air; what the files say if left out.
    set : NAME=VALUE
        Change a value of the probe file.
    """

    probe: ProbeFile = None
    medium: str | None = None
    set: list[str] | None = None
    physics: Physics = None


@dataclass(frozen=True)
class WaveformOptions:
    """A wave form of the bias.

    Attributes
    ----------
    step : V
        Switch the bias on, and leave it.
    pulse : V,TIME
        A pulse, such as 10V,5us.
    period : TIME
        Of pulses that are repeated.
    count : N
        Number of pulses.
    ramp : V,TIME
        Raise the bias, such as 8V,50us.
    sine : V+V@FREQ
        Such as 3V+0.5V@20kHz.
    waveform
        A table of times and biases, such as a supply takes.
    """

    step: str | None = None
    pulse: str | None = None
    period: str | None = None
    count: int | None = None
    ramp: str | None = None
    sine: str | None = None
    waveform: Path | None = None

    def read(self) -> Waveform | None:
        """Return the one wave form that is told by a text or in a file; None if none is.

        Raises
        ------
        InputError
            If several are told, or one cannot be understood.
        """
        from hotlever.lever.transient import read_waveform
        from hotlever.lever.transient.waveform import waveform_from_text

        told = {"step": self.step, "pulse": self.pulse, "ramp": self.ramp, "sine": self.sine}
        at_most_one(**told, waveform=self.waveform)
        if self.pulse is None:
            refuse("goes with --pulse", period=self.period, count=self.count)
        if self.waveform is not None:
            return read_waveform(self.waveform)
        for kind, text in told.items():
            if text is not None:
                return waveform_from_text(kind, text, self.period, self.count, mark="--")
        return None

    def notes(self, told: Waveform) -> list[str]:
        """Return what should be known of the wave form that is told."""
        if self.waveform is None or not told.before_V:
            return []
        return [
            f"{told.text}: the lever rests at its first bias, {told.before_V:g} V, before it; a "
            "cold lever needs 0 V there"
        ]


@dataclass(frozen=True)
class HistoryOptions(WaveformOptions):
    """A wave form, and the times that are reported.

    Attributes
    ----------
    until : TIME
        When to stop.
    at : TIME,...
        Times to report; where the solver stepped if left out.
    """

    until: str | None = None
    at: str | None = None


@dataclass(frozen=True)
class PriorOptions:
    """What is known of a lever before it is measured: one like it, its physics, priors and laws.

    Attributes
    ----------
    probe
        Probe file of levers like these; the reference probe if left out.
    prior : NAME=VALUE±SPREAD
        What is known beforehand, as n_d=3.3e17±15%, n_d=1e17×/3 (to a factor), dimensions=±2%,
        usual (what a calibration takes) or none; repeated.
    laws : paper|uncertain
        Whether laws of silicon hold to the letter or are as uncertain as published values differ;
        left out: uncertain in a calibration, the paper's in a fit.
    """

    probe: Path | None = None
    physics: Physics = None
    prior: list[str] | None = None
    laws: str | None = None

    def priors(self, probe: Probe) -> dict[str, str] | None:
        """Return what is known of a probe like it, as `parse_priors` does."""
        laws = [] if self.laws is None else [f"laws={self.laws}"]
        return parse_priors([*(self.prior or []), *laws], probe)


@dataclass(frozen=True)
class MeasuredOptions(PriorOptions):
    """What is known before a lever is measured, and what its files do not say themselves.

    Attributes
    ----------
    medium
        vacuum, air or unknown (both are tried); what the files say if left out.
    column : 'QUANTITY (UNIT)=NAME'
        Which column of the data is which quantity, as 'I_h (uA)=Current' or by its number; or a
        file of such lines; repeated.
    """

    medium: str | None = None
    column: list[str] | None = None


def _types_of_results(values: Mapping[str, Any]) -> tuple[str, ...]:
    return FOLDER if len(values["data"]) > 1 else (".json",)


@dataclass(frozen=True)
class DataArguments:
    """Data files of one lever or several, where results go, and who works on them.

    Attributes
    ----------
    data : DATA.csv...
        Measurement files, one for each lever.
    output
        Result file (JSON); a folder of them with several data files.
    report
        Write a page with figures to this folder.
    processes : N
        Local processes; one for each processor if left out.
    scheduler : ADDRESS
        Dask scheduler for several data files, as tls://HOST:8786.
    """

    data: Annotated[list[Path], Argument()]
    output: Annotated[Path | None, Written(types_of=_types_of_results)] = None
    report: Annotated[Path | None, Written()] = None
    processes: int | None = None
    scheduler: str | None = None


# --- what options tell together -----------------------------------------------------------------


def _stated(options: Mapping[str, Any]) -> list[str]:
    """Return the options, by the names of their parameters, that are stated."""
    return [
        f"--{name.replace('_', '-')}"
        for name, value in options.items()
        if value is not None and value is not False
    ]


def refuse(why: str, **options: Any) -> None:
    """Refuse options of which any would do nothing, or contradict.

    Examples
    --------
    >>> refuse("goes with --pulse", period=None, count=None)
    >>> refuse("goes with --pulse", period="5us", count=None)
    Traceback (most recent call last):
    ...
    hotlever.errors.InputError: --period: goes with --pulse
    """
    for option in _stated(options):
        raise InputError(f"{option}: {why}")


def at_most_one(**options: Any) -> None:
    """Refuse several of some options."""
    if len(stated := _stated(options)) > 1:
        raise InputError(f"{' and '.join(stated)}: expected only one of them")


def refuse_set(changes: Iterable[str], option: str, keys: Collection[str]) -> None:
    """Refuse what ``--set`` says, by name, of `keys` that an option states too."""
    for name in changes:
        if name.rpartition(".")[2] in keys:
            raise InputError(f"--set {name}: it is what --{option} states, expected one of them")


def check_medium(medium: str | None, *more: str) -> None:
    """Refuse a medium that does not exist."""
    from hotlever.probe.surroundings import Medium

    media = *get_args(Medium), *more
    if medium is not None and medium not in media:
        raise InputError(f"--medium {excerpt(medium)}: expected {' or '.join(media)}")


class Reporter(Protocol):
    """Who hears what a command tells beside the files that it writes: a terminal, or the app."""

    def note(self, *texts: str) -> None:
        """Say what should be known beside the result."""

    def progress(self, label: str) -> AbstractContextManager[Progress]:
        """Show how far the block is, which calls (steps done, steps in all)."""

    def give(self, result: str) -> None:
        """Give the result as text."""

    def tell(self, text: str) -> None:
        """Say something in one line."""

    def fail(self, message: str) -> None:
        """Say what went wrong with a part of the work."""

    def tell_table(self, rows: Sequence[Sequence[str]]) -> None:
        """Show rows of cells."""

    def show(self, what: str, content: Any) -> None:
        """Show what can be drawn on the way to the result, as the ``curve`` of a fit."""

    def progress_bars(self, *labels: str) -> AbstractContextManager[tuple[Progress, ...]]:
        """Show how far several parts of the work are, each from its first call on."""


def read_probe(
    reporter: Reporter,
    path: Path | None,
    settings: Sequence[str] | None = None,
    physics: str | None = None,
) -> Probe:
    """Read a probe file, or take the reference probe, with other values and effects.

    What should be known of its shape is told.

    Parameters
    ----------
    reporter : Reporter
    path : path or None
    settings : sequence of str, optional
        As ``--set`` has them.
    physics : str, optional
        Effects with commas between; those of the file if left out, or ``none``.

    Raises
    ------
    InputError
        If the file, or one of these, is at fault.
    """
    from hotlever.probe import Probe
    from hotlever.probe.surroundings import Physics

    probe = Probe.reference() if path is None else Probe.from_file(path)
    changes = parse_settings(settings, probe)
    probe = probe.with_(**changes) if changes else probe
    reporter.note(*probe.shape.notes())
    if physics is None:
        return probe
    refuse_set(changes, "physics", Physics.model_fields)
    names = [name.strip() for name in physics.split(",")]
    return probe.with_physics(() if names == ["none"] else names, "--physics")


def read_surrounded_probe(
    reporter: Reporter, lever: LeverArguments, *, finds_air: bool = False
) -> Probe:
    """Read a probe as `read_probe` does, in a medium.

    Unless the command takes air where nothing is said (`finds_air`), settings of the air around a
    lever in vacuum are refused, since they would do nothing; so are those of effects that are off.
    """
    from hotlever.probe.probe import field_of

    check_medium(lever.medium)
    probe = read_probe(reporter, lever.probe, lever.set, lever.physics)
    changes = parse_settings(lever.set, probe)
    if lever.medium is not None:
        refuse_set(changes, "medium", ["medium"])
        probe = probe.in_medium(lever.medium)
    if probe.surroundings.medium == "vacuum" and not finds_air:
        for name, value in changes.items():
            section, key, _ = field_of(probe, name)
            if section == "surroundings" and key != "medium" and value not in (None, False):
                raise InputError(
                    f"--set {name}: counts in air, and this lever is in vacuum; expected --medium "
                    "air too"
                )
    of_effect = {"emissivity": "radiation", "scattering_exponent": "thermoelectric"}
    for name in changes:
        effect = of_effect.get(name.rpartition(".")[2])
        if effect is not None and effect not in probe.physics.effects:
            raise InputError(
                f"--set {name}: counts with an effect that is off; expected --physics {effect} too"
            )
    return probe


def make_lever(reporter: Reporter, probe: Probe, model: str = "flat") -> Lever:
    """Mesh a probe, and make the air around it.

    Its `model` is ``flat``, a lever in its plane, or ``full-3d``, of its true thickness with the
    air around it.

    Raises
    ------
    InputError
        If there is no such model.
    """
    if model not in (models := ("flat", "full-3d")):
        raise unknown_name("value", model, models, "--model")
    if model == "full-3d":
        from hotlever.lever3d import SolidLever

        with reporter.progress("mesh and air"):
            return SolidLever(probe)
    from hotlever.lever import Lever

    with reporter.progress("air") as update:
        return Lever(probe, progress=update)


def notes_of(data: xr.Dataset) -> list[str]:
    """Return what should be known of a dataset."""
    return [note for note in data.attrs["notes"].split("\n") if note]


def draw(path: Path | None, figure: Callable[[Any], Figure]) -> None:
    """Draw a figure to a file, if one is asked for.

    ``figure`` makes it of the figures of the package, whose import nobody else has to wait for.
    """
    if path is not None:
        from hotlever import figures

        figures.save_figure(figure(figures), path)


def give_table(
    reporter: Reporter,
    data: xr.Dataset,
    columns: Sequence[str],
    output: Path | None,
    plot: Path | None,
    figure: Callable[[Any], Figure],
) -> None:
    """Write a table to a file, or give its text where none is named, and `draw` a figure of it."""
    from hotlever.datasets import csv_text, write_dataset

    if output is not None:
        write_dataset(data, output, columns)
    draw(plot, figure)
    if output is None:
        reporter.give(csv_text(data, columns))
