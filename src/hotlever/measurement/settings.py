"""Circuit and surroundings as the comments of a measurement file give them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from hotlever.errors import InputError, shown
from hotlever.materials.air import ATMOSPHERE
from hotlever.probe import Circuit
from hotlever.tables import Table
from hotlever.units import conversion, key_and_value, name_and_unit, quantity, unknown_unit

#: Settings: name, attribute, unit inside, largest value.
_SETTINGS = {
    "R_s": ("series_resistance_ohm", "ohm", 1e9),
    "base temperature": ("base_temperature_K", "K", 1e3),
    "pressure": ("pressure_mbar", "mbar", 1e6),
}
#: Their names as people write them, without case, blanks and underscores.
_SPELLINGS = {
    **dict.fromkeys(("rs", "rseries", "seriesresistance", "seriesresistor"), "R_s"),
    **dict.fromkeys(("basetemperature", "basetemp", "tbase", "t0"), "base temperature"),
    "p": "pressure",
    **dict.fromkeys(("medium", "gas", "atmosphere", "environment", "surroundings"), "medium"),
}
#: Units a thousand times smaller.
_SMALLER = {"V": "mV", "mA": "µA"}
#: A comment that begins so is taken for a setting, and said to be unclear if it is.
_LIKE_A_SETTING = re.compile(
    r"series.?resist|base.?temp|(?:medium|pressure)\b|(?:r_?s(?:eries)?|t_?(?:base|0))\b(?!-).*\d",
    re.I,
)
#: What a setting may be of, in whatever words, if a number follows.
_OF_A_SETTING = re.compile(r"resist(?:or|ance)\b|temp(?:erature)?\b|^T$", re.I)
#: Media by their names.
_MEDIA = {
    "vacuum": "vacuum",
    "evacuated": "vacuum",
    "air": "air",
    "nitrogen": "nitrogen",
    "n2": "nitrogen",
}
#: Gases whose conductivity is another.
_OTHER_GASES = {
    *("helium", "he", "argon", "ar", "hydrogen", "h2", "oxygen", "o2", "co2", "neon", "ne"),
    *("krypton", "kr", "xenon", "xe", "sf6", "methane", "ch4", "steam", "water", "oil"),
}
_GASES = {*_MEDIA, *_OTHER_GASES}
_NOT = {"no", "not", "without", "non", "or"}
_PRESSURES = {"mbar", "bar", "hpa", "kpa", "pa", "mpa", "torr", "mtorr", "atm"}
#: Words beside which gas and pressure alone are clear without a name.
_PLAIN = {
    *_MEDIA,
    *_OTHER_GASES,
    *_PRESSURES,
    "in",
    "at",
    "of",
    "dry",
    "lab",
    "still",
    "ambient",
    "e",
}
#: κ of nitrogen over that of air, within 1.3 % from 300 to 1200 K: the dilute gases of Lemmon and
#: Jacobsen, Int. J. Thermophys. 25, 21 (2004).
NITROGEN = 0.975
#: mbar; a gas below it, of free molecules, takes less than 0.2 % of a lever's power.
VACUUM_MBAR = 0.05
#: A number with a unit, in text of a limited length.
_WITH_UNIT = re.compile(r"([-+]?\d[\d.,]*(?:e[-+]?\d+)?)\s*([A-Za-z]+)", re.I | re.ASCII)
#: What may be ten or ten thousand.
_THOUSANDS = re.compile(r"[-+]?\d{1,3},\d{3}(?!\d)", re.ASCII)
_LONGEST = 200  # characters of a medium
_LONGEST_COMMENT = 2000


@dataclass
class Settings:
    """What the comments of a file set.

    `values` has the attributes of a `Measurement`, `origin` for each how it was said and where.
    """

    values: dict[str, Any] = field(default_factory=dict)
    origin: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, table: Table, notes: list[str]) -> Settings:
        """Read the comments that give a setting; a note on each that seems to but is unclear.

        Raises
        ------
        InputError
            If a setting is impossible, or two of them contradict each other.
        """
        found = cls()
        gas: list[tuple[int, str]] = []
        for line, text in table.comments:
            where = f"{table.path}: line {line}"
            if len(text) > _LONGEST_COMMENT:
                notes.append(f"{where}: more than {_LONGEST_COMMENT} characters, no settings")
                continue
            for part in _parts(text):
                given = _setting(part, where)
                if given is None:
                    notes.append(
                        f"{where}: '{shown(part)}' is not understood and not used, expected a line "
                        "like '# R_s (kOhm): 5.6', '# base temperature (K): 293' or '# medium: air'"
                    )
                elif given == {} and _words(part) & _GASES:
                    gas.append((line, part))
                for name, value in (given or {}).items():
                    found._add(name, value, line, where)
        found._settle(table, notes, gas)
        return found

    def _add(self, name: str, value: Any, line: int, where: str) -> None:
        if self.values.setdefault(name, value) != value:
            raise InputError(f"{where}: {name} is {value}, but {self.values[name]} further up")
        self.origin.setdefault(name, f"line {line}")

    def _settle(self, table: Table, notes: list[str], gas: list[tuple[int, str]]) -> None:
        """Bring gas and pressure together."""
        values, origin = self.values, self.origin
        medium, pressure = values.get("medium"), values.get("pressure_mbar")
        where = f"{table.path}: {origin.get('pressure_mbar', '')}"
        if pressure is not None and pressure <= VACUUM_MBAR:
            if medium != "vacuum":
                notes.append(f"{where}: {pressure:g} mbar of any gas count as vacuum")
            # the vacuum of the model has no pressure
            del values["pressure_mbar"]
            values["medium"] = "vacuum"
            origin["medium"] = f"{origin['pressure_mbar']}, {pressure:g} mbar"
        elif pressure is not None and medium in (None, "vacuum"):
            said = "no gas is named" if medium is None else "this is no vacuum"
            raise InputError(
                f"{where}: the pressure is {pressure:g} mbar and {said}, expected a line like "
                f"'# medium: air, {pressure:g} mbar', or at most {VACUUM_MBAR:g} mbar"
            )
        elif medium == "nitrogen":
            values.update(medium="air", gas_conductivity=NITROGEN)
            origin["gas_conductivity"] = f"{origin['medium']}, nitrogen"
        for line, text in gas:
            # a gas beside the medium matters, what else is said of it does not
            if medium is None or _words(text) & _OTHER_GASES:
                notes.append(
                    f"{table.path}: line {line}: '{shown(text)}' does not set the medium, "
                    "expected a line like '# medium: air' or '# medium: vacuum'"
                )
                return


def _parts(text: str) -> Iterator[str]:
    """Split a comment at ``; ``, and at ``, `` and tabs where another setting follows."""
    for part in re.split(r";\s", text):
        mark = "\t" if "\t" in part else ", "
        first, *others = part.split(mark)
        for other in others:
            if "=" in other or ":" in other:
                yield first
                first = other
            else:
                first += mark + other
        yield first


def _setting(text: str, where: str) -> dict[str, Any] | None:
    """Return what a comment sets, nothing where it is another comment, None where it is unclear."""
    key, value = key_and_value(text)
    if not value and _words(key) & {*_MEDIA, *_PRESSURES} and not _words(key) - _PLAIN:
        return _medium(key, where)  # as in 100 mbar N2
    if not value:
        # cells of a file with commas
        key, value = (part.strip(' ,"') for part in (*key.split(",", 1), "")[:2])
    name, unit = name_and_unit(key)
    known = re.sub(r"[\W_]+", "", name[:40]).lower()
    setting = value and ("pressure" if known.endswith("pressure") else _SPELLINGS.get(known))
    if setting == "medium":
        return _medium(value, where) if known == "medium" or _words(value) & _GASES else None
    if setting:
        attribute, inside, high = _SETTINGS[setting]
        where = f"{where}: {setting}"
        read = _value(_powers(value), unit, inside, where)
        if read is None:
            return None
        if setting != "pressure":
            Circuit.of({attribute: read}, where)
        plausible(where, inside, read, 0.0, high)
        return {attribute: read}
    # a resistance, temperature or pressure may be meant for one
    number, rest = quantity(value or key)
    in_brackets = unit if number is not None or key[-1:] in (")", "]") else None
    units = (in_brackets or "", _unit_of(rest))
    alike = any(conversion(each, inside) for each in units for _, inside, _ in _SETTINGS.values())
    named = _OF_A_SETTING.search(key) and re.search(r"\d", value or key)
    return None if alike or named or _LIKE_A_SETTING.match(text.strip(' \t#"')) else {}


def _words(text: str) -> set[str]:
    return set(re.findall(r"[a-z]+\d?\b", text[:_LONGEST].lower()))


def _medium(value: str, where: str) -> dict[str, Any]:
    """Return medium and pressure.

    Raises
    ------
    InputError
        If it is another medium than the known ones, unless its pressure is that of a vacuum.
    """
    pressure = _pressure(value, where)
    found: dict[str, Any] = {} if pressure is None else {"pressure_mbar": pressure}
    if pressure is not None:
        plausible(f"{where}: pressure", "mbar", pressure, 0.0, _SETTINGS["pressure"][2])
    words = _words(value)
    known = {_MEDIA[word] for word in words & set(_MEDIA)}
    if pressure is not None and pressure <= VACUUM_MBAR:
        return {**found, "medium": "vacuum"} if "vacuum" in known else found
    first = re.match(r"[\W\d_]*([a-z]+\d?)", value[:_LONGEST].lower())
    denied = words & _NOT and (first is None or first[1] not in _MEDIA)
    if len(known) > 1 or denied or words & _OTHER_GASES or not (known or found):
        raise InputError(
            f"{where}: medium is '{shown(value)}', expected vacuum, air or nitrogen, with its "
            "pressure; for other gases say air, and gas_conductivity in the probe file"
        )
    return {**found, "medium": known.pop()} if known else found


def _powers(text: str) -> str:
    """Write 1x10^-5, 10⁻⁵ and the like as 1e-5."""
    text = re.sub(r"10(?=[⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹])", "10^", text[:_LONGEST])
    text = unicodedata.normalize("NFKC", text).replace("−", "-")
    text = re.sub(r"\s?[x×*·]\s?10\^?(?=[-+]?\d)", "e", text)
    return re.sub(r"(?<![\d.,])10\^(?=[-+]?\d)", "1e", text)


def _pressure(text: str, where: str) -> float | None:
    """Return the pressure (mbar) that a text names, None if there is none."""
    for number, unit in _WITH_UNIT.findall(_powers(text)):
        scale, value = conversion(unit, "mbar"), quantity(number)[0]
        if scale is not None and value is not None:
            if _THOUSANDS.match(number):
                raise InputError(f"{where}: found '{number} {unit}', expected no mark of thousands")
            return float(scale[0] * value)
    return ATMOSPHERE if "atmospheric pressure" in text.lower() else None


def _value(text: str, unit: str | None, inside: str, where: str) -> float | None:
    """Return a setting's value in the unit used inside; None if that is not clear.

    The unit stands behind the name, in brackets, or behind the number.
    """
    number, rest = quantity(text.replace("deg C", "degC").replace("° C", "°C"))
    behind = conversion(_unit_of(rest), inside)
    odd = behind is None and rest[:1].strip(" ,;([±")
    if odd or "=" in rest or ":" in rest or _THOUSANDS.match(text):
        number = None  # as in 5.6x, or with another setting behind it
    named = behind if unit is None else conversion(unit, inside)
    if unit is not None and named is None:
        raise unknown_unit(unit, inside, where)
    if unit is not None and number is None:
        raise InputError(f"{where}: found '{shown(text)}', expected a number")
    if number is None or named is None or behind not in (None, named):
        return None
    return named[0] * number + named[1]


def _unit_of(text: str) -> str:
    """Return the first word behind a number."""
    return re.split(r"[\s,;()\[\]]", text.lstrip(" (["), maxsplit=1)[0]


def plausible(where: str, unit: str, value: float, low: float, high: float) -> None:
    """Refuse a value out of bounds, with the likeliest cause."""
    if low <= value <= high:
        return
    expected = f"{where}: found {value:g} {unit}, expected {low:g} to {high:g} {unit}"
    if value < 0:
        raise InputError(f"{expected}; is the sign wrong?")
    smaller = _SMALLER.get(unit)
    if value > high and smaller and value / 1e3 <= high:
        raise InputError(f"{expected}; is it in {smaller}, which would be {value / 1e3:g} {unit}?")
    raise InputError(f"{expected}; is the unit wrong?")
