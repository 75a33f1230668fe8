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
from typing import Any

import numpy as np

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimation.experiment import Experiment, Prediction
from hotlever.estimation.lack_of_fit import lack_of_fit_text
from hotlever.estimation.objective import Objective, Subproblem
from hotlever.estimation.options import SearchOptions
from hotlever.probe import Probe
from hotlever.text import with_unit
from hotlever.types import Array, Progress

#: Branches that most searches need, for a progress bar to fill.
_USUAL_BRANCHES = 8


@dataclass(frozen=True)
class Optimum:
    """Where a search ended.

    Attributes
    ----------
    optimiser : Optimiser
        As the search left it.
    prediction : Prediction
    decrement : float
        By how much Gauss and Newton's step would still lower the sum of squares.
    converged : bool
        Whether that is next to nothing.
    covariance : ndarray, shape (p, p)
        If all weighted data had the same noise: the paper's assumption. NaN if it could not be
        estimated.
    """

    optimiser: Optimiser
    prediction: Prediction
    decrement: float
    converged: bool
    covariance: Array

    @property
    def probe(self) -> Probe:
        """The lever."""
        return self.prediction.probe

    @property
    def stderr(self) -> Array:
        """Standard errors from the covariance, (p,); infinite where there are none."""
        variance = np.diag(self.covariance)
        return np.sqrt(np.where(variance > 0, variance, np.inf))

    @property
    def describes_data(self) -> bool:
        """Whether the search converged to a lever that describes the data."""
        return self.converged and not lack_of_fit_text(
            self.optimiser.residuals, self.prediction.values
        )

    @property
    def misfit(self) -> float:
        """The mean square of differences, as shares of the largest of each observable."""
        residuals = self.optimiser.residuals
        share = residuals.difference(self.prediction.values) / residuals.largest
        return float(np.nanmean((residuals.errors.down * share) ** 2))


class Predictor:
    """Predicts with an experiment, each lever from the latest one; the latest are at hand.

    Parameters
    ----------
    experiment : Experiment
        Kept as the attribute of this name, as confirmed last.
    kept : int
        How many predictions are at hand.
    progress : callable, optional
        Called with the levers solved and how many there usually are.
    seen : callable, optional
        Called with each prediction that is compared with the data.
    near : Prediction, optional
        Of a lever similar to that at which a search begins.

    Attributes
    ----------
    evaluations : int
        Levers solved.
    """

    def __init__(
        self,
        experiment: Experiment,
        kept: int,
        progress: Progress | None = None,
        seen: Callable[[Prediction], None] | None = None,
        near: Prediction | None = None,
    ) -> None:
        self.experiment, self.evaluations = experiment, 0
        self._kept, self._progress, self._seen = kept, progress, seen
        self._at_hand = {} if near is None else {near.probe: near}

    def predict(self, probe: Probe) -> Prediction:
        """Predict from the latest prediction, unless what is asked is at hand."""
        if probe not in self._at_hand:
            self._at_hand[probe] = self._solved(probe)
        self._at_hand[probe] = self._at_hand.pop(probe)  # the latest
        if len(self._at_hand) > self._kept:
            del self._at_hand[next(iter(self._at_hand))]
        return self._at_hand[probe]

    def _solved(self, probe: Probe) -> Prediction:
        near = next(reversed(self._at_hand.values()), None)
        self.evaluations += 1
        try:
            prediction = self.experiment.predict(probe, near)
        except ComputationError:
            if near is None:
                raise
            # a step too far to be followed from there
            prediction = self.experiment.predict(probe)
        if self._progress is not None:
            self._progress(self.evaluations, max(_USUAL_BRANCHES, self.evaluations))
        if self._seen is not None:
            self._seen(prediction)
        return prediction

    def others(self, prediction: Prediction) -> list[Prediction]:
        """Return the predictions at hand beside one."""
        return [other for other in self._at_hand.values() if other is not prediction]

    def confirm(self, at: Prediction) -> bool:
        """Make the experiment exact at a prediction; return whether that makes another one.

        Raises
        ------
        ComputationError
            If the full lever cannot be solved there.
        """
        confirmed = self.experiment.confirmed(at)
        if confirmed is self.experiment:
            return False
        self.experiment = confirmed
        others, self._at_hand = self.others(at), {}
        for other in others:
            # with what the fast lever lacked, it may melt below the highest bias
            with suppress(ComputationError):
                self._at_hand[other.probe] = confirmed.predict(other.probe, other)
        self._at_hand[at.probe] = confirmed.predict(at.probe, at)
        return True


