"""Fitting the material parameters of a lever to measured data."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import lmfit
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from hotlever.errors import ComputationError, InputError
from hotlever.files import write_text
from hotlever.fitting.measurement import OBSERVABLE_SYMBOLS, Measurement
from hotlever.fitting.models import ForwardModel, fast_model, full_model
from hotlever.lever.equations import OBSERVABLES
from hotlever.lever.lever import OBSERVABLE_COLUMNS, Lever
from hotlever.materials import PARAMETERS, Material, parameter
from hotlever.materials.silicon import inversion_temperature
from hotlever.probe import Probe

Array = NDArray[np.float64]

#: Scaled residual given to trial parameters for which the lever cannot be solved: far beyond
#: any real one, so that Levenberg-Marquardt turns back.
_UNSOLVED = 10.0

#: Solved sweeps that most fits need, for a progress bar to fill.
_USUAL_EVALUATIONS = 10
#: A confirmation that moves every parameter by less than this share of its standard error ends
#: the fit; further ones would move it by that share again.
_SETTLED = 0.05
_MOST_CONFIRMATIONS = 5
#: Tukey's biweight gives no weight beyond this many standard deviations.
_TUKEY = 4.685
_HUBER, _HUBER_TURNS = 1.345, 6
_MOST_REWEIGHTINGS = 20
#: A point is named as suspicious beyond this many standard deviations.
_SUSPICIOUS = 8.0
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
        NaN if it could not be estimated.
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
    model: Callable[[Probe], ForwardModel] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Fit:
    """Find the material parameters that make the model match a measurement.

    Levenberg-Marquardt (lmfit) with the exact Jacobian; every observable is divided by its
    largest measured value, as in the paper. The start is the probe's material.

    Parameters
    ----------
    measurement : Measurement
    probe : Probe, optional
        The reference probe by default. The measurement's series resistance and base
        temperature win over the probe's.
    observables : sequence of {"current", "reader", "tip"}, optional
        Option I of the paper is ``["current"]``, option II ``["current", "reader"]``, option
        III all three. All that the measurement has, by default.
    fixed : mapping of str to float or None, optional
        Parameters to hold, at a value or (None) at the probe's.
    robust : bool
        Lessen the weight of points far from the others' fit (Tukey's biweight on the residuals
        in units of their median absolute deviation), down to nothing beyond 4.7 of them.
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
    probe, notes = with_measured_circuit(probe or Probe.reference(), measurement)
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
    problem = _LeastSquares(
        model(probe) if model else fast_model(probe, progress),
        start,
        measurement,
        used,
        chosen,
        varied,
        progress,
    )
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
    parameters = {
        name: FittedParameter(
            value=getattr(material, name),
            stderr=problem.stderr(result, name),
            unit=PARAMETERS[name].unit,
            vary=name in varied,
        )
        for name in PARAMETERS
    }
    covariance = problem.covariance(result)
    correlation = _correlation(covariance)
    band = problem.band(result.params, covariance, probe.circuit.series_resistance_ohm)
    notes += problem.suspicious(result.params, robust)
    notes += statements(parameters, varied, correlation, band)
    return Fit(
        parameters=parameters,
        names=varied,
        correlation=correlation,
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


def with_measured_circuit(probe: Probe, measurement: Measurement) -> tuple[Probe, list[str]]:
    """Return the probe in the circuit of the measurement, and a note on each difference."""
    changes, notes = {}, []
    for name in ("series_resistance_ohm", "base_temperature_K"):
        measured, assumed = getattr(measurement, name), getattr(probe.circuit, name)
        if measured is not None and not np.isclose(measured, assumed, rtol=1e-9):
            changes[name] = measured
            notes.append(
                f"{name}: the data file's {measured:g} is used, not the probe's {assumed:g}"
            )
    return probe.with_values(changes), notes


class _LeastSquares:
    """Scaled residuals and their Jacobian, for lmfit."""

    def __init__(
        self,
        model: ForwardModel,
        start: Material,
        measurement: Measurement,
        used: NDArray[np.bool_],
        observables: tuple[str, ...],
        varied: list[str],
        progress: Callable[[int, int], None] | None,
    ) -> None:
        self._model, self._start, self._varied = model, start, varied
        self._measurement, self._progress = measurement, progress
        self._used, self._bias = used, measurement.bias_V[used]
        self._rows = [OBSERVABLES.index(name) for name in observables]
        data = np.stack([measurement.observable(name)[used] for name in observables])
        self._scale = np.nanmax(np.abs(data), axis=1, keepdims=True)
        self._data, self._present = data, np.isfinite(data)
        for name, scale in zip(observables, self._scale, strict=True):
            if scale == 0:
                raise InputError(f"{measurement.path or 'measurement'}: all values of {name} are 0")
        self._weights = np.ones(data.shape)
        self.size = int(self._present.sum())
        self.evaluations = 0
        self.steps = 0
        self._at: Material | None = None
        self._prediction: tuple[Array, Array] | None = None

    def use(self, model: ForwardModel) -> None:
        """Compare the data with another model from now on."""
        self._model, self._at, self._prediction = model, None, None
        self.evaluations = 0

    def solve_and_confirm(self, robust: bool) -> Any:
        """Run Levenberg-Marquardt, make the model exact at its end, and repeat if that matters."""
        result = self._solve(self._start)
        for turn in range(_MOST_REWEIGHTINGS if robust else 0):
            size = np.abs(self._deviations(result.params))
            # first Huber's weights, which have one optimum, then Tukey's, which forget outliers
            at_first = turn < _HUBER_TURNS
            self._weights = (
                np.sqrt(_HUBER / np.maximum(size, _HUBER))
                if at_first
                else np.clip(1.0 - (size / _TUKEY) ** 2, 0.0, None)
            )
            # outliers can drive the first fit onto a bound, where it would stay
            origin = self._start if at_first else self.material(result.params)
            previous, result = result, self._solve(origin)
            if not at_first and self._settled(previous, result):
                break
        for _ in range(_MOST_CONFIRMATIONS):
            change = self._model.confirm(self.material(result.params), self._bias)
            self._at = None
            moved = (change[self._rows] / self._scale)[self._present]
            if not moved.any():
                return result
            previous, result = result, self._solve(self.material(result.params))
            if self._settled(previous, result):
                return result
        raise ComputationError(
            f"the fit did not settle: after {_MOST_CONFIRMATIONS} confirmations by full solves the "
            f"parameters still move by more than {_SETTLED:g} of their standard errors"
        )

    def _settled(self, previous: Any, result: Any) -> bool:
        """Whether confirming moved no parameter by more than a share of its standard error."""
        return all(
            abs(result.params[name].value - previous.params[name].value)
            <= _SETTLED * (result.params[name].stderr or np.inf)
            for name in self._varied
        )

    def _solve(self, start: Material) -> Any:
        """Run Levenberg-Marquardt."""
        parameters = lmfit.Parameters()
        for name in self._varied:
            known = PARAMETERS[name]
            value = getattr(start, name)
            if not known.lower < value < known.upper:
                raise InputError(
                    f"{name} = {value:g} to start from, expected a value between "
                    f"{known.lower:g} and {known.upper:g} {known.unit}"
                )
            parameters.add(
                name,
                value=value / known.scale,
                min=known.lower / known.scale,
                max=known.upper / known.scale,
            )
        minimizer = lmfit.Minimizer(self._residual, parameters, max_nfev=200)
        result = minimizer.leastsq(Dfun=self._jacobian, xtol=1e-5, ftol=1e-8)
        if not result.success:
            raise ComputationError(f"the fit did not converge: {result.message}")
        return result

    def material(self, parameters: Any) -> Material:
        """Return the material of lmfit's scaled parameters."""
        values = {name: parameters[name].value * PARAMETERS[name].scale for name in self._varied}
        return self._start.model_copy(update=values)

    def stderr(self, result: Any, name: str) -> float | None:
        """Return the standard error of a parameter in its own unit."""
        if name not in self._varied or result.params[name].stderr is None:
            return None
        return float(result.params[name].stderr * PARAMETERS[name].scale)

    def covariance(self, result: Any) -> Array:
        """Return the covariance of the varied parameters in their own units."""
        scale = np.array([PARAMETERS[name].scale for name in self._varied])
        covariance = getattr(result, "covar", None)
        if covariance is None:
            return np.full((scale.size, scale.size), np.nan)
        scaled: Array = covariance * np.outer(scale, scale)
        return scaled

    def residual_rms(self, parameters: Any) -> dict[str, float]:
        """Return the rms of data minus model per column, for every observable with data."""
        values, _ = self._predict(self.material(parameters))
        rms = {}
        for row, name in enumerate(OBSERVABLES):
            difference = self._measurement.observable(name)[self._used] - values[row]
            if np.isfinite(difference).any():
                rms[OBSERVABLE_COLUMNS[name]] = float(np.sqrt(np.nanmean(difference**2)))
        return rms

    def band(self, parameters: Any, covariance: Array, series_resistance_ohm: float) -> xr.Dataset:
        """Return the predicted tip temperature and its standard error: see `Fit.band`."""
        (current, _, tip), sensitivities = self._predict(self.material(parameters))
        columns = [list(PARAMETERS).index(name) for name in self._varied]
        slopes = sensitivities[OBSERVABLES.index("tip")][:, columns]
        stderr = np.sqrt(np.einsum("bi,ij,bj->b", slopes, covariance, slopes))
        power = current * (self._bias - series_resistance_ohm / 1000.0 * current)
        _, order = np.unique(self._bias, return_index=True)
        described = {
            "bias_V": (self._bias, "V", "bias"),
            "power_mW": (power, "mW", "power dissipated in the lever"),
            "tip_K": (tip, "K", "predicted tip temperature"),
            "tip_stderr_K": (stderr, "K", "its standard error from the fitted parameters"),
        }
        return xr.Dataset(
            {
                name: ("bias", values[order], {"units": unit, "long_name": text})
                for name, (values, unit, text) in described.items()
            }
        )

    def suspicious(self, parameters: Any, robust: bool) -> list[str]:
        """Name the points that lie far outside the scatter of the others."""
        advice = "it hardly counts" if robust else "a robust fit would lessen its weight"
        deviations = self._deviations(parameters)
        return [
            f"{OBSERVABLES[row]} at {bias:g} V is {abs(deviation):.0f} standard deviations from "
            f"the fit; {advice}"
            for row, deviations_of_row in zip(self._rows, deviations, strict=True)
            for bias, deviation in zip(self._bias, deviations_of_row, strict=True)
            if abs(deviation) > _SUSPICIOUS
        ]

    def _deviations(self, parameters: Any) -> Array:
        """Return residuals in units of the scatter of their observable; 0 where nothing is."""
        values, _ = self._predict(self.material(parameters))
        residuals = np.where(self._present, values[self._rows] - self._data, np.nan)
        scatter = 1.4826 * np.nanmedian(np.abs(residuals), axis=1, keepdims=True)
        # data without noise have no scatter to measure against
        floor = 1e-4 * self._scale
        deviations: Array = np.nan_to_num(residuals / np.maximum(scatter, floor))
        return deviations

    def _residual(self, parameters: Any) -> Array:
        try:
            values, _ = self._predict(self.material(parameters))
        except ComputationError:
            if self.evaluations == 1:
                raise
            return np.full(self.size, _UNSOLVED)
        scaled = (values[self._rows] - self._data) / self._scale
        return (self._weights * scaled)[self._present]

    def _jacobian(self, parameters: Any) -> Array:
        # Levenberg-Marquardt asks for this once per step, at parameters it has just accepted
        self.steps += 1
        _, sensitivities = self._predict(self.material(parameters))
        columns = [list(PARAMETERS).index(name) for name in self._varied]
        scale = np.array([PARAMETERS[name].scale for name in self._varied])
        scaled = sensitivities[self._rows][:, :, columns] * scale / self._scale[:, :, None]
        return (self._weights[:, :, None] * scaled)[self._present]

    def _predict(self, material: Material) -> tuple[Array, Array]:
        if self._prediction is None or material != self._at:
            self._at, self._prediction = material, None
            self.evaluations += 1
            self._prediction = self._model.predict(material, self._bias)
            if self._progress is not None:
                self._progress(self.evaluations, max(_USUAL_EVALUATIONS, self.evaluations))
        return self._prediction


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
