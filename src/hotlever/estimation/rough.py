"""Levers near a fit's optimum, cheaply predicted: what a posterior and its band are made with."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from hotlever.estimation.experiment import (
    experiment_of,
    multiplied,
    reduced_experiment,
    shown_at_bias,
)
from hotlever.lever.branch import Reach
from hotlever.lever.certificate import estimated_error
from hotlever.lever.curve import spline_through
from hotlever.lever.lever import Lever
from hotlever.lever.reduced import ReducedLever
from hotlever.lever.reduction import cached_reduction, can_be_reduced
from hotlever.probe import Probe
from hotlever.threads import one_blas_thread
from hotlever.types import Array


class RoughModel(Protocol):
    """A lever for probes near one, at which it is exact.

    `slopes`, (3, n, p), are the derivatives of I_h, V_r and T_tip there by the parameters `names`.
    """

    names: tuple[str, ...]
    slopes: Array

    def predict(self, probe: Probe) -> Array:
        """Return I_h (mA), V_r (V) and T_tip (K) at the biases, shape (3, n).

        Raises
        ------
        ComputationError
            If the lever has no state below the melting point at one of them.
        """
        ...

    def error_K(self, probe: Probe) -> float:
        """Return by how much the tip temperature of a probe may be off (K)."""
        ...


def rough_model(probe: Probe, names: list[str], bias: Array) -> RoughModel:
    """Return the rough model for a fit's parameters: a reduced lever where one serves.

    Raises
    ------
    ComputationError
        If the lever cannot be solved.
    """
    if can_be_reduced(probe, names):
        lever = Lever(probe)
        return OtherMaterials(lever, cached_reduction(lever, names=names), bias)
    return SimilarProbes(probe, tuple(names), bias)


class OtherMaterials:
    """A reduced lever for materials near that of a lever; cheap: each state starts at its root.

    It stays on the few points of the reduced lever. By what factor voltages and currents differ
    there from those of the lever's own material at the same tip temperature is taken over to the
    full lever's branch.
    """

    def __init__(self, lever: Lever, reduced: ReducedLever, bias: Array) -> None:
        model, probe = reduced_experiment(lever, reduced, bias), lever.probe
        self.names = model.names
        first = model.predict(probe)
        exact = model.confirmed(first)
        at = exact.predict(probe, first)
        assert exact.offset is not None
        self.slopes = at.slopes
        self._lever, self._bias, self._reduced = lever, bias, reduced
        self._near = at.linearised
        self._branch = exact.offset.added(at.linearised.branch, probe.at(exact.names))
        self._u = self._branch.u[1:]
        few, found = reduced.solved(
            probe, self._u, at.linearised.branch.x[:, 1:], at.linearised.factors
        )
        self._shown = few.observed(found.x).T

    @one_blas_thread
    def predict(self, probe: Probe) -> Array:
        """See `RoughModel`."""
        guess = self._near.states(probe)[:, 1:]
        few, found = self._reduced.solved(probe, self._u, guess, self._near.factors)
        ratio = few.observed(found.x).T / self._shown
        # without power the ratio is that of a barely warm lever
        ratio = np.concatenate([ratio[:1], ratio])
        bend = spline_through(self._branch.u, ratio)(self._branch.u, 1)
        branch = multiplied(self._branch, ratio, bend / ratio)
        return shown_at_bias(branch, self._lever.circuit, self._bias)[1]

    def error_K(self, probe: Probe) -> float:
        """Return what the full lever's residual says of the reduced one (K)."""
        reach = Reach(probe.circuit, float(self._bias.max()))
        branch = self._reduced.linearised(probe, reach).branch
        u = branch.u[np.linspace(1, branch.u.size - 1, 4).astype(int)]
        lever = self._lever.with_probe(probe)
        return float(estimated_error(lever, branch, u)[2].max())


class SimilarProbes:
    """A lever with other dimensions and another circuit too, by the powers of its parameters.

    See `hotlever.estimation.experiment.Nearby`.
    """

    def __init__(self, probe: Probe, names: tuple[str, ...], bias: Array) -> None:
        model = experiment_of(probe, bias, names=names)
        first = model.predict(probe)
        self._model = model.confirmed(first)
        self._at = self._model.predict(probe, first)
        self.names, self.slopes = names, self._at.slopes

    def predict(self, probe: Probe) -> Array:
        """See `RoughModel`."""
        return self._at.nearby.predict(probe.at(self.names))[0]

    def error_K(self, probe: Probe) -> float:
        """Return the difference from a lever that is solved (K)."""
        solved = self._model.predict(probe, self._at).values[2]
        return float(np.abs(self.predict(probe)[2] - solved).max())
