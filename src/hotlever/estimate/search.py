"""The search for the lever that priors and a measurement make most likely.

The resistance of a cold lever tells its doping and size, whatever it does when hot. So a lever that
is far from the data is first made to show their coldest rows, then more and more of them; each
portion begins where the last has led, and no candidate is asked for biases that it cannot take.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimate.experiment import (
    Experiment,
    ExperimentAtRest,
    Prediction,
    PredictionAtRest,
    Predictor,
    Seen,
)
from hotlever.estimate.objective import Objective
from hotlever.estimate.optimiser import Optimiser, Optimum
from hotlever.estimate.posterior import Posterior
from hotlever.estimate.prior_density import PriorDensity
from hotlever.estimate.problem import Problem
from hotlever.estimate.residuals import Residuals
from hotlever.lever.branch import Branch
from hotlever.lever.observables import Linearised
from hotlever.lever.similar import SimilarLevers
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, PriorUse, default_priors
from hotlever.probe.probe_parameters import dimensions_of, parameters_of
from hotlever.types import Array, Progress
from hotlever.work import give_back


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
    return Solution(**vars(optimum), problem=problem, seconds=time.perf_counter() - began)


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
