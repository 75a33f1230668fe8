"""Reading fit files: what a fit found, without solving again."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import InputError
from hotlever.files import read_text
from hotlever.fitting.measurement import Measurement, read_measurement
from hotlever.materials import parameter
from hotlever.probe import Probe

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FitFile:
    """A fit as its file tells it.

    Attributes
    ----------
    probe : Probe
        With the fitted material, in the circuit of the measurement.
    names : list of str
        The parameters that were varied.
    covariance : ndarray, shape (len(names), len(names))
        In the parameters' own units; NaN where it could not be estimated.
    observables : tuple of str
    data_path, data_sha256 : str
        The measurement.
    path : str
    """

    probe: Probe
    names: list[str]
    covariance: Array
    observables: tuple[str, ...]
    data_path: str
    data_sha256: str
    path: str

    @property
    def medium(self) -> str:
        """What was around the lever."""
        return self.probe.surroundings.medium

    def measurement(self) -> Measurement | None:
        """Read the measurement that was fitted; None if it is gone or has changed."""
        if not self.data_path:
            return None
        beside = Path(self.path).parent / Path(self.data_path).name
        for path in (Path(self.data_path), beside):
            if path.is_file() and (
                hashlib.sha256(path.read_bytes()).hexdigest() == self.data_sha256
            ):
                return read_measurement(path)
        return None


def read_fit(path: str | os.PathLike[str]) -> FitFile:
    """Read a fit file.

    Raises
    ------
    InputError
        If it cannot be read or is not a fit file; the text names the key.
    """
    try:
        content = json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: not a fit file: expected an object")

    def section(name: str, kind: type) -> Any:
        if name not in content:
            raise InputError(f"{path}: not a fit file: {name} is missing")
        if not isinstance(content[name], kind):
            raise InputError(f"{path}: {name} is {content[name]!r}, expected {kind.__name__}")
        return content[name]

    probe = Probe.from_values(section("probe", dict), f"{path}: probe")
    correlation = section("correlation", dict)
    names = correlation.get("names", [])
    for name in names:
        parameter(name, f"{path}: correlation.names")
    return FitFile(
        probe=probe,
        names=list(names),
        covariance=_covariance(section("parameters", dict), correlation, names, str(path)),
        observables=tuple(section("observables", list)),
        data_path=str(content.get("data", {}).get("path", "")),
        data_sha256=str(content.get("data", {}).get("sha256", "")),
        path=str(path),
    )


def _covariance(parameters: dict, correlation: dict, names: list[str], path: str) -> Array:
    """Put standard errors and correlations together again."""
    try:
        errors = np.array([parameters[name]["stderr"] for name in names], dtype=float)
        matrix = np.array(correlation["matrix"], dtype=float).reshape(len(names), len(names))
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{path}: parameters and correlation do not belong together ({error})"
        ) from None
    return matrix * np.outer(errors, errors)
