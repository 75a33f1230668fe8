"""Measuring a lever bias by bias, so that its tip stays below a limit.

The paper's procedure is a ramp of the bias with a wait at each. Here each next bias is taken only
if the lever, as far as it is known by then, has its tip below a limit there with a certainty of
99 %; what is known is brought up to date by the rows so far while the lever settles. Where the
next bias that is wanted is too hot, the highest that is not is taken, until that is hardly above
the last. Each row is on disk as soon as it is read.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from hotlever.errors import ComputationError, HotleverError, InputError, counted
from hotlever.estimate.estimator import calibrate
from hotlever.estimate.experiment import ExperimentAtRest, PredictionAtRest
from hotlever.estimate.next_measurement import LinearisedLever, hottest_tips, plan_next
from hotlever.estimate.options import CalibrationOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import Search, Solution
from hotlever.estimate.verdict import check_plausible, verdict_on
from hotlever.instruments.source_meter import MeterReading
from hotlever.instruments.supervisor import Supervisor
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import Prior
from hotlever.quantities import QUANTITIES
from hotlever.types import Array
from hotlever.units import MOST_BIAS


class RowByRow:
    """A lever that is being measured.

    Parameters
    ----------
    probe : Probe
        One like it, in the medium and circuit that it is in.
    priors : mapping of str to Prior or str, optional
        In place of some of the usual ones.

    Attributes
    ----------
    known : LinearisedLever
        What is known of it.
    """

    def __init__(self, probe: Probe, priors: Mapping[str, Prior | str] | None = None) -> None:
        self._probe, self._priors = probe, priors
        self._options = CalibrationOptions(priors=priors).of_lever
        self._fast: SimilarLevers | None = None
        self._at: PredictionAtRest | None = None
        self.known = LinearisedLever.of_priors(probe, priors)

    def update(self, measurement: Measurement) -> None:
        """Bring what is known up to date by all rows so far.

        Raises
        ------
        InputError, ComputationError
            If they are of no lever like the probe.
        """
        problem = Problem.of(measurement, self._probe, self._options, model=self._experiment)
        if self._at is None:
            # few rows are described by any lever with much noise
            check_plausible(problem)
        solution = self._searched_on(problem, self._at.probe if self._at else problem.start)
        if solution is None:
            # from afar, and with all that is asked of data that no lever near by shows
            calibration = calibrate(measurement, probe=self._probe, priors=self._priors)
            if not calibration.describes_data:
                raise InputError(calibration.reason)
            solution = self._searched_on(problem, calibration.probe)
            if solution is None:
                self._at, self.known = None, LinearisedLever.of_calibration(calibration)
                return
        assert isinstance(solution.prediction, PredictionAtRest)
        self._at = solution.prediction
        self.known = LinearisedLever.of_solution(solution)

    def _experiment(self, probe: Probe, bias: Array) -> ExperimentAtRest:
        self._fast = self._fast or SimilarLevers(Lever(probe, COARSE))
        return ExperimentAtRest(self._fast, None, bias, (), until_it_melts=True)

    def _searched_on(self, problem: Problem, start: Probe) -> Solution | None:
        """Return the likeliest lever near one; None if it does not describe the data."""
        experiment, began = problem.experiment, time.perf_counter()
        try:
            near = experiment.predict(start, self._at)
            search = Search(problem)
            optimiser = search.optimiser(experiment, start, near=near)
            optimum = optimiser.solve_and_confirm(start, problem.options.robust)
        except (InputError, ComputationError):
            return None
        solution = search.solution(optimum, began)
        converged, reason = verdict_on(solution)
        return solution if converged and not reason else None


@dataclass(frozen=True)
class RampOptions:
    """How a lever is measured.

    Attributes
    ----------
    stay_below_K : float, "knee" or None
        The tip stays below with 99 % probability; below what melts if None, and below the first
        fold of the lever in any case.
    settle_s : float
        Between setting a bias and the reading that counts.
    first_reading_s : float
        Between setting a bias and a reading by which what is known is brought up to date meanwhile,
        if there is more time than that.
    changed : float
        A row that differs from that reading by a larger share is one to bring it up to date by
        anew.
    unknown_rows : int
        Rows from which on they tell something.
    finest : float
        Share of the distance between wanted biases below which a step is not worth a row.
    between : int
        Biases among which the highest that is safe is looked for, between the last and the next.
    propose : bool
        Whether biases are those that tell most (`hotlever.estimate.plan_next`) of many.
    proposed_of : int
        So many biases for each wanted row are compared then.
    """

    stay_below_K: float | str | None = None
    settle_s: float = 10.0
    first_reading_s: float = 0.5
    changed: float = 2e-3
    unknown_rows: int = 3
    finest: float = 0.05
    between: int = 40
    propose: bool = False
    proposed_of: int = 4


@dataclass(frozen=True)
class NextBias:
    """A bias to take, with the tip temperature expected there, and one not exceeded with 99 %.

    The latter may be known to first order alone, `hotlever.estimate.likely_levers`.
    """

    bias_V: float
    tip_K: float
    tip_limit_K: float
    first_order: bool = False


class Ramp:
    """A measurement of one lever.

    Parameters
    ----------
    probe : Probe
        A lever like the one that is measured, in the medium and circuit that it is in.
    bias : ndarray, shape (n,)
        Wanted biases (V), rising from above 0. No more rows are taken.
    options : RampOptions, optional
    priors : mapping of str to Prior or str, optional
        In place of some of the usual ones.

    Attributes
    ----------
    readings : list of MeterReading
    steps : list of NextBias
        What was known of each before it was taken.
    reason : str
        Why no other bias was taken.
    complete : bool
        Whether that is as it was wanted: nothing went wrong.

    Raises
    ------
    InputError
        If the biases do not rise from above 0, the limit is not above the base temperature, or
        the lever does not start cold.
    """

    def __init__(
        self,
        probe: Probe,
        bias: Array,
        options: RampOptions | None = None,
        priors: Mapping[str, Prior | str] | None = None,
    ) -> None:
        self.options = options or RampOptions()
        if not (bias.size and bias[0] > 0.0 and (np.diff(bias) > 0.0).all()):
            raise InputError("measure: expected biases that rise, the first above 0 V")
        base_K, limit_K = probe.circuit.base_temperature_K, self.options.stay_below_K
        if isinstance(limit_K, float) and limit_K <= base_K:
            raise InputError(
                f"measure: a limit of {limit_K:.5g} K, expected one above the base temperature, "
                f"{base_K:.5g} K"
            )
        self._probe, self._bias = probe, bias
        self._spacing = float(np.diff(bias).mean()) if bias.size > 1 else float(bias[0])
        self._lever = RowByRow(probe, priors)
        self.readings: list[MeterReading] = []
        self.steps: list[NextBias] = []
        self.reason, self.complete = "", True

    def measure(
        self,
        instrument: Supervisor,
        record: Callable[[MeterReading, NextBias], None],
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        """Measure row by row; what was measured so far stays known if that fails.

        Parameters
        ----------
        instrument : Supervisor
        record : callable
            Called with each reading that counts, and what was known of it before.
        wait : callable
            Called with the seconds to wait.

        Raises
        ------
        HotleverError
            If the instrument fails.
        """
        options = self.options
        while (step := self._next_step()) is not None:
            instrument.set_bias(step.bias_V)
            begin, first = time.monotonic(), None
            if options.settle_s > options.first_reading_s:
                wait(options.first_reading_s)
                first = instrument.read()
                if not first.at_compliance:
                    self._update(first)
            wait(max(options.settle_s - (time.monotonic() - begin), 0.0))
            reading = instrument.read()
            if reading.at_compliance or (first is not None and first.at_compliance):
                self.reason = f"the source limits the current at {step.bias_V:.4g} V (compliance)"
                self.complete = True
                return
            self.readings.append(reading)
            self.steps.append(step)
            record(reading, step)
            if first is None or abs(reading.current_mA / first.current_mA - 1.0) > options.changed:
                self._update()

    # --- what is known ----------------------------------------------------------------------------

    def measurement(self, *more: MeterReading) -> Measurement:
        """Return the rows so far, and more, as a measurement."""
        bias, current, reader, _ = np.array([*self.readings, *more], dtype=float).T
        nothing = np.full(bias.size, np.nan)
        return Measurement(
            bias, current, reader, nothing, nothing, medium=self._probe.surroundings.medium
        )

    def _update(self, *more: MeterReading) -> None:
        """Bring what is known up to date by the rows so far, and more."""
        if len(self.readings) + len(more) < self.options.unknown_rows:
            return
        try:
            self._lever.update(self.measurement(*more))
        except (InputError, ComputationError) as error:
            self.reason, self.complete = f"the rows are of no lever like the probe: {error}", False

    @property
    def known(self) -> LinearisedLever:
        """What is known of the lever."""
        return self._lever.known

    # --- where to go ------------------------------------------------------------------------------

    @property
    def limit_K(self) -> float:
        """What the tip stays below: as stated, and below the lever's first fold."""
        branch, circuit = self.known.surrogate.branch, self.known.probe.circuit
        stated = self.options.stay_below_K
        if stated == "knee":
            stated = branch.knee.tip_K if branch.knee is not None else None
        limit = np.inf if stated is None else float(stated)
        whole = branch.read(circuit, np.array([MOST_BIAS]))
        # a jump from its fold leads to a hot state, or melts the lever
        first_K = whole.jumps[0][1] if whole.jumps else whole.last_K
        return min(limit, float(first_K))

    def _tip_limits(self, bias_V: Array) -> Array:
        """Return the tips (K) that are not exceeded at biases, infinite where nothing is."""
        known, limits = self.known, np.full(bias_V.size, np.inf)
        there = bias_V <= known.highest_V
        if there.any():
            limits[there] = hottest_tips(known, bias_V[there], known.likely)
        return limits

    def _next_step(self) -> NextBias | None:
        """Return what to take next; None, with the reason, if nothing."""
        last_V = max((reading.bias_V for reading in self.readings), default=0.0)
        if self.reason:
            return None
        if len(self.readings) == self._bias.size:
            self.reason = f"no more than {counted(self._bias.size, 'row')} were wanted"
            return None
        bias = (
            self._proposed(last_V) if self.options.propose and self.tells else self._wanted(last_V)
        )
        if bias is None:
            return None
        at, known = np.array([bias]), self.known
        limit = self._tip_limits(at).item()
        return NextBias(bias, known.tip(at)[0].item(), limit, known.likely.first_order)

    @property
    def tells(self) -> bool:
        """Whether there are rows enough to tell something of the lever."""
        return len(self.readings) >= self.options.unknown_rows

    def _wanted(self, last_V: float) -> float | None:
        """Return the next wanted bias (V), or the highest that is safe before it."""
        finest = self.options.finest * self._spacing
        above = self._bias[self._bias > last_V + finest]
        if not above.size:
            self.reason = f"{last_V:.4g} V is the highest bias that was wanted"
            return None
        biases = np.linspace(last_V, float(above[0]), self.options.between + 1)[1:]
        # a bias beyond one that is not safe is none either
        safe = np.logical_and.accumulate(self._tip_limits(biases) < self.limit_K)
        if safe.any() and biases[safe][-1] - last_V >= finest:
            return float(biases[safe][-1])
        stated, limit_K = self.options.stay_below_K, self.limit_K
        where = " (its knee)" if stated == "knee" else " (where it jumps or melts)"
        self.reason = (
            f"beyond {last_V:.4g} V the tip might be above {limit_K:.0f} K"
            f"{where if limit_K != stated else ''}, with a probability of more than 1 %"
        )
        return None

    def _proposed(self, last_V: float) -> float | None:
        """Return the bias (V) that tells most of those that are safe."""
        count = self.options.proposed_of * self._bias.size
        many = np.linspace(self._bias[0], self._bias[-1], count)
        # no step goes farther than to the next wanted bias
        many = many[many <= last_V + self._spacing]
        try:
            plan = plan_next(
                known=self.known,
                bias=many,
                count=1,
                stay_below_K=self.limit_K,
                allowed={"bias": None},
            )
        except HotleverError as error:
            self.reason, self.complete = f"nothing is proposed: {error}", False
            return None
        return float(plan.proposals.bias_V.values[0])


