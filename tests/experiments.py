"""Experiments with levers that tests choose: as they are, or reduced."""

from __future__ import annotations

from hotlever.estimation.experiment_at_rest import ExperimentAtRest
from hotlever.lever import Lever
from hotlever.lever.reduced.lever import ReducedLever
from hotlever.lever.similar import SimilarLevers
from hotlever.probe.parameters import usual_parameters
from hotlever.types import Array


def full_experiment(lever: Lever, bias: Array) -> ExperimentAtRest:
    """Return a lever as forward model, just as it is."""
    return ExperimentAtRest(SimilarLevers(lever), None, bias, usual_parameters(lever.probe))


def reduced_experiment(lever: Lever, reduced: ReducedLever, bias: Array) -> ExperimentAtRest:
    """Return a reduced lever, corrected by the full one, as forward model."""
    return ExperimentAtRest(reduced, SimilarLevers(lever), bias, reduced.names)
