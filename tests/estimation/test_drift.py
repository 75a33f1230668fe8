"""A drifting zero of the instruments."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from fit_twins import twin

from hotlever.estimate import FitOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.residuals import Residuals, errors_of_scales
from hotlever.estimate.search import solve
from hotlever.measurement import Measurement
from hotlever.probe.priors import Prior


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


@pytest.mark.parametrize("spread", [None, 2e-3, 0.2])
def test_what_the_scale_of_a_meter_explains_does_not_hide_a_zero(spread):
    """With a prior of the scale the zero seemed to go from -0.002 to 0.005 mA, or not at all."""
    bias, noise = np.linspace(1.0, 11.0, 60), 1e-3
    shown = 1.0 - np.exp(-bias / 3.0)
    current = shown + np.linspace(0.01, 0.03, bias.size)
    current += noise * np.random.default_rng(0).standard_normal(bias.size)
    further = {"current_error_mA": np.full(bias.size, noise)}
    data = Measurement(bias, current, *3 * [np.full(bias.size, np.nan)], further=further)
    prior = {} if spread is None else {"current_scale": Prior(1.0, spread)}
    common = errors_of_scales(data, ["current"], prior, 293.0) if prior else []
    residuals = Residuals(data, ["current"], "errors", common=common)
    # of one parameter, which is none of these
    (note,) = residuals.drifting_zeros(shown[None], np.sin(bias)[None, :, None])
    first, last = map(float, re.findall(r"[+-][\d.]+", note))
    assert first == pytest.approx(0.01, abs=2e-3)
    assert last == pytest.approx(0.03, abs=2e-3)
