"""What a calibrated lever does in a pulse: temperatures by the pulse's height, with their errors.

The lever that the calibration has estimated is followed in time at some heights. What the estimate
is uncertain in is the same as at rest, but a pulse depends on it otherwise: levers that are moved
along the main directions of the estimate's covariance are followed too. The heat capacity is one
more uncertain parameter. A lever that holds more heat does the same more slowly, so that its pulse
is that of a shorter one.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from hotlever.errors import ComputationError
from hotlever.estimate.options import PulseOptions
from hotlever.estimate.search import Solution
from hotlever.estimate.tip_table import (
    MOMENTS,
    PULSE_COLUMNS,
    PulseCalibration,
    PulseTiming,
    TipTable,
    total_error,
)
from hotlever.estimate.tip_temperature import error_of_model, measured_range
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE, State
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.transient import pulse, simulate
from hotlever.lever.transient.trains import cyclic_steady_state
from hotlever.materials.air import heat_capacity_of_air, thermal_conductivity_of_air
from hotlever.materials.heat import heat_capacity
from hotlever.probe import Probe
from hotlever.text import BAND
from hotlever.types import Array, Index, Progress


def pulse_calibration(
    solution: Solution,
    timing: PulseTiming,
    progress: Progress | None = None,
) -> PulseCalibration:
    """Return what an estimated lever does in a pulse, over the heights of its measured range.

    Parameters
    ----------
    solution : Solution
    timing : PulseTiming
    progress : callable, optional
        Called with the pulses followed and how many there are, about.

    Raises
    ------
    ComputationError
        If the lever cannot be followed in time.
    """
    bias, options = measured_range(solution), solution.problem.options.numerics.pulses
    pulses = _Pulses(solution, bias, timing, progress, options)
    directions = solution.posterior.principal_steps(options.least_variance)
    axes: Index = np.arange(len(directions))
    corrections, changes = [], []
    for row in options.chosen:
        change = np.zeros((len(directions) + 1, len(MOMENTS)))
        for axis in axes:
            change[axis] = pulses.along(row, directions[axis])
        change[-1] = pulses.change(row, pulses.coarse, slower=1.0 + options.heat_capacity_spread)
        corrections.append(pulses.change(row, pulses.fine))
        changes.append(change)
        if row == options.chosen[0]:
            # the directions that hold nearly all of the variance
            shares = (change[:-1] ** 2 / (change[:-1] ** 2).sum(axis=0)).max(axis=1)
            order = np.argsort(shares)
            axes = np.sort(order[np.cumsum(shares[order]) > options.neglected])
    heights, some = pulses.heights, pulses.heights[list(options.chosen)]
    # over V² they hardly change when cold
    by_square = CubicSpline(heights, np.log(pulses.rises / heights[:, None] ** 2))
    rise = bias[:, None] ** 2 * np.exp(by_square(bias))
    rise *= 1.0 + _through(some, corrections, bias)
    slopes = rise[:, None] * _through(some, changes, bias)
    # with the base the whole lever gets warmer
    slopes[:, :-1] += np.array(
        [[direction.get("base_temperature_K", 0.0)] for direction in directions]
    )
    return _with_errors(solution, bias, timing, rise, slopes, directions, options)


class _Pulses:
    """Rises of the tip (K) in pulses of an estimated lever, and of others like it.

    Rises are those of `MOMENTS`, shape (3,); those of other levers are relative to it.
    """

    def __init__(
        self,
        solution: Solution,
        bias: Array,
        timing: PulseTiming,
        progress: Progress | None,
        options: PulseOptions,
    ) -> None:
        self._probe, self._timing, self._progress = solution.probe, timing, progress
        self._options = options
        self._done, self._all = 0, 2 * (options.heights + len(solution.objective.varied))
        self.heights = np.linspace(float(bias[0]), float(bias[-1]), options.heights)
        self.coarse, self.fine = Lever(solution.probe, COARSE), Lever(solution.probe)
        self._similar = SimilarLevers(self.coarse)
        # a train settles sooner from where one that is a little lower has
        states: list[State | None] = [None]
        rises = []
        for height in self.heights:
            rise, state = self._follow(self.coarse, height, states[-1])
            rises.append(rise)
            states.append(state)
        self.rises, self._states = np.array(rises), states[1:]

    def change(self, row: int, lever: Lever, slower: float = 1.0) -> Array:
        """Return how the rises of a lever differ that holds `slower` times the heat."""
        near = None if lever is self.fine else self._states[row]
        return self._follow(lever, self.heights[row], near, slower)[0] / self.rises[row] - 1.0

    def along(self, row: int, direction: dict[str, float]) -> Array:
        """Return how those of a lever differ one standard error along a direction, linearised.

        The other way if it melts this way, or its mesh turns over.
        """
        try:
            return self._aside(row, direction, -self._options.distance)
        except ComputationError:
            return self._aside(row, direction, self._options.distance)

    def _aside(self, row: int, direction: dict[str, float], way: float) -> Array:
        values = self._probe.values(list(direction)) + way * np.array(list(direction.values()))
        probe = self._probe.replace(dict(zip(direction, values.tolist(), strict=True)))
        return self.change(row, self._similar.lever(probe)) / way

    def _follow(
        self, lever: Lever, height: float, near: State | None, slower: float = 1.0
    ) -> tuple[Array, State | None]:
        """Return the rises, and the state in which a period of the cyclic steady state begins.

        A lever that holds more heat does the same more slowly: its pulse is that of a shorter one.
        """
        length, period = self._timing.length_us / slower, self._timing.period_us
        wave, state, per_step = pulse(float(height), length), None, self._options.per_step
        if period is None:
            # for longer, until its peak has passed
            for longer in range(1, 9):
                history = simulate(lever, wave, length * 2.0**longer, per_step=per_step)
                if int(history.tip_K.values.argmax()) < history.sizes["time"] - 1:
                    break
        else:
            history, state = cyclic_steady_state(
                lever, wave, period / slower, start=near, per_step=per_step
            )
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, max(self._all, self._done + 1))
        time, tip = history.time.values, history.tip_K.values
        during = time <= length
        from scipy.integrate import simpson  # what is measured at rest needs none of it

        mean = simpson(tip[during], x=time[during]) / np.ptp(time[during])
        moments = np.array([tip.max(), tip[during][-1], mean])
        return moments - lever.circuit.base_temperature_K, state


def _through(heights: Array, values: list[Array], at: Array) -> Array:
    """Return values at falling heights at others; below the lowest they stay."""
    curve = PchipInterpolator(heights[::-1], values[::-1])
    return np.asarray(curve(np.maximum(at, heights.min())))


def _with_errors(
    solution: Solution,
    bias: Array,
    timing: PulseTiming,
    rise: Array,
    slopes: Array,
    directions: list[dict[str, float]],
    options: PulseOptions,
) -> PulseCalibration:
    """Return rises (n, moments) with errors, by their changes (n, directions + 1, moments)."""
    probe, varied = solution.probe, solution.objective.varied
    # changes by directions to changes by parameters, of which units differ by many orders
    steps = np.array([[direction[name] for name in varied] for direction in directions])
    scale = np.abs(steps).max(axis=0)
    inverse = np.linalg.pinv(steps / scale) / scale[:, None]
    by_parameter = np.einsum("pd,ndm->nmp", inverse, slopes[:, :-1])
    parts = solution.posterior.errors_by_source(by_parameter)
    parts["heat capacity"] = np.abs(slopes[:, -1])
    around = probe.surroundings
    if around.medium == "air":
        share = _share_of_air(probe, timing.length_us) / options.heat_capacity_spread
        parts["heat in air"] = parts["heat capacity"] * options.heat_in_air_spread * share
    of_model = [error_of_model(around, bias, column) for column in rise.T]
    parts["model"] = np.stack(of_model, axis=1)
    tip = probe.circuit.base_temperature_K + rise
    stderr = total_error(parts)
    kinds = np.stack([tip, stderr, tip - BAND * stderr, tip + BAND * stderr], axis=2)
    rows = np.column_stack([bias, kinds.reshape(len(kinds), -1)])
    columns = dict(zip(PULSE_COLUMNS, rows.T, strict=True))
    peak = MOMENTS.index("peak")
    budget = {source: part[:, peak] for source, part in parts.items()}
    return PulseCalibration(timing, TipTable(columns, {"budget_K": budget}, "height"))


def _share_of_air(probe: Probe, time_us: float) -> float:
    """Return the heat that air takes up from a plate by that in the plate, as they get warm.

    Of a half space on either side whose surface warms evenly in time (Carslaw and Jaeger,
    Conduction of Heat in Solids, 2.5), cold: when it is hot, the air is thinner.
    """
    T = probe.circuit.base_temperature_K
    kappa = probe.surroundings.gas_conductivity * float(thermal_conductivity_of_air(T)[0])
    capacity = float(heat_capacity_of_air(T, probe.surroundings.pressure_mbar)[0])
    per_area = 2.0 * 4.0 / 3.0 * np.sqrt(kappa * capacity * 1e-6 * time_us / np.pi)
    return float(per_area / (1e-4 * probe.layout().thickness_um * heat_capacity(T)[0]))
