"""Numbers with units as people and instruments write them: headings, settings, quantities.

Units are looked up in a list; nothing that stands in a file is evaluated.
"""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from typing import NamedTuple

from hotlever.errors import InputError, excerpt

ZERO_CELSIUS_K = 273.15
#: S/cm to mA/(V µm), and W/(cm K) to mW/(K µm).
PER_CM_TO_MILLI_PER_UM = 0.1
#: W/cm² to mW/µm².
PER_CM2_TO_MILLI_PER_UM2 = 1e-5
#: J/cm³ to nJ/µm³; with times in µs, nJ are mW µs.
PER_CM3_TO_NANO_PER_UM3 = 1e-3
LARGEST_NUMBER = 1e30  #: no quantity is larger in any unit
#: Up to this bias (V) there is no spark.
MOST_BIAS = 1e4

NUMBER = re.compile(r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
LONGEST_NUMBER = 60  #: characters


class _Unit(NamedTuple):
    quantity: str  #: named by its unit
    power: int  #: of ten
    factor: float  #: what else one of the unit is of the quantity


@cache
def _symbols() -> dict[str, _Unit]:
    """Return units by their symbols, with SI prefixes."""
    prefixes = {"": 0, "d": -1, "c": -2, "m": -3, "u": -6, "μ": -6, "n": -9, "p": -12, "f": -15}
    prefixes |= {"a": -18, "da": 1, "h": 2, "k": 3, "K": 3, "M": 6, "G": 9}
    prefixes |= {"T": 12, "P": 15, "E": 18}
    # quantity (its unit), and what one of a unit is of it
    symbols = {
        **{each: (each, 1.0) for each in ("V", "A", "W", "K", "s", "Hz", "m", "bar", "S", "J")},
        **dict.fromkeys(("ohm", "Ohm", "OHM", "Ω"), ("ohm", 1.0)),
        **dict.fromkeys(("torr", "Torr"), ("bar", 1.01325 / 760.0)),
        "Pa": ("bar", 1e-5),
    }
    return _with_prefixes(prefixes, symbols)


@cache
def _words() -> dict[str, _Unit]:
    """Return units by their names, in small letters."""
    prefixes = {"": 0, "milli": -3, "micro": -6, "nano": -9, "pico": -12, "kilo": 3, "mega": 6}
    words = {
        **dict.fromkeys(("volt", "volts"), ("V", 1.0)),
        **dict.fromkeys(("amp", "amps", "ampere", "amperes"), ("A", 1.0)),
        **dict.fromkeys(("ohm", "ohms"), ("ohm", 1.0)),
        **dict.fromkeys(("kelvin", "kelvins"), ("K", 1.0)),
        **dict.fromkeys(("sec", "second", "seconds"), ("s", 1.0)),
        **dict.fromkeys(("pascal", "pascals"), ("bar", 1e-5)),
        "atm": ("bar", 1.01325),
        "mmhg": ("bar", 1.01325 / 760.0),
    }
    return _with_prefixes(prefixes, words)


def _with_prefixes(
    prefixes: dict[str, int], units: dict[str, tuple[str, float]]
) -> dict[str, _Unit]:
    return {
        prefix + name: _Unit(quantity, power, factor)
        for prefix, power in prefixes.items()
        for name, (quantity, factor) in units.items()
    }


def is_time(name: str) -> bool:
    """Whether a heading names a time; of such alone a unit of time is one."""
    times = {"t", "time", "relative time", "elapsed time", "zeit", "relative zeit"}
    return name.casefold() in times


def _unit(text: str) -> _Unit | None:
    """Look up a unit; degrees Celsius have the quantity °C."""
    if not 0 < len(text) < 20:
        return None
    # what µ, Ω and °C of other encodings (UTF-8 read twice, DOS, GBK, Shift-JIS, Mac) look like in
    # a file that is read as Windows' Latin-1; what is part of another stands behind it
    of_misread = {
        **dict.fromkeys(("â„ƒ", "øC", "¡æ", "¡ãC", "�Ž", "�‹C", "¡C"), "°C"),
        **dict.fromkeys(("â„¦", "Î©", "ê", "¦¸", "ƒ¶", "½"), "Ω"),
        **dict.fromkeys(("Âµ", "Î¼", "æ", "¦Ì", "ƒÊ"), "µ"),
        "Â°": "°",
    }
    misread = next((misread for misread in of_misread if misread in text), None)
    if misread is not None:
        text = text.replace(misread, of_misread[misread])
    # one spelling for the two signs of micro, of ohm, and for the compact degree
    text = unicodedata.normalize("NFKC", text).replace(" ", "")
    celsius = {"°C", "degC", "C", "oC", "celsius", "Celsius", "degreesC", "degreesCelsius"}
    if text in celsius:
        return _Unit("°C", 0, 1.0)
    return _symbols().get(text) or _words().get(text.casefold())


def is_unit(text: str) -> bool:
    """Whether a text is a unit of anything that is measured here.

    Examples
    --------
    >>> is_unit("µA"), is_unit("Volts"), is_unit("h")
    (True, True, False)
    """
    unit = _unit(text.strip())
    # those of settings stand in brackets alone: in a heading `V_s` is no voltage in seconds
    return unit is not None and unit.quantity not in {"s", "Hz", "W", "m", "S", "J"}


def differ(unit: str, other: str) -> bool:
    """Whether two texts are units, and not the same one.

    Examples
    --------
    >>> differ("mA", "A"), differ("µA", "uA"), differ("mA", "CH1")
    (True, False, False)
    """
    return is_unit(unit) and is_unit(other) and _unit(unit.strip()) != _unit(other.strip())


def conversion(unit: str, inside: str, difference: bool = False) -> tuple[float, float] | None:
    """Return factor and offset that turn a value in one unit into another's; None if they differ.

    Units are V, A, ohm, K, m, bar, Pa or Torr with an SI prefix, atm, or degrees Celsius; where
    the other is one of time, seconds. Differences of temperatures have the same zero on any scale.

    Examples
    --------
    >>> conversion("µA", "mA"), conversion("°C", "K"), conversion("degC", "K", difference=True)
    ((0.001, 0.0), (1.0, 273.15), (1.0, 0.0))
    """
    theirs, ours = _unit(unit), _symbols()[inside]
    if theirs is None:
        return None
    if (theirs.quantity, ours.quantity) == ("°C", "K"):
        scale = 10.0**-ours.power
        return scale, 0.0 if difference else ZERO_CELSIUS_K * scale
    if theirs.quantity != ours.quantity:
        return None
    return 10.0 ** (theirs.power - ours.power) * (theirs.factor / ours.factor), 0.0


def product_conversion(unit: str, inside: str) -> float | None:
    """Return the factor from one product of units to another; None if they are of other kinds.

    Examples
    --------
    >>> product_conversion("W/(m K)", "W cm⁻¹ K⁻¹"), product_conversion("µΩcm", "Ω cm")
    (0.01, 1e-06)
    >>> product_conversion("W m^-1 K^-1", "W cm⁻¹ K⁻¹"), product_conversion("W/mK", "Ω cm")
    (0.01, None)
    """
    theirs, ours = _product(unit), _product(inside)
    if theirs is None or ours is None or theirs[0] != ours[0]:
        return None
    return float(f"{theirs[1] / ours[1]:.12g}")


def _product(text: str) -> tuple[dict[str, int], float] | None:
    """Return the powers of V, A, K, s and m in a product of units, and what one of it is."""
    plain = text.translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-"))
    text = unicodedata.normalize("NFKC", plain).strip()
    # written together: metres or centimetres, and kelvins
    text = re.sub(r"(ohm|Ω)(c?m)\b", r"\1 \2", text)
    text = re.sub(r"\b([cmµμ]?m(?:\^?[23])?)K\b", r"\1 K", text)
    above, slash, below = text.partition("/")
    powers: dict[str, int] = {}
    scale = 1.0
    numbers = {"1": _Unit("1", 0, 1.0), "%": _Unit("1", -2, 1.0)}
    powers_of = {
        **{symbol: {symbol: 1} for symbol in ("V", "A", "K", "s", "m")},
        "ohm": {"V": 1, "A": -1},
        "S": {"A": 1, "V": -1},
        "W": {"V": 1, "A": 1},
        "J": {"V": 1, "A": 1, "s": 1},
        "1": {},
    }
    factor = re.compile(r"([^\d\s^*·./()-]+|%|1(?!\d))(?:\^|\*\*)?([+-]?\d+)?")
    for part, sign in ((above, 1), (below.strip(" ()") if slash else "", -1)):
        rest = factor.sub("", part).strip(" *·.()")
        if rest or "/" in part:
            return None
        for symbol, exponent in factor.findall(part):
            unit = _symbols().get(symbol) or numbers.get(symbol)
            if unit is None or unit.quantity not in powers_of:
                return None
            times = sign * int(exponent or 1)
            scale *= (unit.factor * 10.0**unit.power) ** times
            for name, each in powers_of[unit.quantity].items():
                powers[name] = powers.get(name, 0) + times * each
    return {name: power for name, power in powers.items() if power}, scale


def unknown_unit(unit: str, inside: str, where: str) -> InputError:
    """Return the error for a unit that `conversion` does not know."""
    return InputError(
        f"{where}: unit '{excerpt(unit)}' is not understood here, expected one like {inside}"
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
    # marks between a name and its unit, where there are no brackets
    for mark in ("/", ",", " in ", " ", "_"):
        name, _, unit = heading.rpartition(mark)
        name, unit = name.strip(" _/,"), unit.strip()
        if name and is_unit_of(name, unit):
            return name, unit
    return heading, None


def heading_with(name: str, unit: str) -> str:
    """Return a heading with the unit that is stated beside it.

    Where it has another one of its own it is no heading of a known quantity any more, so that
    which of them is right is asked for.

    Examples
    --------
    >>> heading_with("V_b", "V"), heading_with("V_b (V)", "V"), heading_with("I_h_mA", "A")
    ('V_b (V)', 'V_b (V)', 'I_h_mA, A')
    """
    own = name_and_unit(name)[1]
    if own is None:
        return f"{name} ({unit})" if unit else name
    theirs, ours = _unit(unit), _unit(own)
    if theirs is None or ours is None or theirs.quantity != ours.quantity:
        return name
    return name if theirs == ours else f"{name}, {unit}"


def is_unit_of(name: str, unit: str) -> bool:
    """Whether a column of some name may have a unit; that of a time is one of a time only.

    Examples
    --------
    >>> is_unit_of("time", "s"), is_unit_of("V", "s"), is_unit_of("V", "mV")
    (True, False, True)
    """
    of_time = is_time(name) and conversion(unit, "s") is not None
    return of_time or is_unit(unit)


def key_and_value(line: str) -> tuple[str, str]:
    """Split a line such as ``# medium: air``; the value is empty where there is none.

    Examples
    --------
    >>> key_and_value("# R_s (kOhm) = 5.6"), key_and_value("#Laser (nm)=\\t532;")
    (('R_s (kOhm)', '5.6'), ('Laser (nm)', '532'))
    """
    key, *value = re.split(r"[=:;\t]", line.strip().lstrip('#;%!*" '), maxsplit=1)
    return key.strip(' "'), value[0].strip(' =:;,\t"') if value else ""


def plain_minus(text: str) -> str:
    """Write every sign that is meant for a minus as the one of ASCII.

    Examples
    --------
    >>> plain_minus("−1.5e–3")
    '-1.5e-3'
    """
    # hyphens, dashes, minus signs; what U+2212 and the en dash look like read as Windows' Latin-1
    return text if text.isascii() else re.sub("[‐‑‒–—−﹣－]|âˆ’|â€“", "-", text)


def quantity(text: str) -> tuple[float | None, str]:
    """Split ``5.6 kOhm`` into number and what follows; None if no number begins the text.

    Examples
    --------
    >>> quantity("5,6e3 Ohm"), quantity("−20°C"), quantity("many")
    ((5600.0, ' Ohm'), (-20.0, '°C'), (None, 'many'))
    """
    text = plain_minus(text)
    match = NUMBER.match(text[:LONGEST_NUMBER])
    if match is None:
        return None, text
    value = float(match[0].replace(",", ".").lower().replace("d", "e"))
    return value if abs(value) <= LARGEST_NUMBER else None, text[match.end() :]


def unit_behind(text: str) -> str:
    """Return the first word of what follows a number, which may be its unit."""
    return re.split(r"[\s,;()\[\]]", text.lstrip(" (["), maxsplit=1)[0]


def plain_powers(text: str) -> str:
    """Write 1x10^-5, 10⁻⁵ and the like as 1e-5.

    Examples
    --------
    >>> plain_powers("2 x 10^-6 mbar"), plain_powers("10⁻⁴ Pa")
    ('2e-6 mbar', '1e-4 Pa')
    """
    text = re.sub(r"10(?=[⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹])", "10^", text)
    text = plain_minus(unicodedata.normalize("NFKC", text))
    text = re.sub(r"\s?[x×*·]\s?10\^?(?=[-+]?\d)", "e", text)
    return re.sub(r"(?<![\d.,])10\^(?=[-+]?\d)", "1e", text)


def may_be_thousands(number: str, marks: str = ",") -> bool:
    """Whether a number such as ``10,000`` may be ten or ten thousand, by one of some marks."""
    return re.match(rf"[-+]?\d{{1,3}}[{marks}]\d{{3}}(?!\d)", number, re.ASCII) is not None


def amount(
    text: str, unit: str | None, inside: str, where: str, thousands: str = ","
) -> float | None:
    """Return what a text such as ``5.6 kOhm (four wires)`` is in another unit; None if unclear.

    Parameters
    ----------
    text : str
        Begins with a number.
    unit : str or None
        If it is not, or not only, behind the number.
    inside, where : str
        The unit wanted, and what an error begins with.
    thousands : str
        Signs that may stand between thousands, so that ``10,000`` is unclear.

    Raises
    ------
    InputError
        If there is a `unit`, and it is another one, or there is no number to it.

    Examples
    --------
    >>> amount("5.6 kOhm (four wires)", None, "ohm", "R_s"), amount("5.6k", None, "ohm", "R_s")
    (5600.0, None)
    """
    text = plain_powers(text)
    number, rest = quantity(text.replace("deg C", "degC").replace("° C", "°C"))
    behind = conversion(unit_behind(rest), inside)
    scale = behind if unit is None else conversion(unit, inside)
    if unit is not None and scale is None:
        raise unknown_unit(unit, inside, where)
    # as in 5.6x, or with a setting of something else behind it, or a sum
    odd = (behind is None and rest[:1].strip(" ,;([±")) or re.search(r"[=:]|[+*/]\s*\d", rest)
    unclear = may_be_thousands(text, thousands)
    if number is None or odd or unclear:
        if unit is not None:
            without = " without marks of thousands" * unclear
            raise InputError(f"{where}: found '{excerpt(text)}', expected a number{without}")
        return None
    return None if scale is None or behind not in (None, scale) else scale[0] * number + scale[1]


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
    theirs, ours = _unit(unit or inside * bare), _symbols()[inside]
    if value is None or theirs is None or theirs.quantity != ours.quantity:
        raise InputError(
            f"{where}: found '{excerpt(text)}', expected a number with a unit like {inside}"
        )
    # whole powers are exact: 250 ns are 0.25 µs to the last digit
    power = theirs.power - ours.power
    return value * 10.0**power if power >= 0 else value / 10.0**-power


def bias_setting(text: str, where: str) -> float:
    """Return a bias such as ``5``, ``5V`` or ``200 mV`` in volts, of either sign.

    Raises
    ------
    InputError
        If it is no voltage, or none between 1 µV and `MOST_BIAS` but 0.

    Examples
    --------
    >>> bias_setting("200 mV", "--step"), bias_setting("5", "--step")
    (0.2, 5.0)
    """
    volts = setting(text, "V", where, bare=True)
    # below, the current cannot be told from none
    least = 1e-6
    if volts and not least <= abs(volts) <= MOST_BIAS:
        raise InputError(
            f"{where}: found a bias of {volts:g} V, expected 0 or {least:g} to {MOST_BIAS:g} V"
        )
    return volts


def plausible(where: str, unit: str, value: float, low: float, high: float) -> None:
    """Refuse a value out of bounds, with the likeliest cause.

    Raises
    ------
    InputError
        If it is smaller than `low` or larger than `high`.
    """
    if low <= value <= high:
        return
    smaller = {"V": "mV", "mA": "µA"}.get(unit)
    if value < 0:
        cause = "is the sign wrong?"
    elif smaller and high < value <= 1e3 * high:
        cause = f"is it in {smaller}, which would be {value / 1e3:g} {unit}?"
    else:
        cause = "is the unit wrong?"
    raise InputError(
        f"{where}: found {value:g} {unit}, expected {low:g} to {high:g} {unit}; {cause}"
    )
