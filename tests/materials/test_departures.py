"""Departures of laws: their spread beside published formulas, and what few modes leave out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from scipy.sparse import diags_array

from hotlever.materials.departures import FACTORS, PROFILE
from hotlever.materials.heat import thermal_conductivity, thermal_conductivity_of_layer
from hotlever.materials.silicon import (
    BOLTZMANN,
    impurity_mobility,
    intrinsic_density,
    minimos_mobility,
    mobility,
    tapered_doping,
)
from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S, PUBLISHED_VALUES

T = np.linspace(300.0, 1300.0, 51)
#: Dopings of heaters (cm⁻³), and that of legs.
HEATERS, LEGS = (3e17, 6e17), 2.2e20


#: Where the legs of a lever are (K): a straight line is fitted there.
LEGS_UP_TO = 600.0


def power_and_gap(factor, power, gap_K):
    return factor * (T / 300.0) ** power * np.exp(-gap_K / T)


def of_gap(factor, power, gap_eV):
    return factor * T**power * np.exp(-gap_eV / (2.0 * BOLTZMANN * T))


def paessler():
    """Gap (eV) of R. Pässler, Phys. Rev. B 66, 085201 (2002)."""
    hot, spread = 2.0 * T / 446.0, 0.51
    series = 1.0 + np.pi**2 / (3.0 * (1.0 + spread**2)) * hot**2
    series += (3.0 * spread**2 - 1.0) / 4.0 * hot**3 + 8.0 / 3.0 * hot**4 + hot**6
    by_phonons = (1.0 - 3.0 * spread**2) / np.expm1(446.0 / T)
    return 1.17 - 3.23e-4 * 446.0 * (by_phonons + 1.5 * spread**2 * (series ** (1.0 / 6.0) - 1.0))


#: The gap (eV) of Green (1990) above 300 K.
GREEN_GAP = 1.206 - 2.73e-4 * T
#: Intrinsic densities (cm⁻³) that were measured or evaluated, as carrier_concentrations.py of
#: github.com/I-use-IT/solar-cell quotes them. Barber's (1967) is calculated, 6.8e9 at 300 K, which
#: all that was measured since contradicts (9.6e9 to 10.1e9).
CARRIERS = {
    "Morin and Maita (1954)": of_gap(np.sqrt(1.5e33), 1.5, 1.21),
    "Putley and Mitchell (1958)": of_gap(3.0e16, 1.5, 1.206),
    "Slotboom (1977)": of_gap(np.sqrt(9.61e32), 1.5, 1.206),
    "Wasserrab (1977)": power_and_gap(5.71e19, 2.365, 6733.0),
    "Green (1990)": of_gap(np.sqrt(2.86e19 * 3.10e19) / 300.0**1.715, 1.715, GREEN_GAP),
    "Sproul and Green (1991)": power_and_gap(9.15e19, 2.0, 6880.0),
    "Sproul and Green (1993)": of_gap(1.640e15, 1.706, GREEN_GAP),
    "Misiakos and Tsamakis (1993)": power_and_gap(5.29e19, 2.54, 6726.0),
    "Couderc et al. (2014)": of_gap(1.541e15, 1.712, paessler()),
}
#: Mobilities (cm² V⁻¹ s⁻¹) of electrons in the lattice: Morin and Maita, Phys. Rev. 96, 28 (1954);
#: Ludwig and Watters, Phys. Rev. 101, 1699 (1956); Jacoboni et al., Solid-State Electron. 20, 77
#: (1977).
LATTICES = (4.0e9 * T**-2.6, 2.1e9 * T**-2.5, 1.43e9 * T**-2.42)
#: What dopants narrow the gap by in heaters (eV): 0.021 by Eq. 7, 0.022 by Slotboom and de Graaff
#: (1976), and nothing by del Alamo et al. (1987).
NARROWING = 0.021


def arora(n):
    """Electrons: N. D. Arora et al., IEEE Trans. Electron Devices 29, 292 (1982)."""
    hot = T / 300.0
    scattered = 0.88 * hot**-0.146 * n / (1.26e17 * hot**2.4)
    return 88.0 * hot**-0.57 + 7.4e8 * T**-2.33 / (1.0 + scattered)


def dorkel(n):
    """Electrons: Dorkel and Leturcq (1981), as PV-Lab/Semiconductor_properties quotes them."""
    lattice, ratio = 1430.0 * (T / 300.0) ** -2.2, 1.52e15 * T**2 / n
    impurity = 4.61e17 * T**1.5 / n / (np.log1p(ratio) - ratio / (1.0 + ratio))
    share = np.sqrt(6.0 * lattice / impurity)
    return lattice * (1.025 / (1.0 + (share / 1.68) ** 1.43) - 0.025)


def mobilities(n):
    by_impurities = impurity_mobility(T, n)[0]
    in_lattices = [1.0 / (1.0 / by_impurities + 1.0 / lattice) for lattice in LATTICES]
    formulas = [dorkel(n), arora(n), minimos_mobility(T, n, p=2.0)[0]]
    return np.stack([mobility(T, n, p=2.65)[0], *formulas, *in_lattices])


def departures_of(law):
    """Logarithms of published formulas of a law over the paper's, which is among them."""
    if law == "n_i":
        own = intrinsic_density(T, 0.0)[0]
        return [np.log(np.stack([own, *CARRIERS.values()]) / own)]
    if law == "mobility":
        return [np.log(mobilities(n) / mobility(T, n, p=2.65)[0]) for n in HEATERS]
    if law == "kappa":
        film, bulk = thermal_conductivity_of_layer(T, 0.4)[0], thermal_conductivity(T)[0]
        scaled = film[0] / bulk[0] * bulk
        return [np.log(np.stack([scaled, film]) / scaled)]
    # of a straight line where the legs are, which a0 and a1 are
    resistivity, there = 1.0 / mobilities(LEGS)[1:4], T <= LEGS_UP_TO
    lines = [
        np.polyval(np.polyfit(T[there] - 300.0, row[there], 1), T - 300.0) for row in resistivity
    ]
    return [np.log(np.stack([T / T, *(lines / resistivity)]))]


