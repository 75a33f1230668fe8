"""Films on a lever: metals, which carry heat and current, and dielectrics, which carry heat alone.

`T` is in K; units are cm, V, A, W and K. A film's resistivity is above that of the bulk metal and
its temperature coefficient below: both are for a fit to find.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import Evaluated, law
from hotlever.types import Array

#: Temperature (K) at which a metal's resistivity is stated.
STATED_AT_K = 293.0
#: Sommerfeld's value of the Lorenz number (V² K⁻²), (π k_B/e)²/3.
SOMMERFELD = 2.443e-8


@law(
    meant_for=(250.0, 800.0),
    source="Bloch and Grüneisen at high temperature; Matula, JPCRD 8, 1147 (1979)",
)
def metal_conductivity(T: ArrayLike, resistivity: float, tcr: float) -> Evaluated:
    """Electrical conductivity of a metal film, in S cm⁻¹: ρ = ρ₂₉₃ (1 + α (T − 293 K)).

    Parameters
    ----------
    T : array_like
    resistivity : float
        ρ₂₉₃, at 293 K (Ω cm).
    tcr : float
        α, its temperature coefficient (K⁻¹).

    Examples
    --------
    >>> sigma, _ = metal_conductivity([293.0, 393.0], resistivity=2e-5, tcr=2e-3)
    >>> (1.0 / sigma).round(9).tolist()
    [2e-05, 2.4e-05]
    """
    above = np.asarray(T, dtype=float) - STATED_AT_K
    rise = 1.0 + tcr * above
    sigma = 1.0 / (resistivity * rise)
    return sigma, {
        "T": -sigma * tcr / rise,
        "resistivity": -sigma / resistivity,
        "tcr": -sigma * above / rise,
    }


@law(meant_for=(250.0, 800.0), source="Wiedemann and Franz, Ann. Phys. 165, 497 (1853)")
def wiedemann_franz(
    T: ArrayLike, conductivity: Callable[[Array], Evaluated], lorenz_ratio: float = 1.0
) -> Evaluated:
    """Thermal conductivity of a metal by its electrical one, κ = L σ T, in W cm⁻¹ K⁻¹.

    Parameters
    ----------
    T : array_like
    conductivity : callable
        Law of σ (S cm⁻¹) by temperature.
    lorenz_ratio : float
        L over Sommerfeld's value; above 1 where the lattice carries heat too.

    Examples
    --------
    >>> kappa, _ = wiedemann_franz(293.0, lambda T: metal_conductivity(T, 1.05e-5, 3.6e-3))
    >>> (100 * kappa).round(1).item()  # W/(m K)
    68.2
    """
    T = np.asarray(T, dtype=float)
    sigma, by = conductivity(T)
    lorenz = SOMMERFELD * lorenz_ratio
    kappa = lorenz * sigma * T
    return kappa, {
        **{name: lorenz * T * partial for name, partial in by.items()},
        "T": lorenz * (sigma + T * by["T"]),
        "lorenz_ratio": kappa / lorenz_ratio,
    }


def reciprocal(resistivity: Evaluated) -> Evaluated:
    """Return σ = 1/ρ of a resistivity and its derivatives."""
    rho, by = resistivity
    sigma = 1.0 / rho
    return sigma, {name: -sigma * sigma * slope for name, slope in by.items()}


@law(meant_for=(200.0, 1300.0), source="a constant, as stated in the probe file")
def constant_conductivity(T: ArrayLike, kappa: float) -> Evaluated:
    """Thermal conductivity that does not depend on the temperature, in W cm⁻¹ K⁻¹."""
    nothing = np.zeros_like(np.asarray(T, dtype=float))
    return nothing + kappa, {"T": nothing, "kappa": nothing + 1.0}


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
