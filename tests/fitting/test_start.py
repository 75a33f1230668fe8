"""Starting values: found from the data, whatever the user's own."""

from __future__ import annotations

import numpy as np
import pytest
from test_fit import BIAS, twin

from hotlever.fitting import Measurement, fit
from hotlever.fitting.models import reduced_model
from hotlever.fitting.residuals import Residuals
from hotlever.fitting.start import quick_prediction, starting_probe
from hotlever.lever.box import Box
from hotlever.lever.dataset import OBSERVABLES
from hotlever.materials import PARAMETERS


@pytest.fixture(scope="module")
def model(coarse, reduced):
    return lambda probe, bias: reduced_model(coarse.with_probe(probe), reduced, bias)


def shown(lever, probe):
    sweep = lever.with_probe(probe).sweep(BIAS)
    return np.stack([sweep[column].values for column in OBSERVABLES.values()])


def residuals_of(data) -> Residuals:
    current, reader, tip = data
    measured = Measurement(BIAS, current, reader, tip, np.full(BIAS.size, np.nan))
    return Residuals(measured, list(OBSERVABLES))


def random_probes(count, seed, around):
    rng, box = np.random.default_rng(seed), Box.of(around)
    return [
        box.probe(around, rng.random(len(box.names))).with_(c_kappa=rng.uniform(0.5, 0.9))
        for _ in range(count)
    ]


def test_the_atlas_predicts_a_measurement_roughly(coarse, reduced):
    for probe in random_probes(3, 2, coarse.probe):
        quick = quick_prediction(reduced.atlas, probe, BIAS)
        full = shown(coarse, probe)
        assert np.abs(quick[2] - full[2]).max() < 100.0
        size = full.max(axis=1, keepdims=True)
        assert np.abs((quick - full) / size)[:2].max() < 0.06


def test_the_start_is_near_the_truth(coarse, reduced):
    for probe in random_probes(3, 7, coarse.probe):
        data = shown(coarse, probe)
        given, residuals = coarse.probe, residuals_of(data)
        found = starting_probe(reduced.atlas, given, list(PARAMETERS), residuals)
        rough = shown(coarse, found)
        assert np.sqrt((((rough - data) / residuals.largest) ** 2).mean()) < 0.03


def test_fixed_parameters_stay_in_the_start(coarse, reduced):
    given = coarse.probe.with_(n_d=3.3e17, c_kappa=0.8)
    residuals = residuals_of(shown(coarse, coarse.probe))
    varied = ["delta", "p", "a0", "a1"]
    found = starting_probe(reduced.atlas, given, varied, residuals)
    assert (found.material.n_d, found.material.c_kappa) == (3.3e17, 0.8)


def test_the_given_start_is_kept_where_it_is_the_best(coarse, reduced):
    probe = coarse.probe
    residuals = residuals_of(quick_prediction(reduced.atlas, probe, BIAS))
    found = starting_probe(reduced.atlas, probe, list(PARAMETERS), residuals)
    assert found == probe


@pytest.mark.parametrize("seed", range(4))
def test_any_start_ends_at_the_same_optimum(coarse, model, seed):
    measurement = twin(coarse, noise=0.002)
    best = fit(measurement, coarse.probe, model=model)
    (start,) = random_probes(1, 30 + seed, coarse.probe)
    found = fit(measurement, start, model=model)
    for name, parameter in best.parameters.items():
        assert abs(found.parameters[name].value - parameter.value) < 0.05 * parameter.stderr


def test_a_glitch_does_not_lead_the_start_astray(coarse, reduced):
    data = shown(coarse, coarse.probe)
    data[0, 5] *= 10.0
    given = coarse.probe.with_(n_d=2.1e17, p=2.4)
    found = starting_probe(reduced.atlas, given, list(PARAMETERS), residuals_of(data))
    assert coarse.with_probe(found).knee().tip_K.item() == pytest.approx(
        coarse.knee().tip_K.item(), abs=40.0
    )
