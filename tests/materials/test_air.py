"""Air: Eq. 13, its derivative and its integral."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from hotlever.materials.air import (
    kirchhoff_variable,
    temperature_from_kirchhoff,
    thermal_conductivity_of_air,
)
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import parameters_of


@pytest.mark.parametrize("T", [210.0, 293.0, 500.0, 900.0, 1300.0, 1690.0, 1750.0])
def test_the_slope_of_the_conductivity_is_exact(T):
    step = 0.1
    high, low = (thermal_conductivity_of_air(T + sign * step)[0] for sign in (1, -1))
    slope = thermal_conductivity_of_air(T)[1]["T"]
    assert float(slope) == pytest.approx(float(high - low) / (2 * step), rel=1e-6)


@pytest.mark.parametrize("T", [250.0, 400.0, 893.0, 1600.0])
def test_the_kirchhoff_variable_is_the_integral_of_the_conductivity(T):
    integral = quad(lambda t: float(thermal_conductivity_of_air(t)[0]), 293.0, T, epsabs=1e-12)[0]
    theta, partials = kirchhoff_variable(T, 293.0)
    assert float(theta) == pytest.approx(integral, rel=1e-10)
    assert float(partials["T"]) == pytest.approx(float(thermal_conductivity_of_air(T)[0]))


def test_the_kirchhoff_variable_rises_for_any_temperature_and_has_an_inverse():
    T = np.linspace(-500.0, 5000.0, 400)
    theta, _ = kirchhoff_variable(T, 293.0)
    assert np.all(np.diff(theta) > 0)
    assert temperature_from_kirchhoff(theta, 293.0) == pytest.approx(T, abs=1e-6)


def test_a_newer_formula_differs_by_far_less_than_what_a_lever_has_around_it():
    """E. W. Lemmon and R. T. Jacobsen, Int. J. Thermophys. 25, 21 (2004), of dilute air."""
    T = np.linspace(293.0, 1300.0, 60)
    collisions = np.polyval([-0.00331, 0.005341, 0.08406, -0.4623, 0.431], np.log(T / 103.3))
    viscosity = 0.0266958 * np.sqrt(28.9586 * T) / (0.36**2 * np.exp(collisions))  # µPa s
    cold = 132.6312 / T
    newer = 1e-5 * (1.308 * viscosity + 1.405 * cold**-1.1 - 1.036 * cold**-0.3)  # W/(cm K)
    away = np.log(newer / thermal_conductivity_of_air(T)[0])
    spread = parameters_of(Probe.reference().in_medium("air"))["gas_conductivity"].spread
    assert np.abs(away).max() < 0.15 * spread
    # the shape by less still
    assert np.std(away) < 0.06 * spread
