"""Smooth curves through values and slopes at some nodes, in closed form."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from hotlever.piecewise import Piecewise
from hotlever.types import Array

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

#: Points between two nodes at which a value is first looked for, and steps of Newton's method from
#: there.
_SAMPLES, _NEWTON_STEPS = 8, 6


def smooth_curve(u: Array, values: Array, slopes: Array, steps: Array | tuple = ()) -> Piecewise:
    """Return the curve through values and slopes: of fifth degree, twice differentiable.

    The second derivative at a node is that of the polynomial through its own and both
    neighbours' values and slopes, so that the error falls as the sixth power of the spacing.

    Parameters
    ----------
    u : ndarray, shape (k,)
        Rising, two nodes or more.
    values, slopes : ndarray, shape (k, ...)
    steps : ndarray
        Nodes at which higher derivatives step: no polynomial reaches across them.

    Examples
    --------
    >>> u = np.linspace(0.0, 1.0, 5)
    >>> round(float(smooth_curve(u, u**5, 5 * u**4)(0.3)), 12)
    0.00243
    """
    inner = np.flatnonzero(np.isin(u[1:-1], steps)) + 1
    ends = [0, *inner.tolist(), u.size - 1]
    pieces = [
        _coefficients(u[a : b + 1], values[a : b + 1], slopes[a : b + 1]) for a, b in pairwise(ends)
    ]
    return Piecewise(np.concatenate(pieces, axis=1), u)


def _coefficients(u: Array, values: Array, slopes: Array) -> Array:
    """Return the coefficients of the polynomials between nodes, the highest power first."""
    width = min(3, u.size)
    first = np.clip(np.arange(u.size) - 1, 0, u.size - width)
    stencil = first[:, None] + np.arange(width)
    weights = hermite_weights(u[stencil], u, derivative=2)
    bends = np.einsum("kj,kj...->k...", weights[:, :width], values[stencil])
    bends += np.einsum("kj,kj...->k...", weights[:, width:], slopes[stencil])
    h = np.diff(u).reshape(-1, *(1,) * (values.ndim - 1))
    rise = (values[1:] - values[:-1]) / h
    low, high = slopes[:-1], slopes[1:]
    bend, bent = bends[:-1] * h / 2, bends[1:] * h / 2
    return np.stack(
        [
            (6 * rise - 3 * (low + high) + (bent - bend)) / h**4,
            (-15 * rise + 8 * low + 7 * high + (3 * bend - 2 * bent)) / h**3,
            (10 * rise - 6 * low - 4 * high - (3 * bend - bent)) / h**2,
            bend / h,
            low,
            values[:-1],
        ]
    )


def spline_through(u: Array, values: Array, most: int = 3) -> BSpline:
    """Return the interpolating spline of values (k, ...) at some u, of at most some degree.

    What is NaN, as the reader voltage of a lever without a reader, stays so.
    """
    from scipy.interpolate import make_interp_spline  # for the same reason as above

    missing = np.isnan(values).any(axis=0)
    spline: BSpline = make_interp_spline(u, np.where(missing, 0.0, values), min(most, u.size - 1))
    spline.c[:, missing] = np.nan
    return spline


def hermite_weights(nodes: Array, at: Array, derivative: int = 0) -> Array:
    """Return the weights, (n, 2k), of k values and then k slopes that interpolate at n points.

    Each has nodes of its own, (n, k), and lies inside or outside; or a derivative is wanted.

    Examples
    --------
    >>> hermite_weights(np.array([[0.0, 1.0]]), np.array([0.5])).tolist()
    [[0.5, 0.5, 0.125, -0.125]]
    """
    width = np.ptp(nodes, axis=1)[:, None]
    t = (nodes - at[:, None]) / width
    degree = np.arange(2 * nodes.shape[1])
    powers = t[:, :, None] ** degree
    slopes = degree * t[:, :, None] ** np.maximum(degree - 1, 0)
    moments = np.concatenate([powers, slopes], axis=1)
    wanted = np.zeros((len(nodes), degree.size, 1))
    wanted[:, derivative] = float(np.prod(np.arange(1, derivative + 1)))
    weights = np.linalg.solve(np.swapaxes(moments, 1, 2), wanted)[:, :, 0]
    weights[:, nodes.shape[1] :] *= width
    return np.asarray(weights / width**derivative)


def crossing(curve: Piecewise, low: float, high: float, values: Array) -> Array:
    """Return where a curve that rises from `low` to `high` has some values, or begins above."""
    at = _samples(curve, low, high)
    heights = np.maximum.accumulate(curve(at))
    before = np.clip(np.searchsorted(heights, values) - 1, 0, at.size - 2)
    left, right = at[before], at[before + 1]
    u = np.interp(values, heights, at)
    for _ in range(_NEWTON_STEPS):
        slope = np.maximum(curve(u, 1), 1e-12)
        u = np.clip(u - (curve(u) - values) / slope, left, right)
    return np.where(values <= heights[0], low, u)


def _samples(curve: Piecewise, low: float, high: float) -> Array:
    """Return points between which a curve is smooth enough for a few steps of Newton's method."""
    inner = curve.x[(curve.x > low) & (curve.x < high)]
    ends = np.concatenate([[low], inner, [high]])
    shares = np.arange(_SAMPLES) / _SAMPLES
    return np.append((ends[:-1, None] + np.diff(ends)[:, None] * shares).ravel(), high)
