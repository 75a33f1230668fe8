"""Measured data sets: bias, current, reader voltage and tip temperature of one lever."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from hotlever.datasets import labelled
from hotlever.errors import InputError, unknown_name
from hotlever.lever.dataset import OBSERVABLES, probe_of
from hotlever.probe import Circuit
from hotlever.probe.surroundings import Medium
from hotlever.tables import (
    Table,
    conversion,
    key_and_value,
    name_and_unit,
    quantity,
    read_table,
    shown,
    unknown_unit,
)
from hotlever.types import Array

#: Quantities of a measurement file: symbol in the header, attribute, unit inside.
COLUMNS = {
    "V_b": ("bias_V", "V"),
    "I_h": ("current_mA", "mA"),
    "V_r": ("reader_V", "V"),
    "T_tip": ("tip_K", "K"),
    "dT_tip": ("tip_error_K", "K"),
    "dI_h": ("current_error_mA", "mA"),
    "dV_r": ("reader_error_V", "V"),
}
#: The columns a fit can compare, by the name users give it.
OBSERVABLE_SYMBOLS = {"current": "I_h", "reader": "V_r", "tip": "T_tip"}
#: Where the largest value of a column can lie, in the unit inside; else its unit is wrong.
_PLAUSIBLE = {"V_b": (1e-3, 1e3), "I_h": (1e-9, 1e3), "V_r": (1e-9, 1e3), "T_tip": (0.0, 5e3)}
#: Units a thousand times smaller.
_SMALLER = {"V": "mV", "mA": "µA"}
#: A standard error this much smaller than the largest value is none.
_LEAST_ERROR = 1e-9
#: Part of the largest value by which noise and drift may push a current or voltage below 0.
_NOISE = 0.05
#: K, and standard errors, by which a tip may seem colder than its base.
_COLDER_K, _COLDER_ERRORS = 20.0, 4.0
#: K; probe files take no colder base.
_COLDEST_BASE_K = 250.0
_MOST_NOTES = 20

#: Settings in comment lines: name, attribute, unit inside, largest value.
_SETTINGS = {
    "R_s": ("series_resistance_ohm", "ohm", 1e9),
    "base temperature": ("base_temperature_K", "K", 1e3),
}
#: Their names as people write them, without case, blanks and underscores.
_SPELLINGS = {
    **dict.fromkeys(("rs", "rseries", "seriesresistance", "seriesresistor"), "R_s"),
    **dict.fromkeys(("basetemperature", "basetemp", "tbase", "t0"), "base temperature"),
    "medium": "medium",
}
#: A comment that begins so is taken for a setting, and said to be unclear if it is.
_LIKE_A_SETTING = re.compile(
    r"series.?resist|base.?temp|medium\b|(?:r_?s(?:eries)?|t_?(?:base|0))\b(?!-).*\d", re.I
)


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
    notes : tuple of str
        What of the file was not used or not understood, and what looks wrong in it.
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
    notes: tuple[str, ...] = ()
    current_error_mA: Array | None = None
    reader_error_V: Array | None = None

    @classmethod
    def given(cls, measurement: Measurement | str | os.PathLike[str]) -> Measurement:
        """Return a measurement as it is, or read one from a measurement file.

        Raises
        ------
        InputError
            If it is neither, or the file is at fault.
        """
        if isinstance(measurement, Measurement):
            return measurement
        if isinstance(measurement, str | os.PathLike):
            return read_measurement(measurement)
        raise InputError(
            f"found {type(measurement).__name__}, expected a Measurement or a measurement file"
        )

    @classmethod
    def of_sweep(cls, sweep: xr.Dataset) -> Measurement:
        """Return a sweep as if it had been measured, without noise, with its circuit and medium.

        Examples
        --------
        >>> from hotlever import Probe, sweep
        >>> Measurement.of_sweep(sweep(Probe.reference(), [1.0, 2.0])).observables
        ('current', 'reader', 'tip')
        """
        probe, names = probe_of(sweep), ("bias_V", *OBSERVABLES.values())
        columns: dict[str, Any] = {name: sweep[name].values for name in names}
        return cls(
            **columns,
            tip_error_K=np.full(sweep.bias_V.size, np.nan),
            **probe.circuit.model_dump(),
            medium=probe.surroundings.medium,
        )

    def dataset(self, circuit: Circuit) -> xr.Dataset:
        """Return the data by the names that a sweep has, V_l and P_l included, rising in bias."""
        named = ((name, getattr(self, name)) for name, _ in COLUMNS.values())
        columns = {name: values for name, values in named if values is not None}
        columns["lever_V"] = circuit.lever_voltage(self.bias_V, self.current_mA)
        columns["power_mW"] = circuit.power(self.bias_V, self.current_mA)
        return labelled(columns, coordinates={"bias": self.bias_V}).sortby("bias")

    def observable(self, name: str) -> Array:
        """Return the data of ``current`` (mA), ``reader`` (V) or ``tip`` (K).

        Raises
        ------
        InputError
            If there is no observable of this name.
        """
        if name not in OBSERVABLES:
            raise unknown_name("observable", name, OBSERVABLES)
        values: Array = getattr(self, OBSERVABLES[name])
        return values

    def error(self, name: str) -> Array:
        """Return the standard errors of an observable's data, NaN where there are none."""
        self.observable(name)
        values = getattr(self, COLUMNS["d" + OBSERVABLE_SYMBOLS[name]][0])
        return np.full(self.bias_V.shape, np.nan) if values is None else values

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of the observables that have any data."""
        return tuple(name for name in OBSERVABLES if np.isfinite(self.observable(name)).any())


def read_measurement(path: str | os.PathLike[str]) -> Measurement:
    """Read a measurement file.

    A header row names each column with its unit in brackets or parentheses, such as
    ``V_b (V),I_h [mA],V_r (mV),T_tip (K)``; SI prefixes are understood, columns come in any
    order, cells may be empty, lines starting with ``#`` are comments and may give
    ``R_s (kOhm): 5.6``, ``base temperature = 20 °C`` and ``medium: air``. Cells are separated by
    commas, tabs, or semicolons; with the latter two a decimal comma is understood.

    Raises
    ------
    InputError
        Naming file, line and column, what was found and what is expected; also for values that
        no lever can have, or whose unit must be wrong.
    """
    table = read_table(path, "one like 'V_b (V),I_h (mA),V_r (mV)'")
    notes: list[str] = []
    settings = _settings(table, notes)
    places = _places(table, notes)
    values = dict.fromkeys(COLUMNS, np.full(len(table.rows), np.nan))
    for symbol, place in places.items():
        inside = COLUMNS[symbol][1]
        values[symbol] = table.values(place, inside, symbol, difference=symbol[0] == "d")
        written = np.isnan(values[symbol]) & [bool(cells[place]) for cells in table.rows]
        if symbol != "V_b":
            _note(notes, table, written, f"{symbol} is written as missing")
    _check(table, places, values, settings, notes)
    more = len(notes) - _MOST_NOTES
    if more > 0:
        notes[_MOST_NOTES:] = [f"{path}: {more} more such notes"]
    content: dict[str, Any] = {name: values[symbol] for symbol, (name, _) in COLUMNS.items()}
    measurement = Measurement(
        **content, **settings, path=table.path, sha256=table.sha256, notes=tuple(notes)
    )
    if not measurement.observables:
        raise InputError(f"{path}: no values in any of the columns I_h, V_r, T_tip")
    return measurement


def _note(notes: list[str], table: Table, odd: NDArray[np.bool_], text: str) -> None:
    """Note what is odd about some rows, if there are any."""
    if odd.any():
        others = f", and in {odd.sum() - 1} more rows" if odd.sum() > 1 else ""
        notes.append(f"{table.where(int(np.argmax(odd)))}: {text}{others}")


# --- settings in comments ------------------------------------------------------------------


def _settings(table: Table, notes: list[str]) -> dict[str, Any]:
    """Read the comments that give a setting; a note on each that seems to but is not clear."""
    found: dict[str, Any] = {}
    parts = ((line, part) for line, text in table.comments for part in re.split(r"[;,]\s", text))
    for line, text in parts:
        where = f"{table.path}: line {line}"
        given = _setting(text, where)
        if given is None:
            notes.append(
                f"{where}: '{shown(text)}' is not understood and not used, expected a line like "
                "'# R_s (kOhm): 5.6', '# base temperature (K): 293' or '# medium: air'"
            )
            continue
        for name, value in given.items():
            if found.setdefault(name, value) != value:
                raise InputError(f"{where}: {name} is {value}, but {found[name]} further up")
    return found


def _setting(text: str, where: str) -> dict[str, Any] | None:
    """Return what a comment sets, nothing where it is another comment, None where it is unclear."""
    key, value = key_and_value(text)
    name, unit = name_and_unit(key)
    setting = value and _SPELLINGS.get(re.sub(r"[\W_]+", "", name[:40]).lower())
    if setting == "medium":
        words = re.findall(r"[a-z-]+", value[:200].lower())
        said = [medium for medium in get_args(Medium) if medium in words]
        sure = words[:1] == said[:1] or not {"no", "not", "without"} & set(words)
        return {"medium": said[0]} if len(said) == 1 and sure else None
    if setting:
        attribute, inside, high = _SETTINGS[setting]
        read = _value(value, unit, inside, f"{where}: {setting}")
        if read is None:
            return None
        Circuit.of({attribute: read}, f"{where}: {setting}")
        _plausible(f"{where}: {setting}", inside, read, 0.0, high)
        return {attribute: read}
    # a resistance or a temperature may be meant for one
    units = (unit or "", _unit_of(quantity(value)[1]))
    alike = any(conversion(each, inside) for each in units for _, inside, _ in _SETTINGS.values())
    return None if alike or _LIKE_A_SETTING.match(text.strip(' \t#"')) else {}


def _value(text: str, unit: str | None, inside: str, where: str) -> float | None:
    """Return a setting's value in the unit used inside; None if that is not clear.

    The unit stands behind the name, in brackets, or behind the number.
    """
    number, rest = quantity(text.replace("deg C", "degC").replace("° C", "°C"))
    behind = conversion(_unit_of(rest), inside)
    if (behind is None and rest[:1].strip(" ,;([±")) or re.match(r"[-+]?\d{1,3},\d{3}(?!\d)", text):
        number = None  # as in 5.6x; 10,000 may be ten or ten thousand
    named = behind if unit is None else conversion(unit, inside)
    if unit is not None and named is None:
        raise unknown_unit(unit, inside, where)
    if unit is not None and number is None:
        raise InputError(f"{where}: found '{shown(text)}', expected a number")
    if number is None or named is None or behind not in (None, named):
        return None
    return named[0] * number + named[1]


def _unit_of(text: str) -> str:
    """Return the first word behind a number."""
    return re.split(r"[\s,;()\[\]]", text.lstrip(" (["), maxsplit=1)[0]


# --- columns -------------------------------------------------------------------------------


def _places(table: Table, notes: list[str]) -> dict[str, int]:
    """Find the known columns, and note the others."""
    where = table.where(-1)
    found: dict[str, int] = {}
    unused: list[str] = []
    for place, heading in enumerate(table.names):
        name, unit = name_and_unit(heading)
        symbol = next((known for known in COLUMNS if known.lower() == name.lower()), None)
        if symbol is None:
            unused.append(heading)
        elif unit is None:
            raise InputError(
                f"{where}: column '{shown(heading)}' has no unit, expected "
                f"'{symbol} ({COLUMNS[symbol][1]})' or another unit in parentheses"
            )
        elif found.setdefault(symbol, place) != place:
            raise InputError(f"{where}: column '{symbol}' stands twice")
    if "V_b" not in found or not found.keys() & set(OBSERVABLE_SYMBOLS.values()):
        raise InputError(
            f"{where}: the header names {', '.join(repr(shown(name)) for name in table.names[:9])};"
            " expected 'V_b (V)' and at least one of 'I_h (mA)', 'V_r (mV)', 'T_tip (K)'"
        )
    for heading in unused:
        unit = name_and_unit(heading)[1] or ""
        alike = (s for s, (_, u) in COLUMNS.items() if s not in found and conversion(unit, u))
        symbol = next(alike, None)
        hint = f"; if it is {symbol}, name it '{symbol} ({unit})'" if symbol else ""
        notes.append(f"{table.path}: column '{shown(heading)}' is not used{hint}")
    return found


def _check(
    table: Table,
    places: dict[str, int],
    values: dict[str, Array],
    settings: dict[str, Any],
    notes: list[str],
) -> None:
    """Refuse what no lever can show, and note what it hardly can."""
    for symbol in (symbol for symbol in COLUMNS if symbol in places):
        of, data = symbol.removeprefix("d"), values[symbol]
        unit, (low, high) = COLUMNS[of][1], _PLAUSIBLE[of]
        size = np.nanmax(np.abs(values[of]), initial=0.0)
        if symbol != of:
            wrong = (data <= _LEAST_ERROR * size) | (data > high)
            expected = f"a standard error above 0 and up to {high:g} {unit}, or an empty cell"
        elif symbol == "V_b":
            wrong, expected = ~(data >= 0.0), "a bias of 0 or more"
        else:
            wrong, expected = (data <= 0.0) & (symbol == "T_tip"), "a temperature above 0 K"
        if wrong.any():
            row = int(np.argmax(wrong))
            cell = shown(table.rows[row][places[symbol]])
            raise InputError(f"{table.where(row)}: {symbol} is '{cell}', expected {expected}")
        if symbol == of and not np.isnan(data).all():
            for largest in (np.nanmax(data), size):
                _plausible(f"{table.path}: the largest {symbol}", unit, largest, low, high)
            _note(notes, table, data < -_NOISE * size, f"{symbol} is negative")

    base = settings.get("base_temperature_K", _COLDEST_BASE_K)
    margin = np.fmax(_COLDER_K, _COLDER_ERRORS * values["dT_tip"])
    text = f"T_tip is below the base temperature ({base:g} K), perhaps in another unit"
    _note(notes, table, values["T_tip"] < base - margin, text)

    bias, current = values["V_b"], values["I_h"]
    ohm = settings.get("series_resistance_ohm", 0.0)
    lever = Circuit(series_resistance_ohm=ohm).lever_voltage(bias, current)
    below = lever < -_NOISE * bias.max()
    if below.any():
        row = int(np.argmax(below))
        raise InputError(
            f"{table.where(row)}: V_b = {bias[row]:g} V and I_h = {current[row]:g} mA leave "
            f"{lever[row]:.3g} V for the lever behind R_s = {ohm:g} ohm, expected a voltage above "
            "0; is a unit wrong?"
        )


def _plausible(where: str, unit: str, value: float, low: float, high: float) -> None:
    if low <= value <= high:
        return
    expected = f"{where}: found {value:g} {unit}, expected {low:g} to {high:g} {unit}"
    if value < 0:
        raise InputError(f"{expected}; is the sign wrong?")
    smaller = _SMALLER.get(unit)
    if value > high and smaller and value / 1e3 <= high:
        raise InputError(f"{expected}; is it in {smaller}, which would be {value / 1e3:g} {unit}?")
    raise InputError(f"{expected}; is the unit wrong?")
