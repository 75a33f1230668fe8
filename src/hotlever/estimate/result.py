"""What a fit found, and the file that holds all of it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, Self, cast

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from pydantic import (
    Field,
    JsonValue,
    PlainSerializer,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from hotlever.datasets import labelled
from hotlever.errors import InputError
from hotlever.estimate.experiment import experiment_of
from hotlever.estimate.noise import errors_of_scales
from hotlever.estimate.objective import Objective
from hotlever.estimate.options import FitOptions
from hotlever.estimate.outcome import (
    Correlations,
    Matrix,
    MeasurementSection,
    Outcome,
    ResultFile,
    Section,
    Vector,
    array,
)
from hotlever.estimate.over_a_sample import with_distances
from hotlever.estimate.posterior import standard_errors
from hotlever.estimate.prior_density import PriorDensity
from hotlever.estimate.residuals import Residuals
from hotlever.lever.dataset import probe_attributes
from hotlever.lever.lever import Lever
from hotlever.lever.transient import simulate
from hotlever.materials import full_name
from hotlever.measurement import Measurement
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, PriorUse, priors_of
from hotlever.probe.probe_parameters import parameter_of, parameters_of, usual_parameters
from hotlever.quantities import FITTED, OF_A_CONTACT, Observable
from hotlever.records import Number, stored_as
from hotlever.text import value_with_error, with_unit
from hotlever.types import Array

#: Variables of a fit's band at rest.
_OF_BAND = {"bias_V", "power_mW", "tip_K", "tip_stderr_K"}


@dataclass(frozen=True)
class FittedParameter:
    """One material parameter after a fit.

    `stderr` is None if the parameter was fixed or its error could not be estimated.
    """

    value: float
    stderr: Annotated[float, Field(ge=0)] | None
    unit: str
    vary: bool

    def __str__(self) -> str:
        """Return the value with its error, as far as there is one, and its unit."""
        return with_unit(value_with_error(self.value, self.stderr), self.unit)


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

    def __post_init__(self) -> None:
        super().__post_init__()
        # figures of it say of which lever it is
        object.__setattr__(self, "band", self.band.assign_attrs(lever=self.probe.title))

    def _without_errors(self) -> dict[str, Any]:
        stderr = xr.full_like(self.band.tip_stderr_K, np.nan)
        return {
            "covariance": np.full_like(self.covariance, np.nan),
            "common_noise_covariance": np.full_like(self.covariance, np.nan),
            "band": self.band.assign(tip_stderr_K=stderr),
        }

    def __repr__(self) -> str:
        values = (f"{name} {fitted}" for name, fitted in self.parameters.items())
        summary = self.doubt or ", ".join(values)
        return f"<Fit of {self.measurement.path or 'a measurement'}: {summary}>"

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
        errors = np.sqrt(np.diag(self.covariance)).tolist()
        stderr = {
            name: error
            for name, error in zip(self.names, errors, strict=True)
            if np.isfinite(error)
        }
        units = parameters_of(self.probe, in_time=True)
        names = list(dict.fromkeys([*usual_parameters(self.probe), *self.names]))
        return {
            name: FittedParameter(value, stderr.get(name), units[name].unit, name in self.names)
            for name, value in zip(names, self.probe.values(names).tolist(), strict=True)
        }

    @cached_property
    def stated_priors(self) -> dict[str, Prior]:
        """What was known before of parameters and scales, by name."""
        return priors_of(self.options.priors, self.probe, "priors", in_time=self.in_time)

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
        material = self.probe.layout().heater.material
        for own in ("n_d", "p"):
            name, value = full_name(material, own), getattr(silicon, own)
            if name in self.names:
                low, high = (
                    silicon.model_copy(update={own: value * way}).inversion_temperature()
                    for way in (1 - 1e-4, 1 + 1e-4)
                )
                slope[self.names.index(name)] = float(high - low) / (2e-4 * value)
        return float(standard_errors(slope, self.covariance))

    def model(self, bias: ArrayLike | None = None) -> xr.Dataset:
        """Solve the fitted lever, at the measured biases by default; see `Lever.sweep`.

        Of what was measured in time: follow it at the measured times (`simulate`). Of a tip in
        contact: as far from the sample as it was, with the temperatures of the contact.
        """
        lever, measured = Lever(self.probe), self.measurement
        if bias is None and measured.waveform is not None:
            return simulate(lever, measured.waveform, at=measured.time_us)
        if bias is None and self.probe.contact is not None:
            return self._over_a_sample()
        return lever.sweep(measured.bias_V if bias is None else bias)

    def _over_a_sample(self) -> xr.Dataset:
        """Return what is shown at the measured biases and distances, in the order of the rows."""
        bias, distance = self.measurement.bias_V, self.measurement.distance_um
        experiment = experiment_of(self.probe, bias)
        experiment = with_distances(experiment, self.probe, distance)
        _, at = experiment.measuring(bias, None, distance).exact_at(self.probe)
        away = self.measurement.out_of_contact
        of_contact = {
            column.name: np.where(away, np.nan, at.values[list(FITTED).index(name)])
            for name, column in OF_A_CONTACT.items()
        }
        columns, coordinates = at.columns | of_contact, {"bias": bias}
        return labelled(columns, coordinates=coordinates, **probe_attributes(self.probe))

    def residuals(self) -> Residuals:
        """Return the data with the fit's own weights, to be compared with predictions."""
        priors, base = self.stated_priors, self.probe.circuit.base_temperature_K
        common = []
        if priors:
            common = errors_of_scales(self.measurement, self.observables, priors, base)
        return Residuals(
            self.measurement,
            self.observables,
            data_weights=self.data_weights,
            common=common,
        )

    def objective(self, names: Sequence[str]) -> Objective:
        """Return what the fit has made small, by derivatives by some parameters."""
        prior = PriorDensity.of_priors(self.stated_priors)
        return Objective(self.residuals(), self.probe, names, self.names, prior)

    def file(self, request: dict[str, JsonValue] | None = None) -> FitFile:
        """Return what the fit file holds."""
        correlation = _Correlation.model_construct(names=self.names, matrix=self.correlation)
        data = _FittedData.of(self.measurement, weights=self.data_weights)
        return FitFile.holding(self, correlation=correlation, data=data, request=request)


