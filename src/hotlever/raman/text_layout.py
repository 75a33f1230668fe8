"""Which parts of a table are spectra: columns beside each other, rows, or one below the other.

The Raman shift and the intensities are known by their headings, else by their numbers.
"""

from __future__ import annotations

import re
from itertools import combinations, pairwise

import numpy as np

from hotlever.errors import InputError, excerpt
from hotlever.raman.lineshape import MIN_SAMPLES, WINDOW, in_window
from hotlever.raman.spectrum import (
    Spectrum,
    positions,
    temperature_in_metadata,
    temperature_in_name,
)
from hotlever.tables import TextTable
from hotlever.types import Array, Index
from hotlever.units import quantity


def pick_spectra(table: TextTable) -> list[Spectrum]:
    """Every spectrum of a table, with what sets it apart: its position, or its column's heading.

    Raises
    ------
    InputError
        If there is none, or it is not clear which columns they are.
    """
    if table.array.shape[1] < 2:
        raise InputError(
            f"{table.path}: one column of numbers, expected Raman shift (cm⁻¹) and intensity"
        )
    return _in_rows(table) or _in_pairs(table) or _in_columns(table)


def _in_rows(table: TextTable) -> list[Spectrum]:
    """Spectra of a table with the axis in its first row or its headings, as LabSpec's maps."""
    values, names = table.array, table.names
    # fewer columns are those of a table
    if values.shape[1] <= 40:
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
    labels = positions(columns, len(rows))
    return [
        _labelled(first[axis], row[axis], columns, number, labels[number])
        for number, row in enumerate(rows)
    ]


def _heading(name: str) -> float:
    """The Raman shift that a column is headed by, NaN if it is headed by anything else."""
    value, unit = quantity(name.strip())
    is_shift = unit.strip() in ("", "cm-1", "cm^-1", "cm⁻¹", "1/cm")
    return value if value is not None and is_shift else np.nan


def _in_pairs(table: TextTable) -> list[Spectrum]:
    """Spectra of a table in which each intensity has an axis of its own before it."""
    values, names = table.array, table.names
    axes = range(0, values.shape[1], 2)
    if values.shape[1] < 4 or values.shape[1] % 2:
        return []
    if not all(is_axis(values[:, j]) and not is_axis(values[:, j + 1]) for j in axes):
        return []
    shifts = [raman_shift(table, j) for j in axes]
    if not all(covers_line(x) and not is_index(x) for x in shifts):
        return []
    return [
        _labelled(x, values[:, j + 1], {}, 0, heading=names[j + 1])
        for j, x in zip(axes, shifts, strict=True)
    ]


def _in_columns(table: TextTable) -> list[Spectrum]:
    """Spectra beside each other with one axis, or below each other as in WiRE's maps, or both."""
    values, names = table.array, table.names
    axis, x = axis_of(table)
    others = [j for j in range(values.shape[1]) if j != axis]
    groups = _groups(x, values, others)
    first = np.array([rows[0] for rows in groups])
    fixed = [
        j
        for j in others
        if len(groups) > 1 and all(np.ptp(values[rows, j]) == 0.0 for rows in groups)
    ]
    columns = {names[j].lstrip("#").strip(): values[first, j] for j in fixed if names[j]}
    chosen = intensities(table, [j for j in others if j not in fixed])
    headings = {column: names[column] if len(chosen) > 1 else "" for column in chosen}
    labels = positions(columns, len(groups))
    return [
        _labelled(x[rows], values[rows, column], columns, number, labels[number], heading)
        for number, rows in enumerate(groups)
        for column, heading in headings.items()
    ]


def _labelled(
    x: Array,
    y: Array,
    columns: dict[str, Array],
    number: int,
    label: str = "",
    heading: str = "",
) -> Spectrum:
    """A spectrum with its position and its column's heading as label, and the temperature there."""
    position = {name: f"{values[number]:g}" for name, values in columns.items()}
    temperature = temperature_in_name(heading) or temperature_in_metadata(position)
    return Spectrum(x, y, f"{label} {heading}".strip(), temperature=temperature)


def _groups(x: Array, values: Array, others: list[int]) -> list[Index]:
    """Rows of each spectrum: the axis begins again, or positions take turns along it."""
    begun = _begun_again(x)
    # if positions take turns each value of an axis stands in it more than once
    if len(begun) > 1 or x.size < 1.9 * np.unique(x).size:
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


