"""One of the spectra in a file, as a reader of files finds it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hotlever.types import Array

_LONGEST = 60  # characters of a label


@dataclass(frozen=True)
class Part:
    """Raman shift (cm⁻¹) and intensity of one spectrum, and what sets it apart in its file."""

    x: Array
    y: Array
    label: str = ""  #: its position, or the heading of its column; empty where there is none
    temperature: float | None = None  #: of the sample, K, where the file gives one for this part
    metadata: dict[str, str] = field(default_factory=dict)


def part_names(file: str, labels: list[str]) -> list[str]:
    """Name the spectra of a file: by their labels, or counted from 0 where these do not tell.

    Examples
    --------
    >>> part_names("si.txt", ["counts"]), part_names("map.txt", ["X=0 Y=1", "X=1 Y=1"])
    (['si.txt'], ['map.txt[X=0 Y=1]', 'map.txt[X=1 Y=1]'])
    >>> part_names("series.txt", ["counts", "counts"])
    ['series.txt[0]', 'series.txt[1]']
    """
    if len(labels) == 1:
        return [file]
    # a name is a cell of a CSV, and the last part of a path
    plain = [" ".join(re.sub(r"[\[\]\\/,;|\"']", " ", one).split())[:_LONGEST] for one in labels]
    told = all(plain) and len(set(plain)) == len(plain)
    return [f"{file}[{one}]" for one in (plain if told else range(len(plain)))]


def file_and_label(name: str) -> tuple[str, str]:
    """Split a name that `part_names` gave; the label is empty for the only spectrum of a file.

    Examples
    --------
    >>> file_and_label("iv.txt[5.25 V]"), file_and_label("si.txt")
    (('iv.txt', '5.25 V'), ('si.txt', ''))
    """
    found = re.fullmatch(r"(.+?)\[([^\[\]]+)\]", name)
    return (found[1], found[2]) if found else (name, "")


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