@pytest.mark.parametrize("law", FACTORS)
def test_a_law_is_known_no_better_than_published_formulas_are_near_it(law):
    spread = FACTORS[law].spread(T)
    for logarithms in departures_of(law):
        squares = np.mean(logarithms**2, axis=0)
        if law == "n_i":
            # half of what dopants do is not known
            squares = squares + (0.5 * NARROWING / (2.0 * BOLTZMANN * T)) ** 2
        away = np.sqrt(squares)
        # colder carriers are those of the dopant
        counts = (600.0 if law == "n_i" else 450.0) < T
        assert (spread[counts] > 0.95 * away[counts]).all()
        # and not without reason: where it is hot they are nearly as far
        assert away[-1] > 0.75 * spread[-1]


@pytest.mark.parametrize("law", FACTORS)
def test_modes_have_nearly_all_of_the_variance_and_published_departures(law):
    departure = FACTORS[law]
    modes = departure.modes(T)
    along = np.geomspace(departure.low_K, departure.high_K, 201)
    kept, whole = (departure.modes(along) ** 2).sum(), (departure.spread(along) ** 2).sum()
    assert kept > 0.995 * whole
    kept = np.sqrt((modes**2).sum(axis=0))
    assert kept == pytest.approx(departure.spread(T), rel=0.05)
    # beside the level, which a parameter of the law is
    columns = np.vstack([modes, np.ones_like(T)]).T
    for row in np.concatenate(departures_of(law)):
        left = row - columns @ np.linalg.lstsq(columns, row, rcond=None)[0]
        assert np.abs(left).max() < 0.25 * departure.spread(1000.0)


@pytest.mark.parametrize("law", FACTORS)
def test_coefficients_of_unit_size_make_the_spread(law):
    departure, rng = FACTORS[law], np.random.default_rng(1)
    drawn = [np.log(departure.departed(T, rng.normal(size=3))[0]) for _ in range(4000)]
    assert np.std(drawn, axis=0) == pytest.approx(departure.spread(T), rel=0.08)


def test_a_law_stays_what_it_is_at_the_ends_of_the_formulas_beyond_them():
    departure = FACTORS["mobility"]
    factor, slope = departure.departed(np.array([50.0, 200.0, 1700.0, 1e5]), (1.0, -1.0, 2.0))
    assert factor[0] == factor[1]
    assert factor[2] == factor[3]
    assert slope[[0, 3]].tolist() == [0.0, 0.0]


#: Of heaters and of what borders them (cm⁻³).
HEATER, BORDER = 5.75e17, LEGS


def diffused_phosphorus(kelvin, seconds):
    """Depth (µm) and phosphorus (cm⁻³) of a step at 0 after annealing.

    Diffusivity by vacancies of three charges and the field of the dopant: R. B. Fair and J. C. C.
    Tsai, J. Electrochem. Soc. 124, 1107 (1977).
    """
    kT = BOLTZMANN * kelvin
    factors, energies = np.array([3.85, 4.44, 44.2]), np.array([3.66, 4.00, 4.37])
    neutral, single, double = factors * np.exp(-energies / kT)
    n_i = np.sqrt(1.5e33) * kelvin**1.5 * np.exp(-1.21 / (2.0 * kT))
    x = np.linspace(-5.0, 3.5, 601)
    step = 1e-4 * (x[1] - x[0])

    def rate(_, n):
        between = 0.5 * (n[1:] + n[:-1])
        root = np.sqrt(between**2 + 4.0 * n_i**2)
        carriers = 0.5 * (between + root) / n_i
        by_field = 1.0 + between / root
        D = by_field * (neutral + single * carriers + double * carriers**2)
        flux = D * np.diff(n) / step
        return np.concatenate([[0.0], np.diff(flux) / step, [0.0]])

    start = np.where(x < 0.0, BORDER, HEATER)
    pattern = diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(x.size, x.size))
    solution = solve_ivp(
        rate, (0.0, seconds), start, "BDF", [seconds], jac_sparsity=pattern, rtol=1e-5, atol=1e14
    )
    return x, solution.y[:, -1]


def test_a_front_of_phosphorus_is_what_the_profile_departs_by():
    x, n = diffused_phosphorus(ANNEALING_K, ANNEALING_S)
    # what is higher doped adds nothing to the heater's resistance
    there = (n < 50.0 * HEATER) & (n > 1.2 * HEATER)

    def off(delta, front):
        profile = tapered_doping(x[None, there], HEATER, delta, n_hd=BORDER, front=front)[0]
        return np.log(profile / n[there])

    # a front and a steeper tail are what it is
    both = least_squares(lambda both: off(*both), [0.6, 0.0])
    plain = least_squares(lambda delta: off(delta[0], 0.0), [0.6])
    assert np.std(both.fun) < 0.1 * np.std(plain.fun)
    # levers tell Δ, and what erfc of that length leaves out is the front
    length = PUBLISHED_VALUES["option III"]["delta"]
    [front] = least_squares(lambda front: off(length, front[0]), [0.5]).x
    away = np.sqrt(np.mean([0.0, front**2]))
    assert 0.95 * away < PROFILE.spread_hot < 1.1 * away
