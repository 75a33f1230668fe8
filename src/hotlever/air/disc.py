"""A hot disc midway between two cold planes (the paper's Fig. 8), solved exactly.

Mixed boundary conditions on the plane of the disc give dual integral equations, which turn into
one Fredholm equation of the second kind on 0 ≤ x ≤ 1 (Sneddon, Mixed Boundary Value Problems in
Potential Theory, 1966, chapter 8; Love's equation is its twin):

    f(x) + ∫₀¹ K(x, t) f(t) dt = 1,  K = (2/π) ∫₀^∞ (tanh(s h/r) − 1) cos(s x) cos(s t) ds,

and the disc loses 8 κ r ΔT ∫₀¹ f dt from both faces.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

#: Points of the Gauss rules for x and t, and for s.
_POINTS, _WAVES = 120, 400
#: tanh(s h/r) is one beyond s h/r of this.
_FLAT = 20.0


def disc_loss(distance_over_radius: ArrayLike) -> Array:
    """Heat lost by a disc midway between two planes, in units of κ r ΔT.

    Parameters
    ----------
    distance_over_radius : array_like
        Distance of each plane from the disc, over its radius; at least 0.02.

    Returns
    -------
    ndarray
        8 for planes far away, 2π r/h for near ones.

    Raises
    ------
    ValueError
        If a distance is too small to be resolved.

    Examples
    --------
    >>> disc_loss([0.1, 1.0, 1000.0]).round(2).tolist()
    [68.5, 12.77, 8.0]
    """
    distances = np.asarray(distance_over_radius, dtype=float)
    if not np.all(distances >= 0.02):
        raise ValueError(f"found h/r = {distances.min():g}, expected 0.02 or more")
    return np.array([_loss(h) for h in distances.ravel()]).reshape(distances.shape)


def disc_limits(distance_over_radius: ArrayLike) -> tuple[Array, Array]:
    """Return the loss for planes much nearer and much further than the radius (κ r ΔT).

    The paper's far limit, 4, counts one face.
    """
    distances = np.asarray(distance_over_radius, dtype=float)
    return 2.0 * np.pi / distances, np.full(distances.shape, 8.0)


def _loss(h: float) -> float:
    nodes, weights = _gauss(_POINTS, 1.0)
    waves, steps = _gauss(_WAVES, _FLAT / h)
    cosines = np.cos(np.outer(nodes, waves))
    kernel = (2.0 / np.pi) * (cosines * (steps * (np.tanh(waves * h) - 1.0))) @ cosines.T
    solution = np.linalg.solve(np.eye(_POINTS) + kernel * weights, np.ones(_POINTS))
    return 8.0 * float(weights @ solution)


def _gauss(count: int, end: float) -> tuple[Array, Array]:
    """Return a Gauss rule on 0 to `end`."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * end * (nodes + 1.0), 0.5 * end * weights
