"""States of a lever that have been solved: by which constraint, and how they are found.

A constraint, a line in the plane of tip temperature and lever voltage, selects the state at each
point of the curve. A lever that starts cold has one state at each tip temperature: its natural
parameter. Another one is warm without a bias and may cool at first; its points are lines across a
curve (pseudo-arclength; H. B. Keller, in Applications of Bifurcation Theory, 359 (1977)), its own
or that of a similar lever, so that the states of both can be compared.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import NewtonError
from hotlever.lever.equations import LeverEquations
from hotlever.lever.newton import NewtonOptions, NewtonResult, find_roots
from hotlever.lever.space import TIP, Constraint, Factors, Space
from hotlever.piecewise import Piecewise
from hotlever.probe.circuit import Circuit
from hotlever.types import Array, Index

#: A change of the tip (K) that compares with one of the lever voltage by 1 V.
UNIT_K = 60.0


def in_plane(space: Space, x: Array) -> Array:
    """Return tip and lever voltage of states, or of changes of them, in their units, (n, 2)."""
    return np.stack([space.tip_rise(x) / UNIT_K, x[-1]], axis=-1)


class Parametrisation:
    """The constraints of the points u (n,) of a branch.

    They are those of a lever that starts cold: u = √(T_tip − T_base), negative with the bias.
    With thermoelectricity the temperature begins in proportion to the bias, not to its square: the
    points between the cold state and the next are those of the smooth curve through both.
    """

    def constraint(self, u: Array) -> Constraint:
        """Return the constraint of each place."""
        return TIP

    def values(self, u: Array) -> Array:
        """Return the value that the constraint has there, (n,)."""
        return np.asarray(u**2)

    def rate(self, u: Array, space: Space, x: Array) -> Array:
        """Return how fast the values pass states (size + 1, n), by u, (n,)."""
        return np.asarray(2.0 * u)

    def reversed_at(self, u: Array, x: Array) -> NDArray[np.bool_]:
        """Return which states (size + 1, n) have the values but the other polarity, (n,).

        Heat does not know the direction of a current, so that each tip temperature has two states.
        """
        return np.asarray(x[-1] * u < 0.0)


#: It has no state of its own.
NATURAL = Parametrisation()


class PseudoArclength(Parametrisation):
    """Lines across a curve in the plane of tip and lever voltage.

    Parameters
    ----------
    curve : Piecewise
        Both by u, see `in_plane`.
    """

    def __init__(self, curve: Piecewise) -> None:
        self._curve = curve

    @classmethod
    def across_tangent(cls, u: float, origin: Array, tangent: Array) -> PseudoArclength:
        """Return the lines across a straight line, given by where it is at u and its tangent."""
        return cls(Piecewise(np.stack([tangent, origin])[:, None], np.array([u, u + 1.0])))

    def constraint(self, u: Array) -> Constraint:
        """See `Parametrisation`."""
        tip, lever = self._curve(u, 1).T
        return Constraint(tip / UNIT_K, lever)

    def values(self, u: Array) -> Array:
        """See `Parametrisation`."""
        return np.asarray((self._curve(u, 1) * self._curve(u)).sum(axis=1))

    def rate(self, u: Array, space: Space, x: Array) -> Array:
        """See `Parametrisation`."""
        along, bend = self._curve(u, 1), self._curve(u, 2)
        # the lines turn, so that they pass faster on the outside of a bend than on the inside
        aside = in_plane(space, x) - self._curve(u)
        return np.asarray((along**2 - bend * aside).sum(axis=1))

    def reversed_at(self, u: Array, x: Array) -> NDArray[np.bool_]:
        """See `Parametrisation`; lines in the plane of the lever voltage know its sign."""
        return np.zeros(u.shape, dtype=bool)


class Constrained:
    """The equations of states with given values of a constraint, (n,); see `newton.Equations`."""

    def __init__(self, equations: LeverEquations, constraint: Constraint, values: Array) -> None:
        self._equations, self._constraint, self._values = equations, constraint, values
        self.scale, self.step_limit = equations.scale, equations.step_limit

    def residual(self, x: Array, which: Index) -> Array:
        """Return the residuals of heat, charge and constraint, (size + 1, n)."""
        residual = self._equations.balance(x)
        left = self._constraint.among(which).of(self._equations.space, x)
        residual[-1] = left - self._values[which]
        return residual

    def factorised(self, x: Array, which: Index) -> Factors:
        """Return the factorised Jacobians."""
        return self._equations.factorised(x, self._constraint.among(which))


def solve_at(
    equations: LeverEquations,
    u: Array,
    guess: Array,
    options: NewtonOptions,
    factors: Factors | None = None,
    parametrisation: Parametrisation = NATURAL,
    *,
    fresh: bool = False,
) -> NewtonResult:
    """Find the states at some points u, (size + 1, n), from guesses of them.

    The factors may be those of states nearby, or fresh: those of the guesses.

    Raises
    ------
    NewtonError
        If a state was not found.
    """
    problem = Constrained(equations, parametrisation.constraint(u), parametrisation.values(u))
    roots = find_roots(problem, guess, options, factors, fresh=fresh)
    is_reversed = parametrisation.reversed_at(u, roots.x)
    if not is_reversed.any():
        return roots
    # Newton's method went past the state without a current, to one of the other polarity
    potentials = ~equations.space.is_temperature[:, None]
    turned = np.where(potentials & is_reversed, -roots.x, roots.x)
    roots = find_roots(problem, turned, options)
    if parametrisation.reversed_at(u, roots.x).any():
        raise NewtonError("only states of the other polarity were found", partial=roots.x)
    return roots


def state_at_bias(
    equations: LeverEquations,
    circuit: Circuit,
    bias: float,
    guess: Array,
    constraint: Constraint = TIP,
) -> Array:
    """Return the state at a bias (V) in a circuit, (size + 1, 1), from one nearby.

    The state at the guess's tip temperature, or other constraint that changes along the branch, is
    moved along it until it has the bias.

    Raises
    ------
    NewtonError
        If the guess is too far from a solution.
    """

    def bias_of(outputs: Array) -> Array:
        return np.asarray(circuit.bias(outputs[0], outputs[1]))

    options = NewtonOptions()
    x, factors, along = guess, None, None
    for _ in range(options.max_iterations):
        here = Constrained(equations, constraint, constraint.of(equations.space, x))
        root = find_roots(here, x, options, factors)
        if along is None:
            along = equations.along(root.x, root.factors, constraint)
            bias_by = bias_of(equations.observed_change(root.x, along))
        factors = root.factors
        step = along * (bias - bias_of(equations.observed(root.x))) / bias_by
        step /= max(1.0, float(np.abs(step / equations.step_limit).max()))
        x = root.x + step
        if np.abs(step / equations.scale).max() < options.tolerance:
            return x
    raise NewtonError(f"no state was found at a bias of {bias:g} V", partial=x)
