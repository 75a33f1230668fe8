"""A lever in time under a wave form that is repeated: its cyclic steady state, and long trains.

Periods are integrated one after the other. What a period begins with changes less each time; all
that is still to come is a geometric series, whose ratio the last two changes tell.

Long trains of pulses are simulated on modes where those are certified by the full lever. Modes are
those of the first periods. On them the train is simulated, until its periods are alike;
then the full lever is integrated from a state late in the train, and tells, as the first periods
do, how far the reduced one departs within a period, and from that to the next. Where it departs too
far, what the full lever did there joins the snapshots, and the train is simulated once more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import ComputationError
from hotlever.lever.lever import State
from hotlever.lever.transient.history import (
    checked_times,
    history_dataset,
    initial_state,
    integrate,
    note_on_holder,
)
from hotlever.lever.transient.reduced import on_all_nodes, reduced_in_time
from hotlever.lever.transient.waveform import Polyline, Waveform
from hotlever.types import Array, Progress
from hotlever.work import one_blas_thread

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever.lever import Lever


@dataclass(frozen=True)
class TrainOptions:
    """How trains are simulated on modes, and the cyclic steady state is looked for.

    Attributes
    ----------
    fewest : int
        Periods from which modes pay.
    periods : int
        Those that are integrated to make modes, or to compare.
    rounds : int
        How often modes are made.
    per_step : int
        Points of a history for each step, where levers are compared.
    largest_ratio : float
        Most of what a departure within a period grows to, as it is carried on by the next ones.
    alike : float
        Share of the tolerance by which all later periods together may differ from a copy.
    most_to_steady : int
        Periods that are integrated at most until one begins as the one before.
    extrapolated_from : int
        Periods from which the steady state is extrapolated.
    """

    fewest: int = 20
    periods: int = 2
    rounds: int = 4
    per_step: int = 2
    largest_ratio: float = 0.97
    alike: float = 0.01
    most_to_steady: int = 60
    extrapolated_from: int = 4


@one_blas_thread
def simulate(
    lever: Lever,
    waveform: Waveform,
    until: float | None = None,
    at: ArrayLike | None = None,
    *,
    tolerance_K: float = 0.1,
    start: State | None = None,
    callback: Callable[[float, State], None] | None = None,
    trains: TrainOptions | None = None,
    **options: Any,
) -> xr.Dataset:
    """Simulate a lever in time, on modes if the wave form is repeated often and they suffice.

    Parameters and errors are those of `hotlever.lever.transient.history.integrate`; ``notes`` of
    the dataset say whether modes were used, and how far from the full lever they are, and that
    a warm holder of the chip is left out.

    Examples
    --------
    >>> from hotlever import Lever, Probe
    >>> from hotlever.lever.transient import pulse
    >>> history = simulate(Lever(Probe.reference()), pulse(10.0, 5.0), at=[5.0, 100.0])
    >>> history.tip_K.values.round().tolist()
    [410.0, 293.0]
    """
    cold_holder, lever = note_on_holder(lever, "stays cold"), lever.in_pulses()
    end, period = waveform.usual_end if until is None else until, waveform.period
    if at is not None and until is None:
        end = float(checked_times(at)[-1])
    trains = trains or TrainOptions()
    often = waveform.count >= trains.fewest and end < np.inf
    # modes are of levers that only the swept supply drives, from cold
    cold = start is None and not lever.space.held
    if period is not None and often and trains.fewest * period <= end and cold:
        try:
            how: Any = {"callback": callback, "trains": trains, **options}
            history = _on_modes(lever, waveform, period, end, at, tolerance_K, **how)
            return _with_note(history, cold_holder)
        except ComputationError:
            pass  # it melts, or is like no train that modes are good for
    options |= {"tolerance_K": tolerance_K, "start": start, "callback": callback}
    return _with_note(integrate(lever, waveform, until, at, **options), cold_holder)


def _on_modes(
    lever: Lever,
    waveform: Waveform,
    period: float,
    end: float,
    at: ArrayLike | None,
    tolerance_K: float,
    callback: Callable[[float, State], None] | None,
    trains: TrainOptions,
    **options: Any,
) -> xr.Dataset:
    """Return the history on modes that are certified.

    Raises
    ------
    ComputationError
        If there are none.
    """
    snapshots: list[Array] = []
    over_periods = partial(
        integrate, waveform=waveform, until=trains.periods * period, tolerance_K=tolerance_K
    )

    def integrated(start: State | None) -> xr.Dataset:
        """Integrate the full lever over some periods, and keep its states."""

        def keep(t: float, state: State) -> None:
            snapshots.append(state.x)

        return over_periods(lever, start=start, per_step=trains.per_step, callback=keep)

    def departure(full: xr.Dataset, start: State) -> float:
        """Estimate how far (K) the reduced lever departs from the full one in the long run."""
        times = full.time.values
        reduced = over_periods(start.lever, at=times, start=start)
        away = np.abs(full.tip_K.values - reduced.tip_K.values)
        first, second = away[times <= period], away[times > period]
        # what is carried on to a later period decays, at a rate that the ends of two tell
        ratio = min(max(second[-1] / max(first[-1], 1e-12) - 1.0, 0.0), trains.largest_ratio)
        return float(away.max() + first[-1] * ratio / (1.0 - ratio))

    first = integrated(None)
    report_times = None if at is None else checked_times(at)
    for _ in range(trains.rounds):
        reduced = reduced_in_time(lever, np.hstack(snapshots))
        train = Train(
            reduced, waveform, period, end, report_times, tolerance_K, trains.alike, **options
        )
        late = train.start(train.whole - trains.periods)
        away = max(
            departure(first, train.start(0)),
            departure(integrated(on_all_nodes(lever, late)), late),
        )
        if away < tolerance_K:
            break
    else:
        raise ComputationError(f"modes of the first periods are off by {away:.2g} K")
    if callback is not None:
        for t, state in train.states:
            callback(t, on_all_nodes(lever, state))
    history = train.history
    note = (
        f"simulated on {reduced.space.size} modes, within {away:.1g} K of the full lever as "
        f"compared from periods 1 and {train.whole - trains.periods + 1} on"
    )
    if train.cyclic_from is not None:
        note += f"; from period {train.cyclic_from + 1} on all are alike"
    return _with_note(history, note)


def _with_note(history: xr.Dataset, note: str) -> xr.Dataset:
    history.attrs["notes"] = "\n".join(filter(None, [history.attrs["notes"], note]))
    return history


class Train:
    """A train of pulses, simulated until it is in its cyclic steady state, and copied from there.

    Parameters
    ----------
    lever : Lever
        Of few unknowns.
    waveform : Waveform
    period, end : float
        µs.
    report_times : ndarray, or None
        Times (µs) to report; None for those at which the solver stepped.
    tolerance_K : float
    alike : float
        See `TrainOptions`.
    per_step : int
        See `hotlever.lever.transient.history.integrate`.
    progress : callable, optional

    Attributes
    ----------
    history : xarray.Dataset
    whole : int
        Periods that are not cut off by the end.
    cyclic_from : int or None
        The first period that is a copy, if one is.
    states : list of (float, State)
        At the times reported.

    Raises
    ------
    ComputationError
        If silicon melts, or a step fails.
    """

    def __init__(
        self,
        lever: Lever,
        waveform: Waveform,
        period: float,
        end: float,
        report_times: Array | None,
        tolerance_K: float,
        alike: float = TrainOptions.alike,
        per_step: int = 1,
        progress: Progress | None = None,
    ) -> None:
        self.whole = min(waveform.count, int(end / period * (1.0 + 1e-9)))
        self._period, self._cut_off = period, end - self.whole * period
        if self._cut_off < 1e-9 * end:
            self._cut_off = 0.0
        self.cyclic_from: int | None = None
        self.states: list[tuple[float, State]] = []
        self._starts: list[State] = []
        self._columns: list[dict[str, Array]] = []
        self._added = dict.fromkeys(("supplied_nJ", "lost_nJ"), 0.0)
        self._report_times: list[Array] | None = None
        if report_times is not None:
            ends = period * np.arange(1, self.whole + (1 if self._cut_off else 0))
            self._report_times = np.split(
                report_times, np.searchsorted(report_times, ends, side="right")
            )
        start, last_K = initial_state(lever, waveform), 0.0

        def integrated(wave: Waveform, length: float, first: int, last: int) -> Cycle:
            """Go on from where the last period ended, over one that stands for some."""
            return Cycle.integrated(
                *(lever, wave, length, start, self._phases(first, last), last_K),
                tolerance_K=tolerance_K,
                per_step=per_step,
            )

        for number in range(self.whole):
            self._starts.append(start)
            cycle = integrated(waveform, period, number, number + 1)
            self._add(number, cycle)
            start, last_K = cycle.states[-1], cycle.change_K
            if progress is not None:
                progress(int(1000 * (number + 1) * period / end), 1000)
            if cycle.remaining_K < alike * tolerance_K:
                self._starts.append(start)
                self.cyclic_from = number + 1
                cycle = integrated(waveform, period, number + 1, self.whole)
                for copy in range(number + 1, self.whole):
                    self._add(copy, cycle)
                break
        if self._cut_off:
            # beyond the last pulse the bias stays
            volts = float(waveform.bias(np.array([end]))[0])
            flat = Polyline(waveform.text, (0.0,), (volts,), self._cut_off, volts)
            wave = flat if self.whole == waveform.count else waveform
            self._add(self.whole, integrated(wave, self._cut_off, self.whole, self.whole + 1))
        columns = {
            name: np.concatenate([part[name] for part in self._columns])
            for name in self._columns[0]
        }
        self.history = history_dataset(lever, waveform, columns)

    def start(self, number: int) -> State:
        """Return the state at the beginning of a period, counted from 0."""
        return self._starts[number if self.cyclic_from is None else min(number, self.cyclic_from)]

    def _length(self, number: int) -> float:
        return self._period if number < self.whole else self._cut_off

    def _within(self, number: int, times: Array) -> Array:
        """Return times (µs) since the beginning of a period; none is beyond its ends."""
        return np.clip(times - number * self._period, 0.0, self._length(number))

    def _phases(self, first: int, last: int) -> Array | None:
        """Return the times within a period at which one of some is asked for, and its end."""
        if self._report_times is None:
            return None
        report_times = self._report_times[first:last]
        phases = [self._within(number, times) for number, times in enumerate(report_times, first)]
        return np.unique(np.concatenate([*phases, [self._length(first)]]))

    def _add(self, number: int, cycle: Cycle) -> None:
        """Add the rows of a period, and its energies to those before."""
        history, time = cycle.history, cycle.history.time.values
        if self._report_times is None:
            # the first row of a later period is the last one of that before
            rows = np.arange(min(number, 1), time.size)
            row_times = number * self._period + time[rows]
        else:
            row_times = self._report_times[number]
            rows = np.searchsorted(time, self._within(number, row_times))
        columns = {str(name): values.values[rows] for name, values in history.data_vars.items()}
        columns["time_us"] = row_times
        for name, before in self._added.items():
            columns[name] = before + columns[name]
            self._added[name] = before + float(history[name].values[-1])
        self._columns.append(columns)
        self.states += [
            (t, cycle.states[row]) for t, row in zip(row_times.tolist(), rows, strict=True)
        ]


@dataclass(frozen=True)
class Cycle:
    """One period of a lever.

    Attributes
    ----------
    start : State
    history : xarray.Dataset
    states : list of State
        At the times of the history; the last one is the end of the period, at which the next one
        begins.
    change_K, remaining_K : float
        By how much the temperatures at its end differ from those at its start, and by how much
        those of all later periods do.
    """

    start: State
    history: xr.Dataset
    states: list[State]
    change_K: float
    remaining_K: float

    @classmethod
    def integrated(
        cls,
        lever: Lever,
        waveform: Waveform,
        period: float,
        start: State,
        at: ArrayLike | None,
        last_change_K: float,
        **options: Any,
    ) -> Cycle:
        """Integrate a period (µs) from a state, about where the one before ended.

        That one changed by `last_change_K`; 0 if there is none. Options are those of
        `hotlever.lever.transient.history.integrate`.

        Raises
        ------
        HistoryEndError
            If silicon melts or a step fails.
        """
        states: list[State] = []
        history = integrate(
            lever,
            waveform,
            period,
            at,
            start=start,
            callback=lambda t, state: states.append(state),
            **options,
        )
        rises = lever.space.rises(states[-1].x - start.x)
        change = float(np.abs(rises).max())
        remaining = np.inf
        if change < last_change_K:
            remaining = change**2 / (last_change_K - change)
        return cls(start, history, states, change, remaining)


def cyclic_steady_state(
    lever: Lever,
    waveform: Waveform,
    period: float,
    *,
    start: State | None = None,
    at: ArrayLike | None = None,
    tolerance_K: float = 0.1,
    trains: TrainOptions | None = None,
    **options: Any,
) -> tuple[xr.Dataset, State]:
    """Simulate a lever under a repeated wave form until a period begins as the one before.

    Parameters
    ----------
    lever : Lever
    waveform : Waveform
        One period of it.
    period : float
        µs.
    start : State, optional
        Near that at which a period begins; at rest by default.
    at : array_like, optional
        Times within the period (µs) to report.
    tolerance_K : float
        Of the steps, and of what the period may still change by (K).
    trains : TrainOptions, optional
    **options
        Of `hotlever.lever.transient.history.integrate`.

    Returns
    -------
    history : xarray.Dataset
        Of one period.
    start : State
        At its beginning.

    Raises
    ------
    HistoryEndError, ComputationError
        If silicon melts, a step fails, or no period is like the last.

    Notes
    -----
    What is left of the beginning decays with the slowest modes. From a few periods it is
    extrapolated away by reduced rank extrapolation (Sidi, J. Comput. Appl. Math. 36, 305 (1991)).
    """
    lever = lever.in_pulses()
    trains = trains or TrainOptions()
    options["tolerance_K"] = tolerance_K
    starts, last_K = [initial_state(lever, waveform) if start is None else start], 0.0
    for _ in range(trains.most_to_steady):
        cycle = Cycle.integrated(lever, waveform, period, starts[-1], at, last_K, **options)
        last_K = cycle.change_K
        if cycle.change_K < 0.1 * tolerance_K or cycle.remaining_K < 0.3 * tolerance_K:
            return cycle.history, cycle.start
        starts.append(_with_steady_air(cycle, period))
        known = trains.extrapolated_from
        if len(starts) > known:
            # the next period begins somewhere else
            starts, last_K = [_extrapolated(starts[-known:], lever)], 0.0
    raise ComputationError(
        f"after {trains.most_to_steady} periods of {period:g} µs one is still not like the last: "
        f"the tip's state at the beginning changes by {cycle.change_K:.2g} K"
    )


def _with_steady_air(cycle: Cycle, period: float) -> State:
    """Return the state after a period, with the air as it is after many such.

    Air far away takes milliseconds to get warm, but hardly matters to the lever.
    """
    last = cycle.states[-1]
    begin, end, own = cycle.start.unknowns, last.unknowns, len(last.x)
    in_air = last.lever.equations.heat_in_air.cyclic(begin[own:], end[own:], period)
    return State(last.lever, end[:own], in_air)


def _extrapolated(starts: list[State], lever: Lever) -> State:
    """Extrapolate states at the beginning of successive periods to their limit."""
    own = lever.space.size + 1
    columns = np.hstack([state.unknowns for state in starts])
    changes = np.diff(lever.space.rises(columns[:own]), axis=1)
    bends = np.diff(changes, axis=1)
    shares, *_ = np.linalg.lstsq(bends, -changes[:, 0], rcond=1e-8)
    limit = columns[:, :1] + np.diff(columns, axis=1)[:, : shares.size] @ shares[:, None]
    return State(lever, limit[:own], limit[own:])
