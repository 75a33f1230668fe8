"""Fits that vary dimensions and the circuit too, held by what is known of them."""

from __future__ import annotations

import json
import os
from copy import copy
from dataclasses import replace
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.estimate import Measurement, estimator, fit, read_fit
from hotlever.estimate.options import FitOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.residuals import CommonError, Residuals, errors_of_scales
from hotlever.estimate.search import solve
from hotlever.estimate.summary import fit_text
from hotlever.estimate.tip_temperature import tip_by_bias
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, default_priors, priors_of

#: What is asked here is so on any mesh.
pytestmark = pytest.mark.usefixtures("coarse_meshes")

NOMINAL = Probe.reference()
TRUE = NOMINAL.with_(n_d=5.2e17, delta=0.68, heater_length_um=4.12, thickness_um=0.39)


@pytest.fixture(scope="module")
def data():
    """A lever with other dimensions, measured with noise."""
    sweep = Lever(TRUE, COARSE).sweep(np.linspace(0.5, 11.0, 30))
    rng = np.random.default_rng(3)
    nothing = np.full(30, np.nan)
    current = sweep.current_mA.values * (1 + 1e-3 * rng.standard_normal(30))
    return Measurement(sweep.bias.values, current, nothing, nothing, nothing), sweep


@pytest.fixture(scope="module")
def solved(data):
    """A fit with what is usually known, as the problem that it solves."""
    return solve(Problem.of(data[0], NOMINAL, FitOptions(priors=default_priors(NOMINAL))))


@pytest.fixture(scope="module")
def found(data, solved):
    """The same as users are given it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(estimator, "solve", lambda *_, **__: solved)
        return fit(data[0], NOMINAL, priors=default_priors(NOMINAL))


def test_the_tip_is_found_with_an_honest_error(data, found):
    error = np.abs(found.band.tip_K.values - data[1].tip_K.values)
    assert error.max() < 40.0
    assert (error / found.band.tip_stderr_K.values).max() < 3.0
    # the fit with the wrong drawing is sure of something else
    flat = fit(data[0], NOMINAL)
    assert np.abs(flat.band.tip_K.values - data[1].tip_K.values).max() > error.max()


def test_everything_with_a_prior_is_varied_and_stays_near_it(found):
    known = default_priors(NOMINAL)
    assert set(found.names) == set(known)
    for name, prior in known.items():
        one = found.parameters[name]
        assert abs(prior.deviation(one.value)) < 3.0
        assert 0 < one.stderr <= 1.2 * prior.absolute


def test_a_fit_with_priors_is_read_back_whole(found, tmp_path):
    found.write(tmp_path / "fit.json")
    again = read_fit(tmp_path / "fit.json")
    np.testing.assert_allclose(again.covariance, found.covariance, rtol=1e-12)
    assert again.probe == found.probe
    assert again.options.priors == found.options.priors
    assert repr(again) == repr(found)
    assert "heater_length_um" in repr(again)
    use = again.content()["priors"]["heater_length_um"]
    assert (use["value"], use["spread"]) == (4.0, pytest.approx(0.2))
    assert use["posterior_value"] == found.parameters["heater_length_um"].value


def test_a_narrow_prior_is_a_fixed_parameter(data):
    held = Prior(5.2e17, 1e-7)
    narrow = fit(data[0], NOMINAL, priors={**default_priors(NOMINAL), "n_d": held})
    assert narrow.parameters["n_d"].value == pytest.approx(5.2e17, rel=1e-5)
    priors = {name: one for name, one in default_priors(NOMINAL).items() if name != "n_d"}
    fixed = fit(data[0], NOMINAL, priors=priors, fixed={"n_d": 5.2e17})
    np.testing.assert_allclose(fixed.band.tip_K, narrow.band.tip_K, atol=0.5)


def test_the_shares_add_up_to_the_covariance(solved):
    one = solved
    shares = one.posterior.shares
    assert set(shares) == {"measurement", *default_priors(NOMINAL)}
    total = np.sum(list(shares.values()), axis=0)
    scale = np.sqrt(np.diag(one.posterior.covariance))
    np.testing.assert_allclose(
        total / np.outer(scale, scale), one.posterior.covariance / np.outer(scale, scale), atol=1e-6
    )


def test_the_estimate_follows_data_and_scales_as_said(solved):
    """By Gauss and Newton's step after the data have changed by a standard deviation."""
    objective, at, residuals = solved.objective, solved.prediction, solved.residuals
    point = objective.point(at.probe)
    jacobian, before = objective.of_data(at.slopes, point), residuals.weighted(at.values)
    gain = objective.laplace(at.slopes, point) * objective.coordinates.rates(point)[:, None]

    def step(more):
        changed = copy(residuals)
        changed.data = residuals.data + more
        return -gain @ jacobian.T @ (changed.weighted(at.values) - before)

    influences, errors = solved.posterior.influences, residuals.errors
    for number, name in enumerate(residuals.observables):
        more = np.zeros(residuals.data.shape)
        first = np.flatnonzero(residuals.present[number])[0]
        more[number, first] = 1.0 / errors.weights[number, first]
        np.testing.assert_allclose(influences[name][:, 0], step(more), rtol=1e-6)
    for scale in residuals.common:
        more = np.zeros(residuals.data.shape)
        more[residuals.observables.index(scale.observable)] = scale.errors
        # what is known to be shown too large is corrected downwards
        np.testing.assert_allclose(influences[scale.name][:, 0], -step(more), rtol=1e-6)
    assert residuals.common


