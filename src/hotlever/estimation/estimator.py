"""Fitting the material parameters of a lever to measured data."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from hotlever.errors import unknown_name
from hotlever.estimation.diagnosis import Diagnosis
from hotlever.estimation.experiment import Experiment, Prediction
from hotlever.estimation.inverse_problem import Estimate, error_of_choice, estimate, in_medium
from hotlever.estimation.lack_of_fit import lack_of_fit_text, outlier_notes
from hotlever.estimation.options import FitOptions
from hotlever.estimation.posterior import standard_errors
from hotlever.estimation.result import Fit, band_dataset
from hotlever.estimation.summary import undetermined
from hotlever.measurement import Measurement, given_measurement
from hotlever.probe import Probe
from hotlever.types import Array, Progress


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
    (`hotlever.estimation.optimiser`).

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
        Called with each `hotlever.estimation.experiment.Prediction` on the way, which comes nearer
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
    given = Probe.reference() if probe is None else Probe.coerce(probe)
    whole = given_measurement(measurement, given)

    def fitted(medium: Any) -> tuple[Estimate, Fit]:
        within = replace(options, medium=medium)
        solution = estimate(whole, given, within, model=model, progress=progress, seen=seen)
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
        common_noise_covariance=estimate.optimum.covariance,
        data_weights=residuals.data_weights,
        sum_of_squares=float(weighted @ weighted),
        residual_rms=residuals.rms(values),
        band=_band(estimate),
        evaluations=estimate.predictor.evaluations,
        steps=estimate.optimum.optimiser.steps,
        reason=reason,
        converged=converged,
        seconds=estimate.seconds,
        priors=estimate.priors(options.stated_priors(estimate.probe, in_time=in_time)),
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
