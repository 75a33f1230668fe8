"""A calibration: its table, its power law, its error budget, and its file."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from pydantic import Field

from hotlever import __version__
from hotlever.calibration.knee import Knee
from hotlever.calibration.power_law import PowerLaw
from hotlever.calibration.pulses import PulseCalibration, PulseSection
from hotlever.datasets import frame_text, labelled
from hotlever.errors import InputError
from hotlever.estimation.embedded import (
    EmbeddedMeasurement,
    Number,
    UsedPrior,
    array,
    embed,
    prior_uses,
    without_spread,
)
from hotlever.estimation.verdict import Outcome, Verdict
from hotlever.files import without_nan
from hotlever.measurement import Measurement
from hotlever.probe import Circuit, Probe
from hotlever.probe.priors import PriorUse
from hotlever.text import value_with_error
from hotlever.types import Array

#: Columns of a calibration's table; the last say how sure it is.
STATED = ("tip_stderr_K", "tip_low_K", "tip_high_K")
TABLE_COLUMNS = ("bias_V", "lever_V", "current_mA", "power_mW", "tip_K", *STATED)
#: One more with held supplies: the power of all of them together.
TOTAL_POWER = "total_power_mW"


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
        `TABLE_COLUMNS` on the dimension ``bias``, evenly spaced over the measured range, and
        ``budget_K``, the standard error by ``source``. With held supplies, what is shown is of
        the swept one, and `TOTAL_POWER` that of all.
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

    lever = "lever like this one"

    def _without_errors(self) -> dict[str, Any]:
        errors = (*STATED, "budget_K")
        unknown = {name: xr.full_like(self.table[name], np.nan) for name in errors}
        return {
            "table": self.table.assign(unknown),
            "knee": self.knee.without_errors,
            "k_stderr": np.nan,
            "priors": without_spread(self.priors),
            "pulse": None,
        }

    @property
    def base_temperature_K(self) -> float:
        """Temperature without power (K)."""
        return self.probe.circuit.base_temperature_K

    @property
    def tip_temperature_uncertainty_K(self) -> float:
        """Largest standard error of the tip temperature in the table (K)."""
        return float(self.table.tip_stderr_K.max())

    @property
    def knee_measured(self) -> bool:
        """Whether the knee lies in the measured range."""
        return self.knee.measured and self.knee.bias_V <= float(self.table.bias_V.max())

    def tip_temperature(self, power_mW: ArrayLike) -> Array:
        """Return the tip temperature (K) by power (mW); NaN outside the measured range.

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
        return self._read(power_mW, "power_mW", "tip_K")

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
            NaN outside the measured range; from the coldest tip on, if it cools at first.

        Raises
        ------
        InputError
            If the data are not described: what is set would not follow.
        """
        self.need_described("the bias for a tip temperature")
        lever, current = (self._read(tip_K, "tip_K", name) for name in ("lever_V", "current_mA"))
        return np.asarray((circuit or self.probe.circuit).bias(lever, current))

    @property
    def heating(self) -> xr.Dataset:
        """The rows of the table that have a tip temperature, from the coldest on."""
        known = self.table.isel(bias=np.isfinite(self.table.tip_K.values))
        return known.isel(bias=slice(int(np.argmin(known.tip_K.values)), None))

    @property
    def columns(self) -> list[str]:
        """The columns of the table in a file."""
        return [name for name in (*TABLE_COLUMNS, TOTAL_POWER) if name in self.table]

    def _read(self, at: ArrayLike, along: str, column: str) -> Array:
        x, y = self.heating[along].values, self.heating[column].values
        return np.interp(np.asarray(at, dtype=float), x, y, left=np.nan, right=np.nan)

    def __repr__(self) -> str:
        hottest = self.table.isel(bias=int(np.nanargmax(self.table.tip_K)))
        tip = value_with_error(hottest.tip_K.item(), hottest.tip_stderr_K.item())
        said = self.doubt or f"{tip} K at {hottest.bias_V.item():.4g} V in {self.medium}"
        return f"<Calibration of {self.measurement.path or 'a measurement'}: {said}>"

    # --- the file -------------------------------------------------------------------------------

    def content(self) -> dict[str, Any]:
        """Return the content of the calibration file."""
        law, budget = self.power_law, self.table.budget_K.transpose("source", "bias")
        sources = dict(zip(budget.source.values.tolist(), budget.values.tolist(), strict=True))
        content = {
            "route": self.route,
            "medium": self.medium,
            "power_law": law and law.values(self.base_temperature_K),
            "power_law_residual_K": self.law_residual_K,
            "k": self.k,
            "k_stderr": self.k_stderr,
            "knee": vars(self.knee) | {"tip_K": self.knee_tip_K, "measured": self.knee_measured},
            "tip_temperature_uncertainty_K": self.tip_temperature_uncertainty_K,
            "uncertainty_budget_K": dict(
                zip(sources, budget.max("bias").values.tolist(), strict=True)
            ),
            "base_temperature_K": self.base_temperature_K,
            "table": self.table[self.columns].to_dataframe().to_dict("records"),
            "budget_K": sources,
            "measured_rms_K": self.measured_rms_K,
            "priors": {name: vars(use) for name, use in self.priors.items()},
            "describes_data": self.describes_data,
            "reason": self.reason,
            **({} if self.pulse is None else {"pulse": self.pulse.content()}),
            "probe": self.probe.values(),
            "data": embed(self.measurement),
            "notes": self.notes,
            "software": f"hotlever {__version__}",
        }
        return dict(without_nan(content))

    def table_csv(self) -> str:
        """Return the table as CSV, to load into an instrument; that of the pulse if there is."""
        if self.pulse is not None:
            return self.pulse.table_csv()
        frame = self.table[self.columns].to_dataframe()
        return frame_text(frame, index=False, float_format="%.6g")


def table_of(columns: dict[str, Array], budget: dict[str, Array]) -> xr.Dataset:
    """Return the table of a calibration: the columns of its file, and the error by source."""
    errors = (("source", "bias"), np.array(list(budget.values())))
    return labelled(
        {**columns, "budget_K": errors},
        coordinates={"bias": columns["bias_V"], "source": list(budget)},
    )


class _CalibrationFile(Verdict):
    """What a calibration file must hold; see `Calibration.content`."""

    route: str
    medium: str
    power_law: dict[str, float] | None
    power_law_residual_K: Number
    k: Number
    k_stderr: Number
    knee: dict[str, Number]
    table: list[dict[str, Number]]
    budget_K: dict[str, list[Number]]
    measured_rms_K: Number = np.nan
    priors: dict[str, UsedPrior] = Field(default_factory=dict)
    probe: dict[str, dict[str, Any]]
    data: EmbeddedMeasurement
    notes: list[str]
    pulse: PulseSection | None = None


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
    found = _CalibrationFile.read(path, "calibration")
    where, rows = f"{path}: table", len(found.table)
    probe = Probe.from_values(found.probe, f"{path}: probe")
    columns = {
        name: array([row.get(name) for row in found.table], (rows,), f"{where}: {name}")
        for name in (*TABLE_COLUMNS, TOTAL_POWER)
        if name in TABLE_COLUMNS or any(name in row for row in found.table)
    }
    if not rows or not found.budget_K or not np.all(np.diff(columns["bias_V"]) > 0):
        raise InputError(f"{where}: expected rows of rising bias, and a budget of their errors")
    budget = {
        source: array(errors, (rows,), f"{path}: budget_K: {source}")
        for source, errors in found.budget_K.items()
    }
    law = {name: value for name, value in (found.power_law or {}).items() if name != "threshold_K"}
    knee = {one.name: found.knee[one.name] for one in fields(Knee) if one.name in found.knee}
    return Calibration(
        route=found.route,
        medium=found.medium,
        power_law=None if found.power_law is None else PowerLaw.of(law, f"{path}: power_law"),
        law_residual_K=found.power_law_residual_K,
        k=found.k,
        k_stderr=found.k_stderr,
        knee=Knee(**knee),
        knee_tip_K=found.knee.get("tip_K", np.nan),
        table=table_of(columns, budget),
        measured_rms_K=found.measured_rms_K,
        probe=probe,
        measurement=found.data.measurement(f"{path}: data", probe.circuit),
        priors=prior_uses(found.priors),
        **found.verdict,
        notes=found.notes,
        pulse=None if found.pulse is None else found.pulse.calibration(f"{path}: pulse"),
    )
