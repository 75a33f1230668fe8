"""Starting values: found from the data, whatever the user's own."""

from __future__ import annotations

import numpy as np
import pytest
from test_fit import BIAS, twin

from hotlever.fitting import Measurement, fit
from hotlever.fitting.models import reduced_model
from hotlever.fitting.residuals import Residuals
from hotlever.fitting.start import quick_prediction, starting_material
from hotlever.lever.atlas import BOX, material_in_box
from hotlever.lever.dataset import OBSERVABLES
from hotlever.materials import PARAMETERS


@pytest.fixture(scope="module")
def model(coarse, reduced):
    return lambda probe, bias: reduced_model(coarse.with_probe(probe), reduced, bias)


def shown(lever, material):
    sweep = lever.with_material(material).sweep(BIAS)
    return np.stack([sweep[column].values for column in OBSERVABLES.values()])


def residuals_of(data) -> Residuals:
    current, reader, tip = data
    measured = Measurement(BIAS, current, reader, tip, np.full(BIAS.size, np.nan))
    return Residuals(measured, list(OBSERVABLES))


def random_materials(count, seed, around):
    rng = np.random.default_rng(seed)
    return [
        material_in_box(around, rng.random(len(BOX))).with_(c_kappa=rng.uniform(0.5, 0.9))
        for _ in range(count)
    ]


def test_the_atlas_predicts_a_measurement_roughly(coarse, reduced):
    for material in random_materials(3, 2, coarse.probe.material):
        quick = quick_prediction(reduced.atlas, coarse.circuit, material, BIAS)
        full = shown(coarse, material)
        assert np.abs(quick[2] - full[2]).max() < 100.0
        size = full.max(axis=1, keepdims=True)
        assert np.abs((quick - full) / size)[:2].max() < 0.06


def test_the_start_is_near_the_truth(coarse, reduced):
    for material in random_materials(3, 7, coarse.probe.material):
        data = shown(coarse, material)
        given, residuals = coarse.probe.material, residuals_of(data)
        found = starting_material(reduced.atlas, coarse.circuit, given, list(PARAMETERS), residuals)
        rough = shown(coarse, found)
        assert np.sqrt((((rough - data) / residuals.largest) ** 2).mean()) < 0.03


def test_fixed_parameters_stay_in_the_start(coarse, reduced):
    given = coarse.probe.material.with_(n_d=3.3e17, c_kappa=0.8)
    residuals = residuals_of(shown(coarse, coarse.probe.material))
    varied = ["delta", "p", "a0", "a1"]
    found = starting_material(reduced.atlas, coarse.circuit, given, varied, residuals)
    assert (found.n_d, found.c_kappa) == (3.3e17, 0.8)


def test_the_given_start_is_kept_where_it_is_the_best(coarse, reduced):
    material = coarse.probe.material
    residuals = residuals_of(quick_prediction(reduced.atlas, coarse.circuit, material, BIAS))
    found = starting_material(reduced.atlas, coarse.circuit, material, list(PARAMETERS), residuals)
    assert found == material


@pytest.mark.parametrize("seed", range(4))
def test_any_start_ends_at_the_same_optimum(coarse, model, seed):
    measurement = twin(coarse, noise=0.002)
    best = fit(measurement, coarse.probe, model=model)
    (start,) = random_materials(1, 30 + seed, coarse.probe.material)
    probe = coarse.probe.model_copy(update={"material": start})
    found = fit(measurement, probe, model=model)
    for name, parameter in best.parameters.items():
        assert abs(found.parameters[name].value - parameter.value) < 0.05 * parameter.stderr


def test_a_glitch_does_not_lead_the_start_astray(coarse, reduced):
    data = shown(coarse, coarse.probe.material)
    data[0, 5] *= 10.0
    given = coarse.probe.material.with_(n_d=2.1e17, p=2.4)
    found = starting_material(
        reduced.atlas, coarse.circuit, given, list(PARAMETERS), residuals_of(data)
    )
    assert coarse.with_material(found).knee().tip_K.item() == pytest.approx(
        coarse.knee().tip_K.item(), abs=40.0
    )
