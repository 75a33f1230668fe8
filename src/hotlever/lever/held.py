"""Following a lever that held supplies heat, or that has leg ends of different temperatures.

Such a lever is warm before the swept supply heats it, and may cool at first as that takes current
from the others. So neither its tip temperature nor its voltage need rise along the branch, and it
is followed by the length of its curve in the plane of both, in units of 60 K and 1 V. The other
polarity of the bias is another part of the same curve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hotlever.errors import ComputationError, NewtonError
from hotlever.lever.branch import Branch, Reach
from hotlever.lever.curve import hermite_weights
from hotlever.lever.equations import LeverEquations
from hotlever.lever.following import Follower, branch_of, joined, part_of
from hotlever.lever.newton import NewtonOptions, find_roots
from hotlever.lever.pinned import Pinned, state_at_bias
from hotlever.lever.sections import UNIT_K, UNIT_V, in_plane
from hotlever.lever.space import LEVER, TIP, Pin, Space
from hotlever.types import Array

#: Steps along the branch: the first, the largest, the smallest, and how many at most.
_FIRST, _LARGEST, _SMALLEST, _MOST = 0.1, 1.0, 1e-4, 2000
#: What a state may be off from where it is expected, in K, beyond which the step was too long.
_ASTRAY = 3.0
#: Smallest share of what is held by which it may rise, from nothing to its values.
_SMALLEST_SHARE = 1.0 / 64.0
#: Far below what the curves between the states are off by.
_OPTIONS = NewtonOptions(tolerance=1e-5)
#: Points for each state at which the nearest place on another branch is looked for.
_LOOKED_AT = 20
#: Points of Gauss's rule and rounds by which the length of a piece of the curve is found.
_GAUSS, _ROUNDS = np.polynomial.legendre.leggauss(5), 6


def at_rest(equations: LeverEquations) -> Array:
    """Return the state without a bias, (size + 1, 1): what is held rises from nothing.

    Raises
    ------
    ComputationError
        If the lever has no such state.
    """
    x, share, step = np.zeros((equations.space.size + 1, 1)), 0.0, 1.0
    while share < 1.0:
        driven = equations.driven(min(share + step, 1.0))
        try:
            x = state_at_bias(driven, equations.circuit, 0.0, x, LEVER)
        except NewtonError as error:
            step /= 2.0
            if step < _SMALLEST_SHARE:
                raise ComputationError(
                    "without a bias no steady state was found: held supplies lead to one up to "
                    f"{share:.0%} of their values"
                ) from error
            continue
        share += step
    return x


def at_places_of(known: Branch, branch: Branch) -> Branch:
    """Return a branch with its states at the places of a similar one, and their u.

    Of a lever that starts cold it is returned as it is: its own places are as good.

    Raises
    ------
    NewtonError
        If a state was not found.
    """
    equations, sections = branch.equations, known.sections
    if equations.circuit.starts_cold:
        return branch
    u = np.linspace(branch.u[0], branch.u[-1], _LOOKED_AT * branch.u.size)
    away = branch.path(u) - known.path(known.u)[:, None]
    nearest = u[np.argmin((away**2).sum(axis=-1), axis=1)]
    pinned = Pinned(equations, sections.values(known.u), sections.pin(known.u))
    found = find_roots(pinned, branch.states(nearest), _OPTIONS)
    return branch_of(equations, known.u, found, sections)


@dataclass(frozen=True)
class Heading:
    """Where a branch goes at a state: its tangent in the plane of tip and voltage.

    Attributes
    ----------
    tip, lever : float
        In units of 60 K and 1 V, of length one together.
    slope : ndarray, shape (size + 1, 1)
        Of the state by the length.
    """

    tip: float
    lever: float
    slope: Array

    @classmethod
    def along(cls, space: Space, slope: Array) -> Heading:
        """Return the heading of a change of a state along its branch."""
        tip, lever = in_plane(space, slope)[0].tolist()
        length = float(np.hypot(tip, lever))
        return cls(tip / length, lever / length, slope / length)

    @property
    def pin(self) -> Pin:
        """What grows by the length along this heading."""
        return Pin(self.tip / UNIT_K, self.lever / UNIT_V)

    def length_to(self, other: Heading, tip: float, lever: float) -> float:
        """Return the length of the curve to a state that is elsewhere by so much (in units).

        It is that of the cubic through both, whose slopes are of unit length.
        """
        ends, away = np.array([[self.tip, self.lever], [other.tip, other.lever]]), (tip, lever)
        length = float(np.hypot(tip, lever))
        t, weights = 0.5 * (_GAUSS[0] + 1.0), 0.5 * _GAUSS[1]
        for _ in range(_ROUNDS):
            slopes = (
                np.outer(6 * t - 6 * t**2, away)
                + length * np.outer(1 - 4 * t + 3 * t**2, ends[0])
                + length * np.outer(3 * t**2 - 2 * t, ends[1])
            )
            length = float(weights @ np.linalg.norm(slopes, axis=1))
        return length


def pin_along(branch: Branch, u: float) -> Pin:
    """Return a pin that changes along a branch at a place of it: the tip, if it starts cold."""
    if branch.equations.circuit.starts_cold:
        return TIP
    return Heading.along(branch.equations.space, branch.states.slope(np.array([u]))).pin


def followed(
    equations: LeverEquations,
    enough: Callable[[Branch], bool],
    start: Branch | None = None,
    seen: Callable[[Branch], None] = lambda branch: None,
) -> Branch:
    """Follow a lever until its branch is long enough, or on from a branch of it.

    A reach may ask for biases of the other polarity too. Each longer branch is shown to `seen`.

    Raises
    ------
    ComputationError
        If a state was not found; ``partial`` holds the branch up to there.
    """

    def far_enough(branch: Branch) -> bool:
        seen(branch)
        return enough(branch)

    if equations.circuit.starts_cold:
        return Follower(equations, start).until(far_enough)
    branch = HeldFollower(equations, start).until(far_enough)
    if not isinstance(enough, Reach) or enough.lowest_V is None:
        return branch
    other, back = enough.mirrored, branch.mirrored
    if other(back):
        return branch
    try:
        return HeldFollower(back.equations, back).until(other).mirrored
    except ComputationError as error:
        error.partial = error.partial.mirrored
        raise


class HeldFollower:
    """Follows a lever from where it is without a bias, or on from a branch of it."""

    def __init__(self, equations: LeverEquations, start: Branch | None = None) -> None:
        self._equations, self._step = equations, _FIRST
        if start is not None:
            self._branch = start
            return
        rest = at_rest(equations)
        along = equations.along(rest, equations.factorised(rest, LEVER), LEVER)
        shown = equations.observed_change(rest, along)
        # the bias rises
        sign = np.sign(float(equations.circuit.bias(shown[0], shown[1])[0]))
        heading = Heading.along(equations.space, sign * along)
        self._branch = part_of(equations, np.zeros(1), rest, heading.slope)

    def until(self, enough: Callable[[Branch], bool]) -> Branch:
        """Go on until the branch is long enough, or something melts.

        Raises
        ------
        ComputationError
            If the next state was not found; ``partial`` holds the branch up to there.
        """
        while not (self._branch.melts or (self._branch.u.size > 1 and enough(self._branch))):
            while (found := self._next(self._step)) is None:
                self._step /= 2.0
                if self._step < _SMALLEST:
                    raise self._lost("no state was found beyond one with")
            self._branch = joined(self._branch, found)
            self._step = min(1.5 * self._step, _LARGEST)
            if self._branch.u.size > _MOST:
                raise self._lost(f"the bias is not reached in {_MOST} steps: the last state has")
        return self._branch

    def _lost(self, what: str) -> ComputationError:
        rise = self._equations.space.tip_rise(self._branch.x[:, -1:])
        tip = self._equations.base_temperature_K + float(rise[0])
        return ComputationError(f"{what} a tip at {tip:.0f} K", partial=self._branch)

    def _next(self, step: float) -> Branch | None:
        """Find the state a step along the branch; None if the step is too long."""
        known, equations = self._branch, self._equations
        space, u, behind = equations.space, float(known.u[-1]), slice(-2, None)
        last, slope = known.x[:, -1:], known.states.slopes[:, -1:]
        expected = last + step * slope
        if known.u.size > 1:
            weights = hermite_weights(known.u[None, behind], np.array([u + step]))[0]
            before = np.concatenate([known.x[:, behind], known.states.slopes[:, behind]], axis=1)
            expected = before @ weights[:, None]
        here = Heading.along(space, slope)
        pin = here.pin
        try:
            pinned = Pinned(equations, pin.of(space, last) + step, pin)
            found = find_roots(pinned, expected, _OPTIONS)
            slope = equations.along(found.x, found.factors, pin)
        except NewtonError:
            return None
        there = Heading.along(space, slope)
        turned = here.tip * there.tip + here.lever * there.lever
        astray = np.abs(found.x - expected)[space.is_temperature].max()
        if not (astray <= _ASTRAY and turned > 0.5):
            return None
        moved = found.x - last
        at = np.array([u + here.length_to(there, *in_plane(space, moved)[0].tolist())])
        return part_of(equations, at, found.x, there.slope)
