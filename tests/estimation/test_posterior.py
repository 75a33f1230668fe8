"""Sampling densities and fits whose posterior is known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from experiments import reduced_experiment
from hotlever.errors import ComputationError, InputError
from hotlever.estimate import Measurement, fit, uncertainty
from hotlever.estimate.chains import Gaussian, effective_sample_size, sample, split_rhat
from hotlever.estimate.experiment import experiment_of
from hotlever.estimate.objective import inverse_or_nan
from hotlever.estimate.profile import profile_likelihood
from hotlever.estimate.sampling import SampledLever, predictive_band, sample_posterior
from hotlever.lever.lever import COARSE, Lever
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, default_priors

pytestmark = pytest.mark.usefixtures("coarse_meshes")

BIAS = np.linspace(2, 11, 10)
HELD = {"n_d": None, "a0": None, "a1": None}


class Normal:
    """A normal density of two correlated quantities, the first cut off below zero."""

    mean = np.array([5.0, 2.0])
    covariance = np.array([[1.0, 1.5], [1.5, 4.0]])

    def log_probability(self, point):
        if point[0] < 0:
            return -np.inf
        away = point - self.mean
        return float(-0.5 * away @ np.linalg.solve(self.covariance, away))


class Nowhere:
    def log_probability(self, point):
        return -np.inf


#: Neither the place nor the width of `Normal`.
ROUGH = Gaussian(np.array([4.5, 2.5]), np.diag([2.0, 3.0]))


@pytest.fixture(scope="module")
def fitted(lever):
    """A fit of data with equal noise on every scaled residual, as its errors assume."""
    exact = Measurement.of_sweep(lever.sweep(BIAS))
    rng = np.random.default_rng(3)
    noisy = {
        name: values + 2e-3 * values.max() * rng.normal(size=BIAS.size)
        for name, values in vars(exact).items()
        if name in ("current_mA", "reader_V", "tip_K")
    }
    return fit(Measurement(**{**vars(exact), **noisy}), fixed=HELD)


@pytest.fixture(scope="module")
def posterior(fitted):
    return sample_posterior(fitted, samples=640, walkers=8, processes=1, noise="common")


def test_a_known_normal_density_is_found():
    chains = sample(Normal().log_probability, ROUGH, samples=20_000, walkers=20, seed=1)
    points = chains.points.reshape(-1, 2)
    assert points.mean(axis=0) == pytest.approx(Normal.mean, abs=0.15)
    np.testing.assert_allclose(np.cov(points.T), Normal.covariance, rtol=0.12)
    first = np.swapaxes(chains.points[..., 0], 1, 2).reshape(4, -1)
    assert split_rhat(first) < 1.02
    assert effective_sample_size(chains.points[..., 0].reshape(80, -1)) > 1000


def test_the_number_of_processes_does_not_change_the_samples():
    one, two = (
        sample(Normal().log_probability, ROUGH, samples=400, walkers=8, seed=2, processes=processes)
        for processes in (1, 2)
    )
    np.testing.assert_array_equal(one.points, two.points)


def test_another_seed_gives_other_samples():
    one, two = (
        sample(Normal().log_probability, ROUGH, samples=100, walkers=8, seed=seed)
        for seed in (1, 2)
    )
    assert not np.array_equal(one.points, two.points)


def test_a_density_without_a_place_to_start_is_reported():
    with pytest.raises(ComputationError, match="only 0 of 400 starting points"):
        sample(Nowhere().log_probability, ROUGH, samples=10, walkers=8)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"samples": 0}, "samples = 0, expected 1 or more"),
        ({"walkers": 3}, "walkers = 3, expected 4 or more"),
        ({"processes": 0}, "processes = 0, expected 1 or more"),
    ],
)
def test_impossible_numbers_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        sample(Normal().log_probability, ROUGH, **{"samples": 10, "walkers": 8, **options})


def test_rhat_sees_chains_that_differ_in_place_or_in_width():
    draws = np.random.default_rng(0).normal(size=(4, 2000))
    assert split_rhat(draws) == pytest.approx(1.0, abs=0.005)
    assert split_rhat(draws + np.arange(4)[:, None]) > 1.3
    assert split_rhat(draws * np.array([1, 1, 1, 4])[:, None]) > 1.1
    assert split_rhat(draws + np.linspace(0, 3, 2000)) > 1.2


def test_chains_of_what_is_held_agree():
    """Without n_d and p among what is varied, the inversion temperature is one number."""
    assert split_rhat(np.full((4, 100), 830.0)) == 1.0
    assert split_rhat(np.repeat([[830.0], [831.0]], 100, axis=1)) > 100.0


def test_effective_sample_size_of_an_autoregressive_chain():
    """x' = φ x + noise has (1 − φ) / (1 + φ) effective draws for each."""
    rng, phi = np.random.default_rng(0), 0.8
    chains = np.empty((8, 5000))
    chains[:, 0] = rng.normal(size=8) / np.sqrt(1 - phi**2)
    for step in range(1, 5000):
        chains[:, step] = phi * chains[:, step - 1] + rng.normal(size=8)
    assert effective_sample_size(chains) == pytest.approx(chains.size / 9, rel=0.1)
    assert effective_sample_size(rng.normal(size=(8, 5000))) == pytest.approx(40_000, rel=0.1)


