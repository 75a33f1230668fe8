"""What fit and calibration files have in common: priors, and the measurement."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, WrapValidator

from hotlever.errors import InputError
from hotlever.files import read_json
from hotlever.lever.transient.waveform import Polyline, Sine
from hotlever.measurement import COLUMNS, Measurement
from hotlever.probe import Circuit
from hotlever.probe.priors import Distribution, PriorUse
from hotlever.probe.surroundings import Medium
from hotlever.records import explained
from hotlever.types import Array

#: What else is kept of a measurement.
_NAMED = (
    *("path", "sha256", "series_resistance_ohm", "base_temperature_K", "medium"),
    *("gas_conductivity", "pressure_mbar"),
)
_OR_NOTHING = WrapValidator(lambda found, check: np.nan if found is None else check(found))
# A number, and a standard error; NaN where the file has none.
Number = Annotated[float, _OR_NOTHING]
Spread = Annotated[float, Field(ge=0), _OR_NOTHING]


class Section(BaseModel):
    """A part of a result file; what is not known is left alone."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    @classmethod
    def read(cls, path: str | os.PathLike[str], kind: str) -> Self:
        """Read a JSON file that must hold such a section.

        Raises
        ------
        InputError
            If it cannot be read or holds something else; the text names the key.
        """
        try:
            return cls.model_validate(read_json(path))
        except ValidationError as error:
            raise explained(error, cls, f"{path}: not a {kind} file") from None


class UsedPrior(Section):
    """A `PriorUse` as result files hold it."""

    value: float
    spread: float
    posterior_value: float
    posterior_spread: Number
    distribution: Distribution = "normal"


def prior_uses(sections: Mapping[str, UsedPrior]) -> dict[str, PriorUse]:
    """Return what priors said and what the data made of it, of the sections of a file."""
    return {name: PriorUse(**one.model_dump()) for name, one in sections.items()}


def without_spread(priors: Mapping[str, PriorUse]) -> dict[str, PriorUse]:
    """Return priors without the spread that data leave, of data that no lever describes."""
    return {name: replace(use, posterior_spread=np.nan) for name, use in priors.items()}


class EmbeddedMeasurement(Section):
    """A measurement as fit and calibration files hold it."""

    path: str = ""
    sha256: str = ""
    series_resistance_ohm: float | None = None
    base_temperature_K: float | None = None
    medium: Medium | None = None
    gas_conductivity: float | None = None
    pressure_mbar: float | None = None
    columns: dict[str, list[Number]]
    rows: list[Annotated[int, Field(ge=1)]] | None = None
    time_us: list[float] | None = None
    waveform: Polyline | Sine | None = None

    def measurement(self, where: str, circuit: Circuit) -> Measurement:
        """Return the measurement, made in a circuit; `where` names the file in an error.

        Raises
        ------
        InputError
            If its columns do not belong together, or a bias is missing, or negative at rest where
            only the swept supply heats.
        """
        if "V_b" not in self.columns:
            raise InputError(f"{where}: columns: V_b is missing")
        rows = len(self.columns["V_b"])
        columns: dict[str, Any] = {
            attribute: array(self.columns.get(name, [np.nan] * rows), (rows,), f"{where}: {name}")
            for name, (attribute, _) in COLUMNS.items()
            if name in self.columns or name not in ("dI_h", "dV_r")
        }
        if self.time_us is not None:
            columns["time_us"] = array(self.time_us, (rows,), f"{where}: time_us")
            if not isinstance(self.waveform, Polyline | Sine) or (
                isinstance(self.waveform, Polyline)
                and len(self.waveform.times) != len(self.waveform.volts)
            ):
                raise InputError(f"{where}: waveform: expected the one that belongs to the times")
            columns["waveform"] = self.waveform
        elif circuit.starts_cold and not np.all(columns["bias_V"] >= 0):
            raise InputError(f"{where}: V_b: expected biases of 0 or more")
        if self.rows is not None:
            columns["rows"] = array(self.rows, (rows,), f"{where}: rows")
        return Measurement(**columns, **{name: getattr(self, name) for name in _NAMED})


def embed(measurement: Measurement) -> dict[str, Any]:
    """Return the content of an `EmbeddedMeasurement`."""
    columns = {name: getattr(measurement, attribute) for name, (attribute, _) in COLUMNS.items()}
    present = {name: values.tolist() for name, values in columns.items() if values is not None}
    averaged = {} if measurement.rows is None else {"rows": measurement.rows.astype(int).tolist()}
    named = {name: getattr(measurement, name) for name in _NAMED}
    history: dict[str, Any] = {}
    if measurement.time_us is not None:
        waveform: Any = measurement.waveform
        history = {"time_us": measurement.time_us.tolist(), "waveform": asdict(waveform)}
    return {**named, "columns": present, **averaged, **history}


def array(values: Sequence[Any], shape: tuple[int, ...], where: str) -> Array:
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
