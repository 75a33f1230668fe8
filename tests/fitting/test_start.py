"""Starting values: found from the data, whatever the user's own."""

from __future__ import annotations

import numpy as np
import pytest
from test_fit import twin

from hotlever.fitting import fit
from hotlever.fitting.models import FastModel
from hotlever.fitting.start import QuickPrediction, starting_material
from hotlever.lever import Lever
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.lever.reduction import BOX, material_in_box
from hotlever.materials import PARAMETERS

BIAS = np.linspace(1.0, 11.0, 13)


@pytest.fixture(scope="module")
def space(coarse):
    return cached_reduction(coarse)


@pytest.fixture(scope="module")
def model(coarse, space):
    return lambda probe: FastModel(Lever(probe, space=coarse.space), space)


def random_materials(count, seed, around):
    rng = np.random.default_rng(seed)
    return [
        material_in_box(around, rng.random(len(BOX))).with_(c_kappa=rng.uniform(0.5, 0.9))
        for _ in range(count)
    ]


def test_the_atlas_predicts_a_measurement_roughly(coarse, space):
    for material in random_materials(3, 2, coarse.probe.material):
        current, reader, tip = QuickPrediction(space, coarse.probe.circuit, BIAS)(material)
        full = coarse.with_material(material).sweep(BIAS)
        assert np.abs(tip - full.tip_K.values).max() < 100.0
        np.testing.assert_allclose(current, full.current_mA, atol=0.06 * full.current_mA.max())
        np.testing.assert_allclose(reader, full.reader_V, atol=0.06 * full.reader_V.max())


def test_the_start_is_near_the_truth(coarse, space):
    for material in random_materials(3, 7, coarse.probe.material):
        full = coarse.with_material(material).sweep(BIAS)
        data = np.stack([full.current_mA, full.reader_V, full.tip_K])
        scale = np.broadcast_to(np.abs(data).max(axis=1, keepdims=True), data.shape)
        circuit = coarse.probe.circuit
        given = coarse.probe.material
        found = starting_material(space, circuit, given, list(PARAMETERS), BIAS, data, scale)
        start = coarse.with_material(found).sweep(BIAS)
        rough = np.stack([start.current_mA, start.reader_V, start.tip_K])
        assert np.sqrt((((rough - data) / scale) ** 2).mean()) < 0.03


def test_fixed_parameters_stay_in_the_start(coarse, space):
    given = coarse.probe.material.with_(n_d=3.3e17, c_kappa=0.8)
    full = coarse.sweep(BIAS)
    data = np.stack([full.current_mA, full.reader_V, full.tip_K])
    varied = ["delta", "p", "a0", "a1"]
    found = starting_material(
        space, coarse.probe.circuit, given, varied, BIAS, data, np.ones_like(data)
    )
    assert (found.n_d, found.c_kappa) == (3.3e17, 0.8)


def test_the_given_start_is_kept_where_it_is_the_best(coarse, space):
    quick = QuickPrediction(space, coarse.probe.circuit, BIAS)(coarse.probe.material)
    scale = np.broadcast_to(np.abs(quick).max(axis=1, keepdims=True), quick.shape)
    material = coarse.probe.material
    names = list(PARAMETERS)
    circuit = coarse.probe.circuit
    assert starting_material(space, circuit, material, names, BIAS, quick, scale) == material


@pytest.mark.parametrize("seed", range(4))
def test_any_start_ends_at_the_same_optimum(coarse, model, seed):
    measurement = twin(coarse, noise=0.002)
    best = fit(measurement, coarse.probe, model=model)
    (start,) = random_materials(1, 30 + seed, coarse.probe.material)
    probe = coarse.probe.model_copy(update={"material": start})
    found = fit(measurement, probe, model=model)
    for name, parameter in best.parameters.items():
        assert abs(found.parameters[name].value - parameter.value) < 0.05 * parameter.stderr


def test_a_glitch_does_not_lead_the_start_astray(coarse, space):
    full = coarse.sweep(BIAS)
    data = np.stack([full.current_mA, full.reader_V, full.tip_K])
    scale = np.broadcast_to(np.abs(data).max(axis=1, keepdims=True), data.shape)
    data[0, 5] *= 10.0
    given = coarse.probe.material.with_(n_d=2.1e17, p=2.4)
    found = starting_material(
        space, coarse.probe.circuit, given, list(PARAMETERS), BIAS, data, scale
    )
    assert coarse.with_material(found).knee().tip_K.item() == pytest.approx(
        coarse.knee().tip_K.item(), abs=40.0
    )
