"""Heat capacity and enthalpy of silicon."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from hotlever.materials.heat import enthalpy, heat_capacity

TEMPERATURES = [150.0, 293.0, 500.0, 1000.0, 1690.0, 1750.0]


def test_heat_capacity_at_two_temperatures_is_that_computed_by_others():
    np.testing.assert_allclose(heat_capacity([300.0, 1000.0])[0], [1.6624, 2.1827], atol=5e-5)


@pytest.mark.parametrize("law", [heat_capacity, enthalpy])
@pytest.mark.parametrize("T", TEMPERATURES)
def test_derivatives_are_exact(law, T):
    _, partials = law(T)
    assert set(partials) == {"T"}
    slope = (law(T + 0.01)[0] - law(T - 0.01)[0]) / 0.02
    assert partials["T"] == pytest.approx(slope, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize(("low", "high"), [(298.15, 900.0), (210.0, 1690.0)])
def test_enthalpy_is_the_integral_of_the_heat_capacity(low, high):
    integral = quad(lambda T: float(heat_capacity(T)[0]), low, high, epsabs=1e-9)[0]
    rise = float(enthalpy(high)[0] - enthalpy(low)[0])
    assert rise == pytest.approx(integral, rel=1e-9)


def test_enthalpy_never_falls():
    T = np.linspace(1.0, 1e4, 5000)
    assert (np.diff(enthalpy(T)[0]) >= 0).all()
