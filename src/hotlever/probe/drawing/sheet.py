"""What a drawing file holds: cells, and outlines by layer, in µm."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy import spatial
from shapely import LineString

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.files import read_bytes
from hotlever.probe.drawing.outlines import Ring, rings_of, without_nested
from hotlever.probe.layout import Point

#: Bytes that a file may have, and of memory and seconds that reading it may take.
_LARGEST, _MEMORY, _PATIENCE_S = 64 * 2**20, 4 * 2**30, 60.0
#: Coordinates (µm) beyond which nothing is drawn on a wafer.
FARTHEST_UM = 1e6
#: Extent of a lever (µm).
SMALLEST_UM, LARGEST_UM = 5.0, 2000.0
#: Units of drawings (µm), the likeliest first.
UNITS = {"um": 1.0, "mm": 1e3, "nm": 1e-3, "m": 1e6, "cm": 1e4, "inch": 25_400.0, "mil": 25.4}


@dataclass(frozen=True)
class Layer:
    """One layer of a sheet.

    Attributes
    ----------
    rings : tuple of rings
        Closed outlines.
    lines : tuple of rings
        Open ones, which a DXF file may have.
    """

    rings: tuple[Ring, ...] = ()
    lines: tuple[Ring, ...] = ()


@dataclass(frozen=True)
class Sheet:
    """The content of a drawing file, or of one of its cells.

    Attributes
    ----------
    file : str
    kind : str
        GDSII, OASIS or DXF.
    cells, top : list of str
        All cells, and those that no other refers to.
    cell : str or None
        The one whose layers these are; None in a DXF file.
    layers : dict of str to Layer
    labels : list of (str, str, Point)
        Layer, text and place of each text.
    unit_um : float
        Of the file's numbers.
    unit_stated : bool
        Whether somebody said so: a DXF file need not.
    left_out : dict of str to int
        How many entities of a DXF file draw nothing.
    """

    file: str
    kind: str
    cells: list[str]
    top: list[str]
    cell: str | None
    layers: dict[str, Layer]
    labels: list[tuple[str, str, Point]]
    unit_um: float = 1.0
    unit_stated: bool = True
    left_out: dict[str, int] = field(default_factory=dict)

    def layer(self, name: str, where: str) -> Layer:
        """Return a layer by its name.

        Raises
        ------
        InputError
            If there is none; the text gives the nearest one.
        """
        if name not in self.layers:
            raise unknown_name("layer", name, sorted(self.layers), where)
        return self.layers[name]

    def rings(self, layer: Layer, *, lines: bool = False) -> tuple[Ring, ...]:
        """Return the outlines of a layer; with `lines` the steps of open ones too."""
        closed = layer.rings if self.kind == "DXF" else without_nested(layer.rings)
        steps = (step for line in layer.lines for step in pairwise(line))
        return (*closed, *steps) if lines else closed


def read_sheet(
    path: str | os.PathLike[str],
    cell: str | None = None,
    *,
    unit_um: float | None = None,
    tolerance_um: float,
) -> Sheet:
    """Read a GDSII, OASIS or DXF file.

    Parameters
    ----------
    path : path
    cell : str, optional
        Of a GDSII or OASIS file; its top cell if left out.
    unit_um : float, optional
        What one unit of the file is; what it says if left out, and µm if it says nothing.
    tolerance_um : float
        How far the straight lines that stand for a curve may be from it.

    Raises
    ------
    InputError
        If the file cannot be read, has no such cell or several top cells.
    """
    content = read_bytes(path, _LARGEST)
    parsed = _read_apart(content, str(path), cell, unit_um, tolerance_um)
    layers = {}
    for name, outlines in sorted(parsed["layers"].items()):
        joined, lines = _joined(_points(outlines["lines"], str(path)), tolerance_um)
        layers[name] = Layer((*_points(outlines["rings"], str(path)), *joined), lines)
    labels = [(layer, text, (x, y)) for layer, text, x, y in parsed["labels"]]
    sheet = Sheet(str(path), **{**parsed, "layers": layers, "labels": labels})
    if sheet.kind == "DXF":
        if cell is not None:
            raise InputError(f"{path}: cell = {quoted(cell)}: a DXF file has no cells")
    elif sheet.cell is None:
        if not sheet.top:
            raise InputError(f"{path}: holds no cell")
        top_cells = ", ".join(sheet.top[:10]) + (", …" if len(sheet.top) > 10 else "")
        raise InputError(
            f"{path}: {len(sheet.top)} top cells, expected one or its name as `cell` ({top_cells})"
        )
    elif sheet.cell not in sheet.cells:
        raise unknown_name("cell", sheet.cell, sheet.cells, str(path))
    if not layers:
        raise InputError(f"{path}: holds no outline")
    return sheet


def _read_apart(
    content: bytes, path: str, cell: str | None, unit_um: float | None, tolerance_um: float
) -> dict[str, Any]:
    """Read a file in a process of its own, see `hotlever.probe.drawing.reader`."""
    options = {
        "cell": cell,
        "unit_um": unit_um,
        "tolerance_um": tolerance_um,
        "memory": _MEMORY,
    }
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "drawing")
        copy.write_bytes(content)
        # what a library keeps for its next time (a list of fonts) goes with the folder
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
            "XDG_CACHE_HOME": folder,
        }
        script = str(Path(__file__).with_name("reader.py"))
        try:
            done = subprocess.run(
                [sys.executable, "-P", script, str(copy), json.dumps(options)],
                capture_output=True,
                stdin=subprocess.DEVNULL,
                timeout=_PATIENCE_S,
                env=environment,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise InputError(f"{path}: not read within {_PATIENCE_S:g} s") from None
    try:
        sheet: dict[str, Any] = json.loads(done.stdout)
    except ValueError:
        raise InputError(f"{path}: a damaged file, which cannot be read") from None
    if "error" in sheet:
        raise InputError(f"{path}: {' '.join(sheet['error'].split())}")
    return sheet


def _points(rings: list[list[list[float]]], path: str) -> tuple[Ring, ...]:
    for ring in rings:
        for x, y in ring:
            if not (abs(x) < FARTHEST_UM and abs(y) < FARTHEST_UM):
                raise InputError(
                    f"{path}: a corner at ({x:g}, {y:g}) µm, expected less than {FARTHEST_UM:g} "
                    "µm; is the unit right?"
                )
    return tuple(tuple((x, y) for x, y in ring) for ring in rings)


def _joined(lines: tuple[Ring, ...], tolerance: float) -> tuple[tuple[Ring, ...], tuple[Ring, ...]]:
    """Return the closed outlines that lines make whose ends meet, and the lines that are left."""
    if not lines:
        return (), ()
    points = np.array([point for line in lines for point in (line[0], line[-1])])
    # each end goes to the first of those near it
    near = spatial.cKDTree(points).query_ball_point(points, tolerance)
    ends = iter([tuple(points[min(some)].tolist()) for some in near])
    met = [(next(ends), *line[1:-1], next(ends)) for line in lines]
    some = [LineString(line) for line in met if len(set(line)) > 1]
    closed, cuts, dangles, _ = shapely.polygonize_full(some)
    rings = tuple(rings_of(polygon)[0] for polygon in shapely.get_parts(closed))
    rest = [line for group in (cuts, dangles) for line in shapely.get_parts(group)]
    return rings, tuple(tuple((x, y) for x, y in line.coords) for line in rest)


# --- how large levers are, which tells a wrong unit -----------------------------------------------


def extent_of(rings: Iterable[Ring]) -> float:
    """Return the longer side of the box around some outlines, in their unit."""
    points = np.array([point for ring in rings for point in ring])
    return float(np.ptp(points, axis=0).max()) if len(points) else 0.0


def is_lever(extent_um: float) -> bool:
    """Whether something is as large as a lever may be."""
    return SMALLEST_UM <= extent_um <= LARGEST_UM


def sensible_unit(extent_um: float, unit_um: float) -> str | None:
    """Return the likeliest unit in which something is as large as a lever, None if there is none.

    Parameters
    ----------
    extent_um : float
        With one unit of the drawing being `unit_um`.
    unit_um : float

    Examples
    --------
    >>> sensible_unit(0.0544, 1.0), sensible_unit(54_400.0, 1000.0), sensible_unit(0.0, 1.0)
    ('mm', 'um', None)
    """
    sizes = {name: extent_um / unit_um * size_um for name, size_um in UNITS.items()}
    return next((name for name, size in sizes.items() if is_lever(size)), None)


def doubt(extent_um: float, unit_um: float, unit: str | None, how: str) -> str:
    """Say that something is not as large as a lever, and with which unit it would be.

    Parameters
    ----------
    extent_um, unit_um : float
        As in `sensible_unit`.
    unit : str or None
        The one that makes sense.
    how : str
        Where to say so, as ``--unit {unit}`` or ``unit_um = {unit_um:g}``.
    """
    words = (
        f"{extent_um:.4g} µm long with one unit of the file as {unit_um:g} µm, expected "
        f"{SMALLEST_UM:g} to {LARGEST_UM:g} µm"
    )
    if unit is None:
        return words
    size = extent_um / unit_um * UNITS[unit]
    hint = how.format(unit=unit, unit_um=UNITS[unit])
    return f"{words}; in {unit} it would be {size:.4g} µm: {hint}"
