"""Levers drawn from what is known of one are such levers, and as likely as trials have them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hotlever.estimate import calibrate
from hotlever.estimate.experiment import TIP, ExperimentAtRest
from hotlever.estimate.likely_levers import DrawOptions, LikelyLevers
from hotlever.estimate.next_measurement import LinearisedLever, hottest_tips
from hotlever.estimate.objective import Subproblem
from hotlever.estimate.options import CalibrationOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.sampling import Trials, draw_samples
from hotlever.estimate.search import solve
from hotlever.estimate.surrogate import Rows
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.probe import Probe

pytestmark = pytest.mark.usefixtures("coarse_meshes")


@pytest.fixture(scope="module")
def below_the_knee(coarse):
    """A sweep that ends where the tip gets steep, so that what is known of it is bent."""
    bias = np.linspace(0.5, 7.5, 15)
    noise = 1.0 + 2e-3 * np.random.default_rng(1).standard_normal(bias.size)
    nothing = np.full(bias.size, np.nan)
    current = coarse.sweep(bias).current_mA.values * noise
    return Measurement(bias, current, nothing, nothing, nothing, medium="vacuum")


@pytest.fixture(scope="module")
def known(below_the_knee):
    return LinearisedLever.of_calibration(calibrate(below_the_knee))


@pytest.fixture(scope="module")
def beyond_the_knee(coarse):
    """What is known where rows follow closely upon each other, and tell most."""
    bias = np.append(np.linspace(1.0, 8.5, 19), [8.58, 8.65, 8.7, 8.75])
    there, nothing = coarse.sweep(bias), np.full(bias.size, np.nan)
    noise = 1.0 + 1e-3 * np.random.default_rng(3).standard_normal((2, bias.size))
    current, reader = (there.current_mA.values, there.reader_V.values) * noise
    data = Measurement(bias, current, reader, nothing, nothing, medium="vacuum")
    return LinearisedLever.of_calibration(calibrate(data))


def test_enough_of_them_count_also_where_rows_tell_most(beyond_the_knee):
    likely = beyond_the_knee.likely
    assert not likely.first_order
    # no place of the grid may hold up the search
    finer = LikelyLevers(
        likely._surrogate,
        likely._coordinates,
        likely._known,
        replace(likely._options, places=2 * likely._options.places),
    )
    bias, shares = np.array([6.0, 8.75]), np.array([0.01, 0.5, 0.99])
    assert finer.quantiles(bias, shares) == pytest.approx(likely.quantiles(bias, shares), abs=1.0)


def test_where_too_few_count_the_tip_may_be_as_hot_as_either_way_says(known):
    few = LikelyLevers(
        known.likely._surrogate,
        known.likely._coordinates,
        known.likely._known,
        DrawOptions(count=100),
    )
    assert few.first_order
    bias = np.array([7.5])
    tip, slopes = known.tip(bias)
    tangent = tip + 2.32 * known.information.stderr(slopes)
    assert hottest_tips(known, bias, few) >= tangent
    assert hottest_tips(known, bias, known.likely) < tangent


def test_a_step_that_leads_far_too_far_shows_nothing(known):
    """A ramp of a right lever ended with an internal error, where one overflowed."""
    likely = known.likely
    size = likely._known.before.shape[1]
    shown, by = likely._residuals(np.outer([0.0, 1.0, 1e3, np.inf, np.nan], np.ones(size)))
    assert np.isfinite(shown).all(axis=1).tolist() == [True, True, False, False, False]
    assert np.isfinite(by).all()


@pytest.mark.parametrize("of_priors", [True, False])
def test_the_tips_are_those_of_the_levers_that_were_drawn(known, of_priors):
    lever = LinearisedLever.of_priors(Probe.reference()) if of_priors else known
    bias, likely = np.array([2.0, 5.0, 7.0]), lever.likely
    surrogate, points = lever.surrogate.reading(Rows(bias)), likely._drawn.points
    for tips, point in zip(likely.tips(bias)[:5], points[:5], strict=True):
        own = surrogate.values_at(lever.parameters(point))[TIP]
        assert tips == pytest.approx(own, abs=0.1)


def test_rows_that_are_measured_yet_make_the_levers_more_alike(known):
    bias = np.array([7.5])
    _, slopes = known.tip(bias)
    much = known.likely_after(slopes / 5.0).band(bias)
    assert np.ptp(much) < 0.5 * np.ptp(known.likely.band(bias))


@pytest.mark.slow
def test_they_are_as_likely_as_trials_of_the_posterior_say(below_the_knee, known):
    """Trials draw the same errors one by one, with levers of their own surrogate."""
    fast = SimilarLevers(Lever(Probe.reference(), COARSE))

    def until_it_melts(probe, bias):
        # else there are no levers that are hotter than the branch is long
        return ExperimentAtRest(fast, None, bias, (), until_it_melts=True)

    options = CalibrationOptions().of_lever
    problem = Problem.of(below_the_knee, Probe.reference(), options, model=until_it_melts)
    solution = solve(problem)
    near = Subproblem(solution.objective, solution.prediction)
    points, _ = draw_samples(Trials(near), 800)
    tips = [near.values_at(point)[TIP, -1] for point in points]
    shares, last_V = np.array([0.025, 0.5, 0.975, 0.99]), below_the_knee.bias_V[-1:]
    ours = known.likely.quantiles(last_V, shares)[:, 0]
    assert ours == pytest.approx(np.quantile(tips, shares), abs=0.35 * np.std(tips))
    # to first order the hottest would be hotter, since beyond the knee the tip is less steep
    tip, slopes = known.tip(last_V)
    linear = tip + 2.33 * known.information.stderr(slopes)
    assert ours[-1] < linear


@pytest.mark.slow
def test_samples_of_a_calibration_are_hotter_than_its_last_row_as_often_as_colder(
    below_the_knee, known
):
    sampled = calibrate(below_the_knee, samples=2000)
    assert any("quantiles of posterior samples" in note for note in sampled.notes)
    last = sampled.table.isel(bias=-1)
    low, high = known.likely.band(below_the_knee.bias_V[-1:])[:, 0]
    found = [float(last.tip_low_K), float(last.tip_high_K)]
    assert found == pytest.approx([low, high], abs=0.25 * float(last.tip_stderr_K))
