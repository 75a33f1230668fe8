"""A slow ramp of the bias along the curve of a lever: where it finds the biases asked for.

It takes the first state whose bias V_l + R_s I_h has been reached.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hotlever.lever.curve import crossing
from hotlever.piecewise import Piecewise
from hotlever.types import Array


@dataclass(frozen=True)
class Reading:
    """Where a slow ramp of the bias finds a lever.

    Attributes
    ----------
    u : ndarray, shape (n,)
        Where on the branch each bias asked for is; NaN beyond the last that has a state.
    jumps : list of tuple of float
        Bias and tip temperature at each fold that the ramp passes.
    last_V, last_u, last_K : float
        The highest bias that has a state on the branch, where that is, and the tip temperature.
    """

    u: Array
    jumps: list[tuple[float, float]]
    last_V: float
    last_u: float
    last_K: float

    @property
    def mirrored(self) -> Reading:
        """The same of the other polarity."""
        jumps = [(-fold, tip) for fold, tip in self.jumps]
        return Reading(-self.u, jumps, -self.last_V, -self.last_u, self.last_K)

    def notes(self, bias: Array) -> list[str]:
        """Say where a ramp through some biases (V) leaves the branch for a hotter part of it."""
        return [
            f"at a bias of {fold:.4f} V the lever jumps from a tip at {tip:.0f} K to a hotter "
            "branch"
            for fold, tip in self.jumps
            if bias.min(initial=0.0) < fold < bias.max(initial=0.0)
        ]


def slow_ramp(
    curve: Piecewise, ends: list[float], bias: Array, tip_K: Callable[[float], Array]
) -> Reading:
    """Find the states that a slow ramp takes from zero upwards.

    Parameters
    ----------
    curve : Piecewise
        The bias (V) by u.
    ends : list of float
        Where the ramp begins, each u at which the curve is level, and where the branch ends.
    bias : ndarray, shape (n,)
        What is looked for, in any order.
    tip_K : callable
        The tip temperature by u.
    """
    u, start = np.full(bias.shape, np.nan), ends[0]
    # what is at no bias is found to rounding errors
    reading = Reading(u, [], min(0.0, float(curve(start))), start, float(tip_K(start)))
    for low, high in pairwise(ends):
        highest = float(curve(high))
        if highest <= reading.last_V:
            continue  # the bias falls here, or has been as high before
        fell = float(curve(low)) < reading.last_V
        jumps = [*reading.jumps, (reading.last_V, reading.last_K)] if fell else reading.jumps
        here = np.flatnonzero(np.isnan(u) & (bias <= highest))
        u[here] = crossing(curve, low, high, bias[here])
        reading = Reading(u, jumps, highest, high, float(tip_K(high)))
    return reading
