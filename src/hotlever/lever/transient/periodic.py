"""A lever under a wave form that is repeated, when each period has become like the last."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from hotlever.errors import ComputationError
from hotlever.lever.state import State
from hotlever.lever.transient.history import followed, kept_in
from hotlever.lever.transient.waveform import Waveform

if TYPE_CHECKING:
    from hotlever.lever.lever import Lever

#: Periods that are followed at most, and those from which the settled one is extrapolated.
_MOST, _KNOWN = 60, 4


def settled(
    lever: Lever,
    waveform: Waveform,
    period: float,
    *,
    start: State | None = None,
    tolerance_K: float = 0.1,
    **options: Any,
) -> tuple[xr.Dataset, State]:
    """Follow a lever under a repeated wave form until a period begins as the one before.

    Parameters
    ----------
    lever : Lever
    waveform : Waveform
        One period of it.
    period : float
        µs.
    start : State, optional
        Near that at which a settled period begins; at rest by default.
    tolerance_K : float
        Of the steps, and of what the settled period may still change by (K).
    **options
        Of `hotlever.lever.transient.history.followed`.

    Returns
    -------
    history : xarray.Dataset
        Of one settled period.
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
    rises, begins, last = lever.space.rises, [start], 0.0
    for _ in range(_MOST):
        reached: list[tuple[float, State]] = []
        history = followed(
            lever,
            waveform,
            period,
            start=begins[-1],
            tolerance_K=tolerance_K,
            seen=kept_in(reached),
            **options,
        )
        before, (_, last_state) = begins[-1], reached[-1]
        change = last_state.x - (0.0 if before is None else before.x)
        size = float(np.abs(rises(change)).max())
        # all that is still to come, a geometric series
        left = size**2 / (last - size) if size < last else np.inf
        if size < 0.1 * tolerance_K or left < 0.3 * tolerance_K:
            return history, before or State(lever, np.zeros_like(change))
        begins.append(_air_settled(before, last_state, period))
        last = size
        if len(begins) > _KNOWN:
            known = [one for one in begins if one is not None]
            begins, last = [_limit(known, lever)], 0.0
    raise ComputationError(
        f"after {_MOST} periods of {period:g} µs one is still not like the last: the tip's state "
        f"at the beginning changes by {size:.2g} K"
    )


def _air_settled(before: State | None, after: State, period: float) -> State:
    """Return a state after a period, with the air as it is after many such.

    Air far away takes milliseconds to get warm, but hardly matters to the lever.
    """
    air = after.lever.equations.heat_in_air
    if air is None or after.in_air is None:
        return after
    begin = np.zeros_like(after.in_air)
    if before is not None:
        begin = air.follows(before.x) if before.in_air is None else before.in_air
    return State(after.lever, after.x, air.settled(begin, after.in_air, period))


def _limit(begins: list[State], lever: Lever) -> State:
    """Extrapolate states at the beginning of successive periods to the limit."""
    own = lever.space.size + 1
    columns = np.hstack(
        [one.x if one.in_air is None else np.vstack([one.x, one.in_air]) for one in begins]
    )
    changes = np.diff(lever.space.rises(columns[:own]), axis=1)
    bends = np.diff(changes, axis=1)
    shares, *_ = np.linalg.lstsq(bends, -changes[:, 0], rcond=1e-8)
    moved = columns[:, :1] + np.diff(columns, axis=1)[:, : shares.size] @ shares[:, None]
    return State(lever, moved[:own], moved[own:] if len(moved) > own else None)
