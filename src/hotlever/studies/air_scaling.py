"""Is air one factor of the power? The paper's k (its Section V and Fig. 10), by tip temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar

from hotlever.datasets import labelled
from hotlever.lever import Branch, Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.steps import each
from hotlever.types import Progress

#: Tip temperatures (K) at which k is compared.
COLD, HOT = 330.0, 1006.0
#: Tip temperatures at which k is found.
_POINTS = 120
#: Gaps (µm) between a lever and a surface below it, the last of which is none.
GAPS_UM = (0.5, 1.0, 2.0, 5.0, 10.0, 50.0, np.inf)


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
    tip = np.linspace(COLD, hottest_K, _POINTS)
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
    tip = np.linspace(COLD, hottest_K, _POINTS)
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
    probe: Probe, gaps_um: Sequence[float] = GAPS_UM, progress: Progress | None = None
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
