"""The branch of a lever: one curve by tip temperature, which every circuit reads.

At a tip temperature a lever has one state, whatever the circuit: current, lever voltage and
fields follow from the temperature, folds or not. So states are solved at tip temperatures
(`hotlever.lever.continuation`), with their exact derivatives along the curve, and smooth curves
through both give every state between. All curves run over u = √(T_tip − T_base), in which they are
smooth down to zero power: the potential begins as u, the temperature as u². The curves of a lever
that more than the swept supply heats run over their length.

How hot they get anywhere: which place is the hottest changes along a branch, a leg may overtake the
heater. So the temperatures of all places that come into question are read off their own smooth
curves, and the highest of them is taken last. A curve through the highest temperatures of the
states would not know of the bend where one place overtakes another.

A sweep reads the branch in a circuit, as a slow ramp of the bias does, which takes the first state
whose bias V_l + R_s I_h has been reached. The fold of a ramp is a maximum of that bias, the knee of
the I-V curve the maximum of V_l.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hotlever.errors import BranchEndError, ComputationError
from hotlever.lever.equations import ELECTRICAL_OUTPUTS, LeverEquations, steps_of
from hotlever.lever.newton import NewtonOptions, NewtonResult
from hotlever.lever.solved_states import (
    NATURAL,
    UNIT_K,
    Parametrisation,
    PseudoArclength,
    solve_at,
)
from hotlever.piecewise import Piecewise, crossing, smooth_curve
from hotlever.probe.circuit import Circuit
from hotlever.types import Array, Index

#: Where a branch's values have the rise of the tip.
TIP_RISE = len(ELECTRICAL_OUTPUTS)


@dataclass(frozen=True)
class OperatingPoint:
    """A state of a lever as an instrument and a thermometer see it.

    Attributes
    ----------
    lever_V, current_mA, power_mW, tip_K : float
        V_l, I_h, P_l = V_l I_h and T_tip.
    """

    lever_V: float
    current_mA: float
    power_mW: float
    tip_K: float


@dataclass(frozen=True)
class Branch:
    """States of a lever one after the other, and the curves through what they show.

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
    stated_parametrisation : Parametrisation, optional
        Of a lever that does not start cold: what the points u of similar levers have in common, if
        they are not lines across this branch itself.

    Examples
    --------
    >>> from hotlever import Lever, Probe
    >>> branch = Lever(Probe.reference()).branch(1000.0)
    >>> round(branch.knee.tip_K), branch.power([600.0, 800.0]).round(2).tolist()
    (900, [2.02, 2.6])
    """

    equations: LeverEquations
    u: Array
    x: Array
    slopes: Array
    values: Array
    value_slopes: Array
    highest_rise: Array
    stated_parametrisation: Parametrisation | None = None

    @classmethod
    def of(cls, equations: LeverEquations, u: Array, x: Array, slopes: Array) -> Branch:
        """Return states, and what they show, from their slopes by u."""
        values = np.vstack([equations.observed(x), equations.space.tip_rise(x)])
        by_u = equations.observed_change(x, slopes), equations.space.tip_rise(slopes)
        return cls(equations, u, x, slopes, values.T, np.vstack(by_u).T, equations.highest_rise(x))

    @classmethod
    def cold(cls, equations: LeverEquations, slope: Array) -> Branch:
        """Return the state without power, whose slope is given."""
        return cls.of(equations, np.zeros(1), np.zeros_like(slope), slope)

    def among(self, which: NDArray[np.bool_ | np.intp]) -> Branch:
        """Return some of them, by a mask or in an order."""
        return Branch(
            equations=self.equations,
            u=self.u[which],
            x=self.x[:, which],
            slopes=self.slopes[:, which],
            values=self.values[which],
            value_slopes=self.value_slopes[which],
            highest_rise=self.highest_rise[which],
        )

    def showing(self, values: Array, value_slopes: Array) -> Branch:
        """Return the same states, which show other values, with other derivatives by u."""
        other = replace(self, values=values, value_slopes=value_slopes)
        # what follows from the states alone is asked of thousands like it
        vars(other).update(end_u=self.end_u, steps=self.steps)
        return other

    def shifted(self, changes: Array, slopes: Array) -> Branch:
        """Return the branch with V_l, I_h, V_r and the rise of the tip changed by (k, 4).

        The slopes are derivatives of the changes by u.
        """
        return self.showing(self.values + changes, self.value_slopes + slopes)

    def followed_by(self, after: Branch) -> Branch:
        """Return the same with others after them."""
        return Branch(
            equations=self.equations,
            u=np.append(self.u, after.u),
            x=np.hstack([self.x, after.x]),
            slopes=np.hstack([self.slopes, after.slopes]),
            values=np.vstack([self.values, after.values]),
            value_slopes=np.vstack([self.value_slopes, after.value_slopes]),
            highest_rise=np.append(self.highest_rise, after.highest_rise),
        )

    @cached_property
    def mirrored(self) -> Branch:
        """The same with all potentials and currents reversed, followed the other way."""
        sign = np.where(self.equations.space.is_temperature, 1.0, -1.0)[:, None]
        of_values = np.append(-np.ones(len(ELECTRICAL_OUTPUTS)), 1.0)
        return Branch(
            equations=self.equations.mirrored,
            u=-self.u[::-1],
            x=sign * self.x[:, ::-1],
            slopes=-sign * self.slopes[:, ::-1],
            values=of_values * self.values[::-1],
            value_slopes=-of_values * self.value_slopes[::-1],
            highest_rise=self.highest_rise[::-1],
        )

    @classmethod
    def of_roots(
        cls,
        equations: LeverEquations,
        u: Array,
        roots: NewtonResult,
        parametrisation: Parametrisation = NATURAL,
        *,
        fresh: bool = False,
    ) -> Branch:
        """Return the branch of states that were found at some points u, and differentiate them.

        Their factors may be fresh, see `LeverEquations.along`.
        """
        constraint = parametrisation.constraint(u)
        along = equations.along(roots.x, roots.factors, constraint, fresh=fresh)
        rate = parametrisation.rate(u, equations.space, roots.x)
        return cls.of(equations, u, roots.x, rate * along)

    @classmethod
    def whole(
        cls,
        equations: LeverEquations,
        u: Array,
        roots: NewtonResult,
        parametrisation: Parametrisation = NATURAL,
        *,
        fresh: bool = False,
    ) -> Branch:
        """Return the same, beginning without power if their points do."""
        branch = cls.of_roots(equations, u, roots, parametrisation, fresh=fresh)
        if parametrisation is not NATURAL:
            return replace(branch, stated_parametrisation=parametrisation)
        cold = cls.cold(equations, equations.cold()[0])
        below, above = branch.among(u < 0.0), branch.among(u > 0.0)
        return below.followed_by(cold).followed_by(above)

    # --- between them -----------------------------------------------------------------------------

    def states(self, u: Array) -> Array:
        """Return the states at some u, shape (size + 1, n)."""
        return np.asarray(self._state_curve(u)).T

    @cached_property
    def _state_curve(self) -> Piecewise:
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

    # --- the curves -------------------------------------------------------------------------------

    @cached_property
    def curve(self) -> Piecewise:
        """V_l (V), I_h (mA), V_r (V) and the rise of the tip (K) by u."""
        return self.through(self.values, self.value_slopes)

    @cached_property
    def parametrisation(self) -> Parametrisation:
        """What a point on the branch of a similar lever has in common with one on this."""
        if self.starts_cold:
            return NATURAL
        return self.stated_parametrisation or PseudoArclength(self.path)

    @cached_property
    def path(self) -> Piecewise:
        """Tip and lever voltage by u, in the units of `hotlever.lever.solved_states.in_plane`."""
        own = self.curve.c[..., [TIP_RISE, 0]] / np.array([UNIT_K, 1.0])
        return Piecewise(own, self.curve.x)

    @property
    def base_temperature_K(self) -> float:
        """Temperature without power (K)."""
        return self.equations.base_temperature_K

    @property
    def hottest_K(self) -> float:
        """Highest tip temperature (K)."""
        return float(self.tip_K(self.end_u))

    def tip_K(self, u: ArrayLike) -> Array:
        """Return tip temperatures (K) at some points of the branch."""
        return self.base_temperature_K + self.rise(np.asarray(u, dtype=float))

    def rise(self, u: Array) -> Array:
        """Return rises of the tip (K) at some points of the branch."""
        return np.asarray(self.curve(u)[..., TIP_RISE])

    def u_at(self, tip_K: ArrayLike) -> Array:
        """Return u at tip temperatures (K) of a lever that starts cold; NaN outside the branch."""
        rise = np.asarray(tip_K, dtype=float) - self.base_temperature_K
        inside = (rise >= 0) & (rise <= self.end_u**2 * (1 + 1e-12))
        u = np.sqrt(np.where(inside, np.maximum(rise, 0.0), np.nan))
        # three steps of Newton's method lead from the root of a rise to its place
        for _ in range(3):
            # before the first state points may differ from the root of the rise
            slope = self.curve(u, 1)[..., TIP_RISE]
            u = u - np.divide(self.rise(u) - rise, slope, out=np.zeros_like(u), where=slope > 0)
        return np.asarray(u)

    def electrical_outputs(self, u: ArrayLike) -> dict[str, Array]:
        """Return what an instrument shows, by name: ``lever_V``, ``current_mA``, ``reader_V``."""
        values = self.curve(np.asarray(u, dtype=float))
        return {name: values[..., column] for column, name in enumerate(ELECTRICAL_OUTPUTS)}

    def lever_voltage(self, tip_K: ArrayLike) -> Array:
        """Return V_l (V) by tip temperature (K); NaN outside the branch."""
        return self.electrical_outputs(self.u_at(tip_K))["lever_V"]

    def current(self, tip_K: ArrayLike) -> Array:
        """Return I_h (mA) by tip temperature (K); NaN outside the branch."""
        return self.electrical_outputs(self.u_at(tip_K))["current_mA"]

    def power(self, tip_K: ArrayLike) -> Array:
        """Return P_l (mW) by tip temperature (K); NaN outside the branch."""
        return self.lever_voltage(tip_K) * self.current(tip_K)

    def bias(self, tip_K: ArrayLike, circuit: Circuit) -> Array:
        """Return the bias (V) that heats the tip to a temperature (K) in a circuit.

        Between the folds of a lever with a small or very large series resistance the state at
        this bias depends on where one comes from.
        """
        bias: Array = circuit.bias(self.lever_voltage(tip_K), self.current(tip_K))
        return bias

    @cached_property
    def by_power(self) -> ByPower:
        """The tip temperature by power, as far as that is a function."""
        return ByPower(self, self.curve)

    @property
    def power_turns_K(self) -> float | None:
        """Tip temperature from which on the power falls (K); None if it rises to the end."""
        turn = self.by_power.turn_u
        return None if turn is None else float(self.tip_K(turn))

    def tip_temperature(self, power_mW: ArrayLike) -> Array:
        """Return the tip temperature (K) by power (mW); NaN where there is none, or several."""
        return self.tip_K(self.by_power.u(np.asarray(power_mW, dtype=float)))

    @cached_property
    def knee_u(self) -> float | None:
        """Where the knee is."""
        lever_V = Piecewise(self.curve.c[..., 0], self.curve.x)
        falling = [u for u in self.turns(lever_V).tolist() if lever_V(u, 2) < 0]
        return falling[0] if falling else None

    @property
    def knee(self) -> OperatingPoint | None:
        """The knee dV_l/dI_h = 0: the highest lever voltage; None if V_l rises to the end."""
        return None if self.knee_u is None else self.point(self.knee_u)

    def need_knee(self, which: str = "the lever") -> OperatingPoint:
        """Return the knee.

        Raises
        ------
        ComputationError
            If there is none, saying of which lever.
        """
        if self.knee is None:
            raise ComputationError(f"{which} has no knee below {self.hottest_K:.0f} K")
        return self.knee

    def point(self, u: float) -> OperatingPoint:
        """Return the operating point at u."""
        lever, current, *_ = self.curve(u).tolist()
        return OperatingPoint(lever, current, lever * current, float(self.tip_K(u)))

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
        together = 64
        for some in np.split(order, range(together, u.size, together)):
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
        # each round narrows down to one of 16 pieces between two states
        for _ in range(3):
            u = np.linspace(low, high, 17)
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
        # elements with this share of the highest rise at a state nearby come into question
        dofs = elements.dofs[elements.near_highest(rises, 0.85)]
        used, dofs = np.unique(dofs, return_inverse=True)
        values = np.hstack([rises[used], slopes[used]]) @ weights.T
        return elements.highest(values, dofs.reshape(-1, elements.dofs.shape[1]))

    # --- in a circuit -----------------------------------------------------------------------------

    def read(self, circuit: Circuit, bias: Array) -> Reading:
        """Find the states that a slow ramp from zero takes at some biases (V), in any order.

        To negative ones another ramp leads.
        """
        below = bias < 0.0
        if not below.any():
            return self._ramp(circuit, bias)
        up = self._ramp(circuit, bias[~below])
        down = self.mirrored._ramp(circuit, -bias[below]).mirrored
        u = np.empty(bias.shape)
        u[~below], u[below] = up.u, down.u
        ends = down if np.isnan(down.u).any() and not np.isnan(up.u).any() else up
        return replace(ends, u=u, jumps=[*up.jumps, *down.jumps])

    def read_back(self, circuit: Circuit, bias: Array, from_u: float) -> Reading:
        """Find the states that a slow ramp back to zero takes from a place of the branch.

        The biases (V) may be in any order, none of them above that of the place.
        """
        # with reversed signs that ramp is one upwards
        back, turns = self.mirrored, -self.turns(self.bias_by_u(circuit))[::-1]
        curve = back.bias_by_u(circuit)
        # what is at no bias, where the way back ends, is found to rounding errors
        end = float(curve(back.end_u))
        asked = np.where(np.abs(bias + end) < 1e-9, end, -bias)
        return slow_ramp(curve, turns, back.end_u, asked, back.tip_K, -from_u).mirrored

    def with_folds(self, circuit: Circuit) -> Branch:
        """Return the branch with a solved state at each fold of the bias in a circuit.

        A fold read from curves between states is off by as much as these, to first order; through a
        state and its tangent by their square.

        Raises
        ------
        ComputationError
            If a state was not found.
        """
        curve = self.bias_by_u(circuit)
        # at a state of the branch, as its end, there is nothing to add
        folds = np.array([u for u in self.turns(curve).tolist() if u not in self.u])
        if not folds.size:
            return self
        lines = self.parametrisation
        guess = self.states(folds)
        roots = solve_at(self.equations, folds, guess, NewtonOptions(), parametrisation=lines)
        every = self.followed_by(Branch.of_roots(self.equations, folds, roots, lines))
        ordered = every.among(np.argsort(every.u))
        return replace(ordered, stated_parametrisation=self.stated_parametrisation)

    def highest_bias(self, circuit: Circuit, bias_V: float) -> float:
        """Return the highest bias (V) up to some one at which a slow ramp finds a state."""
        reading = self.read(circuit, np.array([bias_V]))
        return bias_V if np.isfinite(reading.u[0]) else reading.last_V

    def bias_by_u(self, circuit: Circuit) -> Piecewise:
        """Return the bias (V) along the branch in a circuit."""
        return Piecewise(circuit.bias(self.curve.c[..., 0], self.curve.c[..., 1]), self.curve.x)

    def _ramp(self, circuit: Circuit, bias: Array) -> Reading:
        """Find the states that a slow ramp takes from zero upwards."""
        curve = self.bias_by_u(circuit)
        return slow_ramp(curve, self.turns(curve), self.end_u, bias, self.tip_K)


class ByPower:
    """A branch of a lever that starts cold, read by its power at biases of 0 and more.

    On most levers the power rises with the tip temperature to the end. Where the heat moves towards
    the tip faster than the tip gets hotter, the power turns: the tip gets hotter with less of it,
    and a power belongs to several temperatures.

    Parameters
    ----------
    branch : Branch
    curve : Piecewise
        V_l (V) and I_h (mA) by u, and what else it shows.
    """

    def __init__(self, branch: Branch, curve: Piecewise) -> None:
        self._branch, self._curve = branch, curve

    @cached_property
    def _power(self) -> Piecewise:
        """P_l (mW) by u."""
        lever_V, current = (
            Piecewise(self._curve.c[..., column], self._curve.x) for column in (0, 1)
        )
        return lever_V * current

    @cached_property
    def turn_u(self) -> float | None:
        """Where the power is highest before it falls; None if it rises to the end."""
        falling = [u for u in self._branch.turns(self._power).tolist() if self._power(u, 2) < 0]
        return falling[0] if falling else None

    @cached_property
    def highest_mW(self) -> float:
        """The highest power up to which every power has one temperature."""
        end = self._branch.end_u
        if self.turn_u is None:
            return float(self._power(end))
        level = self._branch.turns(self._power)
        beyond = np.append(level[level > self.turn_u], end)
        return float(self._power(beyond).min())

    def u(self, power_mW: Array) -> Array:
        """Return where some powers (mW) are; NaN where there is none, or several."""
        if self.turn_u is None:
            u = self._by_root(np.sqrt(np.maximum(power_mW, 0.0)))
        else:
            flat = crossing(self._power, 0.0, self.turn_u, power_mW.ravel())
            u = flat.reshape(power_mW.shape)
        inside = (power_mW >= 0) & (power_mW <= self.highest_mW)
        return np.where(inside, u, np.nan)

    def slope(self, power_mW: Array) -> Array:
        """Return dT_tip/dP_l (K/mW) at some powers (mW), which are not zero."""
        if self.turn_u is not None:
            u = self.u(power_mW)
            return np.asarray(2.0 * u / self._power(u, 1))
        root = np.sqrt(power_mW)
        return np.asarray(self._by_root(root) * self._by_root(root, 1) / root)

    @cached_property
    def _by_root(self) -> Piecewise:
        """u by the root of the power, which is nearly a straight line."""
        branch = self._branch
        here = branch.u >= 0.0
        u, values, slopes = branch.u[here], branch.values[here], branch.value_slopes[here]
        power = values[:, 0] * values[:, 1]
        slope = slopes[:, 0] * values[:, 1] + values[:, 0] * slopes[:, 1]
        root = np.sqrt(power)
        # at zero power both begin as u
        by_u = np.append(np.sqrt(slopes[0, 0] * slopes[0, 1]), slope[1:] / (2.0 * root[1:]))
        bent = root[np.isin(u, branch.steps)]
        return smooth_curve(root, u, 1.0 / by_u, bent)


@dataclass(frozen=True)
class Reach:
    """How far a branch must go: until a bias in a circuit, and one state beyond.

    The curve between two states depends on the next one as well. A lever that does not start cold
    may be asked for biases of the other polarity, down to a lowest one.
    """

    circuit: Circuit
    bias_V: float
    lowest_V: float | None = None

    @property
    def mirrored(self) -> Reach:
        """How far the branch of the other polarity must go."""
        return Reach(self.circuit, -(self.lowest_V or 0.0))

    def count(self, values: Array) -> int | None:
        """Return how many states suffice, by their V_l and I_h, (k, 2 or more); None if not all."""
        above = np.flatnonzero(self.circuit.bias(values[:, 0], values[:, 1]) >= self.bias_V)
        return int(above[0]) + 2 if above.size and above[0] + 2 <= len(values) else None

    def __call__(self, branch: Branch) -> bool:
        """Return whether a branch goes far enough."""
        return self.count(branch.values) is not None


def branch_end(branch: Branch, reading: Reading) -> BranchEndError:
    """Return the error that says where a ramp of the bias ends.

    The lever itself ends there only if it was followed until something melts, and is no reduced
    one, which goes as far as it was made for.
    """
    bias, tip = reading.last_V, reading.last_K
    limit, end = branch.equations.laws.limit
    side = branch if bias >= 0 else branch.mirrored
    at_end = f"at a bias of {bias:.4f} V, where the tip is at {tip:.1f} K"
    if branch.equations.space.is_reduced:
        text = f"the reduced lever ends {at_end}: beyond it the full lever has to be solved"
    elif not side.melts:
        text = (
            f"the branch was solved up to a state {at_end}; how far the lever itself goes is "
            "not known from it"
        )
    elif abs(reading.last_u) == side.end_u:
        text = f"{end} {at_end}"
    else:
        at = branch.point(reading.last_u)
        text = (
            f"the branch of a slow bias ramp ends at a bias of {bias:.4f} V (lever "
            f"{at.lever_V:.4f} V, current {at.current_mA:.4f} mA, tip {tip:.1f} K): beyond it "
            f"there is no steady state below {limit:.0f} K"
        )
    return BranchEndError(text, bias_reached=bias)


# --- readings by a slow ramp of the bias ----------------------------------------------------------


@dataclass(frozen=True)
class Reading:
    """Where a slow ramp of the bias finds a lever.

    Attributes
    ----------
    u : ndarray, shape (n,)
        Where on the branch each bias asked for is; NaN beyond the last that has a state.
    jumps : list of tuple of float
        Bias (V) and tip temperature (K) at each fold that the ramp passes.
    last_V, last_u, last_K : float
        The highest bias that has a state on the branch, where that is, and the tip temperature.
    jumps_back : tuple of tuple of float
        As `jumps`, of a ramp that goes back to zero.
    """

    u: Array
    jumps: list[tuple[float, float]]
    last_V: float
    last_u: float
    last_K: float
    jumps_back: tuple[tuple[float, float], ...] = ()

    @property
    def mirrored(self) -> Reading:
        """The same of the other polarity."""
        jumps = [(-fold, tip) for fold, tip in self.jumps]
        return Reading(-self.u, jumps, -self.last_V, -self.last_u, self.last_K)

    def and_back(self, back: Reading) -> Reading:
        """Return what a ramp finds that goes back to zero from the last place of this one."""
        u = np.concatenate([self.u, back.u])
        return replace(self, u=u, jumps_back=tuple(back.jumps))

    def notes(self, bias: Array) -> list[str]:
        """Say where a ramp through some biases (V) leaves the branch for another part of it."""
        return [
            f"{back}at a bias of {fold:.4f} V the lever jumps from a tip at {tip:.0f} K to a "
            f"{other} branch"
            for back, other, jumps in (
                ("", "hotter", self.jumps),
                ("on the way back, ", "colder", self.jumps_back),
            )
            for fold, tip in jumps
            if bias.min(initial=0.0) < fold < bias.max(initial=0.0)
        ]


def there_and_back(bias: Array) -> Array:
    """Return rising biases, and behind them the same falling.

    Examples
    --------
    >>> there_and_back(np.array([0.0, 1.0, 2.0])).tolist()
    [0.0, 1.0, 2.0, 1.0, 0.0]
    """
    return np.concatenate([bias, bias[-2::-1]])


def slow_ramp(
    curve: Piecewise,
    turns: Array,
    end: float,
    bias: Array,
    tip_K: Callable[[float], Array],
    start: float | None = None,
) -> Reading:
    """Find the states that a slow ramp takes from a start upwards.

    Parameters
    ----------
    curve : Piecewise
        The bias (V) by u.
    turns : ndarray
        Each u at which the curve is level, rising.
    end : float
        Where the branch ends.
    bias : ndarray, shape (n,)
        What is looked for, in any order.
    tip_K : callable
        The tip temperature by u.
    start : float, optional
        Where the ramp begins; where there is no bias if left out.
    """
    u = np.full(bias.shape, np.nan)
    if start is None:
        start = 0.0
        # so little is no bias
        if abs(float(curve(start))) >= 1e-9:
            # a similar lever has no bias elsewhere, near where its branch was followed from
            roots = curve.roots()
            start = float(roots[np.argmin(np.abs(roots))]) if roots.size else float(curve.x[0])
    # what is at no bias is found to rounding errors
    reading = Reading(u, [], min(0.0, float(curve(start))), start, float(tip_K(start)))
    for low, high in pairwise([start, *turns[turns > start].tolist(), end]):
        highest = float(curve(high))
        if highest <= reading.last_V:
            continue  # the bias falls here, or has been as high before
        fell = float(curve(low)) < reading.last_V
        jumps = [*reading.jumps, (reading.last_V, reading.last_K)] if fell else reading.jumps
        here = np.flatnonzero(np.isnan(u) & (bias <= highest))
        u[here] = crossing(curve, low, high, bias[here])
        reading = Reading(u, jumps, highest, high, float(tip_K(high)))
    return reading
