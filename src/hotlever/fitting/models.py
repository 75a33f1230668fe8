"""What a fit compares the data with: the full lever, a reduced one, and the two together."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hotlever.lever.continuation import BranchFollower
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import Lever, checked_bias
from hotlever.lever.reduced import ReducedSpace
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.materials import Material
from hotlever.probe import Probe
from hotlever.threads import one_blas_thread

Array = NDArray[np.float64]


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
        states = [state.x for state in lever.solve(values).states]
        return _predicted(lever.equations, states, rows)

    def confirm(self, material: Material, bias: Array) -> Array:
        """Return zeros (3, n): the full lever is exact as it is."""
        return np.zeros((3, bias.size))


class FastModel:
    """A reduced lever, corrected by the difference from the full one where it was confirmed.

    Parameters
    ----------
    lever : Lever
    space : ReducedSpace
        Of the same geometry and base temperature.
    """

    def __init__(self, lever: Lever, space: ReducedSpace) -> None:
        self._lever, self._space = lever, space
        self._offset: Array | float = 0.0

    @one_blas_thread
    def predict(self, material: Material, bias: Array) -> tuple[Array, Array]:
        """Return observables (3, n) and sensitivities (3, n, 6) at biases (n,) in any order."""
        equations, states, rows = self._solve(material, bias)
        values, sensitivities = _predicted(equations, states, rows)
        return values + self._offset, sensitivities

    @one_blas_thread
    def confirm(self, material: Material, bias: Array) -> Array:
        """Solve the full lever here, from the reduced states, and correct by the difference."""
        equations, states, rows = self._solve(material, bias)
        lever = self._lever.with_material(material)
        exact = lever.polish(self._space.expanded(x) for x in states)
        full = np.stack([lever.equations.measured(state.x) for state in exact.states], axis=1)
        reduced = np.stack([equations.measured(x) for x in states], axis=1)
        before, self._offset = self._offset, (full - reduced)[:, rows]
        change: Array = np.nan_to_num(self._offset - before)
        return change

    def _solve(
        self, material: Material, bias: Array
    ) -> tuple[LeverEquations, list[Array], NDArray[np.intp]]:
        equations = LeverEquations(self._space, self._lever.probe.circuit, material)
        values, rows = np.unique(checked_bias(bias), return_inverse=True)
        states = [state.x for state in BranchFollower(equations).ramp(values.tolist())]
        return equations, states, rows


def _predicted(
    equations: LeverEquations, states: list[Array], rows: NDArray[np.intp]
) -> tuple[Array, Array]:
    values = np.stack([equations.measured(x) for x in states], axis=1)
    sensitivities = np.stack([equations.sensitivities(x) for x in states], axis=1)
    return values[:, rows], sensitivities[:, rows]


def full_model(probe: Probe) -> FullModel:
    """Return the finite-element lever of a probe as a forward model."""
    return FullModel(Lever(probe))


def fast_model(probe: Probe, progress: Callable[[int, int], None] | None = None) -> FastModel:
    """Return the reduced lever of a probe, from the cache or made now (some seconds)."""
    lever = Lever(probe)
    return FastModel(lever, cached_reduction(lever, progress=progress))
