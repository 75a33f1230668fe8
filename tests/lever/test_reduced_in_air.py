"""The reduced lever in air, and a fit with it."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.fitting import fit
from hotlever.fitting.measurement import Measurement
from hotlever.fitting.models import FastModel
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.lever.reduced_lever import ReducedLever
from hotlever.lever.reduction import BOX, material_in_box

BIAS = np.linspace(1.0, 11.0, 11)


@pytest.fixture(scope="module")
def in_air(coarse):
    return coarse.in_medium("air")


@pytest.fixture(scope="module")
def space(in_air):
    return cached_reduction(in_air)


@pytest.mark.parametrize("seed", range(2))
def test_it_follows_the_full_lever_in_its_box(in_air, space, seed):
    rng = np.random.default_rng(seed)
    material = material_in_box(in_air.probe.material, rng.random(len(BOX)))
    material = material.with_(c_kappa=rng.uniform(0.6, 0.76))
    full = in_air.with_material(material).sweep(BIAS, sensitivities=True)
    reduced = ReducedLever(space, in_air.probe.circuit)
    states = reduced.solve(material, BIAS)
    current, reader, tip = states.observables
    # benchmarks/air.py states the accuracy on the default mesh
    np.testing.assert_allclose(current, full.current_mA, rtol=1e-5)
    np.testing.assert_allclose(reader, full.reader_V, rtol=2e-5)
    np.testing.assert_allclose(tip, full.tip_K, rtol=0, atol=0.02)
    slopes = reduced.linearise(states).sensitivities
    largest = np.abs(full.sensitivity.values).max(axis=1, keepdims=True)
    np.testing.assert_allclose(slopes / largest, full.sensitivity / largest, atol=5e-3)


def test_the_medium_has_files_of_its_own(coarse, space):
    assert cached_reduction(coarse).air is None
    assert space.air is not None


def test_a_fit_of_data_taken_in_air_finds_the_material(in_air, space):
    truth = in_air.probe.material.with_(n_d=5.2e17, c_kappa=0.66, delta=0.7)
    data = in_air.with_material(truth).sweep(BIAS)
    rng = np.random.default_rng(1)
    measured = Measurement(
        BIAS,
        data.current_mA.values + rng.normal(0, 2e-4, BIAS.size),
        data.reader_V.values + rng.normal(0, 2e-4, BIAS.size),
        data.tip_K.values + rng.normal(0, 2.0, BIAS.size),
        np.full(BIAS.size, np.nan),
        medium="air",
    )
    vacuum = in_air.probe.in_medium("vacuum")
    result = fit(measured, vacuum, model=lambda _: FastModel(in_air, space))
    assert result.probe.surroundings.medium == "air"
    assert "medium: the data file's air is used, not the probe's vacuum" in result.notes
    for name in ("c_kappa", "n_d", "delta"):
        fitted = result.parameters[name]
        assert abs(fitted.value - getattr(truth, name)) < 4 * fitted.stderr
        assert fitted.stderr < 0.1 * fitted.value
