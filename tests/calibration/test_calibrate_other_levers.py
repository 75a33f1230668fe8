"""Calibrations of levers that are not as the probe file says, in air, of cold curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hotlever.estimate import Estimate, calibrate, fit
from hotlever.lever import Lever
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, default_priors
from synthetic_curves import measured_curve, measurement_of

pytestmark = pytest.mark.usefixtures("coarse_meshes")


@pytest.mark.slow
def test_a_narrow_prior_holds_and_none_at_all_varies_the_material_only(reference):
    data = measurement_of(measured_curve(reference, np.random.default_rng(8)))
    priors = default_priors(Probe.reference()) | {"heater_length_um": Prior(4.1, 1e-6)}
    held = calibrate(data, priors=priors)
    assert held.probe.shape.heater_length_um == pytest.approx(4.1, rel=1e-4)
    free = calibrate(data, priors={})
    assert free.probe.shape == Probe.reference().shape
    assert set(free.table.source.values) == {"measurement", "model"}


@pytest.mark.parametrize("shape", ["three-leg", pytest.param("u-shape", marks=pytest.mark.slow)])
def test_another_lever_is_within_a_few_stated_errors(shape):
    """Dimensions off by 5 %, another material, doping known to 15 %; I-V only."""
    nominal = Probe.reference() if shape == "three-leg" else Probe.u_shape()
    rng = np.random.default_rng(22)
    true = nominal.with_(
        **{
            name: prior.at(float(rng.standard_normal()))
            for name, prior in default_priors(nominal).items()
            if name not in ("series_resistance_ohm", "impurity_exponent")
        }
    )
    lever = Lever(true)
    data = measurement_of(measured_curve(lever.branch(), rng))
    calibration = calibrate(data, probe=nominal)
    error = np.abs(calibration.table.tip_K - lever.sweep(calibration.table.bias_V.values).tip_K)
    assert float((error / calibration.table.tip_stderr_K).max()) < 3.0
    assert float(error.max()) < 60.0


def test_no_knee_is_needed(reference):
    """Below it the band is as narrow as ever, and nothing is said of what is above."""
    curve = measured_curve(reference, np.random.default_rng(2), to_V=7.0)
    calibration = calibrate(measurement_of(curve))
    table = calibration.table
    error = np.abs(table.tip_K - reference.tip_temperature(table.power_mW))
    assert np.all(error < 4 * table.tip_stderr_K + 0.2)
    assert table.bias_V.max() == pytest.approx(7.0, abs=0.02)
    assert abs(calibration.knee.power_mW - reference.knee.power_mW) < 0.1
    assert not calibration.content()["knee"]["measured"]


@pytest.mark.slow
def test_a_lever_in_air_is_estimated_in_air(lever, reference):
    air = lever.in_medium("air").branch()
    curve = measurement_of(measured_curve(air, np.random.default_rng(5), to_V=12.0))
    calibration = calibrate(curve, medium="air")
    assert calibration.k == pytest.approx(air.knee.power_mW / reference.knee.power_mW, rel=0.04)
    error = np.abs(calibration.table.tip_K - air.tip_temperature(calibration.table.power_mW))
    assert float((error / calibration.table.tip_stderr_K).max()) < 3.0
    assert "air" in calibration.table.source.values
    # the paper's rule for the same data
    by_rule = calibrate(replace(curve, medium="air"), medium="vacuum")
    assert by_rule.table.budget_K.sel(source="constant k").max() > 10.0
    assert by_rule.k == pytest.approx(calibration.k, rel=0.05)


def test_k_is_no_surer_than_the_knee_in_vacuum_that_nobody_measured(in_air, coarse):
    """It had the error of the knee in air alone, which data show: a tenth of what it is off by."""
    air = in_air.branch()
    curve = measured_curve(air, np.random.default_rng(5), to_V=12.0)
    calibration = calibrate(measurement_of(curve), medium="air")
    knee, k = calibration.knee, calibration.k
    true = air.need_knee().power_mW / coarse.branch().need_knee().power_mW
    assert abs(k - true) < 3.0 * calibration.k_stderr
    assert 0.02 * k < calibration.k_stderr < 0.06 * k
    assert calibration.k_stderr / k > 5.0 * knee.power_mW_stderr / knee.power_mW


@pytest.mark.slow
def test_a_fit_in_vacuum_is_what_is_known_before_a_measurement_in_air(in_air, reference):
    """What the fit knows of material and dimensions narrows the band in air."""
    rng = np.random.default_rng(6)
    vacuum = measurement_of(measured_curve(reference, rng))
    air = in_air.branch()
    other = replace(measurement_of(measured_curve(air, rng, to_V=12.0)), medium="air")
    fitted = fit(vacuum, Probe.reference(), fixed={"p": None})
    both = calibrate(other, fit=fitted)
    # what the fit has left is correlated, so that there are no degrees of freedom
    budget = both.gum.budget
    earlier = [row.quantity.endswith(" of the fit") for row in budget.inputs]
    of_fit = both.table.budget_K.sel(source="fit")[-1].item()
    assert budget.part(np.flatnonzero(earlier)).u == pytest.approx(of_fit, rel=1e-6)
    assert budget.u == pytest.approx(both.table.tip_stderr_K[-1].item(), rel=1e-6)
    assert np.isnan(budget.dof)
    np.testing.assert_allclose(np.diag(budget.correlation), 1.0, rtol=1e-12)
    assert np.count_nonzero(budget.correlation) == len(earlier) - sum(earlier) + sum(earlier) ** 2
    content = both.content()
    assert len(content["gum_correlation"]) == len(content["gum"])
    assert content["effective_dof"] is None
    assert Estimate.of_file(both.file().model_validate(content, context="")).content() == content
    assert both.medium == "air"
    assert {"fit", "measurement", "air"} <= set(both.table.source.values.tolist())
    error = np.abs(both.table.tip_K - air.tip_temperature(both.table.power_mW))
    assert float((error / both.table.tip_stderr_K).max()) < 3.0
    assert both.probe.material.p == Probe.reference().material.p
