"""Measurement files read: columns, units, settings, and the bias that a current stands for."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from hotlever.errors import InputError, counted, excerpt
from hotlever.files import read_bytes
from hotlever.lever.transient.waveform import Polyline, Waveform
from hotlever.measurement.columns import (
    constant_bias,
    find_columns,
    is_taken_as_bias,
    measured_table,
    note_on_bias,
    note_on_header,
    note_on_unused,
    note_on_words,
    quantity_of,
)
from hotlever.measurement.compliance import without_rows_at_compliance
from hotlever.measurement.contents import NOISE, Contents, Settings, check
from hotlever.measurement.data import (
    MEASURED,
    OPTIONAL,
    Measurement,
    noise_about_neighbours,
)
from hotlever.measurement.rows import described, disagreements, sweeps_of
from hotlever.probe import Circuit, Probe
from hotlever.quantities import FITTED, MEASURANDS
from hotlever.tables import groups_in
from hotlever.types import Array, Mask
from hotlever.units import MOST_BIAS, name_and_unit


def find_bias(contents: Contents, circuit: Circuit | None, waveform: Waveform | None) -> None:
    """Complete bias, current and R_s from the voltage over the lever and the wave form, if given.

    Raises
    ------
    InputError
        If a bias is missing, R_s is needed and not given, or voltages disagree.
    """
    columns, values = contents.columns, contents.values
    if waveform is not None:
        if "V_b" in columns:
            contents.note("V_b is not used beside the wave form that was given")
        before = values["t"] < 0.0
        contents.refuse(before, "times from 0 on, where the wave form begins", "t")
        values["V_b"] = waveform.bias(values["t"])
        contents.origin["V_b"] = "the wave form"
    elif "V_b" in columns:
        contents.refuse(np.isnan(values["V_b"]), "a bias", "V_b")
    elif (bias := constant_bias(contents.table)) is not None and "V_l" not in columns:
        values["V_b"] = np.full_like(values["V_b"], bias)
        contents.origin["V_b"] = "a comment, the same for all rows"
    else:
        _bias_of_lever_voltage(contents, circuit)
    if "V_l" in columns and "t" in columns and "I_h" not in columns:
        _current_of_voltages(contents, circuit)
    elif "V_l" in columns and "V_b" in columns and waveform is None:
        _compare_voltages(contents)


def _bias_of_lever_voltage(contents: Contents, circuit: Circuit | None) -> None:
    lever, current = contents.values["V_l"], contents.values["I_h"]
    for symbol, missing in (("V_l", np.isnan(lever)), ("I_h", np.isnan(current))):
        contents.refuse(missing, "a number, since V_b follows from V_l", symbol)
    kohm = _series_kohm(contents, circuit, "V_l without R_s, from which the bias follows")
    more = _telling_kohm(lever, current, kohm)
    if "t" not in contents.columns and more > kohm:
        contents.note(
            f"V_b = V_l + R_s I_h with R_s = {1000.0 * kohm:g} ohm does not tell the points beyond "
            f"the knee apart; {more:g} kOhm are reckoned with instead, which changes nothing that "
            "a lever shows"
        )
        kohm = more
        what = "the resistance that V_l over I_h asks for"
        _put_resistance(contents, 1000.0 * kohm, what, "reckoned with")
    bias = contents.values["V_b"] = lever + kohm * current
    contents.refuse(np.abs(bias) > MOST_BIAS, f"a bias of at most {MOST_BIAS:g} V", "V_l")
    contents.origin["V_b"] = "V_l + R_s I_h"


def _current_of_voltages(contents: Contents, circuit: Circuit | None) -> None:
    how = "I_h follows from V_b - V_l and R_s"
    kohm = _series_kohm(contents, circuit, f"{how} alone")
    if kohm == 0.0:
        raise InputError(f"{contents.table.path}: {how}, which is 0 ohm, expected more")
    contents.values["I_h"] = (contents.values["V_b"] - contents.values["V_l"]) / kohm
    contents.origin["I_h"] = "(V_b - V_l) / R_s"
    contents.note(f"{how} = {1000.0 * kohm:g} ohm, which counts as known")


def _series_kohm(contents: Contents, circuit: Circuit | None, needed: str) -> float:
    """Return R_s (kΩ) of the file, or of the circuit, which then counts; refuse a file without."""
    settings = contents.settings
    if "series_resistance_ohm" not in settings.values:
        if circuit is None:
            raise InputError(
                f"{contents.table.path}: {needed}, expected a line like '# R_s (kOhm): 5.6'"
            )
        settings.put("series_resistance_ohm", circuit.series_resistance_ohm, "of the probe")
    return float(settings.values["series_resistance_ohm"]) / 1000.0


def _put_resistance(contents: Contents, ohm: float, what: str, origin: str) -> None:
    """Let a resistance that follows from the data count as R_s, if it may be one."""
    Circuit.from_values({"series_resistance_ohm": ohm}, f"{contents.table.path}: {what}")
    contents.settings.put("series_resistance_ohm", ohm, origin)


def _telling_kohm(lever: Array, current: Array, kohm: float) -> float:
    """Return a resistance behind which no two points of a curve have one bias: its own if it can.

    Beyond the knee voltage and current fall and rise again, each on its own; behind a resistance
    of the lever's size or more the bias rises all the way.
    """
    warm = _is_warm(current)
    # twice the largest resistance of a lever: the bias rises along its curve behind that
    enough = 2.0 * float(np.max(np.abs(lever[warm] / current[warm]), initial=0.0))
    order = np.argsort(np.abs(lever + enough * current), kind="stable")
    bias = np.abs(lever + kohm * current)[order]
    # by more than noise
    falls = np.max(np.maximum.accumulate(bias) - bias) > 2e-3 * bias.max()
    return float(f"{enough:.2g}") if falls and enough > kohm else kohm


def _is_warm(current: Array) -> Mask:
    """Return where a resistance, of this current, is more than noise."""
    return np.asarray(np.abs(current) > 0.1 * np.nanmax(np.abs(current), initial=0.0))


def _compare_voltages(contents: Contents) -> None:
    """Take R_s from bias and lever voltage, or check that the one given agrees with them."""
    path, values = contents.table.path, contents.values
    settings = contents.settings.values
    behind, current = values["V_b"] - values["V_l"], values["I_h"]
    warm = _is_warm(current) & np.isfinite(behind)
    if not warm.any():
        contents.note("V_l is not used beside V_b without I_h")
        return
    kohm = float(np.median(behind[warm] / current[warm]))
    ohm = settings.get("series_resistance_ohm", 1000.0 * kohm)
    off = np.abs(behind[warm] - ohm / 1000.0 * current[warm])
    if kohm < 0.0 or np.median(off) > 0.05 * np.abs(values["V_b"]).max():
        raise InputError(
            f"{path}: V_b - V_l is {kohm:.4g} kOhm times I_h, expected R_s = "
            f"{ohm:.4g} ohm; is a unit wrong?"
        )
    if "series_resistance_ohm" not in settings:
        origin = "V_b - V_l over I_h"
        _put_resistance(contents, float(f"{1000.0 * kohm:.4g}"), origin, origin)


def mirror(contents: Contents) -> None:
    """Turn rows of negative bias into those of the other polarity.

    Raises
    ------
    InputError
        If current or voltages have another sign than the bias.
    """
    values = contents.values
    sign = np.where(values["V_b"] < 0.0, -1.0, 1.0)
    if (sign > 0.0).all():
        return
    bias = "V_b" if "V_b" in contents.columns else "V_l"
    # what changes its sign with the polarity
    turned = ("V_b", "V_l", "I_h", "V_r", "V_bridge")
    for symbol in turned:
        values[symbol] = sign * values[symbol]
        size = np.nanmax(np.abs(values[symbol]), initial=0.0)
        if not MEASURANDS[symbol].signed:
            contents.refuse(values[symbol] < -NOISE * size, "the same sign", bias, symbol)
    others = " and ".join(symbol for symbol in turned[2:] if symbol in contents.columns)
    contents.note_rows(sign < 0.0, f"V_b is negative, and counts as positive with {others}")


def check_times(contents: Contents) -> None:
    """Refuse times that are missing or do not rise.

    Raises
    ------
    InputError
        If there are some, or there are fewer than two.
    """
    times = contents.values["t"]
    contents.refuse(np.isnan(times), "a time", "t")
    falls = np.diff(times, prepend=-np.inf) <= 0.0
    above = contents.cell("t", int(np.argmax(falls)) - 1)
    contents.refuse(falls, f"a time after that above, '{above}'", "t")
    if times.size < 2:
        raise InputError(f"{contents.table.path}: found one row, expected two or more times")


def leave_out_jumps(contents: Contents, waveform: Waveform) -> None:
    """Leave out what was measured when the bias jumps: nobody can tell if before or behind."""
    times, values = contents.values["t"], contents.values
    same = 1e-9  # share of a time within which it is the same
    pieces = waveform.pieces(float(times[-1]) * (1.0 + same) + same)
    jumps = np.array([piece.start for piece in pieces if piece.jumps])
    at_jump = np.isclose(times[:, None], jumps, rtol=same, atol=0.0).any(axis=1)
    for column in FITTED.values():
        values[column.symbol] = np.where(at_jump, np.nan, values[column.symbol])
    contents.note_rows(at_jump, "the bias jumps at this time, so that the row is not used")


def find_waveform(contents: Contents, most_lines: int = 500) -> Waveform:
    """Return the straight lines that biases lie on within their noise; times count from 0 on.

    Raises
    ------
    InputError
        If these lines are too many, or times before 0 show a lever that is not cold.
    """
    table, times, bias = contents.table, contents.values["t"], contents.values["V_b"]
    largest = float(np.abs(bias).max())
    noise = noise_about_neighbours(bias) if bias.size > 4 else 0.0
    # off straight lines by a share of the largest bias, or by its noise if that is no more than 3 %
    tolerance = max(1e-3 * largest, min(5.0 * noise, 0.03 * largest))
    begins_on = abs(float(bias[0])) > tolerance
    if begins_on and times[0] < 0.0:
        raise InputError(
            f"{table.where(0)}: V_b is {bias[0]:g} V at {times[0]:g} µs, expected a bias of 0, "
            "of a lever that is cold, or times that count from where it is switched on"
        )
    if not begins_on:
        times = contents.values["t"] = times - times[0]
    corners = _corners(times, bias, tolerance, most_lines)
    if corners is None:
        raise InputError(
            f"{table.path}: V_b has more than {most_lines} straight parts, expected fewer, "
            "or the wave form beside the file, such as --pulse 10V,5us"
        )
    from scipy.interpolate import make_lsq_spline  # takes half a second

    at = times[corners]
    volts = make_lsq_spline(times, bias, np.concatenate((at[:1], at, at[-1:])), k=1).c
    if begins_on:
        contents.notes.append(
            f"{table.where(0)}: V_b is {bias[0]:.4g} V in the first row; it is taken as switched "
            "on at t = 0, and the lever as cold before"
        )
        if at[0] > 0.0:
            at, volts = np.append(0.0, at), np.append(volts[0], volts)
    else:
        volts[0] = 0.0
    steep = (np.diff(corners) == 1) & (np.abs(np.diff(bias[corners])) > 0.1 * largest)
    if steep.any():
        row = int(corners[:-1][steep][0]) + 1
        contents.notes.append(
            f"{table.where(row)}: V_b jumps; it counts as a straight line of "
            f"{times[row] - times[row - 1]:.3g} µs from the row above, and a wave form such as "
            "--pulse 10V,5us would say when it did"
        )
    text = f"V_b of the file, {len(at) - 1} straight parts"
    return Polyline(text, tuple(at.tolist()), tuple(volts.tolist()), float(at[-1]))


def _corners(times: Array, bias: Array, tolerance: float, most_lines: int) -> Array | None:
    """Return the rows between which all others lie near straight lines; None if these are many.

    By Douglas and Peucker (Cartographica 10, 112 (1973)): where a line misses a row by most, there
    is a corner.
    """
    corners, open_ends = {0, times.size - 1}, [(0, times.size - 1)]
    while open_ends:
        first, last = open_ends.pop()
        ends, rows = [first, last], np.arange(first + 1, last)
        away = np.abs(bias[rows] - np.interp(times[rows], times[ends], bias[ends]))
        if away.max(initial=0.0) > tolerance:
            corner = int(rows[away.argmax()])
            corners.add(corner)
            open_ends += [(first, corner), (corner, last)]
        if len(corners) > most_lines:
            return None
    return np.array(sorted(corners))


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
    lasts 10 ms at most, or a wave form or the column are told of; it begins with a cold lever.

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
    table, assigned = measured_table(path, columns)
    settings = Settings.of(table)
    quantities = find_columns(table, assigned, driven=waveform is not None)
    remarks = (
        f"{table.path}: line {line}: '{excerpt(text)}' is taken for a comment"
        for line, text in table.remarks
    )
    contents = Contents(table, quantities, settings, [*settings.notes, *remarks])
    if "t" in quantities:
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
    most = 20
    more = len(notes) - most
    if more > 0:
        notes[most:] = [f"{path}: {more} more such notes"]
    rows: dict[str, Any] = {column.name: contents.values[column.symbol] for column in MEASURED}
    absent = [name for name in OPTIONAL if np.isnan(rows[name]).all()]
    rows |= dict.fromkeys(absent)
    measurement = Measurement(
        **rows,
        **settings.values,
        time_us=contents.values["t"] if "t" in quantities else None,
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
    if len(sweeps) > 1 and "D" not in contents.columns:
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
    """Return the groups of a binary file, each a measurement of its own; other files have none.

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
    table, assigned = measured_table(path, columns)
    symbols = dict[int, str]()
    try:
        used = find_columns(table, assigned, driven=driven)
        symbols = {column.index: symbol for symbol, column in used.items()}
    except InputError:
        # what is missing or stands twice is for the user to say
        symbols = {i: quantity_of(name) or "" for i, name in enumerate(table.names)}
        for each in assigned:
            with suppress(InputError):
                symbols[table.index(each.heading)] = each.symbol or ""
    headings = [name.casefold() for name in table.names]
    shown_columns = []
    for index, heading in enumerate(table.names[:60]):
        is_alone = bool(heading) and headings.count(heading.casefold()) == 1 and "=" not in heading
        cells = tuple(excerpt(row[index]) for row in table.rows[:3])
        name = heading if is_alone and not heading.isdecimal() else str(index + 1)
        unit = name_and_unit(heading)[1] or ""
        shown_columns.append(FileColumn(heading, unit, name, cells, symbols.get(index, "")))
    return shown_columns
