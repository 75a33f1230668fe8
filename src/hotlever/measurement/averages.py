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

from hotlever.lever.dataset import OBSERVABLES
from hotlever.measurement.data import COLUMNS, Measurement
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
    as_it_is = measurement.rows is not None or measurement.time_us is not None
    if measurement.bias_V.size <= MANY or as_it_is:
        return measurement
    columns: dict[str, Array] = {
        name: np.array(values)
        for name, _ in COLUMNS.values()
        if (values := getattr(measurement, name)) is not None
    }
    bias = columns["bias_V"]
    levels, step = np.unique(bias, return_inverse=True)
    if levels.size > STEPS:
        width = (levels[-1] - levels[0]) / STEPS
        step = np.minimum((bias - levels[0]) / width, STEPS - 1).astype(int)
    if robust:
        for name in OBSERVABLES.values():
            columns[name][_far_off(columns[name], step)] = np.nan
    known = np.isfinite([values for name, values in columns.items() if name != "bias_V"])
    data = np.isfinite([columns[name] for name in OBSERVABLES.values()]).any(axis=0)
    # rows with the same columns filled have the same mean bias for all of them
    alike = np.unique([step[data], *known[:, data]], axis=1, return_inverse=True)[1]
    count = np.bincount(alike)

    def mean(values: NDArray[Any]) -> Array:
        return np.asarray(np.bincount(alike, values) / count)

    order = np.argsort(mean(np.flatnonzero(data)), kind="stable")
    found: dict[str, Any] = {
        name: (np.sqrt(mean(values[data] ** 2) / count) if "error" in name else mean(values[data]))[
            order
        ]
        for name, values in columns.items()
    }
    return replace(measurement, **found, rows=count[order].astype(float))


def note_on_averages(whole: Measurement, used: Measurement) -> list[str]:
    """Say that rows were averaged, if they were."""
    if used is whole:
        return []
    return [
        f"{whole.bias_V.size} rows are averaged to {used.bias_V.size}; scatter and rms are those "
        "of the averages"
    ]


def _far_off(values: Array, step: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which data are far off the others of their step."""
    places = np.argsort(step, kind="stable")
    places = places[np.isfinite(values[places])]
    away = np.zeros(values.size)
    scatter = np.zeros(values.size)
    for some in np.split(places, np.flatnonzero(np.diff(step[places])) + 1):
        if some.size >= _FEWEST:
            away[some] = np.abs(values[some] - np.median(values[some]))
            scatter[some] = 1.4826 * np.median(away[some])
    usual = np.median(scatter[scatter > 0]) if np.any(scatter > 0) else 0.0
    return np.asarray(away > _OUTLIER * np.maximum(scatter, usual))
