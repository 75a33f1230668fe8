"""A calibration: its table, its power law, its error budget, and its file."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Self

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike
from pydantic import (
    Field,
    JsonValue,
    PlainSerializer,
    ValidationInfo,
    field_serializer,
    model_validator,
)

from hotlever.datasets import frame_text
from hotlever.errors import InputError, unknown_name
from hotlever.estimate.knee import Knee
from hotlever.estimate.outcome import (
    IF_ANY,
    Columns,
    MeasurementSection,
    Outcome,
    ResultFile,
    Vector,
    array,
)
from hotlever.estimate.power_law import PowerLaw
from hotlever.estimate.pulses import PulseCalibration, PulseSection
from hotlever.estimate.tip_table import (
    BUDGETS,
    OF_THE_CONTACT,
    STATED,
    TABLE_COLUMNS,
    TABLES_BY,
    TOTAL_POWER,
    budgets_of,
    check_rows,
    even_rows,
    interpolated,
    stored_table,
)
from hotlever.estimate.uncertainty_budget import BudgetFields, TemperatureBudget
from hotlever.measurement import Measurement
from hotlever.probe import Circuit, Probe
from hotlever.probe.priors import PriorUse
from hotlever.quantities import FITTED
from hotlever.records import Number, StandardError, stored_as
from hotlever.text import value_with_error
from hotlever.types import Array


@dataclass(frozen=True)
class Calibration(Outcome):
    """The tip temperature of one lever against what its instrument shows.

    Where the data are not described by any such lever, the numbers are those of the nearest one and
    no estimates: standard errors, limits and budget are NaN, and there is no pulse.

    Attributes
    ----------
    route : str
        What it rests on: ``power law``, ``probe``, ``fit in vacuum`` or ``fit in air``.
    medium : str
        Of the model whose temperatures are used.
    power_law : PowerLaw or None
        In vacuum, of the estimated lever or as given; T_tip is the law's value at P_l / k,
        approximately (see `law_residual_K`). None with held supplies, or where the power turns
        along the branch: the tip then follows from no single power.
    law_residual_K : float
        Largest difference of the law from the model it was fitted to; 0 for a given law.
    k, k_stderr : float
        Power of the knee over the threshold of the power law; NaN without a knee or a law.
    knee : Knee
        Of the estimated lever, or as measured; NaN where there is none, or all but its power.
    knee_tip_K : float
        Tip temperature there.
    table : xarray.Dataset
        ``TABLE_COLUMNS`` on the dimension ``bias``, evenly spaced over the measured range, with
        more rows where the tip rises by more than 10 K from one to the next; and ``budget_K``, the
        standard error by ``source``. With held supplies, what is shown is of the swept one, and
        `TOTAL_POWER` that of all. Of a tip in contact it has `OF_THE_CONTACT` too, and
        ``apex_budget_K``.
    priors : dict of str to PriorUse
        What was known of each parameter before and after, by name.
    reason : str
        Why the data are not described by any such lever, or why that is not known; empty if they
        are.
    measured_rms_K : float
        Rms of the measurement's own tip temperatures about the calibration; NaN if it has none.
    probe : Probe
    measurement : Measurement
    notes : list of str
    pulse : PulseCalibration, optional
        Of the same lever in a pulse.
    converged : bool
        Whether the search for the lever came to its end.
    gum : TemperatureBudget, optional
        The uncertainty budget of one row of the table; none by the paper's rule.
    weights : dict of str to ndarray, optional
        What differences of data and lever were multiplied by, by observable, (rows of the
        measurement,): one over their standard errors, 0 for what was left out. None by the paper's
        rule, and without priors.
    """

    route: str
    medium: str
    power_law: PowerLaw | None
    law_residual_K: float
    k: float
    k_stderr: float
    knee: Knee
    knee_tip_K: float
    table: xr.Dataset
    measured_rms_K: float
    probe: Probe
    measurement: Measurement
    priors: dict[str, PriorUse] = field(default_factory=dict)
    reason: str = ""
    notes: list[str] = field(default_factory=list)
    pulse: PulseCalibration | None = None
    converged: bool = True
    gum: TemperatureBudget | None = None
    weights: dict[str, Array] | None = None

    lever = "lever like this one"

    def _without_errors(self) -> dict[str, Any]:
        every = (*STATED, *OF_THE_CONTACT[1::2], *BUDGETS)
        errors = [name for name in every if name in self.table]
        unknown = {name: xr.full_like(self.table[name], np.nan) for name in errors}
        knee = self.knee
        return {
            "table": self.table.assign(unknown),
            "knee": Knee(knee.lever_V, knee.current_mA, knee.power_mW, knee.bias_V),
            "k_stderr": np.nan,
            "pulse": None,
            "gum": None,
        }

    @property
    def base_temperature_K(self) -> float:
        """Temperature without power (K)."""
        return self.probe.circuit.base_temperature_K

    @property
    def tip_temperature_uncertainty_K(self) -> float:
        """Largest standard error of the tip temperature in the table (K)."""
        return float(np.fmax.reduce(self.table.tip_stderr_K.values))

    @property
    def knee_measured(self) -> bool:
        """Whether the knee lies in the measured range."""
        return self.knee.measured and bool(self.knee.bias_V <= self.table.bias_V.values[-1])

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
    def heating(self) -> xr.Dataset:
        """The rows of the table that have a tip temperature, from the coldest on."""
        rows = self.table.isel(bias=np.isfinite(self.table.tip_K.values))
        return rows.isel(bias=slice(int(np.argmin(rows.tip_K.values)), None))

    @property
    def columns(self) -> list[str]:
        """The columns of the table in a file."""
        names = (*TABLE_COLUMNS, TOTAL_POWER, *OF_THE_CONTACT)
        return [name for name in names if name in self.table]

    def __repr__(self) -> str:
        hottest = self.table.isel(bias=int(np.nanargmax(self.table.tip_K)))
        tip = value_with_error(hottest.tip_K.item(), hottest.tip_stderr_K.item())
        summary = self.doubt or f"{tip} K at {hottest.bias_V.item():.4g} V in {self.medium}"
        return f"<Calibration of {self.measurement.path or 'a measurement'}: {summary}>"

    def file(self, request: dict[str, JsonValue] | None = None) -> CalibrationFile:
        """Return what the calibration file holds."""
        budgets, gum = budgets_of(self.table), self.gum
        return CalibrationFile.holding(
            self,
            power_law_residual_K=self.law_residual_K,
            knee=vars(self.knee) | {"tip_K": self.knee_tip_K, "measured": self.knee_measured},
            uncertainty_budget_K={name: part.max() for name, part in budgets[BUDGETS[0]].items()},
            table={name: self.table[name].values for name in self.columns},
            **budgets,
            **({} if gum is None else BudgetFields.fields_of(gum)),
            data=MeasurementSection.of(self.measurement),
            request=request,
        )

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
        table = self.table if by == "bias" else self.heating
        rows = even_rows(table, self.columns, TABLES_BY[by][0], step)
        return frame_text(pd.DataFrame(rows), index=False, float_format="%.6g")


def rms(difference: Array) -> float:
    """Return the root mean square of what is known of a difference; NaN if nothing is."""
    present = difference[np.isfinite(difference)]
    return float(np.sqrt(np.mean(present**2))) if present.size else float("nan")


# --- its file -----------------------------------------------------------------------------------


def _law(values: dict[str, float], info: ValidationInfo) -> PowerLaw:
    coefficients = {name: value for name, value in values.items() if name != "threshold_K"}
    return PowerLaw.from_values(coefficients, f"{info.context}: power_law")


_Law = Annotated[PowerLaw, stored_as(dict[str, float], _law, PowerLaw.values)]
_Pulse = Annotated[
    PulseCalibration,
    stored_as(PulseSection, PulseSection.calibration, PulseCalibration.section),
]


class CalibrationFile(BudgetFields, ResultFile[Calibration]):
    """What a calibration file holds: the schema that it is written and read by.

    Beside what a `Calibration` has: of the knee ``tip_K`` and whether it was measured, and the
    largest errors in the table, all in all and by source.
    """

    route: Literal["power law", "probe", "fit in vacuum", "fit in air"]
    medium: str
    power_law: _Law | None
    power_law_residual_K: Number
    k: Number
    k_stderr: StandardError
    # beside numbers, whether it was measured
    knee: Annotated[dict[str, Number], PlainSerializer(dict)]
    tip_temperature_uncertainty_K: StandardError = np.nan
    uncertainty_budget_K: dict[str, Number] = Field(default_factory=dict)
    base_temperature_K: Number = np.nan
    table: Columns
    budget_K: dict[str, Vector]
    apex_budget_K: dict[str, Vector] | None = IF_ANY
    measured_rms_K: Number = np.nan
    pulse: _Pulse | None = IF_ANY
    weights: dict[str, Vector] | None = IF_ANY

    @property
    def _budgets(self) -> dict[str, dict[str, Array]]:
        own = zip(BUDGETS, (self.budget_K, self.apex_budget_K), strict=True)
        return {name: budget for name, budget in own if budget is not None}

    @field_serializer("power_law")
    def _with_threshold(self, law: PowerLaw | None) -> dict[str, float] | None:
        return None if law is None else law.values(self.base_temperature_K)

    @model_validator(mode="after")
    def _rows_belong_together(self, info: ValidationInfo) -> Self:
        check_rows(self.table, self._budgets, "bias", "tip_K", str(info.context))
        if self.gum is not None and self.gum_bias_V not in self.table["bias_V"]:
            raise InputError(f"{info.context}: gum_bias_V: expected the bias of a row of the table")
        for name, weights in (self.weights or {}).items():
            if name not in FITTED:
                raise unknown_name("observable", name, FITTED, f"{info.context}: weights")
            array(weights, self.data.columns["V_b"].shape, f"{info.context}: weights: {name}")
        return self

    def result(self) -> Calibration:
        """Return the calibration, to go on with as if it had just been made."""
        knee = {name: self.knee[name] for name in Knee.__dataclass_fields__ if name in self.knee}
        more = [name for name in (TOTAL_POWER, *OF_THE_CONTACT) if name in self.table]
        table = stored_table(self.table, self._budgets, [*TABLE_COLUMNS, *more])
        return Calibration(
            law_residual_K=self.power_law_residual_K,
            knee_tip_K=self.knee.get("tip_K", np.nan),
            **self.attributes_of(Calibration)
            | {
                "knee": Knee(**knee),
                "table": table,
                "gum": self.temperature_budget(table),
            },
        )


def read_calibration(path: str | os.PathLike[str]) -> Calibration:
    """Read a calibration file: all of the calibration, to go on with as if just made.

    Raises
    ------
    InputError
        If it cannot be read or is not a calibration file; the text names the key.

    Examples
    --------
    >>> read_calibration("calibration.json").bias_for(600.0)  # doctest: +SKIP
    array(7.74)
    """
    return CalibrationFile.read(path, "calibration").result()
