"""Where the terminals of a drawing touch the silicon.

A terminal is the edges of the silicon inside its polygons or along its lines. One that is stated
by *area* holds all silicon below its polygons at the contact's potential and the base temperature:
that is cut away from the lever, and the border it leaves is the terminal.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from hotlever.probe.drawing.layers import DrawnTerminal, terminal_part
from hotlever.probe.drawing.outlines import DrawingError, Ring, parts_of, polygons
from hotlever.probe.layout import Layout, Point, Terminal

#: Share of its length by which an edge may stick out of a terminal that names a line.
_ENDS = 2.0
#: How far (µm) from the outline an edge is none of it.
_OFF = 1e-6
#: Share of a leg that a contact may cover without a word.
_COVERED = 0.1
#: Share of what a contact covers that a film below it must take up to be that contact's metal.
_IS_FILM = 0.9


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
    ends: list[Terminal] = []
    for name, rings in terminals.items():
        lines = [ring for ring in rings if len(ring) == 2]
        part, closed = terminal_part(name), [ring for ring in rings if len(ring) != 2]
        areas = polygons(part, closed, tolerance)
        wider = [area.buffer(tolerance) for area in areas]
        own = [edge for area in wider for edge in edges if area.covers(LineString(edge))]
        for line in lines:
            own += [some for edge in edges if (some := along(edge, line, tolerance)) is not None]
        if not own:
            raise _touches_nothing(name, rings, silicon, edges, bool(areas))
        for start, end in dict.fromkeys(own):
            ends.append(Terminal(name, start, end))
    check_apart(ends)
    return ends


def cut_away(
    body: str,
    outline: Polygon,
    areas: Mapping[str, BaseGeometry],
    ends: Iterable[Terminal],
    tip: Point,
) -> tuple[Polygon, list[Terminal]]:
    """Return the body without what lies below terminals stated by area, and all its terminals.

    What is left is the piece with the tip on it: pieces behind a contact carry no current.

    Parameters
    ----------
    body : str
        Its name.
    outline : Polygon
    areas : mapping of str to geometry
        By the terminals' names, on the outline where they reach it.
    ends : iterable of Terminal
        Edges of the outline that belong to other terminals.
    tip : tuple of float

    Raises
    ------
    DrawingError
        If a terminal covers the tip, leaves no border, or another lies behind it.
    """
    for name, area in areas.items():
        if area.covers(shapely.Point(tip)):
            raise DrawingError("it covers the tip", terminal_part(name), place=tip)
    pieces = parts_of(outline.difference(shapely.union_all(list(areas.values()))))
    rest = next((piece for piece in pieces if piece.covers(shapely.Point(tip))), None)
    if rest is None:
        raise DrawingError(f"it lies outside the {body}", "tip_um", place=tip)
    borders = []
    for start, end in outline_edges(rest):
        middle = LineString([start, end]).interpolate(0.5, normalized=True)
        if outline.boundary.distance(middle) > _OFF:
            name = min(areas, key=lambda name: areas[name].boundary.distance(middle))
            borders.append(Terminal(name, start, end))
    left = [
        end
        for end in ends
        if rest.boundary.distance(shapely.Point(np.mean([end.start, end.end], axis=0))) < _OFF
    ]
    names = {end.name for end in (*left, *borders)}
    for name in (*areas, *(end.name for end in ends)):
        if name not in names:
            what = "between it and the tip another terminal, stated by area, takes all of the "
            raise DrawingError(f"{what}{body}", terminal_part(name), place=areas.get(name, outline))
    return rest, [*left, *borders]


def covered(layout: Layout, terminals: Iterable[DrawnTerminal], films: Iterable[Ring]) -> list[str]:
    """Say which contacts cover more of a leg than they count for, and how to make them count.

    Parameters
    ----------
    layout : Layout
    terminals : iterable of DrawnTerminal
    films : iterable of rings
        Outlines of all films: what these cover does not count as bare silicon.
    """
    regions = [Polygon(region.outline, region.holes) for region in layout.regions]
    body = shapely.union_all(regions)
    heaters = shapely.union_all(
        [
            shape
            for shape, region in zip(regions, layout.regions, strict=True)
            if region.part == "heater"
        ]
    )
    metal = shapely.union_all([Polygon(ring).buffer(0) for ring in films if len(ring) > 2])
    notes = []
    for terminal in terminals:
        ends = [end for end in layout.terminals if end.name == terminal.name]
        areas = [Polygon(ring).buffer(0) for ring in terminal.drawn if len(ring) > 2]
        below = body.intersection(shapely.union_all(areas))
        if terminal.by_area or not areas or below.area == 0:
            continue
        if below.intersection(metal).area > _IS_FILM * below.area:
            continue
        edge = shapely.union_all([LineString([end.start, end.end]) for end in ends])
        reach, leg = _farthest(edge, below), edge.distance(heaters)
        # where a film heats all along, all of it is the leg
        leg = leg if leg > 0 else _farthest(edge, body)
        if reach > _COVERED * leg:
            notes.append(
                f"{terminal_part(terminal.name)} covers {reach:.3g} µm of a leg of {leg:.3g} µm "
                "but counts as its end only, the rest as bare silicon; to make all of it a "
                f'contact: {terminal.name} = {{ area = "LAYER" }} in [terminals]; a film: '
                "[layers.NAME] with drawn, material and thickness_um"
            )
    return notes


def _farthest(edge: BaseGeometry, shape: BaseGeometry) -> float:
    """Return how far the corner of a shape that is farthest from an edge is (µm)."""
    corners = shapely.points(shapely.get_coordinates(shape))
    return float(shapely.distance(corners, edge).max())


def outline_edges(silicon: Polygon) -> list[tuple[Point, Point]]:
    """Return the edges of outline and holes."""
    return [
        ((float(a[0]), float(a[1])), (float(b[0]), float(b[1])))
        for ring in (silicon.exterior, *silicon.interiors)
        for a, b in pairwise(ring.coords)
    ]


def along(edge: tuple[Point, Point], line: Ring, tolerance: float) -> tuple[Point, Point] | None:
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


def _point(coordinates: np.ndarray) -> Point:
    return float(coordinates[0]), float(coordinates[1])


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
    point = shapely.shortest_line(shapes[nearest], silicon.boundary).coords[0]
    if away[nearest] > 0 or not has_area:
        what = f"it touches no edge of the silicon; the nearest is {away[nearest]:.3g} µm away"
    else:
        what = "no edge of the silicon lies inside it from corner to corner"
    return DrawingError(what, terminal_part(name), nearest + 1, point)


def check_apart(terminals: list[Terminal]) -> None:
    """Refuse terminals that touch each other.

    Raises
    ------
    DrawingError
        With the place where they do.
    """
    for index, terminal in enumerate(terminals):
        for other in terminals[:index]:
            a, b = LineString([terminal.start, terminal.end]), LineString([other.start, other.end])
            if terminal.name != other.name and a.distance(b) < 1e-6:
                at = shapely.shortest_line(a, b).coords[0]
                what, part = f"it touches '{other.name}'", terminal_part(terminal.name)
                raise DrawingError(what, part, place=at)
