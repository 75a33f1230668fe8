"""The file of an estimate: one schema, which fits and calibrations are written and read by.

What stands in a file as it is in an `Estimate` is taken from it by name; what stands in another
form has a type that says how. Files of former versions are first made like those of this one.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    PlainSerializer,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    field_serializer,
    model_validator,
)

from hotlever import __version__
from hotlever.errors import InputError, unknown_name
from hotlever.estimate.options import BudgetOf, FitOptions
from hotlever.estimate.power_law import PowerLaw
from hotlever.estimate.tip_table import (
    OF_THE_CONTACT,
    PULSE_COLUMNS,
    TABLE_COLUMNS,
    Knee,
    PulseCalibration,
    PulseTiming,
    TipTable,
)
from hotlever.estimate.uncertainty_budget import (
    Budget,
    CoverageInterval,
    InputQuantity,
    TemperatureBudget,
    limits_of,
)
from hotlever.files import read_json, without_nan
from hotlever.lever.transient.waveform import Polyline, Sine
from hotlever.measurement import MEASURED, Measurement
from hotlever.measurement.data import as_attributes
from hotlever.probe import Probe
from hotlever.probe.priors import SCALES, PriorUse, priors_of
from hotlever.probe.probe_parameters import parameter_of, parameters_of
from hotlever.probe.surroundings import Medium
from hotlever.quantities import FITTED, QUANTITIES, Observable
from hotlever.records import Number, StandardError, explained, stored_as
from hotlever.text import value_with_error, with_unit
from hotlever.types import Array

# --- values that stand in files in another form --------------------------------------------------


def _array(values: Sequence[Any] | Array, shape: tuple[int, ...], where: str) -> Array:
    """Make an array of nested lists, NaN where there is nothing.

    Raises
    ------
    InputError
        If it has another shape.
    """
    try:
        return np.array(values, dtype=float).reshape(shape)
    except (TypeError, ValueError):
        raise InputError(
            f"{where}: expected numbers in {' × '.join(map(str, shape))} places"
        ) from None


def _matrix(values: list[list[float]]) -> Array:
    """Return a matrix of its rows."""
    if len({len(row) for row in values}) > 1:
        raise ValueError("expected rows of the same length")
    return np.array(values, dtype=float)


def _correlations(rows: list[list[float]]) -> Array:
    """Return a matrix of correlations of its rows."""
    matrix, rounding = _matrix(rows), 1e-6
    if np.any(abs(matrix) > 1.0 + rounding) or np.any(abs(np.diag(matrix) - 1.0) > rounding):
        raise ValueError("expected numbers from -1 to 1, and 1 along the diagonal")
    return matrix


def _columns(rows: list[dict[str, float]]) -> dict[str, Array]:
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: np.array([row.get(name) for row in rows], dtype=float) for name in names}


def _rows(columns: dict[str, Array]) -> list[dict[str, float]]:
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in values]


def _probe(sections: dict[str, dict[str, Any]], info: ValidationInfo) -> Probe:
    return Probe.from_sections(sections, f"{info.context}: probe")


def _law(values: dict[str, float], info: ValidationInfo) -> PowerLaw:
    coefficients = {name: value for name, value in values.items() if name != "threshold_K"}
    return PowerLaw.from_values(coefficients, f"{info.context}: power_law")


def _band(columns: dict[str, Array]) -> dict[str, Array]:
    expected = {"bias_V", "power_mW", "tip_K", "tip_stderr_K"}
    if not columns.keys() >= expected or len({values.size for values in columns.values()}) > 1:
        raise ValueError(f"expected {', '.join(sorted(expected))}, as many of each")
    return rising_band(columns)


def _options(values: Any, check: ValidatorFunctionWrapHandler, info: ValidationInfo) -> FitOptions:
    """Read the options of an estimate; what these refuse names the file too."""
    try:
        options: FitOptions = check(values)
    except InputError as error:
        raise InputError(f"{info.context}: options: {error}") from None
    return options


# A row of numbers, NaN where there is nothing.
Vector = Annotated[Array, stored_as(list[Number])]
# Columns of a table, of which files hold the rows.
Columns = Annotated[dict[str, Array], stored_as(list[dict[str, Number]], _columns, _rows)]
Correlations = Annotated[Array, stored_as(list[list[Number]], _correlations)]
Counts = Annotated[
    Array,
    stored_as(
        list[Annotated[float, Field(ge=1, multiple_of=1)]],
        write=lambda counts: counts.astype(int).tolist(),
    ),
]
BudgetRow = Annotated[
    InputQuantity, PlainSerializer(lambda row: asdict(row) | {"contribution_K": row.contribution})
]
# What is not written where there is none.
IF_ANY: Any = Field(None, exclude_if=lambda value: value is None)


# --- the parts of a file ------------------------------------------------------------------------


class Section(BaseModel):
    """A part of a file; what is not known is left alone.

    While a file is read its path is pydantic's context, for errors.
    """

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False, defer_build=True)

    @classmethod
    def holding(cls, source: object, **others: Any) -> Self:
        """Return the section with the attributes of a source that have its names, and others."""
        same = {
            name: getattr(source, name)
            for name in cls.model_fields
            if name not in others and hasattr(source, name)
        }
        # what hotlever has made need not be checked
        return cls.model_construct(**same, **others)

    def attributes_of(self, kind: Any) -> dict[str, Any]:
        """Return what it holds of a dataclass as it is, by attribute."""
        names = [field.name for field in fields(kind) if field.name in type(self).model_fields]
        return {name: getattr(self, name) for name in names}


class MeasurementSection(Section):
    """A measurement as files hold it."""

    path: str = ""
    sha256: str = ""
    series_resistance_ohm: float | None = None
    base_temperature_K: float | None = None
    medium: Medium | None = None
    gas_conductivity: float | None = None
    pressure_mbar: float | None = None
    raman_scale: float | None = IF_ANY
    columns: dict[str, Vector]
    rows: Counts | None = IF_ANY
    time_us: Annotated[Array, stored_as(list[float])] | None = IF_ANY
    waveform: Polyline | Sine | None = IF_ANY

    @classmethod
    def of(cls, measurement: Measurement) -> Self:
        """Return the section of a measurement."""
        columns = {QUANTITIES[name].symbol: values for name, values in measurement.columns.items()}
        return cls.holding(measurement, columns=columns)

    @model_validator(mode="after")
    def _columns_belong_together(self, info: ValidationInfo) -> Self:
        where = f"{info.context}: data"
        if "V_b" not in self.columns:
            raise InputError(f"{where}: columns: V_b is missing")
        count, waveform = self.columns["V_b"].size, self.waveform
        largest = 1e9  # in the units inside
        for name, values in {**self.columns, "rows": self.rows, "time_us": self.time_us}.items():
            if values is None:
                continue
            _array(values, (count,), f"{where}: {name}")
            least = 0.0 if name.startswith("d") else -largest
            wrong = values[(values <= least) | (values > largest)]
            if wrong.size:
                raise InputError(
                    f"{where}: {name}: found {wrong[0]:g}, expected more than {least:g} and at "
                    f"most {largest:g}"
                )
        if (waveform is None) != (self.time_us is None) or (
            isinstance(waveform, Polyline) and len(waveform.times) != len(waveform.volts)
        ):
            raise InputError(f"{where}: waveform: expected the one that belongs to the times")
        return self

    def measurement(self) -> Measurement:
        """Return the measurement."""
        columns = {
            column.name: self.columns[column.symbol]
            for column in MEASURED
            if column.symbol in self.columns
        }
        return Measurement(**as_attributes(columns), **self.attributes_of(Measurement))


class CorrelationSection(Section):
    """The correlation of the parameters that were varied."""

    names: list[str]
    matrix: Correlations


@dataclass(frozen=True)
class FittedParameter:
    """A parameter of an estimate.

    `stderr` is None if the parameter was fixed or its error could not be estimated.
    """

    value: float
    stderr: Annotated[float, Field(ge=0)] | None
    unit: str
    vary: bool

    def __str__(self) -> str:
        """Return the value with its error, as far as there is one, and its unit."""
        return with_unit(value_with_error(self.value, self.stderr), self.unit)


class ParameterFields(Section):
    """What a file holds of the parameters; nothing of a calibration by the paper's rule."""

    parameters: dict[str, FittedParameter] | None = None
    correlation: CorrelationSection | None = None
    observables: tuple[Observable, ...] = ()
    inversion_temperature_K: Number = np.nan
    inversion_temperature_stderr_K: Number = np.nan
    residual_rms: dict[str, float] = Field(default_factory=dict)
    evaluations: int = 0
    steps: int = 0
    seconds: Annotated[float, PlainSerializer(lambda seconds: round(seconds, 3))] = 0.0
    options: (
        Annotated[FitOptions, WrapValidator(_options), PlainSerializer(FitOptions.values)] | None
    ) = None
    common_noise_covariance: Annotated[Array, stored_as(list[list[Number]], _matrix)] | None = None
    sum_of_squares: Number = np.nan
    band: Annotated[dict[str, Vector], AfterValidator(_band)] | None = None


