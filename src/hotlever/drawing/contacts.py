"""Where the terminals of a drawing touch the silicon."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Polygon

from hotlever.drawing.fault import DrawingError, Ring
from hotlever.drawing.healing import polygons
from hotlever.probe.layout import Point, Terminal

#: Terminals that a lever must have.
REQUIRED = ("supply", "ground")
#: Share of its length by which an edge may stick out of a terminal that names a line.
_ENDS = 2.0


def terminal_edges(
    silicon: Polygon, terminals: Mapping[str, tuple[Ring, ...]], tolerance: float
) -> list[Terminal]:
    """Return the edges of the silicon that belong to each terminal.

    An edge belongs to a terminal if it lies inside one of its polygons from corner to corner, or
    as far as it lies along one of its lines.

    Raises
    ------
    DrawingError
        If a terminal touches nothing, or two touch each other.
    """
    edges = outline_edges(silicon)
    found: list[Terminal] = []
    for name, rings in terminals.items():
        lines = [ring for ring in rings if len(ring) == 2]
        part, closed = terminal_part(name), [ring for ring in rings if len(ring) != 2]
        areas = polygons(part, closed, tolerance)
        wider = [area.buffer(tolerance) for area in areas]
        own = [edge for area in wider for edge in edges if area.covers(LineString(edge))]
        for line in lines:
            own += [some for edge in edges if (some := _along(edge, line, tolerance)) is not None]
        if not own:
            raise _touches_nothing(name, rings, silicon, edges, bool(areas))
        for start, end in dict.fromkeys(own):
            found.append(Terminal(name, start, end))
    _check_apart(found)
    return found


def terminal_part(name: str) -> str:
    """Return how a terminal is named among the parts of a drawing."""
    return f"terminal '{name}'"


def outline_edges(silicon: Polygon) -> list[tuple[Point, Point]]:
    """Return the edges of outline and holes."""
    return [
        ((float(a[0]), float(a[1])), (float(b[0]), float(b[1])))
        for ring in (silicon.exterior, *silicon.interiors)
        for a, b in pairwise(ring.coords)
    ]


def _along(edge: tuple[Point, Point], line: Ring, tolerance: float) -> tuple[Point, Point] | None:
    """Return the part of an edge that lies along a line, None if there is none."""
    start, end = np.array(edge)
    length = float(np.linalg.norm(end - start))
    unit = (end - start) / length
    ends = np.array(line) - start
    across = ends @ np.array([-unit[1], unit[0]])
    if np.abs(across).max() > tolerance:
        return None
    low, high = np.sort(ends @ unit)
    low, high = max(low, 0.0), min(high, length)
    if high - low < tolerance:
        return None
    # a line that ends nearly at a corner ends there
    near = _ENDS * tolerance
    first = edge[0] if low < near else _point(start + low * unit)
    last = edge[1] if high > length - near else _point(start + high * unit)
    return first, last


def _point(place: np.ndarray) -> Point:
    return float(place[0]), float(place[1])


def _touches_nothing(
    name: str,
    rings: tuple[Ring, ...],
    silicon: Polygon,
    edges: list[tuple[Point, Point]],
    has_area: bool,
) -> DrawingError:
    shapes = [Polygon(ring) if len(ring) > 2 else LineString(ring) for ring in rings]
    away = [shape.distance(silicon.boundary) for shape in shapes]
    nearest = int(np.argmin(away))
    place = shapely.shortest_line(shapes[nearest], silicon.boundary).coords[0]
    if away[nearest] > 0 or not has_area:
        what = f"it touches no edge of the silicon; the nearest is {away[nearest]:.3g} µm away"
    else:
        what = "no edge of the silicon lies inside it from corner to corner"
    return DrawingError(what, terminal_part(name), nearest + 1, (place[0], place[1]))


def _check_apart(terminals: list[Terminal]) -> None:
    for place, one in enumerate(terminals):
        for other in terminals[:place]:
            a, b = LineString([one.start, one.end]), LineString([other.start, other.end])
            if one.name != other.name and a.distance(b) < 1e-6:
                at = shapely.shortest_line(a, b).coords[0]
                what, part = f"it touches '{other.name}'", terminal_part(one.name)
                raise DrawingError(what, part, None, (at[0], at[1]))
