"""The error estimate of the reduced lever."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import ComputationError
from hotlever.lever.branch import Reach
from hotlever.lever.observables import at_fixed_bias
from hotlever.lever.reduced_lever import ReductionOptions, estimated_error, reduce
from hotlever.lever.response_surface import PAPER, ParameterDomain
from hotlever.materials.parameters import OF_SILICON


@pytest.fixture(scope="module")
def poor(coarse):
    """A reduced lever with few modes: its errors are large enough to be seen."""
    return reduce(coarse, ReductionOptions(parameter_sets=4, modes_T=14, modes_V=14))


@pytest.mark.parametrize("seed", range(3))
def test_the_estimate_bounds_the_true_error_without_exaggeration(coarse, poor, seed):
    shares = np.random.default_rng(seed).uniform(-0.3, 1.3, len(PAPER))
    there = ParameterDomain.of(coarse.probe).probe(coarse.probe, shares)
    branch = poor.linearised(there, Reach(coarse.circuit, 11.0)).branch
    u = np.linspace(3.0, 0.98 * branch.end_u, 7)
    full = coarse.with_probe(there).branch(293.0 + u[-1] ** 2 + 50.0)
    away = full.curve(u) - branch.curve(u)
    true = np.abs(at_fixed_bias(branch.curve(u, 1), coarse.circuit, away[:, :, None]))[1:, :, 0]
    estimate = estimated_error(coarse, branch, u)
    assert true[2].max() > 1e-3
    assert np.all(true <= estimate)
    largest = np.argmax(true, axis=1)
    assert np.all(estimate[range(3), largest] < 10.0 * true[range(3), largest])


@pytest.mark.parametrize("seed", range(2))
def test_a_reduced_lever_is_accurate_where_its_estimate_says_so(coarse, reduced, seed):
    """Materials over the full bounds of a fit, and every second time those it was made for."""
    rng = np.random.default_rng(seed)
    if seed % 2:
        shares = rng.uniform(0.0, 1.0, len(PAPER))
        probe = ParameterDomain.of(coarse.probe).probe(coarse.probe, shares)
    else:
        known = {name: OF_SILICON[name] for name in PAPER}
        probe = coarse.probe.with_(
            **{name: rng.uniform(one.lower, one.upper) for name, one in known.items()}
        )
    lever = coarse.with_probe(probe)
    bias = np.linspace(0.5, 6.0, 12)
    try:
        branch = reduced.linearised(probe, Reach(lever.circuit, 6.0)).branch
    except ComputationError:
        assert not seed % 2
        return
    u = branch.read(lever.circuit, bias).u
    error = estimated_error(lever, branch, u[np.isfinite(u)])[2].max()
    if not error <= 0.1:
        assert not seed % 2
        return
    full = lever.branch_to(6.0).read(lever.circuit, bias).u
    assert np.abs(branch.read(lever.circuit, bias).u ** 2 - full**2).max() < 0.1