def sampled(coarse, reduced, bias=BIAS):
    """The reduced lever as samples see it, and what it shows of a material."""
    lever = SampledLever(reduced_experiment(coarse, reduced, bias), coarse.probe)
    values_at, names = lever.at.surrogate.values_at, tuple(PARAMETERS)
    return lambda material: values_at(coarse.with_material(material).probe.values(names))


def test_the_surrogate_shows_nearby_what_the_full_lever_does(coarse, reduced):
    there = coarse.probe.material.with_(c_kappa=0.70, p=2.70)
    exact = coarse.with_material(there).sweep(BIAS)
    current, reader, tip, _ = sampled(coarse, reduced)(there)
    np.testing.assert_allclose(current, exact.current_mA, rtol=2e-4)
    np.testing.assert_allclose(reader, exact.reader_V, rtol=2e-4)
    np.testing.assert_allclose(tip, exact.tip_K, atol=0.2)


def test_the_surrogate_is_exact_at_its_own_material_in_any_order_of_bias(coarse, reduced):
    bias = np.array([9.0, 3.0, 9.0, 0.0])
    exact = coarse.sweep(bias)
    tip = sampled(coarse, reduced, bias)(coarse.probe.material)[2]
    np.testing.assert_allclose(tip, exact.tip_K, atol=0.02)


def test_the_surrogate_serves_far_away_too(coarse, reduced):
    there = coarse.probe.material.with_(c_kappa=1.0, n_d=6e17, p=2.8)
    exact = coarse.with_material(there).sweep(BIAS)
    np.testing.assert_allclose(sampled(coarse, reduced)(there)[2], exact.tip_K, atol=5.0)


def test_posterior_agrees_with_the_covariance_of_the_fit(fitted, posterior):
    for name in fitted.names:
        known = fitted.parameters[name]
        assert posterior[name].mean().item() == pytest.approx(known.value, abs=0.4 * known.stderr)
        assert posterior[name].std().item() == pytest.approx(known.stderr, rel=0.25)


def test_posterior_says_how_far_to_trust_it(fitted, posterior):
    assert posterior.sizes == {"chain": 32, "draw": 20, "quantity": 4}
    assert posterior.quantity.values.tolist() == [*fitted.names, "inversion_temperature"]
    assert float(posterior.rhat.max()) < 1.1
    assert float(posterior.effective_sample_size.min()) > 100
    assert 0.3 < float(posterior.acceptance_fraction) < 1
    assert posterior.attrs["fixed"].startswith("n_d = ")
    for variable in posterior.data_vars.values():
        assert {"units", "long_name"} <= set(variable.attrs)


def test_an_unknown_noise_is_refused(fitted):
    with pytest.raises(InputError, match="noise = 'none', expected 'each' or 'common'"):
        sample_posterior(fitted, noise="none")


def test_band_holds_the_fit_and_rises_with_power(fitted, lever, posterior):
    band = predictive_band(fitted, posterior, bias=BIAS, samples=40)
    low, _, middle, _, high = band.tip_K.values
    best = lever.with_material(fitted.probe.material).sweep(BIAS).tip_K.values
    assert (low < best).all()
    assert (best < high).all()
    assert (np.diff(middle) > 0).all()
    assert (np.diff(band.tip_at_power_K.values) > 0).all()
    for name in ("tip_K", "tip_at_power_K", "bias", "power_mW", "quantile"):
        assert {"units", "long_name"} <= set(band[name].attrs)


