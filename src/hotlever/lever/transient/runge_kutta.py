"""Steps in time of ``d/dt storage(x) + residual(t, x) = 0``. It knows no physics.

Rows in which nothing is stored are algebraic. The method (`ARK436L2SA`) is
stiffly accurate, so that each step ends with the algebraic rows fulfilled. What is stored is the
variable that is stepped, so that sums over rows are conserved as the sum of the residual says,
whatever the tolerance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from hotlever.errors import ComputationError, NewtonError
from hotlever.types import Array

#: Within this time (1/rate) nothing that is stored changes.
INSTANT_RATE = 1e9


@dataclass(frozen=True)
class StepperOptions:
    """How steps are solved, and how long they are.

    Attributes
    ----------
    newton, newton_first : float
        Shares of the tolerance at which Newton's method stops: a larger one would cost the balance
        of what is stored, but in the first stage, which has no weight in a step.
    consistent : float
        Units to which the algebraic rows are fulfilled before the first step.
    left : float
        As a rule less than this share of a correction is left by it.
    slow : float
        Share left from which on new factors are cheaper.
    most_corrections : int
    middle : int
        A stage in the middle of a step. How far the cubic through the ends is from it counts as an
        error too, for that is shown; ...
    off : float
        ... but stages are of order two, and the cubic is nearer to the solution, by this share.
    moment : float
        Units by which unknowns change in the time over which slopes of what is monitored are taken.
    shortest : float
        The shortest step, as a share of the time reached.
    safety : float
        A step is made so much shorter than its error asks for.
    least_change, most_change : float
        Factors by which a step changes at least and at most.
    failed : float
        Factor where Newton's method fails.
    power : float
        With which power of its error, which is of order four, a step changes.
    first_step : float
        Tolerances that the first step changes, were it explicit.
    """

    newton: float = 1e-4
    newton_first: float = 0.1
    consistent: float = 1e-9
    left: float = 0.005
    slow: float = 0.5
    most_corrections: int = 12
    middle: int = 3
    off: float = 0.15
    moment: float = 1e-4
    shortest: float = 1e-12
    safety: float = 0.9
    least_change: float = 0.2
    most_change: float = 6.0
    failed: float = 0.25
    power: float = 0.22
    first_step: float = 40.0

    def step_change(self, share: float) -> float:
        """Return by which factor a step changes whose error is a share of the tolerance."""
        if not np.isfinite(share):
            return self.failed
        change = max(self.safety * max(share, 1e-6) ** -self.power, self.least_change)
        return min(change, self.most_change if share <= 1.0 else self.safety)


@dataclass(frozen=True)
class Tableau:
    """Coefficients of an implicit method whose first stage is explicit, and the others alike.

    Attributes
    ----------
    times : ndarray, shape (stages,)
        Of the stages, as shares of a step.
    stages : ndarray, shape (stages, stages)
        Weights of the slopes in each stage, lower triangular; the last are those of the step too.
    embedded : ndarray, shape (stages,)
        Weights of the method of lower order that tells the error.
    """

    times: Array
    stages: Array
    embedded: Array

    @property
    def diagonal(self) -> float:
        """The weight that all implicit stages have of their own slope."""
        return float(self.stages[-1, -1])

    @property
    def weights(self) -> Array:
        """Weights of the slopes in a step."""
        return self.stages[-1]

    @cached_property
    def predictors(self) -> tuple[Array, Array]:
        """Weights that extrapolate to each stage.

        Of the stages before it, (stages, stages), and of the slope at the start times the step,
        (stages,). They are those by which a stage follows from the others best if what decays does
        so at any rate; what changes steadily is met exactly. Stages are of order two, and a
        polynomial through them would be a hundred times as far off.
        """
        count, ones = len(self.times), np.ones((len(self.times), 1))
        # modes are looked at that decay so often within a step
        z = -np.linspace(0.0, 12.0, 200)
        values = np.linalg.solve(np.eye(count) - z[:, None, None] * self.stages, ones)[..., 0]
        # what decays fast has mostly done so when steps become long
        counted = np.exp(z) / (0.1 - z)
        constant, straight = np.append(np.ones(count), 0.0), np.append(self.times, 1.0)
        modes = np.column_stack([values, z]) * counted[:, None]
        # these are met exactly: they count so much more
        rows = np.vstack([modes, 1e4 * constant, 1e4 * straight])
        weights = np.zeros((count, count + 1))
        for stage in range(1, count):
            earlier = [*range(stage), count]
            weights[stage, earlier] = np.linalg.lstsq(rows[:, earlier], rows[:, stage])[0]
        return weights[:, :-1], weights[:, -1]

    @cached_property
    def _to_end(self) -> Array:
        """By how much the slope at the end rises with each stage, times the step."""
        return np.linalg.inv(self.stages[1:, 1:])[-1]

    def end_slope(self, stages: Array, first: Array, length: float) -> Array:
        """Return the slopes (k,) at the end of a step of what is in its stages, (k, stages).

        They are those of the same method, read as one that steps these, with the slopes at the
        start.
        """
        rise = (stages[:, 1:] - stages[:, :1]) @ self._to_end
        return np.asarray(rise / length - (self._to_end @ self.stages[1:, 0]) * first)


#: The ESDIRK part of ARK4(3)6L[2]SA (Kennedy and Carpenter, Appl. Numer. Math. 44, 139 (2003)):
#: order four with an error estimate of order three, L-stable and stiffly accurate.
ARK436L2SA = Tableau(
    times=np.array([0.0, 1 / 2, 83 / 250, 31 / 50, 17 / 20, 1.0]),
    stages=np.array(
        [
            [0.0] * 6,
            [1 / 4, 1 / 4, 0.0, 0.0, 0.0, 0.0],
            [8611 / 62500, -1743 / 31250, 1 / 4, 0.0, 0.0, 0.0],
            [5012029 / 34652500, -654441 / 2922500, 174375 / 388108, 1 / 4, 0.0, 0.0],
            [
                15267082809 / 155376265600,
                -71443401 / 120774400,
                730878875 / 902184768,
                2285395 / 8070912,
                1 / 4,
                0.0,
            ],
            [82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211, 1 / 4],
        ]
    ),
    embedded=np.array(
        [
            4586570599 / 29645900160,
            0.0,
            178811875 / 945068544,
            814220225 / 1159782912,
            -3700637 / 11593932,
            61727 / 225920,
        ]
    ),
)


class StageSolver(Protocol):
    """A factorised Jacobian."""

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for right-hand sides (size + 1, 1) or (size + 1, 1, k)."""
        ...


