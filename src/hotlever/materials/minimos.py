"""Mobility of carriers as in MINIMOS: another law than the paper's, for what it would change."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import Evaluated, law
from hotlever.materials.silicon import Carrier

#: Of MINIMOS, electrons and holes: lattice mobility at 300 K, how its exponent differs from that of
#: electrons, mobility at the highest doping, and the doping that halves what is between (cm⁻³).
_MINIMOS: dict[Carrier, tuple[float, float, float, float]] = {
    "electron": (1430.0, 0.0, 80.0, 1.12e17),
    "hole": (460.0, 0.18, 45.0, 2.23e17),
}


@law(
    meant_for=(200.0, 500.0),
    source="MINIMOS; Selberherr et al., Solid-State Electron. 33, 1425 (1990)",
)
def minimos_mobility(
    T: ArrayLike, n: ArrayLike, p: float, _: float = 0.0, carrier: Carrier = "electron"
) -> Evaluated:
    """Carrier mobility as in MINIMOS, in cm² V⁻¹ s⁻¹: impurities scatter less when it is hot.

    Selberherr et al., Solid-State Electron. 33, 1425 (1990), in place of Eq. 8, whose
    impurity term has no temperature. The exponent of the lattice is 2 there; it is `p` here, since
    levers have higher ones (Table II).

    Examples
    --------
    >>> minimos_mobility([300.0, 800.0], 4e17, p=2.0)[0].round().tolist()
    [466.0, 172.0]
    """
    T, n = np.asarray(T, dtype=float), np.asarray(n, dtype=float)
    lattice_300, steeper, lowest_300, half_300 = _MINIMOS[carrier]
    hot = T / 300.0
    exponent = p + steeper
    lattice, lowest = lattice_300 * hot**-exponent, lowest_300 * hot**-0.45
    power, doping = 0.72 * hot**0.065, n / (half_300 * hot**3.2)
    scattered = doping**power
    free = 1.0 / (1.0 + scattered)
    by_scattered = -(lattice - lowest) * free**2 * scattered
    scattered_by_T = power * (0.065 * np.log(doping) - 3.2) / T
    lattice_by_T, lowest_by_T = -exponent * lattice / T, -0.45 * lowest / T
    return lowest + (lattice - lowest) * free, {
        "T": lowest_by_T + (lattice_by_T - lowest_by_T) * free + by_scattered * scattered_by_T,
        "p": -lattice * np.log(hot) * free,
        "n": by_scattered * power / n,
    }
