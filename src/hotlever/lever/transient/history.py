"""What a lever shows in time, as a dataset: a history."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hotlever.datasets import labelled, write_dataset
from hotlever.errors import ComputationError, HistoryEndError, InputError
from hotlever.lever.dataset import (
    MonitorMap,
    in_a_file,
    probe_attributes,
    range_notes,
    with_meanings,
)
from hotlever.lever.lever import State
from hotlever.lever.observables import with_following
from hotlever.lever.transient.runge_kutta import Stepper, TimeStep, hermite
from hotlever.lever.transient.transient_problem import MONITORED, TransientProblem
from hotlever.lever.transient.waveform import Piece, Waveform
from hotlever.types import Array, Progress

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever.lever import Lever

#: Columns of a file in time.
TIME_COLUMNS = (
    *("time_us", "bias_V", "current_mA", "lever_V"),
    *("reader_V", "tip_K", "power_mW"),
)
#: What is interpolated between the ends of each step, in this order.
_REPORTED = (
    *("lever_V", "current_mA", "reader_V", "tip_K", "max_K"),
    *("supplied_nJ", "stored_nJ", "air_stored_nJ", "lost_nJ"),
)


def time_steps(
    lever: Lever,
    waveform: Waveform,
    until: float,
    tolerance_K: float,
    start: State | None = None,
    stops: Sequence[float] = (),
) -> Iterator[tuple[Piece, TimeStep]]:
    """Give the steps of a lever under a wave form, each with the piece it belongs to.

    Steps end at all stops (µs) on the way.
    """
    begin = initial_state(lever, waveform) if start is None else start
    if lever.circuit.starts_cold:
        # a share of the rise that the lever would end with, so that a response is resolved however
        # weak it is; but never less than 1e-6 K, which is near rounding errors
        rise = 2e-3 * _expected_rise(lever, waveform.highest_V)
        tolerance_K = max(min(tolerance_K, rise), 1e-6)
    length: float | None = None
    x: Array | None = None
    for piece in waveform.pieces(until):
        problem = TransientProblem(lever.equations, lever.circuit, piece.bias)
        x = problem.begin(begin) if x is None else x
        stepper = Stepper(problem, tolerance_K)
        first = None if piece.jumps else length
        for step in stepper.steps(piece.start, piece.end, x, piece.longest, first, stops):
            yield piece, step
            x = step.x[:, 1:]
        length = stepper.length


def _expected_rise(lever: Lever, bias: float) -> float:
    """Return the rise of the tip (K) at a bias (V), were the lever not to change with it."""
    first, _ = lever.equations.cold()
    output_slopes = lever.equations.observed_change(np.zeros_like(first), first)[:, 0]
    return float((bias / lever.circuit.bias(output_slopes[0], output_slopes[1])) ** 2)


def initial_state(lever: Lever, waveform: Waveform) -> State:
    """Return the state at rest before a wave form."""
    lowest, bias = lever.probe.lowest_bias_V, waveform.before_V
    polarity = -1.0 if bias < lowest else 1.0
    if bias == 0.0 and lever.circuit.starts_cold:
        return State(lever, np.zeros((lever.space.size + 1, 1)))
    (state,) = lever.solve([polarity * bias])
    # the other polarity has the potentials reversed
    sign = np.where(lever.space.is_temperature, 1.0, polarity)
    return State(lever, sign[:, None] * state.x)


def integrate(
    lever: Lever,
    waveform: Waveform,
    until: float | None = None,
    at: ArrayLike | None = None,
    *,
    tolerance_K: float = 0.1,
    per_step: int = 1,
    start: State | None = None,
    callback: Callable[[float, State], None] | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Integrate a lever in time under a bias that changes.

    Parameters
    ----------
    lever : Lever
    waveform : Waveform
        Such as `pulse` or `read_waveform` return; see `hotlever.lever.transient.waveform`.
    until : float, optional
        Time (µs) to stop at; by default the last one asked for, or what the wave form usually
        takes.
    at : array_like, optional
        Times (µs) to report. By default those at which the solver stepped: after the bias has
        jumped the first is a moment later.
    tolerance_K : float
        Largest error of a step (K) that is accepted, less where the lever hardly heats; that of
        the whole is of this order.
    per_step : int
        Times to report for each step of the solver, where none are asked for; more than one make
        a smooth curve.
    start : State, optional
        Where the lever is when the wave form begins; at rest by default.
    callback : callable, optional
        Called with each time reported (µs) and the `State` there, whose fields it may keep.
    progress : callable, optional
        Called with the share of the time done, in thousandths, and 1000.

    Returns
    -------
    xarray.Dataset
        One variable for each of `TIME_COLUMNS`, the highest temperature and the energies on the
        dimension ``time`` (µs); probe, material, circuit, wave form and version as attributes.

    Raises
    ------
    InputError
        If a time or the tolerance is out of bounds.
    HistoryEndError
        If silicon melts or a step fails; ``partial`` holds the dataset up to there, and
        ``time_reached`` is when (µs).
    """
    report_times = None if at is None else checked_times(at)
    if until is None:
        until = waveform.usual_end if report_times is None else float(report_times[-1])
    if not 0 < until < np.inf or (report_times is not None and report_times[-1] > until):
        raise InputError(
            f"found an end at {until:g} µs, expected a finite one after all times asked for"
        )
    if not 1e-4 <= tolerance_K <= 10.0:
        raise InputError(f"found a tolerance of {tolerance_K:g} K, expected 1e-4 to 10 K")
    recorder, reached, failure = _Recorder(lever, report_times, per_step, callback), 0.0, ""
    try:
        for piece, step in time_steps(lever, waveform, until, tolerance_K, start):
            end = recorder.add(piece, step)
            reached = step.end if end is None else end
            if end is not None:
                failure = f"{lever.equations.laws.limit[1]} after {end:.6g} µs"
                break
            if progress is not None:
                progress(int(1000 * reached / until), 1000)
    except ComputationError as error:
        failure = f"the lever could be simulated up to {reached:.6g} µs only: {error}"
    data = _dataset(lever, waveform, recorder)
    if failure:
        raise HistoryEndError(failure, reached, data)
    return data


