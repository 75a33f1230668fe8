"""Measurement files read: columns, units, settings, and the bias that a current stands for."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hotlever.errors import InputError, counted, excerpt
from hotlever.files import read_bytes
from hotlever.lever.transient.waveform import Polyline, Waveform
from hotlever.materials.air import ATMOSPHERE
from hotlever.measurement.columns import (
    Column,
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
from hotlever.measurement.data import (
    MEASURED,
    Measurement,
    as_attributes,
    colder_than_base,
    noise_about_neighbours,
)
from hotlever.measurement.rows import (
    described,
    disagreements,
    sweeps_of,
    without_rows_at_compliance,
)
from hotlever.probe import Circuit, Probe
from hotlever.probe.priors import share_of
from hotlever.probe.surroundings import Surroundings
from hotlever.quantities import FITTED, MEASURANDS
from hotlever.tables import TextTable, groups_in
from hotlever.types import Array, Mask
from hotlever.units import (
    MOST_BIAS,
    amount,
    conversion,
    key_and_value,
    may_be_thousands,
    name_and_unit,
    plain_powers,
    plausible,
    quantity,
    unit_behind,
)

#: Settings: attribute of a `Measurement`, name, unit, and how people write the name, without case,
#: blanks and underscores.
_SETTINGS = {
    "series_resistance_ohm": (
        "R_s",
        "ohm",
        "rs rseries seriesresistance seriesresistor vorwiderstand",
    ),
    "base_temperature_K": ("T_base", "K", "basetemperature basetemp tbase t0 basistemperatur"),
    "medium": ("medium", "", "medium gas atmosphere environment surroundings"),
    "pressure_mbar": ("pressure", "mbar", "p"),
    "gas_conductivity": ("gas conductivity", "of air's", ""),
    "raman_scale": ("raman_scale", "of the rise", "ramanscale"),
}
#: Media by their names, and other gases, whose conductivity is another.
_MEDIA = {
    **dict.fromkeys(("vacuum", "evacuated"), "vacuum"),
    **dict.fromkeys(("nitrogen", "n2"), "nitrogen"),
    "air": "air",
}
_OTHER_GASES = {
    *("helium", "he", "argon", "ar", "hydrogen", "h2", "oxygen", "o2", "co2", "neon", "ne"),
    *("krypton", "kr", "xenon", "xe", "sf6", "methane", "ch4", "steam", "water", "oil"),
}
#: mbar; a gas below it, of free molecules, takes less than 0.2 % of a lever's power.
VACUUM_MBAR = 0.05
#: Characters of a setting that are looked at.
_LONGEST = 200


@dataclass
class Contents:
    """Rows and settings of a file while it is read.

    Attributes
    ----------
    table : TextTable
    settings : dict of str to Any
        What comments set, by attribute of a `Measurement`.
    columns : dict of str to Column
        By symbol: the quantities that the file gives.
    values : dict of str to ndarray, shape (n,)
        Every quantity by its symbol, in the unit inside; NaN where nothing is known.
    origin : dict of str to str
        The column of a quantity, where a setting was said, or what they follow from.
    notes : list of str
        What of the file was not used or not understood, and what looks wrong in it.
    """

    table: TextTable
    settings: dict[str, Any] = field(default_factory=dict)
    columns: dict[str, Column] = field(default_factory=dict)
    values: dict[str, Array] = field(default_factory=dict)
    origin: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def take_settings(self) -> None:
        """Read the comments that give a setting.

        Raises
        ------
        InputError
            If a setting is impossible, or two of them contradict each other.
        """
        mentioned: list[tuple[str, str]] = []
        # beside decimal commas a point may be a mark of thousands too
        thousands = ",." if self.table.dialect.decimal_comma else ","
        for line, text in self.table.comments:
            where = f"{self.table.path}: line {line}"
            # at '; ', and at ', ' and tabs where another setting follows
            between = r";\s|, (?=(?:[^,=:]|,(?! ))*[=:])|\t(?=[^\t=:]*[=:])"
            for part in re.split(between, text):
                values = _setting(part, where, thousands)
                if values is None:
                    self.notes.append(
                        f"{where}: '{excerpt(part)}' is not understood and not used, expected a "
                        "line like '# R_s (kOhm): 5.6', '# base temperature (K): 293' or "
                        "'# medium: air'"
                    )
                elif not values and _gases(part):
                    mentioned.append((where, part))
                for name, value in (values or {}).items():
                    first = self.settings.get(name, value)
                    if first != value:
                        raise InputError(f"{where}: {name} is {value}, but {first} further up")
                    self.put(name, value, self.origin.get(name, f"line {line}"))
        self._settle(self.table.path)
        for where, part in mentioned:
            # a gas beside the medium matters, what else is said of it does not
            if "medium" not in self.settings or _words(part) & _OTHER_GASES:
                self.notes.append(
                    f"{where}: '{excerpt(part)}' does not set the medium, expected a line like "
                    "'# medium: air' or '# medium: vacuum'"
                )
                break

    def put(self, name: str, value: Any, origin: str) -> None:
        """Set a setting, and say where it is from."""
        self.settings[name], self.origin[name] = value, origin

    def understood(self) -> Iterator[tuple[str, str, str]]:
        """Give what is set, to what, and where it was said."""
        for attribute, (name, unit, _) in _SETTINGS.items():
            value = self.settings.get(attribute)
            if value is not None:
                text = value if isinstance(value, str) else f"{value:g} {unit}"
                yield name, text, self.origin[attribute]
            elif attribute in ("series_resistance_ohm", "base_temperature_K", "medium"):
                yield name, "not said", "the probe's counts"

    def _settle(self, path: str) -> None:
        """Bring gas and pressure together."""
        medium, pressure = self.settings.get("medium"), self.settings.get("pressure_mbar")
        if pressure is not None:
            line = self.origin["pressure_mbar"]
            where = f"{path}: {line}"
            plausible(f"{where}: pressure", "mbar", pressure, 0.0, 1e6)
            if pressure <= VACUUM_MBAR:
                if medium != "vacuum":
                    self.notes.append(f"{where}: {pressure:g} mbar of any gas count as vacuum")
                # the vacuum of the model has no pressure
                del self.settings["pressure_mbar"]
                self.put("medium", "vacuum", f"{line}, {pressure:g} mbar")
            elif medium in (None, "vacuum"):
                reason = "no gas is named" if medium is None else "this is no vacuum"
                raise InputError(
                    f"{where}: the pressure is {pressure:g} mbar and {reason}, expected a line "
                    f"like '# medium: air, {pressure:g} mbar', or at most {VACUUM_MBAR:g} mbar"
                )
        if self.settings.get("medium") == "nitrogen":
            self.settings["medium"] = "air"
            # within 1.3 % from 300 to 1200 K: the dilute gases of Lemmon and Jacobsen, Int. J.
            # Thermophys. 25, 21 (2004)
            self.put("gas_conductivity", 0.975, f"{self.origin['medium']}, nitrogen")

    def take_columns(self, columns: dict[str, Column]) -> None:
        """Read the columns of some quantities.

        Raises
        ------
        InputError
            If a cell is no number.
        """
        self.columns = columns
        self.origin |= {symbol: column.origin for symbol, column in columns.items()}
        self.values = dict.fromkeys(MEASURANDS, np.full(len(self.table.rows), np.nan))
        for symbol, column in columns.items():
            self.values[symbol] = column.values(self.table)
            if symbol not in ("V_b", "V_l", "t"):
                filled = np.array([bool(row[column.index]) for row in self.table.rows])
                missing = np.isnan(self.values[symbol]) & filled
                self.note_rows(missing, f"{symbol} is written as missing")

    def cell(self, symbol: str, row: int) -> str:
        """Return a cell as it stands in the file, to quote it."""
        return excerpt(self.table.rows[row][self.columns[symbol].index])

    def refuse(self, rows: Mask, expected: str, *symbols: str) -> None:
        """Refuse the first of some rows, (n,) of bool, for what its cells of `symbols` hold.

        Raises
        ------
        InputError
            If there is one; the text says what was `expected`.
        """
        if rows.any():
            row = int(np.argmax(rows))
            cells = " and ".join(f"{symbol} is '{self.cell(symbol, row)}'" for symbol in symbols)
            raise InputError(f"{self.table.where(row)}: {cells}, expected {expected}")

    def note(self, text: str) -> None:
        """Note what concerns the whole file."""
        self.notes.append(f"{self.table.path}: {text}")

    def note_rows(self, rows: Mask, text: str) -> None:
        """Note what is odd about some rows, (n,) of bool, if there are any."""
        if rows.any():
            others = f", and in {rows.sum() - 1} more rows" if rows.sum() > 1 else ""
            self.notes.append(f"{self.table.where(int(np.argmax(rows)))}: {text}{others}")


def _setting(text: str, where: str, thousands: str) -> dict[str, Any] | None:
    """Return what a comment sets, nothing where it is another comment, None where it is unclear."""
    if len(text) > 2000:
        return None
    key, value = key_and_value(text)
    words = _words(key)
    pressures = {"mbar", "bar", "hpa", "kpa", "pa", "mpa", "torr", "mtorr", "atm"}
    # beside these gas and pressure alone are clear without a name, as in 100 mbar N2
    plain = {"in", "at", "of", "dry", "lab", "still", "ambient", "e"}
    if not value and words & {*_MEDIA, *pressures} and words <= _gases(key) | pressures | plain:
        return _gas(key, where)
    if not value:
        # cells of a file with commas
        key, value = (part.strip(' ,"') for part in (*key.split(",", 1), "")[:2])
    name, unit = name_and_unit(key)
    bare = re.sub(r"[\W_]+", "", name[:40]).lower()
    so_called = (each for each, (*_, names) in _SETTINGS.items() if bare in names.split())
    attribute = "pressure_mbar" if bare.endswith("pressure") else next(so_called, None)
    if value and attribute == "medium":
        return _gas(value, where) if bare == "medium" or _gases(value) else None
    if value and attribute == "pressure_mbar" and unit is None and _gases(value):
        return _gas(value, where)
    if value and attribute == "raman_scale":
        return {attribute: share_of(value[:_LONGEST], f"{where}: {attribute}")}
    if value and attribute:
        setting, inside, _ = _SETTINGS[attribute]
        where = f"{where}: {setting}"
        converted = amount(value[:_LONGEST], unit, inside, where, thousands)
        if converted is None:
            return None
        if attribute != "pressure_mbar":
            Circuit.from_values({attribute: converted}, where)
        return {attribute: converted}
    # a resistance, temperature or pressure may be meant for one
    number, rest = quantity(value or key)
    units = unit or "", unit_behind(rest)
    measured = any(conversion(each, inside) for each in units for inside in ("ohm", "K", "mbar"))
    measured = measured and (number is not None or key[-1:] in (")", "]"))
    # of a probe file, where alone it counts; a chip or a swept terminal may be anything else's
    of_a_probe = {*Circuit.model_fields, *Surroundings.model_fields} - {"chip", "swept"}
    measured |= bool(value) and key.rpartition(".")[2] in of_a_probe
    # what seems to be a setting is said to be unclear
    alike = (
        r"(?i)(?:series.?resist|base.?temp|(?:medium|pressure)\b)"
        r"|(?:(?:r_?s(?:eries)?|t_?(?:base|0))\b(?!-)|t\s*[=:]).*\d"
        r"|[^=:;\t]*(?:resist(?:or|ance)|widerstand|temp(?:eratur(?:e)?)?)\b.*\d"
    )
    return None if measured or re.match(alike, text.strip(' \t#"')) else {}


def _words(text: str) -> set[str]:
    return set(re.findall(r"[a-z]+\d?\b", text[:_LONGEST].lower()))


def _gases(text: str) -> set[str]:
    return _words(text) & {*_MEDIA, *_OTHER_GASES}


def _gas(text: str, where: str) -> dict[str, Any]:
    """Return medium and pressure that a text names.

    Raises
    ------
    InputError
        If it is another medium than the known ones, unless its pressure is that of a vacuum.
    """
    pressure, words = _pressure(text, where), _words(text)
    media = {_MEDIA[word] for word in words & set(_MEDIA)}
    settings: dict[str, Any] = {} if pressure is None else {"pressure_mbar": pressure}
    if pressure is not None and pressure <= VACUUM_MBAR:
        media &= {"vacuum"}
    else:
        first = re.match(r"[\W\d_]*([a-z]+\d?)", text[:_LONGEST].lower())
        begins_so = first is not None and first[1] in _MEDIA
        denied = words & {"no", "not", "without", "non", "or"} and not begins_so
        if len(media) > 1 or denied or words & _OTHER_GASES or not (media or settings):
            raise InputError(
                f"{where}: medium is '{excerpt(text)}', expected vacuum, air or nitrogen, with its "
                "pressure; for other gases say air, and gas_conductivity in the probe file"
            )
    return {**settings, "medium": media.pop()} if media else settings


def _pressure(text: str, where: str) -> float | None:
    """Return the pressure (mbar) that a text names, None if there is none."""
    with_unit = r"(?ia)([-+]?\d[\d.,]*(?:e[-+]?\d+)?)\s*([A-Za-z]+)"
    for number, unit in re.findall(with_unit, plain_powers(text[:_LONGEST])):
        scale, value = conversion(unit, "mbar"), quantity(number)[0]
        if scale is not None and value is not None:
            if may_be_thousands(number):
                raise InputError(f"{where}: found '{number} {unit}', expected no mark of thousands")
            return float(scale[0] * value)
    return ATMOSPHERE if "atmospheric pressure" in text.lower() else None


# --- what no lever can show -----------------------------------------------------------------------


#: Part of the largest value by which noise and drift may push a current or voltage below 0.
NOISE = 0.05


def check(contents: Contents, *, signed: bool = False, series_ohm: float = 0.0) -> None:
    """Refuse what no lever can show, and note what it hardly can.

    `series_ohm` is in series with the lever if the file does not say what is. What may be of either
    sign is asked less: in time a current goes on or off before the bias is known to, and other
    supplies drive a current of their own.

    Raises
    ------
    InputError
        If a value cannot be, or the largest of a quantity shows that its unit is wrong.
    """
    values, settings = contents.values, contents.settings
    for symbol in (each.symbol for each in MEASURED if each.symbol in contents.columns):
        of, data = symbol.removeprefix("d"), values[symbol]
        unit, (low, high) = MEASURANDS[of].typed_unit, MEASURANDS[of].plausible
        size = np.nanmax(np.abs(values[of]), initial=0.0)
        if symbol != of:
            expected = f"a standard error above 0 and up to {high:g} {unit}, or an empty cell"
            contents.refuse((data <= 1e-9 * size) | (data > high), expected, symbol)
        elif symbol != "D" and not np.isnan(data).all():
            if unit == "K":
                contents.refuse(data <= 0.0, "a temperature above 0 K", symbol)
            where = f"{contents.table.path}: the largest {symbol}"
            either = signed or MEASURANDS[of].signed
            plausible(where, unit, size if either else np.nanmax(data), low, high)
            plausible(where, unit, size, low, high)
            negative = (data < -NOISE * size) & (not either)
            contents.note_rows(negative, f"{symbol} is negative")
    # probe files take no colder base
    base = settings.get("base_temperature_K", 250.0)
    for symbol in (each.symbol for each in FITTED.values() if each.is_temperature):
        contents.note_rows(
            colder_than_base(values[symbol], values["d" + symbol], base),
            f"{symbol} is below the base temperature ({base:g} K), perhaps in another unit",
        )
    if not signed:
        bias, current = values["V_b"], values["I_h"]
        ohm = settings.get("series_resistance_ohm", series_ohm)
        lever = Circuit(series_resistance_ohm=ohm).lever_voltage(bias, current)
        if (below := lever < -NOISE * bias.max()).any():
            row = int(np.argmax(below))
            raise InputError(
                f"{contents.table.where(row)}: V_b = {bias[row]:g} V and I_h = {current[row]:g} mA "
                f"leave {lever[row]:.3g} V for the lever behind R_s = {ohm:g} ohm, expected a "
                f"voltage above 0{_likely_mistakes(bias, current, ohm / 1000.0)}"
            )


def _likely_mistakes(bias: Array, current: Array, series_kohm: float) -> str:
    """Ask after what would leave a lever of some kilo-ohm, where biases (V) and currents do not."""
    heated = (bias > 0) & (current > 0)
    if not heated.any():
        return ""
    kohm = bias[heated] / current[heated]
    lever_kohm = {
        "is V_b the lever's own voltage, not the bias?": kohm,
        "are the columns of V_b and I_h swapped?": 1.0 / kohm - series_kohm,
        "is the unit of I_h wrong (µA labelled mA)?": 1000.0 * kohm - series_kohm,
        "is the unit of V_b wrong (V labelled mV)?": 1000.0 * kohm - series_kohm,
        "is the unit of R_s wrong (ohm labelled kOhm)?": kohm - series_kohm / 1000.0,
    }
    low, high = 0.1, 60.0  # of levers, cold and hot
    questions = [ask for ask, of in lever_kohm.items() if low < of.min() and of.max() < high]
    return f": {' or: '.join(questions)}" if questions else ""


# --- the bias, and what it follows from -----------------------------------------------------------


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
    if "series_resistance_ohm" not in contents.settings:
        if circuit is None:
            raise InputError(
                f"{contents.table.path}: {needed}, expected a line like '# R_s (kOhm): 5.6'"
            )
        contents.put("series_resistance_ohm", circuit.series_resistance_ohm, "of the probe")
    return float(contents.settings["series_resistance_ohm"]) / 1000.0


def _put_resistance(contents: Contents, ohm: float, what: str, origin: str) -> None:
    """Let a resistance that follows from the data count as R_s, if it may be one."""
    Circuit.from_values({"series_resistance_ohm": ohm}, f"{contents.table.path}: {what}")
    contents.put("series_resistance_ohm", ohm, origin)


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
    settings = contents.settings
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


def mirror(contents: Contents, bridge_offset_V: float = 0.0) -> None:
    """Turn rows of negative bias into those of the other polarity.

    What the bridge's amplifier shows of no voltage (V) has no polarity.

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
        offset = bridge_offset_V if symbol == "V_bridge" else 0.0
        values[symbol] = offset + sign * (values[symbol] - offset)
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
    contents = Contents(table)
    contents.take_settings()
    quantities = find_columns(table, assigned, driven=waveform is not None)
    contents.notes += (
        f"{table.path}: line {line}: '{excerpt(text)}' is taken for a comment"
        for line, text in table.remarks
    )
    contents.take_columns(quantities)
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
    every = {column.name: contents.values[column.symbol] for column in MEASURED}
    measurement = Measurement(
        **as_attributes({name: own for name, own in every.items() if not np.isnan(own).all()}),
        **contents.settings,
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
        mirror(contents, 0.0 if circuit is None else circuit.bridge_offset_V)
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
    return (*rows, *contents.understood())


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

    Either is without rows at a limit of an instrument (`hotlever.measurement.rows`).

    Raises
    ------
    InputError
        If it is neither, its biases are negative where both polarities are one, or the file is at
        fault.
    """
    if isinstance(measurement, Measurement):
        at_rest = measurement.time_us is None
        lowest = float(np.nanmin(measurement.bias_V, initial=0.0))
        if at_rest and lowest < probe.lowest_bias_V:
            raise InputError(
                f"{measurement.path or 'measurement'}: found a bias of {lowest:g} V, expected 0 or "
                "more: a lever shows the same with either polarity, unless thermoelectricity or a "
                "held supply counts; turn the signs of its bias, current and voltages"
            )
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
