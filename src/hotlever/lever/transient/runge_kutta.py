"""Steps in time of ``d/dt storage(x) + residual(t, x) = 0``. It knows no physics.

Rows in which nothing is stored are algebraic. The method (`hotlever.lever.transient.tableau`) is
stiffly accurate, so that each step ends with the algebraic rows fulfilled. What is stored is the
variable that is stepped, so that sums over rows are conserved as the sum of the residual says,
whatever the tolerance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hotlever.errors import ComputationError, NewtonError
from hotlever.lever.transient.tableau import ARK436L2SA
from hotlever.types import Array

#: Within this time (1/rate) nothing that is stored changes.
INSTANT_RATE = 1e9
#: Newton's method stops at this share of the tolerance: a larger one would cost the balance of what
#: is stored. But in the first stage, which has no weight in a step; and before the first step.
_NEWTON_SHARE, _FIRST_SHARE, _CONSISTENT = 1e-4, 0.1, 1e-9
#: As a rule less than this share of a correction is left by it; from another share on new factors
#: are cheaper; and the most corrections.
_LEFT, _SLOW, _MOST_CORRECTIONS = 0.005, 0.5, 12
#: A stage in the middle of a step. How far the cubic through the ends is from it counts as an error
#: too, for that is shown; but stages are of order two, and the cubic is nearer to the solution.
_MIDDLE, _OFF = 3, 0.15
#: The slopes of what is monitored are taken over a time in which unknowns change by so many units.
_MOMENT = 1e-4
#: The shortest step, as a share of the time reached.
_SHORTEST = 1e-12


#: A step is made so much shorter than its error asks for; by these factors it changes at least and
#: at most, and by that one where Newton's method fails; and with which power of its error, which is
#: of order four.
_SAFETY, _LEAST_CHANGE, _MOST_CHANGE, _FAILED, _POWER = 0.9, 0.2, 6.0, 0.25, 0.22
#: The first step changes so many tolerances, were it explicit.
_FIRST_STEP = 40.0
METHOD = ARK436L2SA


class LinearSolver(Protocol):
    """A factorised Jacobian."""

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for right-hand sides (size + 1, 1) or (size + 1, 1, k)."""
        ...


class Problem(Protocol):
    """What is stepped in time, for one column of unknowns (size + 1, 1).

    Attributes
    ----------
    scale : ndarray, shape (size + 1, 1)
        Size of one unit of each unknown, by which kelvin and volts compare.
    """

    scale: Array

    def storage(self, x: Array) -> Array:
        """Return what is stored, (size + 1, 1); zero in algebraic rows."""
        ...

    def storage_change(self, x: Array, changes: Array) -> Array:
        """Return how what is stored changes with the unknowns, (size + 1, 1, k), to first order."""
        ...

    def residual(self, t: float, x: Array) -> Array:
        """Return what is lost per unit of time, or the algebraic residual, (size + 1, 1)."""
        ...

    def factorised(self, x: Array, rate: float) -> LinearSolver:
        """Return the factorised Jacobian of ``rate × storage + residual``."""
        ...

    def norm(self, change: Array) -> float:
        """Return the size of a change of the unknowns, by which tolerances are meant."""
        ...

    def monitored(self, x: Array) -> Array:
        """Return quantities (k, n) that are read off or added up, at states (size + 1, n)."""
        ...


@dataclass(frozen=True)
class Step:
    """A step, and what is between its ends.

    Attributes
    ----------
    start, end : float
        Times.
    x, slopes : ndarray, shape (size + 1, 2)
        The unknowns at both ends, and their derivatives by time.
    monitored, monitored_slopes : ndarray, shape (k, 2)
        `Problem.monitored` at both ends, and their derivatives by time.
    added : ndarray, shape (k,)
        Their integrals over the step.
    stages : ndarray, shape (size + 1, stages)
        The unknowns at the start and in each stage.
    factors : LinearSolver
        Of the Jacobian of all stages, nearly.
    """

    start: float
    end: float
    x: Array
    slopes: Array
    monitored: Array
    monitored_slopes: Array
    added: Array
    stages: Array
    factors: LinearSolver

    def between(self, t: float) -> Array:
        """Return the unknowns at a time within the step, (size + 1, 1)."""
        return hermite(self.start, self.end, self.x, self.slopes, t)[:, None]


