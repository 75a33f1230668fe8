"""A lever in its circuit under a bias that changes in time, as a problem to step.

Heat is stored; potentials and the circuit follow at once. The same equations as at rest, with the
rise of the enthalpy in the heat balance and, in place of the pin, the circuit::

    V_l + R_s I_h = V_b(t)

Air is taken at rest: its operator answers at once (see `hotlever.lever.air_loss`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hotlever.lever.balances import heat_left
from hotlever.lever.equations import LeverEquations
from hotlever.lever.space import LEVER, Factors
from hotlever.probe import Circuit
from hotlever.types import Array, Index


class InCircuit:
    """A factorised Jacobian with the row of the circuit last, made of one with that of V_l.

    The row of the circuit is dense. It differs from the pin by a matrix of rank one, and Sherman
    and Morrison's formula takes it in.

    Parameters
    ----------
    factors : Factors
        Of one state, pinned by its lever voltage.
    bias_by : ndarray, shape (size + 1, 1)
        Derivative of the bias by the unknowns.
    """

    def __init__(self, factors: Factors, bias_by: Array) -> None:
        self._factors = factors
        last = np.zeros_like(bias_by)
        last[-1] = 1.0
        self._last, self._more = last, bias_by - last
        self._moved: dict[bool, Array] = {}

    def solve(self, right_hand_side: Array, states: Index, *, transposed: bool = False) -> Array:
        """Solve for right-hand sides (size + 1, 1) or (size + 1, 1, k)."""
        column, row = (self._more, self._last) if transposed else (self._last, self._more)
        if transposed not in self._moved:
            self._moved[transposed] = self._factors.solve(column, states, transposed=transposed)
        moved = self._moved[transposed][:, 0]
        solution = self._factors.solve(right_hand_side, states, transposed=transposed)
        share = np.tensordot(row[:, 0], solution, axes=1) / (1.0 + row[:, 0] @ moved)
        return np.asarray(solution - np.multiply.outer(moved, share))

    def replaced(self, states: Index, other: InCircuit) -> InCircuit:
        """Return the other factors: there is one state."""
        return other


class DrivenLever:
    """See the module's text and `hotlever.lever.transient.runge_kutta.Problem`.

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
        self.scale, self.step_limit = equations.scale, equations.step_limit

    def stored(self, x: Array) -> Array:
        """Return the heat stored (nJ), (size + 1, 1)."""
        return self.equations.stored(x)

    def rest(self, t: float, x: Array) -> Array:
        """Return the residuals of heat, charge and circuit, (size + 1, 1)."""
        rest = self.equations.balance(x)
        rest[-1] = self._circuit.bias(x[-1], rest[-1]) - self._bias(t)
        return rest

    def factorised(self, x: Array, rate: float) -> InCircuit:
        """Return the factorised Jacobian of ``rate × stored + rest``."""
        factors = self.equations.factorised(x, LEVER, rate)
        gradient = self.equations.observed_gradient(x)
        return InCircuit(factors, self._circuit.bias(gradient[..., 0], gradient[..., 1]))

    def size_of(self, change: Array) -> float:
        """Return the largest change of the temperature (K)."""
        return float(np.abs(self.equations.space.rises(change)).max())

    def rates(self, x: Array) -> Array:
        """Return the power, and the heat that leaves as it does at rest (mW), (2,)."""
        return np.array([self.equations.power(x)[0], heat_left(self.equations, x)[0]])