class _Recorder:
    """Rows of a history: at the times asked for, or where the solver stepped."""

    def __init__(
        self,
        lever: Lever,
        report_times: Array | None,
        per_step: int,
        callback: Callable[[float, State], None] | None,
    ) -> None:
        self._lever, self._report_times, self._per_step, self._callback = (
            lever,
            report_times,
            per_step,
            callback,
        )
        self.monitors = MonitorMap(lever.probe, lever.equations)
        base = lever.equations.base_temperature_K
        self._zero = np.array([0.0, 0.0, 0.0, base, base])[:, None]
        # where flows, heats, and what is at the leg ends begin
        self._parts = [MONITORED.index(name) for name in ("power_mW", "stored_nJ", "at_ends_nJ")]
        self._at_ends: float | None = None
        self._added = np.zeros((2, 1))
        self.time: list[float] = []
        self.bias: list[float] = []
        self.values: list[Array] = []

    def add(self, piece: Piece, step: TimeStep) -> float | None:
        """Add the rows of a step; return when silicon melts, if it does."""
        values, slopes = self._read(step)
        if not self.time and (self._report_times is None or self._report_times[0] == 0.0):
            self._add(piece, step, values, slopes, 0.0)
        melts = _melts(step, values, slopes, self._lever.equations.laws.limit[0])
        end = step.end if melts is None else melts
        if self._report_times is None:
            inside = np.linspace(step.start, end, self._per_step + 1)[1:]
        else:
            inside = self._report_times[
                (self._report_times > step.start) & (self._report_times <= end)
            ]
        for t in inside.tolist():
            self._add(piece, step, values, slopes, t)
        return melts

    def _add(self, piece: Piece, step: TimeStep, values: Array, slopes: Array, t: float) -> None:
        self.time.append(t)
        self.bias.append(piece.bias(t))
        self.values.append(hermite(step.start, step.end, values, slopes, t))
        if self._callback is not None:
            own = self._lever.space.size + 1
            both = own + self._lever.equations.heat_in_air.size
            x, in_air, _ = np.split(step.between(t), [own, both])
            self._callback(t, State(self._lever, x, in_air))

    def _read(self, step: TimeStep) -> tuple[Array, Array]:
        """Return values and slopes (per µs) at both ends of the next step, each (9 + rows, 2).

        Behind what is `_REPORTED` come the rows of the monitors.
        """
        outputs, flows, held, at_ends = np.split(step.monitored, self._parts)
        moving, _, held_by, at_ends_by = np.split(step.monitored_slopes, self._parts)
        if self._at_ends is None:
            self._at_ends = float(at_ends[0, 0])
        added = self._added + np.outer(step.added[self._parts[0] : self._parts[1]], [0.0, 1.0])
        self._added = added[:, 1:]
        # what is held at the leg ends leaves without a flux at rest
        left, left_by = added[1:] - (at_ends - self._at_ends), flows[1:] - at_ends_by
        space = self._lever.space
        x, slopes = step.x[: space.size + 1], step.slopes[: space.size + 1]
        ends, rises, rises_by = np.arange(2), space.rises(x), space.rises(slopes)
        hottest = rises.argmax(axis=0)
        highest, highest_by = rises[None, hottest, ends], rises_by[None, hottest, ends]
        values = np.concatenate([outputs, highest, added[:1], held, left, self.monitors.values(x)])
        values[: len(self._zero)] += self._zero
        by_time = [moving, highest_by, flows[:1], held_by, left_by, self.monitors.changes(slopes)]
        return values, np.concatenate(by_time)