def band_dataset(**columns: Array) -> xr.Dataset:
    """Return the `band` of a fit: one row per bias or, with ``time_us``, time; rising in it."""
    along, name = ("time", "time_us") if "time_us" in columns else ("bias", "bias_V")
    rising, order = np.unique(columns[name], return_index=True)
    ordered = {name: values[order] for name, values in columns.items()}
    return labelled(ordered, along, {along: rising})


def _read_band(columns: dict[str, Array]) -> xr.Dataset:
    if not columns.keys() >= _OF_BAND or len({values.size for values in columns.values()}) > 1:
        raise ValueError(f"expected {', '.join(sorted(_OF_BAND))}, as many of each")
    return band_dataset(**columns)


def _written_band(band: xr.Dataset) -> dict[str, list[float]]:
    return {str(name): values.values.tolist() for name, values in band.data_vars.items()}


_Band = Annotated[xr.Dataset, stored_as(dict[str, Vector], _read_band, _written_band)]


def _options(values: Any, check: ValidatorFunctionWrapHandler, info: ValidationInfo) -> FitOptions:
    """Read the options of a fit; what these refuse names the file too.

    Up to version 2 zeros could drift: a fit that let them cannot be taken up again.
    """
    if isinstance(values, dict) and "drift" in values:
        values = dict(values)
        if values.pop("drift"):
            raise InputError(f"{info.context}: options: zeros that drift are no part of fits now")
    try:
        return cast("FitOptions", check(values))
    except InputError as error:
        raise InputError(f"{info.context}: options: {error}") from None


class _Correlation(Section):
    names: list[str]
    matrix: Correlations


class _FittedData(MeasurementSection):
    weights: Matrix


class FitFile(ResultFile[Fit]):
    """What a fit file holds: the schema that it is written and read by."""

    parameters: dict[str, FittedParameter]
    correlation: _Correlation
    observables: tuple[Observable, ...]
    inversion_temperature_K: Number = np.nan
    inversion_temperature_stderr_K: Number = np.nan
    residual_rms: dict[str, float]
    evaluations: int
    steps: int
    seconds: Annotated[float, PlainSerializer(lambda seconds: round(seconds, 3))]
    data: _FittedData
    options: Annotated[FitOptions, WrapValidator(_options), PlainSerializer(FitOptions.values)]
    common_noise_covariance: Matrix
    sum_of_squares: float
    band: _Band

    @model_validator(mode="after")
    def _belongs_together(self, info: ValidationInfo) -> Self:
        path, names, in_time = info.context, self.correlation.names, self.data.time_us is not None
        if not self.parameters.keys() >= set(names):
            raise InputError(f"{path}: parameters and correlation do not belong together")
        for name in names:
            parameter_of(self.probe, name, f"{path}: correlation", in_time=in_time)
            stated, of_probe = self.parameters[name].value, self.probe.values([name]).item()
            if not np.isclose(stated, of_probe, rtol=1e-9, atol=0.0):
                raise InputError(
                    f"{path}: parameters: {name} = {stated:g}, expected that of the probe, "
                    f"{of_probe:g}"
                )
        try:
            self.options.of(self.probe, in_time=in_time)
        except InputError as error:
            raise InputError(f"{path}: options: {error}") from None
        if in_time != ("time_us" in self.band):
            raise InputError(f"{path}: band: expected time_us in it of data in time, and only then")
        priors_of(self.options.priors, self.probe, f"{path}: options: priors", in_time=in_time)
        square, weights = (len(names),) * 2, (len(self.observables), self.data.columns["V_b"].size)
        array(self.correlation.matrix, square, f"{path}: correlation")
        array(self.common_noise_covariance, square, f"{path}: common_noise_covariance")
        array(self.data.weights, weights, f"{path}: data: weights")
        return self

    def result(self) -> Fit:
        """Return the fit, to go on with as if it had just been made."""
        names = self.correlation.names
        stderr = np.array([self.parameters[name].stderr for name in names], dtype=float)
        return Fit(
            names=names,
            covariance=self.correlation.matrix * np.outer(stderr, stderr),
            data_weights=self.data.weights,
            **self.attributes_of(Fit),
        )


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
    return FitFile.read(path, "fit").result()


def _correlation(covariance: Array) -> Array:
    spread = np.sqrt(np.diag(covariance))
    product = np.outer(spread, spread)
    # data that a model made itself leave no errors that could be correlated
    correlation = np.divide(covariance, product, out=np.eye(spread.size), where=product != 0)
    # without what rounding leaves, so that files keep the standard errors as they are
    np.fill_diagonal(correlation, np.round(np.diag(correlation)))
    return correlation
