"""How parameters are named in texts and tables, and on axes."""

from __future__ import annotations

import math
import re

from hotlever.materials.kinds import KINDS
from hotlever.materials.material import PARAMETERS
from hotlever.materials.parameters import Parameter

INVERSION = "inversion_temperature"
#: Units by the endings of names in probe files.
_UNITS = {"um": "µm", "ohm": "Ω", "K": "K", "deg": "°"}


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
        stem = name
    words = stem.replace("_", " ")
    return Parameter(name, words, _UNITS.get(ending, "1"), 1.0, -math.inf, math.inf, words)


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
