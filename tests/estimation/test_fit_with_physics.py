"""Fits and calibrations of levers with thermoelectricity, of both polarities."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever import Lever, Probe, calibrate, fit
from hotlever.lever.lever import COARSE
from hotlever.measurement import Measurement

pytestmark = pytest.mark.usefixtures("coarse_meshes")

PROBE = Probe.reference().with_physics(("thermoelectric", "radiation"))
BIAS = np.concatenate([np.linspace(-9.0, -1.0, 9), np.linspace(1.0, 9.0, 9)])


@pytest.fixture(scope="module")
def truth() -> Probe:
    return PROBE.with_(n_d=5.2e17, c_kappa=0.70)


@pytest.fixture(scope="module")
def measured(truth) -> Measurement:
    sweep, noise = Lever(truth, COARSE).sweep(BIAS), np.random.default_rng(1).normal
    current, reader = (
        column.values * (1 + 1e-3 * noise(size=BIAS.size))
        for column in (sweep.current_mA, sweep.reader_V)
    )
    nothing = np.full(BIAS.size, np.nan)
    return Measurement(BIAS, current, reader, nothing, nothing)


def test_a_fit_of_both_polarities_returns_the_material(measured, truth):
    result = fit(measured, PROBE)
    assert result.describes_data
    for name in ("c_kappa", "n_d", "p"):
        parameter, true = result.parameters[name], getattr(truth.material, name)
        assert abs(parameter.value - true) < 6 * parameter.stderr


@pytest.mark.slow
def test_a_calibration_has_what_is_not_known_of_the_effects_in_its_budget(measured, truth):
    result = calibrate(measured, probe=PROBE)
    assert result.describes_data
    assert {"scattering_exponent", "emissivity"} <= set(result.priors)
    exact = Lever(truth).sweep(result.table.bias_V.values[[0, -1]])
    error = result.table.tip_K.values[[0, -1]] - exact.tip_K.values
    assert np.abs(error / result.table.tip_stderr_K.values[[0, -1]]).max() < 3.0
