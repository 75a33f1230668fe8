"""The search for the lever that priors and a measurement make most likely.

A lever is solved with its exact derivatives. Near it, voltages at a given tip temperature are
nearly powers of the parameters; the optimum among such neighbours, within a region that grows and
shrinks with how well they tell, is solved next. A search ends where the gradient does: where
Gauss and Newton's step would lower the sum of squares by next to nothing.

The resistance of a cold lever tells its doping and size, whatever it does when hot. So a lever that
is far from the data is first made to show their coldest rows, then more and more of them; each
portion begins where the last has led, and no candidate is asked for biases that it cannot take.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimate.diagnosis import lack_of_fit_text
from hotlever.estimate.experiment import (
    Experiment,
    ExperimentAtRest,
    Prediction,
    PredictionAtRest,
    Predictor,
    Seen,
)
from hotlever.estimate.objective import Objective, PriorDensity, Subproblem
from hotlever.estimate.options import SearchOptions
from hotlever.estimate.posterior import Posterior
from hotlever.estimate.problem import Problem
from hotlever.estimate.residuals import Residuals
from hotlever.lever.branch import Branch
from hotlever.lever.observables import Linearised
from hotlever.lever.similar import SimilarLevers
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, PriorUse, default_priors
from hotlever.probe.probe_parameters import dimensions_of, parameters_of
from hotlever.text import with_unit
from hotlever.types import Array, Progress
from hotlever.work import give_back


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
        """Whether the errors of data, what a model is off by among them, follow from the optimum.

        With priors data whose errors are stated are no better than the model either.
        """
        return self.objective.informed and self._options.scatter_rounds > 0

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


@dataclass(frozen=True)
class Solution(Optimum):
    """The most likely lever, with the `problem` that it solves, after so many `seconds`."""

    problem: Problem
    seconds: float

    @cached_property
    def posterior(self) -> Posterior:
        """What is known of its parameters, and of any quantity of it."""
        return Posterior(self.objective, self.prediction)

    @cached_property
    def priors(self) -> dict[str, PriorUse]:
        """What was known before, and what the data made of it."""
        names, before = self.problem.options.varied, self.problem.known
        values = self.probe.values(names).tolist()
        spreads = np.sqrt(np.diag(self.posterior.covariance)).tolist()
        used = {
            name: before[name].used(value, spread)
            for name, value, spread in zip(names, values, spreads, strict=True)
            if name in before
        }
        for error in self.residuals.common:
            size, left = self.posterior.shifts[error.name]
            after = 1.0 + error.share * size, error.share * left
            used[error.name] = PriorUse(1.0, error.share, *after)
        return used

    @property
    def branch(self) -> Branch:
        """The lever at rest, as far as it was measured, corrected by the full one."""
        assert isinstance(self.prediction, PredictionAtRest)
        return self.prediction.surrogate.branch

    def predicted(self, bias: Array) -> PredictionAtRest:
        """Return what a slow ramp shows at other biases (V), as far as the measured ones reach."""
        experiment, prediction = self.predictor.experiment, self.prediction
        assert isinstance(experiment, ExperimentAtRest)
        assert isinstance(prediction, PredictionAtRest)
        return experiment.measuring(bias, None).predict(self.probe, prediction)


# --- the search ---------------------------------------------------------------------------------


def solve(
    problem: Problem,
    progress: Progress | None = None,
    seen: Seen | None = None,
    stated: Linearised | None = None,
) -> Solution:
    """Find the lever that priors and a measurement make most likely.

    Parameters
    ----------
    problem : Problem
    progress, seen : callable, optional
        See `hotlever.estimate.experiment.Predictor`.
    stated : Linearised, optional
        The lever as it is stated, on the coarse mesh, if it has been solved.

    Raises
    ------
    ComputationError
        If the lever cannot be solved at the start, or the search does not settle.
    """
    began = time.perf_counter()
    give_back()  # what an earlier one used
    search, experiment = Search(problem, progress, seen, stated), problem.experiment
    if isinstance(experiment, ExperimentAtRest):
        optimum = search.from_anywhere(experiment)
    else:
        optimum = search.near(experiment, problem.start)
    return search.solution(optimum, began)


@dataclass(frozen=True)
class Search:
    """The searches for the lever of a problem, of which ``progress`` and ``seen`` are told.

    The first may begin with the lever as ``stated``; see `solve`.
    """

    problem: Problem
    progress: Progress | None = None
    seen: Seen | None = None
    stated: Linearised | None = None

    def near(self, experiment: Experiment, start: Probe, before: int = 0) -> Optimum:
        """Search from a lever that is not far from the one that was measured.

        The levers that were solved `before` count.
        """
        optimiser = self.optimiser(experiment, start, before)
        return optimiser.solve_and_confirm(start, self.problem.options.robust)

    def solution(self, optimum: Optimum, began: float) -> Solution:
        """Return an optimum as the solution of the problem, begun at a time of the clock (s)."""
        own = {field.name: getattr(optimum, field.name) for field in fields(optimum)}
        return Solution(**own, problem=self.problem, seconds=time.perf_counter() - began)

    def from_anywhere(self, experiment: ExperimentAtRest) -> Optimum:
        """Search from a lever of which little may be known.

        If it shows something else than the data, or the search leads to a lever that does, that
        jumps on the way or ends before the data do, it first grows; of two ends the one that
        describes the data better counts.

        Raises
        ------
        ComputationError
            If the lever cannot be solved at the start.
        """
        problem, ends = self.problem, list[Optimum]()
        near = self._as_stated(experiment)
        optimiser = self.optimiser(experiment, problem.start, int(near is not None), near)
        with suppress(ComputationError):
            if not _is_far(problem.residuals, optimiser.predictor.predict(problem.start)):
                ends.append(optimiser.solve_and_confirm(problem.start, problem.options.robust))
                if ends[0].describes_data and not _may_mislead(ends[0]):
                    return ends[0]
        before = optimiser.predictor.evaluations
        # by fewer portions a lever comes another way: worth it where the first ends at jumps
        for portions in (6, 4):
            try:
                grown, nearer, before = self._grown(experiment, before, portions)
                if ends and nearer == problem.start:
                    # cold rows say nothing else, and the same search would come to the same end
                    break
                ends.append(self.near(grown, nearer, before))
            except ComputationError:
                if not ends:
                    raise
                break
            if not (ends[-1].describes_data and _may_mislead(ends[-1])):
                break
            before = ends[-1].predictor.evaluations
        return min(
            ends,
            key=lambda end: (
                not end.describes_data,
                bool(end.prediction.without_state.any()),
                end.misfit,
            ),
        )

    def _as_stated(self, experiment: ExperimentAtRest) -> PredictionAtRest | None:
        """Return what is shown by the lever as stated, if it is one that an experiment solves."""
        # rows over a sample belong to several levers, and a reduced one has other states
        simple = type(experiment) is ExperimentAtRest and isinstance(experiment.fast, SimilarLevers)
        if self.stated is None or not simple or self.stated.names != experiment.names:
            return None
        reach = experiment.reach(self.stated.probe)
        return experiment.shown_by(self.stated.up_to(reach)) if reach.lowest_V is None else None

    def optimiser(
        self,
        experiment: Experiment,
        start: Probe,
        before: int = 0,
        near: Prediction | None = None,
    ) -> Optimiser:
        """Return what searches from a lever, which may be solved as `near`, after others."""
        problem = self.problem
        residuals, varied = problem.residuals.afresh(), problem.options.varied
        objective = Objective(residuals, start, experiment.names, varied, problem.prior)
        predictor = Predictor(experiment, self.progress, self.seen, near, before)
        return Optimiser(objective, predictor)

    def _grown(
        self, experiment: ExperimentAtRest, before: int, portions: int
    ) -> tuple[ExperimentAtRest, Probe, int]:
        """Return a lever that shows nearly what was measured, but for the hottest of some portions.

        With it the experiment is returned that is to be searched on with, and the levers that were
        solved, with those `before`. Without priors the usual ones close what cold rows leave open.
        """
        problem, experiment = self.problem, experiment.coarse()
        start, measurement, varied = problem.start, problem.measurement, problem.options.varied
        prior = problem.prior
        if not problem.informed:
            prior = PriorDensity.of_priors(_closing(start, varied))
        bias = np.abs(measurement.bias_V)
        current = measurement.current(start.circuit)
        heated = np.unique(bias[np.isfinite(current) & (bias > 0)])
        # each is to be met within some per cent: the next moves the lever anyway
        numerics = problem.options.numerics
        options = replace(
            numerics.search,
            most_branches=4,
            decrement=2.0,
            scatter_rounds=0,
            first_region=0.7,
            largest_region=1.2,
        )
        for portion in range(1, portions):
            count = max(3, -(-heated.size * portion // portions))
            if count >= heated.size:
                break
            part = measurement.part(bias <= heated[count - 1])
            with_data = set(part.observables)
            residuals = Residuals(
                part,
                [name for name in problem.residuals.observables if name in with_data],
                "errors",
                numerics=numerics,
            )
            if _has_moved(experiment.fast.drawn, start):
                experiment = experiment.drawn_anew(start)
            of_part = experiment.measuring(*residuals.at_rest)
            objective = Objective(residuals, start, of_part.names, varied, prior)
            # what is seen of a portion is not seen at the rows of the measurement
            predictor = Predictor(of_part, self.progress, before=before)
            try:
                start = Optimiser(objective, predictor, options).solve(start).probe
                before = predictor.evaluations
            except ComputationError:
                if portion == 1:
                    raise
                break
        mesh_is_outdated = _has_moved(experiment.fast.drawn, start)
        return (experiment.drawn_anew(start) if mesh_is_outdated else experiment), start, before


def _is_far(residuals: Residuals, at: Prediction) -> bool:
    """Whether a lever shows something else than the data."""
    share = residuals.difference(at.values) / residuals.largest
    # by the median: a few wrong rows are no other lever
    return bool(np.nanmax(np.nanmedian(np.abs(share), axis=1)) > 0.06)


def _may_mislead(end: Optimum) -> bool:
    """Whether a lever jumps below the highest bias, or has no state at one.

    Rows beside a jump may be on either side of it, so that a search may end at jumps that the data
    have not, where another lever describes them better without. A row that a lever has no state for
    is far from it, and passes for an outlier.
    """
    if end.prediction.without_state.any():
        return True
    prediction, circuit = end.prediction, end.probe.circuit
    if not isinstance(prediction, PredictionAtRest) or not circuit.starts_cold:
        return False
    highest = np.abs(prediction.columns["bias_V"]).max(keepdims=True)
    return bool(prediction.surrogate.branch.read(circuit, highest).jumps)


def _has_moved(drawn: Probe, probe: Probe) -> bool:
    """Whether a probe's dimensions are far from those that a mesh was drawn with."""
    names = dimensions_of(probe)
    before, now = drawn.values(names), probe.values(names)
    # a mesh follows a fifth well; edges' bias moves all of them
    return bool(np.any(np.abs(now - before) > 0.2 * np.abs(before)))


def _closing(
    probe: Probe, varied: Sequence[str], widening: float = 4.0, spread: float = 0.5
) -> dict[str, Prior]:
    """Return wide priors about a probe for all that is varied.

    They close only the directions that a few cold rows leave open: the usual ones are widened, and
    what has none gets a spread.
    """
    usual, every = default_priors(probe), parameters_of(probe, anywhere=True)
    closing = {}
    for name, value in zip(varied, probe.values(list(varied)).tolist(), strict=True):
        if name in usual:
            prior = usual[name]
            closing[name] = Prior(value, widening * prior.spread, prior.relative)
        elif every[name].lower > 0:
            closing[name] = Prior(value, spread)
        else:
            closing[name] = Prior(value, spread * every[name].scale, relative=False)
    return closing
