"""A coarse lever as the forward model of fits, full and reduced."""

from __future__ import annotations

import pytest
from fit_twins import twin

from experiments import full_experiment, reduced_experiment
from hotlever.estimate import Estimate, fit


@pytest.fixture(scope="session")
def coarse_model(coarse):
    """The coarse lever as forward model: the same equations on both sides."""
    return lambda probe, bias: full_experiment(coarse.with_probe(probe), bias)


@pytest.fixture(scope="session")
def coarse_fast(coarse, reduced):
    """The reduced lever of the same coarse mesh."""
    return lambda probe, bias: reduced_experiment(coarse.with_probe(probe), reduced, bias)


@pytest.fixture(scope="session")
def noisy_fit(coarse, coarse_fast) -> Estimate:
    """A fit of a twin with noise of 0.2 %, with the reduced lever."""
    return fit(twin(coarse, noise=2e-3), model=coarse_fast)
