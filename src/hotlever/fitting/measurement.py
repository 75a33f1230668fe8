"""Measured data sets: bias, current, reader voltage and tip temperature of one lever."""

from __future__ import annotations

import hashlib
import math
import os
import re
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from hotlever.air.surroundings import Medium
from hotlever.errors import InputError, unknown_name
from hotlever.files import read_text

Array = NDArray[np.float64]

#: Quantities of a measurement file: symbol in the header, attribute, unit inside.
COLUMNS = {
    "V_b": ("bias_V", "V"),
    "I_h": ("current_mA", "mA"),
    "V_r": ("reader_V", "V"),
    "T_tip": ("tip_K", "K"),
    "dT_tip": ("tip_error_K", "delta_K"),
    "dI_h": ("current_error_mA", "mA"),
    "dV_r": ("reader_error_V", "V"),
}
#: The columns a fit can compare, by the name users give it.
OBSERVABLE_SYMBOLS = {"current": "I_h", "reader": "V_r", "tip": "T_tip"}
#: Settings in comment lines: name, attribute, unit inside.
SETTINGS = {
    "r_s": ("series_resistance_ohm", "ohm"),
    "base temperature": ("base_temperature_K", "K"),
}

_NAME_AND_UNIT = re.compile(r"^\s*(?P<name>[^()\[\]]+?)\s*[(\[](?P<unit>[^)\]]*)[)\]]\s*$")
_SETTING = re.compile(
    r"^#\s*(?P<name>[^():\[\]]+?)\s*[(\[](?P<unit>[^)\]]*)[)\]]\s*[:=]\s*(?P<value>\S+)\s*$"
)
_MEDIUM = re.compile(r"^#\s*medium\s*[:=]\s*([A-Za-z]+)", re.IGNORECASE)


@dataclass(frozen=True)
class Measurement:
    """One lever's data, row by row as in the file; NaN where a cell was empty.

    Attributes
    ----------
    bias_V, current_mA, reader_V, tip_K, tip_error_K : ndarray, shape (n,)
        The last is the standard error of the tip temperature.
    current_error_mA, reader_error_V : ndarray, shape (n,), or None
        Standard errors of the others.
    series_resistance_ohm, base_temperature_K : float or None
        If the file gives them.
    medium : {"vacuum", "air"} or None
        If the file says it.
    path, sha256 : str
        Origin; empty for data made in memory.
    ignored : tuple of str
        Columns of the file that mean nothing here.
    """

    bias_V: Array
    current_mA: Array
    reader_V: Array
    tip_K: Array
    tip_error_K: Array
    series_resistance_ohm: float | None = None
    base_temperature_K: float | None = None
    medium: Medium | None = None
    path: str = ""
    sha256: str = ""
    ignored: tuple[str, ...] = field(default=())
    current_error_mA: Array | None = None
    reader_error_V: Array | None = None

    def observable(self, name: str) -> Array:
        """Return the data of ``current`` (mA), ``reader`` (V) or ``tip`` (K).

        Raises
        ------
        InputError
            If there is no observable of this name.
        """
        if name not in OBSERVABLE_SYMBOLS:
            raise unknown_name("observable", name, OBSERVABLE_SYMBOLS)
        values: Array = getattr(self, COLUMNS[OBSERVABLE_SYMBOLS[name]][0])
        return values

    def error(self, name: str) -> Array:
        """Return the standard errors of an observable's data, NaN where there are none."""
        self.observable(name)
        values = getattr(self, COLUMNS["d" + OBSERVABLE_SYMBOLS[name]][0])
        return np.full(self.bias_V.shape, np.nan) if values is None else values

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of the observables that have any data."""
        return tuple(
            name for name in OBSERVABLE_SYMBOLS if np.isfinite(self.observable(name)).any()
        )


def read_measurement(path: str | os.PathLike[str]) -> Measurement:
    """Read a measurement file.

    A header row names each column with its unit in brackets or parentheses, such as
    ``V_b (V),I_h [mA],V_r (mV),T_tip (K)``; SI prefixes are understood, columns come in any
    order, cells may be empty, lines starting with ``#`` are comments and may give
    ``R_s (kOhm): 5.6``, ``base temperature (K): 293`` and ``medium: air``. Cells are separated by
    commas, tabs, or semicolons; with the latter two a decimal comma is understood.

    Raises
    ------
    InputError
        Naming file, line and column, what was found and what is expected.
    """
    text = read_text(path, encoding="utf-8-sig")
    settings: dict[str, float] = {}
    medium: Medium | None = None
    header: list[str] | None = None
    separator = ","
    columns: dict[str, tuple[int, float, float]] = {}
    ignored: list[str] = []
    rows: list[dict[str, float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        where = f"{path}: line {number}"
        if line.startswith("#"):
            settings |= _setting(line, where)
            medium = _medium(line) or medium
        elif not line.strip(" \t,;"):
            continue
        elif header is None:
            separator = next((mark for mark in (";", "\t") if mark in line), ",")
            header = [cell.strip().strip('"') for cell in line.split(separator)]
            columns, ignored = _columns(header, where)
        else:
            rows.append(_row(line, separator, header, columns, where))
    if header is None:
        raise InputError(f"{path}: no header row, expected one like 'V_b (V),I_h (mA),V_r (mV)'")
    if not rows:
        raise InputError(f"{path}: no data rows after the header")
    values = {
        attribute: np.array([row.get(symbol, math.nan) for row in rows])
        for symbol, (attribute, _) in COLUMNS.items()
    }
    measurement = Measurement(
        **values,
        series_resistance_ohm=settings.get("series_resistance_ohm"),
        base_temperature_K=settings.get("base_temperature_K"),
        medium=medium,
        path=str(path),
        sha256=hashlib.sha256(Path(path).read_bytes()).hexdigest(),
        ignored=tuple(ignored),
    )
    if not measurement.observables:
        raise InputError(f"{path}: no values in any of the columns I_h, V_r, T_tip")
    return measurement


def _setting(line: str, where: str) -> dict[str, float]:
    """Read a comment line that gives a setting; empty for any other comment."""
    match = _SETTING.match(line)
    if match is None or match["name"].lower() not in SETTINGS:
        return {}
    attribute, unit = SETTINGS[match["name"].lower()]
    factor, offset = _conversion(match["unit"], unit, f"{where}: {match['name']}")
    return {attribute: factor * _number(match["value"], True, f"{where}: {match['name']}") + offset}


def _medium(line: str) -> Medium | None:
    """Read the medium of a comment line such as ``# medium: air, 20 °C``; None for any other."""
    match = _MEDIUM.match(line)
    word = match[1].lower() if match else ""
    return next((medium for medium in get_args(Medium) if medium == word), None)


