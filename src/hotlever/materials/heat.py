"""Heat that materials hold, per volume: heat capacity and its integral, the enthalpy.

The density is that of room temperature throughout, so that a volume of the layout holds the same
mass when it is hot. Shomate's equation would become negative at 120 K, where only Newton's method
may stray to: below 200 K the heat capacity stays what it is there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import FORMULA_FROM, Evaluated, law
from hotlever.types import Array

#: Coefficients A to E of Shomate's equation for solid silicon (J/(mol K), T in 1000 K).
_SHOMATE = (22.81719, 3.899510, -0.082885, 0.042111, -0.354063)
#: Molar mass (g/mol) and density (g/cm³) of silicon.
MOLAR_MASS, DENSITY = 28.0855, 2.329
_PER_VOLUME = DENSITY / MOLAR_MASS
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
    _, b, c, d, e = _SHOMATE
    slope = (b + (2.0 * c + 3.0 * d * t) * t - 2.0 * e / t**3) / 1000.0
    return _capacity(t), {"T": np.where(T < FORMULA_FROM, 0.0, _PER_VOLUME * slope)}


@law(meant_for=(290.0, 1685.0), source=_SOURCE)
def enthalpy(T: ArrayLike) -> Evaluated:
    """Enthalpy of silicon above that at 298.15 K, in J cm⁻³: the integral of the heat capacity.

    Examples
    --------
    >>> enthalpy([298.15, 1000.0])[0].round(1).tolist()
    [0.0, 1404.8]
    """
    T = np.asarray(T, dtype=float)
    t = np.maximum(T, FORMULA_FROM) / 1000.0
    capacity = _capacity(t)
    below = capacity * np.minimum(T - FORMULA_FROM, 0.0)
    return _integral(t) - _integral(STANDARD_TEMPERATURE / 1000.0) + below, {"T": capacity}


@law(meant_for=(290.0, 600.0), source="values at 298 K; CRC Handbook of Chemistry and Physics")
def enthalpy_by_capacity(T: ArrayLike, heat_capacity: float) -> Evaluated:
    """Enthalpy above that at 298.15 K, in J cm⁻³, of a constant `heat_capacity` (J cm⁻³ K⁻¹).

    Examples
    --------
    >>> enthalpy_by_capacity(398.15, heat_capacity=2.85)[0].item()
    285.0
    """
    above = np.asarray(T, dtype=float) - STANDARD_TEMPERATURE
    return heat_capacity * above, {"T": heat_capacity + 0.0 * above, "heat_capacity": above}


def _capacity(t: Array) -> Array:
    """Shomate's equation by T / 1000 K."""
    a, b, c, d, e = _SHOMATE
    return np.asarray(_PER_VOLUME * (a + (b + (c + d * t) * t) * t + e / t**2))


def _integral(t: Any) -> Any:
    """Return its integral over the temperature."""
    a, b, c, d, e = _SHOMATE
    return 1000.0 * _PER_VOLUME * ((a + (b / 2.0 + (c / 3.0 + d / 4.0 * t) * t) * t) * t - e / t)
