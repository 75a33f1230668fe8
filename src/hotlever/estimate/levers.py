"""What calibrations of many levers say together: how alike they are somewhere."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from hotlever.datasets import frame_text, labelled
from hotlever.errors import HotleverError
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.fit_summary import (
    Compared,
    compared,
    lever_rows,
    levers_frame,
    statements,
    table_text,
)
from hotlever.estimate.tip_table import STATED, interpolated
from hotlever.quantities import QUANTITIES
from hotlever.text import value_with_error

#: What levers are compared by beside the tip temperature somewhere: of a knee,
_KNEE = {
    "knee_lever_V": Compared("knee V_l (V)", "V", "knee_lever_V{}", "lever voltage of the knee"),
    "knee_current_mA": Compared("knee I_h (mA)", "mA", "knee_current_mA{}", "current of the knee"),
    "knee_power_mW": Compared("knee P_l (mW)", "mW", "knee_power_mW{}", "power of the knee"),
    "knee_tip_K": Compared("knee T_tip (K)", "K", "knee_tip_K", "tip temperature of the knee"),
}
_K = Compared("k", "1", "k{}", "k")
#: Of a power law.
LAW = {
    "linear_K_per_mW": Compared("a (K/mW)", "K/mW", "linear_K_per_mW", "a"),
    "nonlinear_K": Compared("b (K)", "K", "nonlinear_K", "b"),
    "exponent": Compared("m", "1", "exponent", "m"),
    "hot_K_per_mW": Compared("c (K/mW)", "K/mW", "hot_K_per_mW", "c"),
    "threshold_mW": Compared("threshold (mW)", "mW", "threshold_mW", "threshold"),
}
#: Points of a curve without visible corners.
_POINTS = 200


# --- what they say together ---------------------------------------------------------------------


class Setting(NamedTuple):
    """What levers are compared at: a column of their tables, and its value there."""

    along: str
    value: float

    @property
    def text(self) -> str:
        """The value with its unit."""
        return f"{self.value:.4g} {QUANTITIES[self.along].unit}"


def highest_common_bias(calibrations: Mapping[str, Estimate]) -> Setting:
    """Return the highest bias at which all levers were measured whose data are described."""
    described = [each for each in calibrations.values() if each.describes_data]
    highest = [each.table.bias_V.values[-1] for each in described or calibrations.values()]
    return Setting("bias_V", float(min(highest, default=np.nan)))


def compare_calibrations(
    calibrations: Mapping[str, Estimate], at: Setting | None = None
) -> xr.Dataset:
    """Put the calibrations of several levers side by side.

    Parameters
    ----------
    calibrations : mapping of str to Estimate
        By lever.
    at : Setting, optional
        Where the tip temperatures are compared; by default at `highest_common_bias`.

    Returns
    -------
    xarray.Dataset
        See `hotlever.estimate.fit_summary.compared`, of the quantities ``tip_K``; ``knee_lever_V``,
        ``knee_current_mA``, ``knee_power_mW``, ``knee_tip_K``; ``k``; and those of `LAW`. On
        ``lever`` too: ``tip_low_K`` and ``tip_high_K``, between which 95 % lie, ``file``,
        ``describes_data``, and ``reason``: why there is no tip temperature.

    Raises
    ------
    InputError
        If there is none.
    """
    at = at or highest_common_bias(calibrations)
    tip = Compared(f"T_tip at {at.text} (K)", "K", "tip{}_K", f"tip temperature at {at.text}")
    tips = {lever: _tip_at(each, at) for lever, each in calibrations.items()}
    quantities = {}
    for lever, each in calibrations.items():
        knee = each.knee
        quantities[lever] = {
            "tip_K": (tips[lever]["tip_K"], tips[lever]["tip_stderr_K"]),
            "knee_lever_V": (knee.lever_V, knee.lever_V_stderr),
            "knee_current_mA": (knee.current_mA, knee.current_mA_stderr),
            "knee_power_mW": (knee.power_mW, knee.power_mW_stderr),
            "knee_tip_K": (each.knee_tip_K, None),
            "k": (each.k, each.k_stderr),
            **{name: (getattr(each.power_law, name, np.nan), None) for name in LAW},
        }
    answers = {True: "true", False: "false", None: "unknown"}
    more = {
        name: [values[name] for values in tips.values()] for name in ("tip_low_K", "tip_high_K")
    } | {
        "describes_data": [answers[each.describes_data] for each in calibrations.values()],
        "reason": [
            each.doubt or _why_none(each, at, tips[lever]) for lever, each in calibrations.items()
        ],
        "file": [each.measurement.path for each in calibrations.values()],
        at.along: [at.value] * len(calibrations),
    }
    table = compared(calibrations, quantities, {"tip_K": tip, **_KNEE, "k": _K, **LAW}, more)
    return table.assign_attrs(along=at.along)


def _rows_along(calibration: Estimate, along: str) -> xr.Dataset | None:
    """Return the rows that tell a tip temperature by bias or power; None if there are none."""
    by_bias = along == "bias_V"
    if not calibration.describes_data or not (by_bias or calibration.power_law is not None):
        return None
    return calibration.table if by_bias else calibration.heating


def _tip_at(calibration: Estimate, at: Setting) -> dict[str, float]:
    """Return the tip temperature with its errors (K); NaN where there is none."""
    rows, names = _rows_along(calibration, at.along), ("tip_K", *STATED)
    if rows is None:
        return dict.fromkeys(names, np.nan)
    return {name: float(interpolated(rows, at.value, at.along, name)) for name in names}


def _why_none(calibration: Estimate, at: Setting, tip: Mapping[str, float]) -> str:
    """Return why a lever whose data are described has no tip temperature there, if so."""
    if np.isfinite(tip["tip_K"]):
        return ""
    if at.along == "power_mW" and calibration.power_law is None:
        return "its tip temperature does not follow from a power; expected a bias"
    low, high = calibration.heating[at.along].values[[0, -1]]
    unit = QUANTITIES[at.along].unit
    return f"{at.text} is out of its range, {low:.4g} to {high:.4g} {unit}, or where it jumps"


def tips_along(calibrations: Mapping[str, Estimate], along: str) -> xr.Dataset:
    """Return the tip temperatures of those levers whose data are described, at the same settings.

    Parameters
    ----------
    calibrations : mapping of str to Estimate
        By lever.
    along : {"bias_V", "power_mW"}

    Returns
    -------
    xarray.Dataset
        ``tip_K`` and ``tip_stderr_K`` on (``lever``, ``along``); NaN out of a lever's range,
        and where it jumps.
    """
    tables = {
        lever: rows
        for lever, each in calibrations.items()
        if (rows := _rows_along(each, along)) is not None
    }
    edges = [float(table[along].values[end]) for table in tables.values() for end in (0, -1)]
    at = np.linspace(min(edges, default=0.0), max(edges, default=1.0), _POINTS)
    columns = {
        name: np.array([interpolated(table, at, along, name) for table in tables.values()])
        for name in ("tip_K", "tip_stderr_K")
    }
    shape = len(tables), at.size
    return labelled(
        {name: values.reshape(shape) for name, values in columns.items()},
        ("lever", along),
        {"lever": list(tables), along: at},
    )


def calibration_rows(levers: xr.Dataset) -> list[list[str]]:
    """Return the table of `compare_calibrations` for people: see `lever_rows`.

    Without the coefficients of power laws and what no lever has; k stands where one is in air.
    """
    finite = levers.value.notnull().any("lever")
    in_air = (levers.value.sel(quantity="k") > 1.0).any()
    quantities = [
        name
        for name in levers.quantity.values[finite.values]
        if name not in LAW and (name != "k" or in_air)
    ]
    return lever_rows(levers.sel(quantity=quantities))


def law_rows(levers: xr.Dataset) -> list[list[str]]:
    """Return the coefficients of the power laws in vacuum, a column each, below a head."""
    laws = levers.sel(quantity=list(LAW))
    rows = [["lever", *laws.heading.values.tolist()]]
    for lever in laws.lever:
        values = laws.value.sel(lever=lever).values.tolist()
        cells = ("" if np.isnan(value) else value_with_error(value, np.nan) for value in values)
        rows.append([str(lever.item()), *cells])
    return rows


def calibration_statements(levers: xr.Dataset) -> list[str]:
    """Say in words whether the levers differ, and which have no tip temperature there, and why."""
    answers = zip(levers.lever.values, levers.described.values, levers.reason.values, strict=True)
    missing = [
        f"lever {lever}: {reason}" for lever, described, reason in answers if described and reason
    ]
    return statements(levers) + missing


def calibrations_text(levers: xr.Dataset) -> str:
    """Return the table of many calibrations and what follows from it as lines of text."""
    return table_text(calibration_rows(levers), calibration_statements(levers))


def calibrations_csv(levers: xr.Dataset, failures: Mapping[str, HotleverError]) -> str:
    """Return a table with one row for each lever, as `compare_calibrations` has them.

    Below them are the data files that no calibration could be made of, and why.
    """
    columns = (levers.attrs["along"], "tip_low_K", "tip_high_K", "describes_data", "reason", "file")
    table = levers_frame(levers, columns)
    for path, error in failures.items():
        table.loc[path, ["reason", "file"]] = str(error), path
    return frame_text(table, float_format="%.8g")