def _melts(step: TimeStep, values: Array, slopes: Array, limit_K: float) -> float | None:
    """Return when the hottest place reaches a limit within a step."""
    row = [_REPORTED.index("max_K")]
    if values[row[0], 1] < limit_K:
        return None

    from scipy.optimize import brentq  # takes longer than all levers

    def above(t: float) -> float:
        (highest_K,) = hermite(step.start, step.end, values[row], slopes[row], t)
        return float(highest_K) - limit_K

    return float(brentq(above, step.start, step.end)) if above(step.start) < 0 else step.start


def checked_times(at: ArrayLike) -> Array:
    """Return times (µs) in order, each once.

    Raises
    ------
    InputError
        If one is negative or not finite, or there is none but 0.
    """
    times = np.unique(np.atleast_1d(np.asarray(at, dtype=float)))
    if not times.size or not (np.isfinite(times) & (times >= 0)).all():
        raise InputError("found a time that is negative or not finite, expected times in µs")
    if times[-1] == 0.0:
        raise InputError("found no time but 0, expected a later one too")
    return times


def _dataset(lever: Lever, waveform: Waveform, recorder: _Recorder) -> xr.Dataset:
    monitors, count = recorder.monitors, len(_REPORTED)
    values = np.array(recorder.values).reshape(len(recorder.time), count + monitors.size)
    columns = dict(zip(_REPORTED, values[:, :count].T, strict=True))
    for name, of in (("reader_V", "lever_V"), ("lever_V", "lever_V"), ("current_mA", "current_mA")):
        # smaller ones are rounding errors
        noise = 1e-12 * np.abs(columns[of]).max()
        columns[name] = np.where(np.abs(columns[name]) < noise, 0.0, columns[name])
    columns["power_mW"] = columns["lever_V"] * columns["current_mA"]
    # the reader, where there is none, is NaN throughout
    variables = {"time_us": np.array(recorder.time), "bias_V": np.array(recorder.bias)}
    more = ("max_K", "supplied_nJ", "stored_nJ", "air_stored_nJ", "lost_nJ")
    variables |= {name: columns[name] for name in (*TIME_COLUMNS[2:], *more)}
    variables |= monitors.columns(values[:, count:])
    return history_dataset(lever, waveform, variables)


def history_dataset(lever: Lever, waveform: Waveform, columns: Mapping[str, Array]) -> xr.Dataset:
    """Return the dataset of a history of its columns, with notes on what it leaves out."""
    time, columns = columns["time_us"], with_following(lever.probe, columns)
    at_rest = lever.medium == "air" and not lever.equations.heat_in_air.size
    air_note = (
        "the air of this lever answers at once, as if it were at rest at every moment: what it "
        "takes up itself is left out (heat goes 15 µm into air in 10 µs)"
    )
    notes = [air_note] if at_rest else []
    notes += range_notes(lever.equations.laws.made_of, "{} µs on", time, columns["max_K"])
    variables, coordinates = with_meanings(lever.probe, columns, "time")
    return labelled(
        variables,
        "time",
        {"time": time, **coordinates},
        **probe_attributes(lever.probe),
        waveform=waveform.text,
        notes="\n".join(notes),
    )


def note_on_holder(lever: Lever, does: str) -> str:
    """Say what the holder of a chip does while a lever changes, if it gets warm at rest."""
    at_rest, in_time = (each.circuit.chip_K_per_mW for each in (lever, lever.in_pulses()))
    if in_time == at_rest:
        return ""
    return (
        f"the holder of the chip {does}: leg ends get warmer by {in_time:.2g} K/mW, which is what "
        f"spreads in the chip, and not by chip_K_per_mW = {at_rest:g} as at rest"
    )


def write_history(data: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a history as ``.csv`` (the columns of `TIME_COLUMNS`) or ``.nc`` (everything).

    Raises
    ------
    InputError
        If the suffix is neither, or the file cannot be written.
    """
    write_dataset(data, path, in_a_file(data, TIME_COLUMNS))
