"""The paper's claims that depend on the layout: when they hold, and for which layouts they do."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from hotlever import spieser2017 as paper
from hotlever.studies.published_lever.ensemble import SIZES, Ensemble, stored_ensemble


class Criterion(NamedTuple):
    """A claim holds where a number lies between two limits.

    Attributes
    ----------
    column : str
        The number of a layout, in the ensemble.
    least, most : float
    form : str
        How the number is written.
    unit : str
    """

    column: str
    least: float
    most: float
    form: str
    unit: str = ""

    def holds(self, value: float | xr.DataArray) -> bool | xr.DataArray:
        """Return whether a claim holds for a number, or where it does."""
        return (value > self.least) & (value < self.most)

    def written(self, value: float) -> str:
        """Return a number with its unit."""
        return f"{value:{self.form}}{self.unit}"


def _below(column: str, most: float, form: str, unit: str = "") -> Criterion:
    return Criterion(column, -np.inf, most, form, unit)


def _above(column: str, least: float, form: str, unit: str = "") -> Criterion:
    return Criterion(column, least, np.inf, form, unit)


#: By the name of the claim.
CRITERIA: dict[str, Criterion] = {
    "operating_points": _below("points_off", 0.01, ".2%"),
    # the paper reads it off 25 points
    "simulated_knee": Criterion(
        "knee_K", paper.KNEE_PREDICTED_K - 10.0, paper.KNEE_PREDICTED_K + 10.0, ".0f", " K"
    ),
    "power_law": _below("eq12_K", paper.POWER_LAW_SPREAD_K, ".0f", " K"),
    "legs_prevail": _above("legs_prevail_K", paper.LEGS_PREVAIL_K - 50.0, ".0f", " K"),
    "heater_length": Criterion("heater_left", 0.35, 0.65, ".0%"),
    # a part of the 25 K within which temperatures are described
    "knee_condition": _below("by_voltage_K", 5.0, ".0f", " K"),
    "knee_by_legs": Criterion(
        "by_legs_K", 0.5 * paper.KNEE_BY_LEGS_K, 1.5 * paper.KNEE_BY_LEGS_K, ".0f", " K"
    ),
    "knee_by_doping": Criterion("doping_share", 0.75, 1.25, ".0%"),
    # as large as it must be for the highest V_l to be that of another row
    "knee_misses": _above("ramp_up_current", paper.CURRENT_ERROR, ".2%"),
    "dependent_parameters": _above("coupling_I", 0.8, ".2f"),
    "decoupled_groups": _below("coupling_III", 0.6, ".2f"),
    "current_alone": _above("tip_I_K", paper.POWER_LAW_SPREAD_K, ".0f", " K"),
    "doping_held": _below("tip_n_d_held_K", paper.POWER_LAW_SPREAD_K, ".0f", " K"),
    "one_factor": _below("eq12_air_K", paper.POWER_LAW_SPREAD_K, ".0f", " K"),
    "constant_share": Criterion("share_growth", 0.9, 1.1, ".2f", "-fold"),
    "factor_of_the_knee": _below("k_by_knee_K", paper.POWER_LAW_SPREAD_K, ".0f", " K"),
    "one_sided": _below("one_sided_K", paper.POWER_LAW_SPREAD_K, ".0f", " K"),
    "linear_branch": _below("straight_K", paper.POWER_LAW_SPREAD_K, ".0f", " K"),
    "proportional_branch": _below("proportional_K", paper.POWER_LAW_SPREAD_K, ".0f", " K"),
    "missing_tip": _above("tip_carries_K", 0.75 * paper.KNEE_OFF_K, "+.2f", " K"),
    "tip_in_air": _above("tip_in_air_K", 0.75 * paper.KNEE_OFF_K, "+.2f", " K"),
    "thermoelectric_size": _below("shift_nm", paper.SHIFT_NM, ".0f", " nm"),
    "thermoelectric_direction": _above("shift_along_nm", 0.0, "+.0f", " nm"),
    "thermoelectric_prediction": _below(
        "without_heat_carried_K", paper.POWER_LAW_SPREAD_K, ".1f", " K"
    ),
    "radiation": _below("radiated_share", 1e-3, ".2%"),
}


class Verdict(NamedTuple):
    """What becomes of a claim in the ensemble: words, and the range of its number."""

    words: str
    range: str


def verdict_on(name: str, found: Ensemble | None = None) -> Verdict:
    """Return the verdict on a claim, by the weight of the layouts for which it holds."""
    found = found or stored_ensemble()
    criterion = CRITERIA[name]
    holds = criterion.holds(found.numbers[criterion.column])
    assert isinstance(holds, xr.DataArray)
    least, *_, most = sorted(found.share(holds, size) for size in SIZES)
    # so much of the weight is as good as all of it, or none
    if least >= 0.95:
        words = "holds"
    elif most <= 0.05:
        words = "does not hold"
    elif f"{least:.0%}" == f"{most:.0%}":
        words = f"holds for some layouts ({most:.0%} of the weight)"
    else:
        words = f"holds for some layouts ({least:.0%} to {most:.0%} of the weight)"
    low, high = map(criterion.written, found.range(criterion.column))
    return Verdict(words, low if low == high else f"{low.removesuffix(criterion.unit)} to {high}")
