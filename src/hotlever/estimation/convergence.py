"""When a search ends: where the gradient does, in units of the priors and of the noise."""

from __future__ import annotations

import numpy as np

from hotlever.estimation.experiment import Prediction
from hotlever.estimation.objective import Objective
from hotlever.estimation.search_options import SearchOptions

#: Share of the range between its bounds within which a parameter is at one of them.
_AT_BOUND = 1e-5


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
