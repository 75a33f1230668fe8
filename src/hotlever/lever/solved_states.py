"""States of a lever: how they are found, and the curve through those one after the other.

A constraint, a line in the plane of tip temperature and lever voltage, selects the state at each
point of the curve. A lever that starts cold has one state at each tip temperature: its natural
parameter. Another one is warm without a bias and may cool at first; its points are lines across a
curve (pseudo-arclength; H. B. Keller, in Applications of Bifurcation Theory, 359 (1977)), its own
or that of a similar lever, so that the states of both can be compared.

How hot they get anywhere: which place is the hottest changes along a branch, a leg may overtake the
heater. So the temperatures of all places that come into question are read off their own smooth
curves, and the highest of them is taken last. A curve through the highest temperatures of the
states would not know of the bend where one place overtakes another.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import NewtonError
from hotlever.lever.equations import ELECTRICAL_OUTPUTS, LeverEquations, steps_of
from hotlever.lever.newton import NewtonOptions, NewtonResult, find_roots
from hotlever.lever.space import TIP, Constraint, Factors, Space
from hotlever.piecewise import Piecewise, smooth_curve
from hotlever.probe.circuit import Circuit
from hotlever.types import Array, Index

#: Units in which changes of the tip (K) and of the lever voltage (V) compare.
UNIT_K, UNIT_V = 60.0, 1.0
#: Places along a branch that are looked at together.
_AT_ONCE = 64
#: Elements with this share of the highest rise at a state nearby come into question.
_NEARLY = 0.85
#: Points at which a temperature is looked for between two states, and how often between those.
_POINTS, _ROUNDS = 17, 3


def in_plane(space: Space, x: Array) -> Array:
    """Return tip and lever voltage of states, or of changes of them, in their units, (n, 2)."""
    return np.stack([space.tip_rise(x) / UNIT_K, x[-1] / UNIT_V], axis=-1)


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
        return Constraint(tip / UNIT_K, lever / UNIT_V)

    def values(self, u: Array) -> Array:
        """See `Parametrisation`."""
        return np.asarray((self._curve(u, 1) * self._curve(u)).sum(axis=1))

    def rate(self, u: Array, space: Space, x: Array) -> Array:
        """See `Parametrisation`."""
        along, bend = self._curve(u, 1), self._curve(u, 2)
        # the lines turn, so that they pass faster on the outside of a bend than on the inside
        aside = in_plane(space, x) - self._curve(u)
        return np.asarray((along**2 - bend * aside).sum(axis=1))


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
) -> NewtonResult:
    """Find the states at some points u, (size + 1, n), from guesses of them.

    The factors may be those of states nearby.

    Raises
    ------
    NewtonError
        If a state was not found.
    """
    problem = Constrained(equations, parametrisation.constraint(u), parametrisation.values(u))
    return find_roots(problem, guess, options, factors)


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


@dataclass(frozen=True)
class SolvedStates:
    """States that were solved, and their derivatives along the curve through them.

    Attributes
    ----------
    equations : LeverEquations
    u : ndarray, shape (k,)
        Where they are: √(T_tip − T_base) (K^½), zero without power. Of a lever that does not start
        cold: how far along the branch they are, from where it is without a bias. Negative on the
        way to biases of the other polarity.
    x, slopes : ndarray, shape (size + 1, k)
        The states, and their derivatives by u.
    values, value_slopes : ndarray, shape (k, 4)
        V_l (V), I_h (mA), V_r (V) and the rise of the tip (K) of each state, and their derivatives
        by u.
    highest_rise : ndarray, shape (k,)
        The highest rise (K) anywhere in the lever.
    """

    equations: LeverEquations
    u: Array
    x: Array
    slopes: Array
    values: Array
    value_slopes: Array
    highest_rise: Array

    @classmethod
    def of(cls, equations: LeverEquations, u: Array, x: Array, slopes: Array) -> Self:
        """Return states, and what they show, from their slopes by u."""
        values = np.vstack([equations.observed(x), equations.space.tip_rise(x)])
        by_u = equations.observed_change(x, slopes), equations.space.tip_rise(slopes)
        return cls(equations, u, x, slopes, values.T, np.vstack(by_u).T, equations.highest_rise(x))

    @classmethod
    def cold(cls, equations: LeverEquations, slope: Array) -> Self:
        """Return the state without power, whose slope is given."""
        return cls.of(equations, np.zeros(1), np.zeros_like(slope), slope)

    def among(self, which: NDArray[np.bool_ | np.intp]) -> Self:
        """Return some of them, by a mask or in an order."""
        return type(self)(
            equations=self.equations,
            u=self.u[which],
            x=self.x[:, which],
            slopes=self.slopes[:, which],
            values=self.values[which],
            value_slopes=self.value_slopes[which],
            highest_rise=self.highest_rise[which],
        )

    def followed_by(self, after: Self) -> Self:
        """Return the same with others after them."""
        return type(self)(
            equations=self.equations,
            u=np.append(self.u, after.u),
            x=np.hstack([self.x, after.x]),
            slopes=np.hstack([self.slopes, after.slopes]),
            values=np.vstack([self.values, after.values]),
            value_slopes=np.vstack([self.value_slopes, after.value_slopes]),
            highest_rise=np.append(self.highest_rise, after.highest_rise),
        )

    @cached_property
    def mirrored(self) -> Self:
        """The same with all potentials and currents reversed, followed the other way."""
        sign = np.where(self.equations.space.is_temperature, 1.0, -1.0)[:, None]
        of_values = np.append(-np.ones(len(ELECTRICAL_OUTPUTS)), 1.0)
        return type(self)(
            equations=self.equations.mirrored,
            u=-self.u[::-1],
            x=sign * self.x[:, ::-1],
            slopes=-sign * self.slopes[:, ::-1],
            values=of_values * self.values[::-1],
            value_slopes=-of_values * self.value_slopes[::-1],
            highest_rise=self.highest_rise[::-1],
        )

    # --- between them -----------------------------------------------------------------------------

    def states(self, u: Array) -> Array:
        """Return the states at some u, shape (size + 1, n)."""
        return np.asarray(self._curve(u)).T

    @cached_property
    def _curve(self) -> Piecewise:
        return self.through(self.x.T, self.slopes.T)

    def through(self, values: Array, slopes: Array) -> Piecewise:
        """Return the curve through some quantities of the states and their slopes, (k, ...)."""
        return smooth_curve(self.u, values, slopes, self.steps)

    @cached_property
    def steps(self) -> Array:
        """Where higher derivatives by u step; not known of places that are not of the tip."""
        return steps_of(self.equations) if self.starts_cold else np.empty(0)

    @cached_property
    def starts_cold(self) -> bool:
        """Whether one is at the base temperature: without a bias nothing heats the lever."""
        return not self.x.any(axis=0).all()

    @property
    def begins_cold(self) -> bool:
        """Whether they do, and none is on the way to biases of the other polarity."""
        return self.starts_cold and self.u[0] == 0.0

    @property
    def solved(self) -> Index:
        """The states that were solved: all but the one without power."""
        return np.flatnonzero(self.x.any(axis=0))

    def has_power(self, u: Array) -> NDArray[np.bool_]:
        """Return which states at some u have power, (n,)."""
        return np.asarray((u != 0.0) | (not self.starts_cold))

    # --- how hot they get -------------------------------------------------------------------------

    @property
    def melting_rise(self) -> float:
        """Rise (K) beyond which no state is meaningful."""
        return self.equations.laws.limit[0] - self.equations.base_temperature_K

    @property
    def melts(self) -> bool:
        """Whether something melts at the last state: silicon, or another material."""
        return bool(self.highest_rise[-1] >= self.melting_rise)

    @cached_property
    def end_u(self) -> float:
        """Where the states end: at the last one, or where something begins to melt."""
        return self._where_it_reaches(self.melting_rise) if self.melts else float(self.u[-1])

    def turns(self, quantity: Piecewise) -> Array:
        """Return u where a curve over u is level, up to the end."""
        level = np.sort(quantity.derivative().roots())
        return level[(level > 0) & (level < self.end_u)]

    def highest_rise_at(self, u: Array) -> Array:
        """Return the highest rise (K) anywhere in the lever at some u, (n,)."""
        highest, order = np.empty(u.size), np.argsort(u)
        for some in np.split(order, range(_AT_ONCE, u.size, _AT_ONCE)):
            if some.size:
                highest[some] = self._between_few(u[some])
        return highest

    def _where_it_reaches(self, rise: float) -> float:
        """Return the first u at which the highest rise is `rise` (K), as it is at the end.

        The place lies before the first state that is as hot.
        """
        start = int(np.searchsorted(self.u, 0.0))
        after = start + int(np.flatnonzero(self.highest_rise[start:] >= rise)[0])
        if after == start:
            return float(self.u[start])
        low, high = self.u[after - 1 : after + 1]
        for _ in range(_ROUNDS):
            u = np.linspace(low, high, _POINTS)
            rises = self.highest_rise_at(u)
            above = max(1, int(np.argmax(rises >= rise)))
            (low, high), ends = u[above - 1 : above + 1], rises[above - 1 : above + 1]
        return float(np.interp(rise, ends, [low, high]))

    def _between_few(self, u: Array) -> Array:
        """Return the highest rises at few u in rising order."""
        first, last = np.searchsorted(self.u, u[[0, -1]])
        # the curve between two states depends on the next ones on either side
        near = slice(max(first - 2, 0), last + 2)
        nodes, unit = self.u[near], np.eye(self.u[near].size)
        weights = smooth_curve(
            nodes, np.hstack([unit, 0.0 * unit]), np.hstack([0.0 * unit, unit]), self.steps
        )(u)
        equations, elements = self.equations, self.equations.space.elements
        rises = equations.nodal_rises(self.x[:, near])
        slopes = equations.space.nodal_rises(self.slopes[:, near])
        dofs = elements.dofs[elements.near_highest(rises, _NEARLY)]
        used, dofs = np.unique(dofs, return_inverse=True)
        values = np.hstack([rises[used], slopes[used]]) @ weights.T
        return elements.highest(values, dofs.reshape(-1, elements.dofs.shape[1]))
