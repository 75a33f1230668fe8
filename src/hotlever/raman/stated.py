"""The sample temperature that a spectrum's header or file name states."""

from __future__ import annotations

import re

from hotlever.units import ZERO_CELSIUS_K, quantity

HOTTEST = 2000.0  #: K; a higher number with the unit of a temperature is something else
#: K; what a header calls "Temperature (C)", no more, and is lower is a detector's: Andor writes so.
COLDEST_UNNAMED = 253.0

_NUMBER = r"(-?\d+(?:[.,]\d+)?)"
_UNIT = r"(K|kelvin|°C|ºC|degC|deg\s?C|C|celsius)"
_IN_NAME = re.compile(rf"T?{_NUMBER}{_UNIT}")
_SPACED = re.compile(rf"(?<![A-Za-z0-9]){_NUMBER}[\s_]{_UNIT}(?![A-Za-z0-9])")
_KEY = re.compile(
    r"^\W*(sample|stage|hot\s?-?plate|linkam|actual|measured|nominal|set)?[\s_]*"
    rf"(?:temperature|temp\.?|T)[\s_]*(?:[\[(]?\s*{_UNIT}\s*[\])]?)?\s*$",
    re.I,
)


def temperature_in_name(stem: str) -> float | None:
    """Temperature (K) that a file's name states with its unit, or None.

    Examples
    --------
    >>> temperature_in_name("si_450K"), temperature_in_name("25C"), temperature_in_name("x50")
    (450.0, 298.15, None)
    """
    parts = re.split(r"[_\s;()\[\]=]+", stem)
    # a dash may be a minus or stand between words
    parts += [part for pair in parts for part in pair.split("-")]
    match = next(filter(None, map(_IN_NAME.fullmatch, parts)), None) or _SPACED.search(stem)
    return _kelvin(quantity(match[1])[0], match[2]) if match else None


def temperature_in_metadata(metadata: dict[str, str]) -> float | None:
    """Sample temperature (K) that a header states with its unit, or None.

    A detector's temperature is not the sample's, and a bare number has no unit to trust.

    Examples
    --------
    >>> temperature_in_metadata({"Detector temperature (°C)": "-70", "Temperature (K)": "295"})
    295.0
    """
    for key, value in metadata.items():
        match = _KEY.match(key[:80])
        if match is None:
            continue
        number, unit = quantity(value)
        unit = unit.strip() or match[2] or ""
        if (found := _kelvin(number, unit)) is None:
            continue
        whose, in_kelvin = match[1], unit[0] in "kK"
        if whose or in_kelvin or found > COLDEST_UNNAMED:
            return found
    return None


def sample_temperature(kelvin: float) -> float | None:
    """Return a temperature (K), or None for what no silicon sample can have.

    Examples
    --------
    >>> sample_temperature(298.15), sample_temperature(-3.0)
    (298.15, None)
    """
    return round(kelvin, 6) if 0.0 < kelvin < HOTTEST else None


def _kelvin(number: float | None, unit: str) -> float | None:
    if number is None or not re.fullmatch(_UNIT, unit, re.I):
        return None
    return sample_temperature(number if unit[0] in "kK" else number + ZERO_CELSIUS_K)
