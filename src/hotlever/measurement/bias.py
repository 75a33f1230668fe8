"""The bias of each row: as measured, or from the voltage over the lever; of either polarity."""

from __future__ import annotations

import numpy as np

from hotlever.errors import InputError, shown
from hotlever.measurement.checks import NOISE, note_rows
from hotlever.measurement.columns import LEVER, Column
from hotlever.measurement.settings import Settings
from hotlever.probe import Circuit
from hotlever.tables import Table
from hotlever.types import Array

#: Times the largest resistance of a lever: in series, it makes the bias rise along its curve.
_ENOUGH = 2.0
#: Part of the largest bias by which it may fall along the curve, for noise.
_FALLS = 0.002
#: Part of the largest current below which resistances are noise.
_COLD = 0.1
#: Part by which V_b - V_l may be off what R_s I_h says, of the largest bias.
_VOLTAGES_AGREE = 0.05


def find_bias(
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
            compare_voltages(table, values, settings, notes)
        return
    if ohm is None:
        if circuit is None:
            raise InputError(
                f"{table.path}: {LEVER} without R_s, from which the bias follows, expected a line "
                "like '# R_s (kOhm): 5.6'"
            )
        ohm = circuit.series_resistance_ohm
        settings.origin["series_resistance_ohm"] = "of the probe"
    kohm = _load(lever, current, ohm / 1000.0)
    if kohm != ohm / 1000.0:
        notes.append(
            f"{table.path}: V_b = V_l + R_s I_h with R_s = {ohm:g} ohm does not tell the points "
            f"beyond the knee apart; {kohm:g} kOhm are reckoned with instead, which changes "
            "nothing that a lever shows"
        )
        settings.origin["series_resistance_ohm"] = "reckoned with"
    found = {"series_resistance_ohm": kohm * 1000.0}
    Circuit.of(found, f"{table.path}: the resistance that {LEVER} over I_h asks for")
    settings.values.update(found)
    values["V_b"] = lever + kohm * current


def _load(lever: Array, current: Array, kohm: float) -> float:
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


def compare_voltages(
    table: Table, values: dict[str, Array], settings: Settings, notes: list[str]
) -> None:
    """Where a file has bias and lever voltage, take R_s from them, or check that it agrees.

    Raises
    ------
    InputError
        If it does not.
    """
    behind, current = values["V_b"] - values[LEVER], values["I_h"]
    known = np.isfinite(behind) & (
        np.abs(current) > _COLD * np.nanmax(np.abs(current), initial=0.0)
    )
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
        found = {"series_resistance_ohm": float(f"{1000.0 * kohm:.4g}")}
        Circuit.of(found, f"{table.path}: V_b - {LEVER} over I_h")
        settings.values.update(found)
        settings.origin["series_resistance_ohm"] = f"V_b - {LEVER} over I_h"


def mirror(
    table: Table,
    columns: dict[str, Column],
    values: dict[str, Array],
    symmetric: bool,
    notes: list[str],
) -> Array:
    """Turn rows of negative bias into those of the other polarity; return the signs of all.

    They stay as they are if the circuit is not symmetric.
    """
    sign = np.where((values["V_b"] < 0.0) & symmetric, -1.0, 1.0)
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
