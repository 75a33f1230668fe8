"""The rows of a measurement: polarities, sweeps up and down, and many rows averaged to some.

What least squares makes of averages stays the same. Rows at one bias count in a sum of squares by
their mean alone, as often as there are rows, so for independent errors nothing is lost; nor is it
for rows of slightly different biases between which the model is a straight line. What is left is
its bend: the mean of a step of width h lies h²/24 times the second derivative beside the model at
the mean bias, some mK of the tip temperature.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from hotlever.measurement.data import Measurement, as_attributes
from hotlever.quantities import FITTED
from hotlever.types import Array, Index, Mask


def sweeps_of(bias: Array, fewest: int = 3) -> list[slice]:
    """Return the rows of each sweep: from turn to turn, and on either side of zero.

    `bias` has its sign. Rows in no order are one sweep; one has so many rows at the `fewest`.

    Examples
    --------
    >>> sweeps_of(np.array([0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 0.0]))
    [slice(0, 4, None), slice(4, 7, None)]
    """
    # rows at which the bias has another sign than before
    signed = np.flatnonzero(bias != 0.0)
    crossings = signed[1:][np.diff(np.sign(bias[signed])) != 0.0].tolist()
    ends = sorted({0, *_turns(bias), *crossings, bias.size})
    if np.median(np.diff(ends)) < fewest:
        return [slice(0, bias.size)]
    # what is too short for a sweep belongs to the one before
    begins = [at for at, end in pairwise(ends) if at == 0 or end - at >= fewest]
    return [slice(begin, end) for begin, end in pairwise([*begins, bias.size])]


def _turns(bias: Array, share: float = 0.1) -> list[int]:
    """Rows with which a sweep begins because the bias turns, and goes back by a share of it."""
    back = share * np.ptp(bias) if bias.size else 0.0
    turns: list[int] = []
    farthest, way = 0, 0
    for row in range(1, bias.size):
        step = bias[row] - bias[farthest]
        if way == 0:
            way = int(np.sign(step)) if abs(step) > back else 0
            farthest = row if way else farthest
        elif step * way >= 0.0:
            farthest = row
        elif abs(step) > back:
            turns.append(farthest + 1)
            # one row back at the start is a sweep in the same direction
            jumped = row == farthest + 1 and abs(step) > (1.0 - share) * np.ptp(bias)
            way, farthest = way if jumped else -way, row
    return turns


def described(bias: Array, sweeps: list[slice]) -> str:
    """Say in words which sweeps there are."""
    words = []
    for sweep in sweeps:
        first, last = bias[sweep][0], bias[sweep][-1]
        way = "up" if abs(last) >= abs(first) else "down"
        sign = "negative, " if min(first, last) < 0.0 else ""
        count = sweep.stop - sweep.start
        words.append(f"{sign}{way} ({count} row{'s' * (count != 1)})")
    return ", ".join(words) if len(words) < 7 else f"{len(words)} sweeps"


def disagreements(
    bias: Array, sweeps: list[slice], data: dict[str, Array], symmetric: bool = True
) -> list[str]:
    """Say by how much sweeps differ from the first, if by more than noise.

    Polarities are compared if the circuit is symmetric.
    """
    texts, along = [], np.abs(bias) if symmetric else bias
    for name, values in data.items():
        largest = np.nanmax(np.abs(values), initial=0.0)
        sizes = [_difference(along, values, sweeps[0], sweep, largest) for sweep in sweeps[1:]]
        if max(sizes, default=0.0) > 0.0:
            texts.append(
                f"{name} of sweep {2 + np.argmax(sizes)} differs from that of sweep 1 by "
                f"{max(sizes) / largest:.1%} of its largest value (rms), which is more than noise: "
                "hysteresis or drift?"
            )
    return texts


def _difference(along: Array, values: Array, first: slice, other: slice, largest: float) -> float:
    """Return what one sweep has beside another (rms); 0 where that is noise, or next to nothing.

    Noise has von Neumann's ratio of 1 within three of its standard deviations, 1/√n (Ann. Math.
    Stat. 12, 367 (1941)): half the mean square between neighbours over that of all.
    """
    (x, y), (at, others) = (_rising(along[rows], values[rows]) for rows in (first, other))
    if x.size < 3:
        return 0.0
    difference = others - np.interp(at, x, y, np.nan, np.nan)
    difference = difference[np.isfinite(difference)]
    # fewer rows that both have tell nothing
    if difference.size < 8:
        return 0.0
    noise, square = 0.5 * np.mean(np.diff(difference) ** 2), np.mean(difference**2)
    beyond = square - noise > 3.0 / np.sqrt(difference.size) * square
    size = float(np.sqrt(square))
    return size if beyond and size > 1e-3 * largest else 0.0


def _rising(x: Array, y: Array) -> tuple[Array, Array]:
    """Sort by bias; rows at the same bias count as their mean."""
    finite = np.isfinite(y)
    bias, level, count = np.unique(x[finite], return_inverse=True, return_counts=True)
    return bias, np.bincount(level, weights=y[finite], minlength=bias.size) / count


# --- many rows averaged to some -----------------------------------------------------------------


def averaged(measurement: Measurement, robust: bool = False, many: int = 2000) -> Measurement:
    """Average the rows of equal or nearly equal bias, if there are more than very many.

    Parameters
    ----------
    measurement : Measurement
    robust : bool
        Whether data far off the others of their step are left out.
    many : int
        Rows up to which all are used as they are; there are half as many steps of the bias.

    Returns
    -------
    Measurement
        As it was, if it has few rows, is one of averages or in time. Else its ``rows`` say of how
        many each is the mean; in the order of the file.
    """
    few = measurement.bias_V.size <= many
    if few or measurement.rows is not None or measurement.time_us is not None:
        return measurement
    columns = measurement.columns
    step = _steps(measurement.bias_V, many // 2)
    if measurement.distance_um is not None:
        # other distances from a sample are other states of the lever
        distance = np.nan_to_num(measurement.distance_um)
        step = np.unique([step, distance], axis=1, return_inverse=True)[1]
    if robust:
        for name in (FITTED[observable].name for observable in measurement.observables):
            columns[name] = np.where(_far_off(columns[name], step), np.nan, columns[name])
    observed = [columns[FITTED[name].name] for name in measurement.observables]
    has_data = np.isfinite(observed).any(axis=0)
    used = {name: values[has_data] for name, values in columns.items()}
    # rows with the same columns filled have the same mean bias for all of them
    filled = np.isfinite(list(used.values()))
    group = np.unique([step[has_data], *filled], axis=1, return_inverse=True)[1]
    count = np.bincount(group)
    order = np.argsort(np.bincount(group, np.flatnonzero(has_data)) / count, kind="stable")
    rows = count[order].astype(float)

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(group, values)[order] / rows)

    means = {
        name: np.sqrt(mean(values**2) / rows) if "error" in name else mean(values)
        for name, values in used.items()
    }
    return replace(measurement, **as_attributes(means), rows=rows)


def note_on_averages(whole: Measurement, used: Measurement) -> list[str]:
    """Say that rows were averaged, if they were."""
    if used is whole:
        return []
    return [
        f"{whole.bias_V.size} rows are averaged to {used.bias_V.size}; scatter and rms are those "
        "of the averages"
    ]


def _steps(bias: Array, most: int) -> Index:
    """Return for each row the number of its bias, or of its step if there are too many biases."""
    levels, step = np.unique(bias, return_inverse=True)
    if levels.size <= most:
        return step
    width = (levels[-1] - levels[0]) / most
    return np.minimum((bias - levels[0]) / width, most - 1).astype(np.intp)


def _far_off(values: Array, step: Index) -> Mask:
    """Return which data are far off the others of their step, which five or more tell."""
    finite = np.isfinite(values)
    data, (steps, group) = values[finite], np.unique(step[finite], return_inverse=True)
    from scipy.ndimage import median  # not needed for most measurements

    numbers = np.arange(steps.size)
    away = np.abs(data - median(data, group, numbers)[group])
    scatter = 1.4826 * median(away, group, numbers)[group]
    enough = np.bincount(group)[group] >= 5
    usual = np.median(scatter[enough & (scatter > 0)]) if np.any(enough & (scatter > 0)) else 0.0
    far = np.zeros(values.size, dtype=bool)
    # in standard deviations, median-based
    far[finite] = enough & (away > 8.0 * np.maximum(scatter, usual))
    return far