def _columns(
    header: list[str], where: str
) -> tuple[dict[str, tuple[int, float, float]], list[str]]:
    """Find the known columns: place, factor and offset to the unit inside; and the others."""
    found: dict[str, tuple[int, float, float]] = {}
    ignored = []
    for place, cell in enumerate(header):
        match = _NAME_AND_UNIT.match(cell)
        name = match["name"] if match else cell
        symbol = next((known for known in COLUMNS if known.lower() == name.lower()), None)
        if symbol is None:
            ignored.append(cell)
            continue
        if match is None:
            raise InputError(
                f"{where}: column '{cell}' has no unit, expected '{symbol} ({COLUMNS[symbol][1]})' "
                "or another unit in parentheses"
            )
        if symbol in found:
            raise InputError(f"{where}: column '{symbol}' stands twice")
        found[symbol] = (place, *_conversion(match["unit"], COLUMNS[symbol][1], f"{where}: {cell}"))
    if "V_b" not in found or not found.keys() & set(OBSERVABLE_SYMBOLS.values()):
        raise InputError(
            f"{where}: the header names {', '.join(repr(cell) for cell in header)}; expected "
            "'V_b (V)' and at least one of 'I_h (mA)', 'V_r (mV)', 'T_tip (K)'"
        )
    return found, ignored


def _row(
    line: str,
    separator: str,
    header: list[str],
    columns: dict[str, tuple[int, float, float]],
    where: str,
) -> dict[str, float]:
    cells = line.split(separator)
    if len(cells) != len(header):
        raise InputError(f"{where}: {len(cells)} cells, expected {len(header)} as in the header")
    row = {
        symbol: factor * _number(cells[place], separator != ",", f"{where}: {symbol}") + offset
        for symbol, (place, factor, offset) in columns.items()
    }
    if math.isnan(row["V_b"]) or row["V_b"] < 0:
        raise InputError(
            f"{where}: V_b is {cells[columns['V_b'][0]]!r}, expected a bias of 0 or more"
        )
    return row


def _number(cell: str, decimal_comma: bool, where: str) -> float:
    """Read a number; NaN for an empty cell."""
    text = cell.strip().strip('"')
    if not text or text.lower() == "nan":
        return math.nan
    try:
        value = float(text.replace(",", ".") if decimal_comma else text)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise InputError(f"{where}: found {text!r}, expected a number")
    return value


@cache
def _units() -> Any:
    import pint  # takes half a second, and only files with data need it

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def _conversion(unit: str, inside: str, where: str) -> tuple[float, float]:
    """Return factor and offset that turn a value in `unit` into the unit used inside.

    Raises
    ------
    InputError
        If the unit is unknown or measures something else.
    """
    import pint

    registry = _units()
    difference = inside.startswith("delta_")
    target = inside.removeprefix("delta_")
    text = unit.strip().replace("Ohm", "ohm").replace("°", "deg")
    try:
        if difference:
            text = {"degC": "K"}.get(text, text)
        zero = registry.Quantity(0.0, text).to(target).magnitude
        one = registry.Quantity(1.0, text).to(target).magnitude
    except (pint.errors.PintError, AttributeError, ValueError, TypeError):
        raise InputError(
            f"{where}: unit '{unit}' is not understood here, expected one like {target}"
        ) from None
    return float(one - zero), float(zero)
