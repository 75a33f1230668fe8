"""A lever in its circuit under a bias that changes in time, as a problem to step.

Heat is stored; potentials and the circuit follow at once. The same equations as at rest, with the
rise of the enthalpy in the heat balance and, in place of the constraint, the circuit::

    V_l + R_s I_h = V_b(t)

Air lets heat through as it does at rest, and holds some itself: the temperatures of its stores
(`hotlever.air.stores`) follow the unknowns of the lever, each at its own rate.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hotlever.air.stores import HeatInAir
from hotlever.lever.equations import ELECTRICAL_OUTPUTS, LeverEquations, heat_held, heat_left
from hotlever.lever.space import LEVER, Factors
from hotlever.probe import Circuit
from hotlever.types import Array

if TYPE_CHECKING:
    from hotlever.lever.lever import State

#: What is monitored: V_l, I_h, V_r and the rise of the tip (K); the power and the heat that leaves
#: as it does at rest (mW); the heat in the lever and in the air (nJ), and how much of both is
#: tested at the leg ends.
MONITORED = (
    *(*ELECTRICAL_OUTPUTS, "tip_rise_K"),
    *("power_mW", "left_mW", "stored_nJ", "air_stored_nJ", "at_ends_nJ"),
)


class InCircuit:
    """A factorised Jacobian with the row of the circuit last, made of one with that of V_l.

    The row of the circuit is dense. It differs from the constraint by a matrix of rank one, and
    Sherman and Morrison's formula takes it in.

    Parameters
    ----------
    factors : Factors
        Of one state, whose constraint is its lever voltage.
    bias_by : ndarray, shape (size + 1, 1)
        Derivative of the bias by the unknowns.
    """

    def __init__(self, factors: Factors, bias_by: Array) -> None:
        self._factors = factors
        last = np.zeros_like(bias_by)
        last[-1] = 1.0
        self._row = bias_by - last
        self._one = np.arange(1)
        self._unit_response = factors.solve(last, self._one)

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for right-hand sides (size + 1, 1) or (size + 1, 1, k)."""
        solution = self._factors.solve(right_hand_side, self._one)
        columns = solution.reshape(len(solution), -1)
        share = (self._row.T @ columns) / (1.0 + self._row.T @ self._unit_response)
        return np.asarray((columns - self._unit_response * share).reshape(solution.shape))


