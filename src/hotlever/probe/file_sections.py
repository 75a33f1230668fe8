"""Probe files: their sections read, and written with what each value is."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any

from hotlever.errors import InputError, unknown_name
from hotlever.files import read_text
from hotlever.materials import Kind
from hotlever.materials.sections import LAWS
from hotlever.probe.parts import MATERIALS, ProbeParts
from hotlever.probe.physics import Physics
from hotlever.probe.shapes import (
    DRAWING,
    PARAMETRIC,
    PARAMETRIC_DRAWING,
    SHAPE_SECTIONS,
    SHAPES,
    Shape,
)
from hotlever.probe.tip import EXAMPLE
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
    return sections_of(read_text(path, largest=_LARGEST), str(path))


def sections_of(text: str, path: str) -> dict[str, Any]:
    """Return the sections of the text of a probe file; `path` names it in an error.

    Raises
    ------
    InputError
        If it is not TOML.
    """
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


def shape_of(
    sections: Mapping[str, Any],
    where: str,
    folder: Path | None = None,
    materials: Mapping[str, Kind] | None = None,
    like: Shape | None = None,
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
    like : Shape, optional
        One whose class it is to have, if both are drawn by one function.

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
    if not isinstance(name, str) or name not in (*SHAPES, PARAMETRIC_DRAWING):
        raise unknown_name("shape", str(name), SHAPES, here)
    kinds = {of: kind.kind for of, kind in (materials or {}).items()}
    if name == DRAWING:
        # imported here: most probes are drawn by their dimensions
        from hotlever.probe.drawing.shape import DrawnShape

        return DrawnShape.read(sections, where, folder, kinds)
    for section in SHAPE_SECTIONS[1:]:
        if section in sections:
            raise InputError(f'{where}: section [{section}] means nothing with shape = "{name}"')
    if name == PARAMETRIC_DRAWING:
        from hotlever.probe.drawing.parametric import ParametricDrawing

        own = type(like) if isinstance(like, ParametricDrawing) else ParametricDrawing
        return own.read(values, where, kinds)
    return PARAMETRIC[name].from_values(values, here)


# --- as text --------------------------------------------------------------------------------------


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


def file_text(
    probe: ProbeParts, shape: Mapping[str, Any], meaning: Mapping[str, str], heading: str = ""
) -> str:
    """Return the probe file of a probe.

    Parameters
    ----------
    probe : ProbeParts
    shape : mapping
        The sections of its shape.
    meaning : mapping of str to str
        What the values of these are, by key.
    heading : str
        Lines above them.
    """
    lines = ["# A hotlever probe file: lengths in µm, temperatures in K."]
    for name, section in shape.items():
        lines += section_lines(name, section, meaning)
    return f"{lines[0]}\n{heading}" + "\n".join(lines[1:]) + "\n" + other_sections(probe)


def other_sections(probe: ProbeParts, without: Container[str] = ()) -> str:
    """Return the sections of a probe's file beside those of its shape, some of them left out."""
    lines = []
    named = {f"{MATERIALS}.{name}": kind for name, kind in probe.materials.items()}
    for name, part in (named | probe.parts).items():
        if name in without:
            continue
        lines += section_lines(name, part.model_dump(), part.description(), optional=True)
    if probe.tip is None:
        lines += ["", "# Without a section [tip] the lever is flat. A cone under the heater:"]
        values, meaning = EXAMPLE.model_dump(), EXAMPLE.description()
        lines += section_lines("tip", values, meaning, start="# ")[1:]
    if not probe.physics:
        lines += ["", "# Without a section [physics] the physics is the paper's. Beyond it:"]
        effects = dict.fromkeys(Physics.model_fields, True)
        lines += section_lines("physics", effects, Physics.description(), start="# ")[1:]
    if probe.laws:
        lines += section_lines(LAWS, probe.laws, {})
    return "\n".join(lines) + "\n"
