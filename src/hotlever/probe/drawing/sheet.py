"""What a drawing file holds: cells, and outlines by layer, in µm."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy import spatial
from shapely import LineString

from hotlever.errors import InputError, excerpt, quoted, unknown_name
from hotlever.files import read_bytes
from hotlever.probe.drawing.outlines import Ring, rings_of, united, without_nested
from hotlever.probe.layout import Point

#: Coordinates (µm) beyond which nothing is drawn on a wafer.
FARTHEST_UM = 1e6
#: Extent of a lever (µm).
SMALLEST_UM, LARGEST_UM = 5.0, 2000.0
#: Units of drawings (µm), the likeliest first.
UNITS = {"um": 1.0, "mm": 1e3, "nm": 1e-3, "m": 1e6, "cm": 1e4, "inch": 25_400.0, "mil": 25.4}


@dataclass(frozen=True)
class SheetLayer:
    """One layer of a sheet.

    Attributes
    ----------
    rings : tuple of rings
        Closed outlines; of what is filled those of the area that it makes with what lies beside it.
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
    layers : dict of str to SheetLayer
    labels : list of (str, str, Point)
        Layer, text and place of each text.
    cells, top : list of str
        All cells, and those that no other refers to.
    cell : str or None
        The one whose layers these are; None in a DXF file.
    unit_um : float
        Of the file's numbers.
    unit_stated : bool
        Whether somebody said so: a DXF file need not.
    remarks : list of (str, str)
        What was left out, or is read otherwise than it may be meant, each with its layer, an empty
        text if it is of none; and what the libraries that read files warn of.
    hidden : dict of str to str
        Layers of a DXF file that are ``off`` or ``frozen``, of which nothing is read.
    """

    file: str
    kind: str
    layers: dict[str, SheetLayer]
    labels: list[tuple[str, str, Point]]
    cells: list[str] = field(default_factory=list)
    top: list[str] = field(default_factory=list)
    cell: str | None = None
    unit_um: float = 1.0
    unit_stated: bool = True
    remarks: list[tuple[str, str]] = field(default_factory=list)
    hidden: dict[str, str] = field(default_factory=dict)

    def layer(self, name: str, where: str) -> SheetLayer:
        """Return a layer by its name, which in DXF does not differ by case.

        Raises
        ------
        InputError
            If there is none, the text giving the nearest one, or it is hidden.
        """
        name = self._own_name(name)
        if name in self.hidden:
            raise InputError(
                f"{where}: layer {name} is {self.hidden[name]} in {self.file}, where nothing of it "
                "is seen: expected one that is seen, or it switched on and thawed"
            )
        if name not in self.layers:
            raise unknown_name("layer", name, sorted(self.layers), where)
        return self.layers[name]

    def notes(self, names: Iterable[str]) -> list[str]:
        """Return what should be known of some layers, and of no layer."""
        own = {"", *map(self._own_name, names)}
        return [text for layer, text in self.remarks if layer in own]

    def _own_name(self, name: str) -> str:
        """Return the name of a layer as the file spells it."""
        if self.kind != "DXF":
            return name
        names = (*self.layers, *self.hidden)
        return next((own for own in names if own.lower() == name.lower()), name)

    def rings(self, layer: SheetLayer, *, lines: bool = False) -> tuple[Ring, ...]:
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
    unit_stated_by: str = "unit_um = {unit_um:g} in [probe]",
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
    unit_stated_by : str, optional
        How another unit is stated, for `doubt`.

    Raises
    ------
    InputError
        If the file cannot be read, has no such cell or several top cells.
    """
    content = read_bytes(path, 64 * 2**20)
    parsed = _read_apart(content, str(path), cell, unit_um, tolerance_um)
    _check_places(parsed, str(path), unit_stated_by)
    layers = {}
    for name, outlines in sorted(parsed["layers"].items()):
        joined, lines = _joined(_rings(outlines["lines"]), tolerance_um)
        fills = [(_rings(fill["rings"]), fill["rule"]) for fill in outlines["fills"]]
        layer = SheetLayer(
            united((*_rings(outlines["rings"]), *joined), fills, tolerance_um), lines
        )
        if layer.rings or layer.lines:
            layers[name] = layer
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
        why = "; ".join(["holds no outline", *(text for _, text in sheet.remarks[:5])])
        raise InputError(f"{path}: {why}")
    return sheet


