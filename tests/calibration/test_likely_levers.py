"""Levers drawn from what is known of one are such levers, and as likely as trials have them."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.estimate import calibrate
from hotlever.estimate.experiment import TIP
from hotlever.estimate.next_measurement import LinearisedLever
from hotlever.estimate.objective import Subproblem
from hotlever.estimate.options import CalibrationOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import solve
from hotlever.estimate.surrogate import Rows
from hotlever.estimate.trials import Trials, draw_samples
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


@pytest.mark.parametrize("of_priors", [True, False])
def test_the_tips_are_those_of_the_levers_that_were_drawn(known, of_priors):
    lever = LinearisedLever.of_priors(Probe.reference()) if of_priors else known
    bias, likely = np.array([2.0, 5.0, 7.0]), lever.likely
    surrogate, (points, _) = lever.surrogate.reading(Rows(bias)), likely._drawn
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
    options = CalibrationOptions().of_lever
    solution = solve(Problem.of(below_the_knee, Probe.reference(), options))
    near = Subproblem(solution.objective, solution.prediction)
    points = draw_samples(Trials(near), 800).points
    tips = [near.values_at(point)[TIP, -1] for point in points]
    shares, last_V = np.array([0.025, 0.5, 0.975]), below_the_knee.bias_V[-1:]
    ours = known.likely.quantiles(last_V, shares)[:, 0]
    assert ours == pytest.approx(np.quantile(tips, shares), abs=0.35 * np.std(tips))
    # to first order the hottest would be hotter, since beyond the knee the tip is less steep
    tip, slopes = known.tip(last_V)
    linear = tip + 2.33 * known.information.stderr(slopes)
    assert np.quantile(tips, 0.99) < known.likely.quantiles(last_V, np.array([0.99])) < linear
