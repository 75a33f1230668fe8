"""The sections of a probe file that describe a shape, by its dimensions or by its drawing."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hotlever.errors import InputError, unknown_name
from hotlever.materials import Kind
from hotlever.probe.shapes import DRAWING, PARAMETRIC, SHAPE_SECTIONS, SHAPES, Shape


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
        from hotlever.drawing.shape import Drawing  # most probes are drawn by their dimensions

        return Drawing.read(sections, where, folder, materials)
    for section in SHAPE_SECTIONS[1:]:
        if section in sections:
            raise InputError(f'{where}: section [{section}] means nothing with shape = "{name}"')
    return PARAMETRIC[name].from_values(values, here)
