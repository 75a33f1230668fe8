"""The least-squares problem of a fit: Levenberg-Marquardt, robust weights, confirmation.

A fit goes in rounds. In each, Levenberg-Marquardt finds the optimum among parameters near
those whose branch was solved with its exact derivatives; there the branch is solved anew. Since
voltages at a given tip temperature are nearly powers of the parameters, a few rounds suffice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import optimize

from hotlever.errors import ComputationError, InputError
from hotlever.fitting.models import ForwardModel, Prediction
from hotlever.fitting.residuals import Residuals
from hotlever.probe import Probe
from hotlever.probe.parameters import parameters_of
from hotlever.probe.priors import JointPrior, Prior
from hotlever.types import Array, Progress

#: Scaled residual given to trial parameters for which the lever has no state: far beyond any
#: real one, so that Levenberg-Marquardt turns back.
_UNSOLVED = 10.0
#: How far a round goes from where the branch was solved (relative change of a parameter), and
#: how near the optimum must be not to go on.
_FAR, _NEAR = 0.5, 1e-7
#: Relative changes of squares and parameters at which a round ends.
_EXACT = 1e-10
#: Predictions that are kept.
_AT_HAND = 3
#: Most rounds, and as many as most fits need, for a progress bar to fill.
_MOST_ROUNDS, _USUAL_ROUNDS = 60, 8
#: Branches after which a search with priors ends where it is: most data of such a lever take half
#: as many, data that contradict what is known beforehand would go on and on.
_MOST_BRANCHES = 20
#: With priors, whose squares count standard deviations, a round that gains no more is the last.
#: So is one that promises a little more and does not keep it.
_LITTLE, _DOUBTFUL = 1e-2, 0.2
#: The optimum is found when a round moves no parameter by more than this share of its standard
#: error.
_FOUND = 0.01
#: A confirmation that moves no parameter by more than these shares of its standard error and of
#: its value ends the fit, since the confirmed model is exact to first order.
_SETTLED, _SETTLED_RELATIVE = 0.5, 0.03
_MOST_CONFIRMATIONS = 5
#: Reweightings, the first of them gentle.
_MOST_REWEIGHTINGS, _GENTLE_TURNS = 20, 6
#: A datum that alone decides a parameter says nothing of its own noise.
_LEAST_FREE = 0.05
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
    data. `progress` is called with the branches solved and how many there usually are.

    Attributes
    ----------
    model : ForwardModel
        As confirmed last.
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
    ) -> None:
        self.model, self.residuals, self._varied = model, residuals, varied
        self._start, self._progress = start, progress
        self._columns = [model.names.index(name) for name in varied]
        self._known = parameters_of(start)
        self._priors = {varied.index(name): prior for name, prior in (priors or {}).items()}
        self._joint, self._informed = joint, bool(priors) or joint is not None
        self._of_joint = [] if joint is None else [varied.index(name) for name in joint.names]
        known = [self._known[name] for name in varied]
        self._scale = np.array([one.scale for one in known])
        self._bounds = np.array([[one.lower, one.upper] for one in known]).T / self._scale
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
        unknown = self.residuals.without_errors.any() and not self._informed
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
            self._at_hand = {found.probe: confirmed.predict(found.probe, found.prediction)}
            previous, found = found, self.solve(found.probe)
            if self.ended or self._settled(previous, found):
                return found
        raise ComputationError(
            f"the fit did not settle: after {_MOST_CONFIRMATIONS} confirmations by full solves the "
            f"parameters still move by more than {_SETTLED:g} of their standard errors"
        )

    def _reweighted(self, found: Optimum) -> Optimum:
        """Lessen the weight of outliers until nothing changes."""
        for turn in range(_MOST_REWEIGHTINGS):
            at_first = turn < _GENTLE_TURNS
            self.residuals.lessen(found.prediction.values, gently=at_first)
            # outliers can drive the first fit onto a bound, where it would stay without priors
            origin = self._start if at_first and not self._informed else found.probe
            previous, found = found, self.solve(origin)
            if self.ended or (not at_first and self._settled(previous, found)):
                break
        return found

    def _settled(self, previous: Optimum, found: Optimum) -> bool:
        """Whether the parameters have moved too little for another confirmation to matter."""
        now, size = self._values(found.probe), np.abs(self._values(found.probe))
        least = np.minimum(
            _SETTLED * found.stderr, _SETTLED_RELATIVE * np.maximum(size, self._scale)
        )
        return bool(np.all(np.abs(now - self._values(previous.probe)) <= least))

    def solve(self, start: Probe) -> Optimum:
        """Find the optimum of the present model and weights.

        Raises
        ------
        InputError
            If a parameter starts outside its bounds.
        ComputationError
            See `solve_and_confirm`.
        """
        for name in self._varied:
            known, (value,) = self._known[name], start.at([name])
            if not known.lower < value < known.upper:
                raise InputError(
                    f"{name} = {value:g} to start from, expected a value between "
                    f"{known.lower:g} and {known.upper:g} {known.unit}"
                )
        probe, prediction, far = start, self._predict(start), _FAR
        squares = self._squares(prediction)
        for _ in range(_MOST_ROUNDS):
            found = self._round(prediction, far)
            if self._informed and self.residuals.without_errors.any():
                found = self._with_scatter(found, far)
                squares = self._squares(prediction)
            here = self._values(probe)
            near = np.maximum(_FOUND * found.stderr, _NEAR * np.abs(here))
            gain = squares - found.squares if self._informed else np.inf
            self.ended = self._informed and self.evaluations >= _MOST_BRANCHES
            self.left = gain if self.ended else 0.0
            if gain < _LITTLE or self.ended:
                return replace(found, probe=probe, prediction=prediction)
            # the optimum is where the branch was solved
            if far < _NEAR or np.all(np.abs(self._values(found.probe) - here) <= near):
                return replace(found, probe=probe, prediction=prediction)
            try:
                trial = self._predict(found.probe)
                better = self._squares(trial)
            except ComputationError:
                better = np.inf
            if better > squares * (1.0 + _NEAR):
                if gain < _DOUBTFUL:
                    return replace(found, probe=probe, prediction=prediction)
                far /= 4.0
                continue
            self.steps += 1
            probe, prediction, squares = found.probe, trial, better
            far = min(_FAR, 2.0 * far)
        raise ComputationError(f"the fit did not converge in {_MOST_ROUNDS} rounds")

    def _with_scatter(self, found: Optimum, far: float) -> Optimum:
        """Take scatter and optimum in turns, among parameters near those of a prediction."""
        at = found.prediction
        for _ in range(_SCATTER_TURNS):
            values, slopes = at.nearby.predict(found.probe.at(self.model.names))
            self.residuals.take_scatter(values, self._used_up(found.probe, slopes), _USUAL)
            found = self._round(at, far)
        return found

    def _round(self, at: Prediction, far: float) -> Optimum:
        """Run Levenberg-Marquardt among parameters near those of a prediction."""
        value, (lower, upper) = self._values(at.probe) / self._scale, self._bounds
        every = at.probe.at(self.model.names)
        room = far * np.maximum(np.abs(value), 0.1)
        low, high = np.maximum(lower, value - room), np.minimum(upper, value + room)
        # the search begins within its bounds
        inside = np.clip(value, low + 1e-6 * (high - low), high - 1e-6 * (high - low))

        @lru_cache(maxsize=1)
        def predicted(trial: bytes) -> tuple[Array, Array]:
            # asked for twice, for the residuals and their derivatives
            values = every.copy()
            values[self._columns] = np.frombuffer(trial) * self._scale
            return at.nearby.predict(values)

        def residual(trial: Array) -> Array:
            try:
                known = self.residuals.weighted(predicted(trial.tobytes())[0])
            except ComputationError:
                known = np.full(self.residuals.size, _UNSOLVED)
            return np.concatenate([known, self._from_priors(trial)])

        def jacobian(trial: Array) -> Array:
            known = self._jacobian(predicted(trial.tobytes())[1])
            return np.concatenate([known, self._of_priors(trial)])

        found = optimize.least_squares(
            residual,
            inside,
            jacobian,
            (low, high),
            x_scale="jac",
            ftol=_EXACT,
            xtol=_EXACT,
            gtol=None,
            max_nfev=200,
        )
        free = self.residuals.size + len(self._from_priors(value)) - value.size
        covariance = _inverse(found.jac.T @ found.jac) * (2.0 * found.cost / max(free, 1))
        covariance = covariance if free > 0 else np.full_like(covariance, np.nan)
        variance = np.diag(covariance)
        stderr = np.sqrt(np.where(variance > 0, variance, np.inf))
        return Optimum(
            at.probe.moved(dict(zip(self._varied, (found.x * self._scale).tolist(), strict=True))),
            at,
            stderr * self._scale,
            covariance * np.outer(self._scale, self._scale),
            2.0 * float(found.cost),
        )

    def _used_up(self, probe: Probe, slopes: Array) -> Array:
        """Return how many degrees of freedom of each observable a fit with priors uses up."""
        jacobian = self._jacobian(slopes)
        leverage = np.zeros(self.residuals.data.shape)
        leverage[self.residuals.present] = np.einsum(
            "ij,jk,ik->i", jacobian, self._posterior(probe, jacobian), jacobian
        )
        return np.asarray(leverage.sum(axis=1, keepdims=True))

    def _posterior(self, probe: Probe, jacobian: Array) -> Array:
        """Return the covariance of the scaled parameters that data and priors leave."""
        prior = self._of_priors(self._values(probe) / self._scale)
        return _inverse(jacobian.T @ jacobian + prior.T @ prior)

    def covariance(self, optimum: Optimum) -> Array:
        """Return the covariance of the varied parameters in their own units; NaN if singular.

        With priors it is that of the posterior, linearised. Without, noise differs between
        observables and along each of them by more than the weights know, so every datum's variance
        is taken from its own residual, enlarged by its leverage h (MacKinnon and White's HC3,
        J. Econometrics 29, 305 (1985)): C = A⁻¹ Jᵀ V J A⁻¹ with A = JᵀJ and V = r² / (1 − h)².
        """
        residual = self.residuals.weighted(optimum.prediction.values)
        jacobian = self._jacobian(optimum.prediction.slopes)
        if self._informed:
            return self._posterior(optimum.probe, jacobian) * np.outer(self._scale, self._scale)
        inverse = _inverse(jacobian.T @ jacobian)
        if residual.size <= self._scale.size:
            return np.full_like(inverse, np.nan)
        leverage = np.einsum("ij,jk,ik->i", jacobian, inverse, jacobian)
        influence = inverse @ jacobian.T * (residual / np.maximum(1.0 - leverage, _LEAST_FREE))
        return np.asarray(influence @ influence.T * np.outer(self._scale, self._scale))

    def shares(self, optimum: Optimum) -> dict[str, Array]:
        """Return what adds up to the covariance that priors and data leave.

        By the name of each prior, and of the data as ``measurement``: the estimate is, to first
        order, a weighted sum of all of them, each with an error of its own.
        """
        if not self._informed:
            return {"measurement": self.covariance(optimum)}
        jacobian = self._jacobian(optimum.prediction.slopes)
        prior = self._of_priors(self._values(optimum.probe) / self._scale)
        names = [*(self._varied[place] for place in self._priors), *["fit"] * len(self._of_joint)]
        left = self._posterior(optimum.probe, jacobian) * self._scale[:, None]
        found = {"measurement": left @ (jacobian.T @ jacobian) @ left.T}
        for name, row in zip(names, prior, strict=True):
            found[name] = found.get(name, 0.0) + np.outer(left @ row, left @ row)
        return found

    def _values(self, probe: Probe) -> Array:
        return probe.at(self._varied)

    def _from_priors(self, scaled: Array) -> Array:
        """Return how far parameters are from their priors, in standard deviations."""
        values = scaled * self._scale
        own = [prior.deviation(values[place]) for place, prior in self._priors.items()]
        if self._joint is not None:
            own = [*own, *self._joint.deviations(values[self._of_joint])]
        return np.array(own)

    def _of_priors(self, scaled: Array) -> Array:
        """Return the derivatives of `_from_priors` by the scaled parameters."""
        rows, values = np.zeros((len(self._priors), scaled.size)), scaled * self._scale
        for row, (place, prior) in zip(rows, self._priors.items(), strict=True):
            row[place] = prior.slope(values[place]) * self._scale[place]
        if self._joint is not None:
            joint = np.zeros((len(self._of_joint), scaled.size))
            joint[:, self._of_joint] = self._joint.slopes(values[self._of_joint])
            rows = np.concatenate([rows, joint * self._scale])
        return rows

    def _jacobian(self, slopes: Array) -> Array:
        """Return the derivatives of the weighted residuals by the scaled parameters."""
        return self.residuals.jacobian(slopes[:, :, self._columns] * self._scale)

    def _squares(self, at: Prediction) -> float:
        """Return the sum of squares of the weighted residuals and of the distance from priors."""
        residual = self.residuals.weighted(at.values)
        prior = self._from_priors(self._values(at.probe) / self._scale)
        return float(residual @ residual + prior @ prior)

    def _predict(self, probe: Probe) -> Prediction:
        """Predict with the model, from the latest prediction; what was asked before is at hand."""
        known = self._at_hand.get(probe)
        if known is not None:
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
        return prediction


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a matrix; NaN if it is singular."""
    try:
        return np.asarray(np.linalg.inv(matrix), dtype=float)
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)
