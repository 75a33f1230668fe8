"""The inverse problem: what priors and a measurement make most likely of a lever.

Of a lever whose medium nobody knows both are tried, and it is said which describes the data.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, TypeVar, cast, get_args

import numpy as np

from hotlever import memory
from hotlever.errors import ComputationError, InputError
from hotlever.estimation.experiment import (
    Experiment,
    ExperimentAtRest,
    Prediction,
    PredictionAtRest,
    experiment_of,
)
from hotlever.estimation.experiment_in_time import ExperimentInTime, known_in_time
from hotlever.estimation.noise import errors_of_scales
from hotlever.estimation.objective import Objective
from hotlever.estimation.optimiser import Optimum, Predictor
from hotlever.estimation.options import UNKNOWN_MEDIUM, FitOptions
from hotlever.estimation.outcome import Outcome
from hotlever.estimation.over_a_sample import with_distances
from hotlever.estimation.posterior import Posterior
from hotlever.estimation.prior_density import FLAT, PriorDensity
from hotlever.estimation.residuals import Residuals
from hotlever.estimation.search import Search
from hotlever.lever.branch import Branch
from hotlever.measurands import FITTED, OF_A_CONTACT
from hotlever.measurement import (
    Measurement,
    with_measured_circuit,
)
from hotlever.measurement.rows import averaged, note_on_averages
from hotlever.measurement.sample import check_sample
from hotlever.probe import Probe
from hotlever.probe.priors import (
    ALL_DIMENSIONS,
    Prior,
    PriorUse,
    default_priors,
)
from hotlever.probe.surroundings import Medium
from hotlever.types import Array, Progress

#: The share of the sum of squares that another step would take away, below which a search that has
#: not come to its end has come to a verdict.
_LITTLE = 0.5
#: Why a probe does not show what was measured.
_MISSING = {
    "reader": "the probe has no reader",
    "bridge": "the probe has no bridge (bridge_upper_ohm and bridge_lower_ohm in [circuit])",
}
#: Data that are enough to tell, with priors, which of them are outliers.
_ENOUGH = 15


@dataclass(frozen=True)
class Estimate:
    """The most likely lever, with the problem that it solves.

    The lever as it was `stated` is in the circuit and medium of the measurement.
    """

    optimum: Optimum
    stated: Probe
    measurement: Measurement
    options: FitOptions
    seconds: float
    notes: list[str]

    @property
    def probe(self) -> Probe:
        """The lever."""
        return self.optimum.probe

    @property
    def prediction(self) -> Prediction:
        """What it shows."""
        return self.optimum.prediction

    @property
    def objective(self) -> Objective:
        """What is least for it."""
        return self.optimum.optimiser.objective

    @property
    def predictor(self) -> Predictor:
        """What predicts levers like it, by the experiment that was confirmed last."""
        return self.optimum.optimiser.predictor

    @property
    def residuals(self) -> Residuals:
        """The data that it is compared with, with their weights."""
        return self.objective.residuals

    @cached_property
    def posterior(self) -> Posterior:
        """What is known of its parameters, and of any quantity of it."""
        return Posterior(self.objective, self.prediction)

    def priors(self, before: Mapping[str, Prior]) -> dict[str, PriorUse]:
        """Return what was known before, and what the data made of it."""
        names = self.options.varied
        values = self.probe.values(names).tolist()
        spreads = np.sqrt(np.diag(self.posterior.covariance)).tolist()
        used = {
            name: before[name].used(value, spread)
            for name, value, spread in zip(names, values, spreads, strict=True)
            if name in before
        }
        for error in self.residuals.common:
            size, left = self.posterior.moved[error.name]
            after = 1.0 + error.share * size, error.share * left
            used[error.name] = PriorUse(1.0, error.share, *after)
        return used

    @property
    def branch(self) -> Branch:
        """The lever at rest, as far as it was measured, corrected by the full one."""
        assert isinstance(self.prediction, PredictionAtRest)
        return self.prediction.surrogate.branch

    def predicted(self, bias: Array) -> PredictionAtRest:
        """Return what a slow ramp shows at other biases (V), as far as the measured ones reach."""
        experiment, prediction = self.predictor.experiment, self.prediction
        assert isinstance(experiment, ExperimentAtRest)
        assert isinstance(prediction, PredictionAtRest)
        return experiment.measuring(bias, None).predict(self.probe, prediction)

    def verdict(self, lack_of_fit: str) -> tuple[bool, str]:
        """Return whether the search came to an end, and why the data are not described, if so.

        One that was ended far from describing the data, where another step would take less than
        half of the sum of squares away, has found that no such lever shows them.
        """
        share = self.optimum.decrement / max(self.objective.squares(self.prediction), 1e-300)
        if self.optimum.converged or (lack_of_fit and share < _LITTLE):
            return True, lack_of_fit
        refused = self.optimum.optimiser.refused
        beyond = f"; a lever on the way could not be solved: {refused}" if refused else ""
        return False, (
            f"the search was ended after {self.predictor.evaluations} levers, before it converged: "
            f"another step would still lower the sum of squares by {share:.1%}{beyond}"
        )


def estimate(
    whole: Measurement,
    given: Probe,
    options: FitOptions,
    *,
    before: PriorDensity = FLAT,
    model: Callable[[Probe, Array], Experiment] | None = None,
    progress: Progress | None = None,
    seen: Callable[[Prediction], None] | None = None,
) -> Estimate:
    """Find the parameters that priors and a whole measurement make most likely; see `fit`.

    The probe is as it was given, not yet in the circuit and medium of the measurement.

    What an estimate has left `before` takes the place of priors of these parameters. With priors
    the data of an observable may be wrong together, by the scale of their meter or thermometer.
    """
    began = time.perf_counter()
    memory.give_back()  # what an earlier one used
    measurement = averaged(whole, options.robust)
    in_time = measurement.time_us is not None
    if in_time:
        given.circuit.need_cold_start("a fit in time")
    probe, notes = with_measured_circuit(given, measurement, options.medium)
    notes += note_on_averages(whole, measurement) + check_sample(measurement, probe)
    options = options.of(probe, in_time=in_time)
    priors = options.stated_priors(probe, in_time=in_time)
    without_effect = [name for name in options.priors if name not in (*priors, ALL_DIMENSIONS)]
    if without_effect:
        notes.append(
            f"priors that do not count in {probe.surroundings.medium}, and have no effect: "
            f"{', '.join(without_effect)}"
        )
    if options.usual_priors:
        usual = default_priors(probe)
        priors = {name: usual[name] for name in usual if name not in options.fixed} | priors
    options = replace(options, priors=priors, usual_priors=False)
    if in_time:
        priors, more = known_in_time(probe, measurement, priors, options.varied)
        options, notes = replace(options, priors=priors), notes + more
    informed = bool(priors) or bool(before.names)
    enough = int(np.isfinite(measurement.current(probe.circuit)).sum()) >= _ENOUGH
    options = replace(options, robust=options.robust or (enough and informed))
    observables = _observables(options, measurement, probe, notes)
    # priors are in standard deviations, so the data must be too
    weights = "errors" if informed else options.weights
    base = probe.circuit.base_temperature_K
    common = errors_of_scales(measurement, observables, priors, base) if informed else []
    residuals = Residuals(measurement, observables, weights, options.drift, common=common)
    if not informed and residuals.different < len(options.varied):
        raise InputError(
            f"{measurement.path or 'measurement'}: {residuals.different} different data for "
            f"{len(options.varied)} parameters; fix some or measure at more "
            f"{'times' if in_time else 'biases'}"
        )
    density = PriorDensity.of_priors(priors)
    likeliest = zip(density.names, density.values.tolist(), strict=True)
    start = options.held(probe.replace(dict(likeliest)))
    search = Search(
        residuals, start, options.varied, options.robust, density.beside(before), progress, seen
    )
    if measurement.waveform is not None:
        follow = partial(ExperimentInTime.of, waveform=measurement.waveform, names=options.varied)
        optimum = search.near((model or follow)(probe, residuals.along), start)
    else:
        names = tuple(dict.fromkeys([*options.usual, *options.varied]))
        experiment = (model or partial(experiment_of, names=names))(probe, residuals.bias)
        assert isinstance(experiment, ExperimentAtRest)
        # with priors errors are a matter of standard deviations; the fast lever's slopes do
        experiment = replace(experiment, names=names, first_order=not informed)
        experiment = with_distances(experiment, probe, residuals.distance_um)
        experiment = experiment.measuring(*residuals.at_rest)
        optimum = search.from_anywhere(experiment, measurement)
    seconds = time.perf_counter() - began
    return Estimate(optimum, probe, measurement, options, seconds, notes)


def _observables(
    options: FitOptions, measurement: Measurement, probe: Probe, notes: list[str]
) -> tuple[str, ...]:
    """Return what is to be fitted: by default all that has data and that the probe can show."""
    where = measurement.path or "measurement"
    # without a contact there is no such measurement
    can_be = {*probe.observables, *OF_A_CONTACT}
    shown = tuple(name for name in measurement.observables if name in can_be)
    for name in options.observables or measurement.observables:
        symbol = FITTED[name].symbol
        if name not in measurement.observables:
            raise InputError(
                f"{where}: no values of {name} (column {symbol}); it has "
                f"{', '.join(measurement.observables)}"
            )
        if name in shown:
            continue
        if options.observables is None and shown:
            notes.append(f"{symbol}: {_MISSING[name]}, so that these values are not fitted")
        else:
            expected = f"fit {', '.join(shown)}" if shown else "there is nothing else to fit"
            raise InputError(f"{where}: {symbol}: {_MISSING[name]}; {expected}")
    return shown if options.observables is None else tuple(options.observables)


Answer = TypeVar("Answer", bound=Outcome)


def in_medium(
    asked: str | None,
    answered: Callable[[str | None], tuple[Estimate, Answer]],
    of_either: Callable[[Answer, Answer], Answer],
) -> tuple[Estimate, Answer]:
    """Answer for a lever in the medium that is asked; if that is unknown, in the likelier one.

    Then a note says how well either describes the data.

    Parameters
    ----------
    asked : str or None
        None is what measurement and probe say.
    answered : callable
        Return an estimate in a medium, and the outcome that is read from it.
    of_either : callable
        Return an outcome whose errors hold another: where both describe the data, these do not
        tell which it is.

    Raises
    ------
    ComputationError
        If the lever can be solved in none of them.
    """
    if asked != UNKNOWN_MEDIUM:
        return answered(asked)
    answers: dict[str, tuple[Estimate, Answer]] = {}
    failures: dict[str, ComputationError] = {}
    for medium in get_args(Medium):
        try:
            answers[medium] = answered(medium)
        except ComputationError as error:
            failures[medium] = error
    if not answers:
        raise next(iter(failures.values()))

    def unlikeliness(medium: str) -> tuple[bool, float]:
        # what describes the data comes first, and of two of a kind the more probable one
        estimate, answer = answers[medium]
        return bool(answer.reason), estimate.posterior.deviance

    best, *rest = sorted(answers, key=unlikeliness)
    texts = [f"in {medium} a lever {_how_well(*answers[medium])}" for medium in (best, *rest)]
    texts += [f"in {medium} none can be solved: {error}" for medium, error in failures.items()]
    note = f"the medium is not known: {'; '.join(texts)}"
    estimate, answer = answers[best]
    for other in (answers[medium][1] for medium in rest if not answers[medium][1].reason):
        answer = of_either(answer, other)
        note += "; the data do not tell which, and the errors of the tip temperature hold both"
    return estimate, replace(cast("Any", answer), notes=[note, *answer.notes])


def error_of_choice(tip_K: Array, other_K: Array) -> Array:
    """Return the standard error (K) of a tip temperature that may as well be another one."""
    return np.asarray(np.abs(tip_K - other_K) / np.sqrt(2.0))


def _how_well(estimate: Estimate, answer: Outcome) -> str:
    rms = estimate.residuals.rms(estimate.prediction.values)
    shown = ", ".join(f"{value:.2g} {name.rsplit('_', 1)[1]}" for name, value in rms.items())
    return f"{'does not describe' if answer.reason else 'describes'} the data (rms {shown})"
