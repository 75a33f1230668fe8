"""What a fit compares the data with: the full lever, or a reduced one that is kept honest by it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hotlever.lever.certificate import estimated_error, relative_to_tolerance
from hotlever.lever.lever import Lever, checked_bias
from hotlever.lever.reduced import ReducedSpace
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.lever.reduced_lever import Linearised, ReducedLever, ReducedStates
from hotlever.lever.reduction import neighbourhood, place_in_box
from hotlever.materials import Material
from hotlever.probe import Probe
from hotlever.threads import one_blas_thread

Array = NDArray[np.float64]

#: Share of the box by which a material may lie outside, or apart from one that was certified.
_MARGIN = 0.1
#: Biases at which the error is estimated, and how often modes are added at a material.
_CERTIFIED, _MOST_ENRICHMENTS = 5, 2


class ForwardModel(Protocol):
    """Predicts what is measured."""

    def predict(self, material: Material, bias: Array) -> tuple[Array, Array]:
        """Return observables (3, n) and sensitivities (3, n, 6) at biases (n,) in any order."""
        ...

    def confirm(self, material: Material, bias: Array) -> Array:
        """Make the prediction at this material exact; return by how much it changed (3, n)."""
        ...


class FullModel:
    """The finite-element lever."""

    def __init__(self, lever: Lever) -> None:
        self._lever = lever

    def predict(self, material: Material, bias: Array) -> tuple[Array, Array]:
        """Return observables (3, n) and sensitivities (3, n, 6) at biases (n,) in any order."""
        lever = self._lever.with_material(material)
        values, rows = np.unique(checked_bias(bias), return_inverse=True)
        equations, states = lever.equations, lever.solve(values).states
        observed = np.stack([equations.measured(state.x) for state in states], axis=1)
        slopes = np.stack([equations.sensitivities(state.x) for state in states], axis=1)
        return observed[:, rows], slopes[:, rows]

    def confirm(self, material: Material, bias: Array) -> Array:
        """Return zeros (3, n): the full lever is exact as it is."""
        return np.zeros((3, bias.size))


class FastModel:
    """A reduced lever, kept honest by the full one.

    Where it is confirmed, the difference from the full lever is added from then on. Outside the
    parameters that its modes were made for, its error is estimated, and modes are added if that
    is too large.

    Parameters
    ----------
    lever : Lever
    space : ReducedSpace
        Of the same geometry and base temperature.
    """

    def __init__(self, lever: Lever, space: ReducedSpace) -> None:
        self._lever = lever
        self._reduced = ReducedLever(space, lever.probe.circuit)
        self._near: Linearised | None = None
        self._offset: Array | float = 0.0
        self._certified: list[Array] = []

    @property
    def space(self) -> ReducedSpace:
        """The reduced space, with the modes added so far."""
        return self._reduced.space

    @one_blas_thread
    def predict(self, material: Material, bias: Array) -> tuple[Array, Array]:
        """Return observables (3, n) and sensitivities (3, n, 6) at biases (n,) in any order."""
        states, rows = self._solve(material, bias)
        if self._is_new(material):
            states = self._certify(states)
        self._near = self._reduced.linearise(states)
        return (
            states.observables[:, rows] + self._offset,
            self._near.sensitivities[:, rows],
        )

    @one_blas_thread
    def confirm(self, material: Material, bias: Array) -> Array:
        """Solve the full lever here, from the reduced states, and correct by the difference."""
        states, rows = self._solve(material, bias)
        lever = self._lever.with_material(material)
        exact = lever.polish(self.space.expanded(x) for x in states.x.T)
        full = np.stack([lever.equations.measured(state.x) for state in exact.states], axis=1)
        before, self._offset = self._offset, (full - states.observables)[:, rows]
        change: Array = np.nan_to_num(self._offset - before)
        return change

    def _solve(self, material: Material, bias: Array) -> tuple[ReducedStates, NDArray[np.intp]]:
        values, rows = np.unique(checked_bias(bias), return_inverse=True)
        near = self._near
        if near is not None and not np.array_equal(near.states.bias, values):
            near = None
        if near is not None and near.states.material == material:
            return near.states, rows
        return self._reduced.solve(material, values, near), rows

    def _is_new(self, material: Material) -> bool:
        """Whether a material lies beyond the box, away from those certified so far."""
        place = place_in_box(material)
        if np.all((place > -_MARGIN) & (place < 1.0 + _MARGIN)):
            return False
        return all(np.abs(place - known).max() > _MARGIN for known in self._certified)

    def _certify(self, states: ReducedStates) -> ReducedStates:
        """Estimate the error at a few biases, and add modes until it is small enough."""
        few = np.unique(np.linspace(0, states.bias.size - 1, _CERTIFIED).astype(int)).tolist()
        for _ in range(_MOST_ENRICHMENTS):
            error = estimated_error(self._lever, self.space, states, few)
            if relative_to_tolerance(error, states.observables[:, few]) < 1.0:
                break
            lever = self._lever.with_material(states.material)
            exact = lever.polish(self.space.expanded(states.x[:, column]) for column in few)
            vectors = np.stack([state.x for state in exact.states], axis=1)
            changes = [neighbourhood(lever.equations, state.x) for state in exact.states]
            space = self.space.enriched(vectors, np.concatenate(changes, axis=1))
            self._reduced = ReducedLever(space, lever.probe.circuit)
            states = self._reduced.solve(states.material, states.bias)
        self._certified.append(place_in_box(states.material))
        return states


def full_model(probe: Probe) -> FullModel:
    """Return the finite-element lever of a probe as a forward model."""
    return FullModel(Lever(probe))


def fast_model(probe: Probe, progress: Callable[[int, int], None] | None = None) -> FastModel:
    """Return the reduced lever of a probe, from the cache or made now (some seconds)."""
    lever = Lever(probe)
    return FastModel(lever, cached_reduction(lever, progress=progress))
