"""Levers over a range of bias, at set points, or under small signals: a table, a figure, fields."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hotlever.datasets import in_a_file
from hotlever.errors import ComputationError, InputError, as_far_as_possible
from hotlever.files import output_folder
from hotlever.lever import State
from hotlever.lever.dataset import SWEEP_COLUMNS
from hotlever.lever.set_points import hold
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import SpectrumRequest, SweepRequest
from hotlever.tasks.shared import draw, make_lever, notes_of, write_table
from hotlever.tasks.texts import parse_bias, parse_frequencies
from hotlever.units import bias_setting

if TYPE_CHECKING:
    import xarray as xr


def sweep(reporter: Reporter, request: SweepRequest) -> None:
    """Solve a lever over a range of bias, or where it is held at a resistance or a power.

    Raises
    ------
    ComputationError
        If it has no state at some of them; what was reached is written.
    """
    request.check_outputs()
    probe = request.read_probe(reporter)
    held = request.set_points
    biases = parse_bias(request.bias, probe.lowest_bias_V)
    lever = make_lever(reporter, probe, request.model)
    states: list[State] = []
    curve: xr.Dataset | None = None
    failure: ComputationError | None = None
    with reporter.progress("sweep") as update:
        if held is not None:
            what, option, set_points = held
            try:
                held_states = hold(lever, what, set_points, progress=update)
            except InputError as error:
                raise InputError(f"{option}: {error}") from None
            data, states, curve = held_states.data, held_states.states, held_states.curve
        else:
            data, failure = as_far_as_possible(
                lambda: lever.sweep(biases, and_back=request.and_back, progress=update)
            )
        if failure is not None and not data.bias.size:
            raise failure
        if request.fields is not None and not states:
            solved = biases if request.and_back else data.bias_V.values
            states, ended = as_far_as_possible(
                lambda: lever.solve(solved, update, and_back=request.and_back)
            )
            failure = failure or ended
        if request.map is not None:
            hottest = int(data.tip_K.values.argmax())
            (mapped,) = states[hottest:][:1] or lever.solve([data.bias_V.values[hottest]])
    reporter.note(*notes_of(data))
    text = write_table(request.output, data, in_a_file(data, SWEEP_COLUMNS))
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
    if text:
        reporter.give(text)
    if failure is not None:
        raise failure


def respond(reporter: Reporter, request: SpectrumRequest) -> None:
    """Find impedance and thermal response to small signals at a bias, or harmonics."""
    # takes longer to import than all that a sweep needs
    from hotlever.lever.transient.frequency_domain import (
        HARMONIC_COLUMNS,
        SPECTRUM_COLUMNS,
        harmonics,
        spectrum,
    )

    swing = None if request.amplitude is None else bias_setting(request.amplitude, "--amplitude")
    volts, frequencies = bias_setting(request.bias, "--bias"), parse_frequencies(request.frequency)
    request.check_outputs()
    lever = make_lever(reporter, request.read_probe(reporter))
    with reporter.progress("spectrum") as update:
        if swing is None:
            (state,) = lever.solve([volts], update)
            data = spectrum(state, frequencies)
        else:
            data = harmonics(lever, volts, swing, frequencies, update)
    columns = in_a_file(data, SPECTRUM_COLUMNS if swing is None else HARMONIC_COLUMNS)
    text = write_table(request.output, data, columns)
    draw(request.plot, lambda figures: figures.figure_of(data))
    if text:
        reporter.give(text)
