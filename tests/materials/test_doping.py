"""The tapered doping profile."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from test_silicon import numerical_derivative

from hotlever.materials.doping import tapered_doping

PROFILE = {"length": 4.0, "n_hd": 2.2e20}


@pytest.mark.parametrize("x", [-2.5, -1.3, 0.0, 0.7, 1.9, 2.0])
def test_partial_derivatives_are_exact(x):
    at = {"x": x, "n_d": 5.75e17, "delta": 0.647, "length": PROFILE["length"]}
    _, partials = tapered_doping(**{**PROFILE, **at})
    assert set(partials) == set(at)
    for name, number in at.items():
        slope = numerical_derivative(
            lambda value, name=name: tapered_doping(**{**PROFILE, **at, name: value})[0],
            number,
            1e-3 * (abs(number) or 1.0),
        )
        assert partials[name] == pytest.approx(slope, rel=1e-5, abs=1e8)


@given(st.floats(-10, 10), st.floats(1e16, 1e19), st.floats(0.05, 2))
def test_profile_is_symmetric_and_between_the_two_concentrations(x, n_d, delta):
    n, _ = tapered_doping(x, n_d, delta, **PROFILE)
    mirrored, _ = tapered_doping(-x, n_d, delta, **PROFILE)
    assert n == pytest.approx(mirrored)
    assert n_d * (1 - 1e-12) <= n <= PROFILE["n_hd"] * (1 + 1e-12)


def test_diffusion_conserves_the_missing_dopants():
    """Diffusion moves dopants: the deficit n_hd − n integrates to that of the sharp step."""
    deficit, _ = quad(
        lambda x: PROFILE["n_hd"] - tapered_doping(x, 5.75e17, 0.647, **PROFILE)[0], -20, 20
    )
    assert deficit == pytest.approx((PROFILE["n_hd"] - 5.75e17) * PROFILE["length"], rel=1e-7)


def test_half_way_between_the_concentrations_at_the_heater_ends():
    n, _ = tapered_doping(np.array([-2.0, 2.0]), 5.75e17, 0.3, **PROFILE)
    np.testing.assert_allclose(n, (5.75e17 + PROFILE["n_hd"]) / 2, rtol=1e-12)
