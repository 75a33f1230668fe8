"""Sections of a probe file, read and written."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hotlever.errors import InputError, unknown_name
from hotlever.files import read_text
from hotlever.materials import Kind
from hotlever.probe.shapes import DRAWING, PARAMETRIC, SHAPE_SECTIONS, SHAPES, Shape
from hotlever.text import as_toml

#: Bytes that a probe file may have, and characters of a line: a key of thousands of parts takes
#: gigabytes to read.
_LARGEST, _LONGEST_LINE = 1_000_000, 1000
#: Column in which comments begin.
_COMMENTS = 32


def read_sections(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a probe file (TOML).

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    """
    text = read_text(path, largest=_LARGEST)
    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > _LONGEST_LINE:
            raise InputError(
                f"{path}: line {number}: {len(line)} characters, expected at most {_LONGEST_LINE}"
            )
    try:
        values = tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path}: not valid TOML: nested too deeply") from None
    except ValueError as error:
        # a number of thousands of digits is a ValueError too
        reason = str(error).partition(";")[0]
        raise InputError(f"{path}: not valid TOML: {reason}") from None
    return values


def with_values(section: Mapping[str, Any]) -> dict[str, Any]:
    """Return a section without the keys that have no value."""
    return {
        key: with_values(value) if isinstance(value, Mapping) else value
        for key, value in section.items()
        if value is not None
    }


def commented(entry: str, text: str | None) -> str:
    """Return a line of a probe file with a comment, if there is one."""
    return f"{entry:<{_COMMENTS - 2}}  # {text}" if text else entry


def section_lines(
    name: str,
    section: Mapping[str, Any],
    meaning: Mapping[str, str],
    *,
    optional: bool = False,
    start: str = "",
) -> list[str]:
    """Return the lines of a section, after an empty one, each with what its value is.

    Keys that have no value are left out, or with `optional` named in a comment. Sections inside it
    come last. The `start` of each line may make all of it a comment.
    """
    inner = {key: value for key, value in section.items() if isinstance(value, Mapping)}
    lines = [] if inner and len(inner) == len(section) else ["", f"{start}[{name}]"]
    for key, value in section.items():
        if key in inner or (value is None and not optional):
            continue
        written = f"{value:.12g}" if isinstance(value, float) else as_toml(value)
        entry = f"# {key} =" if value is None else f"{start}{key} = {written}"
        lines.append(commented(entry, meaning.get(key)))
    for key, values in inner.items():
        lines += section_lines(f"{name}.{key}", values, {})
    return lines


def shape_of(
    sections: Mapping[str, Any],
    where: str,
    folder: Path | None = None,
    materials: Mapping[str, Kind] | None = None,
) -> Shape:
    """Make the shape that some sections of a probe file describe.

    Parameters
    ----------
    sections : mapping
        ``[probe]``, and ``[layers]`` and ``[terminals]`` of a drawing.
    where : str
        Names the file in an error.
    folder : path, optional
        What the name of a drawing's file is relative to.
    materials : mapping of str to Kind, optional
        Those that the layers of a drawing may be made of.

    Raises
    ------
    InputError
        If the shape is unknown, a dimension is missing, misspelt or impossible, or a drawing is
        at fault.
    """
    values, here = sections["probe"], f"{where}: [probe]"
    name = values.get("shape")
    if name is None:
        raise InputError(f"{here}: shape is missing (one of: {', '.join(SHAPES)})")
    if not isinstance(name, str) or name not in SHAPES:
        raise unknown_name("shape", str(name), SHAPES, here)
    if name == DRAWING:
        from hotlever.probe.drawing.shape import (
            Drawing,  # most probes are drawn by their dimensions
        )

        return Drawing.read(sections, where, folder, materials)
    for section in SHAPE_SECTIONS[1:]:
        if section in sections:
            raise InputError(f'{where}: section [{section}] means nothing with shape = "{name}"')
    return PARAMETRIC[name].from_values(values, here)
