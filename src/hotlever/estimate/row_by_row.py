"""What is known of a lever that is being measured, brought up to date by each row.

A calibration answers for a whole measurement: it looks for the lever from afar if need be, confirms
it on a fine mesh, and asks what else may be behind the data. Between two rows little changes. So
the search goes on where it ended, with the levers that it has solved, all on one coarse mesh and
until something melts: what comes next is read off the same branch.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

from hotlever.errors import ComputationError, InputError
from hotlever.estimate.diagnosis import Diagnosis
from hotlever.estimate.estimator import calibrate
from hotlever.estimate.experiment import ExperimentAtRest, PredictionAtRest
from hotlever.estimate.next_measurement import LinearisedLever
from hotlever.estimate.options import CalibrationOptions
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import Search, Solution
from hotlever.estimate.verdict import check_plausible, verdict_on
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import Prior
from hotlever.types import Array


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
            check_plausible(problem, Diagnosis(problem.measurement, problem.probe, self._priors))
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
            optimiser = Search(problem).optimiser(experiment, start, near=near)
            optimum = optimiser.solve_and_confirm(start, problem.options.robust)
        except (InputError, ComputationError):
            return None
        solution = Solution(**vars(optimum), problem=problem, seconds=time.perf_counter() - began)
        converged, reason = verdict_on(solution)
        return solution if converged and not reason else None