def test_a_budget_is_within_the_measured_range(solved):
    with pytest.raises(InputError, match=r"at 12 V: expected a bias .* from 0.5 to 11 V"):
        tip_by_bias(solved, at_V=12.0)


def test_how_far_a_prior_is_pulled_is_what_the_others_gain_without_it(solved):
    """Of the linearised estimate, as nearly as a search ends at its optimum."""
    one = solved
    objective, at = one.objective, one.prediction
    scaled = objective.point(at.probe)
    residual, jacobian = (
        objective.residual(at.values, scaled),
        objective.jacobian(at.slopes, scaled),
    )

    def least(rows):
        step = np.linalg.lstsq(jacobian[rows], residual[rows])[0]
        return np.sum((residual[rows] - jacobian[rows] @ step) ** 2)

    every, count = np.arange(residual.size), len(one.problem.options.varied)
    for row, name in enumerate(one.problem.options.varied, start=residual.size - count):
        gained = least(every) - least(np.delete(every, row))
        assert one.posterior.shifts[name].pull ** 2 == pytest.approx(gained, rel=0.05, abs=0.05), (
            name
        )


def test_priors_of_what_does_not_exist_or_is_fixed_are_refused(data):
    with pytest.raises(InputError, match="priors: unknown prior 'heater_um'"):
        fit(data[0], NOMINAL, priors={"heater_um": Prior(1.0, 0.1)})
    with pytest.raises(InputError, match="n_d is fixed and has a prior"):
        FitOptions(fixed={"n_d": None}, priors={"n_d": Prior(5e17, 0.1)})


def test_errors_that_data_share_weigh_as_one():
    """Against the full covariance of the data."""
    bias, nothing = np.linspace(1.0, 5.0, 5), np.full(5, np.nan)
    tip, error = np.linspace(300.0, 700.0, 5), np.full(5, 4.0)
    data = Measurement(bias, nothing, nothing, tip, error)
    shared = 0.02 * (tip - 293.0)
    common = [CommonError("raman_scale", "tip", 0.02, shared)]
    residuals = Residuals(data, ["tip"], "errors", common=common)
    values = np.stack([nothing, nothing, tip + np.array([3.0, -2.0, 1.0, 5.0, -4.0])])
    weighted = residuals.weighted(values)
    covariance = np.diag(error**2) + np.outer(shared, shared)
    difference = values[2] - tip
    assert weighted @ weighted == pytest.approx(
        difference @ np.linalg.solve(covariance, difference)
    )
    slopes = np.zeros((3, 5, 2))
    slopes[2] = np.random.default_rng(0).standard_normal((5, 2))
    jacobian = residuals.jacobian(slopes)
    expected = slopes[2].T @ np.linalg.solve(covariance, slopes[2])
    np.testing.assert_allclose(jacobian.T @ jacobian, expected)
    # the scale as one more unknown
    wide, prior = np.column_stack([slopes[2], shared]) / error[:, None], np.diag([0.0, 0.0, 1.0])
    every = np.linalg.inv(wide.T @ wide + prior)
    own = every[:2, :2]
    np.testing.assert_allclose(own, np.linalg.inv(expected))
    size, left = residuals.in_common(values, slopes, own)["raman_scale"]
    assert left == pytest.approx(np.sqrt(every[2, 2]))
    scale_error = (shared / error**2) @ difference / (1.0 + np.sum((shared / error) ** 2))
    assert size == pytest.approx(-scale_error)


