"""A lever under a wave form that is repeated, when each period has become like the last."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from hotlever.errors import ComputationError
from hotlever.lever.state import State
from hotlever.lever.transient.history import followed, kept_in
from hotlever.lever.transient.waveform import Waveform
from hotlever.types import Array

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
        if size < 0.1 * tolerance_K or left < tolerance_K:
            return history, before or State(lever, np.zeros_like(change))
        begins.append(last_state)
        last = size
        if len(begins) > _KNOWN:
            columns = [one.x for one in begins if one is not None]
            begins, last = [State(lever, _limit(np.hstack(columns), lever))], 0.0
    raise ComputationError(
        f"after {_MOST} periods of {period:g} µs one is still not like the last: the tip's state "
        f"at the beginning changes by {size:.2g} K"
    )


def _limit(columns: Array, lever: Lever) -> Array:
    """Extrapolate states at the beginning of successive periods (size + 1, n) to the limit."""
    changes = np.diff(lever.space.rises(columns), axis=1)
    bends = np.diff(changes, axis=1)
    shares, *_ = np.linalg.lstsq(bends, -changes[:, 0], rcond=1e-8)
    moved: Array = columns[:, :1] + np.diff(columns, axis=1)[:, : shares.size] @ shares[:, None]
    return moved
