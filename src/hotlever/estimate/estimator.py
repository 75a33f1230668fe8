"""Fitting the material parameters of a lever to measured data.

Of a lever whose medium nobody knows both are tried, and it is said which describes the data.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar, cast, get_args

import numpy as np
import xarray as xr

from hotlever.errors import ComputationError, unknown_name
from hotlever.estimate.diagnosis import Diagnosis, lack_of_fit_text, outlier_notes
from hotlever.estimate.experiment import Experiment, Prediction
from hotlever.estimate.inverse_problem import Estimate, estimate
from hotlever.estimate.options import UNKNOWN_MEDIUM, FitOptions
from hotlever.estimate.outcome import Outcome
from hotlever.estimate.posterior import standard_errors
from hotlever.estimate.result import Fit, band_dataset
from hotlever.measurement import Measurement, given_measurement
from hotlever.probe import Probe
from hotlever.probe.priors import priors_of
from hotlever.probe.probe_parameters import of_materials, parameters_of
from hotlever.probe.surroundings import Medium
from hotlever.text import NOT_DETERMINED, value_with_error, with_unit
from hotlever.types import Array, Progress

#: A parameter is called poorly determined from this relative standard error.
_POOR = 0.15
#: A parameter is at its bound within this share of it.
_AT_THE_BOUND = 1e-3
#: Two parameters are called hard to tell apart from this correlation.
_ENTANGLED = 0.95

Answer = TypeVar("Answer", bound=Outcome)


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

    Gauss and Newton's steps within a trust region, with the exact Jacobian
    (`hotlever.estimate.optimiser`).

    Parameters
    ----------
    measurement : Measurement or path
        Data, or a measurement file.
    probe : Probe or path, optional
        The reference probe by default. The measurement's series resistance, base temperature
        and medium win over the probe's. Its material is where the fit starts.
    options : FitOptions, optional
    model : callable, optional
        Makes the forward model of a probe at some biases or, in time, times (µs). By default a
        lever that is solved fast and confirmed and corrected by the full one.
    progress : callable, optional
        Called with solved sweeps and how many there usually are.
    seen : callable, optional
        Called with each `hotlever.estimate.experiment.Prediction` on the way, which comes nearer
        and nearer to the data.
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
    nominal = Probe.reference() if probe is None else Probe.coerce(probe)
    whole = given_measurement(measurement, nominal)

    def fitted(medium: Any) -> tuple[Estimate, Fit]:
        within = replace(options, medium=medium)
        solution = estimate(whole, nominal, within, model=model, progress=progress, seen=seen)
        return solution, _fit_of(solution)

    solution, result = in_medium(options.medium, fitted, _either)
    # a search that has not come to its end contradicts nothing
    if result.describes_data is not False or result.in_time or "current" not in result.observables:
        return result
    if solution.options.robust or not outlier_notes(
        solution.residuals, solution.prediction.values, robust=False
    ):
        cause = Diagnosis(solution.measurement, solution.stated, options.priors or None).named()
    else:
        cause = "are the points far from the fit wrong ones? a robust fit (--robust) forgets them"
    return replace(result, reason=f"{result.reason}; {cause}")


def _fit_of(estimate: Estimate) -> Fit:
    """Return what users are given of an estimate."""
    options, residuals, prediction = estimate.options, estimate.residuals, estimate.prediction
    values, posterior = prediction.values, estimate.posterior
    in_time = estimate.measurement.time_us is not None
    priors = priors_of(options.priors, estimate.probe, "priors", in_time=in_time)
    notes = outlier_notes(residuals, values, options.robust)
    notes += residuals.drifting_zeros(values, posterior.slopes)
    chi_square = residuals.errors.reduced_chi_square(
        residuals.difference(values), len(options.varied)
    )
    converged, reason = estimate.verdict(lack_of_fit_text(residuals, values))
    if chi_square is not None:
        text = (
            f"the scatter about the fit is {np.sqrt(chi_square):.2f} times the measurement errors"
        )
        follow = not options.priors and converged and not reason
        notes.append(f"{text}; standard errors follow the scatter" if follow else text)
    weighted = residuals.weighted(values)
    result = Fit(
        probe=estimate.probe,
        measurement=estimate.measurement,
        options=options,
        names=options.varied,
        observables=residuals.observables,
        covariance=posterior.covariance,
        common_noise_covariance=estimate.covariance,
        data_weights=residuals.data_weights,
        sum_of_squares=float(weighted @ weighted),
        residual_rms=residuals.rms(values),
        band=_band(estimate),
        evaluations=estimate.predictor.evaluations,
        steps=estimate.optimiser.steps,
        reason=reason,
        converged=converged,
        seconds=estimate.seconds,
        priors=estimate.priors(priors),
        notes=[*estimate.notes, *notes],
    )
    return replace(result, notes=[*result.notes, *undetermined(result)])


def _band(estimate: Estimate) -> xr.Dataset:
    """Return the tip temperature and its standard error, at the rows or where it was followed."""
    columns, covariance = estimate.prediction.columns, estimate.posterior.covariance
    slopes = estimate.prediction.tip_slopes[:, estimate.objective.columns]
    along = {name: columns[name] for name in ("time_us", "bias_V") if name in columns}
    power = estimate.probe.circuit.power(columns["bias_V"], columns["current_mA"])
    stderr = standard_errors(slopes, covariance)
    return band_dataset(**along, power_mW=power, tip_K=columns["tip_K"], tip_stderr_K=stderr)


def in_medium(
    requested_medium: str | None,
    answered: Callable[[str | None], tuple[Estimate, Answer]],
    of_either: Callable[[Answer, Answer], Answer],
) -> tuple[Estimate, Answer]:
    """Answer for a lever in the medium that is asked; if that is unknown, in the likelier one.

    Then a note says how well either describes the data.

    Parameters
    ----------
    requested_medium : str or None
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
    if requested_medium != UNKNOWN_MEDIUM:
        return answered(requested_medium)
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
    rms_text = ", ".join(f"{value:.2g} {name.rsplit('_', 1)[1]}" for name, value in rms.items())
    return f"{'does not describe' if answer.reason else 'describes'} the data (rms {rms_text})"