# an import reads a drawing for what it proposes, for the probe, and for what it says of it
@lru_cache(maxsize=2)
def _read_apart(
    content: bytes, path: str, cell: str | None, unit_um: float | None, tolerance_um: float
) -> dict[str, Any]:
    """Read a file in a process of its own, see `hotlever.probe.drawing.drawing_formats`.

    What is returned is kept for the next who reads the same content, and so not to be changed.
    """
    options = {
        "cell": cell,
        "unit_um": unit_um,
        "tolerance_um": tolerance_um,
        "largest_um": LARGEST_UM,
        "memory": 4 * 2**30,
    }
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "drawing")
        copy.write_bytes(content)
        # what a library keeps for its next time (a list of fonts) goes with the folder
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
            "XDG_CACHE_HOME": folder,
        }
        script = str(Path(__file__).with_name("drawing_formats.py"))
        try:
            patience_s = 60.0
            done = subprocess.run(
                [sys.executable, "-P", script, str(copy), json.dumps(options)],
                capture_output=True,
                stdin=subprocess.DEVNULL,
                timeout=patience_s,
                env=environment,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise InputError(f"{path}: not read within {patience_s:g} s") from None
    try:
        sheet: dict[str, Any] = json.loads(done.stdout)
    except ValueError:
        raise InputError(f"{path}: a damaged file, which cannot be read") from None
    if "error" in sheet:
        raise InputError(f"{path}: {' '.join(sheet['error'].split())}")
    # the libraries write their warnings there, gdstk not by way of Python
    lines = done.stderr.decode(errors="replace").splitlines()
    of_library = "[GDSTK] ", "ezdxf: "
    warned = list(dict.fromkeys(line for line in lines if line.startswith(of_library)))
    remarks = [
        ("", f"warning while the file was read: {excerpt(line, 200)}") for line in warned[:5]
    ]
    if len(warned) > 5:
        remarks.append(("", f"and {len(warned) - 5} more warnings"))
    sheet["remarks"] = [(layer, text) for layer, text in sheet.pop("notes", ())] + remarks
    return sheet


def _rings(rings: list[list[list[float]]]) -> tuple[Ring, ...]:
    return tuple(tuple((x, y) for x, y in ring) for ring in rings)


def _check_places(parsed: dict[str, Any], path: str, unit_stated_by: str) -> None:
    """Refuse what no wafer is large enough for; the likeliest cause is a wrong unit."""
    drawn = {
        name: [*own["rings"], *own["lines"], *chain(*(fill["rings"] for fill in own["fills"]))]
        for name, own in parsed["layers"].items()
    }
    extents = {name: extent_of(rings) for name, rings in drawn.items()}
    for name, rings in drawn.items():
        points = (point for ring in rings for point in ring)
        far = (point for point in points if not all(abs(each) < FARTHEST_UM for each in point))
        if (place := next(far, None)) is None:
            continue
        largest = max(extents, key=lambda name: extents[name])
        unit = sensible_unit(extents[largest], parsed["unit_um"])
        if unit is not None and not is_lever(extents[largest]):
            words = doubt(extents[largest], parsed["unit_um"], unit, unit_stated_by)
            raise InputError(f"{path}: layer {largest}: {words}")
        raise InputError(
            f"{path}: layer {name}: a corner at ({place[0]:g}, {place[1]:g}) µm, expected less "
            f"than {FARTHEST_UM:g} µm; is the unit right?"
        )


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
    once = shapely.union_all(some)
    if once.length < sum(line.length for line in some) - tolerance:
        # drawn twice, or partly over each other
        some = shapely.get_parts(once).tolist()
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
