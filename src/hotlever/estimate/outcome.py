"""What fits and calibrations have in common: the verdict on the data, and the file of a result.

A file is a pydantic model: its schema states what is written and read. What stands in it as it is
taken from a result by name, what stands in another form has a type that says how.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Annotated, Any, ClassVar, Generic, Self, TypeVar

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from hotlever import __version__
from hotlever.errors import InputError, unknown_name
from hotlever.files import json_text, read_json, without_nan, write_text
from hotlever.lever.transient.waveform import Polyline, Sine
from hotlever.measurement import MEASURED, Measurement
from hotlever.measurement.data import OPTIONAL
from hotlever.probe import Probe
from hotlever.probe.priors import SCALES, PriorUse
from hotlever.probe.probe_parameters import parameters_of
from hotlever.probe.surroundings import Medium
from hotlever.records import Number, explained, stored_as
from hotlever.types import Array

#: No column of a measurement has larger values, in the units inside.
_LARGEST = 1e9
#: What a correlation of 1 may be off by.
_ROUNDED = 1e-6


def array(values: Sequence[Any] | Array, shape: tuple[int, ...], where: str) -> Array:
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
    matrix = _matrix(rows)
    if np.any(abs(matrix) > 1.0 + _ROUNDED) or np.any(abs(np.diag(matrix) - 1.0) > _ROUNDED):
        raise ValueError("expected numbers from -1 to 1, and 1 along the diagonal")
    return matrix


def _probe(sections: dict[str, dict[str, Any]], info: ValidationInfo) -> Probe:
    return Probe.from_sections(sections, f"{info.context}: probe")


def _columns(rows: list[dict[str, float]]) -> dict[str, Array]:
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: np.array([row.get(name) for row in rows], dtype=float) for name in names}


def _rows(columns: dict[str, Array]) -> list[dict[str, float]]:
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in values]


# Arrays of one and of two dimensions, NaN where there is nothing.
Vector = Annotated[Array, stored_as(list[Number])]
Matrix = Annotated[Array, stored_as(list[list[Number]], _matrix)]
Correlations = Annotated[Array, stored_as(list[list[Number]], _correlations)]
# Columns of a table, of which files hold the rows.
Columns = Annotated[dict[str, Array], stored_as(list[dict[str, Number]], _columns, _rows)]
_Count = Annotated[float, Field(ge=1, multiple_of=1)]
_Counts = Annotated[
    Array, stored_as(list[_Count], write=lambda counts: counts.astype(int).tolist())
]
_Times = Annotated[Array, stored_as(list[float])]
_Probe = Annotated[Probe, stored_as(dict[str, dict[str, Any]], _probe, Probe.sections)]
# What is not written where there is none.
IF_ANY: Any = Field(None, exclude_if=lambda value: value is None)


# A fit or a calibration.
Result = TypeVar("Result", bound="Outcome")


class Section(BaseModel):
    """A part of a result file; what is not known is left alone.

    While a file is read its path is pydantic's context, for errors.
    """

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

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
    """A measurement as fit and calibration files hold it."""

    path: str = ""
    sha256: str = ""
    series_resistance_ohm: float | None = None
    base_temperature_K: float | None = None
    medium: Medium | None = None
    gas_conductivity: float | None = None
    pressure_mbar: float | None = None
    raman_scale: float | None = IF_ANY
    columns: dict[str, Vector]
    rows: _Counts | None = IF_ANY
    time_us: _Times | None = IF_ANY
    waveform: Polyline | Sine | None = IF_ANY

    @classmethod
    def of(cls, measurement: Measurement, **others: Any) -> Self:
        """Return the section of a measurement."""
        columns = {
            column.symbol: values
            for column in MEASURED
            if (values := getattr(measurement, column.name)) is not None
        }
        return cls.holding(measurement, columns=columns, **others)

    @model_validator(mode="after")
    def _columns_belong_together(self, info: ValidationInfo) -> Self:
        where = f"{info.context}: data"
        if "V_b" not in self.columns:
            raise InputError(f"{where}: columns: V_b is missing")
        count, waveform = self.columns["V_b"].size, self.waveform
        for name, values in {**self.columns, "rows": self.rows, "time_us": self.time_us}.items():
            if values is None:
                continue
            array(values, (count,), f"{where}: {name}")
            least = 0.0 if name.startswith("d") else -_LARGEST
            wrong = values[(values <= least) | (values > _LARGEST)]
            if wrong.size:
                raise InputError(
                    f"{where}: {name}: found {wrong[0]:g}, expected more than {least:g} and at "
                    f"most {_LARGEST:g}"
                )
        if (waveform is None) != (self.time_us is None) or (
            isinstance(waveform, Polyline) and len(waveform.times) != len(waveform.volts)
        ):
            raise InputError(f"{where}: waveform: expected the one that belongs to the times")
        return self

    def measurement(self) -> Measurement:
        """Return the measurement."""
        nothing, columns = np.full(self.columns["V_b"].size, np.nan), dict[str, Any]()
        for column in MEASURED:
            columns[column.name] = None if column.name in OPTIONAL else nothing
            if column.symbol in self.columns:
                columns[column.name] = self.columns[column.symbol]
        return Measurement(**self.attributes_of(Measurement), **columns)


class ResultFile(Section, Generic[Result]):
    """What every result file holds; see `hotlever.estimate.outcome.Outcome`.

    One that does not say whether its data are described has a reason if they are not. ``request``
    is what a batch was asked that the result is of.
    """

    describes_data: bool | None = True
    reason: str = ""
    priors: dict[str, PriorUse] = Field(default_factory=dict)
    probe: _Probe
    data: MeasurementSection
    notes: list[str]
    request: dict[str, JsonValue] | None = IF_ANY
    software: str = f"hotlever {__version__}"

    @classmethod
    def read(cls, path: str | os.PathLike[str], kind: str) -> Self:
        """Read a JSON file of a kind.

        Raises
        ------
        InputError
            If it cannot be read or holds something else; the text names the key.
        """
        try:
            return cls.model_validate(read_json(path), context=path)
        except ValidationError as error:
            command = {"calibration": "calibrate"}.get(kind, kind)
            where = f"{path}: not a {kind} file (hotlever {command} -o)"
            raise explained(error, cls, where) from None

    @model_validator(mode="after")
    def _priors_are_of_the_probe(self, info: ValidationInfo) -> Self:
        of_probe = [*parameters_of(self.probe, anywhere=True, in_time=True), *SCALES]
        for name in self.priors:
            if name not in of_probe:
                raise unknown_name("prior", name, of_probe, f"{info.context}: priors")
        return self

    @model_validator(mode="after")
    def _bias_heats_the_lever(self, info: ValidationInfo) -> Self:
        lowest = self.probe.lowest_bias_V if self.data.time_us is None else -np.inf
        if np.isfinite(lowest) and not np.all(self.data.columns["V_b"] >= lowest):
            raise InputError(f"{info.context}: data: V_b: expected biases of {lowest:g} or more")
        return self

    def attributes_of(self, kind: Any) -> dict[str, Any]:
        """Return what it holds of an outcome, by attribute."""
        reason = self.reason or ("" if self.describes_data else "the file does not say why")
        return super().attributes_of(kind) | {
            "measurement": self.data.measurement(),
            "converged": self.describes_data is not None,
            "reason": reason,
        }

    @abstractmethod
    def result(self) -> Result:
        """Return the result, to go on with as if it had just been made."""

    def content(self) -> dict[str, Any]:
        """Return what is written, in plain values: first what only files of this kind hold."""
        values = without_nan(self.model_dump())
        own = values.keys() - ResultFile.model_fields.keys()
        return dict(sorted(values.items(), key=lambda entry: entry[0] not in own))


class Outcome(ABC):
    """What was estimated of a lever; without errors unless the data are described.

    Errors about a lever that does not show the data would not hold.

    Attributes
    ----------
    probe : Probe
    measurement : Measurement
    priors : dict of str to PriorUse
    reason : str
        Why the data are not described by any such lever, or why that is not known; empty if they
        are.
    converged : bool
        Whether the search came to its end.
    notes : list of str
    """

    #: What no lever is like that shows data which are not described.
    lever: ClassVar[str] = "such lever"
    probe: Probe
    measurement: Measurement
    priors: dict[str, PriorUse]
    reason: str
    converged: bool
    notes: list[str]

    def __post_init__(self) -> None:
        if self.describes_data:
            return
        unknown = {name: replace(use, posterior_spread=np.nan) for name, use in self.priors.items()}
        for name, value in {"priors": unknown, **self._without_errors()}.items():
            object.__setattr__(self, name, value)

    @abstractmethod
    def _without_errors(self) -> dict[str, Any]:
        """Return the other attributes that hold errors, without any."""

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
        return f"no {self.lever} shows these data: {self.reason}"

    def need_described(self, what: str) -> None:
        """Raise an error unless the data are described, for what has no meaning otherwise.

        Raises
        ------
        InputError
            If they are not.
        """
        if not self.describes_data:
            raise InputError(f"{what}: expected data that a lever describes; {self.doubt}")

    @abstractmethod
    def file(self, request: dict[str, JsonValue] | None = None) -> ResultFile[Any]:
        """Return what the result file holds; `request` is what a batch was asked."""

    def content(self, request: dict[str, JsonValue] | None = None) -> dict[str, Any]:
        """Return the content of the result file in plain values."""
        return self.file(request).content()

    def to_json(self, request: dict[str, JsonValue] | None = None) -> str:
        """Return the text of the result file."""
        return json_text(self.content(request))

    def write(
        self, path: str | os.PathLike[str], request: dict[str, JsonValue] | None = None
    ) -> None:
        """Write the result file, whole or not at all."""
        write_text(path, self.to_json(request))