class WithStores:
    """A factorised Jacobian with the rows of the stores in the air below it.

    These are eliminated: what they take up at the rate of the Jacobian is part of the factors.
    """

    def __init__(self, factors: InCircuit, air: HeatInAir, rate: float) -> None:
        self._factors, self._air, self._rate = factors, air, rate

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for right-hand sides (rows, 1) or (rows, 1, k)."""
        air, rate = self._air, self._rate
        flat = right_hand_side.reshape(len(right_hand_side), -1)
        above, below = np.split(flat, [len(flat) - air.size])
        above = above - rate * air.tested(air.lagging(below, rate))
        lever = self._factors.solve(above[:, None])[:, 0]
        in_air = (below + air.rates * air.follows(lever)) / (rate + air.rates)
        return np.concatenate([lever, in_air]).reshape(right_hand_side.shape)


class TransientProblem:
    """See the module's text and `hotlever.lever.transient.runge_kutta.SteppedProblem`.

    The unknowns are those of the lever (size + 1) and below them the temperatures of the stores in
    the air, if it takes up heat itself.

    Parameters
    ----------
    equations : LeverEquations
    circuit : Circuit
    bias : callable
        V_b (V) at a time (µs); smooth while it is stepped.
    """

    def __init__(
        self, equations: LeverEquations, circuit: Circuit, bias: Callable[[float], float]
    ) -> None:
        self.equations, self._circuit, self._bias = equations, circuit, bias
        # the rows of the stores are linear: a correction leaves nothing there
        self._air, self._own = equations.heat_in_air, len(equations.scale)
        self.scale = np.concatenate([equations.scale, np.full((self._air.size, 1), np.inf)])

    def begin(self, state: State) -> Array:
        """Return the unknowns at a state."""
        return state.unknowns

    def parts(self, x: Array) -> tuple[Array, Array]:
        """Return the unknowns of the lever, and the temperatures in the air."""
        return x[: self._own], x[self._own :]

    def storage(self, x: Array) -> Array:
        """Return the heat stored (nJ), and the temperatures in the air (K)."""
        lever, in_air = self.parts(x)
        held = self._air.tested(self._air.held(lever, in_air))
        return np.concatenate([self.equations.storage(lever) + held, in_air])

    def residual(self, t: float, x: Array) -> Array:
        """Return the residuals of heat, charge and circuit, and of the stores in the air."""
        lever, in_air = self.parts(x)
        balance = self.equations.balance_in(self._circuit, lever, self._bias(t))
        return np.concatenate([balance, self._air.rates * (in_air - self._air.follows(lever))])

    def change(self, x: Array, changes: Array, rate: float) -> Array:
        """Return how ``rate × storage + residual`` changes with the unknowns (rows, 1, k)."""
        return rate * self.storage_change(x, changes) + self.residual_change(x, changes)

    def storage_change(self, x: Array, changes: Array) -> Array:
        """Return how `storage` changes with the unknowns (rows, 1, k), to first order."""
        (lever, _), (lever_changes, in_air) = self.parts(x), self.parts(changes)
        stored = self.equations.storage_change(lever, lever_changes)
        held = self._air.tested(self._air.held(lever_changes[:, 0], in_air[:, 0]))
        return np.concatenate([stored + held[:, None], in_air])

    def residual_change(self, x: Array, changes: Array) -> Array:
        """Return how `residual` changes with the unknowns (rows, 1, k), to first order."""
        (lever, _), (lever_changes, in_air) = self.parts(x), self.parts(changes)
        residual = self.equations.balance_change_in(self._circuit, lever, lever_changes)
        lag = self._air.rates * (in_air[:, 0] - self._air.follows(lever_changes[:, 0]))
        return np.concatenate([residual, lag[:, None]])

    def by_parameter(self, x: Array, names: Sequence[str]) -> tuple[Array, Array]:
        """Return how `storage` and `residual` change with parameters, each (rows, 1, k)."""
        lever, in_air = self.parts(x)
        stored = self.equations.storage_by_parameter(lever, names)
        residual = self.equations.by_parameter(lever, names)
        current = self.equations.balance(lever)[-1]
        for column, name in enumerate(names):
            by = residual[-1, :, column]
            residual[-1, :, column] = self._circuit.bias(0.0, by) + self._circuit.bias_by(
                name, current
            )
        lag = np.zeros((len(in_air), 1, len(names)))
        for column in (column for column, name in enumerate(names) if name == "gas_conductivity"):
            # stores in a gas that conducts better follow faster
            away = self._air.rates * (in_air - self._air.follows(lever))
            lag[..., column] = away / self.equations.space.air.gas_conductivity
        return np.concatenate([stored, np.zeros_like(lag)]), np.concatenate([residual, lag])

    def factorised(self, x: Array, rate: float) -> InCircuit | WithStores:
        """Return the factorised Jacobian of ``rate × storage + residual``."""
        lever, _ = self.parts(x)
        # Newton's method and refinement remove what solves leave, which is less than what a kept
        # Jacobian does
        factors = self.equations.factorised(lever, LEVER, rate, left=1e-3)
        gradient = self.equations.observed_gradient(lever)
        driven = InCircuit(factors, self._circuit.bias(gradient[..., 0], gradient[..., 1]))
        return WithStores(driven, self._air, rate) if self._air.size else driven

    def norm(self, change: Array) -> float:
        """Return the largest change of the temperature (K)."""
        return float(np.abs(self.equations.space.rises(change[: self._own])).max())

    def monitored(self, x: Array) -> Array:
        """Return what is `MONITORED` at states, (9, n)."""
        equations, space = self.equations, self.equations.space
        lever, in_air = self.parts(x)
        held, at_ends = heat_held(equations, lever)
        held_by_air, more = self._air.heat(self._air.held(lever, in_air))
        outputs = *equations.observed(lever), space.tip_rise(lever)
        flows = equations.power(lever), heat_left(equations, lever)
        return np.stack([*outputs, *flows, held, held_by_air, at_ends + more])
