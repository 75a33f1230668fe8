"""The least-squares problem of an estimate: Gauss-Newton steps, robust weights, confirmation.

A lever is solved with its exact derivatives. Near it, voltages at a given tip temperature are
nearly powers of the parameters; the optimum among such neighbours, within a region that grows and
shrinks with how well they tell, is solved next. A search ends where the gradient does: where
Gauss and Newton's step would lower the sum of squares by next to nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimation.experiment import Experiment, Prediction
from hotlever.estimation.objective import Objective, inverse_or_nan
from hotlever.estimation.options import SearchOptions
from hotlever.estimation.subproblem import Subproblem
from hotlever.probe import Probe
from hotlever.types import Array, Progress

#: Branches that most searches need, for a progress bar to fill.
_USUAL_BRANCHES = 8
#: Share of the range between its bounds within which a parameter is at one of them.
_AT_BOUND = 1e-5


@dataclass(frozen=True)
class Optimum:
    """Where a search ended.

    Attributes
    ----------
    probe : Probe
    prediction : Prediction
    covariance : ndarray, shape (p, p)
        If all weighted data had the same noise: the paper's assumption. NaN if it
        could not be estimated.
    decrement : float
        By how much Gauss and Newton's step would still lower the sum of squares.
    converged : bool
        Whether that is next to nothing.
    """

    probe: Probe
    prediction: Prediction
    covariance: Array
    decrement: float
    converged: bool

    @property
    def stderr(self) -> Array:
        """Standard errors from the covariance, (p,); infinite where there are none."""
        variance = np.diag(self.covariance)
        return np.sqrt(np.where(variance > 0, variance, np.inf))


class Optimiser:
    """Finds the parameters whose prediction is nearest to a measurement.

    Parameters
    ----------
    model : Experiment
        Kept as the attribute `model`, as confirmed last.
    objective : Objective
    progress : callable, optional
        Called with the branches solved and how many there usually are.
    seen : callable, optional
        Called with each prediction that is compared with the data.
    near : Prediction, optional
        Of a lever similar to that at which the search begins.
    options : SearchOptions, optional

    Attributes
    ----------
    evaluations, steps : int
        Branches solved, and those of them that led nearer to the optimum.
    """

    def __init__(
        self,
        model: Experiment,
        objective: Objective,
        *,
        progress: Progress | None = None,
        seen: Callable[[Prediction], None] | None = None,
        near: Prediction | None = None,
        options: SearchOptions | None = None,
    ) -> None:
        self.model, self.objective, self.residuals = model, objective, objective.residuals
        self._progress, self._seen = progress, seen
        self._at_hand = {} if near is None else {near.probe: near}
        self._options = options or SearchOptions()
        self.evaluations, self.steps = 0, 0

    def solve_and_confirm(self, start: Probe, robust: bool) -> Optimum:
        """Find the optimum, make the model exact there, and go on until that matters no more.

        A robust search lessens the weight of outliers.

        Raises
        ------
        ComputationError
            If the lever cannot be solved at the start, or confirmations do not settle.
        """
        options = self._options
        optimum = self.solve(start)
        unknown = self.residuals.without_errors.any() and not self.objective.informed
        for _ in range(options.scatter_rounds if unknown else 0):
            self.residuals.take_scatter(optimum.prediction.values)
            optimum = self.solve(optimum.probe)
        if robust:
            optimum = self._reweighted(start, optimum)
        for _ in range(options.confirmations):
            confirmed = self.model.confirmed(optimum.prediction)
            if confirmed is self.model:
                return optimum
            self.model = confirmed
            others, self._at_hand = self.others(optimum.prediction), {}
            for other in others:
                # with what the fast lever lacked, it may melt below the highest bias
                with suppress(ComputationError):
                    self._at_hand[other.probe] = confirmed.predict(other.probe, other)
            self._at_hand[optimum.probe] = confirmed.predict(optimum.probe, optimum.prediction)
            previous, optimum = optimum, self.solve(optimum.probe)
            if not optimum.converged or self._settled(previous, optimum):
                return optimum
        return replace(optimum, converged=False)

    def _reweighted(self, start: Probe, optimum: Optimum) -> Optimum:
        """Lessen the weight of outliers until nothing changes: gently at first.

        With priors outliers stand out at once, since these hold a fit that others would pull along;
        without any there is nothing to do.
        """
        options = self._options
        if self.objective.informed and not self.residuals.has_outliers(optimum.prediction.values):
            return optimum
        for gently, most in ((True, options.gentle_rounds), (False, options.robust_rounds)):
            for _ in range(most):
                self.residuals.lessen(optimum.prediction.values, gently)
                # outliers can drive the first fit onto a bound, where it would stay without priors
                origin = start if gently and not self.objective.informed else optimum.probe
                previous, optimum = optimum, self.solve(origin)
                if not optimum.converged or self._settled(previous, optimum):
                    break
        return optimum

    def _settled(self, previous: Optimum, optimum: Optimum) -> bool:
        """Whether the parameters have moved too little for another confirmation to matter."""
        options, objective = self._options, self.objective
        now = objective.values(optimum.probe)
        size = np.maximum(np.abs(now), objective.coordinates.scale)
        least = np.minimum(options.settled * optimum.stderr, options.settled_relative * size)
        return bool(np.all(np.abs(now - objective.values(previous.probe)) <= least))

    def solve(self, start: Probe) -> Optimum:
        """Find the optimum of the present model and weights.

        Raises
        ------
        InputError
            If a parameter starts outside its bounds.
        ComputationError
            If the lever cannot be solved at the start.
        """
        objective, options = self.objective, self._options
        self._check_start(start)
        # without priors a robust search begins anew with each choice of weights
        in_all = options.most_in_all * (1 if objective.informed else options.gentle_rounds)
        most = min(self.evaluations + options.most_branches, in_all)
        at, region = self.predict(start), options.first_region
        while True:
            near = Subproblem(objective, at, self._bending(at))
            room = objective.coordinates.room(near.origin)
            target, least = near.minimum(region=region * room)
            if self._takes_scatter:
                target, least = self._with_scatter(target, region * room, near)
            squares, step = objective.squares(at), target - near.origin
            inner = bool(np.all(np.abs(step) < 0.99 * region * room))
            left, enough = decrement(objective, at), tolerance(objective, at, options)
            # a step within the region that gains nothing is as good as none
            if left <= enough or (inner and squares - least <= enough):
                return self._optimum(at, left, converged=True)
            if region < options.smallest_region or self.evaluations >= most:
                # only rounding errors are left, if so little is promised
                precise = left <= options.negligible_of_misfit * squares
                precise = precise and region < options.smallest_region
                return self._optimum(at, left, converged=precise or self._is_near(left))
            if region < options.rough_region and self._is_near(left):
                return self._optimum(at, left, converged=True)
            length = float(np.max(np.abs(step) / room))
            trial = self._trial(at, target)
            better = np.inf if trial is None else objective.squares(trial)
            gain = (squares - better) / max(squares - least, 1e-300)
            if gain < options.doubted:
                region = 0.3 * length
            elif gain > options.trusted:
                region = min(max(region, 2.0 * length), options.largest_region)
            if trial is not None and better < squares:
                self.steps += 1
                at = trial

    @property
    def _takes_scatter(self) -> bool:
        """Whether the noise of some observables is found with the optimum."""
        unknown = bool(self.residuals.without_errors.any())
        return unknown and self.objective.informed and self._options.scatter_rounds > 0

    def _check_start(self, start: Probe) -> None:
        values = self.objective.values(start).tolist()
        for parameter, value in zip(self.objective.coordinates.parameters, values, strict=True):
            if not parameter.lower <= value <= parameter.upper:
                raise InputError(
                    f"{parameter.name} = {value:g} to start from, expected a value between "
                    f"{parameter.lower:g} and {parameter.upper:g} {parameter.unit}"
                )

    def _is_near(self, left: float) -> bool:
        """Whether an optimum is so near that its errors hold, if values are not smooth there."""
        return self.objective.informed and left <= self._options.decrement_where_rough

    def _optimum(self, at: Prediction, left: float, *, converged: bool) -> Optimum:
        point, residual, jacobian = self.objective.linearised(at)
        free = residual.size - point.size
        covariance = np.full((point.size, point.size), np.nan)
        if free > 0:
            rates = self.objective.coordinates.rates(point)
            variance = residual @ residual / free * np.outer(rates, rates)
            covariance = inverse_or_nan(jacobian.T @ jacobian) * variance
        return Optimum(at.probe, at, covariance, left, converged)

    def _trial(self, at: Prediction, point: Array) -> Prediction | None:
        """Solve the lever of a point; None if it cannot be drawn or solved."""
        try:
            return self.predict(self.objective.at(at.probe, point))
        except HotleverError:
            return None

    def _with_scatter(self, point: Array, region: Array, near: Subproblem) -> tuple[Array, float]:
        """Take scatter and optimum in turns, among parameters near those of a prediction."""
        options, least = self._options, np.inf
        for _ in range(options.scatter_rounds):
            values, slopes = near.predict(point)
            leverage = self.objective.leverage(slopes, point)
            self.residuals.take_scatter(values, leverage, options.usual_scatter)
            point, least = near.minimum(point, region)
        return point, least

    def _bending(self, prediction: Prediction) -> list[Prediction]:
        # without priors residuals have no size that says what is near
        return self.others(prediction) if self.objective.informed else []

    def others(self, prediction: Prediction) -> list[Prediction]:
        """Return the predictions at hand beside one."""
        return [other for other in self._at_hand.values() if other is not prediction]

    def predict(self, probe: Probe) -> Prediction:
        """Predict with the model, from the latest prediction; what was asked before is at hand."""
        if probe not in self._at_hand:
            self._at_hand[probe] = self._solved(probe)
        self._at_hand[probe] = self._at_hand.pop(probe)  # the latest
        if len(self._at_hand) > self._options.kept:
            del self._at_hand[next(iter(self._at_hand))]
        return self._at_hand[probe]

    def _solved(self, probe: Probe) -> Prediction:
        near = next(reversed(self._at_hand.values()), None)
        self.evaluations += 1
        try:
            prediction = self.model.predict(probe, near)
        except ComputationError:
            if near is None:
                raise
            # a step too far to be followed from there
            prediction = self.model.predict(probe)
        if self._progress is not None:
            self._progress(self.evaluations, max(_USUAL_BRANCHES, self.evaluations))
        if self._seen is not None:
            self._seen(prediction)
        return prediction


def decrement(objective: Objective, at: Prediction) -> float:
    """Return by how much Gauss and Newton's step would lower the sum of squares.

    Parameters at their bounds, beyond which it leads, stay there.
    """
    point, residual, jacobian = objective.linearised(at)
    low, high = objective.bounds
    margin = _AT_BOUND * (high - low)
    free = np.ones(point.size, dtype=bool)
    for _ in range(point.size):
        step = np.zeros(point.size)
        step[free] = np.linalg.lstsq(jacobian[:, free], -residual)[0]
        held = ((point <= low + margin) & (step < 0)) | ((point >= high - margin) & (step > 0))
        if not (held & free).any():
            break
        free &= ~held
    return float(residual @ residual - np.sum((residual + jacobian @ step) ** 2))


def tolerance(objective: Objective, at: Prediction, options: SearchOptions) -> float:
    """Return by how much the sum of squares may still fall where a search ends."""
    residuals, squares = objective.residuals, objective.squares(at)
    noise = 1.0 if objective.informed else residuals.noise_squares(at.values)
    # so far above what noise explains that no lever is near
    hopeless = squares > options.misfit * residuals.size * noise
    least = (options.negligible_of_misfit if hopeless else options.negligible) * squares
    if objective.informed:
        return float(max(options.decrement, least))
    precise = residuals.size * (options.precision * residuals.unit_weight) ** 2
    return float(max(options.relative_decrement * noise, least, precise))
