"""The edges of a drawn lever: where terminals hold it, and where etching leaves it.

A terminal is the edges of the silicon inside its polygons or along its lines. One that is stated
by *area* holds all silicon below its polygons at the contact's potential and the base temperature:
that is cut away from the lever, and the border it leaves is the terminal.

Etching moves all edges of the body's outline by the same length, corners mitred, but those at
terminals: there a lever is cut off, not etched. Layers keep their borders, and where they reach the
outline as it is drawn they reach that which is etched. A border that ends at a corner of the
outline, or lies near it, moves with it, so that nothing of a lever comes or goes with a small
shift; what dopant diffuses from stays where it is drawn.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import chain, pairwise

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely import LinearRing, LineString, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from hotlever.probe.drawing.layers import DrawnTerminal, terminal_part
from hotlever.probe.drawing.outlines import (
    NARROWEST,
    DrawingError,
    Ring,
    check_widths,
    parts_of,
    polygons,
)
from hotlever.probe.layout import Film, Layout, Point, Region, Terminal
from hotlever.probe.mesh import ON_LINE
from hotlever.types import Array, Index


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
            shapes = [Polygon(ring) if len(ring) > 2 else LineString(ring) for ring in rings]
            away = [shape.distance(silicon.boundary) for shape in shapes]
            nearest = int(np.argmin(away))
            point = shapely.shortest_line(shapes[nearest], silicon.boundary).coords[0]
            what = "no edge of the silicon lies inside it from corner to corner"
            if away[nearest] > 0 or not areas:
                what = (
                    f"it touches no edge of the silicon; the nearest is {away[nearest]:.3g} µm away"
                )
            raise DrawingError(what, part, nearest + 1, point)
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

    What is left is the piece with the tip on it: pieces behind a contact carry no current. The
    `areas`, by the terminals' names, are on the outline where they reach it, and the `ends` are
    edges of the outline that belong to other terminals.

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
    off_um = 1e-6  # from the outline, where an edge is none of it
    borders = []
    for start, end in outline_edges(rest):
        middle = LineString([start, end]).interpolate(0.5, normalized=True)
        if outline.boundary.distance(middle) > off_um:
            name = min(areas, key=lambda name: areas[name].boundary.distance(middle))
            borders.append(Terminal(name, start, end))
    remaining_ends = [
        end
        for end in ends
        if rest.boundary.distance(shapely.Point(np.mean([end.start, end.end], axis=0))) < off_um
    ]
    names = {end.name for end in (*remaining_ends, *borders)}
    for name in (*areas, *(end.name for end in ends)):
        if name not in names:
            what = "between it and the tip another terminal, stated by area, takes all of the "
            raise DrawingError(f"{what}{body}", terminal_part(name), place=areas.get(name, outline))
    return rest, [*remaining_ends, *borders]


def covered(layout: Layout, terminals: Iterable[DrawnTerminal], films: Iterable[Ring]) -> list[str]:
    """Say which contacts cover more of a leg than they count for, and how to make them count.

    Parameters
    ----------
    layout : Layout
    terminals : iterable of DrawnTerminal
    films : iterable of rings
        Outlines of all films: what these cover does not count as bare silicon.
    """
    body = layout.polygon
    heaters = shapely.union_all([each.polygon for each in layout.regions if each.part == "heater"])
    metal = shapely.union_all([Polygon(ring).buffer(0) for ring in films if len(ring) > 2])
    notes = []
    for terminal in terminals:
        ends = [end for end in layout.terminals if end.name == terminal.name]
        areas = [Polygon(ring).buffer(0) for ring in terminal.drawn if len(ring) > 2]
        below = body.intersection(shapely.union_all(areas))
        if terminal.by_area or not areas or below.area == 0:
            continue
        # a film below a contact that takes up nearly all of it is that contact's metal
        if below.intersection(metal).area > 0.9 * below.area:
            continue
        edge = shapely.union_all(list(map(line_of, ends)))
        reach, leg = _farthest(edge, below), edge.distance(heaters)
        # where a film heats all along, all of it is the leg
        leg = leg if leg > 0 else _farthest(edge, body)
        if reach > 0.1 * leg:
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


def line_of(end: Terminal) -> LineString:
    """Return the line on which a terminal is held."""
    return LineString([end.start, end.end])


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
    near = 2.0 * tolerance
    first = edge[0] if low < near else _point(start + low * unit)
    last = edge[1] if high > length - near else _point(start + high * unit)
    return first, last


def _point(coordinates: np.ndarray) -> Point:
    return float(coordinates[0]), float(coordinates[1])


def check_apart(terminals: list[Terminal]) -> None:
    """Refuse terminals that touch each other.

    Raises
    ------
    DrawingError
        With the place where they do.
    """
    for index, terminal in enumerate(terminals):
        for other in terminals[:index]:
            a, b = line_of(terminal), line_of(other)
            if terminal.name != other.name and a.distance(b) < 1e-6:
                at = shapely.shortest_line(a, b).coords[0]
                what, part = f"it touches '{other.name}'", terminal_part(terminal.name)
                raise DrawingError(what, part, place=at)


# --- etching --------------------------------------------------------------------------------------


def etched(
    body: str, layout: Layout, outline: Polygon, bias_um: float, tolerance_um: float
) -> Layout:
    """Return a layout whose edges are outside of where they are drawn, all by the same length.

    Every corner moves in proportion to the bias, so that the layout keeps its parts and corners.

    Parameters
    ----------
    body : str
        The layer of the outline.
    layout : Layout
        As it is drawn.
    outline : Polygon
        Its own, with corners where it turns.
    bias_um : float
    tolerance_um : float
        An edge so near to that of a terminal is one.

    Raises
    ------
    DrawingError
        If parts of the lever would turn over, overlap or be too narrow.
    """
    rates = _OutlineRates(body, layout, outline, tolerance_um)

    def moved(ring: Iterable[Point]) -> tuple[Point, ...]:
        points = np.array(list(ring))
        return tuple(map(_point, points + bias_um * rates.at(points)))

    regions = tuple(
        replace(region, outline=moved(region.outline), holes=tuple(map(moved, region.holes)))
        for region in layout.regions
    )
    terminals = tuple(Terminal(end.name, *moved((end.start, end.end))) for end in layout.terminals)
    _check_etched(f"with {body}.edge_bias_um = {bias_um:g}", body, regions, tolerance_um)
    return replace(layout, regions=regions, terminals=terminals)


def _check_etched(why: str, body: str, regions: Iterable[Region], tolerance_um: float) -> None:
    """Refuse regions that turn over, overlap or are too narrow."""
    shapes = [region.polygon for region in regions]
    turned = [shape for shape in shapes if not (shape.is_valid and shape.exterior.is_ccw)]
    if turned:
        what = f"{why} a part of the lever turns over, expected a smaller shift"
        raise DrawingError(what, body, place=turned[0].centroid)
    whole = shapely.union_all(shapes)
    if abs(whole.area - sum(shape.area for shape in shapes)) > ON_LINE * whole.length:
        what = f"{why} parts of the lever overlap, expected a smaller shift"
        raise DrawingError(what, body, place=whole)
    for shape in shapes:
        try:
            check_widths(body, shape, [shape], NARROWEST * tolerance_um)
        except DrawingError as error:
            raise DrawingError(f"{why} {error.what}", body, place=error.place) from None


class _OutlineRates:
    """How fast places of a layout move with the bias of the edges of its outline.

    A corner stays on both of its edges, of which one at a terminal rests. Where a border reaches an
    edge far from its corners it goes straight on.
    """

    def __init__(self, body: str, layout: Layout, outline: Polygon, tolerance_um: float) -> None:
        rings = [np.array(ring.coords)[:-1] for ring in _rings(outline)]
        self._starts = np.concatenate(rings)
        ends = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
        sides = ends - self._starts
        self._lengths = np.linalg.norm(sides, axis=1)
        self._along = sides / self._lengths[:, None]
        self._outward = np.stack([self._along[:, 1], -self._along[:, 0]], axis=1)
        held = [(end.start, end.end) for end in layout.terminals]
        edges = [(_point(a), _point(b)) for a, b in zip(self._starts, ends, strict=True)]
        self._rates = np.array(
            [float(not any(along(edge, line, tolerance_um) for line in held)) for edge in edges]
        )
        numbers = self._numbers(rings)
        before, self._next = (
            np.concatenate([np.roll(ring, way) for ring in numbers]) for way in (1, -1)
        )
        self._at_starts = np.array(
            [self._of_corner(body, first, last) for last, first in enumerate(before)]
        )
        self._borders = self._directions(layout)
        films = dict[Point, set[tuple[Film, ...]]]()
        for region in layout.regions:
            for corner in chain(*region.rings):
                films.setdefault(_key(corner), set()).add(region.films)
        self._of_dopant = {
            _key(corner)
            for region in layout.regions
            if region.taper is not None
            for corner in chain(*region.rings)
            if len(films[_key(corner)]) == 1
        }

    @staticmethod
    def _numbers(rings: list[Array]) -> list[Index]:
        """Return the numbers of the edges of each ring."""
        ends = np.cumsum([len(ring) for ring in rings])
        return [np.arange(end - len(ring), end) for ring, end in zip(rings, ends, strict=True)]

    def _of_corner(self, body: str, first: int, last: int) -> Array:
        """Return how the corner between two edges moves."""
        normals, rates = self._outward[[first, last]], self._rates[[first, last]]
        if rates[0] == rates[1]:
            return np.asarray(rates[0] * normals.sum(axis=0) / (1.0 + normals[0] @ normals[1]))
        if abs(np.linalg.det(normals)) < 0.01:
            what = "beside a terminal the edge goes straight on: its edges cannot be shifted"
            raise DrawingError(what, body, place=self._starts[last])
        return np.linalg.solve(normals, rates)

    def _nearest(self, points: Array) -> tuple[Index, Array, Array]:
        """Return the nearest edge of points (n, 2), how far along it and how far away they are."""
        offset = points[:, None] - self._starts
        along_edge = np.clip((offset * self._along).sum(axis=2), 0.0, self._lengths)
        away = np.linalg.norm(offset - along_edge[..., None] * self._along, axis=2)
        edge, row = away.argmin(axis=1), np.arange(len(points))
        return edge, along_edge[row, edge], away[row, edge]

    def _directions(self, layout: Layout) -> dict[Point, list[Array]]:
        """Return the directions of the borders that reach the outline, by where they do."""
        directions = dict[Point, list[Array]]()
        for region in layout.regions:
            edges = region.edges
            _, _, away = self._nearest(edges.mean(axis=1))
            for start, end in edges[away > ON_LINE]:
                for at in (start, end):
                    directions.setdefault(_key(at), []).append(_unit(end - start))
        return directions

    def at(self, points: Array) -> Array:
        """Return the rates of corners (n, 2) of regions or terminals."""
        edges, at, away = self._nearest(points)
        rates = np.zeros_like(points)
        for row, (edge, point) in enumerate(zip(edges.tolist(), points, strict=True)):
            with_outline = max(1.0 - away[row] / self._near(point), 0.0)
            if with_outline:
                rates[row] = with_outline * self._on_edge(edge, at[row], point)
        return rates

    def _on_edge(self, edge: int, at: float, point: Array) -> Array:
        """Return the rate of a place on an edge; near a corner that of it, so as not to pass it."""
        slide = self._slide(edge, point)
        slide = self._rates[edge] * self._outward[edge] if slide is None else slide
        distances = np.array([at, self._lengths[edge] - at])
        shares = np.maximum(1.0 - distances / min(self._lengths[edge], self._near(point)), 0.0)
        corners = self._at_starts[[edge, self._next[edge]]]
        return np.asarray(slide + shares @ (corners - slide))

    def _near(self, point: Array) -> float:
        """Return how far what moves with it is from a place."""
        # borders of low-doped silicon move as its dopant does, those of films stay themselves
        return 1.0 if _key(point) in self._of_dopant else 0.1

    def _slide(self, edge: int, at: Array) -> Array | None:
        """Return the rate of a place on an edge at which a border goes straight on, if it can."""
        normal = self._outward[edge]
        borders = self._borders.get(_key(at), [])
        # others run along the outline
        steep = [border / (border @ normal) for border in borders if abs(border @ normal) > 0.3]
        if not steep or any(np.abs(steep[0] - other).max() > ON_LINE for other in steep):
            return None
        return np.asarray(self._rates[edge] * steep[0])


def _rings(outline: Polygon) -> list[LinearRing]:
    oriented = orient(outline)
    return [oriented.exterior, *oriented.interiors]


def _key(at: ArrayLike) -> Point:
    """Return a place as the same for all that have it."""
    x, y = np.asarray(at, dtype=float).round(6).tolist()
    return x, y


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))
