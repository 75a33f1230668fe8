"""A drawing's edges where etching leaves them, beside where they are drawn.

All edges of the body's outline move by the same length, corners mitred, but those at terminals:
there a lever is cut off, not etched. Layers keep their borders, and where they reach the outline
as it is drawn they reach that which is etched.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import shapely
from shapely import LinearRing, LineString, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from hotlever.probe.drawing.contacts import along, outline_edges
from hotlever.probe.drawing.outlines import STANDS_OUT, DrawingError, parts_of
from hotlever.probe.layout import Terminal
from hotlever.types import Array

_STYLE = {"cap_style": "flat", "join_style": "mitre"}
#: So many times the bias, sides reach beyond the end of a slanted leg, and what is beyond the end
#: reaches beyond its corners.
_BEYOND, _ASIDE = 2.0, 3.0
#: How far off (µm) a point is still a corner, or on a line.
_NEAR = 1e-6
#: Cosine of the angle between a border and the outline's normal below which it runs along it.
_ALONG = 0.3


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
            moved = self.drawn.union(strip).difference(shapely.union_all(cuts))
        else:
            moved = self.drawn.difference(strip)
        pieces = parts_of(moved.simplify(STANDS_OUT * tolerance))
        if len(pieces) != 1:
            what = f"with edge_bias_um = {bias_um:g} {len(pieces)} pieces are left, expected one"
            raise DrawingError(what, body, place=self.drawn)
        self.outline: Polygon = pieces[0]
        self.ends = [moved for end in ends for moved in self._moved(end)]

    def _sides(self, ends: list[Terminal]) -> tuple[list[BaseGeometry], list[Polygon]]:
        """Return the lines that are etched, and what lies beyond the leg ends."""
        sides: list[BaseGeometry] = []
        cuts = []
        for ring in (self.drawn.exterior, *self.drawn.interiors):
            corners = np.array(ring.coords)[:-1]
            edges = list(zip(corners, np.roll(corners, -1, axis=0), strict=True))
            held = [self._is_end((tuple(a), tuple(b)), ends) for a, b in edges]
            if not any(held):
                sides.append(LinearRing(corners))
                continue
            # begin behind a leg end
            first = held.index(True) + 1
            order = [(first + step) % len(edges) for step in range(len(edges))]
            line: list[Array] = []
            for number in order:
                start, end = edges[number]
                if not held[number]:
                    line = line or [start]
                    line.append(end)
                    continue
                before, after = edges[number - 1], edges[(number + 1) % len(edges)]
                turns = _turn(before, edges[number]), _turn(edges[number], after)
                cuts.append(self._beyond(start, end, turns))
                if line:
                    sides.append(self._lengthened(line, edges, number))
                line = []
        return sides, cuts

    def _is_end(
        self, edge: tuple[tuple[float, float], tuple[float, float]], ends: list[Terminal]
    ) -> bool:
        return any(along(edge, (end.start, end.end), self._tolerance) for end in ends)

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
            _ASIDE * self._far if turn > 0 else -self._far / max(abs(turn), _NEAR) for turn in turns
        ]
        corners = [start - aside[0] * direction, end + aside[1] * direction]
        return Polygon([*corners, corners[1] + outward, corners[0] + outward])

    def _moved(self, end: Terminal) -> list[Terminal]:
        """Return a terminal on the etched outline: to the corners, if it went to the corners."""
        start, final = np.array(end.start), np.array(end.end)
        corners = shapely.get_coordinates(self.drawn)
        longer = _ASIDE * self._far * _unit(final - start)
        whole = [
            np.linalg.norm(corners - corner, axis=1).min() < _NEAR for corner in (start, final)
        ]
        line = (
            tuple(start - longer * whole[0]),
            tuple(final + longer * whole[1]),
        )
        return [
            Terminal(end.name, *moved)
            for edge in outline_edges(self.outline)
            if along(edge, (end.start, end.end), self._tolerance)
            and (moved := along(edge, line, self._tolerance))
        ]

    def layer(self, shape: BaseGeometry) -> BaseGeometry:
        """Return a layer that reaches the etched outline where it reached the drawn one."""
        if self._bias <= 0:
            return shape
        band = self.outline.difference(self.drawn)
        reaches = shape.intersection(self.drawn.boundary)
        borders = shape.boundary.intersection(self.drawn).difference(
            self.drawn.boundary.buffer(_NEAR)
        )
        added = []
        for line in _lines(reaches):
            strip = line.buffer(self._far * (1 + _NEAR), **_STYLE)
            if not line.is_ring:
                for points in (np.array(line.coords), np.array(line.coords)[::-1]):
                    strip = self._along_border(strip, points, borders)
            added += [
                # without hairs, and a bit into the layer
                piece.buffer(-2 * _NEAR, **_STYLE).buffer(3 * _NEAR, **_STYLE)
                for piece in parts_of(strip.intersection(band))
                if piece.area > 10 * _NEAR * piece.length
            ]
        whole = shapely.union_all([shape, *added])
        return whole.simplify(STANDS_OUT * self._tolerance)

    def _along_border(
        self, strip: BaseGeometry, points: Array, borders: BaseGeometry
    ) -> BaseGeometry:
        """Return a strip along the outline whose end goes on where the layer's border does."""
        at, back = points[0], _unit(points[0] - points[1])
        here = [
            border_line
            for border_line in _lines(borders)
            if border_line.distance(shapely.Point(at)) < 3 * _NEAR
        ]
        if not here:
            return strip
        coordinates = np.array(here[0].coords)
        if np.linalg.norm(coordinates[0] - at) < np.linalg.norm(coordinates[-1] - at):
            coordinates = coordinates[::-1]
        border = _unit(coordinates[-1] - coordinates[-2])
        normal = border - (border @ back) * back
        lean = float(np.linalg.norm(normal))
        if lean < _ALONG:
            return strip
        far = 2 * self._far
        wedge = Polygon([at, at + far * normal / lean, at + far * border / lean])
        if wedge.area < _NEAR * far:
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
