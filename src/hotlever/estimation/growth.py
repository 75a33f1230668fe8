"""Where a search begins whose lever shows something else than the data: with the cold lever.

The resistance of a cold lever tells its doping and size, whatever it does when hot. So a lever that
is far from the data is first made to show their coldest rows, then more and more of them; each
portion begins where the last has led, and no candidate is asked for biases that it cannot take.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimation.experiment import Experiment, Prediction
from hotlever.estimation.objective import Objective
from hotlever.estimation.optimiser import Optimiser
from hotlever.estimation.residuals import Residuals
from hotlever.estimation.search_options import SearchOptions
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.parameters import dimensions_of, parameters_of
from hotlever.probe.priors import JointPrior, Prior, default_priors
from hotlever.types import Progress

#: Portions of the rows by which a lever grows, the last of which is all of them; the least rows.
_PORTIONS, _FEWEST = 6, 3
#: A lever is far from data that differ from what it shows by this share of the largest (median).
_FAR = 0.06
#: By how much the usual priors are widened, and the spread of what has none, where only the
#: directions are to be closed that a few cold rows leave open.
_WIDENED, _OPEN = 4.0, 0.5
#: Share of a dimension by which a mesh follows it well; edges' bias moves all of them.
_FOLLOWED = 0.2
#: A portion is to be met within some per cent: the next moves the lever anyway.
_ROUGHLY = SearchOptions(
    most_branches=4, decrement=2.0, scatter_rounds=0, first_region=0.7, largest_region=1.2
)


def far_from(residuals: Residuals, at: Prediction) -> bool:
    """Whether a lever shows something else than the data."""
    share = residuals.difference(at.values) / residuals.largest
    # a few wrong rows are no other lever
    return bool(np.nanmax(np.nanmedian(np.abs(share), axis=1)) > _FAR)


def grown(
    model: Experiment,
    measurement: Measurement,
    observables: Sequence[str],
    start: Probe,
    varied: list[str],
    priors: Mapping[str, Prior] | None = None,
    joint: JointPrior | None = None,
    progress: Progress | None = None,
) -> tuple[Experiment, Probe]:
    """Return a lever that shows nearly what was measured, up to the hottest portion of the rows.

    With it the model is returned that is to search on from there.

    Parameters
    ----------
    model : Experiment
        At rest.
    measurement : Measurement
    observables : sequence of str
    start : Probe
        As it is known beforehand.
    varied : list of str
    priors, joint
        What is known beforehand; without either the usual priors close what cold rows leave open.
    progress : callable, optional

    Raises
    ------
    ComputationError
        If the lever cannot be solved at the start, cold as it is.
    """
    model = model.coarse()
    known = dict(priors or {}) if priors or joint is not None else _closing(start, varied)
    bias = np.abs(measurement.bias_V)
    heated = np.unique(bias[np.isfinite(measurement.current_mA) & (bias > 0)])
    for portion in range(1, _PORTIONS):
        count = max(_FEWEST, -(-heated.size * portion // _PORTIONS))
        if count >= heated.size:
            break
        part = measurement.part(bias <= heated[count - 1])
        names = [name for name in observables if np.isfinite(part.observable(name)).any()]
        residuals = Residuals(part, names, "errors")
        if has_moved(model.drawn, start):
            model = model.drawn_anew(start)
        of_part = model.measuring(residuals.bias, residuals.shown)
        objective = Objective(residuals, start, of_part.names, varied, known, joint)
        problem = Optimiser(of_part, objective, progress=progress, options=_ROUGHLY)
        try:
            start = problem.solve(start).probe
        except ComputationError:
            if portion == 1:
                raise
            break
    return model.drawn_anew(start) if has_moved(model.drawn, start) else model, start


def has_moved(drawn: Probe, probe: Probe) -> bool:
    """Whether a probe's dimensions are far from those that a mesh was drawn with."""
    names = dimensions_of(probe)
    before, now = drawn.at(names), probe.at(names)
    return bool(np.any(np.abs(now - before) > _FOLLOWED * np.abs(before)))


def _closing(probe: Probe, varied: Sequence[str]) -> dict[str, Prior]:
    """Return wide priors about a probe for all that is varied."""
    usual, every = default_priors(probe), parameters_of(probe, anywhere=True)
    closing = {}
    for name, value in zip(varied, probe.at(list(varied)).tolist(), strict=True):
        if name in usual:
            prior = usual[name]
            closing[name] = Prior(value, _WIDENED * prior.spread, prior.relative)
        elif every[name].lower > 0:
            closing[name] = Prior(value, _OPEN)
        else:
            closing[name] = Prior(value, _OPEN * every[name].scale, relative=False)
    return closing
