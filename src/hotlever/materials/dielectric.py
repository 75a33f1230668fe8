"""Dielectrics, which carry heat alone. `T` is in K, κ in W cm⁻¹ K⁻¹."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import Evaluated, law


@law(
    meant_for=(290.0, 800.0),
    source="power law; its values for SiO₂ and SiN are those of `hotlever.materials.presets`",
)
def dielectric_conductivity(T: ArrayLike, kappa: float, kappa_exponent: float) -> Evaluated:
    """Thermal conductivity of an amorphous dielectric, κ₃₀₀ (T / 300 K)^m, in W cm⁻¹ K⁻¹.

    In glasses it rises slowly: the heat capacity does, and the mean free path of the vibrations
    hardly changes.

    Parameters
    ----------
    T : array_like
    kappa : float
        κ₃₀₀, at 300 K.
    kappa_exponent : float
        m.

    Examples
    --------
    >>> kappa, _ = dielectric_conductivity([300.0, 600.0], kappa=0.0138, kappa_exponent=0.33)
    >>> (100 * kappa).round(2).tolist()  # W/(m K)
    [1.38, 1.73]
    """
    hot = np.asarray(T, dtype=float) / 300.0
    rise = hot**kappa_exponent
    value = kappa * rise
    return value, {
        "T": kappa_exponent * value / (300.0 * hot),
        "kappa": rise,
        "kappa_exponent": value * np.log(hot),
    }
