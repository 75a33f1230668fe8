"""Following the solutions of a lever as the bias is raised slowly from zero.

The solutions form a smooth curve. Along most of it the bias rises and a state is found by
Newton's method from a tangent (or curved) prediction. Where the tip temperature changes fast
the curve is followed by arc length in the plane of bias and tip temperature, which also passes
folds: biases at which the curve turns back. A slow ramp cannot turn back. It jumps to the
next part of the curve that exists beyond the fold, or, if the silicon would melt before one is
reached, the branch ends there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import BranchEndError, ComputationError, NewtonError
from hotlever.lever.equations import LeverEquations, Pin
from hotlever.lever.newton import NewtonOptions, newton

Array = NDArray[np.float64]

#: Melting point of silicon (K): no state beyond it is meaningful.
MELTING_POINT = 1687.0
#: Units of arc length: this many volts or kelvins are one.
BIAS_UNIT, TIP_UNIT = 1.0, 100.0

AT_BIAS, AT_TIP = Pin(1.0, 0.0), Pin(0.0, 1.0)


@dataclass(frozen=True)
class ContinuationOptions:
    """Step control.

    Attributes
    ----------
    newton : NewtonOptions
    largest_tip_step : float
        A step in bias that is predicted to change the tip temperature by more than this (K)
        is replaced by steps in arc length.
    largest_bias_step : float
        The same for the bias (V).
    arc_step, smallest_arc_step : float
        First and smallest arc length of a step.
    max_steps : int
        Steps between two biases asked for.
    """

    newton: NewtonOptions = field(default_factory=NewtonOptions)
    largest_tip_step: float = 120.0
    largest_bias_step: float = 2.0
    arc_step: float = 1.0
    smallest_arc_step: float = 1e-4
    max_steps: int = 200


@dataclass(frozen=True)
class State:
    """A point of the curve.

    Attributes
    ----------
    x : ndarray
        Unknowns.
    tangent : ndarray
        Derivative of `x` by arc length, in the direction of following.
    bias, tip : float
        V and K.
    iterations : int
        Newton iterations spent on the state.
    """

    x: Array
    tangent: Array
    bias: float
    tip: float
    iterations: int


class BranchFollower:
    """Follows the curve of one lever from zero bias upwards.

    Parameters
    ----------
    equations : LeverEquations
    options : ContinuationOptions, optional

    Attributes
    ----------
    folds : list of State
        Biases passed at which the curve turns: the ramp leaves the branch there.
    solves : int
        Newton iterations spent so far.
    """

    def __init__(
        self, equations: LeverEquations, options: ContinuationOptions | None = None
    ) -> None:
        self.equations = equations
        self.options = options or ContinuationOptions()
        self.folds: list[State] = []
        self.solves = 0
        unknowns, weights = equations.space.tip
        self._tip_row = np.zeros(equations.space.size + 2)
        self._tip_row[unknowns] = weights
        start = equations.start()
        self.state = self._solve(start, AT_BIAS, 0.0, None)
        self._previous: State | None = None
        self._arc = self.options.arc_step

    def ramp(self, biases: Sequence[float]) -> Iterator[State]:
        """Yield the state at each bias, in the order of rising bias.

        Parameters
        ----------
        biases : sequence of float
            Rising biases (V), none below zero.

        Raises
        ------
        BranchEndError
            If the branch ends below a bias asked for.
        ComputationError
            If the curve could not be followed further.
        """
        for bias in biases:
            yield self.advance_to(bias)

    def resume(self, state: State) -> None:
        """Go on from a state that a ramp of the same lever has reached before."""
        self.state, self._previous = state, None

    def advance_to(self, bias: float) -> State:
        """Move along the curve to a bias (V) not below the present one; see `ramp`."""
        for _ in range(self.options.max_steps):
            if self.state.bias == bias and self._rising(self.state):
                return self.state
            state = self._step_to_bias(bias) or self._step_along_arc(bias)
            self._move_to(state)
        raise ComputationError(
            f"stopped at a bias of {self.state.bias:.4g} V (tip at {self.state.tip:.0f} K): "
            f"{self.options.max_steps} steps did not reach {bias:.4g} V"
        )

    def follow_arc(self, keep_going: Callable[[State], bool]) -> Iterator[State]:
        """Yield states along the curve, unstable ones included, while `keep_going` says so."""
        while keep_going(self.state):
            state = self._step_along_arc(None)
            self._move_to(state)
            yield state

    # --- steps -------------------------------------------------------------------------------

    def _step_to_bias(self, bias: float) -> State | None:
        """Try to reach `bias` in one step; None if that could leave the branch unseen."""
        here, options = self.state, self.options
        rise = bias - here.bias
        if not self._rising(here) or rise > options.largest_bias_step:
            return None
        slope = here.tangent / here.tangent[-1]
        change = rise * (slope + 0.5 * rise * self._curvature(slope))
        predicted, expected = here.x + change, self._tip(change)
        if abs(rise * self._tip(slope)) > options.largest_tip_step or (
            abs(expected) > options.largest_tip_step
        ):
            return None
        try:
            state = self._solve(predicted, AT_BIAS, bias, here)
        except NewtonError:
            return None
        return state if self._rising(state) and self._neighbours(here, state) else None

    def _step_along_arc(self, bias: float | None) -> State:
        """Take one step in arc length, ending exactly at `bias` if the step would cross it."""
        here = self.state
        while self._arc >= self.options.smallest_arc_step:
            predicted = here.x + self._arc * here.tangent
            pin = Pin(here.tangent[-1] / BIAS_UNIT**2, self._tip(here.tangent) / TIP_UNIT**2)
            expected = here.tip + self._arc * self._tip(here.tangent)
            value = pin.bias * predicted[-1] + pin.tip * expected
            try:
                state = self._solve(predicted, pin, value, here)
            except NewtonError:
                self._arc /= 2
                continue
            if not self._neighbours(here, state):
                self._arc /= 2
                continue
            if bias is not None and here.bias < bias <= state.bias:
                landed = self._land(here, state, bias)
                if landed is None:
                    self._arc /= 2
                    continue
                return landed
            self._arc = min(self._arc * (1.6 if state.iterations <= 4 else 1.0), 1.5)
            return state
        self._arc = self.options.arc_step
        raise ComputationError(
            f"stopped at a bias of {here.bias:.4g} V (tip at {here.tip:.0f} K): "
            "the next state was not found even with the smallest step"
        )

    def _land(self, below: State, above: State, bias: float) -> State | None:
        """Solve at `bias` between two neighbouring states."""
        share = (bias - below.bias) / (above.bias - below.bias)
        guess = below.x + share * (above.x - below.x)
        try:
            state = self._solve(guess, AT_BIAS, bias, below)
        except NewtonError:
            return None
        low, high = sorted((below.tip, above.tip))
        inside = low - 5.0 <= state.tip <= high + 5.0
        return state if inside and self._rising(state) else None

    def _solve(self, guess: Array, pin: Pin, value: float, origin: State | None) -> State:
        """Find the state near `guess` whose pin has this value, and its tangent."""
        result = newton(self.equations.pinned(pin, value), guess, self.options.newton)
        self.solves += result.iterations
        unit = np.zeros_like(result.x)
        unit[-1] = 1.0
        tangent = result.jacobian.solve(unit)
        tangent /= np.hypot(tangent[-1] / BIAS_UNIT, self._tip(tangent) / TIP_UNIT)
        forward = tangent[-1] if origin is None else self._along(tangent, origin.tangent)
        return State(
            result.x,
            np.copysign(1.0, forward) * tangent,
            # to rounding, V_b is the bias it was pinned to
            value if pin == AT_BIAS else float(result.x[-1]),
            self.equations.space.tip_temperature(result.x),
            result.iterations,
        )

    # --- geometry of the curve ---------------------------------------------------------------

    def _tip(self, vector: Array) -> float:
        return float(self._tip_row @ vector)

    def _along(self, tangent: Array, other: Array) -> float:
        """Inner product of two tangents in the plane of bias and tip temperature."""
        return float(
            tangent[-1] * other[-1] / BIAS_UNIT**2
            + self._tip(tangent) * self._tip(other) / TIP_UNIT**2
        )

    def _neighbours(self, here: State, there: State) -> bool:
        """Whether nothing but a gentle bend lies between two states.

        Between near neighbours the tangent turns little, and the chord halves the angle
        between the tangents. A pair of folds stepped over betrays itself by a chord that is
        steeper than both.
        """
        turned = self._along(here.tangent, there.tangent)
        chord, middle = there.x - here.x, here.tangent + there.tangent
        lengths = self._along(chord, chord) * self._along(middle, middle)
        halved = self._along(chord, middle) / max(np.sqrt(lengths), 1e-300)
        return bool(turned > 0.7 and halved > 0.995)

    @staticmethod
    def _rising(state: State) -> bool:
        return bool(state.tangent[-1] > 0)

    def _curvature(self, slope: Array) -> Array | float:
        """Second derivative of the unknowns by bias, from the last two states."""
        before = self._previous
        if before is None or not self._rising(before) or self.state.bias <= before.bias:
            return 0.0
        return (slope - before.tangent / before.tangent[-1]) / (self.state.bias - before.bias)

    def _move_to(self, state: State) -> None:
        """Make `state` the present one, after checking and noting what lies between."""
        self._check_melting(state)
        if self._rising(self.state) and not self._rising(state):
            self.folds.append(self._locate_fold(self.state, state))
        self._previous, self.state = self.state, state

    def _locate_fold(self, before: State, after: State) -> State:
        """Bisect the arc between two states, by tip temperature, to where the bias turns."""
        best = before
        for _ in range(30):
            share = before.tangent[-1] / (before.tangent[-1] - after.tangent[-1])
            share = min(max(share, 0.1), 0.9)
            tip = before.tip + share * (after.tip - before.tip)
            guess = before.x + share * (after.x - before.x)
            try:
                best = self._solve(guess, AT_TIP, tip, before)
            except NewtonError:
                break
            if abs(best.tangent[-1]) < 1e-5 or abs(after.tip - before.tip) < 1e-3:
                break
            if self._rising(best):
                before = best
            else:
                after = best
        return best

    def _check_melting(self, state: State) -> None:
        if self.equations.space.highest_temperature(state.x) < MELTING_POINT:
            return
        if self.folds and state.bias <= self.folds[-1].bias:
            turn = self.folds[-1]
            at = self.equations.observe(turn.x)
            raise BranchEndError(
                f"the branch of a slow bias ramp ends at a bias of {turn.bias:.4f} V (lever "
                f"{at['lever_V']:.4f} V, current {at['current_mA']:.4f} mA, tip {turn.tip:.1f} K): "
                "above it there is no steady state below the melting point of silicon",
                bias_reached=turn.bias,
            )
        raise BranchEndError(
            f"silicon melts ({MELTING_POINT:.0f} K) between a bias of {self.state.bias:.4f} V, "
            f"where the tip is at {self.state.tip:.1f} K, and {state.bias:.4f} V",
            bias_reached=self.state.bias,
        )
