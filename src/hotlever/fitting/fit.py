"""Fitting the material parameters of a lever to measured data."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from hotlever.errors import ComputationError, InputError
from hotlever.files import write_text
from hotlever.fitting.least_squares import LeastSquares, Weights
from hotlever.fitting.measurement import OBSERVABLE_SYMBOLS, Measurement
from hotlever.fitting.models import FastModel, ForwardModel, fast_model, full_model
from hotlever.lever.equations import OBSERVABLES
from hotlever.lever.lever import Lever
from hotlever.materials import PARAMETERS, Material, parameter
from hotlever.materials.silicon import inversion_temperature
from hotlever.probe import Probe

Array = NDArray[np.float64]

#: A parameter is called poorly determined from this relative standard error.
_POOR = 0.15
#: Two parameters are called hard to tell apart from this correlation.
_ENTANGLED = 0.95


@dataclass(frozen=True)
class FittedParameter:
    """One material parameter after a fit.

    Attributes
    ----------
    value : float
    stderr : float or None
        Standard error; None if the parameter was fixed or its error could not be estimated.
    unit : str
    vary : bool
    """

    value: float
    stderr: float | None
    unit: str
    vary: bool


@dataclass(frozen=True)
class Fit:
    """Material parameters found from a measurement.

    Attributes
    ----------
    parameters : dict of str to FittedParameter
    names : list of str
        The parameters that were varied.
    correlation : ndarray, shape (len(names), len(names))
        That the standard errors belong to; NaN if it could not be estimated.
    common_noise_covariance : ndarray, shape (len(names), len(names))
        What the covariance would be if all weighted data had the same noise: the paper's and
        lmfit's assumption.
    data_weights : ndarray, shape (len(observables), n)
        What the differences of data and model were multiplied by; 0 for data left out.
    sum_of_squares : float
        Of the weighted differences.
    drift : bool
        Whether zeros could drift.
    observables : tuple of str
        What was fitted.
    inversion_temperature_K, inversion_temperature_stderr_K : float
        Of the heater's doping concentration (paper's T_i); the error is NaN if unknown.
    residual_rms : dict of str to float
        Per column of a sweep (mA, V, K), for every observable with data, fitted or not.
    band : xarray.Dataset
        What the fit predicts at the measured biases, and the standard error of the predicted
        tip temperature that follows from the covariance of the parameters: ``bias_V``,
        ``power_mW``, ``tip_K``, ``tip_stderr_K``, rising in bias.
    evaluations, steps : int
        Solved sweeps, and Levenberg-Marquardt steps among them.
    seconds : float
    probe : Probe
        With the fitted material, and the circuit of the measurement.
    measurement : Measurement
    notes : list of str
        What the user should know beside the numbers.
    """

    parameters: dict[str, FittedParameter]
    names: list[str]
    correlation: Array
    common_noise_covariance: Array
    data_weights: Array
    sum_of_squares: float
    drift: bool
    observables: tuple[str, ...]
    inversion_temperature_K: float
    inversion_temperature_stderr_K: float
    residual_rms: dict[str, float]
    band: xr.Dataset
    evaluations: int
    steps: int
    seconds: float
    probe: Probe
    measurement: Measurement
    notes: list[str] = field(default_factory=list)

    def to_json(self) -> str:
        """Return the fit file."""
        content = {
            "parameters": {name: vars(p) for name, p in self.parameters.items()},
            "correlation": {"names": self.names, "matrix": self.correlation.tolist()},
            "observables": list(self.observables),
            "inversion_temperature_K": self.inversion_temperature_K,
            "inversion_temperature_stderr_K": self.inversion_temperature_stderr_K,
            "residual_rms": self.residual_rms,
            "evaluations": self.evaluations,
            "steps": self.steps,
            "seconds": round(self.seconds, 3),
            "probe": self.probe.values(),
            "data": {"path": self.measurement.path, "sha256": self.measurement.sha256},
            "notes": self.notes,
        }
        return json.dumps(_without_nan(content), indent=2, ensure_ascii=False) + "\n"

    @property
    def common_noise_correlation(self) -> Array:
        """The correlation of `common_noise_covariance`."""
        return _correlation(self.common_noise_covariance)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the fit file, whole or not at all."""
        write_text(path, self.to_json())

    def model(self, bias: Array | None = None) -> xr.Dataset:
        """Solve the fitted lever, at the measured biases by default."""
        return Lever(self.probe).sweep(self.measurement.bias_V if bias is None else bias)


