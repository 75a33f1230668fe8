"""Levers in time, with a wave form or a controller: a table, a figure, fields and a film."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import count as count_up
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from hotlever.datasets import in_a_file
from hotlever.errors import HistoryEndError, InputError, excerpt
from hotlever.files import output_folder
from hotlever.lever import Lever, State
from hotlever.lever.fields import write_fields_in_time
from hotlever.lever.set_points import hold
from hotlever.lever.transient import Controller, Waveform, simulate, with_times
from hotlever.lever.transient.closed_loop import FASTEST, ClosedLoop
from hotlever.lever.transient.history import TIME_COLUMNS
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import DriveRequest, PulseRequest
from hotlever.tasks.shared import draw, make_lever, notes_of, write_table
from hotlever.tasks.texts import parse_number
from hotlever.types import Array
from hotlever.units import bias_setting, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Points of a curve for each step of the solver, and frames of a film where no times are asked.
_CURVE, _FRAMES = 8, 120
#: Share of the tip's rise by which straight lines between frames may be off, without a note.
_COARSE = 0.25
#: Highest bias of a controller, where none is given, over that at rest.
_LIMIT = 1.5
#: Most error of a step (K), and the same as a share of the way of the tip.
_TOLERANCE_K, _SHARE, _LEAST_TOLERANCE_K = 0.1, 2e-3, 1e-4
#: Time constants of the closed loop that are simulated if nobody says, and the longest time (µs).
_CONSTANTS, _LONGEST = 10.0, 1e4


def simulate_in_time(reporter: Reporter, request: PulseRequest) -> None:
    """Solve a lever in time, or write the page of it.

    Raises
    ------
    HistoryEndError
        If it has no state any more; what was reached is written.
    """
    if request.report is not None:
        request.need_no_waveform()
        _write_page(reporter, request, request.report)
        return
    waveform = None if asks_for_control(request) else request.required_waveform()
    until, times = request.end_us, request.times_us
    outputs = request.outputs()
    lever = make_lever(reporter, request.read_probe(reporter))
    held: Control | None = None
    options: Any = {}
    if waveform is None:
        held = control(reporter, lever, request)
        waveform = held.controller
        until = held.usual_end if until is None and times is None else until
        options |= {"start": held.start, "tolerance_K": held.tolerance_K}
    frames = None if request.film is None else _Frames(times or _even(waveform, until))
    failure: HistoryEndError | None = None
    # figures and rise times are of smooth curves, the table of the steps alone
    per_step = _CURVE if times is None else 1
    kept_at: list[float] = []
    states: list[State] = []
    ends: list[State] = []
    point_numbers = count_up()
    with reporter.progress("pulse") as update:

        def keep(t: float, state: State) -> None:
            ends[1:] = [state]
            if frames is not None:
                frames.keep(t, state)
            if next(point_numbers) % per_step == 0 and request.fields is not None:
                kept_at.append(t)
                states.append(state)

        options |= {"per_step": per_step, "progress": update, "callback": keep}
        try:
            curve = simulate(lever, waveform, until, times, **options)
        except HistoryEndError as error:
            curve, failure = error.partial, error
    resolved = times is None
    if ends and held is None:
        curve = with_times(curve, ends[0], ends[-1], resolved=resolved)
    data = curve.isel(time=slice(None, None, per_step))
    reporter.note(*notes_of(data), *([] if held is None else held.notes(curve)))
    reporter.tell_table(_times(data) if held is None else held.rows(curve, resolved=resolved))
    with outputs.together():
        text = write_table(request.output, data, in_a_file(data, TIME_COLUMNS))
        if data.sizes["time"]:
            draw(request.plot, lambda figures: figures.history_overview(curve))
        if held is not None:
            draw(request.gain_map, held.gain_map)
        if request.fields is not None:
            write_fields_in_time(lever, kept_at, states, output_folder(request.fields))
        if frames is not None and request.film is not None and frames.states:
            _draw_film(reporter, curve, frames.states, request.film)
    if text:
        reporter.give(text)
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
        before, x = self._before or (t, state.x)
        while self._times and self._times[0] <= t:
            at = self._times.popleft()
            share = (at - before) / (t - before) if t > before else 1.0
            self.states.append((at, State(state.lever, x + share * (state.x - x))))
        self._before = t, state.x


def _even(waveform: Waveform, until: float | None) -> list[float]:
    """Return times (µs) even on the axis on which a history is drawn, and of some corners."""
    end = waveform.usual_end if until is None else until
    times = np.linspace(0.0, end, _FRAMES)
    if np.ptp(waveform.bias(times)) == 0.0:
        times = np.geomspace(1e-4 * end, end, _FRAMES)
    corners = [piece.end for piece in waveform.pieces(end)]
    return np.union1d(times, corners if len(corners) < _FRAMES else []).tolist()


def _draw_film(
    reporter: Reporter, curve: xr.Dataset, states: Sequence[tuple[float, State]], path: Path
) -> None:
    """Draw a film; what comes and goes between its frames is told."""
    from hotlever import figures

    interpolated_K = np.interp(curve.time, *np.transpose([(t, state.tip_K) for t, state in states]))
    off, rise = np.abs(interpolated_K - curve.tip_K).max().item(), np.ptp(curve.tip_K.values)
    if off > _COARSE * rise:
        reporter.note(
            f"the {len(states)} frames of {path} are too few for all that the tip does: between "
            f"them it is up to {off:.0f} K elsewhere (--until or --at choose others)"
        )
    with reporter.progress("film") as update:
        figures.save_film(figures.pulse_film(curve, states), path, update)


def _write_page(reporter: Reporter, request: PulseRequest, folder: Path) -> None:
    """Write the page of a lever in time."""
    from hotlever.report.transient_pages import transient_page

    outputs = request.outputs()
    lever = make_lever(reporter, request.read_probe(reporter))
    with reporter.progress("sections") as update:
        page = transient_page(lever, update)
    with outputs.together():
        written = page.write(folder)
    reporter.give(f"{written}\n")


def _times(data: xr.Dataset) -> list[list[str]]:
    """Return rows that say how hot the tip gets, and how fast."""
    rows, of = [], data.attrs
    if "tip_mean_K" in of:
        highest = f"{of['tip_highest_K']:.1f} K at {of['tip_highest_at_us']:.4g} µs"
        end = f"{data.tip_K[-1].item():.1f} K at {data.time[-1].item():.4g} µs"
        rows += [["tip, highest", highest], ["tip, at the end", end]]
        took = data.time[-1].item() - data.time[0].item()
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


# --- with a controller ----------------------------------------------------------------------------


def asks_for_control(request: PulseRequest) -> bool:
    """Return whether a controller is asked for, and refuse what does not go with it, or alone."""
    if request.controller is None:
        names = "limit", "gain_map", "hold_resistance", "filter"
        request.refuse(*names, why="goes with --controller P,I")
        return False
    others = [own.name for own in fields(DriveRequest) if own.name != "step"]
    why = "does not go with --controller, expected --step, such as 3kohm"
    request.refuse(*others, why=why)
    needed = {"--hold-resistance": request.hold_resistance, "--step": request.step}
    for name, value in needed.items():
        if value is None:
            raise InputError(f"--controller: goes with {name} and a resistance, such as 3kohm")
    return True


@dataclass(frozen=True)
class Control:
    """What brings a lever from one resistance to another.

    Attributes
    ----------
    controller : Controller
    start, end : State
        At rest before and after.
    loop : ClosedLoop
        At the end, where it is stable.
    """

    controller: Controller
    start: State
    end: State
    loop: ClosedLoop

    @property
    def settling(self) -> tuple[float, float]:
        """Time constant (µs) and damping of the closed loop at the end."""
        law = self.controller
        return self.loop.settling(law.proportional, law.integral, law.filter_us)

    @property
    def usual_end(self) -> float:
        """Time (µs) that is simulated if nobody says."""
        return min(_CONSTANTS * self.settling[0], _LONGEST)

    @property
    def tolerance_K(self) -> float:
        """Largest error of a step in time (K)."""
        way = _SHARE * abs(self.end.tip_K - self.start.tip_K)
        return max(min(_TOLERANCE_K, way), _LEAST_TOLERANCE_K)

    def gain_map(self, figures: Any) -> Figure:
        """Draw which gains of this sign are stable."""
        law = self.controller
        data = self.loop.gain_map(float(np.sign(law.integral)), law.filter_us)
        figure: Figure = figures.gain_map(data, (law.proportional, law.integral))
        return figure

    def notes(self, history: xr.Dataset) -> list[str]:
        """Say that the lever is not held at the end, if its bias is at the limit."""
        if history.bias_V.values[-1] < (1.0 - 1e-6) * self.controller.limit_V:
            return []
        return [
            f"at the end the bias is at its limit of {self.controller.limit_V:.4g} V, and nothing "
            "is held: beyond a highest resistance a lever only gets hotter with these gains"
        ]

    def rows(self, history: xr.Dataset, *, resolved: bool) -> list[list[str]]:
        """Return rows that say what the controller does: of a resolved history its overshoot."""
        time, ratio = self.settling
        way, tip = self.end.tip_K - self.start.tip_K, history.tip_K.values
        over = float(np.max(np.sign(way) * (tip - self.end.tip_K)))
        overshoot = f"{over:.2g} K ({over / abs(way):.0%} of the step)" if over > 0.0 else "none"
        return [
            ["tip, at rest before and after", f"{self.start.tip_K:.1f} K, {self.end.tip_K:.1f} K"],
            *([["tip, overshoot", overshoot]] if resolved else []),
            ["tip, at the end", f"{tip[-1]:.1f} K at {history.time[-1].item():.4g} µs"],
            ["closed loop", f"time constant {time:.3g} µs, damping ratio {ratio:.2g}"],
        ]


def control(reporter: Reporter, lever: Lever, request: PulseRequest) -> Control:
    """Return the controller that is asked for, at the state where it begins.

    Its gains choose the states: above zero those where the resistance rises with the tip
    temperature, below zero those where it falls.

    Raises
    ------
    InputError
        If a resistance has no state that gains of this sign hold, or the loop is not stable.
    """
    text = request.controller or ""
    if text.count(",") != 1:
        raise InputError(
            f"--controller: found '{excerpt(text)}', expected P,I in V/kohm and V/(kohm ms), such "
            "as 1,30"
        )
    proportional, integral = (parse_number(part, "--controller") for part in text.split(","))
    resistances = [
        setting(request.hold_resistance or "", "ohm", "--hold-resistance"),
        setting(request.step or "", "ohm", "--step"),
    ]
    start, end = _states(lever, resistances, integral)
    at_rest = max(start.bias_V, end.bias_V)
    limit = _LIMIT * at_rest if request.limit is None else bias_setting(request.limit, "--limit")
    filter_us = setting(request.filter, "us", "--filter")
    try:
        law = Controller(
            resistances[1], proportional, integral, start.bias_V, limit, filter_us=filter_us
        )
    except InputError as error:
        raise InputError(f"--controller: {error}") from None
    if limit < at_rest:
        reporter.note(
            f"{resistances[1]:.5g} ohm takes a bias of {end.bias_V:.4g} V, which is above the "
            f"limit of {limit:.4g} V"
        )
    loop = ClosedLoop.at(end)
    _check_stable(loop, law)
    return Control(law, start, end, loop)


def _check_stable(loop: ClosedLoop, law: Controller) -> None:
    """Refuse gains with which what is off grows, or rings faster than anything is known of."""
    P, per_ms = law.proportional, law.integral
    poles, _ = loop.closed(P, per_ms, law.filter_us)
    if (growth := float(poles.real.max())) >= 0.0:
        why = f"is not stable: what is off grows by e in {1.0 / max(growth, 1e-300):.3g} µs"
    elif np.abs(poles.imag).max() > FASTEST:
        why = "rings faster than the lever's answer is known, 100 MHz"
    else:
        return
    better = loop.stable_gains(float(np.sign(per_ms)), law.filter_us)
    expected = "others" if better is None else "stable ones such as {:.2g},{:.2g}".format(*better)
    raise InputError(
        f"--controller: with gains of {P:g},{per_ms:g} the loop at {law.set_ohm:.5g} ohm {why}; "
        f"expected {expected} (--gain-map draws them all)"
    )


def _states(lever: Lever, resistances: list[float], integral: float) -> tuple[State, State]:
    """Return the states at both resistances that an integral of some sign leads to."""
    try:
        held_states = hold(lever, "resistance", resistances)
    except InputError as error:
        raise InputError(f"--controller: {error}") from None
    chosen: list[State] = []
    for value in resistances:
        here = np.flatnonzero(held_states.data.set_ohm.values == value)
        rises = held_states.data.slope_ohm_per_K.values[here] > 0.0
        held = [held_states.states[k] for k in here[rises == (integral > 0.0)].tolist()]
        if not held:
            tips = ", ".join(f"{held_states.states[k].tip_K:.0f} K" for k in here.tolist())
            other = ("rises", "above") if integral < 0.0 else ("falls", "below")
            raise InputError(
                f"--controller: found I = {integral:g}, expected gains {other[1]} 0: at "
                f"{value:g} ohm (tip at {tips}) the resistance {other[0]} with the temperature"
            )
        before = chosen[0].tip_K if chosen else 0.0
        chosen.append(min(held, key=lambda state: abs(state.tip_K - before)))
    start, end = chosen
    return start, end