def hermite(start: float, end: float, values: Array, slopes: Array, t: float) -> Array:
    """Return the cubic through values (k, 2) at two times, with slopes there, at a third, (k,)."""
    length = end - start
    after, before = (t - start) / length, (end - t) / length
    value = before**2 * (1 + 2 * after), after**2 * (1 + 2 * before)
    slope = length * before**2 * after, -length * after**2 * before
    return np.asarray(values @ np.array(value) + slopes @ np.array(slope))


class Stepper:
    """Steps a problem from one time to another, restarting where its `Problem.residual` jumps.

    Parameters
    ----------
    problem : Problem
    tolerance : float
        Largest estimated error of a step, by `Problem.norm`.

    Attributes
    ----------
    accepted, rejected : int
        Steps.
    length : float
        Of the step to try next.
    """

    def __init__(self, problem: Problem, tolerance: float) -> None:
        self._problem, self._tolerance = problem, tolerance
        self._newton = tolerance * np.where(METHOD.weights, _NEWTON_SHARE, _FIRST_SHARE)
        self.accepted = self.rejected = 0
        self.length = 0.0

    def steps(
        self,
        start: float,
        end: float,
        x: Array,
        longest: float,
        first: float | None = None,
        stops: Sequence[float] = (),
    ) -> Iterator[Step]:
        """Give the steps from one time to another, none longer than a given one.

        What is stored at `x` is kept, the algebraic rows are fulfilled first. The length of the
        first step is tried as given, or found from how fast things change. Steps end at all stops
        on the way.

        Raises
        ------
        ComputationError
            If no step is short enough.
        """
        here = self._consistent(start, x)
        speed = max(self._problem.norm(here.slope), 1e-300)
        self.length = first or _FIRST_STEP * self._tolerance / speed
        while here.t < end:
            stop = min((time for time in stops if here.t < time < end), default=end)
            then = _next(here.t, min(self.length, longest), stop)
            try:
                step, there, error = self._step(here, then)
                share = error / self._tolerance
            except NewtonError:
                share = np.inf
            self.length = step_change(share) * (then - here.t)
            if share <= 1.0:
                yield step
                self.accepted, here = self.accepted + 1, there
                continue
            self.rejected += 1
            if self.length < _SHORTEST * max(abs(here.t), 1.0):
                raise ComputationError(f"no step in time is short enough at {here.t:.6g} µs")

    def _consistent(self, t: float, x: Array) -> _Reached:
        """Fulfil the algebraic rows, nothing that is stored being changed; and find the slopes."""
        problem, rate = self._problem, INSTANT_RATE
        root = self._root(t, x, problem.storage(x), rate, None, _CONSISTENT)
        x = root.x
        slope = -rate * root.factors.solve(problem.residual(t + 1.0 / rate, x))
        flow, stored = -problem.residual(t, x), problem.storage(x)
        speed = max(float(np.abs(slope / problem.scale).max()), 1e-300)
        here, soon = problem.monitored(np.hstack([x, x + _MOMENT / speed * slope])).T
        return _Reached(t, x, slope, stored, flow, here, (soon - here) * (speed / _MOMENT))

    def _step(self, here: _Reached, then: float) -> tuple[Step, _Reached, float]:
        """Try a step; return it, what it reaches, and its error."""
        length = then - here.t
        problem, rate, root = self._problem, 1.0 / (METHOD.diagonal * length), None
        by_stage, by_slope = METHOD.predictors
        # one column for each stage
        states, flows = np.empty((2, len(here.x), len(METHOD.times)))
        states[:, :1], flows[:, :1] = here.x, here.flow
        for stage in range(1, len(METHOD.times)):
            before, now = slice(stage), slice(stage, stage + 1)
            explicit = here.stored + flows[:, before] @ (
                length * METHOD.stages[stage, before, None]
            )
            guess = states[:, before] @ by_stage[stage, before, None]
            guess += length * by_slope[stage] * here.slope
            t = here.t + METHOD.times[stage] * length
            root = self._root(t, guess, explicit, rate, root, self._newton[stage])
            states[:, now], flows[:, now] = root.x, rate * (root.stored - explicit)
        assert root is not None
        slope = METHOD.end_slope(states, here.slope[:, 0], length)[:, None]
        monitored = np.column_stack([here.monitored, problem.monitored(states[:, 1:])])
        monitored_slopes = METHOD.end_slope(monitored, here.monitored_slopes, length)
        there = _Reached(
            then, root.x, slope, root.stored, flows[:, -1:], monitored[:, -1], monitored_slopes
        )
        step = Step(
            here.t,
            then,
            states[:, [0, -1]],
            np.hstack([here.slope, slope]),
            monitored[:, [0, -1]],
            np.stack([here.monitored_slopes, monitored_slopes], axis=1),
            length * (monitored @ METHOD.weights),
            states,
            root.factors,
        )
        difference = length * rate * (flows @ (METHOD.weights - METHOD.embedded)[:, None])
        error = problem.norm(root.factors.solve(difference))
        off = step.between(here.t + METHOD.times[_MIDDLE] * length) - states[:, [_MIDDLE]]
        return step, there, max(error, _OFF * problem.norm(off))

    def _root(
        self,
        t: float,
        x: Array,
        explicit: Array,
        rate: float,
        near: _Root | None,
        tolerance: float,
    ) -> _Root:
        """Solve ``rate × (stored - explicit) + residual = 0`` near `x`, by Newton's method.

        What is left after a correction is taken to be a share of it: that which it is of the one
        before, and at first the largest that it was with the same factors, those of a root nearby.
        The last correction is one of what is stored too, to first order: nothing is evaluated
        again.

        Raises
        ------
        NewtonError
            If there is none.
        """
        problem, last = self._problem, np.inf
        factors, most = (None, _LEFT) if near is None else (near.factors, near.left)
        for _ in range(_MOST_CORRECTIONS):
            stored = problem.storage(x)
            residual = problem.residual(t, x) + rate * (stored - explicit)
            if factors is None:
                factors = problem.factorised(x, rate)
            change = -factors.solve(residual)
            size = float(np.abs(change / problem.scale).max())
            if not np.isfinite(size):
                break
            left = most if last == np.inf else size / last
            most = max(most, left)
            if left * size < tolerance:
                stored = stored + problem.storage_change(x, change[..., None])[..., 0]
                return _Root(x + change, stored, factors, most)
            if left > _SLOW:
                factors, last, most = None, np.inf, _LEFT
            else:
                x, last = x + change, size
        raise NewtonError(f"no root at {t:.6g} µs")


@dataclass(frozen=True)
class _Root:
    """The unknowns, what is stored there, and a Jacobian factorised nearby with what it leaves."""

    x: Array
    stored: Array
    factors: LinearSolver
    left: float


@dataclass(frozen=True)
class _Reached:
    """A time; the unknowns there, what is stored, and what is monitored, with their slopes."""

    t: float
    x: Array
    slope: Array
    stored: Array
    flow: Array
    monitored: Array
    monitored_slopes: Array


def step_change(share: float) -> float:
    """Return by which factor a step changes whose error is a share of the tolerance."""
    if not np.isfinite(share):
        return _FAILED
    change = max(_SAFETY * max(share, 1e-6) ** -_POWER, _LEAST_CHANGE)
    return min(change, _MOST_CHANGE if share <= 1.0 else _SAFETY)


def _next(t: float, length: float, end: float) -> float:
    """Return the end of a step, so that no tiny one is left before the last."""
    steps = (end - t) / length
    if steps <= 1.001:
        return end
    return t + (0.5 * (end - t) if steps < 2.0 else length)
