"""What air takes up from a disc (the paper's Fig. 8) and from a lever: is it one factor k?

The paper scales the power in air by one k (its Section V and Fig. 10); here it is by tip
temperature. A hot disc midway between two cold planes is solved exactly: mixed boundary conditions
on the plane of the disc give dual integral equations, which turn into one Fredholm equation of the
second kind on 0 ≤ x ≤ 1 (Sneddon, Mixed Boundary Value Problems in Potential Theory, 1966, chapter
8; Love's equation is its twin):

    f(x) + ∫₀¹ K(x, t) f(t) dt = 1,  K = (2/π) ∫₀^∞ (tanh(s h/r) − 1) cos(s x) cos(s t) ds,

and the disc loses 8 κ r ΔT ∫₀¹ f dt from both faces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from hotlever.datasets import labelled
from hotlever.lever import Branch, Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.types import Array, Progress
from hotlever.work import each, one_blas_thread

#: Tip temperatures (K) at which k is compared.
COLD, HOT = 330.0, 1006.0


def find_scale_factor(vacuum: Branch, air: Branch, hottest_K: float = HOT) -> xr.Dataset:
    """Return how much more power a lever needs in air than in vacuum, by tip temperature.

    Parameters
    ----------
    vacuum, air : Branch
        Of the same lever.
    hottest_K : float

    Returns
    -------
    xarray.Dataset
        ``k`` on the dimension ``tip_K``; ``best_k``, the single factor that leaves the smallest
        largest error of T_tip, and ``best_error_K``, that error.
    """
    tip = np.linspace(COLD, hottest_K, 120)
    k = air.power(tip) / vacuum.power(tip)
    best = minimize_scalar(
        lambda factor: error_of_one_factor(vacuum, air, factor, hottest_K),
        bounds=(k.min(), k.max()),
        method="bounded",
    )
    columns = {"k": k, "best_k": ((), float(best.x)), "best_error_K": ((), float(best.fun))}
    return labelled(columns, "tip_K", {"tip_K": tip})


def error_of_one_factor(vacuum: Branch, air: Branch, k: float, hottest_K: float = HOT) -> float:
    """Return the largest error (K) of T(P) in vacuum with the power scaled by one k."""
    tip = np.linspace(COLD, hottest_K, 120)
    scaled = vacuum.tip_temperature(air.power(tip) / k)
    return float(np.nanmax(np.abs(scaled - tip)))


def unevenness(factor: xr.Dataset) -> float:
    """Return how many times k − 1 is larger at 1006 K than at 330 K."""
    cold, hot = factor.k.interp(tip_K=[COLD, HOT]).values - 1.0
    return float(hot / cold)


def surroundings_study(probe: Probe) -> xr.Dataset:
    """Return k for other sizes of a lever and pressures of the air.

    Returns
    -------
    xarray.Dataset
        ``k``, ``best_k``, ``best_error_K`` and ``unevenness`` on the dimension ``case``.
    """
    cases = {
        "free space": probe,
        "all sizes × 0.5": _resized(probe, 0.5),
        "all sizes × 2": _resized(probe, 2.0),
    }
    for pressure in (100.0, 10.0):
        thin = probe.with_(accommodation=0.9, pressure_mbar=pressure)
        cases[f"{pressure:g} mbar, accommodation 0.9"] = thin
    return _scale_factors(cases, "case")


def one_sided_study(
    probe: Probe, gaps_um: Sequence[float], progress: Progress | None = None
) -> xr.Dataset:
    """Return k with a cold surface below a lever, by the gap between them.

    Returns
    -------
    xarray.Dataset
        ``k``, ``best_k``, ``best_error_K`` and ``unevenness`` on the dimension ``gap_um``;
        infinite in free space.
    """
    cases = {gap: probe.with_(surface_gap_um=gap) if np.isfinite(gap) else probe for gap in gaps_um}
    return _scale_factors(cases, "gap_um", progress)


def _scale_factors(
    cases: Mapping[str, Probe] | Mapping[float, Probe],
    dimension: str,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Return k of some levers; that on coarse meshes is within 2e-3 of that on usual ones."""
    factors = []
    for probe in each(list(cases.values()), progress):
        lever = Lever(probe.in_medium("vacuum"), COARSE)
        factors.append(find_scale_factor(lever.branch(), lever.in_medium("air").branch()))
    data = xr.concat(factors, dimension, combine_attrs="override")
    return data.assign_coords({dimension: list(cases)}).assign(
        unevenness=(dimension, [unevenness(factor) for factor in factors])
    )


def _resized(probe: Probe, factor: float) -> Probe:
    sizes = {
        name: factor * value
        for name, value in probe.shape.model_dump().items()
        if name.endswith("_um") and value is not None
    }
    return probe.with_(**sizes)


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
    nodes, weights = _gauss(120, 1.0)
    # tanh(s h/r) is one beyond s h/r of 20
    waves, steps = _gauss(400, 20.0 / h)
    cosines = np.cos(np.outer(nodes, waves))
    kernel = (2.0 / np.pi) * (cosines * (steps * (np.tanh(waves * h) - 1.0))) @ cosines.T
    solution = np.linalg.solve(np.eye(nodes.size) + kernel * weights, np.ones(nodes.size))
    return 8.0 * float(weights @ solution)


def _gauss(count: int, end: float) -> tuple[Array, Array]:
    """Return a Gauss rule on 0 to `end`."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * end * (nodes + 1.0), 0.5 * end * weights
