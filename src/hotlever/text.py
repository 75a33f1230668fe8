"""Numbers and tables as text, for terminals, notebooks and pages."""

from __future__ import annotations

import re
from collections.abc import Sequence

from uncertainties import ufloat

from hotlever.materials import PARAMETERS

INVERSION = "inversion_temperature"


def value_with_error(value: float, stderr: float | None, scale: float = 1.0) -> str:
    """Return a value with its standard error in the last digits, such as ``0.686(5)``.

    Examples
    --------
    >>> value_with_error(0.6862, 0.0049)
    '0.686(5)'
    >>> value_with_error(5.75e17, None, 1e17)
    '5.75'
    """
    if not stderr or stderr != stderr:
        return f"{value / scale:.6g}"
    number = ufloat(value / scale, stderr / scale)
    return f"{number:.1uS}" if f"{stderr:e}"[0] > "1" else f"{number:.2uS}"


def scaled_unit(name: str) -> str:
    """Return the unit a parameter is printed in.

    Examples
    --------
    >>> scaled_unit("n_d")
    '1e17 cm⁻³'
    """
    known = PARAMETERS[name]
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
    return PARAMETERS[name].scale if name in PARAMETERS else 1.0


def sentence(text: str) -> str:
    """Make a note a sentence; names of parameters keep their small letters.

    Examples
    --------
    >>> sentence("the levers differ"), sentence("n_d is not determined")
    ('The levers differ.', 'n_d is not determined.')
    """
    begins_with_name = re.split(r"\W", text, maxsplit=1)[0] in PARAMETERS
    return f"{text if begins_with_name else text[0].upper() + text[1:]}."


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
