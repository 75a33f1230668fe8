"""Numbers with units as people and instruments write them: headings, settings, quantities.

Units are looked up in a list; nothing that stands in a file is evaluated.
"""

from __future__ import annotations

import re
import unicodedata

from hotlever.errors import InputError, shown

ZERO_CELSIUS_K = 273.15
LARGEST_NUMBER = 1e30  #: no quantity is larger in any unit

NUMBER = re.compile(r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
LONGEST_NUMBER = 60  #: characters

_PREFIXES = {
    "": 0,
    "d": -1,
    "c": -2,
    "m": -3,
    "u": -6,
    "μ": -6,
    "n": -9,
    "p": -12,
    "f": -15,
    "a": -18,
    "da": 1,
    "h": 2,
    "k": 3,
    "K": 3,
    "M": 6,
    "G": 9,
    "T": 12,
    "P": 15,
    "E": 18,
}
_PREFIX_WORDS = {"": 0, "milli": -3, "micro": -6, "nano": -9, "pico": -12, "kilo": 3, "mega": 6}
#: Quantity (its unit), and what one of a unit is of it.
_SYMBOLS = {
    "V": ("V", 1.0),
    "A": ("A", 1.0),
    "K": ("K", 1.0),
    **dict.fromkeys(("ohm", "Ohm", "OHM", "Ω"), ("ohm", 1.0)),
    **dict.fromkeys(("torr", "Torr"), ("bar", 1.01325 / 760.0)),
    "bar": ("bar", 1.0),
    "Pa": ("bar", 1e-5),
}
_WORDS = {
    **dict.fromkeys(("volt", "volts"), ("V", 1.0)),
    **dict.fromkeys(("amp", "amps", "ampere", "amperes"), ("A", 1.0)),
    **dict.fromkeys(("ohm", "ohms"), ("ohm", 1.0)),
    **dict.fromkeys(("kelvin", "kelvins"), ("K", 1.0)),
    **dict.fromkeys(("pascal", "pascals"), ("bar", 1e-5)),
    "atm": ("bar", 1.01325),
    "mmhg": ("bar", 1.01325 / 760.0),
}
#: Of settings alone: in a heading `V_s` is no voltage in seconds.
_SETTINGS = {
    prefix + symbol: (symbol, power)
    for prefix, power in _PREFIXES.items()
    for symbol in ("s", "Hz", "V")
}
#: By name: quantity, power of ten, and what else one of the unit is.
_UNITS = {
    prefix + symbol: (quantity, power, factor)
    for prefix, power in _PREFIXES.items()
    for symbol, (quantity, factor) in _SYMBOLS.items()
}
#: The same for words, in small letters.
_UNIT_WORDS = {
    prefix + word: (quantity, power, factor)
    for prefix, power in _PREFIX_WORDS.items()
    for word, (quantity, factor) in _WORDS.items()
}
#: Headings that name a time; of these alone a unit of time is one.
TIMES = {"t", "time", "relative time", "elapsed time"}
_TIME_WORDS = {
    prefix + word: power
    for prefix, power in _PREFIX_WORDS.items()
    for word in ("sec", "second", "seconds")
}
_CELSIUS = {"°C", "degC", "C", "oC", "celsius", "Celsius", "degreesC", "degreesCelsius"}
#: What µ, Ω and °C of other encodings (UTF-8 read twice, DOS, GBK, Shift-JIS, Mac) look like when
#: a file is read as Windows' Latin-1.
_MISREAD = {
    "Âµ": "µ",
    "Î¼": "µ",
    "â„¦": "Ω",
    "Î©": "Ω",
    "Â°": "°",
    "â„ƒ": "°C",
    "æ": "µ",
    "¦Ì": "µ",
    "ƒÊ": "µ",
    "ê": "Ω",
    "¦¸": "Ω",
    "ƒ¶": "Ω",
    "½": "Ω",
    "øC": "°C",
    "¡æ": "°C",
    "¡ãC": "°C",
    "�Ž": "°C",
    "�‹C": "°C",
    "¡C": "°C",
}
#: Marks between a name and its unit, where there are no brackets.
_BETWEEN = ("/", ",", " in ", " ", "_")


def _known(unit: str) -> tuple[str, int, float] | None:
    """Look up a unit: quantity, power of ten and factor; degrees Celsius have the quantity °C."""
    if not 0 < len(unit) < 20:
        return None
    # one spelling for the two signs of micro, of ohm, and for the compact degree
    unit = unicodedata.normalize("NFKC", _as_meant(unit)).replace(" ", "")
    if unit in _CELSIUS:
        return "°C", 0, 1.0
    return _UNITS.get(unit) or _UNIT_WORDS.get(unit.casefold())


def _as_meant(unit: str) -> str:
    """Return a unit as it was meant, if its file was read by another encoding."""
    for misread, meant in _MISREAD.items():
        # the longest first, as they stand in the list
        if misread in unit:
            return unit.replace(misread, meant)
    return unit


def is_unit(text: str) -> bool:
    """Whether a text is a unit of anything that is measured here.

    Examples
    --------
    >>> is_unit("µA"), is_unit("Volts"), is_unit("h")
    (True, True, False)
    """
    return _known(text.strip()) is not None


def conversion(unit: str, inside: str, difference: bool = False) -> tuple[float, float] | None:
    """Return factor and offset that turn a value in one unit into another's; None if they differ.

    Units are V, A, ohm, K, bar, Pa or Torr with an SI prefix, atm, or degrees Celsius; where the
    other is one of time, seconds. Differences of temperatures have the same zero on any scale.

    Examples
    --------
    >>> conversion("µA", "mA"), conversion("°C", "K"), conversion("degC", "K", difference=True)
    ((0.001, 0.0), (1.0, 273.15), (1.0, 0.0))
    """
    if _SETTINGS.get(inside, ("",))[0] == "s":
        power = _power_of_seconds(unit)
        return None if power is None else (10.0 ** (power - _SETTINGS[inside][1]), 0.0)
    found, (wanted, ours, part) = _known(unit), _UNITS[inside]
    if found is None:
        return None
    measured, theirs, factor = found
    if (measured, wanted) == ("°C", "K"):
        return 10.0**-ours, 0.0 if difference else ZERO_CELSIUS_K * 10.0**-ours
    return (10.0 ** (theirs - ours) * (factor / part), 0.0) if measured == wanted else None


def _power_of_seconds(unit: str) -> int | None:
    """Return the power of ten that a unit of time is of a second; None if it is another unit."""
    if not 0 < len(unit) < 20:
        return None
    plain = unicodedata.normalize("NFKC", _as_meant(unit)).replace(" ", "")
    symbol, power = _SETTINGS.get(plain, ("", 0))
    return power if symbol == "s" else _TIME_WORDS.get(plain.casefold())


def unknown_unit(unit: str, inside: str, where: str) -> InputError:
    """Return the error for a unit that `conversion` does not know."""
    return InputError(
        f"{where}: unit '{shown(unit)}' is not understood here, expected one like {inside}"
    )


def name_and_unit(heading: str) -> tuple[str, str | None]:
    """Split a heading such as ``V_b (V)``, ``I_h [mA]`` or ``I/µA``; None where it has no unit.

    Without brackets only a known unit is taken for one; that of a time only behind its name, since
    ``V_s`` is no voltage in seconds.

    Examples
    --------
    >>> name_and_unit("V_b (V)"), name_and_unit("I/µA"), name_and_unit("bias_V")
    (('V_b', 'V'), ('I', 'µA'), ('bias', 'V'))
    >>> name_and_unit("file"), name_and_unit("time_us")
    (('file', None), ('time', 'us'))
    """
    heading = heading.strip()
    bracket = re.search(r"[(\[{<]", heading)
    if bracket is not None and heading[-1:] in (")", "]", "}", ">"):
        return heading[: bracket.start()].strip(" _/,"), heading[bracket.end() : -1].strip()
    for mark in _BETWEEN:
        name, _, unit = heading.rpartition(mark)
        name, unit = name.strip(" _/,"), unit.strip()
        of_time = name.casefold() in TIMES and _power_of_seconds(unit) is not None
        if name and (is_unit(unit) or of_time):
            return name, unit
    return heading, None


def key_and_value(line: str) -> tuple[str, str]:
    """Split a line such as ``# medium: air``; the value is empty where there is none.

    Examples
    --------
    >>> key_and_value("# R_s (kOhm) = 5.6"), key_and_value("#Laser (nm)=\\t532;")
    (('R_s (kOhm)', '5.6'), ('Laser (nm)', '532'))
    """
    key, *value = re.split(r"[=:;\t]", line.strip().lstrip('#;%!*" '), maxsplit=1)
    return key.strip(' "'), value[0].strip(' =:;,\t"') if value else ""


def quantity(text: str) -> tuple[float | None, str]:
    """Split ``5.6 kOhm`` into number and what follows; None if no number begins the text.

    Examples
    --------
    >>> quantity("5,6e3 Ohm"), quantity("20°C"), quantity("many")
    ((5600.0, ' Ohm'), (20.0, '°C'), (None, 'many'))
    """
    found = NUMBER.match(text[:LONGEST_NUMBER])
    if found is None:
        return None, text
    value = float(found[0].replace(",", ".").lower().replace("d", "e"))
    return value if abs(value) <= LARGEST_NUMBER else None, text[found.end() :]


def setting(text: str, inside: str, where: str, *, bare: bool = False) -> float:
    """Return a voltage, a time or a frequency such as ``5us`` in another unit.

    Without a unit it is understood only if it may be `bare`.

    Raises
    ------
    InputError
        If it is anything else; the text begins with `where`.

    Examples
    --------
    >>> setting("5us", "us", "--until"), setting("20 kHz", "Hz", "--sine")
    (5.0, 20000.0)
    """
    value, unit = quantity(text.strip())
    unit = unicodedata.normalize("NFKC", unit).replace(" ", "")
    symbol, theirs = _SETTINGS.get(unit or inside * bare, ("", 0))
    wanted, ours = _SETTINGS[inside]
    if value is None or symbol != wanted:
        raise InputError(
            f"{where}: found '{shown(text)}', expected a number with a unit like {inside}"
        )
    # whole powers are exact: 250 ns are 0.25 µs to the last digit
    power = theirs - ours
    return value * 10.0**power if power >= 0 else value / 10.0**-power
