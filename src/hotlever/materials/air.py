"""Air at rest: thermal conductivity and its integral, the Kirchhoff variable.

Equation 13 of Spieser et al., J. Appl. Phys. 121, 174503 (2017), doi:10.1063/1.4981883, after
Kadoya, Matsunaga and Nagashima, J. Phys. Chem. Ref. Data 14, 947 (1985). Still air obeys
∇·(κ_air(T) ∇T) = 0; with θ = ∫κ_air dT this is Laplace's equation for θ. `T` is in K, κ_air in
W cm⁻¹ K⁻¹ and θ, zero at a base temperature, in W cm⁻¹.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import FORMULA_FROM, FORMULA_TO, Evaluated, law
from hotlever.types import Array

#: Coefficients of T⁰, T, T^½, T⁻¹, T⁻² and T⁻³ (K) in Eq. 13, in W cm⁻¹ K⁻¹.
_EQ_13 = 2.60e-4, 4.70e-7, 1.48e-7, -6.63e-2, 9.14, -6.50e2
#: Ratio of specific heats of air.
HEAT_RATIO = 1.4
#: Standard pressure (mbar).
ATMOSPHERE = 1013.25


def _conductivity(T: Array) -> Array:
    """Eq. 13; in products, since general powers are ten times slower."""
    a, b, c, d, e, f = _EQ_13
    inverse = 1.0 / T
    return a + b * T + c * np.sqrt(T) + inverse * (d + inverse * (e + inverse * f))


def _slope(T: Array) -> Array:
    """Return the derivative of Eq. 13."""
    _, b, c, d, e, f = _EQ_13
    inverse = 1.0 / T
    falling = inverse**2 * (d + inverse * (2.0 * e + inverse * 3.0 * f))
    return b + 0.5 * c * np.sqrt(inverse) - falling


def _integral(T: Array) -> Array:
    """Return an antiderivative of Eq. 13."""
    a, b, c, d, e, f = _EQ_13
    inverse = 1.0 / T
    rising = T * (a + 0.5 * b * T + 2.0 / 3.0 * c * np.sqrt(T))
    return rising + d * np.log(T) - inverse * (e + inverse * 0.5 * f)


@law(meant_for=(290.0, 1300.0), source="Eq. 13; Kadoya et al., JPCRD 14, 947 (1985)")
def thermal_conductivity_of_air(T: ArrayLike) -> Evaluated:
    """Thermal conductivity κ_air of air at atmospheric pressure (Eq. 13).

    Examples
    --------
    >>> kappa, _ = thermal_conductivity_of_air([293.0, 300.0, 800.0, 1100.0])
    >>> (100 * kappa).round(5).tolist()  # W/(m K)
    [0.02546, 0.026, 0.05703, 0.07287]
    """
    T = np.asarray(T, dtype=float)
    return _conductivity(T), {"T": _slope(T)}


@law(
    meant_for=(290.0, 1300.0),
    source="E. H. Kennard, Kinetic Theory of Gases (McGraw-Hill, 1938), sec. 180",
)
def temperature_jump_length(T: ArrayLike, pressure_mbar: float, accommodation: float) -> Evaluated:
    """Jump length g (µm) of rarefied air: T_gas − T_wall = g ∂T/∂n at a wall, n into the gas.

    g = (2 − α)/α √(2πRT) κ / ((γ + 1) c_v p), about 1.6 mean free paths for α = 1. Two parallel
    plates with this jump exchange heat exactly as in a dense gas and as in free molecular flow;
    between the two, and for a lone body in free molecular flow (where it gives up to twice the
    loss), it is an approximation. The partial derivative is by ``T``.

    Parameters
    ----------
    T : array_like
        Temperature of the gas (K).
    pressure_mbar : float
    accommodation : float
        Thermal accommodation coefficient α of the wall, above 0 and up to 1.

    Examples
    --------
    >>> length, _ = temperature_jump_length([293.0, 1000.0], 1013.25, 1.0)
    >>> length.round(3).tolist()
    [0.106, 0.521]
    """
    T = np.asarray(T, dtype=float)
    gas_constant = 287.05  # J kg⁻¹ K⁻¹, of air
    c_v = gas_constant / (HEAT_RATIO - 1.0)
    per_kappa = (
        (2.0 - accommodation)
        / accommodation
        * np.sqrt(2.0 * np.pi * gas_constant * T)
        / ((HEAT_RATIO + 1.0) * c_v * 100.0 * pressure_mbar)
    )
    per_kappa *= 1e8  # W cm⁻¹ K⁻¹ to W m⁻¹ K⁻¹, and m to µm
    kappa, slope = _conductivity(T), _slope(T)
    return per_kappa * kappa, {"T": per_kappa * (slope + 0.5 * kappa / T)}


@law(
    meant_for=(290.0, 1300.0),
    source="ideal gas; E. H. Kennard, Kinetic Theory of Gases (McGraw-Hill, 1938)",
)
def heat_capacity_of_air(T: ArrayLike, pressure_mbar: float = ATMOSPHERE) -> Evaluated:
    """Heat capacity of air at constant pressure, ρ c_p = γ/(γ − 1) p/T, in J cm⁻³ K⁻¹.

    With κ_air it makes the diffusivity κ_air/(ρ c_p), 0.222 cm²/s at 300 K and 1 atm. The partial
    derivative is by ``T``.

    Examples
    --------
    >>> capacity, _ = heat_capacity_of_air([293.0, 300.0])
    >>> (1e6 * capacity).round().tolist()  # J/(m³ K)
    [1210.0, 1182.0]
    """
    T = np.asarray(T, dtype=float)
    # mbar to J/cm³
    capacity = 1e-4 * pressure_mbar * HEAT_RATIO / ((HEAT_RATIO - 1.0) * T)
    return capacity, {"T": -capacity / T}


def kirchhoff_variable(T: ArrayLike, base_temperature_K: float) -> Evaluated:
    """Kirchhoff variable of air, θ = ∫κ_air dT from the base temperature.

    From 200 to 1700 K the integral of Eq. 13; beyond, κ_air stays at its value at the limit, so
    that θ rises for any `T`.

    Examples
    --------
    >>> theta, _ = kirchhoff_variable([293.0, 893.0], 293.0)
    >>> (100 * theta).round(2).tolist()  # W/m
    [0.0, 26.91]
    """
    T = np.asarray(T, dtype=float)
    inside = np.clip(T, FORMULA_FROM, FORMULA_TO)
    kappa = _conductivity(inside)
    start = _integral(np.asarray(base_temperature_K, dtype=float))
    return _integral(inside) - start + kappa * (T - inside), {"T": kappa}


def temperature_from_kirchhoff(theta: ArrayLike, base_temperature_K: float) -> Array:
    """Invert `kirchhoff_variable`: the temperature of the air where θ is known.

    Examples
    --------
    >>> theta, _ = kirchhoff_variable([293.0, 893.0], 293.0)
    >>> temperature_from_kirchhoff(theta, 293.0).round(6).tolist()
    [293.0, 893.0]
    """
    theta = np.asarray(theta, dtype=float)
    grid = np.linspace(FORMULA_FROM, FORMULA_TO, 301)
    T = np.interp(theta, kirchhoff_variable(grid, base_temperature_K)[0], grid)
    for _ in range(4):  # κ_air is smooth: from the table, Newton's method needs two
        value, partials = kirchhoff_variable(T, base_temperature_K)
        T = T + (theta - value) / partials["T"]
    return T
