"""The order of the rows: polarities, sweeps up and down, and whether they agree."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hotlever.types import Array

#: A turn is where the bias goes back by more than this part of its range.
_BACK = 0.1
#: Sweeps of fewer rows are none.
_FEWEST = 3
#: Sweeps differ if they do so by this part of the largest value, this many times the scatter of
#: the differences between neighbours, at so many rows.
_DIFFERENT, _BEYOND_NOISE, _ENOUGH = 0.003, 2.5, 8


def sweeps_of(bias: Array) -> list[slice]:
    """Return the rows of each sweep: from turn to turn, and on either side of zero.

    `bias` has its sign. Rows in no order are one sweep.

    Examples
    --------
    >>> sweeps_of(np.array([0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 0.0]))
    [slice(0, 4, None), slice(4, 7, None)]
    """
    # rows at which the bias has another sign than before
    signed = np.flatnonzero(bias != 0.0)
    crossings = signed[1:][np.diff(np.sign(bias[signed])) != 0.0].tolist()
    ends = sorted({0, *_turns(bias), *crossings, bias.size})
    if np.median(np.diff(ends)) < _FEWEST:
        return [slice(0, bias.size)]
    # what is too short for a sweep belongs to the one before
    begins = [at for at, end in pairwise(ends) if at == 0 or end - at >= _FEWEST]
    return [slice(begin, end) for begin, end in pairwise([*begins, bias.size])]


def _turns(bias: Array) -> list[int]:
    """Rows with which a sweep begins because the bias turns."""
    back = _BACK * np.ptp(bias) if bias.size else 0.0
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
            jumped = row == farthest + 1 and abs(step) > (1.0 - _BACK) * np.ptp(bias)
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
    """Return what one sweep has beside another (rms); 0 where that is noise, or next to nothing."""
    (x, y), (at, others) = (_rising(along[rows], values[rows]) for rows in (first, other))
    if x.size < _FEWEST:
        return 0.0
    difference = others - np.interp(at, x, y, np.nan, np.nan)
    difference = difference[np.isfinite(difference)]
    if difference.size < _ENOUGH:
        return 0.0
    noise = np.sqrt(0.5 * np.mean(np.diff(difference) ** 2))
    size = float(np.sqrt(np.mean(difference**2)))
    return size if size > max(_BEYOND_NOISE * noise, _DIFFERENT * largest) else 0.0


def _rising(x: Array, y: Array) -> tuple[Array, Array]:
    """Sort by bias; rows at the same bias count as their mean."""
    finite = np.isfinite(y)
    bias, place, count = np.unique(x[finite], return_inverse=True, return_counts=True)
    return bias, np.bincount(place, weights=y[finite], minlength=bias.size) / count
