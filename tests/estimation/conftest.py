"""A coarse lever as the forward model of fits, full and reduced."""

from __future__ import annotations

import pytest

from experiments import full_experiment, reduced_experiment


@pytest.fixture(scope="module")
def coarse_model(coarse):
    """The coarse lever as forward model: the same equations on both sides."""
    return lambda probe, bias: full_experiment(coarse.with_probe(probe), bias)


@pytest.fixture(scope="module")
def coarse_fast(coarse, reduced):
    """The reduced lever of the same coarse mesh."""
    return lambda probe, bias: reduced_experiment(coarse.with_probe(probe), reduced, bias)
