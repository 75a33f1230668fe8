"""The reduced lever near a fit's optimum: cheap, because every state starts next to its root."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import NewtonError
from hotlever.lever.continuation import AT_BIAS, MELTING_POINT, BranchFollower
from hotlever.lever.equations import LeverEquations, PinnedEquations
from hotlever.lever.lever import Lever, checked_bias
from hotlever.lever.newton import LinearSolve, NewtonOptions, newton
from hotlever.lever.reduced import ReducedSpace
from hotlever.materials import PARAMETERS, Material

Array = NDArray[np.float64]

#: A last step of 1 mK or 10 µV leaves an error far below any measured one.
_NEWTON = NewtonOptions(tolerance=1e-6, max_iterations=12)


class NearbyModel:
    """A reduced lever for materials near that of a lever, exact at the latter.

    A state is sought from that of the lever's own material, moved by the first-order effect of
    the change of material; a few Newton steps do the rest. If one fails, the ramp is followed
    from zero bias. What the reduced lever lacks at the lever's own material is added everywhere.

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
        self._space, self._circuit = space, lever.probe.circuit
        self._material = lever.probe.material
        self._bias, self._rows = np.unique(checked_bias(bias), return_inverse=True)
        equations = self._equations(self._material)
        self._states = self._ramp(equations)
        self._solvers = [
            equations.jacobian(x).factorised(equations.series_kohm, *AT_BIAS) for x in self._states
        ]
        self._changes = [
            _by_parameter(equations, x, solver)
            for x, solver in zip(self._states, self._solvers, strict=True)
        ]
        self._reader = space.reader_weights()
        exact = lever.polish(space.expanded(x) for x in self._states)
        full = np.stack([lever.equations.measured(state.x) for state in exact.states], axis=1)
        self._offset = full - self._measured(equations, self._states)

    def predict(self, material: Material) -> Array:
        """Return I_h (mA), V_r (V) and T_tip (K) at the biases, shape (3, n).

        Raises
        ------
        ComputationError
            If the lever has no state below the melting point at one of them.
        """
        equations = self._equations(material)
        try:
            states = self._near(equations, self._distance(material))
        except NewtonError:
            states = self._ramp(equations)
        predicted: Array = (self._measured(equations, states) + self._offset)[:, self._rows]
        return predicted

    def sensitivities(self) -> Array:
        """Return the derivatives by the six parameters at the optimum, shape (3, n, 6)."""
        equations = self._equations(self._material)
        slopes = np.stack([equations.sensitivities(x) for x in self._states], axis=1)
        return slopes[:, self._rows]

    def _equations(self, material: Material) -> LeverEquations:
        return LeverEquations(self._space, self._circuit, material)

    def _distance(self, material: Material) -> Array:
        return np.array(
            [getattr(material, name) - getattr(self._material, name) for name in PARAMETERS]
        )

    def _near(self, equations: LeverEquations, distance: Array) -> list[Array]:
        states = []
        for bias, x, change, solver in zip(
            self._bias, self._states, self._changes, self._solvers, strict=True
        ):
            pinned = _Primed(equations.pinned(AT_BIAS, bias), solver)
            root = newton(pinned, x + change @ distance, _NEWTON).x
            if self._space.highest_temperature(root) > MELTING_POINT:
                raise NewtonError(f"no state below the melting point near that at {bias:g} V")
            states.append(root)
        return states

    def _measured(self, equations: LeverEquations, states: list[Array]) -> Array:
        """Return I_h, V_r and T_tip of solved states, shape (3, states)."""
        if equations.series_kohm == 0.0 or self._reader is None:
            return np.stack([equations.measured(x) for x in states], axis=1)
        # by the circuit equation, which spares an evaluation of the laws
        x = np.stack(states, axis=1)
        unknowns, weights = self._reader
        return np.stack(
            [
                (x[-1] - x[-2]) / equations.series_kohm,
                weights @ x[unknowns],
                np.array([self._space.tip_temperature(state) for state in states]),
            ]
        )

    def _ramp(self, equations: LeverEquations) -> list[Array]:
        return [state.x for state in BranchFollower(equations).ramp(self._bias.tolist())]


class _Primed:
    """Equations whose first factorised Jacobian is at hand, from a state nearby."""

    def __init__(self, equations: PinnedEquations, solver: LinearSolve) -> None:
        self.scale, self.step_limit = equations.scale, equations.step_limit
        self.residual, self._factorised = equations.residual, equations.factorised
        self._first: LinearSolve | None = solver

    def factorised(self, x: Array) -> LinearSolve:
        """Return the Jacobian at hand once, then those at `x`."""
        first, self._first = self._first, None
        return first or self._factorised(x)


def _by_parameter(equations: LeverEquations, x: Array, solver: LinearSolve) -> Array:
    """Return how a solved state changes with the six parameters at its bias, shape (n, 6)."""
    right_hand_side = np.zeros((x.size, len(PARAMETERS)))
    right_hand_side[:-1] = -equations.by_parameter(x)
    right_hand_side[-2] *= equations.series_kohm
    return solver.solve(right_hand_side)
