"""A search for a lever: from where it begins, and which of two ends counts."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimation.experiment import Experiment, Prediction
from hotlever.estimation.growth import far_from, grown
from hotlever.estimation.lack_of_fit import undescribed
from hotlever.estimation.optimiser import Optimiser, Optimum
from hotlever.estimation.options import FitOptions
from hotlever.estimation.residuals import Residuals
from hotlever.measurement import Measurement
from hotlever.probe import Probe


def search_near(
    forward: Any,
    residuals: Residuals,
    start: Probe,
    options: FitOptions,
    search: dict[str, Any],
    seen: Callable[[Prediction], None] | None,
) -> tuple[Optimiser, Optimum]:
    """Search from a lever that is not far from the one that was measured."""
    own = residuals.afresh()
    problem = Optimiser(forward, own, start, options.varied, seen=seen, **search)
    return problem, problem.solve_and_confirm(options.robust)


def search_from_anywhere(
    forward: Experiment,
    residuals: Residuals,
    start: Probe,
    options: FitOptions,
    measurement: Measurement,
    search: dict[str, Any],
    seen: Callable[[Prediction], None] | None,
) -> tuple[Optimiser, Optimum]:
    """Search from a lever of which little may be known.

    If it shows something else than the data, or the search leads to a lever that does, it first
    grows (`hotlever.estimation.growth`); of two ends the one that describes the data better counts.

    Raises
    ------
    ComputationError
        If the lever cannot be solved at the start.
    """
    ends = []
    is_near = not _is_far(forward, residuals, start)
    if is_near:
        with suppress(ComputationError):
            ends.append(search_near(forward, residuals, start, options, search, seen))
            if _describes(*ends[0]):
                return ends[0]
    again, nearer = grown(
        forward, measurement, residuals.observables, start, options.varied, **search
    )
    if is_near and ends and nearer == start:
        # cold rows say nothing else, and the same search would come to the same end
        return ends[0]
    try:
        ends.append(search_near(again, residuals, nearer, options, search, seen))
    except ComputationError:
        if not ends:
            raise
    return min(ends, key=lambda end: (not _describes(*end), _share(*end)))


def _is_far(forward: Experiment, residuals: Residuals, start: Probe) -> bool:
    try:
        return far_from(residuals, forward.predict(start))
    except ComputationError:
        return True


def _describes(problem: Optimiser, optimum: Optimum) -> bool:
    """Whether a search has ended at a lever that describes the data."""
    values = optimum.prediction.values
    return optimum.converged and not undescribed(problem.residuals, values)


def _share(problem: Optimiser, optimum: Optimum) -> float:
    """Return the mean square of differences, as shares of the largest of each observable."""
    residuals = problem.residuals
    share = residuals.difference(optimum.prediction.values) / residuals.largest
    return float(np.nanmean((residuals.down * share) ** 2))
