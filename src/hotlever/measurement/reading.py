"""Measurement files, from their text to what a fit takes; and their columns as they are."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from hotlever.errors import InputError, counted, excerpt
from hotlever.files import read_bytes
from hotlever.lever.transient.waveform import Waveform
from hotlever.measurement.bias import check_times, find_bias, find_waveform, leave_out_jumps, mirror
from hotlever.measurement.columns import (
    assignments,
    find_columns,
    is_taken_as_bias,
    measured_table,
    note_on_bias,
    note_on_header,
    note_on_unused,
    note_on_words,
    of_columns,
    quantity_of,
)
from hotlever.measurement.compliance import without_rows_at_compliance
from hotlever.measurement.contents import Contents, Settings, check
from hotlever.measurement.data import DISTANCE, MEASURED, OPTIONAL, TIME, Measurement
from hotlever.measurement.rows import described, disagreements, sweeps_of
from hotlever.probe import Circuit, Probe
from hotlever.quantities import FITTED, MEASURANDS
from hotlever.tables import groups_in
from hotlever.units import name_and_unit

_MOST_NOTES = 20
#: Cells of a column that are shown, and columns.
_CELLS, _MOST = 3, 60


def read_measurement(
    path: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    circuit: Circuit | None = None,
    waveform: Waveform | None = None,
    *,
    signed: bool = False,
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
    lasts `hotlever.measurement.columns.BRIEF` at most, or a wave form or the column are
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
    signed : bool
        Whether the signs count without held supplies too, as they do with thermoelectricity.

    Raises
    ------
    InputError
        Naming file, line and column, what was found and what is expected; also for values that
        no lever can have, or whose unit must be wrong.
    """
    assigned = assignments(columns)
    table = measured_table(path, assigned)
    settings = Settings.of(table)
    quantities = find_columns(table, assigned, driven=waveform is not None)
    remarks = (
        f"{table.path}: line {line}: '{excerpt(text)}' is taken for a comment"
        for line, text in table.remarks
    )
    contents = Contents(table, quantities, settings, [*settings.notes, *remarks])
    if TIME in quantities:
        waveform, order = _complete_in_time(contents, circuit, waveform)
    else:
        signed = signed or (circuit is not None and not circuit.starts_cold)
        # behind the probe's resistor a lever's own voltage, taken for the bias, leaves none
        assumed = circuit is not None and is_taken_as_bias(quantities, assigned)
        series_ohm = circuit.series_resistance_ohm if circuit and assumed else 0.0
        order = _complete_at_rest(contents, circuit, series_ohm, symmetric=not signed)
    unused = note_on_unused(table, quantities)
    notes = [
        *note_on_header(table, assigned),
        *note_on_words(table, quantities),
        *contents.notes,
        *note_on_bias(table, quantities, assigned),
    ]
    more = len(notes) - _MOST_NOTES
    if more > 0:
        notes[_MOST_NOTES:] = [f"{path}: {more} more such notes"]
    rows: dict[str, Any] = {column.name: contents.values[column.symbol] for column in MEASURED}
    absent = [name for name in OPTIONAL if np.isnan(rows[name]).all()]
    rows |= dict.fromkeys(absent)
    measurement = Measurement(
        **rows,
        **settings.values,
        time_us=contents.values[TIME] if TIME in quantities else None,
        waveform=waveform,
        path=table.path,
        sha256=table.sha256,
        notes=tuple(notes),
        unused=tuple(unused),
        understood=_understood(contents, order),
    )
    if not measurement.observables:
        symbols = ", ".join(column.symbol for column in FITTED.values())
        raise InputError(f"{path}: no values in any of the columns {symbols}")
    return without_rows_at_compliance(measurement, circuit)


def _complete_in_time(
    contents: Contents, circuit: Circuit | None, waveform: Waveform | None
) -> tuple[Waveform, str]:
    """Complete what was measured in time; return its wave form, and its order in words."""
    check_times(contents)
    find_bias(contents, circuit, waveform)
    if waveform is None:
        waveform = find_waveform(contents)
    else:
        leave_out_jumps(contents, waveform)
    check(contents, signed=True)
    return waveform, f"in time, {counted(len(contents.table.rows), 'row')}; {waveform.text}"


