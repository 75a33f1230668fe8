"""Known branches of a reduced lever, from which states of any material are guessed.

Branches are compared at the same u = √(T_tip − T_base), in which every unknown is smooth down to
zero bias and at the knee. At every u the unknowns are quadratic functions of the parameters,
fitted to the known states and their derivatives. The bias follows for any series resistor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, CubicSpline, make_interp_spline

Array = NDArray[np.float64]

#: Points of the common grid in u.
_GRID = 33


@dataclass(frozen=True)
class Atlas:
    """Quadratic functions of the parameters that give a branch on a grid.

    Attributes
    ----------
    grid : ndarray, shape (g,)
        u (K^½), from 0.
    surface : ndarray, shape (terms, g, n)
        Coefficients, for the terms of `_terms`, of the unknowns up to V_l, and of I_h (mA).
    c_kappa : float or ndarray, shape ()
        Of all branches.
    """

    grid: Array
    surface: Array
    c_kappa: float | Array

    @classmethod
    def fitted(
        cls, grid: Array, places: Array, states: Array, slopes: Array, c_kappa: float
    ) -> Atlas:
        """Fit the coefficients to known branches.

        Parameters
        ----------
        grid : ndarray, shape (g,)
        places : ndarray, shape (k, p)
            Parameters of each branch, between 0 and 1.
        states : ndarray, shape (k, g, n)
        slopes : ndarray, shape (k, g, n, p)
            Derivatives by the parameters.
        c_kappa : float
        """
        values, gradients = zip(*(_terms(place) for place in places), strict=True)
        matrix = np.concatenate([np.stack(values), *(gradient.T for gradient in gradients)])
        known = np.concatenate([states, *np.moveaxis(slopes, 3, 1)])
        surface = np.linalg.lstsq(matrix, known.reshape(len(known), -1))[0]
        return cls(grid, surface.reshape(-1, *states.shape[1:]), c_kappa)

    def widened(self, *places_and_counts: int) -> Atlas:
        """Return an atlas with further unknowns, all zero: at a place, so many, and so on."""
        pairs = zip(places_and_counts[::2], places_and_counts[1::2], strict=True)
        places = np.concatenate([np.full(count, place) for place, count in pairs])
        surface = np.insert(self.surface, places.astype(int), 0.0, axis=2)
        return Atlas(self.grid, surface, self.c_kappa)

    def guess(
        self,
        place: Array,
        stretched: NDArray[np.bool_],
        c_kappa: float,
        series_resistance_kohm: float,
        bias: Array,
    ) -> Array | None:
        """Guess the states of a material at some biases.

        Parameters
        ----------
        place : ndarray, shape (p,)
            Its parameters.
        stretched : ndarray of bool, shape (n,)
            The unknowns that grow with √c_κ: all but temperatures.
        c_kappa : float
        series_resistance_kohm : float
        bias : ndarray, shape (b,)
            V.

        Returns
        -------
        ndarray, shape (n, b) or None
            Unknowns up to V_l, and V_b; None where the branch folds back or ends too early.
        """
        branch = np.tensordot(_terms(place)[0], self.surface, axes=1)
        branch[:, stretched] *= np.sqrt(c_kappa / self.c_kappa)
        branch[:, -1] = branch[:, -2] + series_resistance_kohm * branch[:, -1]
        if np.any(np.diff(branch[:, -1]) <= 0) or bias.max() > branch[-1, -1]:
            return None
        spline = CubicSpline(self.grid, branch)
        # where the bias rises along the branch, the inverse of its spline is a short search
        u = np.interp(bias, branch[:, -1], self.grid)
        for _ in range(3):
            slope = np.maximum(spline(u, 1)[:, -1], 1e-3)
            u = np.clip(u + (bias - spline(u)[:, -1]) / slope, 0.0, self.grid[-1])
        found = spline(u).T
        found[-1] = bias
        return np.asarray(found)

    def branch(
        self, place: Array, stretched: NDArray[np.bool_], c_kappa: float, functionals: Array
    ) -> Array:
        """Return linear functionals of the unknowns and of I_h on the grid.

        Parameters
        ----------
        place, stretched, c_kappa
            As for `guess`.
        functionals : ndarray, shape (f, n)

        Returns
        -------
        ndarray, shape (f, g)
        """
        stretch = np.where(stretched, np.sqrt(c_kappa / self.c_kappa), 1.0)
        weights = (functionals * stretch) @ np.moveaxis(self.surface, 1, 2)
        return np.asarray(np.tensordot(_terms(place)[0], weights, axes=1))


def _terms(place: Array) -> tuple[Array, Array]:
    """Return the terms of a quadratic function, (terms,), and their gradients, (terms, p)."""
    count = len(place)
    first, second = np.triu_indices(count)
    unit = np.eye(count)
    gradient = place[first, None] * unit[second] + place[second, None] * unit[first]
    return (
        np.concatenate([[1.0], place, place[first] * place[second]]),
        np.concatenate([np.zeros((1, count)), unit, gradient]),
    )


def branch_on_grid(u: Array, values: Array, along: Array, others: Array, grid: Array) -> tuple:
    """Bring a branch from where it was solved to the common grid.

    Parameters
    ----------
    u : ndarray, shape (m,)
        Rising, from 0.
    values : ndarray, shape (m, n)
    along : ndarray, shape (m, n)
        Derivatives of the values by u.
    others : ndarray, shape (m, n, p)
        Quantities without derivatives.
    grid : ndarray, shape (g,)

    Returns
    -------
    tuple of ndarray
        Shapes (g, n) and (g, n, p).
    """
    return (
        CubicHermiteSpline(u, values, along)(grid),
        make_interp_spline(u, others, k=3)(grid),
    )


def common_grid(ends: Array) -> Array:
    """Return the grid that all branches reach, for the last u of each."""
    return np.linspace(0.0, float(ends.min()), _GRID)
