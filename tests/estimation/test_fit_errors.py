"""Measurement errors as weights of a fit, and what its standard errors are worth."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from fit_twins import BIAS, TRUTH, twin

from hotlever.errors import InputError
from hotlever.estimate import Estimate, FitOptions, fit
from hotlever.estimate.diagnosis import Diagnosis
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import solve
from hotlever.probe.priors import default_priors


def with_errors(measurement, current=None, reader=None, tip=None):
    size = measurement.bias_V.size

    def column(value):
        return np.full(size, np.nan if value is None else value)

    return dataclasses.replace(
        measurement,
        further={"current_error_mA": column(current), "reader_error_V": column(reader)},
        tip_error_K=column(tip),
    )


def test_measurement_errors_weigh_the_data(coarse, coarse_fast, monkeypatch):
    # a reader that does not count contradicts the lever; why, is not what is asked here
    monkeypatch.setattr(Diagnosis, "named", lambda _: "")
    measurement = twin(coarse, noise=0.003)
    trusted = with_errors(measurement, current=1e-3, reader=0.3, tip=600.0)
    # what a current alone hardly tells is held
    options = {"fixed": {"n_d": TRUTH["n_d"], "a1": None}, "model": coarse_fast}
    result = fit(trusted, coarse.probe, weights="errors", **options)
    alone = fit(measurement, coarse.probe, observables=["current"], **options)
    assert result.residual_rms["current_mA"] == pytest.approx(
        alone.residual_rms["current_mA"], rel=1e-3
    )
    assert any("times the measurement errors" in note for note in result.notes)


def test_without_measurement_errors_the_scatter_takes_their_place(coarse, coarse_fast):
    measurement = twin(coarse, noise=0.003)
    weighed = fit(measurement, coarse.probe, weights="errors", model=coarse_fast)
    scatter = {
        name: weighed.residual_rms[column]
        for name, column in (("current", "current_mA"), ("reader", "reader_V"), ("tip", "tip_K"))
    }
    again = fit(
        with_errors(measurement, **scatter), coarse.probe, weights="errors", model=coarse_fast
    )
    for name, parameter in weighed.parameters.items():
        assert abs(again.parameters[name].value - parameter.value) < 0.1 * parameter.stderr


def test_some_missing_measurement_errors_are_an_error(coarse, coarse_fast):
    measurement = with_errors(twin(coarse, noise=0.003), tip=5.0)
    measurement.tip_error_K[3] = np.nan
    with pytest.raises(InputError, match=r"tip has no error above 0 at 3\.5 V"):
        fit(measurement, coarse.probe, weights="errors", model=coarse_fast)


def test_unknown_weights_are_an_error(coarse):
    with pytest.raises(InputError, match="did you mean 'errors'"):
        fit(twin(coarse), coarse.probe, weights="error")


def test_standard_errors_follow_the_noise_of_each_observable(coarse, coarse_fast):
    # a reader a hundred times as noisy widens the resistivity, not the heater's parameters
    quiet = twin(coarse, noise=1e-4)
    rng = np.random.default_rng(3)
    noise = 1e-2 * np.nanmax(quiet.reader_V) * rng.normal(size=quiet.bias_V.size)
    noisy = dataclasses.replace(quiet, reader_V=quiet.reader_V + noise)
    before = fit(quiet, coarse.probe, model=coarse_fast).parameters
    after = fit(noisy, coarse.probe, model=coarse_fast).parameters
    assert after["a0"].stderr > 20.0 * before["a0"].stderr
    assert after["p"].stderr / after["p"].value < after["a0"].stderr / after["a0"].value


@pytest.mark.slow
def test_the_band_is_the_spread_of_repeated_experiments(coarse, coarse_fast):
    """Fits of data with new noise each scatter in tip temperature as the band says."""
    tips, errors = [], []
    for seed in range(8):
        band = fit(twin(coarse, noise=2e-3, seed=seed), model=coarse_fast).band
        tips.append(band.tip_K.values)
        errors.append(band.tip_stderr_K.values)
    hot = BIAS > 6
    ratio = np.std(tips, axis=0)[hot].mean() / np.mean(errors, axis=0)[hot].mean()
    # eight fits know a spread to 27 %
    assert 0.6 < ratio < 1.6


def test_noise_gives_errors_of_its_size(noisy_fit):
    for name, fitted in noisy_fit.parameters.items():
        assert fitted.stderr is not None
        assert abs(fitted.value - TRUTH[name]) < 4 * fitted.stderr
    assert np.allclose(np.diag(noisy_fit.correlation), 1.0)
    assert np.allclose(noisy_fit.correlation, noisy_fit.correlation.T)
    assert 0 < noisy_fit.inversion_temperature_stderr_K < 60


def test_data_with_stated_errors_are_no_better_than_the_model_where_priors_count(
    coarse, coarse_fast
):
    """They were: a current to 1e-4 tied parameters as if the laws were exactly the lever's."""
    measured = twin(coarse, noise=1e-4)
    largest = np.nanmax(measured.current_mA)
    data = with_errors(measured, current=1e-4 * largest)
    stated = ("n_d", "c_kappa", "delta", "a0")
    priors = {name: default_priors(coarse.probe)[name] for name in stated}
    options = FitOptions(observables=["current"], priors=priors)
    solution = solve(Problem.of(data, coarse.probe, options, model=coarse_fast))
    assert solution.converged
    assert (solution.residuals.errors.scale >= 5e-4 * largest).all()


def test_the_inversion_temperature_follows_all_that_its_law_depends_on(coarse):
    """Of a fit with uncertain laws it had the error by doping and p alone, 25 K for 14 K."""
    names = ["n_d", "c_kappa", "p", "n_i_1", "mobility_1", "intrinsic_scale"]
    probe = coarse.probe.with_(n_i_1=0.4, mobility_1=-0.3)
    found = Estimate(
        probe=probe, measurement=twin(coarse), names=names, covariance=np.zeros((6, 6))
    )

    def inversion_K(name, value):
        return float(probe.with_(**{name: value}).heater_silicon.inversion_temperature())

    for name, slope in zip(names, found.inversion_temperature_slopes_K, strict=True):
        value = probe.values([name]).item()
        step = 1e-3 * abs(value)
        moved = inversion_K(name, value + step) - inversion_K(name, value - step)
        assert slope == pytest.approx(moved / (2.0 * step), rel=1e-3)
    assert found.inversion_temperature_slopes_K.astype(bool).tolist() == [
        name != "c_kappa" for name in names
    ]
