"""Curves through values and slopes: what they reproduce, how they converge, where they bend."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PPoly

from hotlever.piecewise import Piecewise, hermite_weights, smooth_curve, spline_through


@pytest.mark.parametrize("degree", range(6))
def test_polynomials_up_to_the_fifth_degree_are_reproduced(degree):
    u = np.array([0.0, 0.3, 1.0, 1.4, 2.0])
    values, slopes = u**degree, degree * u ** max(degree - 1, 0)
    fine = np.linspace(0, 2, 31)
    np.testing.assert_allclose(smooth_curve(u, values, slopes)(fine), fine**degree, atol=1e-12)


def test_the_error_falls_with_the_sixth_power_of_the_spacing():
    fine, errors = np.linspace(0, 3, 400), []
    for count in (10, 20, 40):
        u = np.linspace(0, 3, count + 1)
        errors.append(np.abs(smooth_curve(u, np.sin(u), np.cos(u))(fine) - np.sin(fine)).max())
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([6, 6], abs=0.4)


def test_a_step_of_a_higher_derivative_spoils_nothing_where_it_is_a_node():
    """|u − 1|³ has a third derivative that steps at 1, as a law has at a transition."""
    u, fine = np.linspace(0, 2, 11), np.linspace(0, 2, 101)
    values, slopes = np.abs(u - 1) ** 3, 3 * (u - 1) * np.abs(u - 1)
    exact = np.abs(fine - 1) ** 3
    assert np.abs(smooth_curve(u, values, slopes)(fine) - exact).max() > 1e-4
    known = smooth_curve(u, values, slopes, np.array([1.0]))
    np.testing.assert_allclose(known(fine), exact, atol=1e-12)


def test_hermite_weights_extrapolate_and_differentiate():
    nodes = np.array([[1.0, 2.0, 4.0]])
    values, slopes = nodes[0] ** 5, 5 * nodes[0] ** 4
    for derivative, exact in ((0, 5.0**5), (1, 5 * 5.0**4), (2, 20 * 5.0**3)):
        weights = hermite_weights(nodes, np.array([5.0]), derivative)[0]
        assert weights @ np.append(values, slopes) == pytest.approx(exact, rel=1e-9)


def test_what_is_missing_stays_missing():
    u = np.linspace(0, 1, 6)
    values = np.stack([u**2, np.full(6, np.nan)], axis=1)
    found = spline_through(u, values)(0.25)
    assert found[0] == pytest.approx(0.0625)
    assert np.isnan(found[1])


def test_polynomials_between_nodes_are_those_of_scipy():
    random = np.random.default_rng(0)
    nodes, places = np.array([0.0, 0.3, 1.0, 2.5]), np.linspace(-0.5, 3.0, 50)
    coefficients = random.normal(size=(6, 3, 2))
    ours, theirs = Piecewise(coefficients, nodes), PPoly(coefficients, nodes)
    for derivative in range(3):
        np.testing.assert_allclose(ours(places, derivative), theirs(places, derivative), rtol=1e-10)
    np.testing.assert_allclose(ours.derivative()(places), theirs.derivative()(places), rtol=1e-10)
    assert ours(1.0).shape == (2,)


def test_roots_are_those_of_scipy():
    """Of a smooth curve: one at a node, and one at which it only touches zero."""
    u = np.linspace(0.0, 3.0, 13)
    curve = smooth_curve(u, np.cos(np.pi * u), -np.pi * np.sin(np.pi * u))
    np.testing.assert_allclose(curve.roots(), [0.5, 1.5, 2.5], atol=1e-12)
    theirs = PPoly(curve.c, curve.x).derivative().roots(extrapolate=False)
    np.testing.assert_allclose(curve.derivative().roots(), np.unique(theirs.round(9)), atol=2e-9)
    np.testing.assert_allclose(curve.derivative().roots(), [0.0, 1.0, 2.0, 3.0], atol=1e-9)
    positive = smooth_curve(u, np.ones_like(u), np.zeros_like(u))
    assert positive.roots().size == 0
