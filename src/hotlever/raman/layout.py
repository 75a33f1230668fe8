"""How a table holds its spectra: in columns, in rows, or one below the other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import InputError
from hotlever.raman.block import Block
from hotlever.raman.columns import (
    axis_of,
    covers_line,
    intensities,
    is_axis,
    is_index,
    raman_shift,
    reaches_line,
)
from hotlever.raman.part import Part, positions
from hotlever.raman.peak import MIN_SAMPLES
from hotlever.raman.stated import temperature_in_metadata, temperature_in_name
from hotlever.types import Array
from hotlever.units import quantity

Rows = NDArray[np.intp]

_MAP_COLUMNS = 40  # from so many on, rows may be spectra
_SHIFT_UNITS = ("", "cm-1", "cm^-1", "cm⁻¹", "1/cm")
_TURNS = 1.9  # times that each value of an axis stands in it, if positions take turns
_OVERLAP = 0.5  # part of an axis that it repeats, from which on it is that of another spectrum


def pick_spectra(table: Block, where: str) -> list[Part]:
    """Every spectrum of a table, with what sets it apart: its position, or its column's heading.

    Raises
    ------
    InputError
        If there is none, or it is not clear which columns they are.
    """
    if table.values.shape[1] < 2:
        raise InputError(
            f"{where}: one column of numbers, expected Raman shift (cm⁻¹) and intensity"
        )
    return _in_rows(table) or _in_pairs(table, where) or _in_columns(table, where)


def _in_rows(table: Block) -> list[Part]:
    """Spectra of a table with the axis in its first row or its headings, as LabSpec's maps."""
    values, names = table.values, table.names
    if values.shape[1] <= _MAP_COLUMNS:
        return []
    first, rows = values[0], values[1:]
    if not (is_axis(first) and reaches_line(first)):
        first, rows = np.array([_heading(name) for name in names]), values
        beside = any(covers_line(x) and is_axis(x) and not is_index(x) for x in values.T)
        if beside or not (is_axis(first) and covers_line(first)):
            return []
    # positions stand before each spectrum, with blanks or names above them
    axis = np.isfinite(first)
    columns = {names[j]: rows[:, j] for j in np.flatnonzero(~axis) if names[j]}
    return _placed([(first[axis], row[axis]) for row in rows], columns)


def _heading(name: str) -> float:
    """The Raman shift that a column is headed by, NaN if it is headed by anything else."""
    value, unit = quantity(name.strip())
    return value if value is not None and unit.strip() in _SHIFT_UNITS else np.nan


def _in_pairs(table: Block, where: str) -> list[Part]:
    """Spectra of a table in which each intensity has an axis of its own before it."""
    values, names = table.values, table.names
    axes = range(0, values.shape[1], 2)
    if values.shape[1] < 4 or values.shape[1] % 2:
        return []
    if not all(is_axis(values[:, j]) and not is_axis(values[:, j + 1]) for j in axes):
        return []
    shifts = [raman_shift(table, j, where) for j in axes]
    if not all(covers_line(x) and not is_index(x) for x in shifts):
        return []
    return [
        Part(x, values[:, j + 1], names[j + 1], temperature_in_name(names[j + 1]))
        for j, x in zip(axes, shifts, strict=True)
    ]


def _in_columns(table: Block, where: str) -> list[Part]:
    """Spectra beside each other with one axis, or below each other as in WiRE's maps, or both."""
    values, names = table.values, table.names
    at, x = axis_of(table, where)
    others = [j for j in range(values.shape[1]) if j != at]
    groups = _groups(x, values, others)
    first = np.array([rows[0] for rows in groups])
    fixed = [
        j
        for j in others
        if len(groups) > 1 and all(np.ptp(values[rows, j]) == 0.0 for rows in groups)
    ]
    columns = {names[j].lstrip("#").strip(): values[first, j] for j in fixed if names[j]}
    chosen = intensities(table, [j for j in others if j not in fixed], where)
    pairs = [(x[rows], values[rows]) for rows in groups]
    parts = [_placed([(shift, rows[:, j]) for shift, rows in pairs], columns) for j in chosen]
    if len(chosen) == 1:
        return parts[0]
    return [
        Part(
            part.x,
            part.y,
            f"{part.label} {names[j]}".strip(),
            temperature_in_name(names[j]) or part.temperature,
        )
        for several in zip(*parts, strict=True)
        for j, part in zip(chosen, several, strict=True)
    ]


def _placed(pairs: list[tuple[Array, Array]], columns: dict[str, Array]) -> list[Part]:
    """Spectra with the quantities of each as its label, and its temperature among them."""
    labels = positions(columns, len(pairs))
    return [
        Part(
            x,
            y,
            labels[i],
            temperature_in_metadata({name: f"{values[i]:g}" for name, values in columns.items()}),
        )
        for i, (x, y) in enumerate(pairs)
    ]


def _groups(x: Array, values: Array, others: list[int]) -> list[Rows]:
    """Rows of each spectrum: the axis begins again, or positions take turns along it."""
    begun = _begun_again(x)
    if len(begun) > 1 or x.size < _TURNS * np.unique(x).size:
        return begun
    distinct = {j: np.unique(values[:, j]).size for j in others}
    few = sorted(
        (j for j in others if distinct[j] <= x.size / MIN_SAMPLES), key=lambda j: distinct[j]
    )
    for count in range(1, len(few) + 1):
        _, which = np.unique(values[:, few[:count]], axis=0, return_inverse=True)
        order = np.argsort(which.ravel(), kind="stable")
        groups = np.split(order, np.flatnonzero(np.diff(which.ravel()[order])) + 1)
        if len(groups) <= x.size / MIN_SAMPLES and all(
            np.unique(x[rows]).size == rows.size for rows in groups
        ):
            return sorted(groups, key=lambda rows: int(rows[0]))
    return begun


def _begun_again(x: Array) -> list[Rows]:
    """Rows between the places where an axis begins again; windows that overlap stay together."""
    finite = np.flatnonzero(np.isfinite(x))
    steps = np.diff(x[finite])
    forward = -1.0 if np.count_nonzero(steps < 0.0) > np.count_nonzero(steps > 0.0) else 1.0
    along = forward * x[finite]
    cuts = [0, *(np.flatnonzero(np.diff(along) < 0.0) + 1).tolist(), finite.size]
    starts, low, high = [0], along[0], -np.inf
    for start, end in pairwise(cuts):
        first, last = along[start], along[end - 1]
        overlap, shorter = high - first, min(high - low, last - first)
        few = min(start - starts[-1], end - start) < MIN_SAMPLES
        if start and not few and overlap >= _OVERLAP * shorter:
            starts.append(start)
            low, high = first, last
        low, high = min(low, first), max(high, last)
    return np.split(finite, starts[1:])