# --- the file of a measurement that goes on -------------------------------------------------------


class CurveFile:
    """A CSV file of rows as they come, with circuit and surroundings in comments above.

    It is a new one: a measurement never takes the place of another. Without a row there is none.

    Parameters
    ----------
    path : path
    probe : Probe
        Whose circuit and medium are said.
    with_reader : bool
        Whether there is a column for the reader.

    Raises
    ------
    InputError
        If the file exists or cannot be written.
    ComputationError
        If a line cannot be written later on.
    """

    def __init__(self, path: str | os.PathLike[str], probe: Probe, with_reader: bool) -> None:
        self._path = Path(path)
        self._names = ("bias_V", "current_mA", "reader_V")[: 2 + with_reader]
        self._has_heads = False
        try:
            self._file = self._path.open("x", encoding="utf-8", newline="\n")
        except FileExistsError:
            raise InputError(
                f"{self._path}: exists, expected a new name: a measurement overwrites nothing"
            ) from None
        except OSError as error:
            raise InputError(f"{self._path}: cannot be written ({error.strerror})") from None
        self.comment(f"measured by hotlever from {datetime.now().astimezone().isoformat()}")
        self.comment(f"R_s (kOhm): {probe.circuit.series_kohm:.9g}")
        self.comment(f"base temperature (K): {probe.circuit.base_temperature_K:.6g}")
        self.comment(f"medium: {probe.surroundings.medium}")

    def __enter__(self) -> CurveFile:
        return self

    def comment(self, text: str) -> None:
        """Write a line of words."""
        self._write(f"# {text}")

    def add(self, reading: MeterReading) -> None:
        """Write a row, the first one behind what heads the columns."""
        if not self._has_heads:
            quantities = [QUANTITIES[name] for name in self._names]
            self._write(",".join(f"{each.symbol} ({each.unit})" for each in quantities))
            self._has_heads = True
        values = (getattr(reading, name) for name in self._names)
        self._write(",".join("" if np.isnan(value) else f"{value:.9g}" for value in values))

    def _write(self, line: str) -> None:
        try:
            self._file.write(f"{line}\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise ComputationError(
                f"{self._path}: cannot be written on ({error.strerror}); the rows before are there"
            ) from error

    def __exit__(self, *_: object) -> None:
        # what did not fit is written once more, and does not fit again
        with suppress(OSError):
            self._file.close()
        if not self._has_heads:
            self._path.unlink(missing_ok=True)
