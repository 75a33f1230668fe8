"""Which column of a table is the Raman shift, and which are intensities."""

from __future__ import annotations

import re
from itertools import combinations

import numpy as np

from hotlever.errors import InputError, shown
from hotlever.raman.block import Block
from hotlever.raman.peak import MIN_SAMPLES, WINDOW, in_window
from hotlever.raman.stated import temperature_in_name
from hotlever.types import Array
from hotlever.units import quantity

#: cm⁻¹; a spectrum must reach the line, and go on so far on both sides.
SILICON_LINE, MARGIN = 520.0, 5.0

#: Steps of an axis that lead on; the others go back to its beginning, where a spectrum follows.
_STEADY = 0.9
_SHIFT = re.compile(r"raman|shift|rel\.?\s*1/cm|wave\b|#wave|cm-1|cm\^-1|1/cm|cm⁻¹|cm\?1", re.I)
_RAMAN = re.compile(r"raman|shift", re.I)
_ABSOLUTE = re.compile(r"wave\s*numbers?", re.I)
_WAVELENGTH = re.compile(r"wave\s*length|lambda|\bnm\b|\(nm\)|\[nm\]", re.I)
#: What intensities are called: the first of these kinds that a table has are the spectra.
_WANTED = (
    re.compile(
        r"(dark|baseline|background)\s*subtracted|corrected|processed|raw\s*[-−–]\s*dark", re.I
    ),
    re.compile(r"intensity|counts|cts|signal|ccd|raman\s*int", re.I),
    # raw ones, where the file has no others, or any that a user has named
    re.compile(r"raw|spectrum|sample|data|\by\b", re.I),
)
_OTHER, _PLAIN, _UNNAMED = -1, 2, 3  # kinds of columns beside the places in _WANTED
_LASER = re.compile(r"laser|excitation", re.I)
_NO_WAVELENGTH = re.compile(r"pol|power|level", re.I)
_UNWANTED = re.compile(
    r"pixel|index|^dark\b(?!\s*sub)|^reference$|%|absorb|irrad|transm|reflect|wave|^#?[xz]\b|time"
    r"|background|baseline|std|\berr|error|sigma|uncert|±|\bfit|model|resid|weight|smooth|mask|flag",
    re.I,
)
_MOST_COMPARED = 8  # columns; a series of many is one
_OTHER_QUANTITY = re.compile(
    r"[\[(]\s*(?:°?[CF]|[kmµμun]?(?:[VAKWsm]|Hz|Ohm|Ω|Pa|bar)|min|h)\s*[\])]\s*$"
)


def axis_of(table: Block, where: str) -> tuple[int, Array]:
    """Place of the axis among the columns, and the Raman shift (cm⁻¹) in it.

    Raises
    ------
    InputError
        If no column is one, or it is a wavelength and the header does not name the laser.
    """
    values, names = table.values, table.names
    axes = [j for j in range(values.shape[1]) if is_axis(values[:, j])]
    for j in axes:
        wavelength = _WAVELENGTH.search(names[j]) and not _RAMAN.search(names[j])
        if _SHIFT.search(names[j]) and not wavelength:
            return _checked(table, j, where)
    for j in axes:
        if _WAVELENGTH.search(names[j]):
            return _checked(table, j, where)
    reaching = [j for j in axes if reaches_line(values[:, j])]
    # a position in a map reaches it too, and an axis has many values there
    reaching = [j for j in reaching if covers_line(values[:, j])] or reaching
    named = [j for j in reaching if _ABSOLUTE.search(names[j])]
    # a running number reaches 520 too, but a later column may be the axis
    others = [j for j in reaching if not is_index(values[:, j])]
    at, x = _checked(table, (*named, *others, *reaching, *axes, 0)[0], where)
    if not axes:
        raise InputError(
            f"{where}: none of {len(names)} columns rises or falls all the way, expected a Raman "
            "shift (cm⁻¹) in one"
        )
    if _OTHER_QUANTITY.search(names[at]):
        raise InputError(
            f"{where}: the axis is '{shown(names[at])}', expected a Raman shift in cm⁻¹"
        )
    return at, x