def _complete_at_rest(
    contents: Contents, circuit: Circuit | None, series_ohm: float, *, symmetric: bool
) -> str:
    """Complete a slow sweep, of either polarity; return the order of its rows in words."""
    find_bias(contents, circuit, None)
    bias = contents.values["V_b"]
    if symmetric:
        mirror(contents)
    check(contents, signed=not symmetric, series_ohm=series_ohm)
    sweeps = sweeps_of(bias)
    order = described(bias, sweeps)
    if len(sweeps) > 1:
        contents.note(f"{len(sweeps)} sweeps, all of them used: {order}")
    if len(sweeps) > 1 and DISTANCE not in contents.columns:
        data = {column.symbol: contents.values[column.symbol] for column in FITTED.values()}
        for text in disagreements(bias, sweeps, data, symmetric):
            contents.note(text)
    return order


def _understood(contents: Contents, order: str) -> tuple[tuple[str, ...], ...]:
    """Return what was understood, as rows of a table: what, as what, and where it stands."""
    table = contents.table
    dialect = table.dialect
    separator = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", None: "blanks"}
    cells = separator[dialect.separator] + ", decimal comma" * dialect.decimal_comma
    rows = [(table.path, cells, order)]
    for symbol, column in MEASURANDS.items():
        values = contents.values[symbol]
        count = int(np.isfinite(values).sum())
        if count > 0:
            limits = f"{np.nanmin(values):.5g} to {np.nanmax(values):.5g} {column.unit}"
            some = f", {counted(count, 'value')}" if count < values.size else ""
            rows.append((symbol, limits + some, f"{column.meaning}, {contents.origin[symbol]}"))
    return (*rows, *contents.settings.understood())


def read_measurement_of(
    probe: Probe,
    path: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    waveform: Waveform | None = None,
) -> Measurement:
    """Read a measurement of a probe's lever: its circuit and its polarity count.

    See `read_measurement`.
    """
    signed = probe.lowest_bias_V < 0.0
    return read_measurement(path, columns, probe.circuit, waveform, signed=signed)


def given_measurement(
    measurement: Measurement | str | os.PathLike[str], probe: Probe
) -> Measurement:
    """Return a measurement, or read one of a probe's lever from its file.

    Either is without rows at a limit of an instrument (`hotlever.measurement.compliance`).

    Raises
    ------
    InputError
        If it is neither, or the file is at fault.
    """
    if isinstance(measurement, Measurement):
        return without_rows_at_compliance(measurement, probe.circuit)
    if isinstance(measurement, str | os.PathLike):
        return read_measurement_of(probe, measurement)
    raise InputError(
        f"found {type(measurement).__name__}, expected a Measurement or a measurement file"
    )


# --- the columns of a file that may be no measurement yet ---------------------------------------


@dataclass(frozen=True)
class FileColumn:
    """One column of a file.

    Attributes
    ----------
    heading, unit : str
        As they stand in the file; empty where there is none.
    name : str
        By which ``--column`` finds it: its heading, or its number where that is not its alone.
    cells : tuple of str
        The first ones.
    symbol : str
        The quantity that it is used as; empty if it is not used.
    """

    heading: str
    unit: str
    name: str
    cells: tuple[str, ...]
    symbol: str


def file_groups(path: str | os.PathLike[str]) -> list[str]:
    """Return the groups of a TDMS file, each a measurement of its own; other files have none.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    return groups_in(read_bytes(path), str(path))


def file_columns(
    path: str | os.PathLike[str], columns: Mapping[str, str] | None = None, *, driven: bool = False
) -> list[FileColumn]:
    """Return the columns of a measurement file, which may lack what a measurement needs.

    Parameters
    ----------
    path : path
    columns : mapping of str to str, optional
        See `read_measurement`.
    driven : bool
        Whether a wave form is given, so that no column of the bias is needed.

    Raises
    ------
    InputError
        If the file holds no table.
    """
    assigned = assignments(columns)
    table = measured_table(path, assigned)
    symbols = dict[int, str]()
    try:
        used = find_columns(table, assigned, driven=driven)
        symbols = {column.index: symbol for symbol, column in used.items()}
    except InputError:
        # what is missing or stands twice is for the user to say
        symbols = {i: quantity_of(name) or "" for i, name in enumerate(table.names)}
        for each in of_columns(assigned):
            with suppress(InputError):
                symbols[table.index(each.heading)] = each.symbol or ""
    headings = [name.casefold() for name in table.names]
    shown_columns = []
    for index, heading in enumerate(table.names[:_MOST]):
        is_alone = bool(heading) and headings.count(heading.casefold()) == 1 and "=" not in heading
        cells = tuple(excerpt(row[index]) for row in table.rows[:_CELLS])
        name = heading if is_alone and not heading.isdecimal() else str(index + 1)
        unit = name_and_unit(heading)[1] or ""
        shown_columns.append(FileColumn(heading, unit, name, cells, symbols.get(index, "")))
    return shown_columns
