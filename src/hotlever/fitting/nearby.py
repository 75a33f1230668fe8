"""The reduced lever near a fit's optimum: cheap, because every state starts next to its root.

All biases are solved at once: arrays of a few hundred points cost as much in calls as in
arithmetic, and there are some hundred operations in the laws.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import NewtonError
from hotlever.lever.continuation import AT_BIAS, MELTING_POINT, BranchFollower
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import Lever, checked_bias
from hotlever.lever.newton import LinearSolve, NewtonOptions, newton
from hotlever.lever.reduced import ReducedSpace
from hotlever.lever.space import Tapered
from hotlever.materials import PARAMETERS, Material

Array = NDArray[np.float64]

#: A last step of 1 mK or 10 µV leaves an error far below any measured one.
_NEWTON = NewtonOptions(tolerance=1e-6, max_iterations=12)
#: The same for the common steps: error left, in units of 1 K or 10 mV; how many; and the ratio
#: of two steps from which Newton's method is the cheaper way.
_NEARLY, _MOST_STEPS, _SLOWEST = 1e-4, 8, 0.5


class NearbyModel:
    """A reduced lever for materials near that of a lever, exact at the latter.

    A state is sought from that of the lever's own material, moved by the first-order effect of
    the change of material; a few steps with the Jacobians of the lever's own states, all biases
    at once, do the rest. Where these do not contract, Newton's method goes on; if that fails, the
    ramp is followed from zero bias. What the reduced lever lacks at the lever's own material is
    added everywhere.

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
        solvers = [
            equations.jacobian(x).factorised(equations.series_kohm, *AT_BIAS) for x in self._states
        ]
        self._changes = [
            _by_parameter(equations, x, solver)
            for x, solver in zip(self._states, solvers, strict=True)
        ]
        self._inverses = np.stack([solver.solve(np.eye(space.size + 2)) for solver in solvers])
        self._reader = space.reader_weights()
        self._stack = _StackedSpace(space, self._bias.size)
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
        guesses = [
            x + change @ distance for x, change in zip(self._states, self._changes, strict=True)
        ]
        stacked, converged = self._iterated(equations.material, np.stack(guesses))
        states = []
        for bias, x, done in zip(self._bias, stacked, converged, strict=True):
            root = x if done else newton(equations.pinned(AT_BIAS, bias), x, _NEWTON).x
            if self._space.highest_temperature(root) > MELTING_POINT:
                raise NewtonError(f"no state below the melting point near that at {bias:g} V")
            states.append(root)
        return states

    def _iterated(self, material: Material, x: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Step towards the roots with the Jacobians at hand; return which were reached."""
        equations = LeverEquations(cast(Any, self._stack), self._circuit, material)
        scale = equations.scale
        last = np.full(len(x), np.inf)
        converged = np.zeros(len(x), dtype=bool)
        diverged = np.zeros(len(x), dtype=bool)
        for _ in range(_MOST_STEPS):
            residual = self._stack.residual(equations, x)
            step = -np.einsum("bij,bj->bi", self._inverses, residual, optimize=True)
            length = np.abs(step / scale).max(axis=1)
            ratio = length / np.maximum(last, np.finfo(float).tiny)
            # a state that steps further and further is left where it was
            diverged |= ~(ratio < _SLOWEST)
            moving = ~(converged | diverged)
            x = np.where(moving[:, None], x + step, x)
            # steps in a steady ratio leave the last one times the ratio; the first knows no ratio
            converged |= moving & np.isfinite(last) & (length * ratio < _NEARLY)
            if np.all(converged | diverged):
                break
            last = length
        return x, converged

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


class _StackedSpace:
    """The points and unknowns of a reduced space, several states at once.

    Offers `LeverEquations` what the laws need, with the points of all states in one array.

    Parameters
    ----------
    space : ReducedSpace
    count : int
        Number of states.
    """

    def __init__(self, space: ReducedSpace, count: int) -> None:
        self.size = space.size
        thickness = space.thickness_um
        self.thickness_um = (
            thickness if isinstance(thickness, float) else np.tile(thickness, (count, 1))
        )
        self.is_temperature = space.is_temperature
        points = space.points.size
        starts = points * np.arange(count)[:, None]
        self.tapered = [
            Tapered(
                (starts + region.elements).ravel(),
                np.tile(region.along, (count, 1)),
                region.length_um,
            )
            for region in space.tapered
        ]
        self._weights, self._hot = space.weights, int(space.is_temperature().sum())
        # the space is linear in its unknowns
        columns = [space.fields(unit, 0.0) for unit in np.eye(space.size + 2)[:-1]]
        self._T = np.stack(
            [np.concatenate([f.T[None], f.grad_T]).ravel() for f in columns[: self._hot]]
        )
        self._V = np.stack([f.grad_V.ravel() for f in columns[self._hot :]])

    def residual(self, equations: LeverEquations, x: Array) -> Array:
        """Return the residual of every state, pinned at its own bias, shape (states, size + 2)."""
        states = len(x)
        fields_T = (x[:, : self._hot] @ self._T).reshape(states, 3, -1)
        grad_V = (x[:, self._hot : -1] @ self._V).reshape(states, 2, -1)
        T = equations.circuit.base_temperature_K + fields_T[:, 0]
        laws = equations.conductivities(T.reshape(-1, 1))
        kappa = laws.kappa.reshape(T.shape) * self._weights
        sigma = laws.sigma.reshape(T.shape) * self._weights
        heat = np.empty_like(fields_T)
        heat[:, 0] = -sigma * (grad_V**2).sum(axis=1)
        heat[:, 1:] = kappa[:, None] * fields_T[:, 1:]
        charge = sigma[:, None] * grad_V
        residual = np.zeros_like(x)
        residual[:, : self._hot] = heat.reshape(states, -1) @ self._T.T
        residual[:, self._hot : -1] = charge.reshape(states, -1) @ self._V.T
        residual[:, -2] = x[:, -2] + equations.series_kohm * residual[:, -2] - x[:, -1]
        return residual


def _by_parameter(equations: LeverEquations, x: Array, solver: LinearSolve) -> Array:
    """Return how a solved state changes with the six parameters at its bias, shape (n, 6)."""
    right_hand_side = np.zeros((x.size, len(PARAMETERS)))
    right_hand_side[:-1] = -equations.by_parameter(x)
    right_hand_side[-2] *= equations.series_kohm
    return solver.solve(right_hand_side)
