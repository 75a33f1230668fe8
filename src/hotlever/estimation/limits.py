"""How far the tip temperature may be off either way, where the linearised error may not hold.

All parameters are estimated anew with the tip temperature at one bias pulled away, on
either side. The sum of squares, of which each unit is a standard deviation squared, then rises by
the square of how many standard errors away it is. A linearised error is that for small changes.
Levers that are pulled so far are solved. `hotlever.estimation.sampled_limits` samples instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.objective import Objective, Pull
from hotlever.estimation.surrogate import Surrogate
from hotlever.text import BAND
from hotlever.types import Array, Index

#: Biases, in the hotter half, at which the tip temperature is pulled away, and by how many
#: standard errors.
_PLACES, _AWAY = 3, 2.0
#: Most times that it is pulled, each with the error found before, unless that changes by less.
_ROUNDS, _NEARLY = 3, 0.1
#: Levers that are solved on each side at most; one is near enough if the pulled estimate is no
#: further from it than this share of the way from the optimum: where levers were solved on until
#: the sum of squares was known within 0.4, the standard error changed by 3 % at most.
_MOST_SOLVED, _NEAR = 3, 0.3
#: A rise of the sum of squares below which a side is open.
_LEAST_RISE = 0.25
#: A linearised error that is right within this factor holds.
_ALIKE = 1.25


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
    optimum, some = Surrogate(objective, at), looked_at(at)
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

    It is pulled again from there until that moves it little; None if that does not end. What the
    optimum tells of levers so far away does not hold where parameters make up for each other along
    a bent valley.
    """
    # lengths in standard errors of the parameters
    errors = np.sqrt(np.diag(covariance)) / optimum.objective.rates(optimum.at.probe)
    near = optimum
    for count in range(_MOST_SOLVED + 1):
        there, _ = _pulled(optimum, near, covariance, place, way)
        moved, away = there - near.origin, near.origin - optimum.origin
        if count and np.linalg.norm(moved / errors) < _NEAR * np.linalg.norm(away / errors):
            return near
        if count == _MOST_SOLVED:
            break
        try:
            near = Surrogate(optimum.objective, solved(there, near.at))
        except ComputationError:  # it melts below the highest bias
            break
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
    least, multiple, there = optimum.squares(optimum.origin), 1.0, near.origin
    if near is optimum:
        there = there + way * _AWAY * along / (stderr * objective.rates(near.at.probe))
    for _ in range(_ROUNDS):
        # a negative error is one to the cold side
        pulled = near.of(_pulled_away(objective, place, here, way * multiple * stderr))
        there, _ = pulled.minimum(there)
        rise = near.squares(there) - least
        away = abs(float(near.values(there)[2, place]) - here) / stderr
        last, multiple = multiple, away / np.sqrt(max(rise, _LEAST_RISE))
        if abs(multiple / last - 1.0) < _NEARLY:
            break
    return there, multiple


def _pulled_away(objective: Objective, place: int, tip_K: float, stderr: float) -> Objective:
    """Return an objective whose optimum has another tip temperature at one bias.

    As if it had been measured there as well, twice as far away, with the error that it is known by:
    the estimate moves half the way, to `_AWAY` standard errors if everything is linear.
    """
    return objective.pulled(Pull(place, tip_K + 2.0 * _AWAY * stderr, stderr))


def looked_at(at: Prediction) -> Index:
    """Return the places of the data at which limits are looked for, the hottest last."""
    order = np.argsort(at.values[2])
    return order[np.linspace(order.size / 2, order.size - 1, _PLACES).astype(int)]
