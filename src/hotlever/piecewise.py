"""Polynomials between nodes, in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hotlever.types import Array

#: Part of the distance between two nodes by which a root may be off.
_ROUNDING = 1e-10


@dataclass(frozen=True)
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

    def roots(self) -> Array:
        """Return where a single quantity is zero between the first and the last node, rising."""
        roots, widths = [np.empty(0)], np.diff(self.x)
        for piece in np.flatnonzero(_may_vanish(self.c, widths)).tolist():
            coefficients, left, width = self.c[:, piece], self.x[piece], widths[piece]
            away = np.roots(coefficients)
            real = away.real[np.abs(away.imag) <= _ROUNDING * width]
            inside = (real >= -_ROUNDING * width) & (real <= width * (1 + _ROUNDING))
            roots.append(left + real[inside])
        rising = np.unique(np.clip(np.concatenate(roots), self.x[0], self.x[-1]))
        # one at a node belongs to the polynomials on both sides of it
        again = np.diff(rising, prepend=-np.inf) <= 2 * _ROUNDING * np.ptp(self.x)
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


def _may_vanish(c: Array, widths: Array) -> NDArray[np.bool_]:
    """Return which polynomials may have a root: those whose Bernstein coefficients differ in sign.

    A polynomial lies between its smallest and its largest one. Most pieces have no root, and each
    that may have one costs the eigenvalues of a matrix.
    """
    degree = len(c) - 1
    orders = range(degree + 1)
    to_bernstein = [[comb(i, j) / comb(degree, j) for j in orders] for i in orders]
    powers = c[::-1] * widths ** np.arange(degree + 1)[:, None]
    bernstein = np.array(to_bernstein) @ powers
    clear = _ROUNDING * np.abs(bernstein).max(axis=0)
    return np.asarray((bernstein.min(axis=0) <= clear) & (bernstein.max(axis=0) >= -clear))


def _end(h: float, next_h: float, rise: float, next_rise: float) -> float:
    """Return the slope at an end, which rises with the first values and not too fast."""
    slope = ((2.0 * h + next_h) * rise - h * next_rise) / (h + next_h)
    if slope * rise <= 0.0:
        return 0.0
    if rise * next_rise <= 0.0 and abs(slope) > 3.0 * abs(rise):
        return 3.0 * rise
    return slope
