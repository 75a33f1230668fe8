"""Rows that were measured in time, and the wave form that their biases follow."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_lsq_spline

from hotlever.datasets import OBSERVABLES
from hotlever.errors import InputError
from hotlever.lever.transient.waveform import Polyline, Waveform
from hotlever.measurement.contents import Contents
from hotlever.measurement.data import TIME
from hotlever.measurement.scatter import noise_about_neighbours
from hotlever.types import Array

#: By what a bias may differ from straight lines: a share of the largest, and so many standard
#: deviations of its noise, but no larger a share.
_STRAIGHT, _NOISE, _MOST_NOISE = 1e-3, 5.0, 0.03
#: Share of a time within which it is the same.
_SAME = 1e-9
#: Share of the largest bias by which it jumps from one row to the next.
_JUMP = 0.1
#: Straight lines that a wave form may have at most.
_MOST_LINES = 500


def check_times(contents: Contents) -> None:
    """Refuse times that are missing or do not rise.

    Raises
    ------
    InputError
        If there are some, or there are fewer than two.
    """
    times = contents.values[TIME]
    contents.refuse(np.isnan(times), "a time", TIME)
    falls = np.diff(times, prepend=-np.inf) <= 0.0
    above = contents.cell(TIME, int(np.argmax(falls)) - 1)
    contents.refuse(falls, f"a time after that above, '{above}'", TIME)
    if times.size < 2:
        raise InputError(f"{contents.table.path}: found one row, expected two or more times")


def leave_out_jumps(contents: Contents, waveform: Waveform) -> None:
    """Leave out what was measured when the bias jumps: nobody can tell if before or behind."""
    times, values = contents.values[TIME], contents.values
    pieces = waveform.pieces(float(times[-1]) * (1.0 + _SAME) + _SAME)
    jumps = np.array([piece.start for piece in pieces if piece.jumps])
    at_jump = np.isclose(times[:, None], jumps, rtol=_SAME, atol=0.0).any(axis=1)
    for column in OBSERVABLES.values():
        values[column.symbol] = np.where(at_jump, np.nan, values[column.symbol])
    contents.note_rows(at_jump, "the bias jumps at this time, so that the row is not used")


def find_waveform(contents: Contents) -> Waveform:
    """Return the straight lines that biases lie on within their noise; times count from 0 on.

    Raises
    ------
    InputError
        If these lines are too many, or times before 0 show a lever that is not cold.
    """
    table, times, bias = contents.table, contents.values[TIME], contents.values["V_b"]
    largest = float(np.abs(bias).max())
    noise = noise_about_neighbours(bias) if bias.size > 4 else 0.0
    tolerance = max(_STRAIGHT * largest, min(_NOISE * noise, _MOST_NOISE * largest))
    begins_on = abs(float(bias[0])) > tolerance
    if begins_on and times[0] < 0.0:
        raise InputError(
            f"{table.where(0)}: V_b is {bias[0]:g} V at {times[0]:g} µs, expected a bias of 0, "
            "of a lever that is cold, or times that count from where it is switched on"
        )
    if not begins_on:
        times = contents.values[TIME] = times - times[0]
    corners = _corners(times, bias, tolerance)
    if corners is None:
        raise InputError(
            f"{table.path}: V_b has more than {_MOST_LINES} straight parts, expected fewer, or the "
            "wave form beside the file, such as --pulse 10V,5us"
        )
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
    steep = (np.diff(corners) == 1) & (np.abs(np.diff(bias[corners])) > _JUMP * largest)
    if steep.any():
        row = int(corners[:-1][steep][0]) + 1
        contents.notes.append(
            f"{table.where(row)}: V_b jumps; it counts as a straight line of "
            f"{times[row] - times[row - 1]:.3g} µs from the row above, and a wave form such as "
            "--pulse 10V,5us would say when it did"
        )
    text = f"V_b of the file, {len(at) - 1} straight parts"
    return Polyline(text, tuple(at.tolist()), tuple(volts.tolist()), float(at[-1]))


def _corners(times: Array, bias: Array, tolerance: float) -> Array | None:
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
        if len(corners) > _MOST_LINES:
            return None
    return np.array(sorted(corners))
