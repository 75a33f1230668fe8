"""Limits of the tip temperature where it is no linear function of what is unknown."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hotlever.estimate.experiment import Prediction
from hotlever.estimate.objective import (
    Coordinates,
    EstimatedQuantity,
    Objective,
    Penalty,
    PriorDensity,
    Subproblem,
)
from hotlever.estimate.options import Numerics
from hotlever.estimate.posterior import ErrorProfile, Posterior, profile_of_tip
from hotlever.estimate.sampling import SampledTip, sample_tip
from hotlever.estimate.tip_temperature import error_of_model
from hotlever.probe.priors import Prior
from hotlever.probe.surroundings import Surroundings
from hotlever.text import BAND

TIPS, SLOPES = np.array([300.0, 500.0, 800.0]), np.array([1.0, 10.0, 20.0])


class Lever(float):
    """A lever of which all is said by one number, x, and that can be drawn for any."""

    shape = SimpleNamespace(check=lambda: None)

    def values(self, names):
        return np.array([float(self)])

    def replace(self, values):
        return Lever(values["x"])


class OneUnknown(Objective):
    """An objective with one unknown x, of which is known that it is 0 ± 1, and nothing else."""

    def __init__(self):
        self.names, self.varied, self.columns = ("x",), ["x"], [0]
        parameter = SimpleNamespace(name="x", unit="1", lower=-9.0, upper=9.0)
        self.coordinates = Coordinates((parameter,), np.array([False]), np.ones(1))
        self.bounds = self.coordinates.bounds
        self.residuals = SimpleNamespace(
            size=0,
            numerics=Numerics(),
            data=np.zeros((1, 0)),
            present=np.zeros((1, 0), dtype=bool),
            errors=SimpleNamespace(without=np.zeros(1, dtype=bool)),
            weighted=lambda values: np.zeros(0),
            jacobian=lambda slopes: np.zeros((0, 1)),
        )
        self.prior = PriorDensity.of_priors({"x": Prior(0.0, 1.0, relative=False)})
        self._of_prior, self._penalty = [0], None

    def values(self, probe):
        return probe.values(["x"])


class Bent:
    """An experiment that shows T = T₀ + b (x + bend x²) at three biases."""

    names = ("x",)

    def __init__(self, bend):
        self._bend = bend

    def predict(self, probe, near=None):
        values, slopes = self._prediction(np.array([float(probe)]))
        surrogate = SimpleNamespace(
            predict=self._prediction, values_at=lambda x: self._prediction(x)[0]
        )
        return Prediction(probe, values, slopes, surrogate, columns={}, tip_slopes=slopes[2])

    def _prediction(self, x):
        tip = TIPS + SLOPES * (x[0] + self._bend * x[0] ** 2)
        slope = SLOPES * (1 + 2 * self._bend * x[0])
        return np.stack([0 * tip, 0 * tip, tip]), np.stack([0 * tip, 0 * tip, slope])[:, :, None]


def posterior(bend):
    """Return what is known of such a lever."""
    return Posterior(OneUnknown(), Bent(bend).predict(Lever(0.0)))


def profile(bend):
    """Return the profile of such a lever; others are solved as they are."""
    return profile_of_tip(posterior(bend), Bent(bend))


def test_a_quantity_is_known_as_well_as_what_it_follows_from():
    for row, slope in enumerate(SLOPES):
        value, stderr = posterior(0.1).of(EstimatedQuantity("tip", row))
        assert value == pytest.approx(TIPS[row])
        assert stderr == pytest.approx(slope)


def test_changes_along_the_axes_add_up_to_the_variance():
    changes = posterior(0.0).changes(lambda x: np.array([3.0 * x[0], -x[0]]))
    np.testing.assert_allclose(np.sum(changes**2, axis=0), [9.0, 1.0])


def test_a_pulled_quantity_is_on_its_profile():
    """Of all levers with this tip it is the one nearest to what was known: x² tells how far."""
    known = posterior(0.0)
    tip = EstimatedQuantity("tip", 2)
    for target in (TIPS[2] + 30.0, TIPS[2] - 50.0):
        penalised = known.objective.penalised(Penalty(tip, target, 1e-3))
        there, squares = Subproblem(penalised, known.at).minimum()
        assert there[0] == pytest.approx((target - TIPS[2]) / SLOPES[2], rel=1e-4)
        assert squares == pytest.approx(there[0] ** 2, rel=1e-3)


def test_what_is_linear_has_the_linearised_error():
    found = profile(0.0)
    np.testing.assert_allclose([found.below, found.above], 1.0, rtol=1e-3)
    assert found.linear
    low, high = found.credible_interval(TIPS, SLOPES, np.zeros(3))
    np.testing.assert_allclose([TIPS - low, high - TIPS], [BAND * SLOPES] * 2)


@pytest.mark.parametrize("slopes", [[0.0, 0.0, 0.0], [0.0, 10.0, 0.0]])
def test_a_tip_that_nothing_unknown_moves_is_known_exactly(slopes, monkeypatch):
    monkeypatch.setattr(f"{__name__}.SLOPES", np.array(slopes))
    known = profile(0.12)
    fixed = np.array(slopes) == 0.0
    low, high = known.credible_interval(TIPS, np.array(slopes), np.zeros(3))
    np.testing.assert_array_equal(low[fixed], TIPS[fixed])
    np.testing.assert_array_equal(high[fixed], TIPS[fixed])
    assert (high[~fixed] > TIPS[~fixed]).all()


@pytest.mark.parametrize("bend", [0.12, -0.15])
def test_what_bends_has_other_limits_either_way(bend):
    found = profile(bend)
    assert not found.linear
    # as far as x is moved, x standard errors away the tip is b |x + bend x²| away
    low, high = found.credible_interval(TIPS[1:], SLOPES[1:], np.zeros(2))
    wide, narrow = (high - TIPS[1:], TIPS[1:] - low)[:: 1 if bend > 0 else -1]
    for away, way in ((wide, np.sign(bend)), (narrow, -np.sign(bend))):
        exact = np.abs(way + bend * BAND) * BAND * SLOPES[1:]
        # the penalised estimate is not exactly 95 % away
        np.testing.assert_allclose(away, exact, rtol=0.1)
    assert np.all(wide > 1.5 * narrow)


def test_other_errors_are_the_same_either_way():
    low, high = profile(0.0).credible_interval(TIPS, np.zeros(3), np.full(3, 2.0))
    np.testing.assert_allclose([TIPS - low, high - TIPS], 2.0 * BAND)


def test_quantiles_of_the_posterior_are_those_of_what_is_unknown():
    """x is normal, so that the quantiles of the tip are the tips at 1.96 standard errors."""
    bend = 0.12
    predictor = SimpleNamespace(others=lambda at: [], experiment=None)
    found = sample_tip(posterior(bend), predictor, samples=2000)
    assert found.enough
    assert found.effective_samples > 500
    low, high = found.profile.credible_interval(TIPS[1:], SLOPES[1:], np.zeros(2))
    x = BAND * np.array([[-1.0], [1.0]])
    expected = TIPS[1:] + SLOPES[1:] * (x + bend * x**2)
    np.testing.assert_allclose([low, high], expected, atol=0.12 * BAND * SLOPES[-1])


def test_few_posterior_samples_are_not_enough():
    enough = SampledTip(ErrorProfile(TIPS, TIPS, TIPS), effective_samples=450.0, fewest=400)
    assert enough.enough
    assert "between quantiles" in enough.note
    few = replace(enough, effective_samples=139.0)
    assert not few.enough
    assert few.note.startswith("too few posterior samples")


def test_what_the_model_leaves_open_is_an_error_of_it():
    bias = np.linspace(1.0, 10.0, 10)
    rise = 9.0 * bias**2  # that of a lever of constant properties
    air, jumping = Surroundings(medium="air"), Surroundings(medium="air", accommodation=0.9)

    def share(around):
        return (error_of_model(around, bias, rise) / rise)[5]

    assert share(Surroundings()) < share(jumping) < share(air)
    assert share(air) == pytest.approx(np.hypot(share(jumping), 7e-3))