class PulseSection(Section):
    """What a file holds of a pulse."""

    length_us: float
    period_us: float | None = None
    table: Columns
    budget_K: dict[str, Vector]

    @classmethod
    def of(cls, pulse: PulseCalibration) -> Self:
        """Return the section of a pulse."""
        table = {name: pulse.tabulated[name] for name in PULSE_COLUMNS}
        return cls.holding(pulse.timing, table=table, **pulse.tabulated.budgets)

    @model_validator(mode="after")
    def _belongs_together(self, info: ValidationInfo) -> Self:
        where = f"{info.context}: pulse"
        _check_rows(self.table, {"budget_K": self.budget_K}, "height", "peak_K", where)
        try:
            PulseTiming(self.length_us, self.period_us)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        return self

    def pulse(self) -> PulseCalibration:
        """Return what was written."""
        table = _table(self.table, {"budget_K": self.budget_K}, PULSE_COLUMNS, "height")
        return PulseCalibration(PulseTiming(self.length_us, self.period_us), table)


class IntervalSection(Section):
    """What the Monte Carlo method says of a budget; no ends where it failed."""

    trials: int
    low_K: Number
    high_K: Number
    tolerance_K: Number


class TipFields(Section):
    """What a file holds of the tip; nothing of a fit.

    Beside what an `Estimate` has: whether the knee was measured, the largest
    errors in the table, all in all and by source, and what follows from the budget for 95 %.
    """

    route: Literal["power law", "probe", "fit in vacuum", "fit in air"] | None = None
    medium: str = ""
    power_law: Annotated[PowerLaw, stored_as(dict[str, float], _law, PowerLaw.values)] | None = None
    power_law_residual_K: Number = np.nan
    k: Number = np.nan
    k_stderr: StandardError = np.nan
    # beside numbers, whether it was measured
    knee: Annotated[dict[str, Number], PlainSerializer(dict)] = Field(default_factory=dict)
    tip_temperature_uncertainty_K: StandardError = np.nan
    uncertainty_budget_K: dict[str, Number] = Field(default_factory=dict)
    base_temperature_K: Number = np.nan
    table: Columns | None = None
    budget_K: dict[str, Vector] = Field(default_factory=dict)
    apex_budget_K: dict[str, Vector] | None = IF_ANY
    measured_rms_K: Number = np.nan
    pulse: PulseSection | None = IF_ANY
    gum: list[BudgetRow] | None = IF_ANY
    gum_correlation: Correlations | None = IF_ANY
    gum_bias_V: float | None = IF_ANY
    gum_of: BudgetOf | None = IF_ANY
    effective_dof: Number | None = IF_ANY
    coverage_factor: float | None = IF_ANY
    expanded_uncertainty_K: float | None = IF_ANY
    gum_monte_carlo: IntervalSection | None = IF_ANY
    gum_linear: bool | None = IF_ANY

    @property
    def budgets(self) -> dict[str, dict[str, Array]]:
        """The errors of the table by source."""
        own = {"budget_K": self.budget_K, "apex_budget_K": self.apex_budget_K}
        return {name: budget for name, budget in own.items() if budget is not None}

    @field_serializer("power_law")
    def _with_threshold(self, law: PowerLaw | None) -> dict[str, float] | None:
        return None if law is None else law.values(self.base_temperature_K)

    @staticmethod
    def values_of(estimate: Any) -> dict[str, Any]:
        """Return the values of a calibration that it has not as they are, by field."""
        table, stated = estimate.tip_table, estimate.gum
        values: dict[str, Any] = {
            "power_law_residual_K": estimate.law_residual_K,
            "knee": asdict(estimate.knee) | {"measured": estimate.knee_measured},
            "uncertainty_budget_K": {
                name: part.max() for name, part in table.budgets["budget_K"].items()
            },
            "table": {name: table[name] for name in estimate.columns},
            "pulse": None if estimate.pulse is None else PulseSection.of(estimate.pulse),
            "gum": None,
            **table.budgets,
        }
        if stated is None:
            return values
        budget, interval, section = stated.budget, stated.monte_carlo, None
        if interval is not None:
            ends = {"low_K": interval.low, "high_K": interval.high}
            section = IntervalSection.holding(interval, **ends, tolerance_K=budget.tolerance)
        return values | {
            "gum": list(budget.inputs),
            "gum_correlation": budget.correlation,
            "gum_bias_V": stated.bias_V,
            "gum_of": stated.of,
            "effective_dof": budget.dof,
            "coverage_factor": budget.coverage_factor(),
            "expanded_uncertainty_K": budget.expanded(),
            "gum_monte_carlo": section,
            "gum_linear": stated.linear,
        }

    def check(self, path: str) -> None:
        """Refuse a table, a budget or a pulse whose numbers do not belong together."""
        assert self.table is not None
        _check_rows(self.table, self.budgets, "bias", "tip_K", path)
        if self.gum is not None and self.gum_bias_V not in self.table["bias_V"]:
            raise InputError(f"{path}: gum_bias_V: expected the bias of a row of the table")
        size, correlation = len(self.gum or []), self.gum_correlation
        if size and correlation is not None and correlation.shape != (size, size):
            raise InputError(f"{path}: gum_correlation: expected numbers in {size} × {size} places")

    def of_table(self) -> dict[str, Any]:
        """Return what an estimate has of the tip, by attribute."""
        assert self.table is not None
        more = [name for name in ("total_power_mW", *OF_THE_CONTACT) if name in self.table]
        table = _table(self.table, self.budgets, [*TABLE_COLUMNS, *more])
        knee = {name: self.knee[name] for name in Knee.__dataclass_fields__ if name in self.knee}
        return {
            "law_residual_K": self.power_law_residual_K,
            "knee": Knee(**knee),
            "tabulated": table,
            "pulse": None if self.pulse is None else self.pulse.pulse(),
            "gum": self._budget(table),
        }

    def _budget(self, table: TipTable) -> TemperatureBudget | None:
        if self.gum is None:
            return None
        row = table.rows(table["bias_V"] == self.gum_bias_V)
        tried, of, interval = self.gum_monte_carlo, self.gum_of or "tip", None
        if tried is not None:
            interval = CoverageInterval(tried.trials, tried.low_K, tried.high_K)
        budget, value = Budget(tuple(self.gum), self.gum_correlation), row[f"{of}_K"].item()
        return TemperatureBudget(
            budget, row["bias_V"].item(), value, limits_of(row, of), of, interval
        )


