"""A drifting zero of the instruments."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from fit_twins import TRUTH, twin

from experiments import reduced_experiment
from hotlever.estimation import FitOptions, fit
from hotlever.estimation.inverse_problem import estimate
from hotlever.estimation.residuals import Drift


@pytest.fixture(scope="module")
def model(coarse, reduced):
    return lambda probe, bias: reduced_experiment(coarse.with_probe(probe), reduced, bias)


@pytest.fixture(scope="module")
def drifting(coarse):
    """Data whose zeros run from one value to another, in an order unlike that of the bias."""
    good = twin(coarse, noise=5e-4)
    order = np.random.default_rng(8).permutation(good.bias_V.size)
    shuffled = {
        name: getattr(good, name)[order]
        for name in ("bias_V", "current_mA", "reader_V", "tip_K", "tip_error_K")
    }
    shuffled["current_mA"] = shuffled["current_mA"] + np.linspace(0.01, 0.05, order.size)
    shuffled["reader_V"] = shuffled["reader_V"] - 0.008
    return dataclasses.replace(good, **shuffled)


def test_a_drifting_zero_is_found_and_taken_out(coarse, model, drifting):
    result = fit(drifting, coarse.probe, drift=True, model=model)
    for name, value in TRUTH.items():
        parameter = result.parameters[name]
        assert abs(parameter.value - value) < 4.0 * parameter.stderr
    assert result.residual_rms["current_mA"] < 1e-3
    (note,) = (note for note in result.notes if note.startswith("current: the zero goes from"))
    first, last = (float(word) for word in note.split()[5:8:2])
    assert first == pytest.approx(0.01, abs=2e-3)
    assert last == pytest.approx(0.05, abs=2e-3)


def test_without_the_option_the_fit_says_that_the_zero_drifts(coarse, model, drifting):
    estimated = estimate(drifting, coarse.probe, FitOptions(), model=model)
    at, slopes = estimated.prediction, estimated.posterior.slopes
    notes = estimated.residuals.drifting_zeros(at.values, slopes)
    assert any("--drift would take that out" in text for text in notes)


def test_data_without_drift_raise_no_suspicion(coarse, model):
    result = fit(twin(coarse, noise=5e-4), coarse.probe, model=model)
    assert not any("zero" in note for note in result.notes)


def test_lines_are_recovered_exactly_and_leave_the_tip_alone():
    present = np.ones((3, 8), dtype=bool)
    present[1, 2] = False
    drift = Drift(("current", "reader", "tip"), present)
    truth = np.stack([np.linspace(1.0, 2.0, 8), np.full(8, -0.3), np.zeros(8)])
    difference = truth + np.array([[0.0], [0.0], [5.0]])
    difference[1, 2] = np.nan
    weights = np.random.default_rng(0).uniform(0.5, 2.0, (3, 8))
    np.testing.assert_allclose(drift.line(difference, weights), truth, atol=1e-12)


def test_the_jacobian_of_the_rest_has_nothing_along_the_lines():
    present = np.ones((2, 9), dtype=bool)
    drift = Drift(("current", "tip"), present)
    rng = np.random.default_rng(1)
    weights, matrix = rng.uniform(0.5, 2.0, (2, 9)), rng.normal(size=(18, 3))
    rest = drift.removed(matrix, weights)
    line = (weights * np.stack([np.linspace(0.0, 1.0, 9), np.zeros(9)])).ravel()
    np.testing.assert_allclose(line @ rest, 0.0, atol=1e-12)
