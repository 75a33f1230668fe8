"""Why the knee is not at the heater's inversion temperature.

The paper (discussion of its Fig. 6) gives two reasons: the resistance of the legs rises with the
temperature, and the doping of the heater is not uniform. Levers without the one, the other or
both show what each accounts for. Two more remain without either: only the middle of the heater is
as hot as the tip; and dV_l/dI_h = 0 is not dR_l/dT = 0, because with V² = P R the voltage still
rises where the resistance is highest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from hotlever.calibration.characteristic import characteristic
from hotlever.errors import ComputationError
from hotlever.lever.lever import Lever
from hotlever.materials.silicon import inversion_temperature

#: Diffusion length (µm) of a heater with uniform doping: far below the mesh size.
_NO_DIFFUSION = 1e-3
#: Leg resistivity, as a share of the true one, of legs without resistance.
_NO_RESISTANCE = 1e-3
#: Tip temperature (K) up to which a knee is looked for.
_HOTTEST = 1100.0


@dataclass(frozen=True)
class KneeReasons:
    """Tip temperatures (K) of the knee and of the highest resistance, of modified levers.

    Attributes
    ----------
    inversion_K : float
        T_i of the heater's doping.
    knee_K, resistance_K : dict of str to float
        Where V_l and R_l are highest: ``as it is``, ``no leg resistance``, ``uniform doping``,
        ``neither``.
    """

    inversion_K: float
    knee_K: dict[str, float]
    resistance_K: dict[str, float]

    def steps(self) -> list[tuple[str, float]]:
        """Return the way from the inversion temperature to the knee: reason and kelvins."""
        return [
            (
                "the heater's ends are colder than its middle",
                self.resistance_K["neither"] - self.inversion_K,
            ),
            (
                "the voltage is highest above where the resistance is",
                self.knee_K["neither"] - self.resistance_K["neither"],
            ),
            (
                "the doping is not uniform",
                self.knee_K["no leg resistance"] - self.knee_K["neither"],
            ),
            (
                "the legs have a resistance",
                self.knee_K["as it is"] - self.knee_K["no leg resistance"],
            ),
        ]


def knee_reasons(lever: Lever) -> KneeReasons:
    """Solve the lever without leg resistance, without dopant diffusion, and without both.

    Raises
    ------
    ComputationError
        If one of them has no knee.
    """
    material = lever.probe.material
    ideal_legs = {"a0": _NO_RESISTANCE * material.a0, "a1": _NO_RESISTANCE * material.a1}
    uniform = {"delta": _NO_DIFFUSION}
    knee, resistance = {}, {}
    for name, changes in {
        "as it is": {},
        "no leg resistance": ideal_legs,
        "uniform doping": uniform,
        "neither": ideal_legs | uniform,
    }.items():
        data = characteristic(lever.with_material(material.with_(**changes)), _HOTTEST).data
        knee[name] = _highest(data.tip_K, data.lever_V**2, name)
        resistance[name] = _highest(data.tip_K, data.lever_ohm, name)
    return KneeReasons(float(inversion_temperature(material.n_d, material.p)), knee, resistance)


def _highest(tip_K: xr.DataArray, values: xr.DataArray, name: str) -> float:
    """Tip temperature (K) at the first maximum of a quantity."""
    curve = CubicSpline(tip_K, values)
    roots = curve.derivative().roots(extrapolate=False)
    maxima = roots[curve(roots, 2) < 0] if roots.size else np.empty(0)
    if not maxima.size:
        raise ComputationError(f"the lever ({name}) has no knee below {float(tip_K[-1]):.0f} K")
    return float(maxima[0])
