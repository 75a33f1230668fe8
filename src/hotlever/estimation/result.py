"""What a fit found, and the file that holds all of it."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from pydantic import Field

from hotlever import __version__
from hotlever.errors import InputError
from hotlever.estimation.band import band_dataset, band_names
from hotlever.estimation.embedded import (
    EmbeddedMeasurement,
    Number,
    Section,
    Spread,
    UsedPrior,
    array,
    embed,
    prior_uses,
    without_spread,
)
from hotlever.estimation.options import FitOptions
from hotlever.estimation.residuals import Residuals
from hotlever.estimation.scales import errors_of_scales
from hotlever.estimation.verdict import Outcome, Verdict
from hotlever.files import without_nan
from hotlever.lever.lever import Lever
from hotlever.materials import full_name
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.parameters import (
    parameter_of,
    parameters_of,
    usual_parameters,
)
from hotlever.probe.priors import Prior, PriorUse, priors_of
from hotlever.text import value_with_error
from hotlever.types import Array

#: What a fit file holds just as a fit does.
_AS_THEY_ARE = (
    *("options", "residual_rms", "sum_of_squares"),
    *("evaluations", "steps", "seconds", "notes"),
)


@dataclass(frozen=True)
class FittedParameter:
    """One material parameter after a fit.

    `stderr` is None if the parameter was fixed or its error could not be estimated.
    """

    value: float
    stderr: float | None
    unit: str
    vary: bool

    def __str__(self) -> str:
        """Return the value with its error, as far as there is one, and its unit."""
        known = value_with_error(self.value, self.stderr)
        return known if self.unit == "1" else f"{known} {self.unit}"


@dataclass(frozen=True)
class Fit(Outcome):
    """Material parameters found from a measurement.

    Where the data are not described by any such lever, the parameters are those of the nearest one
    and no estimates: covariances, and the standard errors that follow, are NaN.

    Attributes
    ----------
    probe : Probe
        With the fitted material, and the circuit and medium of the measurement.
    measurement : Measurement
    options : FitOptions
    names : list of str
        The parameters that were varied.
    observables : tuple of str
        What was fitted.
    covariance : ndarray, shape (len(names), len(names))
        In the parameters' own units, that the standard errors belong to; NaN if it could not be
        estimated.
    common_noise_covariance : ndarray, shape (len(names), len(names))
        What it would be if all weighted data had the same noise: the paper's assumption.
    data_weights : ndarray, shape (len(observables), n)
        What the differences of data and model were multiplied by; 0 for data left out.
    sum_of_squares : float
        Of the weighted differences.
    residual_rms : dict of str to float
        Per column of a sweep (mA, V, K), for every observable with data, fitted or not.
    band : xarray.Dataset
        What the fit predicts at the measured biases, and the standard error of the predicted
        tip temperature that follows from the covariance of the parameters: ``bias_V``,
        ``power_mW``, ``tip_K``, ``tip_stderr_K``, rising in bias; or, of what was measured in time,
        rising in ``time_us``.
    evaluations, steps : int
        Solved sweeps, and Levenberg-Marquardt steps among them.
    seconds : float
    priors : dict of str to PriorUse
        What was known of parameters and scales before, and what the data made of it, by name.
    reason : str
        Where the data are not described by any such lever, or why that is not known; empty if they
        are.
    converged : bool
        Whether the search came to its end.
    notes : list of str
        What the user should know beside the numbers.
    """

    probe: Probe
    measurement: Measurement
    options: FitOptions
    names: list[str]
    observables: tuple[str, ...]
    covariance: Array
    common_noise_covariance: Array
    data_weights: Array
    sum_of_squares: float
    residual_rms: dict[str, float]
    band: xr.Dataset
    evaluations: int
    steps: int
    seconds: float
    priors: dict[str, PriorUse] = field(default_factory=dict)
    reason: str = ""
    notes: list[str] = field(default_factory=list)
    converged: bool = True

    def _without_errors(self) -> dict[str, Any]:
        stderr = xr.full_like(self.band.tip_stderr_K, np.nan)
        return {
            "covariance": np.full_like(self.covariance, np.nan),
            "common_noise_covariance": np.full_like(self.covariance, np.nan),
            "band": self.band.assign(tip_stderr_K=stderr),
            "priors": without_spread(self.priors),
        }

    def __repr__(self) -> str:
        values = (f"{name} {fitted}" for name, fitted in self.parameters.items())
        said = self.doubt or ", ".join(values)
        return f"<Fit of {self.measurement.path or 'a measurement'}: {said}>"

    @property
    def in_time(self) -> bool:
        """Whether it is of what was measured in time."""
        return self.measurement.time_us is not None

    @property
    def medium(self) -> str:
        """What was around the lever."""
        return self.probe.surroundings.medium

    @cached_property
    def parameters(self) -> dict[str, FittedParameter]:
        """Value and standard error of what is usually varied, and of what else was."""
        spread = dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))
        known = parameters_of(self.probe, in_time=True)
        names = dict.fromkeys([*usual_parameters(self.probe), *self.names])
        return {
            name: FittedParameter(
                value=value,
                stderr=spread[name] if np.isfinite(spread.get(name, np.nan)) else None,
                unit=known[name].unit,
                vary=name in self.names,
            )
            for name, value in zip(names, self.probe.at(list(names)).tolist(), strict=True)
        }

    @cached_property
    def _stated(self) -> dict[str, Prior]:
        return priors_of(self.options.priors, self.probe, "priors", in_time=self.in_time)

    @property
    def known_before(self) -> dict[str, Prior]:
        """The priors of the parameters that were varied, by name."""
        return {name: prior for name, prior in self._stated.items() if name in self.names}

    @property
    def correlation(self) -> Array:
        """The correlation of `covariance`."""
        return _correlation(self.covariance)

    @property
    def common_noise_correlation(self) -> Array:
        """The correlation of `common_noise_covariance`."""
        return _correlation(self.common_noise_covariance)

    @property
    def inversion_temperature_K(self) -> float:
        """Inversion temperature T_i of the heater's doping concentration (K); NaN without one."""
        silicon = self.probe.heater_silicon
        return float("nan") if silicon is None else float(silicon.inversion_temperature())

    @cached_property
    def inversion_temperature_stderr_K(self) -> float:
        """Its standard error (K), by central differences; NaN if unknown."""
        silicon, slope = self.probe.heater_silicon, np.zeros(len(self.names))
        if silicon is None:
            return float("nan")
        material = self.probe.layout().heater.stack[0].material
        for own in ("n_d", "p"):
            name, value = full_name(material, own), getattr(silicon, own)
            if name in self.names:
                low, high = (
                    silicon.model_copy(update={own: value * way}).inversion_temperature()
                    for way in (1 - 1e-4, 1 + 1e-4)
                )
                slope[self.names.index(name)] = float(high - low) / (2e-4 * value)
        return float(np.sqrt(slope @ self.covariance @ slope))

    def model(self, bias: ArrayLike | None = None) -> xr.Dataset:
        """Solve the fitted lever, at the measured biases by default; see `Lever.sweep`.

        Of what was measured in time: follow it at the measured times (`Lever.pulse`).
        """
        lever, measured = Lever(self.probe), self.measurement
        if bias is None and measured.waveform is not None:
            return lever.pulse(measured.waveform, at=measured.time_us)
        return lever.sweep(measured.bias_V if bias is None else bias)

    def residuals(self) -> Residuals:
        """Return the data with the fit's own weights, to be compared with predictions."""
        known, base = self._stated, self.probe.circuit.base_temperature_K
        common = errors_of_scales(self.measurement, self.observables, known, base) if known else []
        return Residuals(
            self.measurement,
            self.observables,
            drift=self.options.drift,
            data_weights=self.data_weights,
            common=common,
        )

    # --- the file -------------------------------------------------------------------------------

    def content(self) -> dict[str, Any]:
        """Return the content of the fit file."""
        content = {
            "parameters": {name: vars(p) for name, p in self.parameters.items()},
            "correlation": {"names": self.names, "matrix": self.correlation.tolist()},
            "priors": {name: vars(use) for name, use in self.priors.items()},
            "observables": list(self.observables),
            "inversion_temperature_K": self.inversion_temperature_K,
            "inversion_temperature_stderr_K": self.inversion_temperature_stderr_K,
            "residual_rms": self.residual_rms,
            "evaluations": self.evaluations,
            "steps": self.steps,
            "seconds": round(self.seconds, 3),
            "describes_data": self.describes_data,
            "reason": self.reason,
            "probe": self.probe.values(),
            "data": {**embed(self.measurement), "weights": self.data_weights.tolist()},
            "options": self.options.values(),
            "common_noise_covariance": self.common_noise_covariance.tolist(),
            "sum_of_squares": self.sum_of_squares,
            "band": {name: self.band[name].values.tolist() for name in band_names(self.in_time)},
            "notes": self.notes,
            "software": f"hotlever {__version__}",
        }
        return dict(without_nan(content))


