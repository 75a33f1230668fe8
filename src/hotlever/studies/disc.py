"""A hot disc midway between two cold planes (the paper's Fig. 8), solved exactly.

Mixed boundary conditions on the plane of the disc give dual integral equations, which turn into
one Fredholm equation of the second kind on 0 ≤ x ≤ 1 (Sneddon, Mixed Boundary Value Problems in
Potential Theory, 1966, chapter 8; Love's equation is its twin):

    f(x) + ∫₀¹ K(x, t) f(t) dt = 1,  K = (2/π) ∫₀^∞ (tanh(s h/r) − 1) cos(s x) cos(s t) ds,

and the disc loses 8 κ r ΔT ∫₀¹ f dt from both faces.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.threads import one_blas_thread
from hotlever.types import Array

#: Points of the Gauss rules for x and t, and for s.
_POINTS, _WAVES = 120, 400
#: tanh(s h/r) is one beyond s h/r of this.
_FLAT = 20.0


@one_blas_thread
def loss_between_planes(distance_over_radius: ArrayLike | None = None) -> xr.Dataset:
    """Return the heat lost by a disc midway between two planes and its limits (paper's Fig. 8).

    Parameters
    ----------
    distance_over_radius : array_like, optional
        Distances of each plane over the radius of the disc, at least 0.02; by default from near
        to far.

    Returns
    -------
    xarray.Dataset
        ``loss``, ``near`` and ``far`` in units of κ r ΔT on the dimension ``distance``. The
        paper's far limit, 4, counts one face.

    Raises
    ------
    ValueError
        If a distance is too small to be resolved.

    Examples
    --------
    >>> loss_between_planes([0.1, 1.0, 1000.0]).loss.values.round(2).tolist()
    [68.5, 12.77, 8.0]
    """
    if distance_over_radius is None:
        distance_over_radius = np.geomspace(0.03, 100.0, 60)
    distance = np.atleast_1d(np.asarray(distance_over_radius, dtype=float))
    if not np.all(distance >= 0.02):
        raise ValueError(f"found h/r = {distance.min():g}, expected 0.02 or more")
    columns = {
        "loss": [_loss(h) for h in distance],
        "near": 2.0 * np.pi / distance,
        "far": np.full(distance.shape, 8.0),
    }
    return labelled(columns, "distance", {"distance": distance})


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
