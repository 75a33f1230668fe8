"""How much of its heat a lever radiates, and what that changes.

The paper (Section IV) leaves radiation out: some 1 µW of 4 mW at 1150 K. That is what the heater by
itself radiates as a black body; the legs are hot as well, and much larger.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.errors import ComputationError
from hotlever.lever import Lever
from hotlever.lever.equations import BALANCES, balance_columns
from hotlever.materials.heat import sheet_emissivity
from hotlever.materials.kinds import LowDopedSilicon
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import of_materials


def radiated_heat(probe: Probe, tip_K: ArrayLike, emissivity: float | None = None) -> xr.Dataset:
    """Compute what a lever radiates at some tip temperatures.

    Parameters
    ----------
    probe : Probe
    tip_K : array_like, shape (n,)
        K.
    emissivity : float, optional
        Of all its surface; by default that of each material.

    Returns
    -------
    xarray.Dataset
        On the dimension ``tip`` (K) ``power_mW`` and ``radiated_mW``; the parts of the latter that
        the edges (``edges_mW``) and the faces of the heater (``heater_mW``) radiate; and
        ``cooler_K``, by how much radiation lowers the tip temperature at the same power; NaN where
        the lever would melt without.

    Raises
    ------
    ComputationError
        If the lever does not get so hot.
    """
    tip = np.asarray(tip_K, dtype=float)
    effects = {*probe.physics.effects}
    bright = probe.with_physics(effects | {"radiation"})
    if emissivity is not None:
        names = of_materials(bright)
        bright = bright.replace(
            {name: emissivity for name in names if name.split(".")[-1] == "emissivity"}
        )
    lever = Lever(bright)
    branch = lever.branch(float(tip.max()))
    if tip.max() > branch.hottest_K:
        end = lever.equations.laws.limit[1]
        raise ComputationError(f"{end}, with the tip at {branch.hottest_K:.0f} K")
    dark = lever.with_probe(probe.with_physics(effects - {"radiation"}))
    without = dark.branch(dark.equations.laws.limit[0])  # as hot as that power makes it
    x = branch.states(np.sqrt(tip - branch.base_temperature_K))
    columns = dict(zip(BALANCES, balance_columns(branch.equations, x).T, strict=True))
    faces, (edges, _) = branch.equations.at(x)[1].emission, branch.equations.losses(x)["rim"]
    assert faces is not None  # the lever radiates
    heater = lever.space.parts["heater"]
    of_heater = (lever.space.weights * faces)[heater].sum(axis=0)
    power = branch.power(tip)
    return labelled(
        {
            "power_mW": power,
            "radiated_mW": columns["radiated_mW"],
            "edges_mW": _stated("tip", edges.sum(axis=0), "mW", "heat that the edges radiate"),
            "heater_mW": _stated("tip", of_heater, "mW", "heat that the heater's faces radiate"),
            "cooler_K": _stated(
                "tip",
                without.tip_temperature(power) - tip,
                "K",
                "fall of the tip temperature by radiation, at the same power",
            ),
        },
        "tip",
        {"tip": _stated("tip", tip, "K", "tip temperature")},
    )


def _stated(dimensions: Any, values: Any, unit: str, meaning: str) -> tuple[Any, ...]:
    return dimensions, values, {"units": unit, "long_name": meaning}


def sheet_emissivities(probe: Probe, temperature_K: ArrayLike) -> xr.Dataset:
    """Compute the emissivity of each of a lever's conducting materials as a thin sheet.

    By its resistance for a direct current, see `hotlever.materials.heat.sheet_emissivity`.

    Returns
    -------
    xarray.Dataset
        ``sheet_ohm`` and ``emissivity`` on the dimensions ``material`` and ``temperature`` (K).
    """
    T = np.asarray(temperature_K, dtype=float)
    films = {film.material: film for region in probe.layout().regions for film in region.stack}
    sheets = {}
    for name, kind in probe.made_of.items():
        if kind.conducts and name in films:
            doping = kind.n_d if isinstance(kind, LowDopedSilicon) else 0.0
            sigma, _ = kind.electrical_conductivity(T, doping)
            thickness_um = films[name].thickness_um or probe.layout().thickness_um
            sheets[name] = 1.0 / (sigma * 1e-4 * thickness_um)
    ohm = np.array(list(sheets.values()))
    both = ("material", "temperature")
    return labelled(
        {
            "sheet_ohm": _stated(both, ohm, "ohm", "sheet resistance"),
            "emissivity": _stated(both, sheet_emissivity(ohm), "1", "emissivity of a sheet"),
        },
        both,
        {"material": list(sheets), "temperature": _stated("temperature", T, "K", "temperature")},
    )