def fit(
    measurement: Measurement,
    probe: Probe | None = None,
    *,
    observables: Sequence[str] | None = None,
    fixed: Mapping[str, float | None] | None = None,
    robust: bool = False,
    weights: Weights = "maximum",
    drift: bool = False,
    data_weights: Array | None = None,
    medium: str | None = None,
    model: Callable[[Probe], ForwardModel] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Fit:
    """Find the material parameters that make the model match a measurement.

    Levenberg-Marquardt (lmfit) with the exact Jacobian. It starts from a material found from the
    data (see `hotlever.fitting.start`), or from the probe's if that suits them better.

    Parameters
    ----------
    measurement : Measurement
    probe : Probe, optional
        The reference probe by default. The measurement's series resistance, base temperature
        and medium win over the probe's.
    observables : sequence of {"current", "reader", "tip"}, optional
        Option I of the paper is ``["current"]``, option II ``["current", "reader"]``, option
        III all three. All that the measurement has, by default.
    fixed : mapping of str to float or None, optional
        Parameters to hold, at a value or (None) at the probe's.
    robust : bool
        Lessen the weight of points far from the others' fit (Tukey's biweight on the residuals
        in units of their median absolute deviation), down to nothing beyond 4.7 of them.
    weights : {"maximum", "errors"}
        Divide every observable by its largest measured value, as in the paper, or every datum by
        its measurement error; an observable without errors then takes its scatter about the fit.
    drift : bool
        Let the zeros of I_h and V_r lie on straight lines over the order of the rows.
    data_weights : ndarray, shape (observables, n), optional
        `Fit.data_weights` of an earlier fit, in place of `weights`.
    medium : {"vacuum", "air"}, optional
        What the lever was measured in; wins over measurement and probe.
    model : callable, optional
        Makes the forward model of a probe. By default a reduced lever (made once for each
        geometry, which takes some seconds) whose result is confirmed and corrected by the full
        one; `hotlever.fitting.models.full_model` is the full lever throughout.
    progress : callable, optional
        Called with steps done and their number: parameter sets while a geometry is reduced,
        then solved sweeps and how many there usually are.

    Raises
    ------
    InputError
        If a name does not exist, an observable has no data, a fixed value is impossible, or
        there are fewer data than parameters.
    ComputationError
        If the lever cannot be solved at the start, or the fit does not converge.
    """
    began = time.perf_counter()
    if weights not in ("maximum", "errors"):
        raise InputError(f"found weights = {weights!r}, expected 'maximum' or 'errors'")
    probe, notes = with_measured_circuit(probe or Probe.reference(), measurement, medium)
    fixed = dict(fixed or {})
    chosen = _chosen(observables, measurement)
    start = _held(probe.material, fixed)
    varied = [name for name in PARAMETERS if name not in fixed]
    present = np.isfinite([measurement.observable(name) for name in chosen])
    if present.sum() < len(varied):
        raise InputError(
            f"{measurement.path or 'measurement'}: {present.sum()} data for {len(varied)} "
            "parameters; fix some or measure more"
        )
    used: NDArray[np.bool_] = np.any(present, axis=0)
    forward = model(probe) if model else fast_model(probe, progress)
    problem = LeastSquares(
        forward, start, measurement, used, chosen, varied, weights, drift, data_weights, progress
    )
    if isinstance(forward, FastModel):
        problem.start = problem.found_start(forward.space, probe.circuit)
    try:
        result = problem.solve_and_confirm(robust)
    except ComputationError:
        if model is not None:
            raise
        # far from the parameters it was made for, a reduced lever may fail where the full one
        # does not
        problem.use(full_model(probe))
        result = problem.solve_and_confirm(robust)
    material = problem.material(result.params)
    fitted_probe = probe.model_copy(update={"material": material})
    covariance = problem.covariance(result)
    spread = dict(zip(varied, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    parameters = {
        name: FittedParameter(
            value=getattr(material, name),
            stderr=spread[name] if np.isfinite(spread.get(name, np.nan)) else None,
            unit=PARAMETERS[name].unit,
            vary=name in varied,
        )
        for name in PARAMETERS
    }
    correlation = _correlation(covariance)
    band = problem.band(result.params, covariance, probe.circuit.series_resistance_ohm)
    notes += problem.suspicious(result.params, robust)
    notes += problem.zeros(result.params)
    chi_square = problem.reduced_chi_square
    if chi_square is not None:
        notes.append(
            f"the scatter about the fit is {np.sqrt(chi_square):.2f} times the measurement errors; "
            "standard errors follow the scatter"
        )
    notes += statements(parameters, varied, correlation, band)
    return Fit(
        parameters=parameters,
        names=varied,
        correlation=correlation,
        common_noise_covariance=problem.common_noise_covariance(result),
        data_weights=problem.data_weights,
        sum_of_squares=problem.sum_of_squares(result.params),
        drift=drift,
        observables=chosen,
        inversion_temperature_K=float(inversion_temperature(material.n_d, material.p)),
        inversion_temperature_stderr_K=_inversion_error(material, varied, covariance),
        residual_rms=problem.residual_rms(result.params),
        band=band,
        evaluations=problem.evaluations,
        steps=int(problem.steps),
        seconds=time.perf_counter() - began,
        probe=fitted_probe,
        measurement=measurement,
        notes=notes,
    )


def with_measured_circuit(
    probe: Probe, measurement: Measurement, medium: str | None = None
) -> tuple[Probe, list[str]]:
    """Return the probe in circuit and medium of the measurement, and a note on each difference.

    A `medium` that is asked for wins over both.
    """
    changes: dict[str, Any] = {}
    notes = []
    measured_in, assumed_in = measurement.medium, probe.surroundings.medium
    changes["medium"] = medium or measured_in or assumed_in
    if measured_in is not None and measured_in != changes["medium"]:
        notes.append(f"medium: {medium}, as asked, although the data file says {measured_in}")
    elif medium is None and changes["medium"] != assumed_in:
        notes.append(f"medium: the data file's {measured_in} is used, not the probe's {assumed_in}")
    for name in ("series_resistance_ohm", "base_temperature_K"):
        measured, assumed = getattr(measurement, name), getattr(probe.circuit, name)
        if measured is not None and not np.isclose(measured, assumed, rtol=1e-9):
            changes[name] = measured
            notes.append(
                f"{name}: the data file's {measured:g} is used, not the probe's {assumed:g}"
            )
    return probe.with_values(changes), notes


def statements(
    parameters: Mapping[str, FittedParameter],
    varied: Sequence[str],
    correlation: Array,
    band: xr.Dataset,
) -> list[str]:
    """Say in words what the data do not determine, and what that means for the tip temperature."""
    found = []
    for name in varied:
        fitted = parameters[name]
        if fitted.stderr is None:
            found.append(f"{name}: no standard error could be estimated")
        elif fitted.stderr > _POOR * abs(fitted.value):
            share = fitted.stderr / abs(fitted.value)
            found.append(
                f"{name} is poorly determined by these data: its standard error is {share:.0%} of "
                "its value"
            )
    for first in range(len(varied)):
        for second in range(first):
            together = correlation[first, second]
            if abs(together) > _ENTANGLED:
                found.append(
                    f"{varied[second]} and {varied[first]} are hardly told apart by these data "
                    f"(correlation {together:+.2f})"
                )
    largest = float(band.tip_stderr_K.max())
    if found and np.isfinite(largest):
        found.append(
            "the tip temperature that follows has nevertheless a standard error of at most "
            f"{largest:.1f} K from the fitted parameters"
        )
    return found


def _chosen(observables: Sequence[str] | None, measurement: Measurement) -> tuple[str, ...]:
    """Check the observables asked for; all that have data, by default."""
    if observables is None:
        return measurement.observables
    for name in observables:
        if not np.isfinite(measurement.observable(name)).any():
            raise InputError(
                f"{measurement.path or 'measurement'}: no values of {name} "
                f"(column {OBSERVABLE_SYMBOLS[name]}); it has "
                f"{', '.join(measurement.observables)}"
            )
    if not observables:
        raise InputError(f"no observables; expected some of {', '.join(OBSERVABLES)}")
    return tuple(name for name in OBSERVABLES if name in observables)


def _held(material: Material, fixed: Mapping[str, float | None]) -> Material:
    """Return the starting material with the fixed values in place."""
    values = {}
    for name, value in fixed.items():
        parameter(name)
        if value is not None:
            values[name] = value
    if len(fixed) >= len(PARAMETERS):
        raise InputError("all parameters are fixed; nothing is left to fit")
    return material.with_(**values)


def _correlation(covariance: Array) -> Array:
    spread = np.sqrt(np.diag(covariance))
    return covariance / np.outer(spread, spread)


def _inversion_error(material: Material, varied: list[str], covariance: Array) -> float:
    """Standard error of T_i from the covariance of n_d and p, by central differences."""
    slope = np.zeros(len(varied))
    for place, name in enumerate(varied):
        if name in ("n_d", "p"):
            step = 1e-4 * getattr(material, name)
            high, low = (
                material.model_copy(update={name: getattr(material, name) + sign * step})
                for sign in (1, -1)
            )
            slope[place] = (
                inversion_temperature(high.n_d, high.p) - inversion_temperature(low.n_d, low.p)
            ) / (2 * step)
    return float(np.sqrt(slope @ covariance @ slope))


def _without_nan(value: Any) -> Any:
    """Replace NaN by None: JSON has no NaN."""
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_without_nan(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
