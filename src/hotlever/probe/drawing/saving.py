"""Levers saved as GDSII, for mask shops and other programs, beside a probe file that names it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hotlever.files import whole_file
from hotlever.probe.drawing.kit import Drawing
from hotlever.probe.drawing.layers import AREA, DRAWN, Rings
from hotlever.probe.drawing.outlines import DrawingError, parts_of, polygons, together
from hotlever.probe.drawing.parametric import ParametricDrawing
from hotlever.probe.drawing.shape import TOLERANCE_UM, DrawnShape
from hotlever.probe.shapes import Shape

#: Steps of the coordinates (µm), and how many of them a file counts.
GRID_UM, _MOST_STEPS = 1e-4, 2**31 - 1
_CELL = "LEVER"
#: Number of the layer of the first terminal, if there are not more of others.
_TERMINALS = 10


def save_drawing(shape: Shape, path: str | os.PathLike[str], folder: Path) -> dict[str, Any]:
    """Write what is drawn of a shape as GDSII, whole or not at all.

    Parameters
    ----------
    shape : Shape
        Drawn, or of dimensions.
    path : path
    folder : path
        Where the probe file will stand.

    Returns
    -------
    dict
        Its sections of a probe file, which name the drawing and its layers. Terminals that are
        lines stay lists of points: a GDSII file has areas only.

    Raises
    ------
    DrawingError
        If it is farther from the origin than such a file can say.
    """
    # imported here: it is needed to write only, files are read in processes of their own
    import gdstk

    drawn = _drawn(shape)
    library = gdstk.Library("hotlever", unit=1e-6, precision=1e-6 * GRID_UM)
    cell, sections = library.new_cell(_CELL), drawn.sections()
    sections["probe"] |= {
        "file": relative(Path(path), folder),
        "cell": _CELL,
        # finer than the steps nothing is the same
        "tolerance_um": max(drawn.tolerance_um, TOLERANCE_UM),
    }

    def added(name: str, rings: Rings, number: int) -> str:
        farthest = max(max(map(abs, point)) for ring in rings for point in ring)
        if farthest > _MOST_STEPS * GRID_UM:
            what = f"{farthest:g} µm from the origin, expected {_MOST_STEPS * GRID_UM:.0f} µm"
            raise DrawingError(f"{what} at most", name)
        for area in parts_of(together(polygons(name, rings, 0.0))):
            outline, *holes = (
                gdstk.Polygon(ring.coords[:-1], layer=number)
                for ring in (area.exterior, *area.interiors)
            )
            if holes:
                # an outline that runs along itself, around its holes
                cell.add(*gdstk.boolean(outline, holes, "not", GRID_UM, layer=number))
            else:
                cell.add(outline)
        return f"{number}/0"

    for number, layer in enumerate(drawn.layers, start=1):
        drawn_as = added(layer.name, layer.drawn, number)
        whole = sections["layers"][layer.name]
        sections["layers"][layer.name] = drawn_as if layer.is_plain else whole | {DRAWN: drawn_as}
    first = max(_TERMINALS, len(drawn.layers) + 1)
    for number, end in enumerate(drawn.terminals, start=first):
        if all(len(ring) > 2 for ring in end.drawn):
            drawn_as = added(end.part, end.drawn, number)
            sections["terminals"][end.name] = {AREA: drawn_as} if end.by_area else drawn_as
    with whole_file(path) as temporary:
        library.write_gds(temporary, max_points=0)
    return sections


def _drawn(shape: Shape) -> DrawnShape:
    """Return a shape as it would be drawn."""
    if isinstance(shape, DrawnShape):
        return shape
    if isinstance(shape, ParametricDrawing):
        return shape.drawn
    return DrawnShape.read(Drawing.of_layout(shape.layout()).sections(), shape.shape)


def relative(path: Path, folder: Path) -> str:
    """Return the name of a file as a file in some folder names it."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return path.resolve().as_posix()
