"""What a calibration from currents takes its temperatures from: the intrinsic carriers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hotlever.estimate import calibrate
from hotlever.lever import Lever
from hotlever.materials.departures import FACTORS
from hotlever.materials.silicon import intrinsic_density
from hotlever.probe import Probe
from synthetic_curves import measured_curve, measurement_of

pytestmark = pytest.mark.usefixtures("coarse_meshes")

SCALE, AT_K = 1.15, 800.0


def measured(scale):
    """A lever with some intrinsic carriers over those of Eq. 7, and its I-V curve."""
    branch = Lever(Probe.reference().with_(intrinsic_scale=scale)).branch()
    return branch, measurement_of(measured_curve(branch, np.random.default_rng(4)))


def off(calibration, branch):
    """How far a calibration is off where the tip has a temperature (K), and the stated error."""
    table, bias = calibration.table, branch.bias(AT_K, calibration.probe.circuit)
    tip = float(np.interp(bias, table.bias_V, table.tip_K))
    return tip - AT_K, float(np.interp(bias, table.bias_V, table.tip_stderr_K))


def test_the_shift_is_that_of_the_density():
    density, by = intrinsic_density(AT_K, 3e17)
    assert by["T"] / density == pytest.approx(0.013, abs=5e-4)
    assert pytest.approx(11.0 * by["T"] / density, rel=0.05) == SCALE - 1.0


@pytest.mark.slow
def test_held_they_make_an_error_beyond_all_that_is_stated():
    priors = {"laws": "paper"}
    branch, data = measured(SCALE)
    usual, curve = measured(1.0)
    held, stated = off(calibrate(data, priors=priors), branch)
    shift = held - off(calibrate(curve, priors=priors), usual)[0]
    assert shift == pytest.approx(10.0, abs=1.0)
    assert shift > stated
    # known as well as published densities agree, the error is within what is stated
    free, stated = off(calibrate(data), branch)
    assert abs(free) < 1.2 * stated
    assert stated > 10.0


def test_tip_temperatures_bring_them_up_to_date():
    branch, data = measured(SCALE)
    at = np.isin(np.arange(data.bias_V.size), [20, 25, 30, 35])
    tip = branch.tip_K(branch.read(Probe.reference().circuit, data.bias_V).u)
    spectra = replace(data, tip_K=np.where(at, tip, np.nan), tip_error_K=np.where(at, 2.0, np.nan))
    calibration = calibrate(spectra, probe=Probe.reference())
    error, stated = off(calibration, branch)
    assert abs(error) < 2.0 * stated
    # most of it is the thermometer's scale, 1.5 % of the rise
    assert stated < 9.0
    law = FACTORS["n_i"]
    uses = [calibration.priors[name] for name in law.names]
    departed = np.array([use.posterior_value for use in uses]) @ law.modes(AT_K)
    assert departed == pytest.approx(np.log(SCALE), abs=0.5 * law.spread(AT_K))
    assert uses[0].spread_ratio < 0.8
