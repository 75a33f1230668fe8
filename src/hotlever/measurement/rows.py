"""The rows of a measurement: sweeps, many averaged to some, those at a limit of an instrument.

What least squares makes of averages stays the same. Rows at one bias count in a sum of squares by
their mean alone, as often as there are rows, so for independent errors nothing is lost; nor is it
for rows of slightly different biases between which the model is a straight line. What is left is
its bend: the mean of a step of width h lies h²/24 times the second derivative beside the model at
the mean bias, some mK of the tip temperature.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from hotlever.errors import counted
from hotlever.measurement.data import Measurement, as_attributes
from hotlever.probe import Circuit
from hotlever.quantities import FITTED, MEASURANDS, OBSERVABLES
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


# --- rows at the limit of an instrument ----------------------------------------------------------

# A source is at compliance, or a meter at the end of its range, where a column stands still at its
# largest value, while the curve beside it says that it would go on. What stands still for other
# reasons stays: a current that is at its maximum itself, a column that is too coarse to tell, a
# bias that was set again and again.


@dataclass(frozen=True)
class ComplianceOptions:
    """What counts as standing still, and as going on.

    Attributes
    ----------
    level : float
        Rows are level with the largest magnitude of a column within this share of it.
    apart : float
        Share of the largest magnitude within which the limits of both polarities are.
    change : float
        Change that the curve beside them lets expect over several level rows, a share of the
        largest, from which on they are at a limit. About a smooth maximum it is less than 15 times
        ``level``.
    change_of_few : float
        The same of two rows, or of four that are no neighbours, which may be level by chance.
    several, many : int
        Neighbours that are not level by chance, and rows that are not, wherever they are.
    finer : float
        By how many times the resolution of a column is finer than that change.
    same : float
        Share of the usual step of the other column within which rows are one.
    regular : float
        Share of a step by which regular steps differ.
    going_on : float
        Share of the level rows of what was set in regular steps that differ in the other column,
        from which on that goes on as if the bias did. What drifts while the bias is held does not.
    multiple : float
        Share of a step by which differences of a coarse column may be off its multiples.
    fewest : int
        Rows beside the level ones that tell how the curve goes on.
    named : int
        Rows that a note names one by one.
    """

    level: float = 1e-4
    apart: float = 0.05
    change: float = 2e-3
    change_of_few: float = 1e-2
    several: int = 3
    many: int = 5
    finer: float = 10.0
    same: float = 0.3
    regular: float = 0.1
    going_on: float = 0.4
    multiple: float = 0.15
    fewest: int = 5
    named: int = 8


def is_level(values: Array) -> Mask:
    """Return which values, (n,), are level with the one of the largest magnitude."""
    size = np.abs(values)
    return np.asarray(size >= (1.0 - ComplianceOptions.level) * np.nanmax(size, initial=0.0))


def without_rows_at_compliance(
    measurement: Measurement, circuit: Circuit | None = None
) -> Measurement:
    """Return a measurement without rows at a limit of an instrument; a note names them.

    Of a voltmeter that heats nothing its value is left out alone.

    Parameters
    ----------
    measurement : Measurement
        As it is returned if it has no such rows, or is one in time.
    circuit : Circuit, optional
        By whose R_s the voltage over the lever follows, unless the measurement has another one.
    """
    options = ComplianceOptions()
    if measurement.time_us is not None:
        return measurement
    while True:
        for column in _columns(measurement, circuit):
            rows = _at_limit(measurement, column, options)
            if rows.any():
                measurement = _left_out(measurement, column, rows, options)
                break
        else:
            return measurement


@dataclass(frozen=True)
class _Column:
    """A column that may be at a limit, (n,), and the other one by which it changes.

    With those of a source a row stands and falls.
    """

    symbol: str
    values: Array
    along_symbol: str
    along: Array
    of_source: bool


def _columns(measurement: Measurement, circuit: Circuit | None) -> Iterator[_Column]:
    """Give the columns that may be at a limit."""
    bias, current = measurement.bias_V, measurement.current_mA
    yield _Column("I_h", current, "V_b", bias, of_source=True)
    yield _Column("V_b", bias, "I_h", current, of_source=True)
    ohm = measurement.series_resistance_ohm
    if ohm is None and circuit is not None:
        ohm = circuit.series_resistance_ohm
    if ohm:
        lever = Circuit(series_resistance_ohm=ohm).lever_voltage(bias, current)
        yield _Column("V_l", lever, "I_h", current, of_source=True)
    for name, meter in OBSERVABLES.items():
        if meter.unit == "V":
            shown = measurement.observable(name)
            yield _Column(meter.symbol, shown, "V_b", bias, of_source=False)


def _at_limit(measurement: Measurement, column: _Column, options: ComplianceOptions) -> Mask:
    """Return which rows are at a limit, (n,): those that are level in a sweep that is seen to stop.

    The limit may be a little apart in each polarity, by the meter's offset. Where it is the highest
    value of all, rows of other sweeps that are level with it are at it too.
    """
    values, along = column.values, column.along
    usable = np.isfinite(values) & np.isfinite(along)
    level = usable & is_level(np.where(usable, values, np.nan))
    stopped, largest = np.zeros_like(level), np.abs(values[usable]).max(initial=0.0)
    distance = measurement.distance_um
    place = np.zeros(level.shape) if distance is None else np.nan_to_num(distance)
    for each in np.unique(place[usable]):
        rows = np.flatnonzero(usable & (place == each))
        for sweep in sweeps_of(measurement.bias_V[rows]):
            part = rows[sweep]
            part = part[np.argsort(along[part], kind="stable")]
            highest = is_level(values[part])
            near = np.abs(values[part]).max() >= (1.0 - options.apart) * largest
            if near and _stops(np.abs(along[part]), np.abs(values[part]), highest, options):
                stopped[part[highest]] = True
    return stopped | level if (stopped & level).any() else stopped


def _stops(x: Array, y: Array, level: Mask, options: ComplianceOptions) -> bool:
    """Return whether a sweep, by x, stands still at its highest values where it would go on."""
    order = np.argsort(x, kind="stable")
    x, y, level = x[order], y[order], level[order]
    steps = np.diff(x[~level])
    steps = steps[steps > options.level * np.ptp(x)]
    if level.sum() < 2 or steps.size < options.fewest - 1:
        return False
    same = options.same * float(np.median(steps))

    def different(rows: slice | Mask) -> int:
        return 1 + int(np.sum(np.diff(x[rows]) > same))

    is_set = _is_regular(y[~level], options) and not _is_regular(x, options)
    if is_set and different(level) < options.going_on * level.sum():
        return False  # held, while something else was read
    edges = np.flatnonzero(np.diff(level, prepend=False, append=False))
    runs = [slice(first, end) for first, end in edges.reshape(-1, 2).tolist()]
    counts, total = [different(run) for run in runs], different(level)
    changes = [_expected_change(x, y, run, same) / y.max() for run in runs]
    telling = [
        change
        for change, count in zip(changes, counts, strict=True)
        if count >= options.several or total >= options.many
    ]
    if telling:
        change = max(telling)
        stops = change >= options.change
    else:
        change = min(changes)
        stops = total > 1 and change >= options.change_of_few
        stops = stops and not _is_expected(x, y, level, runs, options)
    return stops and not _is_coarse(y[~level], change * y.max(), options)


def _expected_change(x: Array, y: Array, run: slice, same: float) -> float:
    """Return by how much y would change over a run of level rows, as it does beside them.

    That is how far it falls as far away as the run is wide, or twice as far; on the side where it
    falls less, if both reach so far.
    """
    width = float(x[run.stop - 1] - x[run.start])
    reach = max(width, same)
    far, near = list[float](), list[float]()
    for distance, values in (
        (x[run.start] - x[: run.start][::-1], y[: run.start][::-1]),
        (x[run.stop :] - x[run.stop - 1], y[run.stop :]),
    ):
        if not (distance > 0.0).any():
            continue
        falls = []
        for times in (1.0, 2.0):
            row = min(int(np.searchsorted(distance, times * reach)), distance.size - 1)
            share = min(1.0, width / distance[row]) if width > same else 1.0 / times
            falls.append((y.max() - values[row]) * share)
        (far if distance[-1] >= reach else near).append(float(max(falls)))
    return min(far) if far else max(near, default=0.0)


def _is_expected(
    x: Array, y: Array, level: Mask, runs: list[slice], options: ComplianceOptions
) -> bool:
    """Whether a smooth curve through the rows beside level ones has them where they are."""
    for run in runs:
        before, after = np.flatnonzero(~level[: run.start]), np.flatnonzero(~level[run.stop :])
        before, after = before[-options.fewest + 1 :], run.stop + after[: options.fewest - 1]
        beside = np.concatenate([before, after])
        if min(before.size, after.size) < options.several:
            one_side = np.flatnonzero(~level)
            one_side = one_side[np.argsort(np.abs(one_side - run.start), kind="stable")]
            beside, degree = np.sort(one_side[: options.fewest]), 2
        else:
            degree = 3
        if np.ptp(x[beside]) == 0.0:
            return False
        smooth = np.polynomial.Polynomial.fit(x[beside], y[beside], degree)
        if np.abs(smooth(x[run]) - y.max()).max() > options.change * y.max():
            return False
    return True


def _is_regular(values: Array, options: ComplianceOptions) -> bool:
    """Whether values rise in equal steps, as those that are set do."""
    levels = np.unique(values)
    steps = np.diff(levels)
    steps = steps[steps > options.level * np.abs(levels).max(initial=0.0)]
    return bool(steps.size > 2 and np.ptp(steps) < options.regular * np.median(steps))


def _is_coarse(values: Array, change: float, options: ComplianceOptions) -> bool:
    """Whether all values are apart by multiples of a step too coarse to tell a change.

    Where each is one step from the next, and none is repeated, that is the curve's own.
    """
    levels = np.unique(values)
    apart = np.diff(levels)
    apart = apart[apart > 1e-9 * levels[-1]]  # beyond rounding errors
    least = change / options.finer
    if apart.size < options.fewest - 1:
        return False
    step, divisor = float(apart.min()), 1
    while step >= least:
        for _ in range(3):  # by least squares
            multiples = np.round(apart / step)
            step = float(multiples @ apart / (multiples @ multiples))
        if np.abs(apart / step - multiples).max() < options.multiple:
            return bool(multiples.max() > 1 or levels.size < values.size)
        divisor += 1
        step = float(apart.min()) / divisor
    return False


def _left_out(
    measurement: Measurement, column: _Column, rows: Mask, options: ComplianceOptions
) -> Measurement:
    """Return a measurement without what was measured at a limit, and a note on it."""
    at = [f"{value:.4g}" for value in np.unique(column.along[rows]).tolist()]
    where = f"{at[0]} to {at[-1]}" if len(at) > options.named else ", ".join(at)
    unit, other = (MEASURANDS[symbol].typed_unit for symbol in (column.symbol, column.along_symbol))
    note = (
        f"{measurement.path or 'measurement'}: {column.symbol} is clipped at "
        f"{np.abs(column.values[rows]).max():.4g} {unit}, by the compliance of its source or the "
        f"range of its meter: {counted(int(rows.sum()), 'row')} at {where} {other} "
    )
    notes = (*measurement.notes, note + "left out")
    if column.of_source:
        return replace(measurement.part(~rows), notes=notes)
    changed: Any = {MEASURANDS[column.symbol].name: np.where(rows, np.nan, column.values)}
    return replace(measurement, notes=notes, **changed)
