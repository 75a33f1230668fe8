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
    lever = lever.in_pulses()
    options["tolerance_K"] = tolerance_K
    starts, last_K = [initial_state(lever, waveform) if start is None else start], 0.0
    for _ in range(_MOST):
        cycle = Cycle.integrated(lever, waveform, period, starts[-1], at, last_K, **options)
        last_K = cycle.change_K
        if cycle.change_K < 0.1 * tolerance_K or cycle.remaining_K < 0.3 * tolerance_K:
            return cycle.history, cycle.start
        starts.append(_with_steady_air(cycle, period))
        if len(starts) > _KNOWN:
            # the next period begins somewhere else
            starts, last_K = [_extrapolated(starts[-_KNOWN:], lever)], 0.0
    raise ComputationError(
        f"after {_MOST} periods of {period:g} µs one is still not like the last: the tip's state "
        f"at the beginning changes by {cycle.change_K:.2g} K"
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
