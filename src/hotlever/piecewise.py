"""Polynomials between nodes, in closed form: those given, and smooth curves through values."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import comb
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hotlever.types import Array, Index

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


@dataclass(frozen=True, eq=False)
class Piecewise:
    """Polynomials between nodes; the outer ones go on beyond the ends.

    Like ``scipy.interpolate.PPoly``, whose import takes longer than that of all levers.

    Attributes
    ----------
    c : ndarray, shape (degree + 1, k - 1, ...)
        Coefficients of the distance from the node before, the highest power first.
    x : ndarray, shape (k,)
        Nodes, rising.

    Examples
    --------
    >>> halves = Piecewise(np.array([[1.0, -1.0], [0.0, 1.0]]), np.array([0.0, 1.0, 3.0]))
    >>> halves([0.5, 1.5, 4.0]).tolist(), halves(2.5, 1).item(), halves.roots().tolist()
    ([0.5, 0.5, -2.0], -1.0, [0.0, 2.0])
    """

    c: Array
    x: Array

    def __call__(self, u: ArrayLike, derivative: int = 0) -> Array:
        """Return values or a derivative at some places: their shape, and that of a value."""
        if derivative:
            return self.derivative()(u, derivative - 1)
        u = np.asarray(u, dtype=float)
        before = np.clip(np.searchsorted(self.x, u, side="right") - 1, 0, self.x.size - 2)
        away = (u - self.x[before]).reshape((*u.shape, *(1,) * (self.c.ndim - 2)))
        values = self.c[0][before]
        for coefficients in self.c[1:]:
            values = values * away + coefficients[before]
        return np.asarray(values)

    def __mul__(self, other: Piecewise | float) -> Piecewise:
        """Return the product with a number, or of single quantities with the same nodes."""
        if not isinstance(other, Piecewise):
            return Piecewise(self.c * other, self.x)
        product = np.zeros((len(self.c) + len(other.c) - 1, self.x.size - 1))
        for power, row in enumerate(self.c):
            product[power : power + len(other.c)] += row * other.c
        return Piecewise(product, self.x)

    def __sub__(self, other: Piecewise | float) -> Piecewise:
        """Return the difference from a number, or from one of the same degree and nodes."""
        if isinstance(other, Piecewise):
            return Piecewise(self.c - other.c, self.x)
        return Piecewise(np.concatenate([self.c[:-1], self.c[-1:] - other]), self.x)

    def derivative(self) -> Piecewise:
        """Return the first derivative."""
        powers = np.arange(len(self.c) - 1, 0, -1).reshape(-1, *(1,) * (self.c.ndim - 1))
        return Piecewise(self.c[:-1] * powers, self.x)

    def roots(self, rounding: float = 1e-10) -> Array:
        """Return where a single quantity is zero between the first and the last node, rising.

        One may be off by `rounding`, as a part of the distance between two nodes.
        """
        roots, widths = [np.empty(0)], np.diff(self.x)
        for piece in np.flatnonzero(_may_vanish(self.c, widths, rounding)).tolist():
            coefficients, left, width = self.c[:, piece], self.x[piece], widths[piece]
            away = np.roots(coefficients)
            real = away.real[np.abs(away.imag) <= rounding * width]
            inside = (real >= -rounding * width) & (real <= width * (1 + rounding))
            roots.append(left + real[inside])
        rising = np.unique(np.clip(np.concatenate(roots), self.x[0], self.x[-1]))
        # one at a node belongs to the polynomials on both sides of it
        again = np.diff(rising, prepend=-np.inf) <= 2 * rounding * np.ptp(self.x)
        return np.asarray(rising[~again])


def hermite_cubic(x: Array, y: Array, slopes: Array) -> Piecewise:
    """Return the piecewise cubic through values and slopes at rising nodes, (k,) each.

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 3.0])
    >>> hermite_cubic(x, x**3, 3 * x**2)(2.0).item()
    8.0
    """
    h = np.diff(x)
    rise, low, high = np.diff(y) / h, slopes[:-1], slopes[1:]
    bend = (3.0 * rise - 2.0 * low - high) / h
    return Piecewise(np.stack([(low + high - 2.0 * rise) / h**2, bend, low, y[:-1]]), x)


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


def _may_vanish(c: Array, widths: Array, rounding: float) -> NDArray[np.bool_]:
    """Return which polynomials may have a root: those whose Bernstein coefficients differ in sign.

    A polynomial lies between its smallest and its largest one. Most pieces have no root, and each
    that may have one costs the eigenvalues of a matrix.
    """
    degree = len(c) - 1
    orders = range(degree + 1)
    to_bernstein = [[comb(i, j) / comb(degree, j) for j in orders] for i in orders]
    powers = c[::-1] * widths ** np.arange(degree + 1)[:, None]
    bernstein = np.array(to_bernstein) @ powers
    clear = rounding * np.abs(bernstein).max(axis=0)
    return np.asarray((bernstein.min(axis=0) <= clear) & (bernstein.max(axis=0) >= -clear))


def _end(h: float, next_h: float, rise: float, next_rise: float) -> float:
    """Return the slope at an end, which rises with the first values and not too fast."""
    slope = ((2.0 * h + next_h) * rise - h * next_rise) / (h + next_h)
    if slope * rise <= 0.0:
        return 0.0
    if rise * next_rise <= 0.0 and abs(slope) > 3.0 * abs(rise):
        return 3.0 * rise
    return slope


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
    stencil, weights = _bend_weights(tuple(u.tolist()))
    width = stencil.shape[1]
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


# many curves in turn have one set of nodes
@lru_cache(maxsize=32)
def _bend_weights(nodes: tuple[float, ...]) -> tuple[Index, Array]:
    """Return the neighbours of each node, (k, 3), and their weights in its second derivative."""
    u = np.array(nodes)
    width = min(3, u.size)
    first = np.clip(np.arange(u.size) - 1, 0, u.size - width)
    stencil = first[:, None] + np.arange(width)
    return stencil, hermite_weights(u[stencil], u, derivative=2)


def spline_through(u: Array, values: Array, most: int = 3) -> BSpline:
    """Return the interpolating spline of values (k, ...) at some u, of at most some degree.

    What is NaN, as the reader voltage of a lever without a reader, stays so.
    """
    from scipy.interpolate import make_interp_spline  # takes longer than all levers

    missing = np.isnan(values).any(axis=0)
    spline: BSpline = make_interp_spline(u, np.where(missing, 0.0, values), min(most, u.size - 1))
    spline.c[:, missing] = np.nan
    return spline


def spline_values(u: Array, values: Array, at: Array, derivative: int = 0) -> Array:
    """Return values, or a derivative, of the cubic spline through values (k, ...) at some u.

    As `spline_through`, which takes longer: many splines in turn have one set of nodes.

    Examples
    --------
    >>> u = np.linspace(0.0, 1.0, 5)
    >>> spline_values(u, u**3, np.array([0.3])).round(12).tolist()
    [0.027]
    """
    weights = _cardinal_splines(tuple(u.tolist()))(at, derivative)
    return np.asarray(np.tensordot(weights, values, axes=1))


@lru_cache(maxsize=32)
def _cardinal_splines(nodes: tuple[float, ...]) -> BSpline:
    """Return the splines that are one at a node and zero at all others."""
    return spline_through(np.array(nodes), np.eye(len(nodes)))


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
    right_hand_side = np.zeros((len(nodes), degree.size, 1))
    right_hand_side[:, derivative] = float(np.prod(np.arange(1, derivative + 1)))
    weights = np.linalg.solve(np.swapaxes(moments, 1, 2), right_hand_side)[:, :, 0]
    weights[:, nodes.shape[1] :] *= width
    return np.asarray(weights / width**derivative)


def crossing(curve: Piecewise, low: float, high: float, values: Array) -> Array:
    """Return where a curve that rises from `low` to `high` has some values, or begins above."""
    at = _samples(curve, low, high)
    heights = np.maximum.accumulate(curve(at))
    before = np.clip(np.searchsorted(heights, values) - 1, 0, at.size - 2)
    left, right = at[before], at[before + 1]
    u = np.interp(values, heights, at)
    # between two samples it is one polynomial
    piece = np.clip(np.searchsorted(curve.x, left, side="right") - 1, 0, curve.x.size - 2)
    start, (highest, *lower) = curve.x[piece], curve.c[:, piece]
    for _ in range(6):
        away, height, slope = u - start, highest, np.zeros(u.shape)
        for coefficients in lower:
            height, slope = height * away + coefficients, slope * away + height
        u = (u - (height - values) / np.maximum(slope, 1e-12)).clip(left, right)
    return np.where(values <= heights[0], low, u)


def _samples(curve: Piecewise, low: float, high: float) -> Array:
    """Return points between which a curve is smooth enough for a few steps of Newton's method."""
    inner = curve.x[(curve.x > low) & (curve.x < high)]
    ends = np.concatenate([[low], inner, [high]])
    between = 8
    shares = np.arange(between) / between
    return np.append((ends[:-1, None] + np.diff(ends)[:, None] * shares).ravel(), high)
