"""Many rows averaged to some: what least squares makes of them stays the same.

Rows at one bias count in a sum of squares by their mean alone, as often as there are rows, so for
independent errors nothing is lost; nor is it for rows of slightly different biases between which
the model is a straight line. What is left is its bend: the mean of a step of width h lies h²/24
times the second derivative beside the model at the mean bias, some mK of the tip temperature.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median

from hotlever.datasets import OBSERVABLES
from hotlever.measurement.data import MEASURED, Measurement
from hotlever.types import Array

#: Rows up to which all are used as they are, and steps of the bias in which more are averaged.
MANY, STEPS = 2000, 1000
#: For a robust fit a datum is left out of its mean beyond so many standard deviations
#: (median-based) of the data of its step, of which it takes some to tell.
_OUTLIER, _FEWEST = 8.0, 5


def averaged(measurement: Measurement, robust: bool = False) -> Measurement:
    """Average the rows of equal or nearly equal bias, if there are very many.

    Parameters
    ----------
    measurement : Measurement
    robust : bool
        Whether data far off the others of their step are left out.

    Returns
    -------
    Measurement
        As it was, if it has few rows, is one of averages or in time. Else its ``rows`` say of how
        many each is the mean; in the order of the file.
    """
    averaged_before = measurement.rows is not None
    if measurement.bias_V.size <= MANY or averaged_before or measurement.time_us is not None:
        return measurement
    columns = {column.name: getattr(measurement, column.name) for column in MEASURED}
    columns = {name: values for name, values in columns.items() if values is not None}
    step = _steps(measurement.bias_V)
    if robust:
        for name in (OBSERVABLES[observable].name for observable in measurement.observables):
            columns[name] = np.where(_far_off(columns[name], step), np.nan, columns[name])
    shown = np.isfinite([columns[column.name] for column in OBSERVABLES.values()]).any(axis=0)
    used = {name: values[shown] for name, values in columns.items()}
    # rows with the same columns filled have the same mean bias for all of them
    filled = np.isfinite(list(used.values()))
    group = np.unique([step[shown], *filled], axis=1, return_inverse=True)[1]
    count = np.bincount(group)
    order = np.argsort(np.bincount(group, np.flatnonzero(shown)) / count, kind="stable")
    rows = count[order].astype(float)

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(group, values)[order] / rows)

    means: Any = {
        name: np.sqrt(mean(values**2) / rows) if "error" in name else mean(values)
        for name, values in used.items()
    }
    return replace(measurement, **means, rows=rows)


def note_on_averages(whole: Measurement, used: Measurement) -> list[str]:
    """Say that rows were averaged, if they were."""
    if used is whole:
        return []
    return [
        f"{whole.bias_V.size} rows are averaged to {used.bias_V.size}; scatter and rms are those "
        "of the averages"
    ]


def _steps(bias: Array) -> NDArray[np.intp]:
    """Return for each row the number of its bias, or of its step if there are too many biases."""
    levels, step = np.unique(bias, return_inverse=True)
    if levels.size <= STEPS:
        return step
    width = (levels[-1] - levels[0]) / STEPS
    return np.minimum((bias - levels[0]) / width, STEPS - 1).astype(np.intp)


def _far_off(values: Array, step: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which data are far off the others of their step."""
    finite = np.isfinite(values)
    data, (steps, group) = values[finite], np.unique(step[finite], return_inverse=True)
    numbers = np.arange(steps.size)
    away = np.abs(data - median(data, group, numbers)[group])
    scatter = 1.4826 * median(away, group, numbers)[group]
    enough = np.bincount(group)[group] >= _FEWEST
    usual = np.median(scatter[enough & (scatter > 0)]) if np.any(enough & (scatter > 0)) else 0.0
    far = np.zeros(values.size, dtype=bool)
    far[finite] = enough & (away > _OUTLIER * np.maximum(scatter, usual))
    return far
