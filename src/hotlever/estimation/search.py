"""A search for a lever: from where it begins, and which of two ends counts.

The resistance of a cold lever tells its doping and size, whatever it does when hot. So a lever that
is far from the data is first made to show their coldest rows, then more and more of them; each
portion begins where the last has led, and no candidate is asked for biases that it cannot take.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimation.experiment import Experiment, ExperimentAtRest, Prediction
from hotlever.estimation.objective import Objective
from hotlever.estimation.optimiser import Optimiser, Optimum
from hotlever.estimation.options import SearchOptions
from hotlever.estimation.prior_density import FLAT, PriorDensity
from hotlever.estimation.residuals import Residuals
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.parameters import dimensions_of, parameters_of
from hotlever.probe.priors import Prior, default_priors
from hotlever.types import Progress

#: A lever is far from data that differ from what it shows by this share of the largest (median).
_FAR = 0.06
#: Portions by which a lever grows, the last of which is all of the rows; the least rows of one.
_PORTIONS, _FEWEST_ROWS = 6, 3
#: By how much the usual priors are widened, and the spread of what has none, where only the
#: directions are to be closed that a few cold rows leave open.
_WIDENED, _OPEN = 4.0, 0.5
#: Share of a dimension by which a mesh follows it well; edges' bias moves all of them.
_MESH_FOLLOWS = 0.2
#: A portion is to be met within some per cent: the next moves the lever anyway.
_OF_PORTIONS = SearchOptions(
    most_branches=4, decrement=2.0, scatter_rounds=0, first_region=0.7, largest_region=1.2
)


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
    prior : PriorDensity
    progress, seen : callable, optional
        See `hotlever.estimation.optimiser.Predictor`.
    """

    residuals: Residuals
    start: Probe
    varied: list[str]
    robust: bool
    prior: PriorDensity = FLAT
    progress: Progress | None = None
    seen: Callable[[Prediction], None] | None = None

    def near(self, experiment: Experiment, start: Probe) -> Optimum:
        """Search from a lever that is not far from the one that was measured."""
        return self._optimiser(experiment, start).solve_and_confirm(start, self.robust)

    def from_anywhere(self, experiment: ExperimentAtRest, measurement: Measurement) -> Optimum:
        """Search from a lever of which little may be known.

        If it shows something else than the data, or the search leads to a lever that does, it first
        grows; of two ends the one that describes the data better counts.

        Raises
        ------
        ComputationError
            If the lever cannot be solved at the start.
        """
        ends: list[Optimum] = []
        optimiser = self._optimiser(experiment, self.start)
        with suppress(ComputationError):
            if not _is_far(self.residuals, optimiser.predictor.predict(self.start)):
                ends.append(optimiser.solve_and_confirm(self.start, self.robust))
                if ends[0].describes_data:
                    return ends[0]
        grown, nearer = self._grown(experiment, measurement)
        if ends and nearer == self.start:
            # cold rows say nothing else, and the same search would come to the same end
            return ends[0]
        try:
            ends.append(self.near(grown, nearer))
        except ComputationError:
            if not ends:
                raise
        return min(ends, key=lambda end: (not end.describes_data, end.misfit))

    def _optimiser(self, experiment: Experiment, start: Probe) -> Optimiser:
        residuals = self.residuals.afresh()
        objective = Objective(residuals, start, experiment.names, self.varied, self.prior)
        return Optimiser(objective, experiment, progress=self.progress, seen=self.seen)

    def _grown(
        self, experiment: ExperimentAtRest, measurement: Measurement
    ) -> tuple[ExperimentAtRest, Probe]:
        """Return a lever that shows nearly what was measured, up to the hottest portion of rows.

        With it the experiment is returned that is to be searched on with. Without priors the usual
        ones close what cold rows leave open.
        """
        experiment, start = experiment.coarse(), self.start
        prior = (
            self.prior if self.prior.names else PriorDensity.of_priors(_closing(start, self.varied))
        )
        bias = np.abs(measurement.bias_V)
        current = measurement.current(start.circuit)
        heated = np.unique(bias[np.isfinite(current) & (bias > 0)])
        for portion in range(1, _PORTIONS):
            count = max(_FEWEST_ROWS, -(-heated.size * portion // _PORTIONS))
            if count >= heated.size:
                break
            part = measurement.part(bias <= heated[count - 1])
            with_data = set(part.observables)
            residuals = Residuals(
                part, [name for name in self.residuals.observables if name in with_data], "errors"
            )
            if _has_moved(experiment.fast.drawn, start):
                experiment = experiment.drawn_anew(start)
            of_part = experiment.measuring(*residuals.at_rest)
            objective = Objective(residuals, start, of_part.names, self.varied, prior)
            # what is seen of a portion is not seen at the rows of the measurement
            optimiser = Optimiser(objective, of_part, _OF_PORTIONS, progress=self.progress)
            try:
                start = optimiser.solve(start).probe
            except ComputationError:
                if portion == 1:
                    raise
                break
        moved = _has_moved(experiment.fast.drawn, start)
        return (experiment.drawn_anew(start) if moved else experiment), start


def _is_far(residuals: Residuals, at: Prediction) -> bool:
    """Whether a lever shows something else than the data."""
    share = residuals.difference(at.values) / residuals.largest
    # a few wrong rows are no other lever
    return bool(np.nanmax(np.nanmedian(np.abs(share), axis=1)) > _FAR)


def _has_moved(drawn: Probe, probe: Probe) -> bool:
    """Whether a probe's dimensions are far from those that a mesh was drawn with."""
    names = dimensions_of(probe)
    before, now = drawn.values(names), probe.values(names)
    return bool(np.any(np.abs(now - before) > _MESH_FOLLOWS * np.abs(before)))


def _closing(probe: Probe, varied: Sequence[str]) -> dict[str, Prior]:
    """Return wide priors about a probe for all that is varied."""
    usual, every = default_priors(probe), parameters_of(probe, anywhere=True)
    closing = {}
    for name, value in zip(varied, probe.values(list(varied)).tolist(), strict=True):
        if name in usual:
            prior = usual[name]
            closing[name] = Prior(value, _WIDENED * prior.spread, prior.relative)
        elif every[name].lower > 0:
            closing[name] = Prior(value, _OPEN)
        else:
            closing[name] = Prior(value, _OPEN * every[name].scale, relative=False)
    return closing
