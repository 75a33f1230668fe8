"""Sampling densities and fits whose posterior is known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from experiments import reduced_experiment
from hotlever.errors import ComputationError, InputError
from hotlever.estimate import Measurement, fit, uncertainty
from hotlever.estimate.experiment import experiment_of
from hotlever.estimate.objective import inverse_or_nan
from hotlever.estimate.sampling import (
    SampledLever,
    Trials,
    draw_samples,
    predictive_band,
    sample_posterior,
)
from hotlever.estimate.uncertainty import profile_likelihood
from hotlever.lever.lever import COARSE, Lever
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, default_priors

pytestmark = pytest.mark.usefixtures("coarse_meshes")

BIAS = np.linspace(2, 11, 10)
HELD = {"n_d": None, "a0": None, "a1": None}


class Near:
    """Residuals of two parameters, of which every quantity is known."""

    origin = np.zeros(2)

    def __init__(self, residual, jacobian, prior=True, bound=50.0):
        self.residual, self.jacobian = residual, jacobian
        present = np.ones((1, residual(self.origin).size), dtype=bool)
        self.objective = SimpleNamespace(
            bounds=np.array([[-bound, -bound], [bound, bound]]),
            informed=prior,
            of_priors=lambda point: np.zeros((0, 2)),
            log_volume=lambda point: 0.0,
            residuals=SimpleNamespace(present=present),
        )


#: A normal density of two correlated quantities.
MEAN, COVARIANCE = np.array([0.5, 0.2]), np.array([[1.0, 1.5], [1.5, 4.0]])
ROOT = np.linalg.inv(np.linalg.cholesky(COVARIANCE))


def normal(**options):
    return Near(lambda x: ROOT @ (x - MEAN), lambda x: ROOT.copy(), **options)


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
    return sample_posterior(fitted, samples=100, processes=1, noise="common")


def test_a_normal_density_is_found():
    points, effective = draw_samples(Trials(normal()), 1000, seed=1)
    np.testing.assert_array_less(np.abs(points.mean(axis=0) - MEAN), [0.1, 0.2])
    np.testing.assert_allclose(np.cov(points.T), COVARIANCE, rtol=0.15)
    # less than all only for the tails that errors are drawn with
    assert 750 < effective <= 1000


def test_a_bent_density_is_found():
    """Along a parabola y = x² estimates from drawn errors have other moments than the posterior."""

    def residual(x):
        return np.array([x[0], (x[1] - x[0] ** 2) / 0.5, 0.7 * x[1]])

    def jacobian(x):
        return np.array([[1.0, 0.0], [-4.0 * x[0], 2.0], [0.0, 0.7]])

    points, effective = draw_samples(Trials(Near(residual, jacobian)), 1500, seed=1)
    assert effective > 400
    x, y = np.meshgrid(np.linspace(-5, 5, 1001), np.linspace(-5, 20, 2501), indexing="ij")
    density = np.exp(-0.5 * (x**2 + ((y - x**2) / 0.5) ** 2 + (0.7 * y) ** 2))
    for values, sampled_values in ((x**2, points[:, 0] ** 2), (y, points[:, 1])):
        exact = (density * values).sum() / density.sum()
        assert sampled_values.mean() == pytest.approx(exact, rel=0.1)


def test_an_unknown_noise_is_integrated_out():
    """The mean of n data of unknown noise has a Student's t with n − 1 degrees of freedom."""
    data = np.array([1.0, 2.0, 4.0, 3.0, 5.5])

    def residual(x):
        return np.concatenate([x[0] - data, x[1] - data])

    def jacobian(x):
        return np.repeat(np.eye(2), data.size, axis=0)

    near = Near(residual, jacobian, prior=False)
    near.objective.residuals.present = np.ones((2, data.size), dtype=bool)
    found, _ = draw_samples(Trials(near), 1500, seed=1)
    exact = stats.t(data.size - 1, data.mean(), stats.sem(data))
    for points in found.T:
        quantiles = np.percentile(points, (5, 25, 75, 95))
        np.testing.assert_allclose(quantiles, exact.ppf([0.05, 0.25, 0.75, 0.95]), atol=0.2)


def test_what_the_data_leave_open_is_uniform_within_its_bounds():
    def residual(x):
        return np.array([x[0], 0.0])

    near = Near(residual, lambda x: np.diag([1.0, 0.0]), bound=3.0)
    points, _ = draw_samples(Trials(near), 1000)
    assert points[:, 1].std() == pytest.approx(6.0 / np.sqrt(12.0), rel=0.05)
    assert np.abs(points).max() < 3.0


