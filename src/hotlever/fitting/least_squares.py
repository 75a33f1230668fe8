"""The least-squares problem of a fit: weights, Levenberg-Marquardt, confirmation, scatter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import lmfit
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from hotlever.errors import ComputationError, InputError
from hotlever.fitting.drift import Drift
from hotlever.fitting.measurement import Measurement
from hotlever.fitting.models import ForwardModel
from hotlever.fitting.start import aligned, starting_material
from hotlever.lever.equations import OBSERVABLES
from hotlever.lever.lever import OBSERVABLE_COLUMNS
from hotlever.lever.reduced import ReducedSpace
from hotlever.materials import PARAMETERS, Material
from hotlever.probe.probe import Circuit

Array = NDArray[np.float64]
Weights = Literal["maximum", "errors"]

#: Scaled residual given to trial parameters for which the lever cannot be solved: far beyond
#: any real one, so that Levenberg-Marquardt turns back.
_UNSOLVED = 10.0

#: Solved sweeps that most fits need, for a progress bar to fill.
_USUAL_EVALUATIONS = 10
#: A relative change of the sum of squares by 1e-6 is that of a hundredth of a standard error.
_STEP_TOLERANCE, _SUM_TOLERANCE = 1e-5, 1e-6
#: A confirmation that moves every parameter by less than this share of its standard error ends
#: the fit; further ones would move it by that share again.
_SETTLED = 0.05
_MOST_CONFIRMATIONS = 5
#: Tukey's biweight gives no weight beyond this many standard deviations.
_TUKEY = 4.685
_HUBER, _HUBER_TURNS = 1.345, 6
_MOST_REWEIGHTINGS = 20
#: A datum that alone decides a parameter says nothing of its own noise.
_LEAST_FREE = 0.05
#: Rounds in which an observable without measurement errors finds its scatter.
_SCATTER_TURNS = 3
#: A point is named as suspicious beyond this many standard deviations.
_SUSPICIOUS = 8.0


class LeastSquares:
    """The residuals of a measurement and their Jacobian, in the units of the fit, for lmfit.

    Every observable is divided by its largest measured value, or every datum by its standard
    error; every parameter by its scale.

    Parameters
    ----------
    model : ForwardModel
    start : Material
        Where to begin; fixed parameters stay there.
    measurement : Measurement
    used : ndarray of bool
        The rows of the measurement that take part.
    observables : tuple of str
    varied : list of str
        Parameters to find.
    weights : {"maximum", "errors"}
        What differences are divided by. An observable without measurement errors takes its
        scatter about the fit for one.
    drift : bool
        Whether I_h and V_r have a zero that drifts along the file.
    data_weights : ndarray, shape (observables, rows of the measurement), or None
        What differences are multiplied by instead, as an earlier fit found it; 0 leaves out.
    progress : callable or None
        Called with the sweeps solved and how many there usually are.

    Attributes
    ----------
    evaluations, steps : int
        Sweeps solved, and Levenberg-Marquardt steps taken.

    Raises
    ------
    InputError
        If all values of an observable are zero, or only some data have errors.
    """

    def __init__(
        self,
        model: ForwardModel,
        start: Material,
        measurement: Measurement,
        used: NDArray[np.bool_],
        observables: tuple[str, ...],
        varied: list[str],
        weights: Weights,
        drift: bool,
        data_weights: Array | None,
        progress: Callable[[int, int], None] | None,
    ) -> None:
        self._model, self._varied = model, varied
        self.start = start
        self._measurement, self._progress = measurement, progress
        self._used, self._bias = used, measurement.bias_V[used]
        self._rows = [OBSERVABLES.index(name) for name in observables]
        data = np.stack([measurement.observable(name)[used] for name in observables])
        self._scale = np.nanmax(np.abs(data), axis=1, keepdims=True)
        self._data, self._present = data, np.isfinite(data)
        for name, scale in zip(observables, self._scale, strict=True):
            if scale == 0:
                raise InputError(f"{measurement.path or 'measurement'}: all values of {name} are 0")
        self._largest = self._scale
        self._errors = weights == "errors" and data_weights is None
        if self._errors:
            self._scale = self._measured_errors(observables)
        self._weights = np.ones(data.shape)
        if data_weights is not None:
            self._scale, self._weights = np.ones(data.shape), data_weights[:, used]
            self._present = self._present & (self._weights > 0)
        self._lines, self._drift = Drift(observables, self._present), drift
        self.size = int(self._present.sum())
        self.evaluations = 0
        self.steps = 0
        self._at: Material | None = None
        self._prediction: tuple[Array, Array] | None = None

    def _measured_errors(self, observables: tuple[str, ...]) -> Array:
        """Return the standard error of every datum; a hundredth of the largest where unknown."""
        errors = np.stack([self._measurement.error(name)[self._used] for name in observables])
        usable = errors > 0
        for place, name in enumerate(observables):
            missing = self._bias[self._present[place] & ~usable[place]]
            if usable[place].any() and missing.size:
                raise InputError(
                    f"{self._measurement.path or 'measurement'}: {name} has no error above 0 at "
                    f"{missing[0]:g} V, expected one for each of its values or none at all"
                )
        self._without_errors: NDArray[np.bool_] = np.all(np.isnan(errors), axis=1)
        guessed = np.broadcast_to(0.01 * self._largest, errors.shape)
        return np.where(np.isfinite(errors), errors, guessed)

    def _take_scatter(self, result: Any) -> None:
        """Give observables without measurement errors their scatter about the fit."""
        rms = np.sqrt(np.nanmean(self._difference(result.params) ** 2, axis=1, keepdims=True))
        scatter = np.maximum(rms, 1e-6 * self._largest)
        self._scale = np.where(self._without_errors[:, None], scatter, self._scale)

    @property
    def reduced_chi_square(self) -> float | None:
        """Of the observables with measurement errors, at the last prediction; None without."""
        if not self._errors or self._without_errors.all() or self._prediction is None:
            return None
        residual = self._unexplained(self._prediction[0]) / self._scale
        known = residual[~self._without_errors]
        count = np.isfinite(known).sum()
        share = len(self._varied) * count / self.size
        return float(np.nansum(known**2) / max(count - share, 1.0))

    def use(self, model: ForwardModel) -> None:
        """Compare the data with another model from now on."""
        self._model, self._at, self._prediction = model, None, None
        self.evaluations = 0

    def found_start(self, space: ReducedSpace, circuit: Circuit) -> Material:
        """Return the material to start from, found from the data or the one given."""
        data, scale = (
            aligned(self._rows, rows)
            for rows in (self._data, np.broadcast_to(self._largest, self._data.shape))
        )
        return starting_material(space, circuit, self.start, self._varied, self._bias, data, scale)

    def solve_and_confirm(self, robust: bool) -> Any:
        """Run Levenberg-Marquardt, make the model exact at its end, and repeat if that matters."""
        result = self._solve(self.start)
        for _ in range(_SCATTER_TURNS if self._errors and self._without_errors.any() else 0):
            self._take_scatter(result)
            result = self._solve(self.material(result.params))
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
            origin = self.start if at_first else self.material(result.params)
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
        result = minimizer.leastsq(Dfun=self._jacobian, xtol=_STEP_TOLERANCE, ftol=_SUM_TOLERANCE)
        if not result.success:
            raise ComputationError(f"the fit did not converge: {result.message}")
        return result

    def material(self, parameters: Any) -> Material:
        """Return the material of lmfit's scaled parameters."""
        values = {name: parameters[name].value * PARAMETERS[name].scale for name in self._varied}
        return self.start.model_copy(update=values)

    def covariance(self, result: Any) -> Array:
        """Return the covariance of the varied parameters in their own units; NaN if singular.

        Noise differs between observables and along each of them by more than the weights know,
        so every datum's variance is taken from its own residual, enlarged by its leverage h
        (MacKinnon and White's HC3, J. Econometrics 29, 305 (1985)): C = A⁻¹ Jᵀ V J A⁻¹ with
        A = JᵀJ and V = r² / (1 − h)².
        """
        scale = np.array([PARAMETERS[name].scale for name in self._varied])
        residual, jacobian = self._residual(result.params), self._slopes(result.params)
        unknown = np.full((scale.size, scale.size), np.nan)
        if self.size <= scale.size:
            return unknown
        try:
            inverse = np.linalg.inv(jacobian.T @ jacobian)
        except np.linalg.LinAlgError:
            return unknown
        leverage = np.einsum("ij,jk,ik->i", jacobian, inverse, jacobian)
        influence = inverse @ jacobian.T * (residual / np.maximum(1.0 - leverage, _LEAST_FREE))
        covariance: Array = influence @ influence.T * np.outer(scale, scale)
        return covariance

    def common_noise_covariance(self, result: Any) -> Array:
        """Return the covariance if all weighted data had the same noise, as lmfit takes them."""
        scale = np.array([PARAMETERS[name].scale for name in self._varied])
        covariance = getattr(result, "covar", None)
        if covariance is None:
            return np.full((scale.size, scale.size), np.nan)
        return np.asarray(covariance * np.outer(scale, scale))

    @property
    def data_weights(self) -> Array:
        """What differences are multiplied by, in all rows of the measurement; 0 if left out."""
        full = np.zeros((len(self._rows), self._used.size))
        full[:, self._used] = np.where(self._present, self._by, 0.0)
        return full

    def sum_of_squares(self, parameters: Any) -> float:
        """Return the sum of squares of the weighted residuals."""
        residual = self._residual(parameters)
        return float(residual @ residual)

    def residual_rms(self, parameters: Any) -> dict[str, float]:
        """Return the rms of data minus model per column, for every observable with data."""
        values, _ = self._predict(self.material(parameters))
        fitted = dict(zip(self._rows, self._unexplained(values), strict=True))
        rms = {}
        for row, name in enumerate(OBSERVABLES):
            others = self._measurement.observable(name)[self._used] - values[row]
            difference = fitted.get(row, others)
            if np.isfinite(difference).any():
                rms[OBSERVABLE_COLUMNS[name]] = float(np.sqrt(np.nanmean(difference**2)))
        return rms

    def zeros(self, parameters: Any) -> list[str]:
        """Say how the zeros drift, or that they seem to."""
        values, _ = self._predict(self.material(parameters))
        difference = self._data - values[self._rows]
        if self._drift:
            return self._lines.lines_in_words(self._lines.line(difference, self._by))
        if self.size <= len(self._varied) + 2 * len(self._rows):
            return []
        residual, jacobian = -self._residual(parameters), self._slopes(parameters)
        noticed = self._lines.noticed(residual, jacobian, self._by)
        return [f"{text}; --drift would take that out" for text in noticed]

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
        residuals = self._difference(parameters)
        scatter = 1.4826 * np.nanmedian(np.abs(residuals), axis=1, keepdims=True)
        # data without noise have no scatter to measure against
        floor = 1e-4 * self._largest
        deviations: Array = np.nan_to_num(residuals / np.maximum(scatter, floor))
        return deviations

    def _residual(self, parameters: Any) -> Array:
        try:
            values, _ = self._predict(self.material(parameters))
        except ComputationError:
            if self.evaluations == 1:
                raise
            return np.full(self.size, _UNSOLVED)
        return (-self._by * self._unexplained(values))[self._present]

    def _jacobian(self, parameters: Any) -> Array:
        # Levenberg-Marquardt asks for this once per step, at parameters it has just accepted
        self.steps += 1
        return self._slopes(parameters)

    def _slopes(self, parameters: Any) -> Array:
        """Return the derivatives of the residuals by the scaled parameters."""
        _, sensitivities = self._predict(self.material(parameters))
        columns = [list(PARAMETERS).index(name) for name in self._varied]
        scale = np.array([PARAMETERS[name].scale for name in self._varied])
        scaled = sensitivities[self._rows][:, :, columns] * scale
        jacobian = (self._by[:, :, None] * scaled)[self._present]
        return self._lines.removed(jacobian, self._by) if self._drift else jacobian

    @property
    def _by(self) -> Array:
        """What differences are multiplied by, shape (observables, n)."""
        by: Array = self._weights / self._scale
        return by

    def _difference(self, parameters: Any) -> Array:
        """Return data minus prediction, NaN where nothing was measured."""
        return self._unexplained(self._predict(self.material(parameters))[0])

    def _unexplained(self, values: Array) -> Array:
        """Return data minus prediction minus the drifting zeros."""
        difference: Array = self._data - values[self._rows]
        return difference - self._lines.line(difference, self._by) if self._drift else difference

    def _predict(self, material: Material) -> tuple[Array, Array]:
        if self._prediction is None or material != self._at:
            self._at, self._prediction = material, None
            self.evaluations += 1
            self._prediction = self._model.predict(material, self._bias)
            if self._progress is not None:
                self._progress(self.evaluations, max(_USUAL_EVALUATIONS, self.evaluations))
        return self._prediction
