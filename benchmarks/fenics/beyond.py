"""The peer's laws beyond the paper, stated in UFL: thermoelectricity and radiation.

Each film has one Seebeck coefficient S [V/K] and, where holes and electrons conduct in it, a
conductivity [mW/(um K)] of pairs that carry heat without a current:

    S = (sigma_1 S_1 + sigma_2 S_2) / sigma,    T sigma_1 sigma_2 (S_1 - S_2)^2 / sigma

(G. S. Nolas, J. Sharp and H. J. Goldsmid, Thermoelectrics, Springer 2001, sec. 2.3).  S of either
carrier is that of a parabolic band.  Its Fermi integrals are solved elsewhere, by quadrature; what
they give is here a polynomial.
"""

import ufl
from laws import (
    BOLTZMANN_EV_PER_K,
    CARRIED,
    MW_PER_UM_K_FROM_W_PER_CM_K,
    states,
)

STEFAN_BOLTZMANN_MW_PER_UM2_K4 = 5.670374419e-17
# Doping [cm^-3] of silicon that was pure when its thermal conductivity was measured, pairs and all.
PURE = 1e12


def band_seebeck(temperature, sign, density, polynomial):
    """Return S [V/K] of the carriers of one band.

    The polynomial, coefficients from the constant on, is e |S| / k_B + ln(r) in ln(1 + r), r being
    the density over that of states.
    """
    ratio = density / states(temperature)
    reduced, variable = 0.0, ufl.ln(1.0 + ratio)
    for coefficient in reversed(polynomial):
        reduced = reduced * variable + coefficient
    return sign * BOLTZMANN_EV_PER_K * (reduced - ufl.ln(ratio))


def mixed(temperature, carried, polynomial):
    """Return S [V/K] of two bands together, and the conductivity of pairs [W/(cm K)]."""
    (first, of_first), (second, of_second) = (
        (band_seebeck(temperature, sign, density, polynomial), s_per_cm)
        for sign, density, s_per_cm in carried
    )
    total = of_first + of_second
    pairs = temperature * of_first * of_second * (first - second) ** 2 / total
    return (of_first * first + of_second * second) / total, pairs


def thermoelectric(stated, temperature, material, doping):
    """Return S [V/K] of a film and the conductivity of pairs [mW/(um K)] that Eq. 4 has not.

    `stated` is what the problem says of the material beside its parameters.
    """
    if stated["kind"] == "metal-film":
        return 1e-6 * material["seebeck"], 0
    polynomial = stated["reduced_seebeck"]
    if stated["kind"] == "high-doped-silicon":
        sign, density = stated["sign"], material["n_hd"]
        return band_seebeck(temperature, sign, density, polynomial), 0
    carried = CARRIED[stated["kind"]]
    seebeck, pairs = mixed(temperature, carried(temperature, material, doping), polynomial)
    _, of_pure = mixed(temperature, carried(temperature, material, PURE), polynomial)
    return seebeck, MW_PER_UM_K_FROM_W_PER_CM_K * (pairs - of_pure)


def black_emission(temperature, surroundings_kelvin):
    """Return what a black surface [mW/um^2] radiates into others, less what it takes up."""
    return STEFAN_BOLTZMANN_MW_PER_UM2_K4 * (temperature**4 - surroundings_kelvin**4)
