"""Levers over a range of bias: a table, a figure and fields.

What draws, writes fields, or is solved in full 3-D is imported where it is needed: a sweep is there
at once.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from hotlever.errors import ComputationError
from hotlever.files import Outputs, output_folder
from hotlever.lever import Lever, State, sweep_csv, write_sweep
from hotlever.tasks.files import Files, draw
from hotlever.tasks.reporter import Reporter
from hotlever.types import Array


def sweep(reporter: Reporter, lever: Lever, biases: Array, outputs: Outputs, files: Files) -> None:
    """Solve a lever over a range of bias (V).

    Raises
    ------
    ComputationError
        If it has no state at some of them; what was reached is written.
    """
    states: list[State] = []
    with reporter.progress("sweep") as update:
        data, failure = _reached(lambda: lever.sweep(biases, progress=update))
        if failure is not None and not data.bias.size:
            raise failure
        if files.fields is not None:
            states, ended = _reached(lambda: lever.solve(data.bias_V.values, update))
            failure = failure or ended
    reporter.note(*filter(None, data.attrs["notes"].split("\n")))
    with outputs.together():
        if files.output is not None:
            write_sweep(data, files.output)
        draw(files.plot, lambda figures: figures.sweep_overview(data))
        if files.fields is not None:
            _write_fields(lever, states, output_folder(files.fields))
    if files.output is None:
        reporter.give(sweep_csv(data))
    if failure is not None:
        raise failure


def _reached(work: Callable[[], Any]) -> tuple[Any, ComputationError | None]:
    """Return what a computation gives; if it fails, what it reached, and the failure."""
    try:
        return work(), None
    except ComputationError as error:
        if error.partial is None:
            raise
        return error.partial, error


def _write_fields(lever: Lever, states: list[State], folder: Path) -> None:
    """Write the fields of states to a folder, those of the air too where there is some."""

    def name(state: State, suffix: str) -> Path:
        return folder / f"bias_{state.bias_V:08.4f}V{suffix}"

    from hotlever.lever3d import SolidLever

    if isinstance(lever, SolidLever):
        from hotlever.lever3d.fields import write_solid_vtu

        for state in states:
            write_solid_vtu(state, name(state, ".vtu"))
            if lever.medium == "air":
                _draw_slices(state, name(state, ".png"))
        return

    from hotlever.lever.air_fields import AirFields
    from hotlever.lever.fields import FieldMapper, write_vtu

    mapper, air = FieldMapper(lever), AirFields(lever) if lever.medium == "air" else None
    for state in states:
        write_vtu(mapper.map(state), name(state, ".vtu"))
        if air is not None:
            air.write_vtu(state, name(state, "_air.vtu"))


def _draw_slices(state: State, path: Path) -> None:
    from hotlever.lever3d.fields import temperature_slices

    draw(path, lambda figures: figures.temperature_slices(temperature_slices(state)))
