"""Continuation of a lever's curve: the next state is predicted, corrected, or tried from nearer by.

A lever that starts cold is followed in its natural parameter, the tip temperature, to hotter and
hotter tips. One that held supplies heat, or that has leg ends of different temperatures, is warm
before the swept supply heats it, and may cool at first as that takes current from the others: so
neither its tip temperature nor its voltage need rise along the branch, and it is followed by the
length of its curve in the plane of both, in units of 60 K and 1 V. The other polarity of the bias
is another part of the same curve.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from hotlever.errors import ComputationError, NewtonError
from hotlever.lever.branch import TIP_RISE, Branch, Reach
from hotlever.lever.equations import LeverEquations, steps_of
from hotlever.lever.newton import NewtonOptions
from hotlever.lever.solved_states import PseudoArclength, in_plane, solve_at, state_at_bias
from hotlever.lever.space import LEVER
from hotlever.piecewise import hermite_weights
from hotlever.types import Array, Progress


@dataclass(frozen=True)
class ContinuationOptions:
    """How a branch is followed.

    Attributes
    ----------
    newton : NewtonOptions
        How exactly states are solved: far below what the curves between them are off by.
    behind : int
        States that the next one is predicted from.
    most : int
        States that a branch has at most.
    step_u : float
        In the natural parameter: the step in u (K^½) where it is cold.
    step_K : float
        The step in the tip temperature (K) where it is hot.
    after_step_K : float
        Half the step (K) after a step of a law.
    much_faster : float
        By how much some place must get hotter per kelvin of the tip to halve the steps.
    trusted : float
        Share of the step in the natural parameter within which a state is where it is expected.
    first, largest : float
        By arc length: the first step and the largest.
    smallest_share : float
        Smallest share of what is held by which it may rise, from nothing to its values.
    """

    newton: NewtonOptions = field(default_factory=lambda: NewtonOptions(tolerance=1e-5))
    behind: int = 3
    most: int = 2000
    step_u: float = 4.0
    step_K: float = 60.0
    after_step_K: float = 5.0
    much_faster: float = 2.0
    trusted: float = 0.5
    first: float = 0.1
    largest: float = 0.5
    smallest_share: float = 1.0 / 64.0


def continued(
    equations: LeverEquations,
    enough: Callable[[Branch], bool | np.bool_],
    start: Branch | None = None,
    progress: Progress | None = None,
    options: ContinuationOptions | None = None,
) -> Branch:
    """Follow a lever until its branch is long enough or something melts, or on from a branch of it.

    A reach may ask for biases of the other polarity too. Progress is called with the states done
    and how many there usually are.

    Raises
    ------
    ComputationError
        If a state was not found; ``partial`` holds the branch up to there.
    """

    def far_enough(branch: Branch) -> bool | np.bool_:
        if progress is not None:
            # a branch has some 20 states, which a progress bar fills
            progress(branch.u.size, max(20, branch.u.size + 1))
        return enough(branch)

    follow = NaturalContinuation if equations.circuit.starts_cold else ArclengthContinuation
    options = options or ContinuationOptions()
    branch = follow(equations, start, options).until(far_enough)
    if not isinstance(enough, Reach) or enough.lowest_V is None or equations.is_even:
        return branch
    other, back = enough.mirrored, branch.mirrored
    if other(back):
        return branch
    try:
        return follow(back.equations, back, options).until(other).mirrored
    except ComputationError as error:
        error.partial = error.partial.mirrored
        raise


class Continuation(ABC):
    """Follows the curve of a lever, from its beginning or on from a branch of it."""

    #: The smallest step that is tried.
    smallest: ClassVar[float]

    def __init__(
        self,
        equations: LeverEquations,
        start: Branch | None,
        options: ContinuationOptions,
        step: float,
    ) -> None:
        self._equations, self.options, self._step = equations, options, step
        self._branch = self._beginning() if start is None else start

    def until(self, enough: Callable[[Branch], bool | np.bool_]) -> Branch:
        """Go on until the branch is long enough, or something melts.

        Raises
        ------
        ComputationError
            If the next state was not found; ``partial`` holds the branch up to there.
        """
        while not (self._branch.melts or enough(self._branch)):
            step = self._proposed()
            while (part := self._next(step)) is None:
                step /= 2.0
                if step < self.smallest:
                    raise self._lost("no state was found beyond one with")
            self._branch, self._step = self._branch.followed_by(part), step
            if self._branch.u.size > self.options.most:
                raise self._lost(
                    f"a branch of {self.options.most} states is not long enough: the last has"
                )
        return self._branch

    def _lost(self, what: str) -> ComputationError:
        tip = self._branch.base_temperature_K + float(self._branch.values[-1, TIP_RISE])
        return ComputationError(f"{what} a tip at {tip:.0f} K", partial=self._branch)

    def _next(self, step: float) -> Branch | None:
        """Find the state after a step; None if it could lie on another branch."""
        u = self._landing(step)
        expected = self._expected(u)
        try:
            part = self._solved(u, expected)
        except NewtonError:
            return None
        astray = np.abs(part.x - expected)[self._equations.space.is_temperature].max()
        return part if astray <= self._trusted(step) and self._goes_on(part) else None

    def _expected(self, u: float) -> Array:
        """Predict the state at u from the last ones and their slopes."""
        branch, behind = self._branch, slice(-self.options.behind, None)
        if branch.u.size == 1:
            return branch.x + (u - branch.u[-1]) * branch.slopes
        weights = hermite_weights(branch.u[None, behind], np.array([u]))[0]
        states = np.concatenate([branch.x[:, behind], branch.slopes[:, behind]], axis=1)
        return np.asarray(states @ weights[:, None])

    @abstractmethod
    def _beginning(self) -> Branch:
        """Return the first states."""

    @abstractmethod
    def _proposed(self) -> float:
        """Return the step that is tried first."""

    @abstractmethod
    def _landing(self, step: float) -> float:
        """Return u after a step."""

    @abstractmethod
    def _solved(self, u: float, guess: Array) -> Branch:
        """Find the state at u near a guess, and its slope."""

    @abstractmethod
    def _trusted(self, step: float) -> float:
        """Return how far (K) from where it is expected a state surely is on the same branch."""

    def _goes_on(self, part: Branch) -> bool:
        """Return whether a state continues the branch in its direction."""
        return True


class NaturalContinuation(Continuation):
    """Follows a lever that starts cold to hotter and hotter tips; steps are in kelvin."""

    smallest = 0.5

    def __init__(
        self, equations: LeverEquations, start: Branch | None, options: ContinuationOptions
    ) -> None:
        self._bends = steps_of(equations)
        if start is not None and self._is_next_to_step(start.u):
            # two states so close do not tell how it goes on: that at the step takes its place
            start = start.among(np.arange(start.u.size - 1))
        super().__init__(equations, start, options, options.step_K)
        if self._branch.u[-1] == 0.0:
            self._branch = self._from_cold(self._branch)

    def _is_next_to_step(self, u: Array) -> bool:
        """Return whether the last state is just before a step of a law.

        So it is where that of a similar lever was at the step, whose base is a little colder.
        """
        away = self._bends**2 - u[-1] ** 2
        return bool(u.size > 1 and np.any((away > 0.0) & (away < self.smallest)))

    def _beginning(self) -> Branch:
        return Branch.cold(self._equations, self._equations.cold()[0])

    def _from_cold(self, branch: Branch) -> Branch:
        """Add the first states that are not cold."""
        first, second = self._equations.cold()
        for u in (0.5 * self.options.step_u, self.options.step_u):
            try:
                branch = branch.followed_by(self._solved(u, u * first + u**2 * second))
            except NewtonError as error:
                tip = self._equations.base_temperature_K + u**2
                raise ComputationError(
                    f"no state was found with a tip at {tip:.0f} K: {error}"
                ) from error
        return branch

    def _proposed(self) -> float:
        # where a law settles after a step, the curve bends
        options, u = self.options, float(self._branch.u[-1])
        last = options.after_step_K if u in self._bends else self._step
        # A leg may get hotter faster than the tip. Steps are halved then, not scaled, so that
        # branches of similar levers still have most of their points in common.
        slopes = self._equations.space.rises(self._branch.slopes[:, -1:])
        faster = max(1.0, float(slopes.max()) / (2.0 * u) / options.much_faster)
        longest = options.step_K / 2.0 ** np.ceil(np.log2(faster))
        return float(min((u + options.step_u) ** 2 - u**2, longest, 2.0 * last))

    def _landing(self, step: float) -> float:
        # or at a step of a law on the way
        u = float(self._branch.u[-1])
        after = float(np.sqrt(u**2 + step))
        between = self._bends[(self._bends > u) & (self._bends < after)]
        return float(between[0]) if between.size else after

    def _solved(self, u: float, guess: Array) -> Branch:
        roots = solve_at(self._equations, np.array([u]), guess, self.options.newton)
        return Branch.of_roots(self._equations, np.array([u]), roots)

    def _trusted(self, step: float) -> float:
        return self.options.trusted * step


class ArclengthContinuation(Continuation):
    """Follows a lever from where it is without a bias, along its curve; steps are lengths of it."""

    smallest = 1e-4

    def __init__(
        self, equations: LeverEquations, start: Branch | None, options: ContinuationOptions
    ) -> None:
        super().__init__(equations, start, options, options.first)

    def _beginning(self) -> Branch:
        equations = self._equations
        rest = without_bias(equations, self.options)
        along = equations.along(rest, equations.factorised(rest, LEVER), LEVER)
        output_slopes = equations.observed_change(rest, along)
        # the bias rises
        along = along * np.sign(
            float(equations.circuit.bias(output_slopes[0], output_slopes[1])[0])
        )
        slope = along / np.linalg.norm(in_plane(equations.space, along))
        branch = Branch.of(equations, np.zeros(1), rest, slope)
        if branch.melts:
            end = equations.laws.limit[1]
            raise ComputationError(f"without a bias {end}: held supplies heat it")
        self._branch = branch
        part = self._next(self.options.first)
        return branch if part is None else branch.followed_by(part)

    def _proposed(self) -> float:
        return min(1.5 * self._step, self.options.largest)

    def _landing(self, step: float) -> float:
        return float(self._branch.u[-1]) + step

    def _tangent(self) -> Array:
        """Return the unit tangent at the last state in the plane of tip and lever voltage."""
        tangent = in_plane(self._equations.space, self._branch.slopes[:, -1:])[0]
        return np.asarray(tangent / np.linalg.norm(tangent))

    def _solved(self, u: float, guess: Array) -> Branch:
        equations, branch, tangent = self._equations, self._branch, self._tangent()
        space, at = equations.space, np.array([u])
        origin = in_plane(space, branch.x[:, -1:])[0]
        lines = PseudoArclength.across_tangent(float(branch.u[-1]), origin, tangent)
        roots = solve_at(equations, at, guess, self.options.newton, parametrisation=lines)
        slope = equations.along(roots.x, roots.factors, lines.constraint(at))
        # by the length of the curve, not by that of its tangent
        slope = slope / np.linalg.norm(in_plane(space, slope))
        away = in_plane(space, roots.x)[0] - origin
        length = _length_between(tangent, in_plane(space, slope)[0], away)
        return Branch.of(equations, branch.u[-1:] + length, roots.x, slope)

    def _trusted(self, step: float) -> float:
        return 3.0

    def _goes_on(self, part: Branch) -> bool:
        return bool(self._tangent() @ in_plane(self._equations.space, part.slopes)[0] > 0.5)


def _length_between(start: Array, end: Array, away: Array) -> float:
    """Return the length of a curve with these unit tangents (2,) that ends so far away (2,).

    It is that of the cubic through both ends, whose slopes are of unit length.
    """
    length = float(np.linalg.norm(away))
    nodes, of_nodes = np.polynomial.legendre.leggauss(5)
    t, weights = 0.5 * (nodes + 1.0), 0.5 * of_nodes
    for _ in range(6):  # it converges by a digit a round
        slopes = (
            np.outer(6 * t - 6 * t**2, away)
            + length * np.outer(1 - 4 * t + 3 * t**2, start)
            + length * np.outer(3 * t**2 - 2 * t, end)
        )
        length = float(weights @ np.linalg.norm(slopes, axis=1))
    return length


def without_bias(equations: LeverEquations, options: ContinuationOptions | None = None) -> Array:
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
            if step < (options or ContinuationOptions()).smallest_share:
                raise ComputationError(
                    "without a bias no steady state was found: held supplies lead to one up to "
                    f"{share:.0%} of their values"
                ) from error
            continue
        share += step
    return x
