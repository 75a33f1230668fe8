"""The inverse problem: what priors and a measurement make most likely of a lever."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from hotlever import memory
from hotlever.errors import InputError
from hotlever.estimation.experiment import Experiment, Prediction, experiment_of
from hotlever.estimation.experiment_in_time import ExperimentInTime, known_in_time
from hotlever.estimation.optimiser import Optimiser, Optimum
from hotlever.estimation.options import FitOptions
from hotlever.estimation.residuals import Residuals
from hotlever.estimation.scales import errors_of_scales
from hotlever.estimation.search import Search
from hotlever.lever.branch import Branch
from hotlever.measurement import (
    OBSERVABLE_SYMBOLS,
    Measurement,
    with_measured_circuit,
)
from hotlever.measurement.averages import averaged, note_on_averages
from hotlever.probe import Probe
from hotlever.probe.priors import (
    SCALES,
    JointPrior,
    Moved,
    Prior,
    PriorUse,
    default_priors,
    priors_of,
)
from hotlever.types import Array, Progress

#: The share of the sum of squares that another step would take away, below which a search that has
#: not come to its end has come to a verdict.
_LITTLE = 0.5
#: Data that are enough to tell, with priors, which of them are outliers.
_ENOUGH = 15


@dataclass(frozen=True)
class Estimate:
    """What was found, with the problem that it solves.

    The lever as it was `stated` is in the circuit and medium of the measurement.
    """

    problem: Optimiser
    optimum: Optimum
    stated: Probe
    measurement: Measurement
    options: FitOptions
    seconds: float
    notes: list[str]

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the varied parameters in their own units."""
        return self.problem.objective.covariance(self.optimum.prediction)

    def slopes(self, prediction: Prediction) -> Array:
        """Return the derivatives of a prediction by the varied parameters, (3, n, p)."""
        return prediction.slopes[:, :, self.problem.objective.columns]

    @property
    def known(self) -> dict[str, Prior]:
        """The priors that were asked for."""
        in_time = self.measurement.time_us is not None
        return priors_of(self.options.priors, self.optimum.probe, "priors", in_time=in_time)

    def priors(self, known: Mapping[str, Prior]) -> dict[str, PriorUse]:
        """Return what was known before, and what the data made of it."""
        names = self.options.varied
        after = zip(self.optimum.probe.at(names), np.sqrt(np.diag(self.covariance)), strict=True)
        found = {
            name: known[name].used(float(value), float(spread))
            for name, (value, spread) in zip(names, after, strict=True)
            if name in known
        }
        moved = self.moved
        for one in self.problem.residuals.common:
            size, left = moved[one.name]
            found[one.name] = PriorUse(1.0, one.share, 1.0 + one.share * size, one.share * left)
        return found

    @cached_property
    def moved(self) -> dict[str, Moved]:
        """How far the data moved parameters and scales from their own priors."""
        problem, at = self.problem, self.optimum.prediction
        scales = problem.residuals.in_common(at.values, self.slopes(at), self.covariance)
        return problem.objective.moved(at) | scales

    @property
    def branch(self) -> Branch:
        """The lever at rest, as far as it was measured, corrected by the full one."""
        at = self.optimum.prediction
        return at.nearby.branch_at(at.probe.at(self.problem.model.names))

    def predicted(self, bias: Array) -> Prediction:
        """Return what is predicted at other biases (V), as far as the measured ones reach."""
        model = self.problem.model.measuring(bias, None)
        return model.predict(self.optimum.probe, self.optimum.prediction)

    def solved(self, scaled: Array, near: Prediction) -> Prediction:
        """Return the prediction for other scaled parameters, from that for a similar lever."""
        return self.problem.model.predict(self.problem.objective.at(near.probe, scaled), near)

    def verdict(self, lack_of_fit: str) -> tuple[bool, str]:
        """Return whether the search came to an end, and why the data are not described, if so.

        One that was ended far from describing the data, where another step would take less than
        half of the sum of squares away, has found that no such lever shows them.
        """
        squares = self.problem.objective.squares(self.optimum.prediction)
        share = self.optimum.decrement / max(squares, 1e-300)
        if self.optimum.converged or (lack_of_fit and share < _LITTLE):
            return True, lack_of_fit
        return False, (
            f"the search was ended after {self.problem.evaluations} levers, before it converged: "
            f"another step would still lower the sum of squares by {share:.1%}"
        )

    @property
    def unlikeliness(self) -> float:
        """Minus twice the logarithm of the probability at the optimum, up to a constant.

        With it estimates of a lever from the same data are compared, in one medium and another.
        """
        problem, values = self.problem, self.optimum.prediction.values
        residuals = problem.residuals
        if not problem.objective.informed:
            # the noise is unknown and in common
            return residuals.size * float(np.log(np.sum(residuals.weighted(values) ** 2)))
        squares = problem.objective.squares(self.optimum.prediction)
        return float(squares + residuals.normalisation)