class SteppedProblem(Protocol):
    """What is stepped in time, for one column of unknowns (size + 1, 1).

    Attributes
    ----------
    scale : ndarray, shape (size + 1, 1)
        Size of one unit of each unknown, by which kelvin and volts compare; infinite of one whose
        row is linear, and whose size does not matter.
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

    def factorised(self, x: Array, rate: float) -> StageSolver:
        """Return the factorised Jacobian of ``rate × storage + residual``."""
        ...

    def norm(self, change: Array) -> float:
        """Return the size of a change of the unknowns, by which tolerances are meant."""
        ...

    def monitored(self, x: Array) -> Array:
        """Return quantities (k, n) that are read off or added up, at states (size + 1, n)."""
        ...


@dataclass(frozen=True)
class TimeStep:
    """A step, and what is between its ends.

    Attributes
    ----------
    start, end : float
        Times.
    x, slopes : ndarray, shape (size + 1, 2)
        The unknowns at both ends, and their derivatives by time.
    monitored, monitored_slopes : ndarray, shape (k, 2)
        `SteppedProblem.monitored` at both ends, and their derivatives by time.
    added : ndarray, shape (k,)
        Their integrals over the step.
    stages : ndarray, shape (size + 1, stages)
        The unknowns at the start and in each stage.
    factors : StageSolver
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
    factors: StageSolver

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
    """Steps a problem from one time to another; restarts where its `SteppedProblem.residual` jumps.

    Parameters
    ----------
    problem : SteppedProblem
    tolerance : float
        Largest estimated error of a step, by `SteppedProblem.norm`.
    options : StepperOptions, optional

    Attributes
    ----------
    accepted, rejected : int
        Steps.
    length : float
        Of the step to try next.
    """

    def __init__(
        self, problem: SteppedProblem, tolerance: float, options: StepperOptions | None = None
    ) -> None:
        self._problem, self._tolerance = problem, tolerance
        self._options = options = options or StepperOptions()
        shares = np.where(ARK436L2SA.weights, options.newton, options.newton_first)
        self._newton = tolerance * shares
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
    ) -> Iterator[TimeStep]:
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
        self.length = first or self._options.first_step * self._tolerance / speed
        while here.t < end:
            stop = min((time for time in stops if here.t < time < end), default=end)
            then = _next(here.t, min(self.length, longest), stop)
            try:
                step, there, error = self._step(here, then)
                share = error / self._tolerance
            except NewtonError:
                share = np.inf
            self.length = self._options.step_change(share) * (then - here.t)
            if share <= 1.0:
                yield step
                self.accepted, here = self.accepted + 1, there
                continue
            self.rejected += 1
            if self.length < self._options.shortest * max(abs(here.t), 1.0):
                raise ComputationError(f"no step in time is short enough at {here.t:.6g} µs")

    def _consistent(self, t: float, x: Array) -> _Reached:
        """Fulfil the algebraic rows, nothing that is stored being changed; and find the slopes."""
        problem, rate = self._problem, INSTANT_RATE
        root = self._root(t, x, problem.storage(x), rate, None, self._options.consistent)
        x = root.x
        slope = -rate * root.factors.solve(problem.residual(t + 1.0 / rate, x))
        flow, stored = -problem.residual(t, x), problem.storage(x)
        speed = max(float(np.abs(slope / problem.scale).max()), 1e-300)
        moment = self._options.moment / speed
        here, soon = problem.monitored(np.hstack([x, x + moment * slope])).T
        return _Reached(t, x, slope, stored, flow, here, (soon - here) / moment)

    def _step(self, here: _Reached, then: float) -> tuple[TimeStep, _Reached, float]:
        """Try a step; return it, what it reaches, and its error."""
        length = then - here.t
        problem, rate, root = self._problem, 1.0 / (ARK436L2SA.diagonal * length), None
        by_stage, by_slope = ARK436L2SA.predictors
        # one column for each stage
        states, flows = np.empty((2, len(here.x), len(ARK436L2SA.times)))
        states[:, :1], flows[:, :1] = here.x, here.flow
        for stage in range(1, len(ARK436L2SA.times)):
            before, now = slice(stage), slice(stage, stage + 1)
            explicit = here.stored + flows[:, before] @ (
                length * ARK436L2SA.stages[stage, before, None]
            )
            guess = states[:, before] @ by_stage[stage, before, None]
            guess += length * by_slope[stage] * here.slope
            t = here.t + ARK436L2SA.times[stage] * length
            root = self._root(t, guess, explicit, rate, root, self._newton[stage])
            states[:, now], flows[:, now] = root.x, rate * (root.stored - explicit)
        assert root is not None
        slope = ARK436L2SA.end_slope(states, here.slope[:, 0], length)[:, None]
        monitored = np.column_stack([here.monitored, problem.monitored(states[:, 1:])])
        monitored_slopes = ARK436L2SA.end_slope(monitored, here.monitored_slopes, length)
        there = _Reached(
            then, root.x, slope, root.stored, flows[:, -1:], monitored[:, -1], monitored_slopes
        )
        step = TimeStep(
            here.t,
            then,
            states[:, [0, -1]],
            np.hstack([here.slope, slope]),
            monitored[:, [0, -1]],
            np.stack([here.monitored_slopes, monitored_slopes], axis=1),
            length * (monitored @ ARK436L2SA.weights),
            states,
            root.factors,
        )
        difference = length * rate * (flows @ (ARK436L2SA.weights - ARK436L2SA.embedded)[:, None])
        error = problem.norm(root.factors.solve(difference))
        middle = self._options.middle
        off = step.between(here.t + ARK436L2SA.times[middle] * length) - states[:, [middle]]
        return step, there, max(error, self._options.off * problem.norm(off))

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
        problem, options, last = self._problem, self._options, np.inf
        factors, most = (None, options.left) if near is None else (near.factors, near.left)
        for _ in range(options.most_corrections):
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
            if left > options.slow:
                factors, last, most = None, np.inf, options.left
            else:
                x, last = x + change, size
        raise NewtonError(f"no root at {t:.6g} µs")


@dataclass(frozen=True)
class _Root:
    """The unknowns, what is stored there, and a Jacobian factorised nearby with what it leaves."""

    x: Array
    stored: Array
    factors: StageSolver
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


def _next(t: float, length: float, end: float) -> float:
    """Return the end of a step, so that no tiny one is left before the last."""
    steps = (end - t) / length
    if steps <= 1.001:
        return end
    return t + (0.5 * (end - t) if steps < 2.0 else length)
