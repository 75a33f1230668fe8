"""Very many rows: averaged, with the result of least squares of all of them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from experiments import full_experiment
from hotlever.estimate import Measurement, fit, read_fit
from hotlever.estimate.residuals import Residuals
from hotlever.lever import Lever
from hotlever.measurement.rows import averaged

ROWS = 40_000


@pytest.fixture(scope="module")
def ramp(coarse: Lever) -> Measurement:
    """A slow ramp up and down with noise, and a tip temperature in every tenth row."""
    rng = np.random.default_rng(3)
    bias = np.abs(np.linspace(-10.0, 10.0, ROWS)) + 1.0
    branch = coarse.branch()
    u = branch.read(coarse.circuit, bias).u
    observables = branch.electrical_outputs(u)
    tip = coarse.circuit.base_temperature_K + u**2 + rng.normal(0.0, 3.0, ROWS)
    tip[np.arange(ROWS) % 10 > 0] = np.nan
    noise = 1.0 + 1e-3 * rng.normal(size=(2, ROWS))
    return Measurement(
        bias,
        observables["current_mA"] * noise[0],
        observables["reader_V"] * noise[1],
        tip,
        np.where(np.isnan(tip), np.nan, 3.0),
    )


def optimum(coarse: Lever, data: Measurement, weights: str) -> tuple[np.ndarray, np.ndarray]:
    """Where one step of least squares from the same lever leads, and its standard errors."""
    model = full_experiment(coarse, data.bias_V)
    at = model.predict(coarse.probe)
    residuals = Residuals(data, data.observables, weights)
    jacobian, residual = residuals.jacobian(at.slopes), residuals.weighted(at.values)
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    influence = inverse @ jacobian.T * residual
    return -influence.sum(axis=1), np.sqrt((influence**2).sum(axis=1))


@pytest.mark.parametrize("weights", ["maximum", "errors"])
def test_averages_lead_to_the_same_optimum_and_errors(coarse, ramp, weights):
    few = averaged(ramp)
    assert few.bias_V.size <= 2 * 1000
    assert few.rows.sum() == ROWS
    whole, errors = optimum(coarse, ramp, weights)
    found, again = optimum(coarse, few, weights)
    np.testing.assert_allclose(again, errors, rtol=0.1)
    # by what the optima differ, in K and relative to the largest current
    slopes = full_experiment(coarse, few.bias_V).predict(coarse.probe).slopes @ (found - whole)
    assert np.abs(slopes[2]).max() < 5e-3
    assert np.abs(slopes[0]).max() < 5e-6


def test_rows_of_equal_bias_are_averaged_exactly(ramp):
    bias = np.repeat(np.arange(1.0, 8.0), 1000)
    data = dataclasses.replace(
        ramp,
        bias_V=bias,
        **{
            name: getattr(ramp, name)[: bias.size]
            for name in ("current_mA", "reader_V", "tip_K", "tip_error_K")
        },
    )
    few = averaged(data)
    np.testing.assert_array_equal(np.unique(few.bias_V), np.arange(1.0, 8.0))
    with_tip = np.isfinite(few.tip_K)
    np.testing.assert_array_equal(few.rows[with_tip], 100)
    np.testing.assert_allclose(few.tip_error_K[with_tip], 0.3)
    third = data.current_mA[(bias == 3.0) & np.isfinite(data.tip_K)].mean()
    assert few.current_mA[with_tip][2] == pytest.approx(third, rel=1e-12)


def test_outliers_spoil_no_mean_of_a_robust_fit(ramp):
    spoilt = dataclasses.replace(ramp, current_mA=ramp.current_mA.copy())
    spoilt.current_mA[::500] *= 10.0
    good, robust = averaged(ramp), averaged(spoilt, robust=True)
    assert np.nanmax(robust.current_mA) < 1.01 * np.nanmax(good.current_mA)
    assert np.nanmax(averaged(spoilt).current_mA) > 1.05 * np.nanmax(good.current_mA)


def test_few_rows_and_averages_stay_as_they_are(ramp):
    few = dataclasses.replace(
        ramp,
        **{
            name: values[:2000]
            for name, values in vars(ramp).items()
            if isinstance(values, np.ndarray)
        },
    )
    assert averaged(few) is few
    again = averaged(ramp)
    assert averaged(again) is again


def test_a_fit_of_very_many_rows_says_so_and_is_read_back(coarse, ramp, tmp_path):
    found = fit(ramp, model=lambda probe, bias: full_experiment(coarse.with_probe(probe), bias))
    told = f"{ROWS} rows are averaged to {found.measurement.bias_V.size}"
    assert any(told in note for note in found.notes)
    for name, parameter in found.parameters.items():
        truth = float(coarse.probe.values([name])[0])
        assert abs(parameter.value - truth) < 5 * parameter.stderr
    found.write(tmp_path / "fit.json")
    assert (tmp_path / "fit.json").stat().st_size < 1e6
    back = read_fit(tmp_path / "fit.json")
    np.testing.assert_array_equal(back.measurement.rows, found.measurement.rows)