class EstimateFile(ParameterFields, TipFields):
    """What the file of an estimate holds: the schema that it is written and read by.

    One that does not say whether its data are described has a reason if they are not. ``request``
    is what a batch was asked that the estimate is of.
    """

    describes_data: bool | None = True
    reason: str = ""
    priors: dict[str, PriorUse] = Field(default_factory=dict)
    probe: Annotated[Probe, stored_as(dict[str, dict[str, Any]], _probe, Probe.sections)]
    data: MeasurementSection
    weights: dict[str, Vector] | None = IF_ANY
    notes: list[str]
    request: dict[str, JsonValue] | None = IF_ANY
    software: str = f"hotlever {__version__}"

    #: What is of the parameters alone, and of the tip alone.
    of_parameters: ClassVar[frozenset[str]] = frozenset(ParameterFields.model_fields)
    of_tip: ClassVar[frozenset[str]] = frozenset(TipFields.model_fields)

    @classmethod
    def of(cls, estimate: Any, request: dict[str, JsonValue] | None = None) -> Self:
        """Return what the file of an estimate holds."""
        of_tip = TipFields.values_of(estimate) if estimate.route else dict.fromkeys(cls.of_tip)
        correlation = CorrelationSection.model_construct(
            names=estimate.names, matrix=estimate.correlation
        )
        return cls.holding(
            estimate,
            **of_tip,
            band=estimate.band_columns,
            correlation=correlation if estimate.names else None,
            data=MeasurementSection.of(estimate.measurement),
            request=request,
        )

    @classmethod
    def read(cls, path: str | os.PathLike[str], kind: str) -> Self:
        """Read a JSON file of a kind, a fit or a calibration.

        Raises
        ------
        InputError
            If it cannot be read or holds something else; the text names the key.
        """
        command, keys = {
            "fit": (
                "hotlever fit",
                "parameters correlation observables options common_noise_covariance band",
            ),
            "calibration": (
                "hotlever calibrate",
                "route medium power_law power_law_residual_K k k_stderr knee table",
            ),
        }[kind]
        content, where = read_json(path), f"{path}: not a {kind} file ({command} -o)"
        for key in keys.split():
            if key not in content or (content[key] is None and kind == "fit"):
                raise InputError(f"{where}: {key} is missing")
        try:
            return cls.model_validate(_as_of_now(content, str(path)), context=path)
        except ValidationError as error:
            raise explained(error, cls, where) from None

    @model_validator(mode="after")
    def _belongs_together(self, info: ValidationInfo) -> Self:
        path, in_time = str(info.context), self.data.time_us is not None
        of_probe = [*parameters_of(self.probe, anywhere=True, in_time=True), *SCALES]
        for name in self.priors:
            if name not in of_probe:
                raise unknown_name("prior", name, of_probe, f"{path}: priors")
        lowest = self.probe.lowest_bias_V if not in_time else -np.inf
        if np.isfinite(lowest) and not np.all(self.data.columns["V_b"] >= lowest):
            raise InputError(f"{path}: data: V_b: expected biases of {lowest:g} or more")
        if self.options is not None:
            where = f"{path}: options"
            try:
                self.options.of(self.probe, in_time=in_time)
            except InputError as error:
                raise InputError(f"{where}: {error}") from None
            priors = priors_of(self.options.priors, self.probe, f"{where}: priors", in_time=in_time)
            self.options = replace(self.options, priors=priors)
        for name, weights in (self.weights or {}).items():
            if name not in FITTED:
                raise unknown_name("observable", name, FITTED, f"{path}: weights")
            _array(weights, self.data.columns["V_b"].shape, f"{path}: weights: {name}")
        if self.correlation is not None:
            self._check_parameters(path, in_time)
        if self.table is not None:
            self.check(path)
        return self

    def _check_parameters(self, path: str, in_time: bool) -> None:
        assert self.correlation is not None
        names, parameters = self.correlation.names, self.parameters or {}
        if not parameters.keys() >= set(names):
            raise InputError(f"{path}: parameters and correlation do not belong together")
        for name in names:
            parameter_of(self.probe, name, f"{path}: correlation", in_time=in_time)
            stated, of_probe = parameters[name].value, self.probe.values([name]).item()
            if not np.isclose(stated, of_probe, rtol=1e-9, atol=0.0):
                raise InputError(
                    f"{path}: parameters: {name} = {stated:g}, expected that of the probe, "
                    f"{of_probe:g}"
                )
        if self.band is not None and in_time != ("time_us" in self.band):
            raise InputError(f"{path}: band: expected time_us in it of data in time, and only then")
        square, common = (len(names),) * 2, self.common_noise_covariance
        common = np.zeros(square) if common is None else common
        _array(self.correlation.matrix, square, f"{path}: correlation")
        _array(common, square, f"{path}: common_noise_covariance")

    def content(self) -> dict[str, Any]:
        """Return what is written, in plain values: first of the tip, then of the parameters."""
        left_out = set[str]()
        if self.table is None:
            left_out |= self.of_tip
        if self.correlation is None:
            left_out |= self.of_parameters
        values = without_nan(self.model_dump(exclude=left_out))

        def part(entry: tuple[str, Any]) -> int:
            return (entry[0] not in self.of_tip) + (
                entry[0] not in self.of_tip | self.of_parameters
            )

        return dict(sorted(values.items(), key=part))

    def attributes(self, names: Sequence[str]) -> dict[str, Any]:
        """Return what the file tells of some attributes of an estimate, by name."""
        attributes = {
            name: getattr(self, name) for name in names if name in type(self).model_fields
        } | {
            "band_columns": self.band or {},
            "measurement": self.data.measurement(),
            "converged": self.describes_data is not None,
            "reason": self.reason or ("" if self.describes_data else "the file does not say why"),
        }
        if self.correlation is not None:
            varied, parameters = self.correlation.names, self.parameters or {}
            stderr = np.array([parameters[name].stderr for name in varied], dtype=float)
            attributes |= {
                "names": varied,
                "covariance": self.correlation.matrix * np.outer(stderr, stderr),
            }
        # what the file has nothing of is as an estimate has it by default
        absent = {name for name in self.of_parameters if attributes.get(name) is None}
        if self.table is None:
            absent |= self.of_tip
        else:
            attributes |= self.of_table()
        return {name: value for name, value in attributes.items() if name not in absent}


