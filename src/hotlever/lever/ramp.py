"""A slow ramp of the bias along the curve of a lever: where it finds the biases asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hotlever.types import Array

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

#: Points between two states at which a bias is first looked for, and steps of Newton's method
#: from there.
_SAMPLES, _NEWTON_STEPS = 8, 6


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


def _samples(curve: PPoly, low: float, high: float) -> Array:
    """Return points between which a curve is smooth enough for a few steps of Newton's method."""
    inner = curve.x[(curve.x > low) & (curve.x < high)]
    ends = np.concatenate([[low], inner, [high]])
    shares = np.arange(_SAMPLES) / _SAMPLES
    return np.append((ends[:-1, None] + np.diff(ends)[:, None] * shares).ravel(), high)


def crossing(curve: PPoly, low: float, high: float, values: Array) -> Array:
    """Return where a curve that rises from `low` to `high` has some values, or begins above."""
    at = _samples(curve, low, high)
    known = np.maximum.accumulate(curve(at))
    place = np.clip(np.searchsorted(known, values) - 1, 0, at.size - 2)
    left, right = at[place], at[place + 1]
    u = np.interp(values, known, at)
    for _ in range(_NEWTON_STEPS):
        slope = np.maximum(curve(u, 1), 1e-12)
        u = np.clip(u - (curve(u) - values) / slope, left, right)
    return np.where(values <= known[0], low, u)
