"""Numbers and tables as text, for terminals, notebooks and pages."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence

from hotlever.materials import KINDS, PARAMETERS
from hotlever.materials.parameters import Parameter

INVERSION = "inversion_temperature"
#: Numbers between these are written without a power of ten.
_PLAIN = 1e-4, 1e6
#: Characters beyond which a list takes several lines.
_LONG = 100
#: Units by the endings of names in probe files.
_UNITS = {"um": "µm", "ohm": "Ω", "K": "K", "deg": "°"}


def value_with_error(value: float, stderr: float | None, scale: float = 1.0) -> str:
    """Return a value with its standard error in the last digits, such as ``0.686(5)``.

    Examples
    --------
    >>> value_with_error(0.6862, 0.0049)
    '0.686(5)'
    >>> value_with_error(5.75e17, None, 1e17)
    '5.75'
    >>> value_with_error(771.3, 28.0), value_with_error(897.24, 1.31), value_with_error(12.0, 53.0)
    ('770(30)', '897.2(1.3)', '10(50)')
    """
    value = value / scale
    if not stderr or not math.isfinite(stderr):
        return f"{value:.6g}"
    error = stderr / scale
    largest = max(abs(value), error)
    if not _PLAIN[0] <= largest < _PLAIN[1]:
        if error >= abs(value):
            return f"{value:.2g} ± {error:.1g}"
        power = math.floor(math.log10(largest))
        return f"{value_with_error(value / 10.0**power, error / 10.0**power)}e{power:+03d}"
    # one digit of the error, two where the first is a 1
    first = f"{error:.0e}"
    place = int(first[2:]) - (f"{error:.1e}"[0] == "1")
    if place >= 0:
        return f"{round(value, -place):.0f}({round(error, -place):.0f})"
    if error >= 1.0:
        return f"{value:.{-place}f}({error:.{-place}f})"
    return f"{value:.{-place}f}({round(error * 10.0**-place)})"


def parameter_named(name: str) -> Parameter:
    """Return how a parameter of a material, or any other value of a probe file, is printed.

    Examples
    --------
    >>> parameter_named("heater_width_um").symbol, parameter_named("heater_width_um").unit
    ('heater width', 'µm')
    >>> parameter_named("film.tcr").symbol, parameter_named("film.tcr").unit
    ('α (film)', 'K⁻¹')
    """
    if name in PARAMETERS:
        return PARAMETERS[name]
    material, dot, own = name.partition(".")
    declared = [kind.declared[own] for kind in KINDS.values() if own in kind.declared]
    if dot and declared:
        known = declared[0]
        return known._replace(
            name=name, symbol=f"{known.symbol} ({material})", meaning=f"{known.meaning}, {material}"
        )
    stem, _, ending = name.rpartition("_")
    if ending not in _UNITS:
        return Parameter(name, name.replace("_", " "), "1", 1.0, -math.inf, math.inf, name)
    symbol = stem.replace("_", " ")
    return Parameter(name, symbol, _UNITS[ending], 1.0, -math.inf, math.inf, name)


def scaled_unit(name: str) -> str:
    """Return the unit a parameter is printed in.

    Examples
    --------
    >>> scaled_unit("n_d")
    '1e17 cm⁻³'
    """
    known = parameter_named(name)
    power = "" if known.scale == 1 else f"{known.scale:.0e}".replace("e+", "e") + " "
    return (power + ("" if known.unit == "1" else known.unit)).strip()


def heading(name: str) -> str:
    """Return the heading of a column with a parameter or the inversion temperature.

    Examples
    --------
    >>> heading("n_d"), heading("p"), heading("inversion_temperature")
    ('n_d (1e17 cm⁻³)', 'p', 'T_i (K)')
    """
    if name == INVERSION:
        return "T_i (K)"
    unit = scaled_unit(name)
    return f"{name} ({unit})" if unit else name


def scale_of(name: str) -> float:
    """Return the unit, of its own, that a parameter or the inversion temperature is printed in."""
    return parameter_named(name).scale


def sentence(text: str) -> str:
    """Make a note a sentence; names of parameters keep their small letters.

    Examples
    --------
    >>> sentence("the levers differ"), sentence("n_d is not determined")
    ('The levers differ.', 'n_d is not determined.')
    """
    first = re.split(r"[^\w.]", text, maxsplit=1)[0]
    is_name = first in PARAMETERS or "." in first
    return f"{text if is_name else text[0].upper() + text[1:]}."


def aligned(rows: Sequence[Sequence[str]], right: bool = False) -> list[str]:
    """Return rows of cells as lines, each column as wide as its widest cell.

    Examples
    --------
    >>> aligned([["p", "2.65"], ["n_d", "5.75"]])
    ['p    2.65', 'n_d  5.75']
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    adjust = str.rjust if right else str.ljust
    return ["  ".join(map(adjust, row, widths)).rstrip() for row in rows]


def as_toml(value: object) -> str:
    """Return a text, a truth, a number or a list as TOML writes it; long lists on several lines.

    Examples
    --------
    >>> as_toml("1/0"), as_toml(((0.0, -1.5), (0.0, 1.5))), as_toml(True)
    ('"1/0"', '[[0.0, -1.5], [0.0, 1.5]]', 'true')
    """
    # JSON writes all of these as TOML does
    text = json.dumps(value, ensure_ascii=False)
    if len(text) <= _LONG or not isinstance(value, list | tuple):
        return text
    inner = ",\n".join(as_toml(one) for one in value)
    return f"[\n{inner},\n]"