def _begun_again(x: Array) -> list[Index]:
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
        # an axis that repeats half of one is that of another spectrum
        if start and not few and overlap >= 0.5 * shorter:
            starts.append(start)
            low, high = first, last
        low, high = min(low, first), max(high, last)
    return np.split(finite, starts[1:])


def axis_of(table: TextTable) -> tuple[int, Array]:
    """Index of the axis among the columns, and the Raman shift (cm⁻¹) in it.

    Raises
    ------
    InputError
        If no column is one, or it is a wavelength and the header does not name the laser.
    """
    values, names = table.array, table.names
    axes = [j for j in range(values.shape[1]) if is_axis(values[:, j])]
    shift = r"(?i)raman|shift|rel\.?\s*1/cm|wave\b|#wave|cm-1|cm\^-1|1/cm|cm⁻¹|cm\?1"
    headed = [j for j in axes if re.search(shift, names[j]) and not _is_wavelength(names[j])]
    headed += [j for j in axes if _names_wavelength(names[j])]
    reaching = [j for j in axes if reaches_line(values[:, j])]
    # a position in a map reaches it too, and an axis has many values there
    reaching = [j for j in reaching if covers_line(values[:, j])] or reaching
    absolute = [j for j in reaching if re.search(r"(?i)wave\s*numbers?", names[j])]
    # a running number reaches 520 too, but a later column may be the axis
    others = [j for j in reaching if not is_index(values[:, j])]
    axis = (*headed, *absolute, *others, *reaching, *axes, 0)[0]
    x = raman_shift(table, axis)
    require_line(x, table.path)
    in_window(np.unique(x[np.isfinite(x)]), f"{table.path}: ")
    if not axes:
        raise InputError(
            f"{table.path}: none of {len(names)} columns rises or falls all the way, expected a "
            "Raman shift (cm⁻¹) in one"
        )
    if not headed and _is_other_quantity(names[axis]):
        raise InputError(
            f"{table.path}: the axis is '{excerpt(names[axis])}', expected a Raman shift in cm⁻¹"
        )
    return axis, x


def _names_wavelength(name: str) -> bool:
    return bool(re.search(r"(?i)wave\s*length|lambda|\bnm\b|\(nm\)|\[nm\]", name))


def _is_wavelength(name: str) -> bool:
    return _names_wavelength(name) and not re.search(r"(?i)raman|shift", name)


def _is_other_quantity(name: str) -> bool:
    """Whether a heading ends in the unit of something that is no Raman shift and no intensity."""
    units = r"°?[CF]|[kmµμun]?(?:[VAKWsm]|Hz|Ohm|Ω|Pa|bar)|min|h"
    return re.search(rf"[\[(]\s*(?:{units})\s*[\])]\s*$", name) is not None


def raman_shift(table: TextTable, column: int) -> Array:
    """Return a column in cm⁻¹: a wavelength is converted by the laser that the header names."""
    x, name = table.array[:, column], table.names[column]
    if not _is_wavelength(name):
        return x
    laser = _laser(table.settings)
    if laser is None:
        raise InputError(
            f"{table.path}: the axis is a wavelength ('{excerpt(name)}') and the file does not "
            "name the laser; expected Raman shift in cm⁻¹, or a line like '#Laser (nm)= 532' above"
        )
    with np.errstate(divide="ignore"):
        return np.asarray(1e7 / laser - 1e7 / x)


def is_axis(column: Array) -> bool:
    """Whether a column rises or falls all the way, or does so time and again.

    Steps that do not lead on go back to its beginning, where a spectrum follows.
    """
    steps = np.diff(column[np.isfinite(column)])
    rising, falling = np.count_nonzero(steps > 0.0), np.count_nonzero(steps < 0.0)
    return bool(rising + falling and max(rising, falling) >= 0.9 * (rising + falling))


def is_index(column: Array) -> bool:
    """Whether a column counts its rows."""
    good = column[np.isfinite(column)]
    return bool(good.size > 1 and good[0] in (0.0, 1.0) and np.mean(np.diff(good) == 1.0) > 0.9)


def reaches_line(column: Array) -> bool:
    """Whether these values of an axis (cm⁻¹) hold silicon's line, and go on on both sides."""
    low, high = 515.0, 525.0
    good = column[np.isfinite(column)]
    return bool(good.min(initial=np.inf) <= low and good.max(initial=-np.inf) >= high)