def _checked(table: Block, at: int, where: str) -> tuple[int, Array]:
    """The column as a Raman shift that holds silicon's line, or InputError."""
    x = raman_shift(table, at, where)
    require_line(x, where)
    in_window(np.unique(x[np.isfinite(x)]), f"{where}: ")
    return at, x


def raman_shift(table: Block, at: int, where: str) -> Array:
    """Return a column in cm⁻¹: a wavelength is converted by the laser that the header names."""
    x, name = table.values[:, at], table.names[at]
    if not _WAVELENGTH.search(name) or _RAMAN.search(name):
        return x
    laser = _laser(table.metadata)
    if laser is None:
        raise InputError(
            f"{where}: the axis is a wavelength ('{shown(name)}') and the file does not name the "
            "laser; expected Raman shift in cm⁻¹, or a line like '#Laser (nm)= 532' above"
        )
    with np.errstate(divide="ignore"):
        return np.asarray(1e7 / laser - 1e7 / x)


def is_axis(column: Array) -> bool:
    """Whether a column rises or falls all the way, or does so time and again."""
    steps = np.diff(column[np.isfinite(column)])
    rising, falling = np.count_nonzero(steps > 0.0), np.count_nonzero(steps < 0.0)
    return bool(rising + falling and max(rising, falling) >= _STEADY * (rising + falling))


def is_index(column: Array) -> bool:
    """Whether a column counts its rows."""
    good = column[np.isfinite(column)]
    return bool(good.size > 1 and good[0] in (0.0, 1.0) and np.mean(np.diff(good) == 1.0) > _STEADY)


def reaches_line(column: Array) -> bool:
    """Whether these values of an axis (cm⁻¹) hold silicon's line."""
    low, high = SILICON_LINE - MARGIN, SILICON_LINE + MARGIN
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
        if _LASER.search(key) and not _NO_WAVELENGTH.search(key):
            number, _ = quantity(re.sub(r"^\D+", "", value))
            if number is not None and 200.0 < number < 1500.0:
                return number
    return None


def intensities(table: Block, others: list[int], where: str) -> list[int]:
    """Columns that are spectra, of those beside the axis: by their names, else all that vary.

    Raises
    ------
    InputError
        If there are none, or if it is not clear which they are.
    """
    values, names = table.values, [name.strip() for name in table.names]
    useful = [j for j in others if np.nanmin(values[:, j]) < np.nanmax(values[:, j])]
    if not useful:
        raise InputError(f"{where}: no column of intensities beside the axis")
    # a second axis, such as a running number, is no intensity
    useful = [j for j in useful if not is_axis(values[:, j])] or useful
    kinds = {j: _kind(names[j]) for j in useful}
    spectra = [j for j in useful if kinds[j] != _OTHER]
    best = min((kinds[j] for j in spectra), default=_OTHER)
    # beside what is clearly named, another column may be anything
    unclear = best < _PLAIN and _UNNAMED in kinds.values()
    if unclear or (not spectra and len(useful) > 1):
        raise InputError(
            f"{where}: the columns beside the axis are {_listed(names, useful)}; expected "
            "intensities alone, or all of them named so"
        )
    found = [j for j in spectra if kinds[j] == best or best >= _PLAIN] or useful
    for first, second in combinations(found[:_MOST_COMPARED], 2):
        if _computed_from(values[:, first], values[:, second]):
            raise InputError(
                f"{where}: columns {first + 1} and {second + 1} rise and fall as one, as counts "
                "and their error do; expected spectra alone"
            )
    return found


def _kind(name: str) -> int:
    """Place in `_WANTED` of what a column is named as, `_UNNAMED` if in none, or `_OTHER`."""
    if _UNWANTED.search(name) and not _WANTED[0].search(name):
        return _OTHER
    found = next((i for i, wanted in enumerate(_WANTED) if wanted.search(name)), _UNNAMED)
    quantity = _OTHER_QUANTITY.search(name) and temperature_in_name(name) is None
    return _OTHER if found == _UNNAMED and quantity else found


def _listed(names: list[str], which: list[int]) -> str:
    quoted = [f"'{shown(names[j], 20)}'" for j in which]
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
            f"at {SILICON_LINE:g} cm⁻¹"
        )
