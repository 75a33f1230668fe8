"""A lever estimated by its own data and those of a fit.

What the fit leaves of the lever itself is known before the other data, as one density.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.objective import PriorDensity
from hotlever.estimate.options import FitOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import Solution, solve
from hotlever.estimate.tip_temperature import OF_THE_MEASUREMENT
from hotlever.measurement import Measurement
from hotlever.probe.priors import (
    SCALES,
    Prior,
    as_known,
    default_priors,
    published_material,
    updated,
)
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.types import Progress


def solve_beside_a_fit(
    problem: Problem,
    fit: Estimate,
    priors: Mapping[str, Prior | str] | None,
    progress: Progress | None,
) -> Solution:
    """Estimate a lever by its own data and those of a fit.

    What the data of the fit leave of the lever itself is known before the other data; circuit and
    gas are those of each measurement.

    Raises
    ------
    ComputationError
        If no lever near the probe has states at all measured biases.
    """
    before, fixed = known_before_a_fit(fit, priors), dict.fromkeys(fit.options.fixed)
    options = FitOptions(
        observables=fit.observables,
        fixed=fixed,
        priors=before,
        medium=fit.probe.surroundings.medium,
        numerics=problem.options.numerics,
    )
    fitted = solve(Problem.of(fit.measurement, fit.probe, options), progress)
    if _same_data(fit.measurement, problem.measurement):
        return fitted
    varied = fitted.problem.options.varied
    own = [name for name in varied if name not in OF_THE_MEASUREMENT]
    numbers = [varied.index(name) for name in own]
    values, covariance = fitted.probe.values(own), fitted.posterior.covariance
    relative = np.array([name not in before or before[name].relative for name in own])
    left = PriorDensity.of_estimate(own, values, covariance[np.ix_(numbers, numbers)], relative)
    probe = problem.probe.replace(dict(zip(own, values.tolist(), strict=True)))
    theirs = {
        name: prior
        for name, prior in problem.known.items()
        if name in {*OF_THE_MEASUREMENT, *SCALES}
    }
    free = tuple(name for name in own if name not in usual_parameters(probe))
    medium = problem.probe.surroundings.medium
    again = replace(options, observables=None, priors=theirs, free=free, medium=medium)
    together = Problem.of(problem.measurement, probe, again, before=left)
    try:
        return solve(replace(together, known={**before, **theirs}), progress)
    except ComputationError as error:
        raise ComputationError(
            f"no lever like the fitted one shows these data; is it another lever's fit? ({error})"
        ) from error


def known_before_a_fit(fit: Estimate, priors: Mapping[str, Prior | str] | None) -> dict[str, Prior]:
    """Return what was known of a lever before it was fitted.

    The probe of a fit has the material that was found, so that this is no prior of its own.
    """
    if priors is not None and not priors:
        return {}
    stated = {**fit.options.priors, **(priors or {})}
    probe = as_known(fit.probe, stated)
    before = updated(default_priors(probe, published_material()), stated, probe, "priors")
    return {name: prior for name, prior in before.items() if name not in fit.options.fixed}


def _same_data(first: Measurement, second: Measurement) -> bool:
    columns, others = (
        (data.bias_V, data.observable("current"), data.observable("bridge"))
        for data in (first, second)
    )
    return np.array_equal(columns, others, equal_nan=True)
