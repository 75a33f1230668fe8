"""Levers over a range of bias: a table, a figure and fields."""

from __future__ import annotations

from hotlever.errors import as_far_as_possible
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
        data, failure = as_far_as_possible(lambda: lever.sweep(biases, progress=update))
        if failure is not None and not data.bias.size:
            raise failure
        if files.fields is not None:
            states, ended = as_far_as_possible(lambda: lever.solve(data.bias_V.values, update))
            failure = failure or ended
    reporter.note(*filter(None, data.attrs["notes"].split("\n")))
    with outputs.together():
        if files.output is not None:
            write_sweep(data, files.output)
        draw(files.plot, lambda figures: figures.sweep_overview(data))
        if files.fields is not None:
            # what draws or writes fields is imported where it is needed: a sweep is there at once
            from hotlever.lever.fields import write_fields

            write_fields(
                lever,
                states,
                output_folder(files.fields),
                lambda slices, path: draw(path, lambda figures: figures.temperature_slices(slices)),
            )
    if files.output is None:
        reporter.give(sweep_csv(data))
    if failure is not None:
        raise failure
