"""Tables of tip temperatures with an error budget: by bias, or by the height of a pulse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.errors import InputError
from hotlever.estimation.outcome import array
from hotlever.probe import Circuit
from hotlever.text import BAND
from hotlever.types import Array

#: Columns of a calibration's table; the last say how sure it is.
STATED = ("tip_stderr_K", "tip_low_K", "tip_high_K")
TABLE_COLUMNS = ("bias_V", "lever_V", "current_mA", "power_mW", "tip_K", *STATED)
#: One more with held supplies: the power of all of them together.
TOTAL_POWER = "total_power_mW"


def table_with_budget(
    columns: Mapping[str, Array], budget: Mapping[str, Array], along: str = "bias"
) -> xr.Dataset:
    """Return columns on a dimension, rising in ``{along}_V``, and ``budget_K`` by ``source``."""
    errors = (("source", along), np.array(list(budget.values())))
    coordinates = {along: columns[f"{along}_V"], "source": list(budget)}
    return labelled({**columns, "budget_K": errors}, along, coordinates)


def budget_of(table: xr.Dataset) -> dict[str, Array]:
    """Return the standard errors (K) of a table by source, independent of each other."""
    return {error.source.item(): error.values for error in table.budget_K}


def total_error(parts: Mapping[str, Array]) -> Array:
    """Return the standard error of which independent ones are the parts."""
    return np.sqrt(np.sum([part**2 for part in parts.values()], axis=0))


def interpolated(table: xr.Dataset, values: ArrayLike, along: str, column: str) -> Array:
    """Return a column of a table at values of another one that rises; NaN outside of it."""
    at, rising = np.asarray(values, dtype=float), table[along].values
    return np.interp(at, rising, table[column].values, left=np.nan, right=np.nan)


def table_by_bias(
    circuit: Circuit,
    bias: Array,
    current: Array,
    tip: Array,
    parts: Mapping[str, Array],
    limits: tuple[Array, Array] | None = None,
) -> xr.Dataset:
    """Return the table of bias (V), current (mA) and tip temperature (K), with its errors.

    95 % lie between the limits, or as far away as the errors say.
    """
    stderr, lever = total_error(parts), circuit.lever_voltage(bias, current)
    low, high = limits or (tip - BAND * stderr, tip + BAND * stderr)
    values = (bias, lever, current, lever * current, tip, stderr, low, high)
    return table_with_budget(dict(zip(TABLE_COLUMNS, values, strict=True)), parts)


# --- in files -----------------------------------------------------------------------------------


def check_rows(
    columns: Mapping[str, Array], budget: Mapping[str, Array], along: str, where: str
) -> None:
    """Refuse what a file holds in place of a table with its budget; `where` names the file.

    Raises
    ------
    InputError
        If its rows do not rise, or the budget is not one of them.
    """
    rising = columns.get(f"{along}_V", np.array([]))
    if not rising.size or not budget or not np.all(np.diff(rising) > 0):
        raise InputError(
            f"{where}: table: expected rows of rising {along}, and a budget of their errors"
        )
    for source, errors in budget.items():
        array(errors, rising.shape, f"{where}: budget_K: {source}")


def stored_table(
    columns: Mapping[str, Array],
    budget: Mapping[str, Array],
    names: Sequence[str],
    along: str = "bias",
) -> xr.Dataset:
    """Return the table that a file holds; columns are NaN that an older file has not."""
    unknown = np.full_like(columns[f"{along}_V"], np.nan)
    return table_with_budget({name: columns.get(name, unknown) for name in names}, budget, along)