def estimate(
    whole: Measurement,
    given: Probe,
    options: FitOptions,
    *,
    joint: JointPrior | None = None,
    model: Callable[[Probe, Array], Experiment] | None = None,
    progress: Progress | None = None,
    seen: Callable[[Prediction], None] | None = None,
) -> Estimate:
    """Find the parameters that priors and a whole measurement make most likely; see `fit`.

    The probe is as it was given, not yet in the circuit and medium of the measurement.

    A joint prior of several parameters takes the place of priors of their own. With priors the
    data of an observable may be wrong together, by the scale of their meter or thermometer.
    """
    began = time.perf_counter()
    # what an earlier one used
    memory.give_back()
    measurement = averaged(whole, options.robust)
    in_time = measurement.time_us is not None
    if in_time:
        given.circuit.need_cold_start("a fit in time")
    probe, notes = with_measured_circuit(given, measurement, options.medium)
    notes += note_on_averages(whole, measurement)
    options = options.of(probe, in_time=in_time)
    priors = priors_of(options.priors, probe, "priors", in_time=in_time)
    if options.usual_priors:
        usual = default_priors(probe)
        priors = {name: usual[name] for name in usual if name not in options.fixed} | priors
    enough = int(np.isfinite(measurement.current_mA).sum()) >= _ENOUGH
    robust = options.robust or (enough and (bool(priors) or joint is not None))
    options = replace(options, priors=priors, usual_priors=False, robust=robust)
    if in_time:
        priors, more = known_in_time(probe, measurement, priors, options.varied)
        options, notes = replace(options, priors=priors), notes + more
    observables = _observables(options, measurement, probe, notes)
    # priors are in standard deviations, so the data must be too
    known = bool(options.priors) or joint is not None
    weights = "errors" if known else options.weights
    base = probe.circuit.base_temperature_K
    common = errors_of_scales(measurement, observables, priors, base) if known else []
    residuals = Residuals(measurement, observables, weights, options.drift, common=common)
    if not known and residuals.different < len(options.varied):
        raise InputError(
            f"{measurement.path or 'measurement'}: {residuals.different} different data for "
            f"{len(options.varied)} parameters; fix some or measure at more "
            f"{'times' if in_time else 'biases'}"
        )
    names = tuple(dict.fromkeys([*options.usual, *options.varied]))
    forward: Any
    if measurement.waveform is not None:
        follow = partial(ExperimentInTime.of, waveform=measurement.waveform, names=options.varied)
        forward = (model or follow)(probe, residuals.along)
    else:
        make = model or partial(experiment_of, names=names)
        # with priors errors are a matter of standard deviations; the fast lever's slopes do
        forward = replace(make(probe, residuals.bias), names=names, first_order=not known)
    own = {name: prior for name, prior in priors.items() if name not in SCALES}
    start = options.held(probe.moved({name: prior.value for name, prior in own.items()}))
    search = Search(residuals, start, options.varied, robust, own, joint, progress, seen)
    if isinstance(forward, Experiment):
        forward = forward.measuring(residuals.bias, residuals.shown)
        problem, optimum = search.from_anywhere(forward, measurement)
    else:
        problem, optimum = search.near(forward, start)
    seconds = time.perf_counter() - began
    return Estimate(problem, optimum, probe, measurement, options, seconds, notes)


def _observables(
    options: FitOptions, measurement: Measurement, probe: Probe, notes: list[str]
) -> tuple[str, ...]:
    """Return what is to be fitted: by default all that has data and that the probe can show."""
    where = measurement.path or "measurement"
    found = measurement.observables
    if "reader" not in probe.layout().terminal_names:
        found = tuple(name for name in found if name != "reader")
        if "reader" in (options.observables or ()):
            raise InputError(f"{where}: reader: the probe has no reader; fit {', '.join(found)}")
        if found != measurement.observables and options.observables is None:
            notes.append("V_r: the probe has no reader, so that these values are not fitted")
    if options.observables is None:
        return found
    for name in options.observables:
        if not np.isfinite(measurement.observable(name)).any():
            raise InputError(
                f"{where}: no values of {name} (column {OBSERVABLE_SYMBOLS[name]}); it has "
                f"{', '.join(measurement.observables)}"
            )
    return tuple(options.observables)
