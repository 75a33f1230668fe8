"""Levers over a range of bias, or at set points: a table, a figure and fields."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hotlever.errors import ComputationError, InputError, as_far_as_possible
from hotlever.files import output_folder
from hotlever.lever import State, sweep_csv, write_sweep
from hotlever.lever.set_points import HeldStates, hold
from hotlever.tasks.files import draw
from hotlever.tasks.probes import make_lever
from hotlever.tasks.ranges import parse_bias
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import SweepRequest
from hotlever.types import Array, Progress

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever import Lever


def sweep(reporter: Reporter, request: SweepRequest) -> None:
    """Solve a lever over a range of bias, or where it is held at a resistance or a power.

    Raises
    ------
    ComputationError
        If it has no state at some of them; what was reached is written.
    """
    outputs = request.outputs()
    probe = request.read_probe(reporter)
    held = request.set_points
    biases = parse_bias(request.bias, probe.lowest_bias_V)
    lever = make_lever(reporter, probe, request.model)
    states: list[State] = []
    curve: xr.Dataset | None = None
    failure: ComputationError | None = None
    with reporter.progress("sweep") as update:
        if held is not None:
            data, states, curve = _held(lever, *held, update)
        else:
            data, failure = as_far_as_possible(lambda: lever.sweep(biases, progress=update))
        if failure is not None and not data.bias.size:
            raise failure
        if request.fields is not None and not states:
            states, ended = as_far_as_possible(lambda: lever.solve(data.bias_V.values, update))
            failure = failure or ended
        if request.map is not None:
            hottest = int(data.tip_K.values.argmax())
            (mapped,) = states[hottest:][:1] or lever.solve([data.bias_V.values[hottest]])
    reporter.note(*filter(None, data.attrs["notes"].split("\n")))
    with outputs.together():
        if request.output is not None:
            write_sweep(data, request.output)
        draw(
            request.plot,
            lambda figures: (
                figures.sweep_overview(data) if held is None else figures.held_states(data, curve)
            ),
        )
        draw(request.map, lambda figures: figures.temperature_map(mapped))
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


def _held(
    lever: Lever, what: str, option: str, set_points: Array, update: Progress
) -> tuple[xr.Dataset, list[State], xr.Dataset]:
    """Return the states at set points, and all of the branch."""
    try:
        held_states: HeldStates = hold(lever, what, set_points, progress=update)
    except InputError as error:
        raise InputError(f"{option}: {error}") from None
    return held_states.data, held_states.states, held_states.curve
