"""States of a lever selected by their tip temperature, or by the bias in a circuit."""

from __future__ import annotations

import numpy as np

from hotlever.errors import NewtonError
from hotlever.lever.equations import LeverEquations
from hotlever.lever.newton import NewtonOptions, find_roots
from hotlever.lever.space import Factors
from hotlever.probe.circuit import Circuit
from hotlever.types import Array, Index


class AtTip:
    """The equations of states whose tip is warmer by given rises (K); see `newton.Equations`."""

    def __init__(self, equations: LeverEquations, rise: Array) -> None:
        self._equations, self._rise = equations, rise
        self.scale, self.step_limit = equations.scale, equations.step_limit

    def residual(self, x: Array, which: Index) -> Array:
        """Return the residuals of heat, charge and pin, (size + 1, n)."""
        residual = self._equations.balance(x)
        residual[-1] = self._equations.space.tip_rise(x) - self._rise[which]
        return residual

    def factorised(self, x: Array, which: Index) -> Factors:
        """Return the factorised Jacobians."""
        return self._equations.factorised(x)


def state_at_bias(equations: LeverEquations, circuit: Circuit, bias: float, guess: Array) -> Array:
    """Return the state at a bias (V) in a circuit, (size + 1, 1), from one nearby.

    The state at the guess's tip temperature is moved along the branch, until it has the bias.

    Raises
    ------
    NewtonError
        If the guess is too far from a solution.
    """

    def bias_of(shown: Array) -> Array:
        return np.asarray(circuit.bias(shown[0], shown[1]))

    options = NewtonOptions()
    x, factors, along = guess, None, None
    for _ in range(options.max_iterations):
        found = find_roots(AtTip(equations, equations.space.tip_rise(x)), x, options, factors)
        if along is None:
            along = equations.along(found.x, found.factors)
            by_tip = bias_of(equations.observed_change(found.x, along))
        factors = found.factors
        step = along * (bias - bias_of(equations.observed(found.x))) / by_tip
        step /= max(1.0, float(np.abs(step / equations.step_limit).max()))
        x = found.x + step
        if np.abs(step / equations.scale).max() < options.tolerance:
            return x
    raise NewtonError(f"no state was found at a bias of {bias:g} V", partial=x)