@pytest.fixture(scope="module")
def informed(coarse):
    """A fit of the material and a dimension, with priors, of data with stated errors."""
    true = coarse.probe.with_(n_d=5.3e17, heater_length_um=4.1)
    exact = Measurement.of_sweep(Lever(true, COARSE).sweep(BIAS))
    error = 3e-3 * exact.current_mA
    noisy = exact.current_mA + error * np.random.default_rng(1).normal(size=BIAS.size)
    nothing = np.full(BIAS.size, np.nan)
    data = Measurement(BIAS, noisy, nothing, nothing, nothing, current_error_mA=error)
    stated = ("n_d", "c_kappa", "heater_length_um", "series_resistance_ohm")
    priors = {name: default_priors(coarse.probe)[name] for name in stated}
    return fit(data, coarse.probe, priors=priors, fixed={"a0": None, "a1": None})


def test_the_posterior_of_a_fit_with_priors_agrees_with_its_covariance(informed):
    assert {"heater_length_um", "series_resistance_ohm"} < set(informed.names)
    posterior = sample_posterior(informed, samples=1200, walkers=12, processes=1)
    for name in ("n_d", "c_kappa", "heater_length_um", "series_resistance_ohm"):
        known = informed.parameters[name]
        assert posterior[name].mean().item() == pytest.approx(known.value, abs=0.4 * known.stderr)
        assert posterior[name].std().item() == pytest.approx(known.stderr, rel=0.3)
        assert {"units", "long_name"} <= set(posterior[name].attrs)
    assert posterior.attrs["surrogate_error_K"] < 10.0
    band = predictive_band(informed, posterior, bias=BIAS, samples=100)
    low, _, _, _, high = band.tip_K.values
    stderr = informed.band.tip_stderr_K.values
    np.testing.assert_allclose((high - low) / 3.92, stderr, rtol=0.5, atol=0.3)


def test_a_profile_counts_priors(informed):
    """Where data hardly tell, it is the prior's parabola."""
    profile = profile_likelihood(informed, "series_resistance_ohm", points=5)
    np.testing.assert_allclose(profile.delta_chi_square, profile.parabola, rtol=0.3, atol=0.2)


def test_other_probes_are_predicted_by_powers_nearly_as_they_are_solved(coarse):
    names = ("n_d", "heater_length_um", "base_temperature_K")
    lever = SampledLever(experiment_of(coarse.probe, BIAS, names=names), coarse.probe)
    there = coarse.probe.with_(n_d=5.5e17, heater_length_um=4.1, base_temperature_K=295.0)
    exact, values_at = Lever(there).sweep(BIAS).tip_K.values, lever.at.surrogate.values_at
    assert np.abs(values_at(there.values(names))[2] - exact).max() < 2.0
    assert lever.error_K(there) < 2.0


def test_what_was_known_to_a_factor_is_compared_in_logarithms():
    """Half as much again as was known: in its unit the posterior is as wide as the prior."""
    known = Prior(1e18, np.log(1.5))
    fitted = SimpleNamespace(value=1.5e18, stderr=4.5e17)
    fit = SimpleNamespace(
        probe=Probe.reference(), parameters={"n_d": fitted}, stated_priors={"n_d": known}
    )
    normal = np.random.default_rng(0).standard_normal(4000)
    statement = "n_d is as known before: these data do not tell"
    assert statement not in uncertainty._about(fit, "n_d", 1.5e18 * np.exp(0.30 * normal))
    assert statement in uncertainty._about(fit, "n_d", 1.5e18 * np.exp(0.39 * normal))


def test_data_that_determine_fewer_parameters_have_no_covariance():
    """The matrix of six parameters that only two of them count in has an inverse by rounding."""
    random = np.random.default_rng(5)
    full, two = (
        random.normal(size=(33, 6)),
        random.normal(size=(33, 2)) @ random.normal(size=(2, 6)),
    )
    np.testing.assert_allclose(inverse_or_nan(full.T @ full) @ full.T @ full, np.eye(6), atol=1e-9)
    assert np.isnan(inverse_or_nan(two.T @ two)).all()
