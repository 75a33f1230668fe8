"""The reduced lever near a fit's optimum: cheap, because every state starts next to its root."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hotlever.lever.lever import Lever, checked_bias
from hotlever.lever.reduced import ReducedSpace
from hotlever.lever.reduced_lever import ReducedLever
from hotlever.materials import Material

Array = NDArray[np.float64]


class NearbyModel:
    """A reduced lever for materials near that of a lever, exact at the latter.

    It stays on the few points of the reduced lever; what that lacks at the lever's own material
    is added everywhere.

    Parameters
    ----------
    lever : Lever
        With the material of the optimum.
    space : ReducedSpace
        Of the same geometry and base temperature.
    bias : ndarray, shape (n,)
        Biases (V) in any order.

    Raises
    ------
    ComputationError
        If the lever cannot be solved with its own material.
    """

    def __init__(self, lever: Lever, space: ReducedSpace, bias: Array) -> None:
        self._bias, self._rows = np.unique(checked_bias(bias), return_inverse=True)
        self._reduced = ReducedLever(space, lever.probe.circuit)
        states = self._reduced.solve(lever.probe.material, self._bias, rough=True)
        self._optimum = self._reduced.linearise(states)
        exact = lever.polish(space.expanded(x) for x in states.x.T)
        full = np.stack([lever.equations.measured(state.x) for state in exact.states], axis=1)
        self._offset = full - states.observables

    def predict(self, material: Material) -> Array:
        """Return I_h (mA), V_r (V) and T_tip (K) at the biases, shape (3, n).

        Raises
        ------
        ComputationError
            If the lever has no state below the melting point at one of them.
        """
        states = self._reduced.solve(material, self._bias, self._optimum, rough=True)
        predicted: Array = (states.observables + self._offset)[:, self._rows]
        return predicted

    def sensitivities(self) -> Array:
        """Return the derivatives by the six parameters at the optimum, shape (3, n, 6)."""
        return self._optimum.sensitivities[:, self._rows]
