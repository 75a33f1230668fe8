"""How far the tip temperature may be off either way, where the linearised error may not hold.

The profile: all parameters are estimated anew with the tip temperature at one bias pulled away, on
either side. The sum of squares, of which each unit is a standard deviation squared, then rises by
the square of how many standard errors away it is. A linearised error is that for small changes.
Levers that are pulled so far are solved.

The posterior: all parameters are sampled, and the limits are quantiles of their tip temperatures.
It takes the levers near the optimum from those that were solved in the search.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from hotlever.errors import ComputationError
from hotlever.estimation.ensembles import (
    Gaussian,
    independent_samples,
    rhat_of_ensembles,
    sample,
)
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.objective import Objective, inside
from hotlever.estimation.surrogate import UNSOLVED, Surrogate
from hotlever.text import BAND
from hotlever.types import Array, Index, Progress

#: Biases, in the hotter half, at which the tip temperature is pulled away, and by how many
#: standard errors.
_PLACES, _AWAY = 3, 2.0
#: Most times that it is pulled, each with the error found before, unless that changes by less.
_ROUNDS, _NEARLY = 3, 0.1
#: Levers that are solved on each side at most, unless the sum of squares is known as well as this.
_MOST_SOLVED, _KNOWN = 3, 0.4
#: Relative change of the sum of squares at which a pulled estimate is found.
_FOUND = 1e-5
#: A rise of the sum of squares below which a side is open.
_LEAST_RISE = 0.25
#: A linearised error that is right within this factor holds.
_ALIKE = 1.25
#: Standard deviations from which on a solved lever tells of those that samples reach.
_TELLING = 1.0
#: R̂ from which on samples are too few.
_SETTLED = 1.05


@dataclass(frozen=True)
class Profile:
    """Standard errors on either side, as multiples of the linearised one.

    Attributes
    ----------
    tip_K : ndarray, shape (k,)
        Rising.
    below, above : ndarray, shape (k,)
    """

    tip_K: Array
    below: Array
    above: Array

    @property
    def linear(self) -> bool:
        """Whether the linearised error holds everywhere."""
        return bool(np.abs(np.log([self.below, self.above])).max() < np.log(_ALIKE))

    def limits(self, tip_K: Array, stderr_K: Array, other_K: Array) -> tuple[Array, Array]:
        """Return what 95 % of the tip temperatures lie between (K).

        The profile is that of the linearised error `stderr_K`; an `other_K` is the same either way.
        """
        below, above = (np.interp(tip_K, self.tip_K, side) for side in (self.below, self.above))
        low, high = (BAND * np.hypot(side * stderr_K, other_K) for side in (below, above))
        return tip_K - low, tip_K + high


def profile_of_tip(
    objective: Objective,
    at: Prediction,
    solved: Callable[[Array, Prediction], Prediction],
    covariance: Array,
) -> Profile:
    """Pull the tip temperature of an estimate away from its optimum.

    On a side where the pulled lever stays unknown the linearised error is kept.

    Parameters
    ----------
    objective : Objective
        Residuals with priors.
    at : Prediction
        The optimum.
    solved : callable
        Solves a lever of scaled parameters, near one that is known.
    covariance : ndarray, shape (p, p)
        Of the varied parameters, linearised.
    """
    optimum, some = Surrogate(objective, at), _looked_at(at)
    sides = np.ones((2, some.size))
    for side, way in enumerate((-1.0, 1.0)):
        near = _pulled_lever(optimum, covariance, int(some[-1]), way, solved)
        if near is not None:
            sides[side] = [_pulled(optimum, near, covariance, int(one), way)[1] for one in some]
    return Profile(at.values[2, some], *sides)


def _pulled_lever(
    optimum: Surrogate,
    covariance: Array,
    place: int,
    way: float,
    solved: Callable[[Array, Prediction], Prediction],
) -> Surrogate | None:
    """Solve the lever whose tip is pulled to one side, and return what is near it.

    It is pulled again from there, until its sum of squares is known; None if that does not end.
    What the optimum tells of levers so far away does not hold where parameters make up for each
    other along a bent valley.
    """
    near = optimum
    for _ in range(_MOST_SOLVED):
        there, _ = _pulled(optimum, near, covariance, place, way)
        expected = _squares(near.residual(there))
        try:
            near = Surrogate(optimum.objective, solved(there, near.at))
        except ComputationError:  # it melts below the highest bias
            break
        if abs(_squares(near.residual(near.origin)) - expected) < _KNOWN:
            return near
    return None


def _pulled(
    optimum: Surrogate, near: Surrogate, covariance: Array, place: int, way: float
) -> tuple[Array, float]:
    """Return where the tip is pulled to one side at a place, and the standard error there.

    As scaled parameters, and as a multiple of the linearised standard error.
    """
    objective, at = optimum.objective, optimum.at
    slope = at.slopes[2, place, objective.columns]
    along = covariance @ slope
    stderr, here = float(np.sqrt(slope @ along)), float(at.values[2, place])
    least, multiple, there = _squares(optimum.residual(optimum.origin)), 1.0, near.origin
    if near is optimum:
        there = there + way * _AWAY * along / (stderr * objective.rates(near.at.probe))
    for _ in range(_ROUNDS):
        # a negative error is one to the cold side
        pulled = _Pulled(near, place, here, way * multiple * stderr)
        there = pulled.estimate(there)
        rise = _squares(near.residual(there)) - least
        away = abs(pulled.tip_K(there) - here) / stderr
        last, multiple = multiple, away / np.sqrt(max(rise, _LEAST_RISE))
        if abs(multiple / last - 1.0) < _NEARLY:
            break
    return there, multiple


@dataclass(frozen=True)
class TipPosterior:
    """What posterior samples say of the tip temperature.

    Attributes
    ----------
    profile : Profile
        From the quantiles of 2.5 and 97.5 %.
    effective_samples, rhat : float
        Of the tip temperature where it is hottest.
    """

    profile: Profile
    effective_samples: float
    rhat: float

    @property
    def note(self) -> str:
        """What the limits are from, and whether there are enough samples."""
        text = (
            "95 % of the tip temperatures lie between quantiles of posterior samples "
            f"({self.effective_samples:.0f} effective ones, R̂ {self.rhat:.3f})"
        )
        return text + ("" if self.rhat < _SETTLED else "; these are too few, take more samples")


def posterior_of_tip(
    objective: Objective,
    at: Prediction,
    others: list[Prediction],
    covariance: Array,
    *,
    samples: int,
    progress: Progress | None = None,
) -> TipPosterior:
    """Sample the parameters of an estimate, and their tip temperatures.

    Parameters are those of `profile_of_tip`, with `others` than the optimum that have been solved,
    and those of `hotlever.estimation.ensembles.sample`. What is sampled costs too little for
    processes of its own.
    """
    surrogate = Surrogate(objective, at, others, least=_TELLING)
    rates = objective.rates(at.probe)
    scaled = covariance / np.outer(rates, rates)
    chains = sample(
        _Density(surrogate),
        Gaussian(surrogate.origin, scaled),
        samples=samples,
        progress=progress,
    )
    some, every = _looked_at(at), chains.points.reshape(-1, surrogate.origin.size)
    tips = np.array([surrogate.predict(point)[0][2] for point in every])
    slopes = at.slopes[2][some][:, objective.columns]
    stderr = np.sqrt(np.einsum("bi,ij,bj->b", slopes, covariance, slopes))
    low, high = np.percentile(tips[:, some], (2.5, 97.5), axis=0)
    middle = at.values[2, some]
    hottest = tips[:, some[-1]].reshape(chains.points.shape[:3])
    return TipPosterior(
        Profile(middle, (middle - low) / (BAND * stderr), (high - middle) / (BAND * stderr)),
        independent_samples(hottest),
        rhat_of_ensembles(hottest),
    )


def _looked_at(at: Prediction) -> Index:
    """Return the places of the data at which limits are looked for, the hottest last."""
    order = np.argsort(at.values[2])
    return order[np.linspace(order.size / 2, order.size - 1, _PLACES).astype(int)]


@dataclass(frozen=True)
class _Density:
    """The logarithm of the posterior density of scaled parameters."""

    surrogate: Surrogate

    def __call__(self, scaled: Array) -> float:
        low, high = self.surrogate.objective.bounds
        if np.any(scaled <= low) or np.any(scaled >= high):
            return -math.inf
        squares = _squares(self.surrogate.residual(scaled))
        return -0.5 * squares + self.surrogate.objective.log_volume(scaled)


class _Pulled:
    """An estimate whose tip temperature at one bias is pulled away from what it is at the optimum.

    If it had been measured there as well, twice as far away, with the error that it is known by,
    the estimate would move half the way: to `_AWAY` standard errors if everything is linear.
    """

    def __init__(self, surrogate: Surrogate, place: int, tip_K: float, stderr: float) -> None:
        self._surrogate, self._place, self._stderr = surrogate, place, stderr
        self._target = tip_K + 2.0 * _AWAY * stderr

    def tip_K(self, scaled: Array) -> float:
        return float(self._surrogate.predict(scaled)[0][2, self._place])

    def estimate(self, start: Array) -> Array:
        """Return the scaled parameters of least squares."""
        objective = self._surrogate.objective
        low, high = objective.bounds
        try:
            self.tip_K(start)
        except ComputationError:
            start = self._surrogate.origin
        found = optimize.least_squares(
            self._residual,
            inside(start, low, high),
            self._jacobian,
            (low, high),
            x_scale="jac",
            ftol=_FOUND,
            gtol=None,
            max_nfev=100,
        )
        return np.asarray(found.x)

    def _residual(self, scaled: Array) -> Array:
        known = self._surrogate.residual(scaled)
        try:
            return np.append(known, (self.tip_K(scaled) - self._target) / self._stderr)
        except ComputationError:
            return np.append(known, UNSOLVED)

    def _jacobian(self, scaled: Array) -> Array:
        objective = self._surrogate.objective
        slope = self._surrogate.predict(scaled)[1][2, self._place, objective.columns]
        row = slope * objective.coordinates.rates(scaled) / self._stderr
        return np.vstack([self._surrogate.jacobian(scaled), row])


def _squares(residual: Array) -> float:
    return float(residual @ residual)
