"""Sections of a probe file, read and written."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from typing import Any

from hotlever.errors import InputError
from hotlever.files import read_text
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
