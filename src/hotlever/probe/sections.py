"""Sections of a probe file as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hotlever.text import as_toml

#: Column in which comments begin.
_COMMENTS = 32


def with_values(section: Mapping[str, Any]) -> dict[str, Any]:
    """Return a section without the keys that have no value."""
    return {
        key: with_values(value) if isinstance(value, Mapping) else value
        for key, value in section.items()
        if value is not None
    }


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
        lines.append(f"{entry:<{_COMMENTS}}# {meaning[key]}" if key in meaning else entry)
    for key, values in inner.items():
        lines += section_lines(f"{name}.{key}", values, {})
    return lines
