"""Steps in time of ``d/dt stored(x) + rest(t, x) = 0``. It knows no physics.

Rows in which nothing is stored are algebraic. The method is the ESDIRK part of ARK4(3)6L[2]SA
(Kennedy and Carpenter, Appl. Numer. Math. 44, 139 (2003)): order four with an error estimate of
order three, L-stable and stiffly accurate, so that each step ends with the algebraic rows
fulfilled. What is stored is the variable that is stepped, so that sums over rows are conserved as
the sum of the rest says, whatever the tolerance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hotlever.errors import ComputationError, NewtonError
from hotlever.lever.newton import NewtonOptions, find_roots
from hotlever.lever.space import Factors
from hotlever.types import Array, Index

#: Of the stages: the common diagonal, their times as shares of a step, their weights; the last are
#: also those of the step. And the weights of the embedded method of order three.
GAMMA = 1 / 4
TIMES = np.array([0.0, 1 / 2, 83 / 250, 31 / 50, 17 / 20, 1.0])
STAGES = np.zeros((6, 6))
STAGES[1, :2] = 1 / 4, 1 / 4
STAGES[2, :3] = 8611 / 62500, -1743 / 31250, 1 / 4
STAGES[3, :4] = 5012029 / 34652500, -654441 / 2922500, 174375 / 388108, 1 / 4
STAGES[4, :4] = (
    15267082809 / 155376265600,
    -71443401 / 120774400,
    730878875 / 902184768,
    2285395 / 8070912,
)
STAGES[4, 4] = 1 / 4
STAGES[5] = 82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211, 1 / 4
WEIGHTS = STAGES[5]
EMBEDDED = np.array(
    [
        4586570599 / 29645900160,
        0.0,
        178811875 / 945068544,
        814220225 / 1159782912,
        -3700637 / 11593932,
        61727 / 225920,
    ]
)

#: Within this time (1/rate) nothing that is stored changes.
_INSTANT_RATE = 1e9
#: A step is made so much shorter than its error asks for; by these factors at least and at most;
#: and by this one where Newton's method fails.
_SAFETY, _LEAST, _MOST, _FAILED = 0.9, 0.2, 6.0, 0.25
#: Exponents of a PI controller for errors of order four.
_PROPORTIONAL, _INTEGRAL = 0.04, 0.22
#: The first step changes so many tolerances, were it explicit.
_FIRST = 20.0
#: Newton's method stops at this share of the tolerance.
_NEWTON_SHARE = 0.01
#: The shortest step, as a share of the time reached.
_SHORTEST = 1e-12


class Problem(Protocol):
    """What is stepped in time, for one column of unknowns (size + 1, 1).

    Attributes
    ----------
    scale, step_limit : ndarray, shape (size + 1, 1)
        See `hotlever.lever.newton.Equations`.
    """

    scale: Array
    step_limit: Array

    def stored(self, x: Array) -> Array:
        """Return what is stored, (size + 1, 1); zero in algebraic rows."""
        ...

    def rest(self, t: float, x: Array) -> Array:
        """Return what is lost per unit of time, or the algebraic residual, (size + 1, 1)."""
        ...

    def factorised(self, x: Array, rate: float) -> Factors:
        """Return the factorised Jacobian of ``rate × stored + rest``."""
        ...

    def size_of(self, change: Array) -> float:
        """Return the size of a change of the unknowns, by which tolerances are meant."""
        ...

    def rates(self, x: Array) -> Array:
        """Return quantities (k,) that are added up over time."""
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
    added : ndarray, shape (k,)
        Integrals of `Problem.rates` over the step.
    """

    start: float
    end: float
    x: Array
    slopes: Array
    added: Array


class _Stage:
    """The equations of a stage; see `hotlever.lever.newton.Equations`."""

    def __init__(self, problem: Problem, t: float, stored: Array, rate: float) -> None:
        self._problem, self._t, self._stored, self._rate = problem, t, stored, rate
        self.scale, self.step_limit = problem.scale, problem.step_limit

    def residual(self, x: Array, which: Index) -> Array:
        rest = self._problem.rest(self._t, x)
        return rest + self._rate * (self._problem.stored(x) - self._stored)

    def factorised(self, x: Array, which: Index) -> Factors:
        return self._problem.factorised(x, self._rate)


def _predictors() -> list[Array]:
    """Return weights that extrapolate to each stage.

    Of the start, the slope there times the step, and the stages before it: those of the polynomial
    through all of these.
    """
    found = []
    for stage in range(1, len(TIMES)):
        degree = np.arange(stage + 1)
        known = TIMES[1:stage, None] ** degree
        rows = np.vstack([degree == 0, degree == 1, known])
        found.append(np.linalg.solve(rows.T, TIMES[stage] ** degree))
    return found


