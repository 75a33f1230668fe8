"""A measurement file while it is read: settings in its comments, rows, what no lever can show."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hotlever.errors import InputError, excerpt
from hotlever.materials.air import ATMOSPHERE
from hotlever.measurement.columns import Column
from hotlever.measurement.data import MEASURED
from hotlever.probe import Circuit
from hotlever.probe.priors import share_of
from hotlever.quantities import FITTED, MEASURANDS
from hotlever.tables import TextTable
from hotlever.types import Array, Mask
from hotlever.units import (
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
#: κ of nitrogen over that of air, within 1.3 % from 300 to 1200 K: the dilute gases of Lemmon and
#: Jacobsen, Int. J. Thermophys. 25, 21 (2004).
NITROGEN = 0.975
#: mbar; a gas below it, of free molecules, takes less than 0.2 % of a lever's power.
VACUUM_MBAR = 0.05
#: Characters of a setting that are looked at.
_LONGEST = 200


@dataclass
class Settings:
    """What the comments of a file set, by attribute of a `Measurement`, and what is unclear.

    `origin` says of each where it was said, or what it follows from.
    """

    values: dict[str, Any] = field(default_factory=dict)
    origin: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, table: TextTable) -> Settings:
        """Read the comments that give a setting.

        Raises
        ------
        InputError
            If a setting is impossible, or two of them contradict each other.
        """
        settings = cls()
        mentioned: list[tuple[str, str]] = []
        # beside decimal commas a point may be a mark of thousands too
        thousands = ",." if table.dialect.decimal_comma else ","
        for line, text in table.comments:
            where = f"{table.path}: line {line}"
            # at '; ', and at ', ' and tabs where another setting follows
            between = r";\s|, (?=(?:[^,=:]|,(?! ))*[=:])|\t(?=[^\t=:]*[=:])"
            for part in re.split(between, text):
                values = _setting(part, where, thousands)
                if values is None:
                    settings.notes.append(
                        f"{where}: '{excerpt(part)}' is not understood and not used, expected a "
                        "line like '# R_s (kOhm): 5.6', '# base temperature (K): 293' or "
                        "'# medium: air'"
                    )
                elif not values and _gases(part):
                    mentioned.append((where, part))
                for name, value in (values or {}).items():
                    first = settings.values.get(name, value)
                    if first != value:
                        raise InputError(f"{where}: {name} is {value}, but {first} further up")
                    settings.put(name, value, settings.origin.get(name, f"line {line}"))
        settings._settle(table.path)
        for where, part in mentioned:
            # a gas beside the medium matters, what else is said of it does not
            if "medium" not in settings.values or _words(part) & _OTHER_GASES:
                settings.notes.append(
                    f"{where}: '{excerpt(part)}' does not set the medium, expected a line like "
                    "'# medium: air' or '# medium: vacuum'"
                )
                break
        return settings

    def put(self, name: str, value: Any, origin: str) -> None:
        """Set a value, and say where it is from."""
        self.values[name], self.origin[name] = value, origin

    def understood(self) -> Iterator[tuple[str, str, str]]:
        """Give what is set, to what, and where it was said."""
        for attribute, (name, unit, _) in _SETTINGS.items():
            value = self.values.get(attribute)
            if value is not None:
                text = value if isinstance(value, str) else f"{value:g} {unit}"
                yield name, text, self.origin[attribute]
            elif attribute in ("series_resistance_ohm", "base_temperature_K", "medium"):
                yield name, "not said", "the probe's counts"

    def _settle(self, path: str) -> None:
        """Bring gas and pressure together."""
        medium, pressure = self.values.get("medium"), self.values.get("pressure_mbar")
        if pressure is not None:
            line = self.origin["pressure_mbar"]
            where = f"{path}: {line}"
            plausible(f"{where}: pressure", "mbar", pressure, 0.0, 1e6)
            if pressure <= VACUUM_MBAR:
                if medium != "vacuum":
                    self.notes.append(f"{where}: {pressure:g} mbar of any gas count as vacuum")
                # the vacuum of the model has no pressure
                del self.values["pressure_mbar"]
                self.put("medium", "vacuum", f"{line}, {pressure:g} mbar")
            elif medium in (None, "vacuum"):
                reason = "no gas is named" if medium is None else "this is no vacuum"
                raise InputError(
                    f"{where}: the pressure is {pressure:g} mbar and {reason}, expected a line "
                    f"like '# medium: air, {pressure:g} mbar', or at most {VACUUM_MBAR:g} mbar"
                )
        if self.values.get("medium") == "nitrogen":
            self.values["medium"] = "air"
            self.put("gas_conductivity", NITROGEN, f"{self.origin['medium']}, nitrogen")


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


# --- rows -----------------------------------------------------------------------------------------


@dataclass
class Contents:
    """Rows and settings of a file, which `hotlever.measurement.measurement_file` completes.

    Attributes
    ----------
    table : TextTable
    columns : dict of str to Column
        By symbol: the quantities that the file gives.
    settings : Settings
    notes : list of str
        What of the file was not used or not understood, and what looks wrong in it.
    values : dict of str to ndarray, shape (n,)
        Every quantity by its symbol, in the unit inside; NaN where nothing is known.
    origin : dict of str to str
        The column of a quantity, or what it follows from.

    Raises
    ------
    InputError
        If a cell is no number.
    """

    table: TextTable
    columns: dict[str, Column]
    settings: Settings
    notes: list[str]
    values: dict[str, Array] = field(init=False)
    origin: dict[str, str] = field(init=False)

    def __post_init__(self) -> None:
        self.origin = {symbol: column.origin for symbol, column in self.columns.items()}
        self.values = dict.fromkeys(MEASURANDS, np.full(len(self.table.rows), np.nan))
        for symbol, column in self.columns.items():
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


#: Part of the largest value by which noise and drift may push a current or voltage below 0.
NOISE = 0.05


def colder_than_base(
    tip_K: Array, error_K: Array, base_K: float, offset_K: float = 20.0, errors: float = 4.0
) -> Mask:
    """Return where a tip seems colder than its base by more than an offset or noise explain."""
    margin = np.maximum(offset_K, errors * np.nan_to_num(error_K))
    return np.asarray(tip_K < base_K - margin)


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
    values, settings = contents.values, contents.settings.values
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
    for symbol in (each.symbol for each in FITTED.values() if each.unit == "K"):
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
