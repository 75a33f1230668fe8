"""Experiments with levers that tests choose: as they are, or reduced, or on coarse meshes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from hotlever.estimate import Estimate, fit
from hotlever.estimate.experiment import ExperimentAtRest
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced_lever import ReducedLever
from hotlever.lever.similar import SimilarLevers
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.types import Array


def full_experiment(lever: Lever, bias: Array) -> ExperimentAtRest:
    """Return a lever as forward model, just as it is."""
    return ExperimentAtRest(SimilarLevers(lever), None, bias, usual_parameters(lever.probe))


def reduced_experiment(lever: Lever, reduced: ReducedLever, bias: Array) -> ExperimentAtRest:
    """Return a reduced lever, corrected by the full one, as forward model."""
    return ExperimentAtRest(reduced, SimilarLevers(lever), bias, reduced.names)


@contextmanager
def on_coarse_meshes() -> Iterator[None]:
    """Let levers of this process have the coarse mesh where they would have the usual one.

    For what is said, written and drawn of a lever, whatever its numbers are in the fourth digit.
    """
    make = Lever.__init__

    def made_coarse(self: Lever, probe: Any, mesh: Any = None, **others: Any) -> None:
        make(self, probe, mesh or COARSE, **others)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Lever, "__init__", made_coarse)
        yield


def coarse_fit(*arguments: Any, **options: Any) -> Estimate:
    """Fit on coarse meshes, in the worker processes of a batch too."""
    with on_coarse_meshes():
        return fit(*arguments, **options)