_PREDICTORS = _predictors()


class Stepper:
    """Steps a problem from one time to another, restarting where its `Problem.rest` jumps.

    Parameters
    ----------
    problem : Problem
    tolerance : float
        Largest estimated error of a step, by `Problem.size_of`.

    Attributes
    ----------
    accepted, rejected : int
        Steps.
    """

    def __init__(self, problem: Problem, tolerance: float) -> None:
        self._problem, self._tolerance = problem, tolerance
        self._newton = NewtonOptions(
            tolerance=_NEWTON_SHARE * tolerance, keep_while=0.5, max_iterations=12
        )
        self.accepted = self.rejected = 0

    def steps(self, start: float, end: float, x: Array, longest: float) -> Iterator[Step]:
        """Give the steps from one time to another, none longer than a given one.

        What is stored at `x` is kept, the algebraic rows are fulfilled first.

        Raises
        ------
        ComputationError
            If no step is short enough.
        """
        t, last = start, 1.0
        x, slope = self._settled(start, x)
        flow = -self._problem.rest(t, x)
        length = _FIRST * self._tolerance / max(self._problem.size_of(slope), 1e-300)
        while t < end:
            length = _fitting(min(length, longest), end - t)
            try:
                step, flow_then, error = self._step(t, length, x, slope, flow)
                share = max(error / self._tolerance, 1e-6)
                change = _SAFETY * share**-_INTEGRAL * last**_PROPORTIONAL
                change = min(max(change, _LEAST), _MOST if share <= 1.0 else _SAFETY)
            except NewtonError:
                share, change = np.inf, _FAILED
            if share <= 1.0:
                yield step
                self.accepted, last = self.accepted + 1, share
                t = end if step.end >= end else step.end
                x, slope, flow = step.x[:, 1:], step.slopes[:, 1:], flow_then
            else:
                self.rejected += 1
                if change * length < _SHORTEST * max(abs(t), 1.0):
                    raise ComputationError(f"no step in time is short enough at {t:.6g} µs")
            length *= change

    def _settled(self, t: float, x: Array) -> tuple[Array, Array]:
        """Fulfil the algebraic rows, nothing that is stored being changed; and find the slopes."""
        problem, rate = self._problem, _INSTANT_RATE
        stage = _Stage(problem, t, problem.stored(x), rate)
        found = find_roots(stage, x, NewtonOptions(tolerance=1e-9))
        later = problem.rest(t + 1.0 / rate, found.x)
        return found.x, -rate * found.factors.solve(later, _ONE)

    def _step(
        self, t: float, length: float, x: Array, slope: Array, flow: Array
    ) -> tuple[Step, Array, float]:
        """Try a step; return it, the flow into what is stored at its end, and its error."""
        problem, rate = self._problem, 1.0 / (GAMMA * length)
        before, factors = problem.stored(x), None
        states, slopes, flows = [x], [slope], [flow]
        for stage in range(1, len(TIMES)):
            known = before + length * _sum(STAGES[stage], flows)
            guess = _sum(_PREDICTORS[stage - 1], [x, length * slope, *states[1:]])
            equations = _Stage(problem, t + TIMES[stage] * length, known, rate)
            found = find_roots(equations, guess, self._newton, factors)
            factors = found.factors
            states.append(found.x)
            flows.append(rate * (problem.stored(found.x) - known))
            # the same method, read as one that steps the unknowns
            slopes.append(rate * (found.x - x - length * _sum(STAGES[stage], slopes)))
        assert factors is not None
        rates = np.stack([problem.rates(state) for state in states], axis=1)
        step = Step(
            t,
            t + length,
            np.hstack([x, states[-1]]),
            np.hstack([slope, slopes[-1]]),
            length * rates @ WEIGHTS,
        )
        difference = length * rate * _sum(WEIGHTS - EMBEDDED, flows)
        return step, flows[-1], problem.size_of(factors.solve(difference, _ONE))


_ONE: Index = np.arange(1)


def _fitting(length: float, left: float) -> float:
    """Return a step that leaves no tiny one behind."""
    if length > 0.999 * left:
        return left
    return min(length, 0.5 * left) if length > 0.5 * left else length


def _sum(weights: Array, columns: list[Array]) -> Array:
    """Return the sum of some columns with the first of the weights."""
    total = np.zeros_like(columns[0])
    for weight, column in zip(weights, columns, strict=False):
        if weight:
            total += weight * column
    return total
