"""Priors of several parameters as one density, and what an estimate leaves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hotlever.estimate.objective import PriorDensity
from hotlever.probe.priors import Prior


@given(st.floats(0.1, 10.0), st.floats(0.01, 1.0), st.booleans())
def test_the_slope_is_that_of_the_deviation(share, spread, relative):
    prior = Prior(2.0, spread, relative)
    value, step = 2.0 * share, 1e-6 * share
    slope = (prior.deviation(value + step) - prior.deviation(value - step)) / (2 * step)
    density = PriorDensity.of_priors({"a": prior})
    assert density.deviations(np.array([value]))[0] == pytest.approx(prior.deviation(value))
    assert density.slopes(np.array([value]))[0, 0] == pytest.approx(slope, rel=1e-4)
    assert prior.deviation(2.0) == 0.0


def test_a_joint_prior_is_as_wide_as_its_covariance():
    values = np.array([2.0, 5.0])
    covariance = np.array([[0.04, 0.03], [0.03, 0.09]])
    joint = PriorDensity.of_estimate(["a", "b"], values, covariance, np.array([True, True]))
    slopes = joint.slopes(values)
    np.testing.assert_allclose(np.linalg.inv(slopes.T @ slopes), covariance, rtol=1e-12)
    nearby = values * 1.001
    np.testing.assert_allclose(joint.deviations(nearby), slopes @ (nearby - values), rtol=1e-3)


def test_what_may_be_zero_is_no_logarithm_in_a_joint_prior():
    """An exponent may come out with either sign, whatever the data before said."""
    values, covariance = np.array([2.0, 0.1]), np.array([[0.04, 0.01], [0.01, 0.09]])
    joint = PriorDensity.of_estimate(["a", "s"], values, covariance, np.array([True, False]))
    here = np.array([2.0, -0.3])
    away = np.array([0.0, -0.4])
    squares = away @ np.linalg.solve(covariance, away)
    assert np.sum(joint.deviations(here) ** 2) == pytest.approx(squares)
    step = 1e-6 * np.eye(2)
    slopes = [(joint.deviations(here + one) - joint.deviations(here - one)) / 2e-6 for one in step]
    np.testing.assert_allclose(joint.slopes(here), np.transpose(slopes), rtol=1e-6)


def test_densities_of_different_parameters_are_independent():
    values, covariance = np.array([2.0, 5.0]), np.array([[0.04, 0.03], [0.03, 0.09]])
    own = PriorDensity.of_priors({"c": Prior(1.0, 0.5), "d": Prior(0.0, 2.0, relative=False)})
    joint = PriorDensity.of_estimate(["a", "b"], values, covariance, np.array([True, True]))
    both, here = own.beside(joint), np.array([1.2, 3.0, 2.1, 4.9])
    parts = [own.deviations(here[:2]), joint.deviations(here[2:])]
    np.testing.assert_allclose(both.deviations(here), np.concatenate(parts))
    assert both.sources == ("c", "d", "fit", "fit")
    assert not both.slopes(here)[:2, 2:].any()
