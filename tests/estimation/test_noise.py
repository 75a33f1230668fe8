"""How noise goes with the size of what is shown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hotlever.estimate.residuals import CommonError, Residuals, relative_noise
from hotlever.measurement import Measurement

TRUTH = np.linspace(0.05, 1.5, 40)
NOTHING = np.zeros(TRUTH.size)
USUAL = 1e-3 * TRUTH.max()


def noise(seed, size):
    return size * np.random.default_rng(seed).standard_normal(TRUTH.size)


def mean_of_levers(size):
    """Return what the noise of 40 measurements is taken for, in the mean."""
    return np.mean([relative_noise(noise(n, size), TRUTH, NOTHING, USUAL) for n in range(40)], 0)


def test_noise_in_proportion_is_recognised():
    found = mean_of_levers(2e-3 * TRUTH)
    expected = TRUTH / np.sqrt(np.mean(TRUTH**2))
    # where there is next to no current, some of it may be the same everywhere
    np.testing.assert_allclose(found[8:], expected[8:], rtol=0.1)


def test_noise_that_is_the_same_everywhere_is_recognised():
    np.testing.assert_allclose(mean_of_levers(2e-3), 1.0, atol=0.15)


@pytest.mark.parametrize("place", [2, 37])
def test_outliers_do_not_tell_how_noise_goes(place):
    clean = noise(1, 2e-3 * TRUTH)
    spoilt = clean.copy()
    spoilt[place] = 50 * 2e-3 * TRUTH[place]
    found, expected = (relative_noise(one, TRUTH, NOTHING, USUAL) for one in (spoilt, clean))
    np.testing.assert_allclose(found[4:], expected[4:], rtol=0.25)


def test_what_a_fit_has_taken_up_counts_as_noise():
    """The last ten residuals are half of the noise that was there."""
    leverage = np.where(np.arange(TRUTH.size) < 30, 0.0, 0.75)
    whole = [noise(n, 2e-3) for n in range(40)]
    left = [difference * np.sqrt(1 - leverage) for difference in whole]
    found = [relative_noise(one, TRUTH, leverage, USUAL) for one in left]
    expected = [relative_noise(one, TRUTH, NOTHING, USUAL) for one in whole]
    np.testing.assert_allclose(found, expected)


def test_rows_without_data_have_no_noise_of_their_own():
    difference = noise(3, 2e-3 * TRUTH)
    difference[5:9] = np.nan
    found = relative_noise(difference, TRUTH, NOTHING, USUAL)
    assert np.all(found[5:9] == 1.0)
    some = np.isfinite(difference)
    np.testing.assert_allclose(
        found[some], relative_noise(difference[some], TRUTH[some], NOTHING[some], USUAL)
    )
    assert np.mean(found[some] ** 2) == pytest.approx(1.0)


def residuals_of(current):
    """Return the residuals of a measurement whose current is predicted as shown."""
    nothing = np.full(TRUTH.size, np.nan)
    measurement = Measurement(np.arange(1.0, 41.0), current, nothing, nothing, nothing)
    residuals = Residuals(measurement, ("current",), "errors")
    predicted_current = TRUTH[np.isfinite(current)]
    predicted = np.stack([predicted_current, predicted_current, predicted_current])
    for _ in range(3):
        residuals.take_scatter(predicted, discrepancy=1e-6)
    return residuals, predicted


def test_noise_of_large_data_makes_no_outliers_of_them():
    currents = [TRUTH + noise(n, 2e-3 * TRUTH) for n in range(40)]
    found = [residuals_of(current) for current in currents]
    assert (
        np.mean(
            [
                residuals.errors.has_outliers(residuals.difference(predicted))
                for residuals, predicted in found
            ]
        )
        < 0.1
    )
    # each datum has the weight that its own noise gives it
    weights = np.mean([residuals.errors.weights[0] for residuals, _ in found], axis=0)
    np.testing.assert_allclose(weights[8:] * 2e-3 * TRUTH[8:], 1.0, atol=0.12)


def test_an_outlier_is_one():
    spoilt = TRUTH + noise(4, 2e-3 * TRUTH)
    spoilt[30] *= 1.02
    residuals, predicted = residuals_of(spoilt)
    assert residuals.errors.has_outliers(residuals.difference(predicted))


def test_what_is_smooth_is_no_noise():
    """A current that bends away from the prediction by a tenth has noise of a thousandth."""
    bent = TRUTH + 0.1 * TRUTH.max() * np.sin(np.linspace(0.0, np.pi, TRUTH.size))
    wrong, _ = residuals_of(bent + noise(5, 1e-3 * TRUTH.max()))
    assert np.sqrt(np.mean(wrong.errors.weights**-2.0)) < 6e-3 * TRUTH.max()
    # and noise is counted in full
    right, _ = residuals_of(TRUTH + noise(5, 0.05 * TRUTH.max()))
    assert np.sqrt(np.mean(right.errors.weights**-2.0)) > 0.04 * TRUTH.max()


def test_what_the_scale_of_a_meter_explains_is_no_noise():
    """A good meter: noise of 1e-4, and a scale that is off by five times as much."""
    current = TRUTH * (1.0 + 5e-4) + noise(6, 1e-4 * TRUTH)
    measurement = Measurement(np.arange(1.0, 41.0), current, *3 * [np.full(TRUTH.size, np.nan)])
    common = [CommonError("current_scale", "current", 1e-3, 1e-3 * TRUTH)]
    residuals = Residuals(measurement, ("current",), "errors", common=common)
    predicted = np.stack([TRUTH, TRUTH, TRUTH])
    slopes = (TRUTH**2)[None, :, None]
    covariance = np.array([[1e-8]])
    for _ in range(3):
        leverage = residuals.leverage(residuals.jacobian(slopes), covariance)
        residuals.take_scatter(predicted, leverage, discrepancy=1e-6)
    assert residuals.errors.scale[0, 20:] / (1e-4 * TRUTH[20:]) == pytest.approx(1.0, abs=0.25)
    # the share of noise that is taken up, by the covariance of all that data are made of
    weights = residuals.errors.weights[0]
    pattern, by = weights * common[0].errors, weights * slopes[0, :, 0]
    without = np.eye(TRUTH.size) + np.outer(pattern, pattern)
    prior = 1.0 / (1.0 / covariance[0, 0] - by @ np.linalg.solve(without, by))
    whole = without + prior * np.outer(by, by)
    leverage = residuals.leverage(residuals.jacobian(slopes), covariance)
    np.testing.assert_allclose(leverage[0], 1.0 - np.diag(np.linalg.inv(whole)), rtol=1e-6)


@pytest.mark.parametrize("stated", [None, 1e-4])
def test_no_data_are_better_than_the_model(stated):
    """Nor are means of many rows, or what lies on a prediction by chance."""
    current, count = TRUTH + noise(7, 1e-5 * TRUTH), TRUTH.size
    nothing = np.full(count, np.nan)
    measurement = Measurement(np.arange(1.0, 41.0), current, nothing, nothing, nothing)
    if stated is not None:
        stated_mA = np.full(count, stated * TRUTH[-1])
        measurement = replace(measurement, further={"current_error_mA": stated_mA})
    measurement = replace(measurement, rows=np.full(count, 100))
    residuals = Residuals(measurement, ("current",), "errors")
    residuals.take_scatter(np.stack([TRUTH, TRUTH, TRUTH]), discrepancy=5e-4)
    share = np.sqrt(np.mean(residuals.errors.scale**2)) / TRUTH[-1]
    assert share == pytest.approx(np.hypot(5e-4, stated or 0.0), rel=0.01)


@pytest.mark.parametrize("rows", [1, 25])
def test_a_misfit_is_no_noise_of_means_of_many_rows_either(rows):
    """It was taken for as many times the noise as there are rows."""
    own = noise(3, 2e-3) / np.sqrt(rows)
    bias, nothing = np.arange(1.0, 41.0), np.full(TRUTH.size, np.nan)
    data = Measurement(bias, TRUTH + own + 0.02 * np.sin(bias / 12.0), *3 * [nothing])
    data = replace(data, rows=None if rows == 1 else np.full(TRUTH.size, float(rows)))
    errors = Residuals(data, ("current",)).errors
    squares = errors.noise_squares((data.current_mA - TRUTH)[None])
    assert squares == pytest.approx(np.mean((errors.weights * own) ** 2), rel=0.5)


def test_degrees_of_freedom_are_those_of_what_is_estimated():
    """Half of a variance that is a scatter makes four times as many (Welch, Satterthwaite)."""
    current = TRUTH + noise(7, 2e-3 * TRUTH[-1])
    measurement = Measurement(np.arange(1.0, 41.0), current, *3 * [np.full(TRUTH.size, np.nan)])
    residuals, leverage = Residuals(measurement, ("current",), "errors"), np.zeros((1, TRUTH.size))
    scatter = np.sqrt(np.mean((current - TRUTH) ** 2)) / current.max()
    for discrepancy, factor in ((1e-6, 1.0), (scatter, 4.0)):
        residuals.take_scatter(np.stack([TRUTH, TRUTH, TRUTH]), discrepancy=discrepancy)
        dof = residuals.errors.degrees_of_freedom(leverage)
        assert dof == pytest.approx(factor * TRUTH.size, rel=0.05)


def test_scatter_is_compared_with_what_was_stated_and_by_what_is_left_free():
    """A discrepancy is no scatter, and parameters with priors take up less than a datum each."""
    sd, nothing = 1e-4 * TRUTH[-1], np.full(TRUTH.size, np.nan)
    current = TRUTH + noise(7, sd)
    further = {"current_error_mA": np.full(TRUTH.size, sd)}
    data = Measurement(np.arange(1.0, 41.0), current, *3 * [nothing], further=further)
    residuals = Residuals(data, ("current",), "errors")
    residuals.take_scatter(np.stack([TRUTH, TRUTH, TRUTH]), discrepancy=5e-4)
    leverage = np.full((1, TRUTH.size), 0.25)
    found = residuals.errors.reduced_chi_square((current - TRUTH)[None], leverage)
    squares = np.sum(((current - TRUTH) / sd) ** 2)
    assert found == pytest.approx(squares / (0.75 * TRUTH.size), rel=1e-6)


def test_the_discrepancy_of_a_model_falls_out_of_differences():
    """Of rows in contact and away from it, that is; rows in contact alone have all of it."""
    nothing = np.full(TRUTH.size, np.nan)
    measurement = Measurement(np.arange(1.0, 41.0), TRUTH, nothing, nothing, nothing)
    shares = []
    for away in (0.0, 1.0):
        distance = np.where(np.arange(TRUTH.size) % 2, away, 0.0)
        residuals = Residuals(replace(measurement, distance_um=distance), ("current",), "errors")
        residuals.take_scatter(np.stack([TRUTH, TRUTH, TRUTH]), discrepancy=5e-4)
        shares.append(np.sqrt(np.mean(residuals.errors.scale**2)) / TRUTH[-1])
    assert shares == pytest.approx([5e-4, 2.5e-5], rel=0.01)
