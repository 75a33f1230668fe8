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
    ends = sorted({0, *_turns(bias), *_crossings(bias), bias.size})
    if np.median(np.diff(ends)) < _FEWEST:
        return [slice(0, bias.size)]
    # what is too short for a sweep belongs to the one before
    begins = [at for at, end in pairwise(ends) if at == 0 or end - at >= _FEWEST]
    return [slice(begin, end) for begin, end in pairwise([*begins, bias.size])]


def _crossings(bias: Array) -> list[int]:
    """Rows at which the bias has another sign than before."""
    known = np.flatnonzero(bias != 0.0)
    return [int(known[at + 1]) for at in np.flatnonzero(np.diff(np.sign(bias[known])))]


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


def described(bias: Array, parts: list[slice]) -> str:
    """Say in words which sweeps there are."""
    words = []
    for part in parts:
        first, last = bias[part][0], bias[part][-1]
        way = "up" if abs(last) >= abs(first) else "down"
        sign = "negative, " if min(first, last) < 0.0 else ""
        count = part.stop - part.start
        words.append(f"{sign}{way} ({count} row{'s' * (count != 1)})")
    return ", ".join(words) if len(words) < 7 else f"{len(words)} sweeps"


def disagreements(
    bias: Array, parts: list[slice], data: dict[str, Array], symmetric: bool = True
) -> list[str]:
    """Say by how much sweeps differ from the first, if by more than noise.

    Polarities are compared if the circuit is symmetric.
    """
    found, along = [], np.abs(bias) if symmetric else bias
    for name, values in data.items():
        largest = np.nanmax(np.abs(values), initial=0.0)
        worst, which = 0.0, 0
        for number, part in enumerate(parts[1:], start=2):
            difference = _difference(along, values, parts[0], part)
            if difference.size < _ENOUGH:
                continue
            noise = np.sqrt(0.5 * np.mean(np.diff(difference) ** 2))
            size = np.sqrt(np.mean(difference**2))
            if size > max(_BEYOND_NOISE * noise, _DIFFERENT * largest) and size > worst:
                worst, which = size, number
        if which:
            found.append(
                f"{name} of sweep {which} differs from that of sweep 1 by {worst / largest:.1%} of "
                "its largest value (rms), which is more than noise: hysteresis or drift?"
            )
    return found


def _difference(along: Array, values: Array, one: slice, other: slice) -> Array:
    """Return what one sweep has beside another, rising in what is along both."""
    known = np.isfinite(values)
    (x, y), (at, found) = (
        _rising(along[part][known[part]], values[part][known[part]]) for part in (one, other)
    )
    if x.size < _FEWEST or at.size == 0:
        return np.empty(0)
    inside = (at >= x[0]) & (at <= x[-1])
    return np.asarray(found[inside] - np.interp(at[inside], x, y))


def _rising(x: Array, y: Array) -> tuple[Array, Array]:
    """Sort by bias; rows at the same bias count as their mean."""
    bias, place = np.unique(x, return_inverse=True)
    count = np.bincount(place, minlength=bias.size)
    return bias, np.bincount(place, weights=y, minlength=bias.size) / np.fmax(count, 1)