def covers_line(column: Array) -> bool:
    """Whether these values reach silicon's line, and are enough around it to fit one."""
    low, high = WINDOW
    return reaches_line(column) and (
        np.unique(column[(column >= low) & (column <= high)]).size >= MIN_SAMPLES
    )


def _laser(metadata: dict[str, str]) -> float | None:
    """Laser wavelength in nm, if the header gives a plausible one."""
    for key, value in metadata.items():
        if re.search(r"(?i)laser|excitation", key) and not re.search(r"(?i)pol|power|level", key):
            number, _ = quantity(re.sub(r"^\D+", "", value))
            if number is not None and 200.0 < number < 1500.0:
                return number
    return None


def intensities(table: TextTable, others: list[int]) -> list[int]:
    """Columns that are spectra, of those beside the axis: by their names, else all that vary.

    Raises
    ------
    InputError
        If there are none, or if it is not clear which they are.
    """
    values, names = table.array, [name.strip() for name in table.names]
    useful = [j for j in others if np.nanmin(values[:, j]) < np.nanmax(values[:, j])]
    if not useful:
        raise InputError(f"{table.path}: no column of intensities beside the axis")
    # a second axis, such as a running number, is no intensity
    useful = [j for j in useful if not is_axis(values[:, j])] or useful
    kinds = {j: _kind(names[j]) for j in useful}
    spectra = [j for j in useful if kinds[j] >= 0]
    best = min((kinds[j] for j in spectra), default=-1)
    # beside what is clearly named, another column may be anything
    unclear = best < 2 and 3 in kinds.values()
    if unclear or (not spectra and len(useful) > 1):
        raise InputError(
            f"{table.path}: the columns beside the axis are {_listed(names, useful)}; expected "
            "intensities alone, or all of them named so"
        )
    chosen = [j for j in spectra if kinds[j] == best or best >= 2] or useful
    # a series of many is one
    for first, second in combinations(chosen[:8], 2):
        if _computed_from(values[:, first], values[:, second]):
            raise InputError(
                f"{table.path}: columns {first + 1} and {second + 1} rise and fall as one, as "
                "counts and their error do; expected spectra alone"
            )
    return chosen


def _kind(name: str) -> int:
    """Return as what kind of intensity a column is named: the first that a table has are spectra.

    They are 0, corrected ones; 1, intensities; 2, raw ones, where the file has no others, or any
    that a user has named; 3, none of these; and -1, something else.
    """
    kinds = (
        r"(?i)(dark|baseline|background)\s*subtracted|corrected|processed|raw\s*[-−–]\s*dark",
        r"(?i)intensity|counts|cts|signal|ccd|raman\s*int",
        r"(?i)raw|spectrum|sample|data|\by\b",
    )
    others = (
        r"(?i)pixel|index|^dark\b(?!\s*sub)|^reference$|%|absorb|irrad|transm|reflect|wave"
        r"|^#?[xz]\b|time|background|baseline|std|\berr|error|sigma|uncert|±|\bfit|model|resid"
        r"|weight|smooth|mask|flag"
    )
    if re.search(others, name) and not re.search(kinds[0], name):
        return -1
    kind = next((kind for kind, pattern in enumerate(kinds) if re.search(pattern, name)), 3)
    other = _is_other_quantity(name) and temperature_in_name(name) is None
    return -1 if kind == 3 and other else kind


def _listed(names: list[str], which: list[int]) -> str:
    quoted = [f"'{excerpt(names[j], 20)}'" for j in which]
    return ", ".join(quoted[:6]) + (", …" if len(quoted) > 6 else "")


def _computed_from(first: Array, second: Array) -> bool:
    """Whether one column is a rising function of the other, but no multiple: √counts of counts."""
    good = np.isfinite(first) & np.isfinite(second)
    first, second = first[good], second[good]
    in_order = second[np.lexsort((second, first))]
    if in_order.size < 3 or not np.ptp(first) > 0.0 < np.ptp(second):
        return False
    straight = np.corrcoef(first, second)[0, 1] > 1.0 - 1e-6
    return bool(np.all(np.diff(in_order) >= 0.0) and not straight)


def require_line(x: Array, where: str) -> None:
    """Raise InputError if these values of an axis (cm⁻¹) do not hold silicon's line."""
    if not reaches_line(x):
        good = x[np.isfinite(x)]
        span = f"from {good.min():g} to {good.max():g}" if good.size else "over no numbers"
        raise InputError(
            f"{where}: the axis runs {span}, expected a Raman shift that covers silicon's line "
            "at 520 cm⁻¹"
        )
