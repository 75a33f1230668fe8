"""The silicon of a drawing cut into regions, with the borders between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, MultiLineString, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from hotlever.drawing.contacts import outline_edges
from hotlever.drawing.fault import DrawingError
from hotlever.drawing.healing import GRID, parts_of
from hotlever.probe.layout import BorderTaper, Point, Taper
from hotlever.types import Array

Edge = frozenset[Point]


@dataclass(frozen=True)
class Piece:
    """One connected part of the silicon, of one kind.

    Attributes
    ----------
    kind : str or None
        The name of the low-doped part; None of high-doped silicon.
    shape : Polygon
        Its corners are bit by bit those of its neighbours.
    """

    kind: str | None
    shape: Polygon


@dataclass(frozen=True)
class Cut:
    """Silicon in pieces.

    Attributes
    ----------
    pieces : list of Piece
    shared : dict of (int, int) to list of Edge
        The edges that two pieces share, by their numbers, the lower first.
    """

    pieces: list[Piece]
    shared: dict[tuple[int, int], list[Edge]]

    def neighbours(self, number: int) -> set[int]:
        """Return the pieces that touch one along an edge."""
        return {one for pair in self.shared if number in pair for one in pair} - {number}

    def reached(self, start: set[int], without: set[int]) -> set[int]:
        """Return the pieces that some are connected with, other than through these."""
        found, new = set(start) - without, set(start) - without
        while new:
            new = set().union(*(self.neighbours(one) for one in new)) - found - without
            found |= new
        return found


def cut(silicon: Polygon, low_doped: Mapping[str, BaseGeometry]) -> Cut:
    """Cut silicon along the outlines of its low-doped parts.

    Raises
    ------
    DrawingError
        If two low-doped parts overlap.
    """
    names = list(low_doped)
    for place, name in enumerate(names):
        for other in names[:place]:
            both = low_doped[name].intersection(low_doped[other])
            if any(one.buffer(-10 * GRID).area > 0 for one in parts_of(both)):
                at = both.representative_point()
                raise DrawingError(f"it overlaps with '{other}'", name, None, (at.x, at.y))
    outlines = [silicon.boundary, *(shape.boundary for shape in low_doped.values())]
    noded = shapely.union_all(outlines, grid_size=GRID)
    kinds: dict[str | None, list[Polygon]] = defaultdict(list)
    for face in shapely.get_parts(shapely.polygonize(list(shapely.get_parts(noded)))):
        at = face.representative_point()
        if silicon.covers(at):
            kind = next((name for name in names if low_doped[name].covers(at)), None)
            kinds[kind].append(face)
    pieces = [
        Piece(kind, orient(one))
        for kind in (*names, None)
        for one in sorted(parts_of(shapely.union_all(kinds[kind])), key=lambda one: -one.area)
    ]
    owners: dict[Edge, list[int]] = defaultdict(list)
    for number, piece in enumerate(pieces):
        for face in kinds[piece.kind]:
            if piece.shape.covers(face.representative_point()):
                for edge in map(frozenset, outline_edges(face)):
                    owners[edge].append(number)
    shared: dict[tuple[int, int], list[Edge]] = defaultdict(list)
    for edge, touching in owners.items():
        if len(touching) == 2 and touching[0] != touching[1]:
            shared[min(touching), max(touching)].append(edge)
    return Cut(pieces, dict(shared))


def taper_of(whole: Cut, number: int, tolerance: float) -> Taper | BorderTaper:
    """Return how the doping of a low-doped piece is tapered from its high-doped neighbours.

    Raises
    ------
    DrawingError
        If it has none.
    """
    piece = whole.pieces[number]
    borders: list[LineString] = []
    edges = [
        tuple(edge)
        for pair, edges in whole.shared.items()
        if number in pair and whole.pieces[sum(pair) - number].kind is None
        for edge in edges
    ]
    if edges:
        merged = shapely.line_merge(MultiLineString(edges))
        borders = sorted(shapely.get_parts(merged).tolist(), key=lambda one: one.coords[0])
    if not borders:
        at = piece.shape.representative_point()
        raise DrawingError(
            "it borders on no high-doped silicon", piece.kind or "", None, (at.x, at.y)
        )
    strip = _strip(piece.shape, borders, tolerance)
    if strip is not None:
        return strip
    return BorderTaper(tuple(tuple((x, y) for x, y in border.coords) for border in borders))


def _strip(shape: Polygon, borders: list[LineString], tolerance: float) -> Taper | None:
    """Return the taper of a strip between two parallel straight borders, None if it is not one.

    All corners lie on the lines of the borders.
    """
    if len(borders) != 2 or shape.interiors:
        return None
    ends = [np.array([border.coords[0], border.coords[-1]]) for border in borders]
    chords = [end[1] - end[0] for end in ends]
    if chords[0] @ chords[1] < 0:
        chords[1] = -chords[1]
    along = chords[0] + chords[1]
    length = np.linalg.norm(along)
    if length < tolerance:
        return None
    normal: Array = np.array([-along[1], along[0]]) / length
    places = [float(end.mean(axis=0) @ normal) for end in ends]
    away = np.abs(np.array(shape.exterior.coords) @ normal - np.reshape(places, (2, 1)))
    if abs(places[1] - places[0]) < tolerance or away.min(axis=0).max() > tolerance:
        return None
    middle = (ends[0].mean(axis=0) + ends[1].mean(axis=0)) / 2
    axis = normal if places[1] > places[0] else -normal
    return Taper(
        (float(middle[0]), float(middle[1])),
        (float(axis[0]), float(axis[1])),
        abs(places[1] - places[0]),
    )