@pytest.mark.slow
def test_the_number_of_processes_does_not_change_the_samples(informed, of_informed):
    two = sample_posterior(informed, samples=150, processes=2)
    for name in informed.names:
        np.testing.assert_allclose(two[name], of_informed[name], rtol=1e-9)


def test_another_seed_gives_other_samples():
    (one, _), (two, _) = (draw_samples(Trials(normal()), 100, seed=seed) for seed in (1, 2))
    assert not np.array_equal(one, two)


def test_a_density_without_a_lever_is_reported():
    nowhere = Near(lambda x: np.full(3, 10.0), lambda x: np.ones((3, 2)))
    with pytest.raises(ComputationError, match="none of 10 trials"):
        draw_samples(Trials(nowhere), 10)


@pytest.mark.parametrize("name", ["samples", "processes"])
def test_impossible_numbers_are_refused(name):
    options = {"count": 10} if name == "processes" else {"count": 0}
    with pytest.raises(InputError, match=f"{name} = 0, expected 1 or more"):
        draw_samples(Trials(normal()), **options, processes=int(name == "samples"))


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


def test_the_surrogate_has_the_slopes_of_its_values_far_away_too(coarse, reduced):
    lever = SampledLever(reduced_experiment(coarse, reduced, BIAS), coarse.probe)
    there = coarse.with_material(coarse.probe.material.with_(n_d=6e17, p=2.8)).probe
    at, change = there.values(reduced.names), np.zeros(len(reduced.names))
    for name, step in (("n_d", 2e14), ("p", 1e-3), ("a1", 1e-9)):
        change[:] = 0.0
        change[reduced.names.index(name)] = step
        after, before = (lever.at.surrogate.values_at(at + way * change) for way in (1.0, -1.0))
        slopes = lever.at.surrogate.predict(at)[1] @ change
        changes = after[:3] - before[:3]
        off = 1e-2 * np.abs(changes).max(axis=1, keepdims=True)
        assert (np.abs(2.0 * slopes[:3] - changes) < off).all()


def test_posterior_agrees_with_the_covariance_of_the_fit(fitted, posterior):
    for name in fitted.names:
        known = fitted.parameters[name]
        assert posterior[name].mean().item() == pytest.approx(known.value, abs=0.4 * known.stderr)
        assert posterior[name].std().item() == pytest.approx(known.stderr, rel=0.25)


def test_posterior_says_how_far_to_trust_it(fitted, posterior):
    assert posterior.sizes == {"draw": 100, "quantity": 4}
    assert posterior.quantity.values.tolist() == [*fitted.names, "inversion_temperature"]
    assert 50 < posterior.effective_sample_size.item() < 100
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
    """A fit of the material, a law and a dimension, with priors, of data with stated errors."""
    true = coarse.probe.with_(n_d=5.3e17, heater_length_um=4.1)
    exact = Measurement.of_sweep(Lever(true, COARSE).sweep(BIAS))
    error = 3e-3 * exact.current_mA
    noisy = exact.current_mA + error * np.random.default_rng(1).normal(size=BIAS.size)
    nothing = np.full(BIAS.size, np.nan)
    data = Measurement(BIAS, noisy, nothing, nothing, nothing, further={"current_error_mA": error})
    stated = ("n_d", "c_kappa", "n_i_1", "heater_length_um", "series_resistance_ohm")
    priors = {name: default_priors(coarse.probe)[name] for name in stated}
    return fit(data, coarse.probe, priors=priors, fixed={"a0": None, "a1": None})


@pytest.fixture(scope="module")
def of_informed(informed):
    return sample_posterior(informed, samples=150, processes=1)


def test_the_posterior_of_a_fit_with_priors_agrees_with_its_covariance(informed, of_informed):
    assert {"heater_length_um", "series_resistance_ohm"} < set(informed.names)
    posterior = of_informed
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


def test_the_inversion_temperature_of_a_sample_is_that_of_its_laws_too(informed, of_informed):
    drawn = of_informed[informed.names].to_dataframe()
    for draw in np.argsort(of_informed.n_i_1.values)[[0, 75, 149]]:
        silicon = informed.probe.with_(**drawn.iloc[draw]).heater_silicon
        own = of_informed.inversion_temperature.values[draw]
        # by the laws to first order, of a temperature that is known to 14 K
        assert own == pytest.approx(float(silicon.inversion_temperature()), abs=2.5)


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
    fit = SimpleNamespace(probe=Probe.reference(), parameters={"n_d": fitted}, known={"n_d": known})
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
