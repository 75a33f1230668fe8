"""The bias of each row: measured, from the voltage over the lever, or of a wave form in time."""

from __future__ import annotations

import numpy as np

from hotlever.errors import InputError
from hotlever.lever.transient.waveform import Polyline, Waveform
from hotlever.measurement.columns import constant_bias
from hotlever.measurement.contents import NOISE, Contents
from hotlever.measurement.data import LEVER, TIME, noise_about_neighbours
from hotlever.probe import Circuit
from hotlever.quantities import FITTED, MEASURANDS
from hotlever.types import Array
from hotlever.units import MOST_BIAS

#: Times the largest resistance of a lever: in series, it makes the bias rise along its curve.
_ENOUGH = 2.0
#: Part of the largest bias by which it may fall along the curve, for noise.
_FALLS = 0.002
#: Part of the largest current below which resistances are noise.
_COLD = 0.1
#: What changes its sign with the polarity.
_TURNED = ("V_b", LEVER, "I_h", "V_r", "V_bridge")
#: Part by which V_b - V_l may be off what R_s I_h says, of the largest bias.
_VOLTAGES_AGREE = 0.05


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
        before = values[TIME] < 0.0
        contents.refuse(before, "times from 0 on, where the wave form begins", TIME)
        values["V_b"] = waveform.bias(values[TIME])
        contents.origin["V_b"] = "the wave form"
    elif "V_b" in columns:
        contents.refuse(np.isnan(values["V_b"]), "a bias", "V_b")
    elif (bias := constant_bias(contents.table)) is not None and LEVER not in columns:
        values["V_b"] = np.full_like(values["V_b"], bias)
        contents.origin["V_b"] = "a comment, the same for all rows"
    else:
        _bias_of_lever_voltage(contents, circuit)
    if LEVER in columns and TIME in columns and "I_h" not in columns:
        _current_of_voltages(contents, circuit)
    elif LEVER in columns and "V_b" in columns and waveform is None:
        _compare_voltages(contents)


def _bias_of_lever_voltage(contents: Contents, circuit: Circuit | None) -> None:
    lever, current = contents.values[LEVER], contents.values["I_h"]
    for symbol, missing in ((LEVER, np.isnan(lever)), ("I_h", np.isnan(current))):
        contents.refuse(missing, f"a number, since V_b follows from {LEVER}", symbol)
    kohm = _series_kohm(contents, circuit, f"{LEVER} without R_s, from which the bias follows")
    if TIME not in contents.columns and (more := _telling_kohm(lever, current, kohm)) > kohm:
        contents.note(
            f"V_b = V_l + R_s I_h with R_s = {1000.0 * kohm:g} ohm does not tell the points beyond "
            f"the knee apart; {more:g} kOhm are reckoned with instead, which changes nothing that "
            "a lever shows"
        )
        kohm = more
        what = f"the resistance that {LEVER} over I_h asks for"
        _put_resistance(contents, 1000.0 * kohm, what, "reckoned with")
    bias = contents.values["V_b"] = lever + kohm * current
    contents.refuse(np.abs(bias) > MOST_BIAS, f"a bias of at most {MOST_BIAS:g} V", LEVER)
    contents.origin["V_b"] = f"{LEVER} + R_s I_h"


def _current_of_voltages(contents: Contents, circuit: Circuit | None) -> None:
    how = f"I_h follows from V_b - {LEVER} and R_s"
    kohm = _series_kohm(contents, circuit, f"{how} alone")
    if kohm == 0.0:
        raise InputError(f"{contents.table.path}: {how}, which is 0 ohm, expected more")
    contents.values["I_h"] = (contents.values["V_b"] - contents.values[LEVER]) / kohm
    contents.origin["I_h"] = f"(V_b - {LEVER}) / R_s"
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
    warm = np.abs(current) > _COLD * np.abs(current).max()
    enough = _ENOUGH * float(np.max(np.abs(lever[warm] / current[warm]), initial=0.0))
    order = np.argsort(np.abs(lever + enough * current), kind="stable")
    bias = np.abs(lever + kohm * current)[order]
    falls = np.max(np.maximum.accumulate(bias) - bias) > _FALLS * bias.max()
    return float(f"{enough:.2g}") if falls and enough > kohm else kohm


def _compare_voltages(contents: Contents) -> None:
    """Take R_s from bias and lever voltage, or check that the one given agrees with them."""
    path, values = contents.table.path, contents.values
    settings = contents.settings.values
    behind, current = values["V_b"] - values[LEVER], values["I_h"]
    warm = np.abs(current) > _COLD * np.nanmax(np.abs(current), initial=0.0)
    warm &= np.isfinite(behind)
    if not warm.any():
        contents.note(f"{LEVER} is not used beside V_b without I_h")
        return
    kohm = float(np.median(behind[warm] / current[warm]))
    ohm = settings.get("series_resistance_ohm", 1000.0 * kohm)
    off = np.abs(behind[warm] - ohm / 1000.0 * current[warm])
    if kohm < 0.0 or np.median(off) > _VOLTAGES_AGREE * np.abs(values["V_b"]).max():
        raise InputError(
            f"{path}: V_b - {LEVER} is {kohm:.4g} kOhm times I_h, expected R_s = "
            f"{ohm:.4g} ohm; is a unit wrong?"
        )
    if "series_resistance_ohm" not in settings:
        origin = f"V_b - {LEVER} over I_h"
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
    bias = "V_b" if "V_b" in contents.columns else LEVER
    for symbol in _TURNED:
        values[symbol] = sign * values[symbol]
        size = np.nanmax(np.abs(values[symbol]), initial=0.0)
        if not MEASURANDS[symbol].signed:
            contents.refuse(values[symbol] < -NOISE * size, "the same sign", bias, symbol)
    others = " and ".join(symbol for symbol in _TURNED[2:] if symbol in contents.columns)
    contents.note_rows(sign < 0.0, f"V_b is negative, and counts as positive with {others}")


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
    for column in FITTED.values():
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
