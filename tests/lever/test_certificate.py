"""The error estimate of the reduced lever, and what is done when it is too large."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.fitting.models import FastModel
from hotlever.lever import Lever
from hotlever.lever.certificate import TOLERANCE, estimated_error, relative_to_tolerance
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.lever.reduced_lever import ReducedLever
from hotlever.lever.reduction import BOX, ReductionOptions, material_in_box

BIAS = np.linspace(1.0, 11.0, 7)


@pytest.fixture(scope="module")
def poor(coarse):
    """A reduced lever with few modes: its errors are large enough to be seen."""
    return cached_reduction(coarse, ReductionOptions(parameter_sets=4, modes_T=14, modes_V=14))


def compared(lever, space, material):
    states = ReducedLever(space, lever.probe.circuit).solve(material, BIAS)
    full = lever.with_material(material).sweep(BIAS)
    exact = np.stack([full.current_mA, full.reader_V, full.tip_K])
    return states, np.abs(exact - states.observables)


@pytest.mark.parametrize("seed", range(5))
def test_the_estimate_bounds_the_true_error_without_exaggeration(coarse, poor, seed):
    shares = np.random.default_rng(seed).uniform(-0.3, 1.3, len(BOX))
    material = material_in_box(coarse.probe.material, shares)
    states, true = compared(coarse, poor, material)
    estimate = estimated_error(coarse, poor, states)
    assert true.max(axis=1)[2] > 1e-3
    assert np.all(true <= estimate)
    largest = np.argmax(true, axis=1)
    assert np.all(estimate[range(3), largest] < 10.0 * true[range(3), largest])


def test_some_of_the_states_can_be_estimated(coarse, poor):
    states, _ = compared(coarse, poor, coarse.probe.material)
    every = estimated_error(coarse, poor, states)
    np.testing.assert_array_equal(estimated_error(coarse, poor, states, [1, 4]), every[:, [1, 4]])


def test_errors_are_compared_with_the_tolerance():
    observables = np.array([[2.0], [0.5], [600.0]])
    error = np.array([[2e-5], [1e-5], [0.01]])
    assert relative_to_tolerance(error, observables) == pytest.approx(2.0)
    error[1], observables[1] = np.nan, np.nan
    assert relative_to_tolerance(error, observables) == pytest.approx(1.0)
    assert TOLERANCE.shape == (3,)


def test_a_space_is_enriched_where_its_error_is_too_large(coarse, poor):
    # well outside the box that the modes were made for
    material = material_in_box(coarse.probe.material, np.array([1.4, 0.5, -0.3, 1.3, 0.5]))
    before, true = compared(coarse, poor, material)
    assert relative_to_tolerance(true, before.observables) > 2.0
    model = FastModel(coarse, poor)
    values, _ = model.predict(material, BIAS)
    assert model.space.size > poor.size
    full = coarse.with_material(material).sweep(BIAS)
    exact = np.stack([full.current_mA, full.reader_V, full.tip_K])
    assert relative_to_tolerance(np.abs(values - exact), exact) < 1.0


def test_inside_the_box_nothing_is_added(coarse):
    space = cached_reduction(coarse)
    model = FastModel(coarse, space)
    model.predict(coarse.probe.material, BIAS)
    assert model.space is space


def test_an_enriched_space_keeps_its_atlas_and_its_states(coarse, poor):
    material = coarse.probe.material
    lever = Lever(coarse.probe, space=coarse.space)
    full = lever.solve(BIAS)
    vectors = np.stack([state.x for state in full.states], axis=1)
    richer = poor.enriched(vectors, vectors[:, :0])
    assert poor.size < richer.size <= poor.size + 2 * BIAS.size
    for x in vectors.T:
        back = richer.expanded(richer.coordinates(x))
        np.testing.assert_allclose(back, x, atol=2e-2)
    old = ReducedLever(poor, lever.probe.circuit).solve(material, BIAS)
    new = ReducedLever(richer, lever.probe.circuit).solve(material, BIAS)
    np.testing.assert_allclose(new.observables[2], old.observables[2], atol=1.0)
    exact = lever.sweep(BIAS)
    np.testing.assert_allclose(new.observables[2], exact.tip_K, atol=2e-2)
