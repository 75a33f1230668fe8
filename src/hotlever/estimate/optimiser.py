"""The least-squares problem of an estimate: Gauss-Newton steps, robust weights, confirmation.

A lever is solved with its exact derivatives. Near it, voltages at a given tip temperature are
nearly powers of the parameters; the optimum among such neighbours, within a region that grows and
shrinks with how well they tell, is solved next. A search ends where the gradient does: where
Gauss and Newton's step would lower the sum of squares by next to nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimate.diagnosis import lack_of_fit_text
from hotlever.estimate.experiment import Prediction, Predictor
from hotlever.estimate.objective import Objective, Subproblem
from hotlever.estimate.options import SearchOptions
from hotlever.estimate.residuals import Residuals
from hotlever.probe import Probe
from hotlever.text import with_unit
from hotlever.types import Array


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
    def objective(self) -> Objective:
        """What is least for it."""
        return self.optimiser.objective

    @property
    def predictor(self) -> Predictor:
        """What predicts levers like it, by the experiment that was confirmed last."""
        return self.optimiser.predictor

    @property
    def residuals(self) -> Residuals:
        """The data that it is compared with, with their weights."""
        return self.objective.residuals

    @property
    def stderr(self) -> Array:
        """Standard errors from the covariance, (p,); infinite where there are none."""
        variance = np.diag(self.covariance)
        return np.sqrt(np.where(variance > 0, variance, np.inf))

    @property
    def describes_data(self) -> bool:
        """Whether the search converged to a lever that describes the data."""
        return self.converged and not lack_of_fit_text(self.residuals, self.prediction.values)

    @property
    def misfit(self) -> float:
        """The mean square of differences, as shares of the largest of each observable."""
        share = self.residuals.difference(self.prediction.values) / self.residuals.largest
        return float(np.nanmean((self.residuals.errors.down * share) ** 2))


class Optimiser:
    """Finds the parameters whose prediction is nearest to a measurement.

    Parameters
    ----------
    objective : Objective
    predictor : Predictor
    options : SearchOptions, optional
        In place of those of the residuals.

    Attributes
    ----------
    steps : int
        Levers that led nearer to the optimum.
    """

    def __init__(
        self,
        objective: Objective,
        predictor: Predictor,
        options: SearchOptions | None = None,
    ) -> None:
        self.objective, self.residuals, self.predictor = objective, objective.residuals, predictor
        self._options, self.steps = options or self.residuals.numerics.search, 0
        self._most = self._options.most_in_estimate
        if objective.informed:
            self._most = min(self._most, predictor.evaluations + self._options.most_in_all)
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
        if robust and not self.objective.informed:
            self._most = 2 * self._options.most_in_estimate
        optimum = self.solve(start, roughly=True)
        unknown = self.residuals.errors.without.any() and not self.objective.informed
        for _ in range(self._options.scatter_rounds if unknown else 0):
            self.residuals.take_scatter(optimum.prediction.values)
            optimum = self.solve(optimum.probe, roughly=True)
        if robust:
            optimum = self._reweighted(start, optimum)
        for _ in range(self._options.confirmations):
            if not self.predictor.confirm(optimum.prediction):
                return self.solve(optimum.probe) if self.objective.informed else optimum
            previous, optimum = optimum, self.solve(optimum.probe)
            if not optimum.converged or self._settled(previous, optimum):
                return optimum
        return replace(optimum, converged=False)

    def _reweighted(self, start: Probe, optimum: Optimum) -> Optimum:
        """Lessen the weight of outliers until nothing changes: gently at first.

        With priors outliers stand out at once, since these hold a fit that others would pull along;
        without any there is nothing to do, and with some the levers near the optimum tell which.
        """
        errors, options = self.residuals.errors, self._options
        rounds = ((True, options.gentle_rounds), (False, options.robust_rounds))
        if self.objective.informed:
            difference = self.residuals.own_difference(optimum.prediction.values)
            for _ in range(options.robust_rounds if errors.has_outliers(difference) else 0):
                near = Subproblem(self.objective, optimum.prediction)
                for gently, most in rounds:
                    self._lessen_nearby(near, gently, most)
                previous, optimum = optimum, self.solve(optimum.probe, roughly=True)
                if not optimum.converged or self._settled(previous, optimum):
                    break
            return optimum
        for gently, most in rounds:
            for _ in range(most):
                errors.lessen(self.residuals.own_difference(optimum.prediction.values), gently)
                # outliers can drive the first fit onto a bound, where it would stay
                origin = start if gently else optimum.probe
                previous, optimum = optimum, self.solve(origin, roughly=True)
                if not optimum.converged or self._settled(previous, optimum):
                    break
        return optimum

    def _lessen_nearby(self, near: Subproblem, gently: bool, most: int) -> None:
        """Lessen the weight of outliers, by the levers near one that was solved."""
        objective, options = self.objective, self._options
        region = options.first_region * objective.coordinates.room(near.origin)
        point = near.origin
        for _ in range(most):
            try:
                values, slopes = near.predict(point)
            except ComputationError:  # the lever that is solved next tells
                break
            self.residuals.errors.lessen(self.residuals.own_difference(values), gently)
            before, (point, _) = point, near.minimum(point, region)
            if self._takes_scatter:
                point, _ = self._with_scatter(point, region, near)
            stderr = np.sqrt(np.diag(objective.laplace(slopes, point)))
            if np.all(np.abs(point - before) <= options.settled * stderr):
                break

    @property
    def _takes_scatter(self) -> bool:
        """Whether the noise of some observables is found with the optimum."""
        unknown = bool(self.residuals.errors.without.any())
        return unknown and self.objective.informed and self._options.scatter_rounds > 0

    def _settled(self, previous: Optimum, optimum: Optimum) -> bool:
        """Whether the parameters have moved too little for another confirmation to matter."""
        objective, options = self.objective, self._options
        now = optimum.probe.values(objective.varied)
        size = np.maximum(np.abs(now), objective.coordinates.scale)
        least = np.minimum(options.settled * optimum.stderr, options.settled_relative * size)
        return bool(np.all(np.abs(now - previous.probe.values(objective.varied)) <= least))

    def solve(self, start: Probe, *, roughly: bool = False) -> Optimum:
        """Find the optimum of the present model and weights, or roughly, to be confirmed.

        Raises
        ------
        InputError
            If a parameter starts outside its bounds.
        ComputationError
            If the lever cannot be solved at the start.
        """
        objective, options = self.objective, self._options
        self._check_start(start)
        most = min(self.predictor.evaluations + options.most_branches, self._most)
        takes_scatter = self._takes_scatter
        at, region, creeping = self.predictor.predict(start), options.first_region, 0
        while True:
            # without priors residuals have no size that says what is near
            others = self.predictor.others(at) if objective.informed else []
            near = Subproblem(objective, at, others)
            room = objective.coordinates.room(near.origin)
            target, least = near.minimum(region=region * room)
            if takes_scatter:
                target, least = self._with_scatter(target, region * room, near)
            squares, step = objective.squares(at), target - near.origin
            inner = bool(np.all(np.abs(step) < 0.99 * region * room))
            left, enough = objective.decrement(at), self._tolerance(at, roughly)
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
            creeping = creeping + 1 if self._creeps(at, squares - least) else 0
            if creeping > options.creeping_steps:
                return self._optimum(at, left, converged=True)
            length = float(np.max(np.abs(step) / room))
            trial = self._trial(at, target)
            better = np.inf if trial is None else objective.squares(trial)
            gain = (squares - better) / max(squares - least, 1e-300)
            # neighbours tell the less, the further away they are
            if gain < 0.25:
                region = 0.3 * length
            elif gain > 0.7:
                region = min(max(region, 2.0 * length), options.largest_region)
            if trial is not None and better < squares:
                self.steps += 1
                at = trial

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
        return self.objective.informed and left <= self._options.small_decrement

    def _creeps(self, at: Prediction, promised: float) -> bool:
        """Whether a step of a search without priors promises next to nothing."""
        if self.objective.informed:
            return False
        return promised <= self._options.small_decrement * self._noise(at)

    def _noise(self, at: Prediction) -> float:
        """Return the sum of squares that a standard error costs."""
        if self.objective.informed:
            return 1.0
        return self.residuals.errors.noise_squares(self.residuals.difference(at.values))

    def _tolerance(self, at: Prediction, roughly: bool) -> float:
        """Return by how much the sum of squares may still fall where a search ends."""
        objective, residuals, options = self.objective, self.residuals, self._options
        squares, noise = objective.squares(at), self._noise(at)
        # so far above what noise explains that no lever is near
        hopeless = squares > options.misfit * residuals.size * noise
        least = (options.negligible_of_misfit if hopeless else options.negligible) * squares
        if objective.informed:
            decrement = options.rough_decrement if roughly else options.decrement
            return float(max(decrement, least))
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
        least = np.inf
        for _ in range(self._options.scatter_rounds):
            values, slopes = near.predict(point)
            leverage = self.objective.leverage(slopes, point)
            self.residuals.take_scatter(values, leverage, self._options.discrepancy)
            point, least = near.minimum(point, region)
        return point, least
