"""Which column of a table is the Raman shift, and which the intensity."""

from __future__ import annotations

import re

import numpy as np

from hotlever.errors import InputError
from hotlever.raman.block import Block
from hotlever.types import Array
from hotlever.units import quantity

#: cm⁻¹; a spectrum must reach the line, and go on so far on both sides.
SILICON_LINE, MARGIN = 520.0, 5.0

_MAP_COLUMNS = 40
_SHIFT = re.compile(r"raman|shift|rel\.?\s*1/cm|wave\b|#wave|cm-1|cm\^-1|1/cm|cm⁻¹|cm\?1", re.I)
_RAMAN = re.compile(r"raman|shift", re.I)
_ABSOLUTE = re.compile(r"wave\s*numbers?", re.I)
_WAVELENGTH = re.compile(r"wave\s*length|lambda|\bnm\b|\(nm\)|\[nm\]", re.I)
_WANTED = (
    re.compile(r"dark\s*subtracted|corrected", re.I),
    re.compile(r"intensity|counts|cts|signal|ccd|raman\s*int", re.I),
    re.compile(r"raw|spectrum|sample|data|\by\b", re.I),
)
_LASER = re.compile(r"laser|excitation", re.I)
_NO_WAVELENGTH = re.compile(r"pol|power|level", re.I)
_UNWANTED = re.compile(
    r"pixel|index|^dark$|^reference$|%|absorb|irrad|transm|reflect|wave|^#?[xz]\b|time|background"
    r"|baseline|std|error|sigma",
    re.I,
)


def pick_spectra(table: Block, where: str) -> list[tuple[Array, Array]]:
    """Raman shift (cm⁻¹) and intensity, by the columns' names or their values.

    One pair, unless the table is a map: an axis in its first row and a spectrum in each other.

    Raises
    ------
    InputError
        If there are no two such columns, or the axis is a wavelength without its laser.
    """
    values = table.values
    if values.shape[1] < 2:
        raise InputError(
            f"{where}: one column of numbers, expected Raman shift (cm⁻¹) and intensity"
        )
    first = values[0]
    if values.shape[1] > _MAP_COLUMNS and _is_axis(first) and reaches_line(first):
        # LabSpec's maps: positions stand before each spectrum, blanks above them
        axis = np.isfinite(first)
        return [(first[axis], row[axis]) for row in values[1:]]
    at, laser = _x_column(table, where)
    x = values[:, at]
    if laser is not None:
        with np.errstate(divide="ignore"):
            x = 1e7 / laser - 1e7 / x
    require_line(x, where)
    others = [j for j in range(values.shape[1]) if j != at]
    return [(x, values[:, _y_column(table, others, where)])]


def _x_column(table: Block, where: str) -> tuple[int, float | None]:
    """Index of the axis column, and the laser wavelength if it is to be converted by it."""
    values, names = table.values, table.names
    axes = [j for j in range(values.shape[1]) if _is_axis(values[:, j])]
    for j in axes:
        wavelength = _WAVELENGTH.search(names[j]) and not _RAMAN.search(names[j])
        if _SHIFT.search(names[j]) and not wavelength:
            return j, None
    for j in axes:
        if _WAVELENGTH.search(names[j]):
            laser = _laser(table.metadata)
            if laser is None:
                raise InputError(
                    f"{where}: the axis is a wavelength ('{names[j].strip()}') and the file does "
                    "not name the laser; expected Raman shift in cm⁻¹"
                )
            return j, laser
    reaching = [j for j in axes if reaches_line(values[:, j])]
    named = [j for j in reaching if _ABSOLUTE.search(names[j])]
    # a running number reaches 520 too, but a later column may be the axis
    others = [j for j in reaching if not _is_index(values[:, j])]
    return (*named, *others, *reaching, *axes, 0)[0], None


def _is_axis(column: Array) -> bool:
    steps = np.diff(column[np.isfinite(column)])
    return bool(steps.any() and max(np.mean(steps >= 0), np.mean(steps <= 0)) > 0.98)


def _is_index(column: Array) -> bool:
    good = column[np.isfinite(column)]
    return bool(good.size > 1 and good[0] in (0.0, 1.0) and np.all(np.diff(good) == 1.0))


def reaches_line(column: Array) -> bool:
    """Whether these values of an axis (cm⁻¹) hold silicon's line."""
    low, high = SILICON_LINE - MARGIN, SILICON_LINE + MARGIN
    good = column[np.isfinite(column)]
    return bool(good.min(initial=np.inf) <= low and good.max(initial=-np.inf) >= high)


def _laser(metadata: dict[str, str]) -> float | None:
    """Laser wavelength in nm, if the header gives a plausible one."""
    for key, value in metadata.items():
        if _LASER.search(key) and not _NO_WAVELENGTH.search(key):
            number, _ = quantity(re.sub(r"^\D+", "", value))
            if number is not None and 200.0 < number < 1500.0:
                return number
    return None


def _y_column(table: Block, others: list[int], where: str) -> int:
    values, names = table.values, [name.strip() for name in table.names]
    useful = [j for j in others if np.nanmin(values[:, j]) < np.nanmax(values[:, j])]
    if not useful:
        raise InputError(f"{where}: no column of intensities beside the axis")
    # a second axis, such as a running number, is no intensity
    useful = [j for j in useful if not _is_axis(values[:, j])] or useful
    useful = [j for j in useful if not _UNWANTED.search(names[j])] or useful
    named = (j for wanted in _WANTED for j in useful if wanted.search(names[j]))
    return next((j for j in named if not _UNWANTED.search(names[j])), useful[0])


def require_line(x: Array, where: str) -> None:
    """Raise InputError if these values of an axis (cm⁻¹) do not hold silicon's line."""
    if not reaches_line(x):
        good = x[np.isfinite(x)]
        span = f"from {good.min():g} to {good.max():g}" if good.size else "over no numbers"
        raise InputError(
            f"{where}: the axis runs {span}, expected a Raman shift that covers silicon's line "
            f"at {SILICON_LINE:g} cm⁻¹"
        )
