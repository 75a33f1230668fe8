"""The error estimate of the reduced lever."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.lever.atlas import BOX, material_in_box
from hotlever.lever.branch import Reach
from hotlever.lever.certificate import estimated_error
from hotlever.lever.reduction import ReductionOptions, reduce
from hotlever.lever.sensitivities import at_fixed_bias


@pytest.fixture(scope="module")
def poor(coarse):
    """A reduced lever with few modes: its errors are large enough to be seen."""
    return reduce(coarse, ReductionOptions(parameter_sets=4, modes_T=14, modes_V=14))


@pytest.mark.parametrize("seed", range(5))
def test_the_estimate_bounds_the_true_error_without_exaggeration(coarse, poor, seed):
    shares = np.random.default_rng(seed).uniform(-0.3, 1.3, len(BOX))
    material = material_in_box(coarse.probe.material, shares)
    there = coarse.with_material(material).probe
    branch = poor.linearised(there, Reach(coarse.circuit, 11.0)).branch
    u = np.linspace(3.0, 0.98 * branch.end_u, 7)
    full = coarse.with_material(material).branch(293.0 + u[-1] ** 2 + 50.0)
    away = (full.curve(u) - branch.curve(u))[:, :3]
    true = np.abs(at_fixed_bias(branch.curve(u, 1), u, coarse.circuit, away[:, :, None]))[..., 0]
    estimate = estimated_error(coarse, branch, u)
    assert true[2].max() > 1e-3
    assert np.all(true <= estimate)
    largest = np.argmax(true, axis=1)
    assert np.all(estimate[range(3), largest] < 10.0 * true[range(3), largest])
