"""Measurement files, from their text to what a fit takes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import InputError, shown
from hotlever.fitting.measurement.checks import NOISE, check, note_rows
from hotlever.fitting.measurement.columns import (
    LEVER,
    MEANING,
    QUANTITIES,
    Column,
    find_columns,
    is_heading,
    parse_columns,
)
from hotlever.fitting.measurement.data import COLUMNS, OBSERVABLE_SYMBOLS, Measurement
from hotlever.fitting.measurement.settings import Settings
from hotlever.fitting.measurement.sweeps import described, disagreements, sweeps_of
from hotlever.probe import Circuit
from hotlever.tables import Table, read_table
from hotlever.types import Array
from hotlever.units import name_and_unit

_MOST_NOTES = 20
#: Series resistances (kΩ) along which a curve is read whose own one does not tell its points apart.
_LOAD_KOHM = (5.6, 20.0, 100.0, 1000.0)
#: Part of the largest bias by which it may fall while the current rises.
_FALLS = 0.02
#: Part by which V_b - V_l may be off what R_s I_h says, of the largest bias.
_VOLTAGES_AGREE = 0.05


def read_measurement(
    path: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    circuit: Circuit | None = None,
) -> Measurement:
    """Read a measurement file.

    A header row names each column with its unit, such as
    ``V_b (V),I_h [mA],V_r/mV,T_tip (°C)``, or units stand in the row below it; columns come in any
    order, cells may be empty. Cells are separated by commas, tabs, semicolons or blanks; decimal
    commas are understood. Lines starting with ``#`` and those above the header row may give
    ``R_s (kOhm): 5.6``, ``base temperature = 20 °C`` and ``medium: air``.

    For the voltage over the lever, ``V_l (V)``, the bias follows from R_s and I_h. Rows of
    negative bias are mirrored: lever and circuit are symmetric.

    Parameters
    ----------
    path : path
    columns : mapping of str to str, optional
        Quantities, with a unit if the file gives none, and the headings or numbers of their
        columns: ``{"I_h (uA)": "Current"}``.
    circuit : Circuit, optional
        Its R_s makes the bias of V_l in a file that does not give R_s.

    Raises
    ------
    InputError
        Naming file, line and column, what was found and what is expected; also for values that
        no lever can have, or whose unit must be wrong.
    """
    told = parse_columns(f"{name}={heading}" for name, heading in (columns or {}).items())
    known = partial(is_heading, told=told)
    table = read_table(path, "one like 'V_b (V),I_h (mA),V_r (mV)'", known=known)
    notes: list[str] = []
    settings = Settings.of(table, notes)
    found = find_columns(table, told, notes)
    for line, text in table.remarks:
        notes.append(f"{table.path}: line {line}: '{shown(text)}' is taken for a comment")
    values = dict.fromkeys(QUANTITIES, np.full(len(table.rows), np.nan))
    for symbol, column in found.items():
        values[symbol] = column.values(table)
        written = np.isnan(values[symbol]) & [bool(row[column.place]) for row in table.rows]
        if symbol not in ("V_b", LEVER):
            note_rows(notes, table, written, f"{symbol} is written as missing")
    _find_bias(table, found, values, settings, circuit, notes)
    sign = _mirror(table, found, values, notes)
    check(table, found, values, settings.values, notes)
    bias = sign * values["V_b"]
    parts = sweeps_of(bias)
    if len(parts) > 1:
        notes.append(f"{path}: {len(parts)} sweeps, all of them used: {described(bias, parts)}")
        data = {symbol: values[symbol] for symbol in OBSERVABLE_SYMBOLS.values()}
        notes += [f"{path}: {text}" for text in disagreements(bias, parts, data)]
    more = len(notes) - _MOST_NOTES
    if more > 0:
        notes[_MOST_NOTES:] = [f"{path}: {more} more such notes"]
    content: dict[str, Any] = {name: values[symbol] for symbol, (name, _) in COLUMNS.items()}
    measurement = Measurement(
        **content,
        **settings.values,
        path=table.path,
        sha256=table.sha256,
        notes=tuple(notes),
        understood=_understood(table, found, values, settings, described(bias, parts)),
    )
    if not measurement.observables:
        raise InputError(f"{path}: no values in any of the columns I_h, V_r, T_tip")
    return measurement


def _find_bias(
    table: Table,
    columns: dict[str, Column],
    values: dict[str, Array],
    settings: Settings,
    circuit: Circuit | None,
    notes: list[str],
) -> None:
    """Find the bias of each row, where need be from the voltage over the lever and R_s."""
    symbol = "V_b" if "V_b" in columns else LEVER
    for needed in ("V_b",) if symbol == "V_b" else (LEVER, "I_h"):
        missing = np.isnan(values[needed])
        if missing.any():
            row = int(np.argmax(missing))
            cell = shown(table.rows[row][columns[needed].place])
            expected = "a bias" if needed == "V_b" else f"a number, since V_b follows from {LEVER}"
            raise InputError(
                f"{table.where(row)}: {needed} is '{cell}', expected {expected}"
                + " of 0 or more" * (needed == "V_b")
            )
    ohm = settings.values.get("series_resistance_ohm")
    lever, current = values[LEVER], values["I_h"]
    if symbol == "V_b":
        if LEVER in columns:
            _compare_voltages(table, values, settings, notes)
        return
    if ohm is None:
        if circuit is None:
            raise InputError(
                f"{table.path}: {LEVER} without R_s, from which the bias follows, expected a line "
                "like '# R_s (kOhm): 5.6'"
            )
        ohm = circuit.series_resistance_ohm
        settings.origin["series_resistance_ohm"] = "of the probe"
    kohm = next(
        (r for r in (ohm / 1000.0, *_LOAD_KOHM) if _rises(lever + r * current, current)), None
    )
    if kohm is None:
        raise InputError(
            f"{table.path}: {LEVER} falls too much while I_h rises for a lever's, expected less "
            f"than {_LOAD_KOHM[-1]:g} kΩ; is a unit wrong?"
        )
    if kohm != ohm / 1000.0:
        notes.append(
            f"{table.path}: V_l falls while I_h rises, so that V_b = V_l + R_s I_h does not tell "
            f"the points apart with R_s = {ohm:g} ohm; {kohm:g} kOhm are reckoned with instead, "
            "which changes nothing that a lever shows"
        )
        settings.origin["series_resistance_ohm"] = "reckoned with"
    settings.values["series_resistance_ohm"] = kohm * 1000.0
    values["V_b"] = lever + kohm * current


def _rises(bias: Array, current: Array) -> bool:
    """Whether a bias rises with the current, but for noise."""
    sized = np.abs(bias)[np.argsort(np.abs(current), kind="stable")]
    falls = np.maximum.accumulate(sized) - sized
    return bool(falls.max() <= _FALLS * sized.max())


def _compare_voltages(
    table: Table, values: dict[str, Array], settings: Settings, notes: list[str]
) -> None:
    """Where a file has bias and lever voltage, take R_s from them, or check that it agrees."""
    behind, current = values["V_b"] - values[LEVER], values["I_h"]
    known = np.isfinite(behind) & (np.abs(current) > 0.1 * np.nanmax(np.abs(current), initial=0.0))
    if not known.any():
        notes.append(f"{table.path}: {LEVER} is not used beside V_b without I_h")
        return
    kohm = float(np.median(behind[known] / current[known]))
    ohm = settings.values.get("series_resistance_ohm", 1000.0 * kohm)
    off = np.abs(behind[known] - ohm / 1000.0 * current[known])
    if kohm < 0.0 or np.median(off) > _VOLTAGES_AGREE * np.abs(values["V_b"]).max():
        raise InputError(
            f"{table.path}: V_b - {LEVER} is {kohm:.4g} kOhm times I_h, expected R_s = "
            f"{ohm:.4g} ohm; is a unit wrong?"
        )
    if "series_resistance_ohm" not in settings.values:
        settings.values["series_resistance_ohm"] = float(f"{1000.0 * kohm:.4g}")
        settings.origin["series_resistance_ohm"] = f"V_b - {LEVER} over I_h"


def _mirror(
    table: Table, columns: dict[str, Column], values: dict[str, Array], notes: list[str]
) -> NDArray[np.float64]:
    """Turn rows of negative bias into those of the other polarity; return the signs of all."""
    sign = np.where(values["V_b"] < 0.0, -1.0, 1.0)
    if not (sign < 0.0).any():
        return sign
    for symbol in ("V_b", LEVER, "I_h", "V_r"):
        values[symbol] = sign * values[symbol]
        size = np.nanmax(np.abs(values[symbol]), initial=0.0)
        wrong = values[symbol] < -NOISE * size
        if wrong.any():
            row = int(np.argmax(wrong))
            bias = "V_b" if "V_b" in columns else LEVER
            cells = [shown(table.rows[row][columns[name].place]) for name in (bias, symbol)]
            raise InputError(
                f"{table.where(row)}: {bias} is '{cells[0]}' and {symbol} is '{cells[1]}', "
                "expected the same sign"
            )
    note_rows(notes, table, sign < 0.0, "V_b is negative, and counts as positive with I_h and V_r")
    return sign


def _understood(
    table: Table,
    columns: dict[str, Column],
    values: dict[str, Array],
    settings: Settings,
    sweeps: str,
) -> tuple[tuple[str, ...], ...]:
    """Return what was understood, as rows of a table: what, as what, and where it stands."""
    separator = {"\t": "tabs", ";": "semicolons", ",": "commas", None: "blanks"}[table.separator]
    rows = [
        (table.path, f"{separator}, decimal comma" if table.decimal_comma else separator, sweeps)
    ]
    for symbol in (symbol for symbol in (LEVER, *COLUMNS) if np.isfinite(values[symbol]).any()):
        if symbol not in columns:
            rows.append((symbol, _range(values[symbol], "V"), f"bias, {LEVER} + R_s I_h"))
            continue
        column = columns[symbol]
        heading = f"'{shown(column.heading)}'" if column.heading else f"column {column.place + 1}"
        told = "" if name_and_unit(column.heading)[1] == column.unit else f" in {column.unit}"
        found = _range(values[symbol], QUANTITIES[symbol])
        rows.append((symbol, found, f"{MEANING[symbol]}, {heading}{told}"))
    named = {
        "series_resistance_ohm": ("R_s", "ohm"),
        "base_temperature_K": ("T_base", "K"),
        "medium": ("medium", ""),
        "pressure_mbar": ("pressure", "mbar"),
        "gas_conductivity": ("gas conductivity", "of air's"),
    }
    for attribute, (name, unit) in named.items():
        value = settings.values.get(attribute)
        if value is not None:
            text = value if isinstance(value, str) else f"{value:g} {unit}"
            rows.append((name, text, settings.origin.get(attribute, "")))
        elif attribute in ("series_resistance_ohm", "base_temperature_K", "medium"):
            rows.append((name, "not said", "the probe's counts"))
    return tuple(rows)


def _range(values: Array, unit: str) -> str:
    count = np.isfinite(values).sum()
    some = "" if count == values.size else f", {count} values"
    return f"{np.nanmin(values):.5g} to {np.nanmax(values):.5g} {unit}{some}"
