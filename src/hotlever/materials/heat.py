"""Heat that materials hold, per volume: heat capacity and its integral, the enthalpy.

The density is that of room temperature throughout, so that a volume of the layout holds the same
mass when it is hot. Shomate's equation would become negative at 120 K, where only Newton's method
may stray to: below 200 K the heat capacity stays what it is there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import FORMULA_FROM, Evaluated, law
from hotlever.types import Array

#: Coefficients A to E of Shomate's equation for solid silicon (J/(mol K), T in 1000 K).
_SHOMATE = (22.81719, 3.899510, -0.082885, 0.042111, -0.354063)
#: Molar mass (g/mol) and density (g/cm³) of silicon.
MOLAR_MASS, DENSITY = 28.0855, 2.329
#: Temperature (K) whose enthalpy is zero.
STANDARD_TEMPERATURE = 298.15

_SOURCE = "Shomate equation, NIST Chemistry WebBook, SRD 69; Chase, NIST-JANAF (1998)"


@law(meant_for=(290.0, 1685.0), source=_SOURCE)
def heat_capacity(T: ArrayLike) -> Evaluated:
    """Heat capacity of silicon at constant pressure, in J cm⁻³ K⁻¹.

    Examples
    --------
    >>> heat_capacity([300.0, 1000.0])[0].round(4).tolist()
    [1.6624, 2.1827]
    """
    T = np.asarray(T, dtype=float)
    t = np.maximum(T, FORMULA_FROM) / 1000.0
    a, b, c, d, e = _SHOMATE
    per_mole = a + b * t + c * t**2 + d * t**3 + e / t**2
    slope = b + 2.0 * c * t + 3.0 * d * t**2 - 2.0 * e / t**3
    per_volume = DENSITY / MOLAR_MASS
    return per_volume * per_mole, {
        "T": np.where(T < FORMULA_FROM, 0.0, per_volume * slope / 1000.0)
    }


@law(meant_for=(290.0, 1685.0), source=_SOURCE)
def enthalpy(T: ArrayLike) -> Evaluated:
    """Enthalpy of silicon above that at 298.15 K, in J cm⁻³: the integral of the heat capacity.

    Examples
    --------
    >>> enthalpy([298.15, 1000.0])[0].round(1).tolist()
    [0.0, 1404.8]
    """
    T = np.asarray(T, dtype=float)
    capacity = heat_capacity.formula(T)[0]
    above = _kilojoules_per_mole(np.maximum(T, FORMULA_FROM)) - _kilojoules_per_mole(
        np.asarray(STANDARD_TEMPERATURE)
    )
    below = capacity * np.minimum(T - FORMULA_FROM, 0.0)
    return 1000.0 * DENSITY / MOLAR_MASS * above + below, {"T": capacity}


def _kilojoules_per_mole(T: Array) -> Array:
    t = T / 1000.0
    a, b, c, d, e = _SHOMATE
    return np.asarray(a * t + b * t**2 / 2.0 + c * t**3 / 3.0 + d * t**4 / 4.0 - e / t)
