"""The edges of a drawn lever: where terminals hold it, and where etching leaves it.

A terminal is the edges of the silicon inside its polygons or along its lines. One that is stated
by *area* holds all silicon below its polygons at the contact's potential and the base temperature:
that is cut away from the lever, and the border it leaves is the terminal.

Etching moves all edges of the body's outline by the same length, corners mitred, but those at
terminals: there a lever is cut off, not etched. Layers keep their borders, and where they reach the
outline as it is drawn they reach that which is etched.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise

import numpy as np
import shapely
from shapely import LinearRing, LineString, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from hotlever.probe.drawing.layers import DrawnTerminal, terminal_part
from hotlever.probe.drawing.outlines import STANDS_OUT, DrawingError, Ring, parts_of, polygons
from hotlever.probe.layout import Layout, Point, Terminal
from hotlever.types import Array

#: Share of its length by which an edge may stick out of a terminal that names a line.
_ENDS = 2.0
#: How far (µm) from the outline an edge is none of it.
_OFF = 1e-6
#: Share of a leg that a contact may cover without a word.
_COVERED = 0.1
#: Share of what a contact covers that a film below it must take up to be that contact's metal.
_IS_FILM = 0.9
_STYLE = {"cap_style": "flat", "join_style": "mitre"}
#: So many times the bias, sides reach beyond the end of a slanted leg, and what is beyond the end
#: reaches beyond its corners.
_BEYOND, _ASIDE = 2.0, 3.0
#: How far off (µm) a point is still a corner, or on a line.
_SAME_UM = 1e-6
#: Cosine of the angle between a border and the outline's normal below which it runs along it.
_ALONG = 0.3


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
    borders = []
    for start, end in outline_edges(rest):
        middle = LineString([start, end]).interpolate(0.5, normalized=True)
        if outline.boundary.distance(middle) > _OFF:
            name = min(areas, key=lambda name: areas[name].boundary.distance(middle))
            borders.append(Terminal(name, start, end))
    remaining_ends = [
        end
        for end in ends
        if rest.boundary.distance(shapely.Point(np.mean([end.start, end.end], axis=0))) < _OFF
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
        if below.intersection(metal).area > _IS_FILM * below.area:
            continue
        edge = shapely.union_all(list(map(line_of, ends)))
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
    near = _ENDS * tolerance
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


class Etching:
    """What etching makes of a drawn outline.

    Attributes
    ----------
    drawn, outline : Polygon
        Before and after.
    ends : list of Terminal
        The terminals on the etched outline.

    Raises
    ------
    DrawingError
        If the body falls apart, or a terminal is lost.
    """

    def __init__(
        self, body: str, drawn: Polygon, ends: list[Terminal], bias_um: float, tolerance: float
    ) -> None:
        self.drawn, self._bias, self._tolerance = orient(drawn), bias_um, tolerance
        self._far = abs(bias_um)
        sides, cuts = self._sides(ends)
        strip = shapely.union_all([side.buffer(self._far, **_STYLE) for side in sides])
        if bias_um > 0:
            etched_area = self.drawn.union(strip).difference(shapely.union_all(cuts))
        else:
            etched_area = self.drawn.difference(strip)
        pieces = parts_of(etched_area.simplify(STANDS_OUT * tolerance))
        if len(pieces) != 1:
            what = f"with edge_bias_um = {bias_um:g} {len(pieces)} pieces are left, expected one"
            raise DrawingError(what, body, place=self.drawn)
        self.outline: Polygon = pieces[0]
        self.ends = [etched_end for end in ends for etched_end in self._etched_ends(end)]

    def _sides(self, ends: list[Terminal]) -> tuple[list[BaseGeometry], list[Polygon]]:
        """Return the lines that are etched, and what lies beyond the leg ends."""
        sides: list[BaseGeometry] = []
        cuts = []
        cut_off = [(end.start, end.end) for end in ends]
        for ring in (self.drawn.exterior, *self.drawn.interiors):
            corners = np.array(ring.coords)[:-1]
            edges = list(zip(corners, np.roll(corners, -1, axis=0), strict=True))
            held = [
                any(along((tuple(a), tuple(b)), line, self._tolerance) for line in cut_off)
                for a, b in edges
            ]
            if not any(held):
                sides.append(LinearRing(corners))
                continue
            # begin behind a leg end
            first = held.index(True) + 1
            order = [(first + step) % len(edges) for step in range(len(edges))]
            side: list[Array] = []
            for number in order:
                start, end = edges[number]
                if not held[number]:
                    side = side or [start]
                    side.append(end)
                    continue
                before, after = edges[number - 1], edges[(number + 1) % len(edges)]
                turns = _turn(before, edges[number]), _turn(edges[number], after)
                cuts.append(self._beyond(start, end, turns))
                if side:
                    sides.append(self._lengthened(side, edges, number))
                side = []
        return sides, cuts

    def _lengthened(
        self, line: list[Array], edges: list[tuple[Array, Array]], number: int
    ) -> LineString:
        """Return a side, beyond the corners of the leg ends unless they turn inwards."""
        count = len(edges)
        first = (number - len(line) + 1) % count
        begin, final = edges[first - 1], edges[number]
        points = list(line)
        if _turn(begin, edges[first]) > 0:
            points.insert(0, line[0] - _BEYOND * self._far * _unit(line[1] - line[0]))
        if _turn(edges[number - 1], final) > 0:
            points.append(line[-1] + _BEYOND * self._far * _unit(line[-1] - line[-2]))
        return LineString(points)

    def _beyond(self, start: Array, end: Array, turns: tuple[float, float]) -> Polygon:
        """Return what lies beyond a leg end, a bit to its sides unless silicon is there."""
        direction = _unit(end - start)
        outward = 2 * _ASIDE * self._far * np.array([direction[1], -direction[0]])
        aside = [
            _ASIDE * self._far if turn > 0 else -self._far / max(abs(turn), _SAME_UM)
            for turn in turns
        ]
        corners = [start - aside[0] * direction, end + aside[1] * direction]
        return Polygon([*corners, corners[1] + outward, corners[0] + outward])

    def _etched_ends(self, end: Terminal) -> list[Terminal]:
        """Return a terminal on the etched outline: to the corners, if it went to the corners."""
        start, final = np.array(end.start), np.array(end.end)
        corners = shapely.get_coordinates(self.drawn)
        longer = _ASIDE * self._far * _unit(final - start)
        whole = [np.linalg.norm(corners - at, axis=1).min() < _SAME_UM for at in (start, final)]
        line = (tuple(start - longer * whole[0]), tuple(final + longer * whole[1]))
        return [
            Terminal(end.name, *segment)
            for edge in outline_edges(self.outline)
            if along(edge, (end.start, end.end), self._tolerance)
            and (segment := along(edge, line, self._tolerance))
        ]

    def layer(self, shape: BaseGeometry) -> BaseGeometry:
        """Return a layer that reaches the etched outline where it reached the drawn one."""
        if self._bias <= 0:
            return shape
        band = self.outline.difference(self.drawn)
        reaches = shape.intersection(self.drawn.boundary)
        borders = shape.boundary.intersection(self.drawn).difference(
            self.drawn.boundary.buffer(_SAME_UM)
        )
        added = []
        for line in _lines(reaches):
            strip = line.buffer(self._far * (1 + _SAME_UM), **_STYLE)
            if not line.is_ring:
                for points in (np.array(line.coords), np.array(line.coords)[::-1]):
                    strip = self._along_border(strip, points, borders)
            added += [
                # without hairs, and a bit into the layer
                piece.buffer(-2 * _SAME_UM, **_STYLE).buffer(3 * _SAME_UM, **_STYLE)
                for piece in parts_of(strip.intersection(band))
                if piece.area > 10 * _SAME_UM * piece.length
            ]
        whole = shapely.union_all([shape, *added])
        return whole.simplify(STANDS_OUT * self._tolerance)

    def _along_border(
        self, strip: BaseGeometry, points: Array, borders: BaseGeometry
    ) -> BaseGeometry:
        """Return a strip along the outline whose end goes on where the layer's border does."""
        at, back = points[0], _unit(points[0] - points[1])
        near = (line for line in _lines(borders) if line.distance(shapely.Point(at)) < 3 * _SAME_UM)
        line = next(near, None)
        if line is None:
            return strip
        coordinates = np.array(line.coords)
        if np.linalg.norm(coordinates[0] - at) < np.linalg.norm(coordinates[-1] - at):
            coordinates = coordinates[::-1]
        border = _unit(coordinates[-1] - coordinates[-2])
        normal = border - (border @ back) * back
        lean = float(np.linalg.norm(normal))
        if lean < _ALONG:
            return strip
        far = 2 * self._far
        wedge = Polygon([at, at + far * normal / lean, at + far * border / lean])
        if wedge.area < _SAME_UM * far:
            return strip
        return strip.union(wedge) if border @ back > 0 else strip.difference(wedge)


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


def _turn(before: tuple[Array, Array], after: tuple[Array, Array]) -> float:
    """Return the sine of the angle by which an outline turns to the left."""
    first, second = _unit(before[1] - before[0]), _unit(after[1] - after[0])
    return float(first[0] * second[1] - first[1] * second[0])


def _lines(shape: BaseGeometry) -> Iterable[LineString]:
    """Return the single lines of what two shapes have in common."""
    parts = [line for line in shapely.get_parts(shape) if "Line" in line.geom_type]
    merged = shapely.line_merge(shapely.union_all(parts)) if parts else LineString()
    return [line for line in shapely.get_parts(merged) if line.length > 0]
