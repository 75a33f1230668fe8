"""Rows at the limit of an instrument: a source at compliance, a meter at the end of its range.

There a column stands still at its largest value, while the curve beside it says that it would go
on. What stands still for other reasons stays: a current that is at its maximum itself, a column
that is too coarse to tell, a bias that was set again and again.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hotlever.errors import counted
from hotlever.measurement.data import Measurement
from hotlever.measurement.rows import sweeps_of
from hotlever.probe import Circuit
from hotlever.quantities import MEASURANDS, OBSERVABLES
from hotlever.types import Array, Mask


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
