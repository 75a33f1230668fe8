"""The monotone cubic through values: no bump that the values do not have."""

from __future__ import annotations

import numpy as np

from hotlever.piecewise import Piecewise, hermite_cubic
from hotlever.types import Array


def monotone_cubic(x: Array, y: Array) -> Piecewise:
    """Return the piecewise cubic that rises and falls where its values do (PCHIP).

    Slopes at inner nodes are harmonic means of those to both sides (F. N. Fritsch and J. Butland,
    SIAM J. Sci. Stat. Comput. 5, 300 (1984)), at the ends those of a parabola through three values,
    limited. The curve is once differentiable, and without scipy, whose import takes longer than
    that of all levers.

    Parameters
    ----------
    x, y : ndarray, shape (k,)
        Rising nodes, two or more, and values.

    Examples
    --------
    >>> curve = monotone_cubic(np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.0, 1.0]))
    >>> curve([0.5, 1.0, 1.5]).tolist()
    [0.0, 0.0, 0.3125]
    """
    h = np.diff(x)
    rise = np.diff(y) / h
    slopes = np.full(x.size, rise[0])
    if x.size > 2:
        left, right = rise[:-1], rise[1:]
        weight_left, weight_right = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
        same = left * right > 0.0
        safe_left, safe_right = np.where(same, left, 1.0), np.where(same, right, 1.0)
        with np.errstate(over="ignore"):
            # beside a rise of next to nothing the curve is level
            harmonic = (weight_left + weight_right) / (
                weight_left / safe_left + weight_right / safe_right
            )
        slopes[1:-1] = np.where(same, harmonic, 0.0)
        slopes[0] = _end(h[0], h[1], rise[0], rise[1])
        slopes[-1] = _end(h[-1], h[-2], rise[-1], rise[-2])
    return hermite_cubic(x, y, slopes)


def _end(h: float, next_h: float, rise: float, next_rise: float) -> float:
    """Return the slope at an end, which rises with the first values and not too fast."""
    slope = ((2.0 * h + next_h) * rise - h * next_rise) / (h + next_h)
    if slope * rise <= 0.0:
        return 0.0
    if rise * next_rise <= 0.0 and abs(slope) > 3.0 * abs(rise):
        return 3.0 * rise
    return slope