def undetermined(fit: Fit) -> list[str]:
    """Say in words what the data do not determine, and what that means for the tip temperature."""
    texts, declared = [], parameters_of(fit.probe, in_time=True)
    for name in fit.names:
        fitted, bounds = fit.parameters[name], declared[name].bounds
        if fitted.stderr is None:
            if fit.describes_data:
                texts.append(f"{name}: no standard error could be estimated")
        elif fitted.stderr >= abs(fitted.value):
            value = value_with_error(fitted.value, fitted.stderr, bounds=bounds)
            texts.append(
                f"{name} is not determined by these data: its standard error is larger than its "
                "value"
                if value == NOT_DETERMINED
                else f"{name} is only bounded by these data: {with_unit(value, fitted.unit)} (95 %)"
            )
        elif (share := fitted.stderr / abs(fitted.value)) > _POOR:
            texts.append(
                f"{name} is poorly determined by these data: its standard error is {share:.0%} of "
                "its value"
            )
    of_material = [name for name in of_materials(fit.probe, in_time=True) if name in fit.names]
    texts += [
        f"{name} ended at the bound of what it may be, "
        f"{with_unit(f'{bound:g}', declared[name].unit)}: these data would have it beyond"
        for name in of_material
        for bound in declared[name].bounds
        if abs(fit.parameters[name].value - bound) < _AT_THE_BOUND * abs(bound)
    ]
    correlation = np.tril(fit.correlation, -1)
    texts += [
        f"{fit.names[second]} and {fit.names[first]} are hardly told apart by these "
        f"data (correlation {correlation[first, second]:+.2f})"
        for first, second in np.argwhere(np.abs(correlation) > _ENTANGLED)
    ]
    largest = float(np.fmax.reduce(fit.band.tip_stderr_K.values))
    if texts and np.isfinite(largest):
        texts.append(
            "the tip temperature that follows has nevertheless a standard error of at most "
            f"{largest:.1f} K from the fitted parameters"
        )
    return texts


def chosen_options(options: FitOptions | None, choices: dict[str, Any]) -> FitOptions:
    """Return options with some of them chosen by name.

    Raises
    ------
    InputError
        If there is no such option; the text gives the nearest one.
    """
    names = list(FitOptions.__dataclass_fields__)
    for name in choices:
        if name not in names:
            raise unknown_name("option", name, names, "fit")
    return replace(options or FitOptions(), **choices)


def _either(fit: Fit, other: Fit) -> Fit:
    """Return a fit in whose band the errors hold that of another one, at the same rows or times."""
    band, of_choice = fit.band, error_of_choice(fit.band.tip_K.values, other.band.tip_K.values)
    stderr = band.tip_stderr_K.copy(data=np.hypot(band.tip_stderr_K.values, of_choice))
    return replace(fit, band=band.assign(tip_stderr_K=stderr))
