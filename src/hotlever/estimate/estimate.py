"""An estimate: the lever that data and priors make most likely, how sure it is, and the verdict.

A fit finds the parameters of a lever, a calibration its tip temperature as well. Both are estimates
and differ in what was known beforehand (`hotlever.estimate.estimator`).
"""

from __future__ import annotations

import os
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import JsonValue

from hotlever.datasets import columns_text, labelled
from hotlever.errors import ComputationError, InputError, unknown_name
from hotlever.estimate.experiment import experiment_of
from hotlever.estimate.file import EstimateFile, FittedParameter, rising_band
from hotlever.estimate.objective import Objective, PriorDensity
from hotlever.estimate.options import FitOptions
from hotlever.estimate.posterior import OF_THE_MEASUREMENT, standard_errors
from hotlever.estimate.power_law import PowerLaw
from hotlever.estimate.problem import Problem
from hotlever.estimate.residuals import Residuals, errors_of_scales
from hotlever.estimate.search import Solution, solve
from hotlever.estimate.tip_table import (
    OF_THE_CONTACT,
    STATED,
    TABLE_COLUMNS,
    TABLES_BY,
    Knee,
    PulseCalibration,
    TipTable,
    even_rows,
    interpolated,
)
from hotlever.estimate.uncertainty_budget import TemperatureBudget, limits_of
from hotlever.files import json_text, write_text
from hotlever.lever.dataset import probe_attributes
from hotlever.lever.lever import Lever
from hotlever.lever.transient import simulate
from hotlever.materials import full_name
from hotlever.measurement import Measurement
from hotlever.probe import Circuit, Probe
from hotlever.probe.priors import (
    SCALES,
    Prior,
    PriorUse,
    as_known,
    default_priors,
    published_material,
    updated,
)
from hotlever.probe.probe_parameters import parameters_of, usual_parameters
from hotlever.quantities import FITTED, OF_A_CONTACT
from hotlever.text import value_with_error
from hotlever.types import Array, Progress

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """What a measurement and what was known beforehand say of a lever.

    Where the data are not described by any such lever, the numbers are those of the nearest one and
    no estimates: covariances, standard errors, limits and budget are NaN, and there is no pulse,
    since errors about a lever that does not show the data would not hold.

    Attributes
    ----------
    probe : Probe
        The most likely one, in the circuit and medium of the measurement.
    measurement : Measurement
    options : FitOptions
        As they were settled (`hotlever.estimate.problem`), priors among them.
    priors : dict of str to PriorUse
        What was known of parameters and scales before, and what the data made of it, by name.
    reason : str
        Why the data are not described by any such lever, or why that is not known; empty if they
        are.
    converged : bool
        Whether the search came to its end.
    notes : list of str
        What the user should know beside the numbers.
    names : list of str
        The parameters that were varied; none by the paper's rule.
    observables : tuple of str
        What was fitted.
    covariance : ndarray, shape (len(names), len(names))
        In the parameters' own units, that the standard errors belong to; NaN if it could not be
        estimated.
    common_noise_covariance : ndarray, shape (len(names), len(names))
        What it would be if all weighted data had the same noise: the paper's assumption.
    weights : dict of str to ndarray, or None
        What differences of data and lever were multiplied by, by observable, (rows of the
        measurement,): 0 for data left out. None if it rests on other data as well.
    sum_of_squares : float
        Of the weighted differences.
    residual_rms : dict of str to float
        Per column of a sweep (mA, V, K), for every observable with data, fitted or not.
    band_columns : dict of str to ndarray, shape (rows,)
        What is predicted at the measured biases, and the standard error of the predicted tip
        temperature that follows from the covariance of the parameters: ``bias_V``, ``power_mW``,
        ``tip_K``, ``tip_stderr_K``, rising in bias; or, of what was measured in time, rising in
        ``time_us``. Empty by the paper's rule.
    evaluations, steps : int
        Solved sweeps, and steps of the search among them.
    seconds : float
    route : str
        What a calibration rests on: ``power law``, ``probe``, ``fit in vacuum`` or ``fit in air``;
        empty if the tip was not asked for. What follows is of calibrations.
    power_law : PowerLaw or None
        In vacuum, of the estimated lever or as given; T_tip is the law's value at P_l / k,
        approximately (see ``law_residual_K``). None with held supplies, or where the power turns
        along the branch: the tip then follows from no single power.
    law_residual_K : float
        Largest difference of the law from the model it was fitted to; 0 for a given law.
    k, k_stderr : float
        Power of the knee over the threshold of the power law; NaN without a knee or a law.
    knee : Knee
        Of the estimated lever, or as measured; NaN where there is none, or all but its power.
    tabulated : TipTable, optional
        What `table` returns as a dataset: ``TABLE_COLUMNS``, evenly spaced in bias over the
        measured range, with more rows where the tip rises by more than 10 K from one to the next;
        and ``budget_K``, the standard error by source. With held supplies, what is shown is of
        the swept one, and ``total_power_mW`` that of all. Of a tip in contact it has
        `OF_THE_CONTACT` too, and ``apex_budget_K``.
    measured_rms_K : float
        Rms of the measurement's own tip temperatures about the table; NaN if it has none.
    pulse : PulseCalibration, optional
        Of the same lever in a pulse.
    gum : TemperatureBudget, optional
        The uncertainty budget of one row of the table; none by the paper's rule.
    """

    probe: Probe
    measurement: Measurement
    options: FitOptions = field(default_factory=FitOptions)
    priors: dict[str, PriorUse] = field(default_factory=dict)
    reason: str = ""
    converged: bool = True
    notes: list[str] = field(default_factory=list)

    names: list[str] = field(default_factory=list)
    observables: tuple[str, ...] = ()
    covariance: Array = field(default_factory=partial(np.zeros, (0, 0)))
    common_noise_covariance: Array = field(default_factory=partial(np.zeros, (0, 0)))
    weights: dict[str, Array] | None = None
    sum_of_squares: float = np.nan
    residual_rms: dict[str, float] = field(default_factory=dict)
    band_columns: dict[str, Array] = field(default_factory=dict)
    evaluations: int = 0
    steps: int = 0
    seconds: float = 0.0

    route: str = ""
    power_law: PowerLaw | None = None
    law_residual_K: float = np.nan
    k: float = np.nan
    k_stderr: float = np.nan
    knee: Knee = field(default_factory=Knee)
    tabulated: TipTable | None = None
    measured_rms_K: float = np.nan
    pulse: PulseCalibration | None = None
    gum: TemperatureBudget | None = None

    @classmethod
    def of(cls, solution: Solution, converged: bool, reason: str) -> Estimate:
        """Return what users are given of a solution, and of the verdict on it."""
        problem, residuals, prediction = solution.problem, solution.residuals, solution.prediction
        columns, weighted = prediction.columns, residuals.weighted(prediction.values)
        slopes = prediction.tip_slopes[:, solution.objective.columns]
        covariance = solution.posterior.covariance
        band = {name: columns[name] for name in ("time_us", "bias_V") if name in columns} | {
            "power_mW": solution.probe.circuit.power(columns["bias_V"], columns["current_mA"]),
            "tip_K": columns["tip_K"],
            "tip_stderr_K": standard_errors(slopes, covariance),
        }
        of_others = "fit" in problem.prior.sources
        weights = dict(zip(residuals.observables, residuals.data_weights, strict=True))
        return cls(
            probe=solution.probe,
            measurement=problem.measurement,
            options=problem.options,
            priors=solution.priors,
            reason=reason,
            converged=converged,
            notes=problem.notes,
            names=problem.options.varied,
            observables=residuals.observables,
            covariance=covariance,
            common_noise_covariance=solution.covariance,
            weights=None if of_others else weights,
            sum_of_squares=float(weighted @ weighted),
            residual_rms=residuals.rms(prediction.values),
            band_columns=rising_band(band),
            evaluations=solution.predictor.evaluations,
            steps=solution.optimiser.steps,
            seconds=solution.seconds,
        )

    def __post_init__(self) -> None:
        if not self.describes_data:
            for name, value in self._without_errors().items():
                object.__setattr__(self, name, value)

    def _without_errors(self) -> dict[str, Any]:
        """Return the attributes that hold errors, without any."""
        without: dict[str, Any] = {
            "priors": {
                name: replace(use, posterior_spread=np.nan) for name, use in self.priors.items()
            },
            "covariance": np.full_like(self.covariance, np.nan),
            "common_noise_covariance": np.full_like(self.common_noise_covariance, np.nan),
            "k_stderr": np.nan,
            "knee": self.knee.without_errors(),
            "pulse": None,
            "gum": None,
        }
        errors = (*STATED, *OF_THE_CONTACT[1::2])

        def emptied(columns: Mapping[str, Array], names: Container[str]) -> dict[str, Array]:
            return {
                name: np.full_like(values, np.nan) if name in names else values
                for name, values in columns.items()
            }

        without["band_columns"] = emptied(self.band_columns, errors)
        if (table := self.tabulated) is not None:
            budgets = {name: emptied(parts, parts) for name, parts in table.budgets.items()}
            without["tabulated"] = TipTable(emptied(table.columns, errors), budgets)
        return without

    # --- the verdict ------------------------------------------------------------------------------

    @property
    def describes_data(self) -> bool | None:
        """Whether such a lever shows what was measured; None if the search did not converge."""
        return not self.reason if self.converged else None

    @property
    def doubt(self) -> str:
        """That no such lever shows the data, or that the search did not converge; else empty."""
        if self.describes_data:
            return ""
        if self.describes_data is None:
            return f"the search for a lever that shows these data did not converge: {self.reason}"
        lever = "lever like this one" if self.route else "such lever"
        return f"no {lever} shows these data: {self.reason}"

    def need_described(self, what: str) -> None:
        """Raise an error unless the data are described, for what has no meaning otherwise.

        Raises
        ------
        InputError
            If they are not.
        """
        if not self.describes_data:
            raise InputError(f"{what}: expected data that a lever describes; {self.doubt}")

    def __repr__(self) -> str:
        """Say what was found: the hottest tip, if it was asked for, or the parameters."""
        if self.route:
            table = self.tip_table
            row = int(np.nanargmax(table["tip_K"]))
            hottest, error, bias_V = (
                float(table[name][row]) for name in ("tip_K", "tip_stderr_K", "bias_V")
            )
            tip = value_with_error(hottest, error)
            found = f"{tip} K at {bias_V:.4g} V in {self.medium}"
        else:
            found = ", ".join(f"{name} {fitted}" for name, fitted in self.parameters.items())
        where = self.measurement.path or "a measurement"
        return f"<Estimate of {where}: {self.doubt or found}>"

    @property
    def in_time(self) -> bool:
        """Whether it is of what was measured in time."""
        return self.measurement.time_us is not None

    @property
    def known(self) -> dict[str, Prior]:
        """What was known beforehand, by name: the priors of the options, all settled."""
        return {
            name: prior for name, prior in self.options.priors.items() if isinstance(prior, Prior)
        }

    @property
    def medium(self) -> str:
        """What is around the lever whose numbers these are."""
        return self.probe.surroundings.medium

    # --- the parameters ---------------------------------------------------------------------------

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
    def inversion_temperature_slopes_K(self) -> Array:
        """Derivatives of it by what was varied, (len(names),), in K per unit; NaN without one.

        They are those of where the conductivity is lowest: T_i moves until d ln σ/dT is 0 again.
        """
        silicon, T_i = self.probe.heater_silicon, self.inversion_temperature_K
        if silicon is None or np.isnan(T_i):
            return np.full(len(self.names), np.nan)

        def steepness(T: float, **changes: float) -> float:
            """Return d ln σ/dT (1/K) of a silicon with some other parameters."""
            other = silicon.model_copy(update=changes)
            sigma, by = other.electrical_conductivity(np.asarray(T), other.n_d)
            return float(by["T"] / sigma)

        along = (steepness(T_i + 0.1) - steepness(T_i - 0.1)) / 0.2
        slopes, material = np.zeros(len(self.names)), self.probe.layout().heater.material
        for own in silicon.parameters:
            if (name := full_name(material, own)) in self.names:
                value = getattr(silicon, own)
                step = 1e-4 * (abs(value) or 1.0)
                high, low = (steepness(T_i, **{own: value + way}) for way in (step, -step))
                slopes[self.names.index(name)] = -(high - low) / (2.0 * step) / along
        return slopes

    @property
    def inversion_temperature_stderr_K(self) -> float:
        """Its standard error (K); NaN if unknown."""
        return float(standard_errors(self.inversion_temperature_slopes_K, self.covariance))

    # --- the lever, and what it is compared with --------------------------------------------------

    @property
    def band(self) -> xr.Dataset:
        """The ``band_columns`` on the dimension ``bias`` or ``time``, and of which lever."""
        columns = self.band_columns
        if not columns:
            return labelled({})
        along, name = ("time", "time_us") if "time_us" in columns else ("bias", "bias_V")
        return labelled(columns, along, {along: columns[name]}, lever=self.probe.title)

    def model(self, bias: ArrayLike | None = None) -> xr.Dataset:
        """Solve the estimated lever, at the measured biases by default; see `Lever.sweep`.

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
        experiment = experiment_of(self.probe, bias, distance_um=distance)
        _, at = experiment.measuring(bias, None, distance).exact_at(self.probe)
        away = self.measurement.out_of_contact
        of_contact = {
            column.name: np.where(away, np.nan, at.values[list(FITTED).index(name)])
            for name, column in OF_A_CONTACT.items()
        }
        columns, coordinates = at.columns | of_contact, {"bias": bias}
        return labelled(columns, coordinates=coordinates, **probe_attributes(self.probe))

    def residuals(self) -> Residuals:
        """Return the data with the weights that they had, to be compared with predictions.

        Raises
        ------
        InputError
            If it rests on other data as well, or on none but a rule.
        """
        if not self.weights:
            raise InputError(
                "the residuals of an estimate: found one that rests on other data too, or on the "
                "paper's rule; expected one of a probe"
            )
        priors, base = self.known, self.probe.circuit.base_temperature_K
        common = []
        if priors:
            common = errors_of_scales(self.measurement, self.observables, priors, base)
        weights = np.stack([self.weights[name] for name in self.observables])
        return Residuals(
            self.measurement,
            self.observables,
            data_weights=weights,
            common=common,
            numerics=self.options.numerics,
        )

    def objective(self, names: Sequence[str]) -> Objective:
        """Return what the search has made small, by derivatives by some parameters."""
        prior = PriorDensity.of_priors(self.known)
        return Objective(self.residuals(), self.probe, names, self.names, prior)

    # --- the tip temperature ----------------------------------------------------------------------

    @property
    def base_temperature_K(self) -> float:
        """Temperature without power (K)."""
        return self.probe.circuit.base_temperature_K

    @property
    def tip_temperature_uncertainty_K(self) -> float:
        """Largest standard error of the tip temperature in the table (K)."""
        return float(np.fmax.reduce(self.tip_table["tip_stderr_K"]))

    @property
    def knee_measured(self) -> bool:
        """Whether the knee lies in the measured range."""
        return self.knee.measured and bool(self.knee.bias_V <= self.tip_table["bias_V"][-1])

    def tip_temperature(self, power_mW: ArrayLike) -> Array:
        """Return the tip temperature (K) by power (mW); NaN outside the measured range.

        NaN too where a slow ramp of the bias jumps over temperatures.

        Raises
        ------
        InputError
            If something else than the swept supply heats the lever, its power turns, or the data
            are not described.
        """
        self.need_described("the tip temperature by power")
        self.probe.circuit.need_cold_start("the tip temperature by the power of one supply")
        if self.power_law is None:
            raise InputError(
                "the tip temperature by power: the power of this lever falls while the tip gets "
                "hotter; expected to be read by bias"
            )
        return interpolated(self.heating, power_mW, "power_mW", "tip_K")

    def bias_for(self, tip_K: ArrayLike, circuit: Circuit | None = None) -> Array:
        """Return the bias (V) that heats the tip to a temperature (K).

        Parameters
        ----------
        tip_K : array_like
        circuit : Circuit, optional
            That of the measurement by default; power and lever voltage do not depend on it.

        Returns
        -------
        ndarray
            NaN outside the measured range, and where a slow ramp jumps over the temperature: no
            bias leads to it. From the coldest tip on, if it cools at first.

        Raises
        ------
        InputError
            If the data are not described: what is set would not follow.
        """
        self.need_described("the bias for a tip temperature")
        lever, current = (
            interpolated(self.heating, tip_K, "tip_K", name) for name in ("lever_V", "current_mA")
        )
        return np.asarray((circuit or self.probe.circuit).bias(lever, current))

    @property
    def table(self) -> xr.Dataset:
        """The tip temperature by bias, with its errors; see ``tabulated``.

        Raises
        ------
        InputError
            If the tip was not asked for.
        """
        return self.tip_table.dataset

    @property
    def tip_table(self) -> TipTable:
        """What is ``tabulated``.

        Raises
        ------
        InputError
            If the tip was not asked for.
        """
        if self.tabulated is None:
            raise InputError(
                f"{self.measurement.path or 'an estimate'}: is a fit, expected a calibration, "
                "which has a table of the tip temperature"
            )
        return self.tabulated

    @property
    def heating(self) -> TipTable:
        """The rows of the table that have a tip temperature, from the coldest on.

        Raises
        ------
        InputError
            If the tip was not asked for.
        """
        known = self.tip_table.rows(np.isfinite(self.tip_table["tip_K"]))
        return known.rows(slice(int(np.argmin(known["tip_K"])), None))

    @property
    def columns(self) -> list[str]:
        """The columns of the table in a file."""
        names = (*TABLE_COLUMNS, "total_power_mW", *OF_THE_CONTACT)
        return [name for name in names if name in self.tip_table]

    def table_csv(self, by: str = "temperature", step: float | None = None) -> str:
        """Return the table as CSV, to load into an instrument; that of the pulse if there is.

        Parameters
        ----------
        by : {"temperature", "power", "bias"}
            What its rows are even in; of a pulse its highest temperature, or its height.
        step : float, optional
            Between rows, in K, mW or V; a round one by default (`even_rows`).

        Raises
        ------
        InputError
            If there is no such table, as by a power that falls while the tip gets hotter.
        """
        if by not in TABLES_BY:
            raise unknown_name("quantity", by, TABLES_BY)
        if self.pulse is not None:
            return self.pulse.table_csv(by, step)
        # by temperature and power from the coldest row on
        table = self.tip_table if by == "bias" else self.heating
        rows = even_rows(table, self.columns, TABLES_BY[by][0], step)
        return columns_text(rows, digits=6)

    def in_either(self, other: Estimate) -> Estimate:
        """Return it with errors that hold another estimate of the same data as well."""
        band = self.band_columns
        choice = _error_of_choice(band["tip_K"], other.band_columns["tip_K"])
        band = {**band, "tip_stderr_K": np.hypot(band["tip_stderr_K"], choice)}
        if not self.route:
            return replace(self, band_columns=band)
        columns, of_other = dict(self.tip_table.columns), other.tip_table
        others = {
            name: np.interp(columns["bias_V"], of_other["bias_V"], of_other[name])
            for name in columns
        }
        columns["tip_low_K"] = np.minimum(columns["tip_low_K"], others["tip_low_K"])
        columns["tip_high_K"] = np.maximum(columns["tip_high_K"], others["tip_high_K"])
        choices = {}
        for error in (name for name in columns if name.endswith("_stderr_K")):
            name = error.replace("_stderr", "")
            choices[name] = _error_of_choice(columns[name], others[name])
            columns[error] = np.hypot(columns[error], choices[name])
        budgets = {
            name: {**parts, "medium": choices["apex_K" if name == "apex_budget_K" else "tip_K"]}
            for name, parts in self.tip_table.budgets.items()
        }
        at_knee = _error_of_choice(np.array(self.knee.tip_K), np.array(other.knee.tip_K)).item()
        knee = replace(self.knee, tip_K_stderr=float(np.hypot(self.knee.tip_K_stderr, at_knee)))
        table, gum = TipTable(columns, budgets), self.gum
        if gum is not None and other.gum is not None:
            row = columns["bias_V"].tolist().index(gum.bias_V)
            limits = limits_of(table.rows(slice(row, row + 1)), gum.of)
            gum = gum.in_either(other.gum, choices[f"{gum.of}_K"][row].item(), limits)
        return replace(self, band_columns=band, tabulated=table, knee=knee, gum=gum)

    # --- what it leaves, known before other data --------------------------------------------------

    def known_before(self, priors: Mapping[str, Prior | str] | None) -> dict[str, Prior]:
        """Return what was known of the lever before it was fitted, some of it by other priors.

        The probe has the material that was found, so that this is no prior of its own.
        """
        if priors is not None and not priors:
            return {}
        stated = {**self.options.priors, **(priors or {})}
        probe = as_known(self.probe, stated)
        before = updated(default_priors(probe, published_material()), stated, probe, "priors")
        return {name: prior for name, prior in before.items() if name not in self.options.fixed}

    def solve_beside(
        self,
        problem: Problem,
        priors: Mapping[str, Prior | str] | None,
        progress: Progress | None,
    ) -> Solution:
        """Estimate the lever by the data of a problem and by its own.

        What its own data leave of the lever itself is known before the others, as one density;
        circuit and gas are those of each measurement.

        Raises
        ------
        ComputationError
            If no lever near the probe has states at all measured biases.
        """
        before, fixed = self.known_before(priors), dict.fromkeys(self.options.fixed)
        options = FitOptions(
            observables=self.observables,
            fixed=fixed,
            priors=before,
            medium=self.probe.surroundings.medium,
            numerics=problem.options.numerics,
        )
        fitted = solve(Problem.of(self.measurement, self.probe, options), progress)
        if _same_data(self.measurement, problem.measurement):
            return fitted
        varied = fitted.problem.options.varied
        own = [name for name in varied if name not in OF_THE_MEASUREMENT]
        numbers = [varied.index(name) for name in own]
        values, covariance = fitted.probe.values(own), fitted.posterior.covariance
        relative = np.array([name not in before or before[name].relative for name in own])
        left = PriorDensity.of_estimate(own, values, covariance[np.ix_(numbers, numbers)], relative)
        probe = problem.probe.replace(dict(zip(own, values.tolist(), strict=True)))
        theirs = {
            name: prior
            for name, prior in problem.known.items()
            if name in {*OF_THE_MEASUREMENT, *SCALES}
        }
        free = tuple(name for name in own if name not in usual_parameters(probe))
        medium = problem.probe.surroundings.medium
        again = replace(options, observables=None, priors=theirs, free=free, medium=medium)
        together = Problem.of(problem.measurement, probe, again, before=left)
        try:
            return solve(replace(together, known={**before, **theirs}), progress)
        except ComputationError as error:
            raise ComputationError(
                "no lever like the fitted one shows these data; is it another lever's fit? "
                f"({error})"
            ) from error

    # --- its file ---------------------------------------------------------------------------------

    @classmethod
    def of_file(cls, file: EstimateFile) -> Estimate:
        """Return the estimate of a file, to go on with as if it had just been made."""
        return cls(**file.attributes([field.name for field in fields(cls)]))

    def file(self, request: dict[str, JsonValue] | None = None) -> EstimateFile:
        """Return what the file of the estimate holds; `request` is what a batch was asked."""
        return EstimateFile.of(self, request)

    def content(self, request: dict[str, JsonValue] | None = None) -> dict[str, Any]:
        """Return the content of the file in plain values."""
        return self.file(request).content()

    def to_json(self, request: dict[str, JsonValue] | None = None) -> str:
        """Return the text of the file."""
        return json_text(self.content(request))

    def write(
        self, path: str | os.PathLike[str], request: dict[str, JsonValue] | None = None
    ) -> None:
        """Write the file, whole or not at all."""
        write_text(path, self.to_json(request))


def _same_data(first: Measurement, second: Measurement) -> bool:
    columns, others = (
        (data.bias_V, data.observable("current"), data.observable("bridge"))
        for data in (first, second)
    )
    return np.array_equal(columns, others, equal_nan=True)


def _error_of_choice(tip_K: Array, other_K: Array) -> Array:
    """Return the standard error (K) of a tip temperature that may as well be another one."""
    return np.asarray(np.abs(tip_K - other_K) / np.sqrt(2.0))


def _correlation(covariance: Array) -> Array:
    spread = np.sqrt(np.diag(covariance))
    product = np.outer(spread, spread)
    # data that a model made itself leave no errors that could be correlated
    correlation = np.divide(covariance, product, out=np.eye(spread.size), where=product != 0)
    # without what rounding leaves, so that files keep the standard errors as they are
    np.fill_diagonal(correlation, np.round(np.diag(correlation)))
    return correlation


def read_fit(path: str | os.PathLike[str]) -> Estimate:
    """Read the file of a fit: all that was found, to go on with as if it had just been made.

    Raises
    ------
    InputError
        If it cannot be read or is no such file; the text names the key.

    Examples
    --------
    >>> read_fit("fit.json").parameters["p"].value  # doctest: +SKIP
    2.65
    """
    return Estimate.of_file(EstimateFile.read(path, "fit"))


def read_calibration(path: str | os.PathLike[str]) -> Estimate:
    """Read the file of a calibration: all of it, to go on with as if it had just been made.

    Raises
    ------
    InputError
        If it cannot be read or is no such file; the text names the key.

    Examples
    --------
    >>> read_calibration("calibration.json").bias_for(600.0)  # doctest: +SKIP
    array(7.74)
    """
    return Estimate.of_file(EstimateFile.read(path, "calibration"))
