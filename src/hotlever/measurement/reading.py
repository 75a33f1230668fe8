"""Measurement files, from their text to what a fit takes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from hotlever.errors import InputError, shown
from hotlever.lever.transient.waveform import Waveform
from hotlever.measurement.bias import find_bias, mirror
from hotlever.measurement.checks import check, note_rows
from hotlever.measurement.columns import (
    LEVER,
    MEANING,
    QUANTITIES,
    Column,
    find_columns,
    is_heading,
    parse_columns,
    require,
)
from hotlever.measurement.data import COLUMNS, OBSERVABLE_SYMBOLS, TIME, Measurement
from hotlever.measurement.histories import find_waveform, take_time
from hotlever.measurement.settings import Settings
from hotlever.measurement.sweeps import described, disagreements, sweeps_of
from hotlever.probe import Circuit
from hotlever.tables import Table, read_table
from hotlever.types import Array
from hotlever.units import name_and_unit

_MOST_NOTES = 20


def read_measurement(
    path: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    circuit: Circuit | None = None,
    waveform: Waveform | None = None,
) -> Measurement:
    """Read a measurement file.

    A header row names each column with its unit, such as
    ``V_b (V),I_h [mA],V_r/mV,T_tip (°C)``, or units stand in the row below it; columns come in any
    order, cells may be empty. Cells are separated by commas, tabs, semicolons or blanks; decimal
    commas are understood. Lines starting with ``#`` and those above the header row may give
    ``R_s (kOhm): 5.6``, ``base temperature = 20 °C`` and ``medium: air``.

    For the voltage over the lever, ``V_l (V)``, the bias follows from R_s and I_h. Rows of
    negative bias are mirrored: lever and circuit are symmetric, but for held supplies.

    A table with a column ``time (us)``, in any unit of time, is of what was measured in time if it
    lasts `hotlever.measurement.histories.BRIEF` at most, or a wave form or the column are
    told of; it begins with a cold lever.

    Parameters
    ----------
    path : path
    columns : mapping of str to str, optional
        Quantities, with a unit if the file gives none, and the headings or numbers of their
        columns: ``{"I_h (uA)": "Current"}``.
    circuit : Circuit, optional
        Its R_s makes the bias of V_l in a file that does not give R_s. With its held supplies the
        signs of bias, current and voltage count.
    waveform : Waveform, optional
        Of the bias in time, instead of the column ``V_b``.

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
    unused: list[str] = []
    found = find_columns(table, told, unused)
    for line, text in table.remarks:
        notes.append(f"{table.path}: line {line}: '{shown(text)}' is taken for a comment")
    values = dict.fromkeys(QUANTITIES, np.full(len(table.rows), np.nan))
    in_time = take_time(table, found, told, unused, expected=waveform is not None)
    require(table, found, driven=waveform is not None)
    for symbol, column in found.items():
        values[symbol] = column.values(table)
        written = np.isnan(values[symbol]) & [bool(row[column.place]) for row in table.rows]
        if symbol not in ("V_b", LEVER, TIME):
            note_rows(notes, table, written, f"{symbol} is written as missing")
    if in_time:
        history = find_waveform(table, found, values, settings, circuit, waveform, notes)
        check(table, found, values, settings.values, notes, signed=True)
        order = f"in time, {len(table.rows)} rows; {history['waveform'].text}"
    else:
        history = {}
        find_bias(table, found, values, settings, circuit, notes)
        symmetric = circuit is None or circuit.starts_cold
        sign = mirror(table, found, values, symmetric, notes)
        check(table, found, values, settings.values, notes, signed=not symmetric)
        bias = sign * values["V_b"]
        parts = sweeps_of(bias)
        order = described(bias, parts)
        if len(parts) > 1:
            notes.append(f"{path}: {len(parts)} sweeps, all of them used: {order}")
            data = {symbol: values[symbol] for symbol in OBSERVABLE_SYMBOLS.values()}
            notes += [f"{path}: {text}" for text in disagreements(bias, parts, data, symmetric)]
    notes += unused
    more = len(notes) - _MOST_NOTES
    if more > 0:
        notes[_MOST_NOTES:] = [f"{path}: {more} more such notes"]
    content: dict[str, Any] = {name: values[symbol] for symbol, (name, _) in COLUMNS.items()}
    measurement = Measurement(
        **content,
        **settings.values,
        **history,
        path=table.path,
        sha256=table.sha256,
        notes=tuple(notes),
        understood=_understood(table, found, values, settings, order),
    )
    if not measurement.observables:
        raise InputError(f"{path}: no values in any of the columns I_h, V_r, T_tip")
    return measurement


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
    reckoned = {
        "V_b": ("V", f"bias, {LEVER} + R_s I_h" if LEVER in columns else "bias, the wave form"),
        "I_h": ("mA", f"heater current, (V_b - {LEVER}) / R_s"),
    }
    every = (TIME, LEVER, *COLUMNS)
    for symbol in (symbol for symbol in every if np.isfinite(values[symbol]).any()):
        if symbol not in columns:
            unit, how = reckoned[symbol]
            rows.append((symbol, _range(values[symbol], unit), how))
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


def given_measurement(
    measurement: Measurement | str | os.PathLike[str], circuit: Circuit | None = None
) -> Measurement:
    """Return a measurement as it is, or read one that was made in a circuit from its file.

    Raises
    ------
    InputError
        If it is neither, or the file is at fault.
    """
    if isinstance(measurement, Measurement):
        return measurement
    if isinstance(measurement, str | os.PathLike):
        return read_measurement(measurement, circuit=circuit)
    raise InputError(
        f"found {type(measurement).__name__}, expected a Measurement or a measurement file"
    )
