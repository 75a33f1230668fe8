"""Rows that were measured in time: which they are, and the wave form that their biases follow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hotlever.errors import InputError, shown
from hotlever.lever.transient.waveform import MOST_BIAS, Polyline, Waveform
from hotlever.measurement.bias import compare_voltages
from hotlever.measurement.checks import note_rows
from hotlever.measurement.columns import LEVER, Column
from hotlever.measurement.data import OBSERVABLE_SYMBOLS, TIME
from hotlever.measurement.scatter import noise_about_neighbours
from hotlever.measurement.settings import Settings
from hotlever.probe import Circuit
from hotlever.tables import Table, number
from hotlever.types import Array
from hotlever.units import TIMES, name_and_unit

#: µs that a table in time lasts at most, unless one says that it is one: longer ones are slow
#: sweeps with the time of each row.
BRIEF = 1e4
#: By what a bias may differ from straight lines: a share of the largest, and so many standard
#: deviations of its noise, but no larger a share.
_STRAIGHT, _NOISE, _MOST_NOISE = 1e-3, 5.0, 0.03
#: Share of a time within which it is the same.
_SAME = 1e-9
#: Share of the largest bias by which it jumps from one row to the next.
_JUMP = 0.1
#: Straight lines that a wave form may have at most.
_MOST_LINES = 500


def take_time(
    table: Table,
    columns: dict[str, Column],
    told: Mapping[str, str],
    unused: list[str],
    *,
    expected: bool,
) -> bool:
    """Return whether a table is of what was measured in time; else leave its times out.

    Raises
    ------
    InputError
        If no time is found although it is `expected`, or one is no number.
    """
    column = columns.get(TIME)
    if column is None:
        if expected:
            raise InputError(
                f"{table.where(-1)}: no column of the time, expected one like 'time (us)' beside "
                "a wave form"
            )
        return False
    asked = expected or any(name_and_unit(quantity)[0].casefold() in TIMES for quantity in told)
    cell = table.rows[0][column.place]
    # clocks show no numbers
    if asked or number(cell, table.decimal_comma) is not None:
        times = column.values(table)
        known = times[np.isfinite(times)]
        if asked or (known.size and 0.0 < np.ptp(known) <= BRIEF):
            return True
    del columns[TIME]
    unused.append(f"{table.path}: column '{shown(column.heading)}' is not used")
    return False


def find_waveform(
    table: Table,
    columns: dict[str, Column],
    values: dict[str, Array],
    settings: Settings,
    circuit: Circuit | None,
    waveform: Waveform | None,
    notes: list[str],
) -> dict[str, Any]:
    """Return times and wave form; bias and current are completed from the voltage over the lever.

    Raises
    ------
    InputError
        If times do not rise, a bias is missing, or the wave form has too many corners.
    """
    times = values[TIME]
    _check_times(table, columns[TIME], times)
    ohm = settings.values.get("series_resistance_ohm")
    if ohm is None and circuit is not None:
        ohm = circuit.series_resistance_ohm
    if waveform is not None:
        if times[0] < 0.0:
            cell = shown(table.rows[0][columns[TIME].place])
            raise InputError(
                f"{table.where(0)}: {TIME} is '{cell}', expected times from 0 on, where the wave "
                "form begins"
            )
        if "V_b" in columns:
            notes.append(f"{table.path}: V_b is not used beside the wave form that was given")
        values["V_b"] = waveform.bias(times)
    elif "V_b" not in columns:
        if ohm is None:
            raise InputError(f"{table.path}: {LEVER} without R_s, expected '# R_s (kOhm): 5.6'")
        values["V_b"] = values[LEVER] + ohm / 1000.0 * values["I_h"]
    bias, told = values["V_b"], "V_b" if "V_b" in columns else LEVER
    wrong = np.isnan(bias) | (np.abs(bias) > MOST_BIAS)
    if wrong.any():
        row = int(np.argmax(wrong))
        cell = shown(table.rows[row][columns[told].place])
        raise InputError(
            f"{table.where(row)}: {told} is '{cell}', expected a bias of at most {MOST_BIAS:g} V"
        )
    if LEVER in columns and "I_h" not in columns:
        if not ohm:
            raise InputError(
                f"{table.path}: I_h follows from V_b - {LEVER} and R_s alone, expected a line like "
                "'# R_s (kOhm): 5.6'"
            )
        values["I_h"] = (bias - values[LEVER]) / (ohm / 1000.0)
        notes.append(
            f"{table.path}: I_h follows from V_b - {LEVER} and R_s = {ohm:g} ohm, which counts as "
            "known"
        )
    elif LEVER in columns and "V_b" in columns and waveform is None:
        compare_voltages(table, values, settings, notes)
    if waveform is None:
        waveform, times = _straight_lines(table, times, bias, notes)
    else:
        _leave_out_jumps(table, times, waveform, values, notes)
    return {"time_us": times, "waveform": waveform}


def _leave_out_jumps(
    table: Table, times: Array, waveform: Waveform, values: dict[str, Array], notes: list[str]
) -> None:
    """Leave out what was measured when the bias jumps: nobody can tell if before or behind."""
    pieces = waveform.pieces(float(times[-1]) * (1.0 + _SAME) + _SAME)
    jumps = np.array([piece.start for piece in pieces if piece.jumps])
    at = (np.abs(times[:, None] - jumps) <= _SAME * times[:, None]).any(axis=1)
    for symbol in OBSERVABLE_SYMBOLS.values():
        values[symbol] = np.where(at, np.nan, values[symbol])
    note_rows(notes, table, at, "the bias jumps at this time, so that the row is not used")


def _check_times(table: Table, column: Column, times: Array) -> None:
    """Refuse times that are missing or do not rise."""
    cells = [shown(row[column.place]) for row in table.rows]
    falls = np.diff(times, prepend=-np.inf) <= 0.0
    for wrong, expected in ((np.isnan(times), "a time"), (falls, "a time after that above")):
        if wrong.any():
            row = int(np.argmax(wrong))
            above = f", '{cells[row - 1]}'" if wrong is falls else ""
            raise InputError(
                f"{table.where(row)}: {TIME} is '{cells[row]}', expected {expected}{above}"
            )
    if times.size < 2:
        raise InputError(f"{table.path}: found one row, expected two or more times")


def _straight_lines(
    table: Table, times: Array, bias: Array, notes: list[str]
) -> tuple[Waveform, Array]:
    """Return the straight lines that biases lie on within their noise, and the times from 0 on."""
    largest = float(np.abs(bias).max())
    noise = noise_about_neighbours(bias) if bias.size > 4 else 0.0
    tolerance = max(_STRAIGHT * largest, min(_NOISE * noise, _MOST_NOISE * largest))
    on = abs(float(bias[0])) > tolerance
    if on and times[0] < 0.0:
        raise InputError(
            f"{table.where(0)}: V_b is {bias[0]:g} V at {times[0]:g} µs, expected a bias of 0, "
            "of a lever that is cold, or times that count from where it is switched on"
        )
    if not on:
        times = times - times[0]
    corners = _corners(times, bias, tolerance)
    if corners is None:
        raise InputError(
            f"{table.path}: V_b has more than {_MOST_LINES} straight parts, expected fewer, or the "
            "wave form beside the file, such as --pulse 10V,5us"
        )
    volts = _heights(times, bias, corners)
    if not on:
        volts[0] = 0.0
    at = times[corners]
    if on:
        notes.append(
            f"{table.where(0)}: V_b is {bias[0]:.4g} V in the first row; it is taken as switched "
            "on at t = 0, and the lever as cold before"
        )
        if at[0] > 0.0:
            at, volts = np.append(0.0, at), np.append(volts[0], volts)
    jumps = np.flatnonzero(
        (np.diff(corners) == 1) & (np.abs(np.diff(bias[corners])) > _JUMP * largest)
    )
    if jumps.size:
        row = int(corners[jumps[0]]) + 1
        lasts = times[row] - times[row - 1]
        notes.append(
            f"{table.where(row)}: V_b jumps; it counts as a straight line of {lasts:.3g} µs from "
            "the row above, and a wave form such as --pulse 10V,5us would say when it did"
        )
    text = f"V_b of the file, {len(at) - 1} straight parts"
    points = tuple(at.tolist()), tuple(volts.tolist())
    return Polyline(text, *points, float(at[-1])), times


def _corners(times: Array, bias: Array, tolerance: float) -> Array | None:
    """Return the rows between which all others lie near straight lines; None if these are many.

    By Douglas and Peucker (Cartographica 10, 112 (1973)): where a line misses a row by most, there
    is a corner.
    """
    kept, open_ends = {0, times.size - 1}, [(0, times.size - 1)]
    while open_ends:
        first, last = open_ends.pop()
        inside = slice(first + 1, last)
        share = (times[inside] - times[first]) / (times[last] - times[first])
        away = np.abs(bias[inside] - (bias[first] + share * (bias[last] - bias[first])))
        if away.size and away.max() > tolerance:
            place = first + 1 + int(away.argmax())
            kept.add(place)
            open_ends += [(first, place), (place, last)]
        if len(kept) > _MOST_LINES:
            return None
    return np.array(sorted(kept))


def _heights(times: Array, bias: Array, corners: Array) -> Array:
    """Return the biases at the corners for which the lines between are nearest to all rows."""
    at, count = times[corners], corners.size
    part = np.clip(np.searchsorted(at, times, side="right") - 1, 0, count - 2)
    share = (times - at[part]) / (at[part + 1] - at[part])
    matrix, right = np.zeros((count, count)), np.zeros(count)
    for one, weight in ((part, 1.0 - share), (part + 1, share)):
        right += np.bincount(one, weight * bias, count)
        for other, further in ((part, 1.0 - share), (part + 1, share)):
            np.add.at(matrix, (one, other), weight * further)
    return np.asarray(np.linalg.solve(matrix, right))
