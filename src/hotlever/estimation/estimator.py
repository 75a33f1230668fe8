"""Fitting the material parameters of a lever to measured data."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import xarray as xr

from hotlever import memory
from hotlever.errors import InputError, unknown_name
from hotlever.estimation.band import band_dataset
from hotlever.estimation.diagnosis import Diagnosis
from hotlever.estimation.experiment import Experiment, Prediction, experiment_of
from hotlever.estimation.experiment_in_time import (
    ExperimentInTime,
    HistoryPrediction,
    known_in_time,
)
from hotlever.estimation.lack_of_fit import undescribed
from hotlever.estimation.optimiser import Optimiser, Optimum
from hotlever.estimation.options import FitOptions
from hotlever.estimation.residuals import Residuals
from hotlever.estimation.result import Fit
from hotlever.estimation.scales import errors_of_scales
from hotlever.estimation.search import search_from_anywhere, search_near
from hotlever.estimation.words import undetermined
from hotlever.lever.branch import Branch
from hotlever.lever.dataset import OBSERVABLES
from hotlever.measurement import OBSERVABLE_SYMBOLS, Measurement, with_measured_circuit
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


def fit(
    measurement: Measurement | str | os.PathLike[str],
    probe: Probe | str | os.PathLike[str] | None = None,
    options: FitOptions | None = None,
    *,
    model: Callable[[Probe, Array], Experiment] | None = None,
    progress: Progress | None = None,
    seen: Callable[[Prediction], None] | None = None,
    **choices: Any,
) -> Fit:
    """Find the material parameters that make the model match a measurement.

    Levenberg-Marquardt with the exact Jacobian.

    Parameters
    ----------
    measurement : Measurement or path
        Data, or a measurement file.
    probe : Probe or path, optional
        The reference probe by default. The measurement's series resistance, base temperature
        and medium win over the probe's. Its material is where the fit starts, unless a material
        found from the data suits them better (see `hotlever.estimation.start`).
    options : FitOptions, optional
    model : callable, optional
        Makes the forward model of a probe at some biases or, in time, times (µs). By default a
        lever that is solved fast and confirmed and corrected by the full one.
    progress : callable, optional
        Called with solved sweeps and how many there usually are.
    seen : callable, optional
        Called with each `Prediction` on the way, which comes nearer and nearer to the data.
    **choices
        Fields of `FitOptions`, such as ``fixed={"n_d": 3.3e17}``.

    Raises
    ------
    InputError
        If a name does not exist, an observable has no data, a fixed value is impossible, or
        there are fewer data than parameters.
    ComputationError
        If the lever cannot be solved at the start, or the fit does not converge.
    """
    options = chosen_options(options, choices)
    telling: Any = {"progress": progress, "seen": seen}
    found = estimate(measurement, probe, options, model=model, **telling)
    result = found.fit()
    if result.describes_data or result.in_time or "current" not in result.observables:
        return result
    stated = options.priors or None
    cause = Diagnosis(found.measurement, found.stated, stated).named()
    return replace(result, reason=f"{result.reason}; {cause}")


@dataclass(frozen=True)
class Estimate:
    """What was found, with the problem that it solves; `fit` gives the result for users.

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

    def fit(self) -> Fit:
        """Return the result."""
        found = _found(self)
        return replace(found, notes=[*self.notes, *found.notes, *undetermined(found)])


def estimate(
    measurement: Measurement | str | os.PathLike[str],
    probe: Probe | str | os.PathLike[str] | None,
    options: FitOptions,
    *,
    joint: JointPrior | None = None,
    model: Callable[[Probe, Array], Experiment] | None = None,
    progress: Progress | None = None,
    seen: Callable[[Prediction], None] | None = None,
) -> Estimate:
    """Find the parameters that priors and a measurement make most likely; see `fit`.

    A joint prior of several parameters takes the place of priors of their own. With priors the
    data of an observable may be wrong together, by the scale of their meter or thermometer.
    """
    began = time.perf_counter()
    # what an earlier one used
    memory.give_back()
    given = Probe.reference() if probe is None else Probe.given(probe)
    whole = Measurement.given(measurement, given.circuit)
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
    search: Any = {"priors": own, "joint": joint, "progress": progress}
    if isinstance(forward, Experiment):
        forward = forward.measuring(residuals.bias, residuals.shown)
        problem, optimum = search_from_anywhere(
            forward, residuals, start, options, measurement, search, seen
        )
    else:
        problem, optimum = search_near(forward, residuals, start, options, search, seen)
    seconds = time.perf_counter() - began
    return Estimate(problem, optimum, probe, measurement, options, seconds, notes)


def _found(estimate: Estimate) -> Fit:
    """Put together what a fit found."""
    problem, optimum, options = estimate.problem, estimate.optimum, estimate.options
    residuals, values = problem.residuals, optimum.prediction.values
    every, covariance = estimate.slopes(optimum.prediction), estimate.covariance
    notes = residuals.suspicious(values, options.robust) + residuals.zeros(values, every)
    chi_square = residuals.reduced_chi_square(values, len(options.varied))
    if chi_square is not None:
        text = (
            f"the scatter about the fit is {np.sqrt(chi_square):.2f} times the measurement errors"
        )
        notes.append(text if options.priors else f"{text}; standard errors follow the scatter")
    weighted = residuals.weighted(values)
    converged, reason = estimate.verdict(undescribed(residuals, values))
    return Fit(
        probe=optimum.probe,
        measurement=estimate.measurement,
        options=options,
        names=options.varied,
        observables=residuals.observables,
        covariance=covariance,
        common_noise_covariance=optimum.covariance,
        data_weights=residuals.data_weights,
        sum_of_squares=float(weighted @ weighted),
        residual_rms=residuals.rms(values),
        band=_band(estimate),
        evaluations=problem.evaluations,
        steps=problem.steps,
        reason=reason,
        converged=converged,
        seconds=estimate.seconds,
        priors=estimate.priors(priors) if (priors := estimate.known) else {},
        notes=notes,
    )


def _band(estimate: Estimate) -> xr.Dataset:
    """Return the tip temperature and its standard error, at the rows or where it was followed."""
    at, residuals = estimate.optimum.prediction, estimate.problem.residuals
    values, slopes, along = at.values, estimate.slopes(at), {"bias_V": residuals.bias}
    waveform = estimate.measurement.waveform
    if waveform is not None and isinstance(at, HistoryPrediction):
        values, slopes = at.seen, at.seen_by[:, :, estimate.problem.objective.columns]
        along = {"time_us": at.at, "bias_V": waveform.bias(at.at)}
    by = slopes[list(OBSERVABLES).index("tip")]
    shown: dict[str, Array] = dict(zip(OBSERVABLES.values(), values, strict=True))
    power = estimate.optimum.probe.circuit.power(along["bias_V"], shown["current_mA"])
    stderr = np.sqrt(np.einsum("bi,ij,bj->b", by, estimate.covariance, by))
    return band_dataset(**along, power_mW=power, tip_K=shown["tip_K"], tip_stderr_K=stderr)


def chosen_options(options: FitOptions | None, choices: dict[str, Any]) -> FitOptions:
    """Return options with some of them chosen by name.

    Raises
    ------
    InputError
        If there is no such option; the text gives the nearest one.
    """
    known = list(FitOptions.__dataclass_fields__)
    for name in choices:
        if name not in known:
            raise unknown_name("option", name, known, "fit")
    return replace(options or FitOptions(), **choices)


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
