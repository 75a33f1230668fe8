"""A search for a lever: from where it begins, and which of two ends counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimation.experiment import Experiment, Prediction
from hotlever.estimation.growth import far_from, grown
from hotlever.estimation.lack_of_fit import undescribed
from hotlever.estimation.objective import Objective
from hotlever.estimation.optimiser import Optimiser, Optimum
from hotlever.estimation.residuals import Residuals
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import JointPrior, Prior
from hotlever.types import Progress

#: The problem as it was solved, and where the search for its solution ended.
End = tuple[Optimiser, Optimum]


@dataclass(frozen=True)
class Search:
    """What is searched for.

    Attributes
    ----------
    residuals : Residuals
    start : Probe
        As the lever is known beforehand.
    varied : list of str
    robust : bool
        Whether the weight of outliers is lessened.
    priors, joint
        See `hotlever.estimation.objective.Objective`.
    progress, seen
        See `hotlever.estimation.optimiser.Optimiser`.
    """

    residuals: Residuals
    start: Probe
    varied: list[str]
    robust: bool
    priors: Mapping[str, Prior]
    joint: JointPrior | None = None
    progress: Progress | None = None
    seen: Callable[[Prediction], None] | None = None

    def near(self, forward: Any, start: Probe) -> End:
        """Search from a lever that is not far from the one that was measured."""
        problem = self._problem(forward, start)
        return problem, problem.solve_and_confirm(start, self.robust)

    def _problem(self, forward: Any, start: Probe) -> Optimiser:
        residuals = self.residuals.afresh()
        objective = Objective(residuals, start, forward.names, self.varied, self.priors, self.joint)
        return Optimiser(forward, objective, progress=self.progress, seen=self.seen)

    def from_anywhere(self, forward: Experiment, measurement: Measurement) -> End:
        """Search from a lever of which little may be known.

        If it shows something else than the data, or the search leads to a lever that does, it first
        grows (`hotlever.estimation.growth`); of two ends the one that describes the data better
        counts.

        Raises
        ------
        ComputationError
            If the lever cannot be solved at the start.
        """
        ends: list[End] = []
        problem = self._problem(forward, self.start)
        with suppress(ComputationError):
            if not far_from(self.residuals, problem.predict(self.start)):
                ends.append((problem, problem.solve_and_confirm(self.start, self.robust)))
                if _describes(*ends[0]):
                    return ends[0]
        again, nearer = grown(
            forward,
            measurement,
            self.residuals.observables,
            self.start,
            self.varied,
            self.priors,
            self.joint,
            self.progress,
        )
        if ends and nearer == self.start:
            # cold rows say nothing else, and the same search would come to the same end
            return ends[0]
        try:
            ends.append(self.near(again, nearer))
        except ComputationError:
            if not ends:
                raise
        return min(ends, key=lambda end: (not _describes(*end), _share(*end)))


def _describes(problem: Optimiser, optimum: Optimum) -> bool:
    """Whether a search has ended at a lever that describes the data."""
    values = optimum.prediction.values
    return optimum.converged and not undescribed(problem.residuals, values)


def _share(problem: Optimiser, optimum: Optimum) -> float:
    """Return the mean square of differences, as shares of the largest of each observable."""
    residuals = problem.residuals
    share = residuals.difference(optimum.prediction.values) / residuals.largest
    return float(np.nanmean((residuals.down * share) ** 2))