def rising_band(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return the columns of a band with one row per bias or, with ``time_us``, time; rising."""
    along = columns["time_us" if "time_us" in columns else "bias_V"]
    _, rows = np.unique(along, return_index=True)
    return {name: values[rows] for name, values in columns.items()}


def _check_rows(
    columns: Mapping[str, Array],
    budgets: Mapping[str, Mapping[str, Array]],
    along: str,
    tip: str,
    where: str,
) -> None:
    """Refuse what a file holds in place of a table with its budgets; `where` names the file.

    Raises
    ------
    InputError
        If its rows do not rise or have no tip temperature, or a budget is not one of them.
    """
    rising, sources = columns.get(f"{along}_V", np.array([])), budgets["budget_K"].keys()
    if not rising.size or not sources or not np.all(np.diff(rising) > 0):
        raise InputError(
            f"{where}: table: expected rows of rising {along}, and a budget of their errors"
        )
    if not np.isfinite(columns.get(tip, np.nan)).any():
        raise InputError(f"{where}: table: expected a tip temperature ({tip}) in some rows")
    for name, parts in budgets.items():
        if parts.keys() != sources:
            raise InputError(f"{where}: {name}: expected the sources {', '.join(sources)}")
        for source, errors in parts.items():
            _array(errors, rising.shape, f"{where}: {name}: {source}")


def _table(
    columns: Mapping[str, Array],
    budgets: Mapping[str, Mapping[str, Array]],
    names: Sequence[str],
    along: str = "bias",
) -> TipTable:
    """Return the table that a file holds; columns are NaN that an older file has not."""
    unknown = np.full_like(columns[f"{along}_V"], np.nan)
    own = {name: columns.get(name, unknown) for name in names}
    return TipTable(own, budgets, along)


# --- reading ------------------------------------------------------------------------------------


def _as_of_now(content: dict[str, Any], path: str) -> dict[str, Any]:
    """Return what a file of version 1 or 2 holds as one of this version holds it.

    The weights of a fit stood with its data, as rows in the order of its observables; zeros could
    drift, and a fit that let them cannot be taken up again. A calibration had no options; its
    priors were what was known before.
    """
    content, data, options = dict(content), content.get("data"), content.get("options")
    if isinstance(data, dict) and "weights" in data:
        rows, names = data["weights"], content.get("observables")
        if not isinstance(rows, list) or not isinstance(names, list) or len(rows) != len(names):
            raise InputError(f"{path}: data: weights: expected a row for each observable")
        content["weights"] = dict(zip(map(str, names), rows, strict=True))
    if isinstance(options, dict) and "drift" in options:
        if options["drift"]:
            raise InputError(f"{path}: options: zeros that drift are no part of fits now")
        content["options"] = {key: value for key, value in options.items() if key != "drift"}
    return content
