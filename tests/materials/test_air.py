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
