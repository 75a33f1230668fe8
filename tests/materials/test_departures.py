"""Departures of laws: their spread beside published formulas, and what few modes leave out."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.materials.departures import DEPARTURES, HOT_K, MODES_FROM, MODES_TO
from hotlever.materials.heat import thermal_conductivity, thermal_conductivity_of_layer
from hotlever.materials.silicon import BOLTZMANN, intrinsic_density, minimos_mobility, mobility

T = np.linspace(MODES_FROM, MODES_TO, 51)
#: Dopings of heaters (cm⁻³), and that of legs.
HEATERS, LEGS = (3e17, 6e17), 2.2e20


def power_and_gap(factor, power, gap_K):
    return factor * (T / 300.0) ** power * np.exp(-gap_K / T)


#: Intrinsic densities (cm⁻³) as parameters/carrier_concentrations.py of
#: github.com/I-use-IT/solar-cell quotes them.
CARRIERS = {
    "Morin and Maita (1954)": np.sqrt(1.5e33 * T**3 * np.exp(-1.21 / (BOLTZMANN * T))),
    "Putley and Mitchell (1958)": 3.0e16 * T**1.5 * np.exp(-0.603 / (BOLTZMANN * T)),
    "Barber (1967)": 1.72e16 * T**1.5 * np.exp(-0.6025 / (BOLTZMANN * T)),
    "Slotboom (1977)": np.sqrt(9.61e32 * T**3 * np.exp(-1.206 / (BOLTZMANN * T))),
    "Wasserrab (1977)": power_and_gap(5.71e19, 2.365, 6733.0),
    "Sproul and Green (1991)": power_and_gap(9.15e19, 2.0, 6880.0),
    "Misiakos and Tsamakis (1993)": power_and_gap(5.29e19, 2.54, 6726.0),
}


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
    return np.stack(
        [mobility(T, n, p=2.65)[0], dorkel(n), arora(n), minimos_mobility(T, n, p=2.0)[0]]
    )


def departures_of(law):
    """Logarithms of published formulas of a law over the paper's, which is among them."""
    if law == "n_i":
        own = intrinsic_density(T, 0.0)[0]
        return [np.log(np.stack([own, *CARRIERS.values()]) / own)]
    if law == "mobility":
        return [np.log(mobilities(n) / mobility(T, n, p=2.65)[0]) for n in HEATERS]
    if law == "kappa":
        film, bulk = thermal_conductivity_of_layer(T, 0.4)[0], thermal_conductivity(T)[0]
        return [np.log(np.stack([film[0] / bulk[0] * bulk, film]) / film)]
    # of a straight line through what is measured, which a0 and a1 are
    resistivity = 1.0 / mobilities(LEGS)[1:]
    lines = [np.polyval(np.polyfit(T - 300.0, row, 1), T - 300.0) for row in resistivity]
    return [np.log(np.stack([T / T, *(resistivity / lines)]))]


@pytest.mark.parametrize("law", DEPARTURES)
def test_a_law_is_known_no_better_than_published_formulas_agree(law):
    for logarithms in departures_of(law):
        among = logarithms.std(axis=0, ddof=1)
        hot = T > 450.0
        assert (DEPARTURES[law].spread(T)[hot] > 0.97 * among[hot]).all()
        # and not without reason: somewhere they differ by half as much
        assert (among > 0.5 * DEPARTURES[law].spread(T)).any()


@pytest.mark.parametrize("law", DEPARTURES)
def test_modes_have_nearly_all_of_the_variance_and_published_departures(law):
    departure = DEPARTURES[law]
    modes = departure.modes(T)
    assert departure.variance_left < 0.005
    kept = np.sqrt((modes**2).sum(axis=0))
    assert kept == pytest.approx(departure.spread(T), rel=0.05)
    # beside the level, which a parameter of the law is
    columns = np.vstack([modes, np.ones_like(T)]).T
    for row in np.concatenate(departures_of(law)):
        left = row - columns @ np.linalg.lstsq(columns, row, rcond=None)[0]
        assert np.abs(left).max() < 0.1 * departure.spread(HOT_K)


@pytest.mark.parametrize("law", DEPARTURES)
def test_coefficients_of_unit_size_make_the_spread(law):
    departure, rng = DEPARTURES[law], np.random.default_rng(1)
    drawn = [np.log(departure.departed(T, rng.normal(size=3))[0]) for _ in range(4000)]
    assert np.std(drawn, axis=0) == pytest.approx(departure.spread(T), rel=0.08)


def test_a_law_stays_what_it_is_at_the_ends_of_the_formulas_beyond_them():
    departure = DEPARTURES["mobility"]
    factor, slope = departure.departed(np.array([50.0, 200.0, 1700.0, 1e5]), (1.0, -1.0, 2.0))
    assert factor[0] == factor[1]
    assert factor[2] == factor[3]
    assert slope[[0, 3]].tolist() == [0.0, 0.0]