class Optimiser:
    """Finds the parameters whose prediction is nearest to a measurement.

    Parameters
    ----------
    objective : Objective
    experiment : Experiment
    options : SearchOptions, optional
    **predicting
        Of the `Predictor`, which is the attribute `predictor`.

    Attributes
    ----------
    steps : int
        Levers that led nearer to the optimum.
    """

    def __init__(
        self,
        objective: Objective,
        experiment: Experiment,
        options: SearchOptions | None = None,
        **predicting: Any,
    ) -> None:
        self.objective, self.residuals = objective, objective.residuals
        self._options, self.steps = options or SearchOptions(), 0
        self.predictor = Predictor(experiment, self._options.kept, **predicting)
        #: What was wrong with the latest lever that could not be drawn or solved.
        self.refused = ""

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
        unknown = self.residuals.errors.without.any() and not self.objective.informed
        for _ in range(options.scatter_rounds if unknown else 0):
            self.residuals.take_scatter(optimum.prediction.values)
            optimum = self.solve(optimum.probe)
        if robust:
            optimum = self._reweighted(start, optimum)
        for _ in range(options.confirmations):
            if not self.predictor.confirm(optimum.prediction):
                return optimum
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
        errors, informed = self.residuals.errors, self.objective.informed
        difference = self.residuals.own_difference(optimum.prediction.values)
        if informed and not errors.has_outliers(difference):
            return optimum
        for gently, most in ((True, options.gentle_rounds), (False, options.robust_rounds)):
            for _ in range(most):
                errors.lessen(self.residuals.own_difference(optimum.prediction.values), gently)
                # outliers can drive the first fit onto a bound, where it would stay without priors
                origin = start if gently and not informed else optimum.probe
                previous, optimum = optimum, self.solve(origin)
                if not optimum.converged or self._settled(previous, optimum):
                    break
        return optimum

    def _settled(self, previous: Optimum, optimum: Optimum) -> bool:
        """Whether the parameters have moved too little for another confirmation to matter."""
        options, objective = self._options, self.objective
        now = optimum.probe.values(objective.varied)
        size = np.maximum(np.abs(now), objective.coordinates.scale)
        least = np.minimum(options.settled * optimum.stderr, options.settled_relative * size)
        return bool(np.all(np.abs(now - previous.probe.values(objective.varied)) <= least))

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
        most = min(self.predictor.evaluations + options.most_branches, in_all)
        at, region = self.predictor.predict(start), options.first_region
        while True:
            # without priors residuals have no size that says what is near
            others = self.predictor.others(at) if objective.informed else []
            near = Subproblem(objective, at, others)
            room = objective.coordinates.room(near.origin)
            target, least = near.minimum(region=region * room)
            if self._takes_scatter:
                target, least = self._with_scatter(target, region * room, near)
            squares, step = objective.squares(at), target - near.origin
            inner = bool(np.all(np.abs(step) < 0.99 * region * room))
            left, enough = objective.decrement(at), self._tolerance(at)
            # a step within the region that gains nothing is as good as none
            if left <= enough or (inner and squares - least <= enough):
                return self._optimum(at, left, converged=True)
            if region < options.smallest_region or self.predictor.evaluations >= most:
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
        unknown = bool(self.residuals.errors.without.any())
        return unknown and self.objective.informed and self._options.scatter_rounds > 0

    def _check_start(self, start: Probe) -> None:
        values = start.values(self.objective.varied).tolist()
        for parameter, value in zip(self.objective.coordinates.parameters, values, strict=True):
            if not parameter.lower <= value <= parameter.upper:
                raise InputError(
                    f"{parameter.name} = {value:g} to start from, expected a value between "
                    f"{parameter.lower:g} and {with_unit(f'{parameter.upper:g}', parameter.unit)}"
                )

    def _is_near(self, left: float) -> bool:
        """Whether an optimum is so near that its errors hold, if values are not smooth there."""
        return self.objective.informed and left <= self._options.decrement_where_rough

    def _tolerance(self, at: Prediction) -> float:
        """Return by how much the sum of squares may still fall where a search ends."""
        objective, residuals, options = self.objective, self.residuals, self._options
        squares, difference = objective.squares(at), residuals.difference(at.values)
        noise = 1.0 if objective.informed else residuals.errors.noise_squares(difference)
        # so far above what noise explains that no lever is near
        hopeless = squares > options.misfit * residuals.size * noise
        least = (options.negligible_of_misfit if hopeless else options.negligible) * squares
        if objective.informed:
            return float(max(options.decrement, least))
        precise = residuals.size * (options.precision * residuals.errors.unit_weight) ** 2
        return float(max(options.relative_decrement * noise, least, precise))

    def _optimum(self, at: Prediction, left: float, *, converged: bool) -> Optimum:
        return Optimum(self, at, left, converged, self.objective.common_noise_covariance(at))

    def _trial(self, at: Prediction, point: Array) -> Prediction | None:
        """Solve the lever of a point; None if it cannot be drawn or solved."""
        try:
            return self.predictor.predict(self.objective.at(at.probe, point))
        except HotleverError as error:
            self.refused = str(error)
            return None

    def _with_scatter(self, point: Array, region: Array, near: Subproblem) -> tuple[Array, float]:
        """Take scatter and optimum in turns, among parameters near those of a prediction."""
        options, least = self._options, np.inf
        for _ in range(options.scatter_rounds):
            values, slopes = near.predict(point)
            leverage = self.objective.leverage(slopes, point)
            self.residuals.take_scatter(values, leverage, options.discrepancy)
            point, least = near.minimum(point, region)
        return point, least
