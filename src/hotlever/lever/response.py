"""How what instruments show of a lever at rest responds to small changes, its bias being held.

One adjoint solve answers for every change, of a parameter or of what fluctuates at each point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hotlever.lever.equations import SHOWN, LeverEquations
from hotlever.lever.space import Constraint
from hotlever.types import Array


@dataclass(frozen=True)
class Response:
    """The response of one of `SHOWN` in the lever's circuit.

    Attributes
    ----------
    equations : LeverEquations
    x : ndarray, shape (size + 1, 1)
        The state at rest.
    adjoint : ndarray, shape (size + 1, 1)
        The response to a change of `LeverEquations.balance` is less their product. At the points it
        is a temperature by which added heat counts (V/mW) and a potential by which a current does
        (V/mA).
    by_bias : float
        The response to the bias of the swept supply (V/V).
    power_by_bias : float
        How the power P_l of that supply responds (mW/V).
    change : callable
        The change of the state by a change of the balance, (size + 1, 1).
    """

    equations: LeverEquations
    x: Array
    adjoint: Array
    by_bias: float
    power_by_bias: float
    change: Callable[[Array], Array]

    @classmethod
    def of(
        cls, equations: LeverEquations, x: Array, constraint: Constraint, shown: str
    ) -> Response:
        """Find the response of a state; the constraint is one that selects it on its branch."""
        circuit, number = equations.circuit, SHOWN.index(shown)
        factors = equations.factorised(x, constraint)
        by_state = factors.solve(equations.observed_gradient(x), np.arange(1), transposed=True)
        branch = equations.along(x, factors, constraint)
        along = equations.observed_change(x, branch)[:, 0]
        # along its branch the state goes back to where the bias is what it was
        per_V = circuit.bias(along[0], along[1])
        along, branch = along / per_V, branch / per_V
        lever_V, current_mA, _ = np.moveaxis(by_state, 2, 0)
        adjoint = by_state[..., number] - along[number] * circuit.bias(lever_V, current_mA)
        # a change of the current at the same state is the last of the balance
        adjoint[-1] = along[number] * circuit.series_kohm
        by_power = float(x[-1, 0] * along[1] + equations.balance(x)[-1, 0] * along[0])

        def change(of_balance: Array) -> Array:
            held = np.concatenate([-of_balance[:-1], np.zeros((1, 1))])
            moved = equations.solve_linear(x, factors, held, constraint)
            lever_V, current_mA, _ = equations.observed_change(x, moved)[:, 0]
            missing = circuit.bias(lever_V, current_mA + of_balance[-1, 0])
            return np.asarray(moved - missing * branch)

        return cls(equations, x, adjoint, float(along[number]), by_power, change)

    def by_parameter(self, name: str) -> tuple[float, float]:
        """Return the response to a parameter of the equations, per unit, and its delay (µs).

        By the delay, the first moment of its answer to a step, it follows slow changes: the lever's
        own heat counts, not that of the air.
        """
        of_balance = self.equations.by_parameter(self.x, [name])[..., 0]
        response = -float((self.adjoint * of_balance).sum())
        stored = self.equations.storage_change(self.x, self.change(of_balance))
        return response, float((self.adjoint * stored).sum()) / response
