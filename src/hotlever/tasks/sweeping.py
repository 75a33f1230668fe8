"""Levers over a range of bias, at set points, or under small signals: a table, a figure, fields."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from hotlever.errors import ComputationError, InputError, as_far_as_possible, excerpt
from hotlever.files import FIGURE_TYPES, output_folder
from hotlever.tasks.arguments import (
    LeverArguments,
    Plot,
    Table,
    Written,
    at_most_one,
    refuse,
)
from hotlever.tasks.common_steps import (
    draw,
    give_table,
    make_lever,
    notes_of,
    read_surrounded_probe,
)
from hotlever.tasks.parsing import parse_bias, parse_frequencies, parse_set_points
from hotlever.tasks.reporter import Reporter
from hotlever.units import bias_setting

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever import State


def sweep(
    reporter: Reporter,
    lever: LeverArguments,
    *,
    bias: str | None = None,
    and_back: bool = False,
    hold_resistance: str | None = None,
    hold_power: str | None = None,
    model: str = "flat",
    output: Table = None,
    plot: Plot = None,
    map: Annotated[Path | None, Written(FIGURE_TYPES)] = None,
    fields: Annotated[Path | None, Written()] = None,
) -> None:
    """Solve a lever over a range of bias.

    Parameters
    ----------
    bias : START:STOP:COUNT
        In volts, ends included, or a single one; 1:11:25 if left out.
    and_back
        Let the bias go back as well: a lever that jumps does so elsewhere.
    hold_resistance : OHM
        The states that a controller of V_l/I_h holds, in place of a bias: such as 3kohm,
        2.5kohm,3kohm or 2.5kohm:3.3kohm:9.
    hold_power : WATT
        The same of V_l I_h, such as 2.5mW or 1mW:4mW:7.
    model
        flat: the lever in its plane; full-3d: its true thickness and the air around it (minutes;
        goes on where it was stopped).
    map
        Draw the temperature at the highest tip temperature to this file, as --plot.
    fields
        Write the fields of each state as VTU to this folder.
    """
    from hotlever.datasets import in_a_file
    from hotlever.lever.dataset import SWEEP_COLUMNS
    from hotlever.lever.set_points import hold

    changed = read_surrounded_probe(reporter, lever)
    at_most_one(bias=bias, hold_resistance=hold_resistance, hold_power=hold_power)
    held, unit = ("resistance", "ohm") if hold_resistance is not None else ("power", "mW")
    option, points = f"--hold-{held}", hold_resistance if hold_power is None else hold_power
    if points is not None:
        refuse(f"does not go with {option}", and_back=and_back)
        if model != "flat":
            raise InputError(f"{option}: goes with --model flat, found {excerpt(model)}")
        set_points = parse_set_points(points, unit, option)
    biases = parse_bias(bias, changed.lowest_bias_V)
    meshed = make_lever(reporter, changed, model)
    states: list[State] = []
    curve: xr.Dataset | None = None
    failure: ComputationError | None = None
    with reporter.progress("sweep") as update:
        if points is not None:
            try:
                held_states = hold(meshed, held, set_points, progress=update)
            except InputError as error:
                raise InputError(f"{option}: {error}") from None
            data, states, curve = held_states.data, held_states.states, held_states.curve
        else:
            data, failure = as_far_as_possible(
                lambda: meshed.sweep(biases, and_back=and_back, progress=update)
            )
        if failure is not None and not data.bias.size:
            raise failure
        if fields is not None and not states:
            solved = biases if and_back else data.bias_V.values
            states, ended = as_far_as_possible(
                lambda: meshed.solve(solved, update, and_back=and_back)
            )
            failure = failure or ended
        if map is not None:
            hottest = int(data.tip_K.values.argmax())
            (mapped,) = states[hottest:][:1] or meshed.solve([data.bias_V.values[hottest]])
    reporter.note(*notes_of(data))
    give_table(
        reporter,
        data,
        in_a_file(data, SWEEP_COLUMNS),
        output,
        plot,
        lambda figures: (
            figures.sweep_overview(data) if points is None else figures.held_states(data, curve)
        ),
    )
    draw(map, lambda figures: figures.temperature_map(mapped))
    if fields is not None:
        from hotlever.lever.fields import write_fields

        write_fields(
            meshed,
            states,
            output_folder(fields),
            lambda slices, path: draw(path, lambda figures: figures.temperature_slices(slices)),
        )
    if failure is not None:
        raise failure


def respond(
    reporter: Reporter,
    lever: LeverArguments,
    *,
    bias: str,
    frequency: str = "1Hz:10MHz:71",
    amplitude: str | None = None,
    output: Table = None,
    plot: Plot = None,
) -> None:
    """Show impedance and thermal response to small signals at a bias, or harmonics.

    Parameters
    ----------
    bias : V
        Of the operating point.
    frequency : START:STOP:COUNT
        Spaced evenly in the logarithm, or a single one.
    amplitude : V
        Of a sine about the bias: harmonics of V_l instead (3ω method).
    """
    from hotlever.datasets import in_a_file
    from hotlever.lever.transient.frequency_domain import (
        HARMONIC_COLUMNS,
        SPECTRUM_COLUMNS,
        harmonics,
        spectrum,
    )

    swing = None if amplitude is None else bias_setting(amplitude, "--amplitude")
    volts, frequencies = bias_setting(bias, "--bias"), parse_frequencies(frequency)
    changed = read_surrounded_probe(reporter, lever)
    meshed = make_lever(reporter, changed)
    with reporter.progress("spectrum") as update:
        if swing is None:
            (state,) = meshed.solve([volts], update)
            data = spectrum(state, frequencies)
        else:
            data = harmonics(meshed, volts, swing, frequencies, update)
    columns = in_a_file(data, SPECTRUM_COLUMNS if swing is None else HARMONIC_COLUMNS)
    give_table(reporter, data, columns, output, plot, lambda figures: figures.figure_of(data))
