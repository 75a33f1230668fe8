"""What command-line options are parsed into."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, get_args

import numpy as np
import typer
from numpy.typing import NDArray

from hotlever.air.surroundings import Medium
from hotlever.errors import InputError, unknown_name
from hotlever.probe import Probe

ProbeFile = Annotated[
    Path | None,
    typer.Argument(metavar="[PROBE.toml]", help="Probe file; the reference probe if left out."),
]


MediumOption = Annotated[
    str | None, typer.Option(help="vacuum or air; what the files say if left out.")
]


def load_probe(path: Path | None) -> Probe:
    """Read a probe file, or return the reference probe."""
    return Probe.reference() if path is None else Probe.from_file(path)


def check_medium(medium: str | None) -> None:
    """Refuse a medium that does not exist."""
    if medium is not None and medium not in get_args(Medium):
        raise InputError(f"--medium {medium}: expected {' or '.join(get_args(Medium))}")


def parse_bias(text: str) -> NDArray[np.float64]:
    """Parse ``START:STOP:COUNT`` in volts, ends included.

    Examples
    --------
    >>> parse_bias("1:11:3").tolist()
    [1.0, 6.0, 11.0]
    """
    where = f"--bias {text}"
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError(f"{where}: expected START:STOP:COUNT in volts, such as 1:11:25")
    start, stop = parse_number(parts[0], where), parse_number(parts[1], where)
    if not parts[2].isdecimal() or int(parts[2]) < 1:
        raise InputError(f"{where}: COUNT is {parts[2]!r}, expected a whole number of 1 or more")
    count = int(parts[2])
    if start < 0 or stop < start:
        raise InputError(f"{where}: expected 0 <= START <= STOP")
    if (count == 1) != (start == stop):
        raise InputError(f"{where}: COUNT 1 goes with START = STOP, more with START < STOP")
    return np.linspace(start, stop, count)


def parse_number(text: str, where: str) -> float:
    """Parse a finite number."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise InputError(f"{where}: found {text!r}, expected a number")
    return value


def parse_settings(settings: list[str]) -> dict[str, float]:
    """Parse ``NAME=VALUE`` pairs.

    Examples
    --------
    >>> parse_settings(["a0=9e-4"])
    {'a0': 0.0009}
    """
    values = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        if not equals:
            raise InputError(f"--set {setting}: expected NAME=VALUE")
        values[name.strip()] = parse_number(value, f"--set {name}")
    return values


def parse_fixed(settings: list[str]) -> dict[str, float | None]:
    """Parse ``NAME`` or ``NAME=VALUE``: parameters to hold.

    Examples
    --------
    >>> parse_fixed(["n_d=3.3e17", "p"])
    {'n_d': 3.3e+17, 'p': None}
    """
    values: dict[str, float | None] = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        values[name.strip()] = parse_number(value, f"--fix {name}") if equals else None
    return values


def check_choice(option: str, value: str, choices: tuple[str, ...]) -> None:
    """Refuse a value that is none of the choices, with the nearest one."""
    if value not in choices:
        raise unknown_name("value", value, choices, option)


def check_output(path: Path | None, *suffixes: str) -> None:
    """Refuse an output file early: of an unknown type, or in a folder that does not exist."""
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise InputError(
            f"{path}: unknown file type '{path.suffix}', expected {' or '.join(suffixes)}"
        )
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist")
