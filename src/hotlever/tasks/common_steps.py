"""Steps that commands have in common: tell, read a probe, mesh its lever, write a table, draw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from hotlever.errors import InputError, unknown_name
from hotlever.tasks.arguments import LeverArguments, check_medium
from hotlever.tasks.parsing import parse_settings

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from hotlever.lever import Lever
    from hotlever.probe import Probe
    from hotlever.types import Progress


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

    probe = Probe.reference() if path is None else Probe.from_file(path)
    probe = probe.with_(**parse_settings(settings, probe)) if settings else probe
    reporter.note(*probe.shape.notes())
    if physics is None:
        return probe
    names = [name.strip() for name in physics.split(",")]
    return probe.with_physics(() if names == ["none"] else names, "--physics")


def read_surrounded_probe(
    reporter: Reporter, lever: LeverArguments, *, finds_air: bool = False
) -> Probe:
    """Read a probe as `read_probe` does, in a medium.

    Unless the command takes air where nothing is said (`finds_air`), settings of the air around a
    lever in vacuum are refused, since they would do nothing.
    """
    from hotlever.probe.probe import field_of

    check_medium(lever.medium)
    probe = read_probe(reporter, lever.probe, lever.set, lever.physics)
    probe = probe if lever.medium is None else probe.in_medium(lever.medium)
    if probe.surroundings.medium == "vacuum" and not finds_air:
        for name, value in parse_settings(lever.set, probe).items():
            section, key, _ = field_of(probe, name)
            if section == "surroundings" and key != "medium" and value not in (None, False):
                raise InputError(
                    f"--set {name}: counts in air, and this lever is in vacuum; expected --medium "
                    "air too"
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
