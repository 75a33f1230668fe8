"""The tapered doping profile."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import erf
from test_silicon import numerical_derivative

from hotlever.materials.silicon import tapered_doping

LENGTH, N_HD = 4.0, 2.2e20


def profile(x, n_d, delta):
    """The paper's heater: a strip between two parallel borders, x from its centre."""
    distances = np.stack([LENGTH / 2 - np.asarray(x), LENGTH / 2 + np.asarray(x)])
    return tapered_doping(distances, n_d, delta, n_hd=N_HD)[0]


@pytest.mark.parametrize("x", [-2.5, -1.3, 0.0, 0.7, 1.9, 2.0])
def test_between_parallel_borders_it_is_the_papers_equation(x):
    steps = erf((x - LENGTH / 2) / 0.647) + erf((-x - LENGTH / 2) / 0.647)
    expected = 5.75e17 + (N_HD - 5.75e17) * (1 + steps / 2)
    assert profile(x, 5.75e17, 0.647) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    "distances", [(4.5, -0.5), (0.7, 3.3), (2.0, 2.0), (1.0, 1.5, 0.4), (1.2,)]
)
def test_partial_derivatives_are_exact(distances):
    at = {"n_d": 5.75e17, "delta": 0.647, "n_hd": N_HD, "front": 0.4}
    _, partials = tapered_doping(distances, **at)
    assert set(partials) == {*at, "distances"}
    for name, number in at.items():
        slope = numerical_derivative(
            lambda value, name=name: tapered_doping(distances, **{**at, name: value})[0],
            number,
            1e-3 * number,
        )
        assert partials[name] == pytest.approx(slope, rel=1e-5, abs=1e8)
    for border, unit in enumerate(np.eye(len(distances))):
        slope = numerical_derivative(
            lambda step, unit=unit: tapered_doping(distances + step * unit, **at)[0],
            0.0,
            1e-3,
        )
        assert partials["distances"][border] == pytest.approx(slope, rel=1e-5, abs=1e8)


def test_where_many_borders_are_near_it_is_high_doped():
    n, partials = tapered_doping([0.01, 0.01, 0.01], 5e17, 0.65, n_hd=N_HD)
    assert n == N_HD
    assert not np.any(partials["distances"])


def test_a_front_is_a_shift_by_diffusion_lengths():
    moved, _ = tapered_doping([1.5, 2.0], 5e17, 0.6, n_hd=N_HD, front=0.5)
    plain, _ = tapered_doping([1.2, 1.7], 5e17, 0.6, n_hd=N_HD)
    assert moved == pytest.approx(plain, rel=1e-12)


@given(st.floats(-10, 10), st.floats(1e16, 1e19), st.floats(0.05, 2))
def test_profile_is_symmetric_and_between_the_two_concentrations(x, n_d, delta):
    n, mirrored = profile(x, n_d, delta), profile(-x, n_d, delta)
    assert n == pytest.approx(mirrored)
    assert n_d * (1 - 1e-12) <= n <= N_HD * (1 + 1e-12)


def test_diffusion_conserves_the_missing_dopants():
    """Diffusion moves dopants: the deficit n_hd − n integrates to that of the sharp step."""
    deficit, _ = quad(lambda x: N_HD - profile(x, 5.75e17, 0.647), -20, 20)
    assert deficit == pytest.approx((N_HD - 5.75e17) * LENGTH, rel=1e-7)
