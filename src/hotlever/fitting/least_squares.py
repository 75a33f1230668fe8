"""The least-squares problem of a fit: Levenberg-Marquardt, robust weights, confirmation.

A fit goes in rounds. In each, Levenberg-Marquardt finds the optimum among parameters near
those whose branch was solved with its exact derivatives; there the branch is solved anew. Since
voltages at a given tip temperature are nearly powers of the parameters, a few rounds suffice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from hotlever.errors import ComputationError, InputError
from hotlever.fitting.models import ForwardModel, Prediction
from hotlever.fitting.objective import Objective, Vicinity, inside, inverse_or_nan
from hotlever.fitting.residuals import Residuals
from hotlever.probe import Probe
from hotlever.probe.priors import JointPrior, Prior
from hotlever.types import Array, Progress

#: How far a round goes from where the branch was solved (relative change of a parameter), and
#: how near the optimum must be not to go on.
_FAR, _NEAR = 0.5, 1e-7
#: Relative changes of squares and parameters at which a round ends.
_EXACT = 1e-10
#: The change of squares where they count standard deviations.
_ENOUGH = 1e-5
#: Predictions that are kept: they tell how values bend between them.
_AT_HAND = 5
#: Most rounds, and as many as most fits need, for a progress bar to fill.
_MOST_ROUNDS, _USUAL_ROUNDS = 60, 8
#: Branches after which a search with priors ends where it is: most data of such a lever take half
#: as many, data that contradict what is known beforehand would go on and on.
_MOST_BRANCHES = 20
#: With priors, whose squares count standard deviations, a round that gains no more is the last.
#: So is one that promises a little more and does not keep it.
_LITTLE, _DOUBTFUL = 2e-2, 0.2
#: The optimum is found when a round moves no parameter by more than this share of its standard
#: error.
_FOUND = 0.01
#: A confirmation that moves no parameter by more than these shares of its standard error and of
#: its value ends the fit, since the confirmed model is exact to first order.
_SETTLED, _SETTLED_RELATIVE = 0.5, 0.03
_MOST_CONFIRMATIONS = 5
#: Reweightings, the first of them gentle.
_MOST_REWEIGHTINGS, _GENTLE_TURNS = 20, 6
#: Rounds in which an observable without measurement errors finds its scatter.
_SCATTER_TURNS = 3
#: Scatter that is usual, as a share of the largest value.
_USUAL = 1e-3


@dataclass(frozen=True)
class Optimum:
    """Where Levenberg-Marquardt ended.

    Attributes
    ----------
    probe : Probe
    prediction : Prediction
    stderr : ndarray, shape (p,)
        From `covariance`; infinite where there is none.
    covariance : ndarray, shape (p, p)
        If all weighted data had the same noise: the paper's assumption. NaN if it
        could not be estimated.
    squares : float
        Sum of squares that the nearby predictions have there.
    """

    probe: Probe
    prediction: Prediction
    stderr: Array
    covariance: Array
    squares: float


class LeastSquares:
    """Finds the parameters whose prediction is nearest to a measurement.

    It begins at the probe `start`, where what is not varied stays, or from a prediction for a
    similar one, `near`; priors by name, or a joint one of all that is varied, count as further
    data. `progress` is called with the branches solved and how many there usually are, `seen` with
    each prediction that is compared with the data.

    Attributes
    ----------
    model : ForwardModel
        As confirmed last.
    objective : Objective
    evaluations, steps : int
        Branches solved, and rounds that led nearer to the optimum.
    ended : bool
        Whether the search was ended there, not by itself.
    left : float
        By how much it would then have lowered the sum of squares in one more round.
    """

    def __init__(
        self,
        model: ForwardModel,
        residuals: Residuals,
        start: Probe,
        varied: list[str],
        progress: Progress | None = None,
        near: Prediction | None = None,
        priors: Mapping[str, Prior] | None = None,
        joint: JointPrior | None = None,
        seen: Callable[[Prediction], None] | None = None,
    ) -> None:
        self.model, self.residuals = model, residuals
        self._start, self._progress, self._seen = start, progress, seen
        self.objective = Objective(residuals, start, model.names, varied, priors, joint)
        self._at_hand = {} if near is None else {near.probe: near}
        self.evaluations, self.steps, self.ended, self.left = 0, 0, False, 0.0

    def solve_and_confirm(self, robust: bool) -> Optimum:
        """Find the optimum, make the model exact there, and go on until that matters no more.

        Raises
        ------
        ComputationError
            If the lever cannot be solved at the start, or the fit does not converge.
        """
        found = self.solve(self._start)
        unknown = self.residuals.without_errors.any() and not self.objective.informed
        for _ in range(_SCATTER_TURNS if unknown else 0):
            self.residuals.take_scatter(found.prediction.values)
            found = self.solve(found.probe)
        if robust:
            found = self._reweighted(found)
        for _ in range(_MOST_CONFIRMATIONS):
            confirmed = self.model.confirmed(found.prediction)
            if confirmed is self.model:
                return found
            self.model = confirmed
            others, self._at_hand = self.others(found.prediction), {}
            for other in others:
                # with what the fast lever lacked, it may melt below the highest bias
                with suppress(ComputationError):
                    self._at_hand[other.probe] = confirmed.predict(other.probe, other)
            self._at_hand[found.probe] = confirmed.predict(found.probe, found.prediction)
            previous, found = found, self.solve(found.probe)
            if self.ended or self._settled(previous, found):
                return found
        raise ComputationError(
            f"the fit did not settle: after {_MOST_CONFIRMATIONS} confirmations by full solves the "
            f"parameters still move by more than {_SETTLED:g} of their standard errors"
        )

    def _reweighted(self, found: Optimum) -> Optimum:
        """Lessen the weight of outliers until nothing changes: gently at first.

        With priors outliers stand out at once, since these hold a fit that others would pull along;
        without any there is nothing to do.
        """
        if self.objective.informed and not self.residuals.has_outliers(found.prediction.values):
            return found
        for gently, most in ((True, _GENTLE_TURNS), (False, _MOST_REWEIGHTINGS - _GENTLE_TURNS)):
            for _ in range(most):
                self.residuals.lessen(found.prediction.values, gently)
                # outliers can drive the first fit onto a bound, where it would stay without priors
                origin = self._start if gently and not self.objective.informed else found.probe
                previous, found = found, self.solve(origin)
                if self.ended or self._settled(previous, found):
                    break
        return found

    def _settled(self, previous: Optimum, found: Optimum) -> bool:
        """Whether the parameters have moved too little for another confirmation to matter."""
        now, size = self.objective.values(found.probe), np.abs(self.objective.values(found.probe))
        least = np.minimum(
            _SETTLED * found.stderr, _SETTLED_RELATIVE * np.maximum(size, self.objective.scale)
        )
        return bool(np.all(np.abs(now - self.objective.values(previous.probe)) <= least))

    def solve(self, start: Probe) -> Optimum:
        """Find the optimum of the present model and weights.

        Raises
        ------
        InputError
            If a parameter starts outside its bounds.
        ComputationError
            See `solve_and_confirm`.
        """
        values = self.objective.values(start).tolist()
        for known, value in zip(self.objective.known, values, strict=True):
            if not known.lower < value < known.upper:
                raise InputError(
                    f"{known.name} = {value:g} to start from, expected a value between "
                    f"{known.lower:g} and {known.upper:g} {known.unit}"
                )
        probe, prediction, far = start, self._predict(start), _FAR
        squares = self.objective.squares(prediction)
        for _ in range(_MOST_ROUNDS):
            vicinity = Vicinity(self.objective, prediction, self._bending(prediction))
            found = self._round(prediction, far, vicinity)
            if self.objective.informed and self.residuals.without_errors.any():
                found = self._with_scatter(found, far, vicinity)
                squares = self.objective.squares(prediction)
            here = self.objective.values(probe)
            near = np.maximum(_FOUND * found.stderr, _NEAR * np.abs(here))
            gain = squares - found.squares if self.objective.informed else np.inf
            self.ended = self.objective.informed and self.evaluations >= _MOST_BRANCHES
            self.left = gain if self.ended else 0.0
            if gain < _LITTLE or self.ended:
                return replace(found, probe=probe, prediction=prediction)
            # the optimum is where the branch was solved
            if far < _NEAR or np.all(np.abs(self.objective.values(found.probe) - here) <= near):
                return replace(found, probe=probe, prediction=prediction)
            better = np.inf
            with suppress(ComputationError):
                trial = self._predict(found.probe)
                better = self.objective.squares(trial)
            if better > squares * (1.0 + _NEAR):
                if gain < _DOUBTFUL:
                    return replace(found, probe=probe, prediction=prediction)
                far /= 4.0
                continue
            self.steps += 1
            probe, prediction, squares = found.probe, trial, better
            far = min(_FAR, 2.0 * far)
        raise ComputationError(f"the fit did not converge in {_MOST_ROUNDS} rounds")

    def _with_scatter(self, found: Optimum, far: float, near: Vicinity) -> Optimum:
        """Take scatter and optimum in turns, among parameters near those of a prediction."""
        at, objective = found.prediction, self.objective
        for _ in range(_SCATTER_TURNS):
            values, slopes = near.predict(objective.values(found.probe) / objective.scale)
            self.residuals.take_scatter(values, objective.used_up(found.probe, slopes), _USUAL)
            found = self._round(at, far, near, found.probe)
        return found

    def _round(
        self, at: Prediction, far: float, near: Vicinity, start: Probe | None = None
    ) -> Optimum:
        """Run Levenberg-Marquardt among parameters near those of a prediction, where it starts."""
        objective = self.objective
        value, (lower, upper) = near.origin, objective.bounds
        room = far * np.maximum(np.abs(value), 0.1)
        low, high = np.maximum(lower, value - room), np.minimum(upper, value + room)
        begin = value if start is None else objective.values(start) / objective.scale
        found = optimize.least_squares(
            near.residual,
            inside(begin, low, high),
            near.jacobian,
            (low, high),
            x_scale="jac",
            ftol=_ENOUGH if objective.informed else _EXACT,
            xtol=_EXACT,
            gtol=None,
            max_nfev=200,
        )
        free = found.fun.size - value.size
        covariance = inverse_or_nan(found.jac.T @ found.jac) * (2.0 * found.cost / max(free, 1))
        covariance = covariance if free > 0 else np.full_like(covariance, np.nan)
        variance = np.diag(covariance)
        stderr = np.sqrt(np.where(variance > 0, variance, np.inf))
        return Optimum(
            objective.at(at.probe, found.x),
            at,
            stderr * objective.scale,
            covariance * np.outer(objective.scale, objective.scale),
            2.0 * float(found.cost),
        )

    def _bending(self, prediction: Prediction) -> list[Prediction]:
        # without priors residuals have no size that says what is near
        return self.others(prediction) if self.objective.informed else []

    def others(self, prediction: Prediction) -> list[Prediction]:
        """Return the predictions at hand beside one."""
        return [one for one in self._at_hand.values() if one is not prediction]

    def _predict(self, probe: Probe) -> Prediction:
        """Predict with the model, from the latest prediction; what was asked before is at hand."""
        known = self._at_hand.pop(probe, None)
        if known is not None:
            self._at_hand[probe] = known
            return known
        near = next(reversed(self._at_hand.values()), None)
        self.evaluations += 1
        try:
            prediction = self.model.predict(probe, near)
        except ComputationError:
            if near is None:
                raise
            # a step too far to be followed from there
            prediction = self.model.predict(probe)
        self._at_hand[probe] = prediction
        if len(self._at_hand) > _AT_HAND:
            del self._at_hand[next(iter(self._at_hand))]
        if self._progress is not None:
            self._progress(self.evaluations, max(_USUAL_ROUNDS, self.evaluations))
        if self._seen is not None:
            self._seen(prediction)
        return prediction