def test_scales_are_as_uncertain_as_priors_say(data):
    """The thermometer is known to 1.5 %, whatever is stated of each temperature."""
    tip = data[1].tip_K.values
    warm = replace(data[0], tip_K=tip, tip_error_K=0.03 * np.maximum(tip - 293.0, 100.0))
    one = solve(Problem.of(warm, NOMINAL, FitOptions(priors=default_priors(NOMINAL))))
    shares = {common.name: common.share for common in one.residuals.common}
    assert shares == {"current_scale": 1e-3, "raman_scale": 0.015}
    of_file = replace(warm, raman_scale=0.03)
    np.testing.assert_allclose(
        errors_of_scales(of_file, ["tip"], {}, 290.0)[0].errors, 0.03 * (tip - 290.0)
    )
    known, base = priors_of({"raman_scale": "± 0.5%"}, NOMINAL, "here"), 290.0
    raman = errors_of_scales(of_file, ["tip"], known, base)[0]
    np.testing.assert_allclose(raman.errors, 0.005 * (tip - base))
    # what the data tell of the scale is said as of any other prior
    use = one.priors["raman_scale"]
    assert (use.value, use.spread) == (1.0, shares["raman_scale"])
    assert 0 < use.posterior_spread < use.spread
    assert abs(use.posterior_value - 1.0) < 3.0 * use.spread


def test_a_probe_file_is_read_once_and_may_be_a_pipe(run, tmp_path):
    """Its priors and the probe itself come from the same bytes."""
    os.mkfifo(tmp_path / "probe.toml")
    text = NOMINAL.to_toml() + '\n[prior]\nn_d = "± 15%"\n'
    writer = Thread(target=(tmp_path / "probe.toml").write_text, args=(text,), daemon=True)
    writer.start()
    data = Path(__file__).parents[2] / "src" / "hotlever" / "examples" / "lever-a.csv"
    status, out, err = run("fit", data, "--probe", "probe.toml", "-o", "fit.json")
    assert status == 0, err
    assert set(read_fit(tmp_path / "fit.json").options.priors) == {"n_d"}
    assert "n_d" in out


def test_doping_known_by_orders_of_magnitude_is_found_and_said_by_its_factor(data):
    """Nominal is a third of the truth: one standard deviation, however it is counted."""
    known = {**default_priors(NOMINAL), "n_d": "1.733e17 ×/ 3"}
    result = fit(data[0], NOMINAL, priors=known)
    value, stderr = result.parameters["n_d"].value, result.parameters["n_d"].stderr
    # with uncertain laws the data tell it to a factor of two
    assert stderr / value < 0.7 * np.log(3.0)
    assert abs(np.log(value / 5.2e17)) < 1.5 * stderr / value
    use = result.priors["n_d"]
    assert use.distribution == "log-normal"
    assert use.spread / use.value == pytest.approx(np.log(3.0))
    assert use.shift == pytest.approx(np.log(value / 1.733e17) / np.log(3.0), rel=1e-12)
    assert result.priors["base_temperature_K"].distribution == "normal"
    away = f"n_d by {use.shift:+.1f} σ"
    assert (away in fit_text(result)) == (abs(use.shift) > 1.0)
    assert result.content()["priors"]["n_d"]["distribution"] == "log-normal"


def test_priors_of_files_that_say_no_distribution_are_read(found, tmp_path):
    content = found.content()
    for use in content["priors"].values():
        del use["distribution"]
    (tmp_path / "old.json").write_text(json.dumps(content))
    assert read_fit(tmp_path / "old.json").priors["n_d"].distribution == "normal"


def test_a_prior_that_does_not_count_is_said_to_have_no_effect(data):
    priors = {"n_d": default_priors(NOMINAL)["n_d"], "gas_conductivity": Prior(1.0, 0.1)}
    note = "priors that do not count in vacuum, and have no effect: gas_conductivity"
    assert note in Problem.of(data[0], NOMINAL, FitOptions(priors=priors)).notes
