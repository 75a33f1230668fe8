"""Is air one factor of the power? The paper's k (its Section V and Fig. 10), by tip temperature."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar

from hotlever.datasets import labelled
from hotlever.lever import Branch, Lever
from hotlever.probe import Probe

#: Tip temperatures (K) at which k is compared.
COLD, HOT = 330.0, 1006.0
#: Tip temperatures at which k is found.
_POINTS = 120


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
    """Return k for other sizes of a lever, gaps to a surface and pressures of the air.

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
    for gap in (10.0, 2.0, 0.5):
        cases[f"surface {gap:g} µm below"] = probe.with_(surface_gap_um=gap)
    for pressure in (100.0, 10.0):
        thin = probe.with_(accommodation=0.9, pressure_mbar=pressure)
        cases[f"{pressure:g} mbar, accommodation 0.9"] = thin
    factors = []
    for changed in cases.values():
        vacuum, air = (Lever(changed.in_medium(medium)).branch() for medium in ("vacuum", "air"))
        factors.append(find_scale_factor(vacuum, air))
    data = xr.concat(factors, "case", combine_attrs="override").assign_coords(case=list(cases))
    return data.assign(unevenness=("case", [unevenness(factor) for factor in factors]))


def _resized(probe: Probe, factor: float) -> Probe:
    sizes = {
        name: factor * value
        for name, value in probe.shape.model_dump().items()
        if name.endswith("_um") and value is not None
    }
    return probe.with_(**sizes)
