"""States of a lever selected by their tip temperature or another pin, or by the bias."""

from __future__ import annotations

import numpy as np

from hotlever.errors import NewtonError
from hotlever.lever.equations import LeverEquations
from hotlever.lever.newton import NewtonOptions, find_roots
from hotlever.lever.space import TIP, Factors, Pin
from hotlever.probe.circuit import Circuit
from hotlever.types import Array, Index


class Pinned:
    """The equations of states with given values of a pin, (n,); see `newton.Equations`.

    By default these are how much warmer the tip is (K).
    """

    def __init__(self, equations: LeverEquations, values: Array, pin: Pin = TIP) -> None:
        self._equations, self._values, self._pin = equations, values, pin
        self.scale, self.step_limit = equations.scale, equations.step_limit

    def residual(self, x: Array, which: Index) -> Array:
        """Return the residuals of heat, charge and pin, (size + 1, n)."""
        residual = self._equations.balance(x)
        pin = self._pin.among(which)
        residual[-1] = pin.of(self._equations.space, x) - self._values[which]
        return residual

    def factorised(self, x: Array, which: Index) -> Factors:
        """Return the factorised Jacobians."""
        return self._equations.factorised(x, self._pin.among(which))


def state_at_bias(
    equations: LeverEquations, circuit: Circuit, bias: float, guess: Array, pin: Pin = TIP
) -> Array:
    """Return the state at a bias (V) in a circuit, (size + 1, 1), from one nearby.

    The state at the guess's tip temperature, or other pin that changes along the branch, is moved
    along it until it has the bias.

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
        here = Pinned(equations, pin.of(equations.space, x), pin)
        found = find_roots(here, x, options, factors)
        if along is None:
            along = equations.along(found.x, found.factors, pin)
            by_tip = bias_of(equations.observed_change(found.x, along))
        factors = found.factors
        step = along * (bias - bias_of(equations.observed(found.x))) / by_tip
        step /= max(1.0, float(np.abs(step / equations.step_limit).max()))
        x = found.x + step
        if np.abs(step / equations.scale).max() < options.tolerance:
            return x
    raise NewtonError(f"no state was found at a bias of {bias:g} V", partial=x)
