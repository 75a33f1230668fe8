"""How what instruments show of a lever at rest responds to small changes, its bias being held.

One adjoint solve answers for every change, of a parameter or of what fluctuates at each point.
"""

from __future__ import annotations

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
    """

    equations: LeverEquations
    x: Array
    adjoint: Array
    by_bias: float
    power_by_bias: float

    @classmethod
    def of(
        cls, equations: LeverEquations, x: Array, constraint: Constraint, shown: str
    ) -> Response:
        """Find the response of a state; the constraint is one that selects it on its branch."""
        circuit, number = equations.circuit, SHOWN.index(shown)
        factors = equations.factorised(x, constraint)
        by_state = factors.solve(equations.observed_gradient(x), np.arange(1), transposed=True)
        along = equations.observed_change(x, equations.along(x, factors, constraint))[:, 0]
        # along its branch the state goes back to where the bias is what it was
        along = along / circuit.bias(along[0], along[1])
        lever_V, current_mA, _ = np.moveaxis(by_state, 2, 0)
        adjoint = by_state[..., number] - along[number] * circuit.bias(lever_V, current_mA)
        # a change of the current at the same state is the last of the balance
        adjoint[-1] = along[number] * circuit.series_kohm
        by_power = float(x[-1, 0] * along[1] + equations.balance(x)[-1, 0] * along[0])
        return cls(equations, x, adjoint, float(along[number]), by_power)

    def by_parameter(self, name: str) -> float:
        """Return the response to a parameter of the equations, per unit of it."""
        change = self.equations.by_parameter(self.x, [name])[..., 0]
        return -float((self.adjoint * change).sum())
