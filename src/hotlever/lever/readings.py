"""Readings of a branch by a slow ramp of the bias.

A slow ramp of the bias takes the first state whose bias V_l + R_s I_h has been reached.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hotlever.piecewise import Piecewise, crossing
from hotlever.types import Array


@dataclass(frozen=True)
class Reading:
    """Where a slow ramp of the bias finds a lever.

    Attributes
    ----------
    u : ndarray, shape (n,)
        Where on the branch each bias asked for is; NaN beyond the last that has a state.
    jumps : list of tuple of float
        Bias (V) and tip temperature (K) at each fold that the ramp passes.
    last_V, last_u, last_K : float
        The highest bias that has a state on the branch, where that is, and the tip temperature.
    jumps_back : tuple of tuple of float
        As `jumps`, of a ramp that goes back to zero.
    """

    u: Array
    jumps: list[tuple[float, float]]
    last_V: float
    last_u: float
    last_K: float
    jumps_back: tuple[tuple[float, float], ...] = ()

    @property
    def mirrored(self) -> Reading:
        """The same of the other polarity."""
        jumps = [(-fold, tip) for fold, tip in self.jumps]
        return Reading(-self.u, jumps, -self.last_V, -self.last_u, self.last_K)

    def and_back(self, back: Reading) -> Reading:
        """Return what a ramp finds that goes back to zero from the last place of this one."""
        u = np.concatenate([self.u, back.u])
        return replace(self, u=u, jumps_back=tuple(back.jumps))

    def notes(self, bias: Array) -> list[str]:
        """Say where a ramp through some biases (V) leaves the branch for another part of it."""
        return [
            f"{back}at a bias of {fold:.4f} V the lever jumps from a tip at {tip:.0f} K to a "
            f"{other} branch"
            for back, other, jumps in (
                ("", "hotter", self.jumps),
                ("on the way back, ", "colder", self.jumps_back),
            )
            for fold, tip in jumps
            if bias.min(initial=0.0) < fold < bias.max(initial=0.0)
        ]


def there_and_back(bias: Array) -> Array:
    """Return rising biases, and behind them the same falling.

    Examples
    --------
    >>> there_and_back(np.array([0.0, 1.0, 2.0])).tolist()
    [0.0, 1.0, 2.0, 1.0, 0.0]
    """
    return np.concatenate([bias, bias[-2::-1]])


def slow_ramp(
    curve: Piecewise,
    turns: Array,
    end: float,
    bias: Array,
    tip_K: Callable[[float], Array],
    start: float | None = None,
) -> Reading:
    """Find the states that a slow ramp takes from a start upwards.

    Parameters
    ----------
    curve : Piecewise
        The bias (V) by u.
    turns : ndarray
        Each u at which the curve is level, rising.
    end : float
        Where the branch ends.
    bias : ndarray, shape (n,)
        What is looked for, in any order.
    tip_K : callable
        The tip temperature by u.
    start : float, optional
        Where the ramp begins; where there is no bias if left out.
    """
    u = np.full(bias.shape, np.nan)
    if start is None:
        start = 0.0
        # so little is no bias
        if abs(float(curve(start))) >= 1e-9:
            # a similar lever has no bias elsewhere, near where its branch was followed from
            roots = curve.roots()
            start = float(roots[np.argmin(np.abs(roots))]) if roots.size else float(curve.x[0])
    # what is at no bias is found to rounding errors
    reading = Reading(u, [], min(0.0, float(curve(start))), start, float(tip_K(start)))
    for low, high in pairwise([start, *turns[turns > start].tolist(), end]):
        highest = float(curve(high))
        if highest <= reading.last_V:
            continue  # the bias falls here, or has been as high before
        fell = float(curve(low)) < reading.last_V
        jumps = [*reading.jumps, (reading.last_V, reading.last_K)] if fell else reading.jumps
        here = np.flatnonzero(np.isnan(u) & (bias <= highest))
        u[here] = crossing(curve, low, high, bias[here])
        reading = Reading(u, jumps, highest, high, float(tip_K(high)))
    return reading
