"""The cyclic steady state of a lever under a wave form that is repeated.

Periods are integrated one after the other. What a period begins with changes less each time; all
that is still to come is a geometric series, whose ratio the last two changes tell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from hotlever.errors import ComputationError
from hotlever.lever.lever import State
from hotlever.lever.transient.history import initial_state, integrate
from hotlever.lever.transient.waveform import Waveform

if TYPE_CHECKING:
    from hotlever.lever.lever import Lever

#: Periods that are integrated at most, and those from which the steady state is extrapolated.
_MOST, _KNOWN = 60, 4


@dataclass(frozen=True)
class Cycle:
    """One period of a lever.

    Attributes
    ----------
    start : State
    history : xarray.Dataset
    states : list of State
        At the times of the history; the last one is the end of the period.
    change_K, remaining_K : float
        By how much the temperatures at its end differ from those at its start, and by how much
        those of all later periods do.
    """

    start: State
    history: xr.Dataset
    states: list[State]
    change_K: float
    remaining_K: float

    @property
    def end(self) -> State:
        """The state at which the next period begins."""
        return self.states[-1]


class Cycles:
    """Integrates periods of a lever, each of which begins about where the one before ended.

    Parameters
    ----------
    lever : Lever
    waveform : Waveform
        One period of it, or more.
    period : float
        µs.
    **options
        Of `hotlever.lever.transient.history.integrate`.
    """

    def __init__(self, lever: Lever, waveform: Waveform, period: float, **options: Any) -> None:
        self._lever, self._waveform, self._period = lever, waveform, period
        self._options, self._last_change_K = options, 0.0

    def integrate(self, start: State, at: ArrayLike | None = None) -> Cycle:
        """Integrate the next period from a state.

        Raises
        ------
        HistoryEndError
            If silicon melts or a step fails.
        """
        states: list[State] = []
        history = integrate(
            self._lever,
            self._waveform,
            self._period,
            at,
            start=start,
            callback=lambda t, state: states.append(state),
            **self._options,
        )
        rises = self._lever.space.rises(states[-1].x - start.x)
        change, last = float(np.abs(rises).max()), self._last_change_K
        remaining = change**2 / (last - change) if change < last else np.inf
        self._last_change_K = change
        return Cycle(start, history, states, change, remaining)

    def restart(self) -> None:
        """Forget the last change: the next period begins somewhere else."""
        self._last_change_K = 0.0


def cyclic_steady_state(
    lever: Lever,
    waveform: Waveform,
    period: float,
    *,
    start: State | None = None,
    at: ArrayLike | None = None,
    tolerance_K: float = 0.1,
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
    cycles = Cycles(lever, waveform, period, tolerance_K=tolerance_K, **options)
    starts = [initial_state(lever, waveform) if start is None else start]
    for _ in range(_MOST):
        cycle = cycles.integrate(starts[-1], at)
        if cycle.change_K < 0.1 * tolerance_K or cycle.remaining_K < 0.3 * tolerance_K:
            return cycle.history, cycle.start
        starts.append(_with_steady_air(cycle, period))
        if len(starts) > _KNOWN:
            starts = [_extrapolated(starts[-_KNOWN:], lever)]
            cycles.restart()
    raise ComputationError(
        f"after {_MOST} periods of {period:g} µs one is still not like the last: the tip's state "
        f"at the beginning changes by {cycle.change_K:.2g} K"
    )


def _with_steady_air(cycle: Cycle, period: float) -> State:
    """Return the state after a period, with the air as it is after many such.

    Air far away takes milliseconds to get warm, but hardly matters to the lever.
    """
    begin, end = cycle.start.unknowns, cycle.end.unknowns
    own, air = len(cycle.end.x), cycle.end.lever.equations.heat_in_air
    return State(cycle.end.lever, end[:own], air.cyclic(begin[own:], end[own:], period))


def _extrapolated(starts: list[State], lever: Lever) -> State:
    """Extrapolate states at the beginning of successive periods to their limit."""
    own = lever.space.size + 1
    columns = np.hstack([state.unknowns for state in starts])
    changes = np.diff(lever.space.rises(columns[:own]), axis=1)
    bends = np.diff(changes, axis=1)
    shares, *_ = np.linalg.lstsq(bends, -changes[:, 0], rcond=1e-8)
    limit = columns[:, :1] + np.diff(columns, axis=1)[:, : shares.size] @ shares[:, None]
    return State(lever, limit[:own], limit[own:])
