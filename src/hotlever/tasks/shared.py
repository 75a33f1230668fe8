"""What tasks share: probes read and levers made, with what should be known of them; files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hotlever.errors import unknown_name
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.texts import parse_settings

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from hotlever.lever import Lever
    from hotlever.probe import Probe

#: A lever in its plane, or of its true thickness with the air around it.
MODELS = ("flat", "full-3d")


def read_probe(
    reporter: Reporter, path: Path | None = None, settings: Sequence[str] | None = None
) -> Probe:
    """Read a probe file, or take the reference probe, and change some of its values.

    What should be known of its shape is told.
    """
    from hotlever.probe import Probe

    probe = Probe.reference() if path is None else Probe.from_file(path)
    probe = probe.with_(**parse_settings(settings, probe)) if settings else probe
    reporter.note(*probe.shape.notes())
    return probe


def make_lever(reporter: Reporter, probe: Probe, model: str = "flat") -> Lever:
    """Mesh a probe, and make the air around it, for one of `MODELS`.

    Raises
    ------
    InputError
        If there is no such model.
    """
    if model not in MODELS:
        raise unknown_name("value", model, MODELS, "--model")
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


def write_table(path: Path | None, data: xr.Dataset, columns: Sequence[str]) -> str:
    """Write a table to a file, or return its text, for standard output, if none is named."""
    from hotlever.datasets import csv_text, write_dataset

    if path is None:
        return csv_text(data, columns)
    write_dataset(data, path, columns)
    return ""


def draw(path: Path | None, figure: Callable[[Any], Figure]) -> None:
    """Draw a figure to a file, if one is asked for.

    ``figure`` makes it of the figures of the package, whose import nobody else has to wait for.
    """
    if path is not None:
        from hotlever import figures

        figures.save_figure(figure(figures), path)
