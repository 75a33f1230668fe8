"""Levers over a range of bias: a table, a figure and fields."""

from __future__ import annotations

from hotlever.errors import as_far_as_possible
from hotlever.files import FIGURE_TYPES, output_folder
from hotlever.lever import State, sweep_csv, write_sweep
from hotlever.tasks.files import draw
from hotlever.tasks.probes import make_lever
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import SweepRequest
from hotlever.tasks.texts import parse_bias


def sweep(reporter: Reporter, request: SweepRequest) -> None:
    """Solve a lever over a range of bias.

    Raises
    ------
    ComputationError
        If it has no state at some of them; what was reached is written.
    """
    outputs = request.outputs(request.probe)
    outputs.file(request.map, *FIGURE_TYPES)
    outputs.folder(request.fields)
    probe = request.read_probe(reporter)
    biases = parse_bias(request.bias, probe.lowest_bias_V)
    lever = make_lever(reporter, probe, request.model)
    states: list[State] = []
    with reporter.progress("sweep") as update:
        data, failure = as_far_as_possible(lambda: lever.sweep(biases, progress=update))
        if failure is not None and not data.bias.size:
            raise failure
        if request.fields is not None:
            states, ended = as_far_as_possible(lambda: lever.solve(data.bias_V.values, update))
            failure = failure or ended
        if request.map is not None:
            (hottest,) = lever.solve([data.bias_V.values[data.tip_K.values.argmax()]])
    reporter.note(*filter(None, data.attrs["notes"].split("\n")))
    with outputs.together():
        if request.output is not None:
            write_sweep(data, request.output)
        draw(request.plot, lambda figures: figures.sweep_overview(data))
        draw(request.map, lambda figures: figures.temperature_map(hottest))
        if request.fields is not None:
            # what draws or writes fields is imported where it is needed: a sweep is there at once
            from hotlever.lever.fields import write_fields

            write_fields(
                lever,
                states,
                output_folder(request.fields),
                lambda slices, path: draw(path, lambda figures: figures.temperature_slices(slices)),
            )
    if request.output is None:
        reporter.give(sweep_csv(data))
    if failure is not None:
        raise failure
