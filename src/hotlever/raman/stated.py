"""The sample temperature that a spectrum's header or file name states."""

from __future__ import annotations

import re

from scipy.constants import zero_Celsius

HOTTEST = 2000.0
"""K; a higher number with the unit of a temperature is something else."""

_NUMBER = r"(-?\d+(?:[.,]\d+)?)"
_UNIT = r"(K|kelvin|°C|ºC|degC|deg\s?C|C|celsius)"
_IN_NAME = re.compile(rf"T?{_NUMBER}{_UNIT}")
_SPACED = re.compile(rf"(?<![A-Za-z0-9]){_NUMBER}[\s_]{_UNIT}(?![A-Za-z0-9])")
_KEY = re.compile(
    r"^\W*(?:sample|stage|hot\s?-?plate|linkam|actual|measured|nominal|set)?[\s_]*"
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
    for part in parts:
        match = _IN_NAME.fullmatch(part)
        if match:
            return _to_kelvin(match[1], match[2])
    match = _SPACED.search(stem)
    return _to_kelvin(match[1], match[2]) if match else None


def temperature_in_metadata(metadata: dict[str, str]) -> float | None:
    """Sample temperature (K) that a header states with its unit, or None.

    A detector's temperature is not the sample's, and a bare number has no unit to trust.

    Examples
    --------
    >>> temperature_in_metadata({"Detector temperature (°C)": "-70", "Temperature (K)": "295"})
    295.0
    """
    for key, value in metadata.items():
        match = _KEY.match(key)
        if not match:
            continue
        stated = re.fullmatch(rf"\s*{_NUMBER}\s*{_UNIT}?\s*", value, re.I)
        unit = (stated[2] if stated else None) or match[1]
        if stated and unit:
            return _to_kelvin(stated[1], unit)
    return None


def kelvin(value: float, unit: str) -> float | None:
    """Convert to kelvin; None for what no silicon sample can have.

    Examples
    --------
    >>> kelvin(25.0, "C"), kelvin(-3.0, "K")
    (298.15, None)
    """
    if not unit.lower().startswith("k"):
        value += zero_Celsius
    return round(value, 6) if 0.0 < value < HOTTEST else None


def _to_kelvin(number: str, unit: str) -> float | None:
    return kelvin(float(number.replace(",", ".")), unit)
