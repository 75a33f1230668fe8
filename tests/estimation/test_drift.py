"""A drifting zero of the instruments."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from fit_twins import twin

from hotlever.estimate import FitOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import solve


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


def test_the_fit_says_that_the_zero_drifts(coarse, coarse_fast, drifting):
    estimated = solve(Problem.of(drifting, coarse.probe, FitOptions(), model=coarse_fast))
    at, slopes = estimated.prediction, estimated.posterior.slopes
    notes = estimated.residuals.drifting_zeros(at.values, slopes)
    assert any(text.startswith("current: the zero seems to go from") for text in notes)