class _Parameter(Section):
    value: float
    stderr: Spread = np.nan


class _Correlation(Section):
    names: list[str]
    matrix: list[list[Number]]


class _Data(EmbeddedMeasurement):
    weights: list[list[float]]


class _FitFile(Verdict):
    """What a fit file must hold; see `Fit.content`."""

    parameters: dict[str, _Parameter]
    correlation: _Correlation
    observables: list[Literal["current", "reader", "tip"]]
    residual_rms: dict[str, float]
    evaluations: int
    steps: int
    seconds: float
    probe: dict[str, dict[str, Any]]
    data: _Data
    options: FitOptions
    common_noise_covariance: list[list[Number]]
    sum_of_squares: float
    band: dict[str, list[Number]]
    priors: dict[str, UsedPrior] = Field(default_factory=dict)
    notes: list[str]


def read_fit(path: str | os.PathLike[str]) -> Fit:
    """Read a fit file: all that the fit found, to go on with as if it had just been made.

    Raises
    ------
    InputError
        If it cannot be read or is not a fit file; the text names the key.

    Examples
    --------
    >>> read_fit("fit.json").parameters["p"].value  # doctest: +SKIP
    2.65
    """
    found = _FitFile.read(path, "fit")
    names, rows = found.correlation.names, len(found.observables)
    if not found.parameters.keys() >= set(names):
        raise InputError(f"{path}: parameters and correlation do not belong together")
    probe = Probe.from_values(found.probe, f"{path}: probe")
    measurement = found.data.measurement(f"{path}: data", probe.circuit)
    in_time = measurement.time_us is not None
    for name in names:
        parameter_of(probe, name, f"{path}: correlation", in_time=in_time)
    stderr = [found.parameters[name].stderr for name in names]
    size = (len(names), len(names))
    correlation = array(found.correlation.matrix, size, f"{path}: correlation")
    noise = array(found.common_noise_covariance, size, f"{path}: common_noise_covariance")
    weights = (rows, measurement.bias_V.size)
    band = {name: found.band.get(name, []) for name in band_names(in_time)}
    length = (len(band["bias_V"]),)
    return Fit(
        probe=probe,
        measurement=measurement,
        names=names,
        observables=tuple(found.observables),
        covariance=correlation * np.outer(stderr, stderr),
        common_noise_covariance=noise,
        data_weights=array(found.data.weights, weights, f"{path}: data: weights"),
        band=band_dataset(
            **{name: array(values, length, f"{path}: band") for name, values in band.items()}
        ),
        priors=prior_uses(found.priors),
        **found.verdict,
        **{name: getattr(found, name) for name in _AS_THEY_ARE},
    )


def _correlation(covariance: Array) -> Array:
    spread = np.sqrt(np.diag(covariance))
    product = np.outer(spread, spread)
    # data that a model made itself leave no errors that could be correlated
    return np.divide(covariance, product, out=np.eye(spread.size), where=product != 0)
