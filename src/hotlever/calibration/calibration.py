"""A calibration: its table, its power law, its error budget, and its file."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from hotlever import __version__
from hotlever.calibration.knee import Knee
from hotlever.calibration.power_law import PowerLaw
from hotlever.files import write_text
from hotlever.fitting.measurement import Measurement
from hotlever.probe import Probe

Array = NDArray[np.float64]

#: Columns of a calibration's table: name, unit, what it is.
TABLE_COLUMNS: dict[str, tuple[str, str]] = {
    "bias_V": ("V", "bias"),
    "lever_V": ("V", "lever voltage"),
    "current_mA": ("mA", "heater current"),
    "power_mW": ("mW", "power dissipated in the lever"),
    "tip_K": ("K", "tip temperature"),
    "tip_stderr_K": ("K", "standard error of the tip temperature"),
}


@dataclass(frozen=True)
class Calibration:
    """The tip temperature of one lever against what its instrument shows.

    Attributes
    ----------
    route : str
        What it rests on: ``power law``, ``probe``, ``fit in vacuum`` or ``fit in air``.
    medium : str
        Of the model whose temperatures are used.
    power_law : PowerLaw
        In vacuum; T_tip is the law's value at P_l / k, approximately (see `law_residual_K`).
    law_residual_K : float
        Largest difference of the law from the model it was fitted to; 0 for a given law.
    k, k_stderr : float
        Power of the measured knee over the threshold of the power law.
    knee : Knee or None
        As measured; None if it had to be estimated.
    knee_mW, knee_stderr_mW, knee_tip_K : float
        Power and temperature of the knee, measured or estimated.
    table : xarray.Dataset
        `TABLE_COLUMNS` on the dimension ``bias``, evenly spaced over the measured range.
    budget : dict of str to ndarray
        Standard error (K) in each row, by source.
    measured_rms_K : float
        Rms of the measurement's own tip temperatures about the calibration; NaN if it has none.
    base_temperature_K : float
    probe : Probe
    measurement : Measurement
    notes : list of str
    """

    route: str
    medium: str
    power_law: PowerLaw
    law_residual_K: float
    k: float
    k_stderr: float
    knee: Knee | None
    knee_mW: float
    knee_stderr_mW: float
    knee_tip_K: float
    table: xr.Dataset
    budget: dict[str, Array]
    measured_rms_K: float
    base_temperature_K: float
    probe: Probe
    measurement: Measurement
    notes: list[str] = field(default_factory=list)

    @property
    def tip_temperature_uncertainty_K(self) -> float:
        """Largest standard error of the tip temperature in the table (K)."""
        return float(self.table.tip_stderr_K.max())

    def bias_for(self, tip_K: ArrayLike, series_resistance_ohm: float | None = None) -> Array:
        """Return the bias (V) that heats the tip to a temperature (K).

        Parameters
        ----------
        tip_K : array_like
        series_resistance_ohm : float, optional
            That of the measurement by default; power and lever voltage do not depend on it.

        Returns
        -------
        ndarray
            NaN outside the measured range.
        """
        if series_resistance_ohm is None:
            series_resistance_ohm = self.probe.circuit.series_resistance_ohm
        known = self.table.isel(bias=np.flatnonzero(np.isfinite(self.table.tip_K)))
        tip = np.asarray(tip_K, dtype=float)
        power = np.interp(tip, known.tip_K, known.power_mW, left=np.nan, right=np.nan)
        lever = np.interp(power, known.power_mW, known.lever_V)
        bias: Array = lever + series_resistance_ohm / 1000.0 * power / lever
        return bias

    def to_json(self) -> str:
        """Return the calibration file."""
        at = self._knee_point()
        rows = self.table.to_dataframe().reset_index(drop=False)
        content = {
            "route": self.route,
            "medium": self.medium,
            "power_law": self.power_law.values(self.base_temperature_K),
            "power_law_residual_K": self.law_residual_K,
            "k": self.k,
            "k_stderr": self.k_stderr,
            "knee": at,
            "tip_temperature_uncertainty_K": self.tip_temperature_uncertainty_K,
            "uncertainty_budget_K": {
                source: float(np.nanmax(error)) for source, error in self.budget.items()
            },
            "base_temperature_K": self.base_temperature_K,
            "table": [
                {name: _number(row[name]) for name in TABLE_COLUMNS} for _, row in rows.iterrows()
            ],
            "probe": self.probe.values(),
            "data": {"path": self.measurement.path, "sha256": self.measurement.sha256},
            "notes": self.notes,
            "software": f"hotlever {__version__}",
        }
        return json.dumps(content, indent=2, ensure_ascii=False) + "\n"

    def _knee_point(self) -> dict[str, float | bool | None]:
        measured = self.knee is not None
        knee = self.knee
        return {
            "lever_V": knee.lever_V if knee else None,
            "current_mA": knee.current_mA if knee else None,
            "power_mW": self.knee_mW,
            "tip_K": self.knee_tip_K,
            "lever_V_stderr": knee.lever_V_stderr if knee else None,
            "current_mA_stderr": knee.current_mA_stderr if knee else None,
            "power_mW_stderr": self.knee_stderr_mW,
            "measured": measured,
        }

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the calibration file, whole or not at all."""
        write_text(path, self.to_json())

    def table_csv(self) -> str:
        """Return the table as CSV, to load into an instrument."""
        columns = [self.table[name].values for name in TABLE_COLUMNS]
        lines = [",".join(TABLE_COLUMNS)]
        lines += [",".join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True)]
        return "\n".join(lines) + "\n"


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
