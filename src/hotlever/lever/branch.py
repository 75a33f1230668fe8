"""The branch of a lever: one curve by tip temperature, which every circuit reads.

At a tip temperature a lever has one state, whatever the circuit: current, lever voltage and
fields follow from the temperature, folds or not. So states are solved at tip temperatures
(`hotlever.lever.continuation`), with their exact derivatives along the curve, and smooth curves
through both give every state between. All curves run over u = √(T_tip − T_base), in which they are
smooth down to zero power: the potential begins as u, the temperature as u². The curves of a lever
that more than the swept supply heats run over their length.

A sweep reads the branch in a circuit, as a slow ramp of the bias does (`hotlever.lever.readings`).
The fold of a ramp is a maximum of that bias, the knee of the I-V curve the maximum of V_l.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import BranchEndError
from hotlever.lever.equations import ELECTRICAL_OUTPUTS, LeverEquations
from hotlever.lever.newton import NewtonOptions, NewtonResult
from hotlever.lever.readings import ByPower, Reading, slow_ramp
from hotlever.lever.solved_states import (
    NATURAL,
    UNIT_K,
    UNIT_V,
    Parametrisation,
    PseudoArclength,
    SolvedStates,
    solve_at,
)
from hotlever.piecewise import Piecewise
from hotlever.probe.circuit import Circuit
from hotlever.types import Array

#: Steps of Newton's method from the root of a rise to its place.
_CORRECTIONS = 3
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
class Branch(SolvedStates):
    """States of a lever one after the other, and the curves through what they show.

    Attributes
    ----------
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

    stated_parametrisation: Parametrisation | None = None

    @classmethod
    def of_roots(
        cls,
        equations: LeverEquations,
        u: Array,
        roots: NewtonResult,
        parametrisation: Parametrisation = NATURAL,
    ) -> Branch:
        """Return the branch of states that were found at some points u, and differentiate them."""
        along = equations.along(roots.x, roots.factors, parametrisation.constraint(u))
        rate = parametrisation.rate(u, equations.space, roots.x)
        return cls.of(equations, u, roots.x, rate * along)

    @classmethod
    def whole(
        cls,
        equations: LeverEquations,
        u: Array,
        roots: NewtonResult,
        parametrisation: Parametrisation = NATURAL,
    ) -> Branch:
        """Return the same, beginning without power if their points do."""
        branch = cls.of_roots(equations, u, roots, parametrisation)
        if parametrisation is not NATURAL:
            return replace(branch, stated_parametrisation=parametrisation)
        cold = cls.cold(equations, equations.cold()[0])
        below, above = branch.among(u < 0.0), branch.among(u > 0.0)
        return below.followed_by(cold).followed_by(above)

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
        own = self.curve.c[..., [TIP_RISE, 0]] / np.array([UNIT_K, UNIT_V])
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
        for _ in range(_CORRECTIONS):
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

    def point(self, u: float) -> OperatingPoint:
        """Return the operating point at u."""
        lever, current, *_ = self.curve(u).tolist()
        return OperatingPoint(lever, current, lever * current, float(self.tip_K(u)))

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
        return slow_ramp(curve, turns, back.end_u, -bias, back.tip_K, -from_u).mirrored

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


def shifted(branch: Branch, changes: Array, slopes: Array) -> Branch:
    """Return a branch with V_l, I_h, V_r and the rise of the tip changed by (k, 4).

    The slopes are derivatives of the changes by u.
    """
    return replace(
        branch, values=branch.values + changes, value_slopes=branch.value_slopes + slopes
    )


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
