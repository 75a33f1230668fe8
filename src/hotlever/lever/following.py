"""Following a lever from cold to hotter and hotter tips."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hotlever.errors import ComputationError, NewtonError
from hotlever.lever.branch import BY_TIP, Branch
from hotlever.lever.curve import hermite_weights
from hotlever.lever.equations import LeverEquations, steps_of
from hotlever.lever.newton import NewtonOptions, NewtonResult, find_roots
from hotlever.lever.pinned import Pinned
from hotlever.lever.sections import Sections
from hotlever.lever.solved_states import SolvedStates
from hotlever.types import Array

#: Steps between the states of a branch: in u (K^½) where it is cold, in the tip temperature (K)
#: where it is hot. The smallest step (K) that is tried where those lead nowhere.
_STEP_U, _STEP_K, _SMALLEST_K = 4.0, 60.0, 0.5
#: Half the step (K) after a step of a law; and by how much some place must get hotter per kelvin of
#: the tip to halve the steps.
_AFTER_STEP_K, _MUCH_FASTER = 5.0, 2.0
#: A state further than this share of the step from where it was expected (K) may lie elsewhere.
_ASTRAY = 0.5
#: Far below what the curves between the states are off by.
_OPTIONS = NewtonOptions(tolerance=1e-5)
#: States that the next one is predicted from.
_BEHIND = 3


class Follower:
    """Follows a lever from cold to hotter and hotter tips, or on from a branch of it."""

    def __init__(self, equations: LeverEquations, start: Branch | None = None) -> None:
        self._equations, self._step, self._steps = equations, _STEP_K, steps_of(equations)
        if start is not None:
            self._branch = start
            return
        first, second = equations.cold()
        self._branch = _cold(equations, first)
        for u in (0.5 * _STEP_U, _STEP_U):
            try:
                found = self._solved(u, u * first + u**2 * second)
            except NewtonError as error:
                base = equations.base_temperature_K
                raise ComputationError(
                    f"no state was found with a tip at {base + u**2:.0f} K: {error}"
                ) from error
            self._branch = joined(self._branch, found)

    def until(self, enough: Callable[[Branch], bool]) -> Branch:
        """Go on until the branch is long enough, or silicon melts.

        Raises
        ------
        ComputationError
            If the next state was not found; ``partial`` holds the branch up to there.
        """
        while not (self._branch.melts or enough(self._branch)):
            here = float(self._branch.u[-1])
            step = min((here + _STEP_U) ** 2 - here**2, self._longest(here), 2.0 * self._step)
            while (found := self._next(_landing(here, step, self._steps), step)) is None:
                step /= 2.0
                if step < _SMALLEST_K:
                    raise ComputationError(
                        "no state was found with a hotter tip than "
                        f"{self._equations.base_temperature_K + here**2:.0f} K",
                        partial=self._branch,
                    )
            self._branch, self._step = joined(self._branch, found), step
            if self._branch.u[-1] in self._steps:
                self._step = _AFTER_STEP_K  # where the law settles, the curve bends
        return self._branch

    def _longest(self, u: float) -> float:
        """Return the longest step (K) from the last state, at u.

        A leg may get hotter faster than the tip. Steps are halved then, so that branches of similar
        levers still have most of their places in common.
        """
        slopes = self._equations.space.rises(self._branch.states.slopes[:, -1:])
        faster = float(slopes.max()) / (2.0 * u)
        return _STEP_K / 2.0 ** np.ceil(np.log2(max(1.0, faster / _MUCH_FASTER)))

    def _next(self, u: float, step: float) -> Branch | None:
        """Find the state at u; None if it could lie on another branch."""
        known = self._branch
        weights = hermite_weights(known.u[None, -_BEHIND:], np.array([u]))[0]
        behind = np.concatenate([known.x[:, -_BEHIND:], known.states.slopes[:, -_BEHIND:]], axis=1)
        expected = behind @ weights[:, None]
        try:
            found = self._solved(u, expected)
        except NewtonError:
            return None
        astray = np.abs(found.x - expected)[self._equations.space.is_temperature].max()
        return found if astray <= _ASTRAY * step else None

    def _solved(self, u: float, guess: Array) -> Branch:
        """Find the state at u near a guess, and its slope."""
        at = np.array([u])
        problem = Pinned(self._equations, at**2)
        return _part(self._equations, at, find_roots(problem, guess, _OPTIONS))


def _landing(u: float, step: float, steps: Array) -> float:
    """Return u after a step (K), or at a step of a law on the way."""
    after = float(np.sqrt(u**2 + step))
    between = steps[(steps > u) & (steps < after)]
    return float(between[0]) if between.size else after


def branch_of(
    equations: LeverEquations, u: Array, found: NewtonResult, sections: Sections = BY_TIP
) -> Branch:
    """Return the branch of states solved together at some u; from cold, if that it starts."""
    part = _part(equations, u, found, sections)
    if not equations.circuit.starts_cold:
        return replace(part, places=sections)
    return joined(_cold(equations, equations.cold()[0]), part)


def _cold(equations: LeverEquations, slope: Array) -> Branch:
    """Return the state without power."""
    return part_of(equations, np.zeros(1), np.zeros_like(slope), slope)


def _part(
    equations: LeverEquations, u: Array, found: NewtonResult, sections: Sections = BY_TIP
) -> Branch:
    """Return a part of a branch that was solved."""
    along = equations.along(found.x, found.factors, sections.pin(u))
    rate = sections.rate(u, equations.space, found.x)
    return part_of(equations, u, found.x, rate * along)


def part_of(equations: LeverEquations, u: Array, x: Array, slopes: Array) -> Branch:
    """Return the part of a branch with some states and their slopes, (size + 1, k)."""
    values = np.vstack([equations.observed(x), equations.space.tip_rise(x)])
    by_u = equations.observed_change(x, slopes), equations.space.tip_rise(slopes)
    highest = equations.highest_rise(x)
    states = SolvedStates(equations, u, x, slopes, highest)
    return Branch(states, values.T, np.vstack(by_u).T)


def joined(branch: Branch, after: Branch) -> Branch:
    """Return a branch with another part after it."""
    return Branch(
        branch.states.followed_by(after.states),
        np.vstack([branch.values, after.values]),
        np.vstack([branch.value_slopes, after.value_slopes]),
    )
