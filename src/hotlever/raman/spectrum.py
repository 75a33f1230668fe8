"""A Raman spectrum: its name in a file, and the sample temperature that file or name states."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hotlever.types import Array
from hotlever.units import ZERO_CELSIUS_K, quantity


@dataclass(frozen=True)
class Spectrum:
    """Intensity against Raman shift."""

    x: Array  #: Raman shift, cm⁻¹, strictly ascending
    y: Array  #: intensity, counts (or in proportion to them less a constant)
    #: the file, with position, column or number in brackets where it holds several spectra; to the
    #: reader of its format the label alone that sets it apart
    name: str = ""
    metadata: dict[str, str] = field(default_factory=dict)  #: what the file's header says
    temperature: float | None = None  #: of the sample, K, by the header or the file's name
    folder: str = ""
    gaps: tuple[float, ...] = ()  #: Raman shifts (cm⁻¹) at which the file has no intensity


def names_in_file(file: str, labels: list[str]) -> list[str]:
    """Name the spectra of a file: by their labels, or counted from 0 where these do not tell.

    Examples
    --------
    >>> names_in_file("si.txt", ["counts"]), names_in_file("map.txt", ["X=0 Y=1", "X=1 Y=1"])
    (['si.txt'], ['map.txt[X=0 Y=1]', 'map.txt[X=1 Y=1]'])
    >>> names_in_file("series.txt", ["counts", "counts"])
    ['series.txt[0]', 'series.txt[1]']
    """
    if len(labels) == 1:
        return [file]
    # a name is a cell of a CSV, and the last part of a path
    plain = [" ".join(re.sub(r"[\[\]\\/,;|\"']", " ", label).split())[:60] for label in labels]
    distinct = all(plain) and len(set(plain)) == len(plain)
    return [f"{file}[{label}]" for label in (plain if distinct else range(len(plain)))]


def file_and_label(name: str) -> tuple[str, str]:
    """Split a name that `names_in_file` gave; the label is empty for the only spectrum of a file.

    Examples
    --------
    >>> file_and_label("iv.txt[5.25 V]"), file_and_label("si.txt")
    (('iv.txt', '5.25 V'), ('si.txt', ''))
    """
    match = re.fullmatch(r"(.+?)\[([^\[\]]+)\]", name)
    return (match[1], match[2]) if match else (name, "")


def aliases(name: str) -> list[str]:
    """Return what tables may call a spectrum, the most exact first.

    Its file goes with or without suffix, and may stand for all the spectra in it.

    Examples
    --------
    >>> aliases("tip/iv.txt[5.25 V]")
    ['iv.txt[5.25 V]', 'iv[5.25 V]', 'iv.txt', 'iv']
    """
    file, label = file_and_label(Path(name).name)
    files = list(dict.fromkeys((file, Path(file).stem)))
    return [f"{name}[{label}]" for name in files if label] + files


def positions(columns: Mapping[str, Array], count: int) -> list[str]:
    """Label spectra by the quantities that vary between them.

    Examples
    --------
    >>> positions({"X": np.array([0.0, 1.5]), "Y": np.array([2.0, 2.0])}, 2)
    ['X=0', 'X=1.5']
    """
    varying = {name: values for name, values in columns.items() if np.ptp(values) > 0.0}
    return [
        " ".join(f"{name}={values[i]:.7g}" for name, values in varying.items())
        for i in range(count)
    ]


#: How the unit of a temperature is written.
_UNIT = r"(K|kelvin|°C|ºC|degC|deg\s?C|C|celsius)"


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
    number = r"(-?\d+(?:[.,]\d+)?)"
    matches = (re.fullmatch(rf"T?{number}{_UNIT}", part) for part in parts)
    match = next(filter(None, matches), None) or re.search(
        rf"(?<![A-Za-z0-9]){number}[\s_]{_UNIT}(?![A-Za-z0-9])", stem
    )
    return _kelvin(quantity(match[1])[0], match[2]) if match else None


def temperature_in_metadata(metadata: dict[str, str]) -> float | None:
    """Sample temperature (K) that a header states with its unit, or None.

    A detector's temperature is not the sample's, and a bare number has no unit to trust.

    Examples
    --------
    >>> temperature_in_metadata({"Detector temperature (°C)": "-70", "Temperature (K)": "295"})
    295.0
    """
    stated = (
        r"(?i)^\W*(sample|stage|hot\s?-?plate|linkam|actual|measured|nominal|set)?[\s_]*"
        rf"(?:temperature|temp\.?|T)[\s_]*(?:[\[(]?\s*{_UNIT}\s*[\])]?)?\s*$"
    )
    for key, value in metadata.items():
        match = re.match(stated, key[:80])
        if match is None:
            continue
        number, unit = quantity(value)
        unit = unit.strip() or match[2] or ""
        kelvin = _kelvin(number, unit)
        # a sample's by name or unit; what a header calls "Temperature (C)", no more, and is cold is
        # a detector's: Andor writes so
        if kelvin is not None and (match[1] or unit[0] in "kK" or kelvin > 253.0):
            return kelvin
    return None


def sample_temperature(kelvin: float) -> float | None:
    """Return a temperature (K), or None for what no silicon sample can have.

    Examples
    --------
    >>> sample_temperature(298.15), sample_temperature(-3.0)
    (298.15, None)
    """
    return round(kelvin, 6) if 0.0 < kelvin < 2000.0 else None


def _kelvin(number: float | None, unit: str) -> float | None:
    if number is None or not re.fullmatch(_UNIT, unit, re.I):
        return None
    return sample_temperature(number if unit[0] in "kK" else number + ZERO_CELSIUS_K)
