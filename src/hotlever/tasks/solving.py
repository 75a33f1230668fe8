"""Levers over a range of bias, at set points, under small signals, or in time."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import asdict
from itertools import count as count_up
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from hotlever.errors import ComputationError, InputError, as_far_as_possible, excerpt
from hotlever.files import FIGURE_TYPES, FILM_TYPES, output_folder
from hotlever.tasks.arguments import (
    HistoryOptions,
    LeverArguments,
    Plot,
    Reporter,
    Table,
    Written,
    at_most_one,
    draw,
    give_table,
    make_lever,
    notes_of,
    read_surrounded_probe,
    refuse,
)
from hotlever.tasks.parsing import parse_bias, parse_frequencies, parse_set_points, parse_times
from hotlever.units import bias_setting

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever import Lever, State
    from hotlever.lever.transient import Waveform
    from hotlever.types import Array


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
    reporter.note(*notes_of(data))
    columns = in_a_file(data, SPECTRUM_COLUMNS if swing is None else HARMONIC_COLUMNS)
    give_table(reporter, data, columns, output, plot, lambda figures: figures.figure_of(data))


# --- in time --------------------------------------------------------------------------------------


def simulate_in_time(
    reporter: Reporter,
    *,
    drive: HistoryOptions,
    lever: LeverArguments,
    output: Table = None,
    plot: Plot = None,
    fields: Annotated[Path | None, Written()] = None,
    film: Annotated[Path | None, Written(FILM_TYPES)] = None,
    report: Annotated[Path | None, Written()] = None,
) -> None:
    """Follow a lever in time: steps, pulses, ramps, sines, or what a file says.

    Parameters
    ----------
    fields
        Write the fields as a series of VTU to this folder.
    film
        Animate temperature and tip to this file: .gif; a frame for each of --at, or 120.
    report
        Folder for a page of the lever in time; goes without a wave form.
    """
    from hotlever.datasets import in_a_file
    from hotlever.lever.transient import simulate, with_times
    from hotlever.lever.transient.history import TIME_COLUMNS

    if report is not None:
        why = "does not go with --report, which has wave forms of its own"
        refuse(why, **asdict(drive), output=output, plot=plot, fields=fields, film=film)
        changed = read_surrounded_probe(reporter, lever)
        _write_page(reporter, make_lever(reporter, changed), report)
        return
    bias = drive.read()
    if bias is None:
        raise InputError("found none: expected one of --step, --pulse, --ramp, --sine, --waveform")
    reporter.note(*drive.notes(bias))
    end, times = parse_times(drive.until, drive.at)
    meshed = make_lever(reporter, read_surrounded_probe(reporter, lever))
    frames = None if film is None else _Frames(times or _even(bias, end))
    # figures and rise times are of smooth curves, the table of the steps alone
    per_step = 8 if times is None else 1
    kept_at: list[float] = []
    states: list[State] = []
    ends: list[State] = []
    point_numbers = count_up()
    with reporter.progress("pulse") as update:

        def keep(t: float, state: State) -> None:
            ends[1:] = [state]
            if frames is not None:
                frames.keep(t, state)
            if next(point_numbers) % per_step == 0 and fields is not None:
                kept_at.append(t)
                states.append(state)

        how: Any = {"per_step": per_step, "progress": update, "callback": keep}
        curve, failure = as_far_as_possible(lambda: simulate(meshed, bias, end, times, **how))
    if ends:
        curve = with_times(curve, ends[0], ends[-1], resolved=times is None)
    data = curve.isel(time=slice(None, None, per_step))
    reporter.note(*notes_of(data))
    reporter.tell_table(_times(data))
    drawn = plot if data.sizes["time"] else None
    columns = in_a_file(data, TIME_COLUMNS)
    give_table(
        reporter, data, columns, output, drawn, lambda figures: figures.history_overview(curve)
    )
    if fields is not None:
        from hotlever.lever.fields import write_fields_in_time  # its formats take long to load

        write_fields_in_time(meshed, kept_at, states, output_folder(fields))
    if frames is not None and film is not None and frames.states:
        _draw_film(reporter, curve, frames.states, film)
    if failure is not None:
        raise failure


class _Frames:
    """States at some times (µs), from those that are reported, on straight lines between them."""

    def __init__(self, times: Sequence[float]) -> None:
        self._times = deque(times)
        self._before: tuple[float, Array] | None = None
        self.states: list[tuple[float, State]] = []

    def keep(self, t: float, state: State) -> None:
        """Keep the states up to the next time that is reported."""
        from hotlever.lever import State

        before, x = self._before or (t, state.x)
        while self._times and self._times[0] <= t:
            at = self._times.popleft()
            share = (at - before) / (t - before) if t > before else 1.0
            self.states.append((at, State(state.lever, x + share * (state.x - x))))
        self._before = t, state.x


def _even(waveform: Waveform, until: float | None, frames: int = 120) -> list[float]:
    """Return times (µs) of the `frames` of a film, and of some corners.

    They are even on the axis on which a history is drawn.
    """
    import numpy as np

    end = waveform.usual_end if until is None else until
    times = np.linspace(0.0, end, frames)
    if np.ptp(waveform.bias(times)) == 0.0:
        times = np.geomspace(1e-4 * end, end, frames)
    corners = [piece.end for piece in waveform.pieces(end)]
    return np.union1d(times, corners if len(corners) < frames else []).tolist()


def _draw_film(
    reporter: Reporter, curve: xr.Dataset, states: Sequence[tuple[float, State]], path: Path
) -> None:
    """Draw a film; what comes and goes between its frames is told."""
    import numpy as np

    from hotlever import figures

    interpolated_K = np.interp(curve.time, *np.transpose([(t, state.tip_K) for t, state in states]))
    off, rise = np.abs(interpolated_K - curve.tip_K).max().item(), np.ptp(curve.tip_K.values)
    # by this share of the tip's rise straight lines between frames may be off
    if off > 0.25 * rise:
        reporter.note(
            f"the {len(states)} frames of {path} are too few for all that the tip does: between "
            f"them it is up to {off:.0f} K elsewhere (--until or --at choose others)"
        )
    with reporter.progress("film") as update:
        figures.save_film(figures.pulse_film(curve, states), path, update)


def _write_page(reporter: Reporter, lever: Lever, folder: Path) -> None:
    """Write the page of a lever in time."""
    from hotlever.report.result_pages import transient_page

    with reporter.progress("sections") as update:
        page = transient_page(lever, update)
    reporter.give(f"{page.write(folder)}\n")


def _times(data: xr.Dataset) -> list[list[str]]:
    """Return rows that say how hot the tip gets, and how fast."""
    import numpy as np

    rows, of = [], data.attrs
    if "tip_mean_K" in of:
        highest = f"{of['tip_highest_K']:.1f} K at {of['tip_highest_at_us']:.4g} µs"
        end = f"{data.tip_K.values[-1]:.1f} K at {data.time.values[-1]:.4g} µs"
        rows += [["tip, highest", highest], ["tip, at the end", end]]
        took = np.ptp(data.time.values)
        rows += [["tip, mean", f"{of['tip_mean_K']:.1f} K over {took:.4g} µs"]]
    for name in ("heating", "cooling"):
        time = data.attrs.get(f"{name}_us", math.nan)
        if not math.isnan(time):
            rows.append([f"{name}, 10 to 90 %", f"{time:.3g} µs"])
    for name in ("start", "end"):
        constants = data.attrs.get(f"time_constants_us_at_{name}", ())
        if len(constants):
            listed = ", ".join(f"{time:.3g}" for time in constants)
            rows.append([f"time constants at the {name}", f"{listed} µs"])
    return rows
