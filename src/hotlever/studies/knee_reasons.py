"""Why the knee is not at the heater's inversion temperature.

The paper (discussion of its Fig. 6) gives two reasons: the resistance of the legs rises with the
temperature, and the doping of the heater is not uniform. Levers without the one, the other or
both show what each accounts for. Two more remain without either: only the middle of the heater is
as hot as the tip; and dV_l/dI_h = 0 is not dR_l/dT = 0, because with V² = P R the voltage still
rises where the resistance is highest.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from hotlever.datasets import labelled
from hotlever.errors import ComputationError
from hotlever.lever import Branch, Lever, OperatingPoint
from hotlever.materials.silicon import inversion_temperature

#: Diffusion length (µm) of a heater with uniform doping: far below the mesh size.
_NO_DIFFUSION = 1e-3
#: Leg resistivity, as a share of the true one, of legs without resistance.
_NO_RESISTANCE = 1e-3
#: Tip temperatures (K) over which the highest resistance is looked for, and their number.
_COLDEST, _POINTS = 400.0, 400


def reasons_of_the_knee(lever: Lever) -> xr.Dataset:
    """Solve the lever without leg resistance, without dopant diffusion, and without both.

    Returns
    -------
    xarray.Dataset
        ``knee_K`` and ``resistance_K``, the tip temperatures at which V_l and R_l are highest, on
        the dimension ``lever`` (``as it is``, ``no leg resistance``, ``uniform doping``,
        ``neither``); the inversion temperature T_i of the heater's doping as the attribute
        ``inversion_K``.

    Raises
    ------
    ComputationError
        If one of them has no knee.
    """
    material = lever.probe.material
    ideal_legs = {"a0": _NO_RESISTANCE * material.a0, "a1": _NO_RESISTANCE * material.a1}
    uniform = {"delta": _NO_DIFFUSION}
    levers = {"as it is": {}, "no leg resistance": ideal_legs, "uniform doping": uniform}
    levers["neither"] = ideal_legs | uniform
    # none of these materials is possible, so none is checked
    maxima = [
        _highest(lever.with_material(material.model_copy(update=changes)).branch(), name)
        for name, changes in levers.items()
    ]
    knee, resistance = zip(*maxima, strict=True)
    return labelled(
        {"knee_K": list(knee), "resistance_K": list(resistance)},
        "lever",
        {"lever": list(levers)},
        inversion_K=float(inversion_temperature(material.n_d, material.p)),
    )


def steps_to_the_knee(reasons: xr.Dataset) -> list[tuple[str, float]]:
    """Return the way from the inversion temperature to the knee: reason and kelvins."""
    knee = dict(zip(reasons.lever.values, reasons.knee_K.values.tolist(), strict=True))
    resistance = reasons.resistance_K.sel(lever="neither").item()
    return [
        ("the heater's ends are colder than its middle", resistance - reasons.inversion_K),
        ("the voltage is highest above where the resistance is", knee["neither"] - resistance),
        ("the doping is not uniform", knee["no leg resistance"] - knee["neither"]),
        ("the legs have a resistance", knee["as it is"] - knee["no leg resistance"]),
    ]


def knee_of(branch: Branch, which: str = "the lever") -> OperatingPoint:
    """Return the knee of a branch.

    Raises
    ------
    ComputationError
        If it has none, saying of which lever.
    """
    if branch.knee is None:
        raise ComputationError(f"{which} has no knee below {branch.hottest_K:.0f} K")
    return branch.knee


def _highest(branch: Branch, name: str) -> tuple[float, float]:
    """Tip temperatures (K) at the knee and at the first maximum of the resistance."""
    tip = np.linspace(_COLDEST, branch.hottest_K, _POINTS)
    curve = CubicSpline(tip, branch.lever_voltage(tip) / branch.current(tip))
    roots = curve.derivative().roots(extrapolate=False)
    maxima = roots[curve(roots, 2) < 0]
    if branch.knee is None or not maxima.size:
        raise ComputationError(f"the lever ({name}) has no knee below {branch.hottest_K:.0f} K")
    return branch.knee.tip_K, float(maxima[0])
