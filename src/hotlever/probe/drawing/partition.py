"""The body of a drawn lever cut into regions, with the borders between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, MultiLineString, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from hotlever.probe.drawing.edges import line_of, outline_edges
from hotlever.probe.drawing.outlines import GRID, DrawingError, parts_of
from hotlever.probe.layout import BorderTaper, Point, Taper, Terminal
from hotlever.types import Array


@dataclass(frozen=True)
class PartitionPiece:
    """One connected part of the lever, of the same layers.

    Attributes
    ----------
    layers : tuple of str
        The part of the body, or the body itself, and the films on it.
    shape : Polygon
        Its corners are bit by bit those of its neighbours.
    """

    layers: tuple[str, ...]
    shape: Polygon


@dataclass(frozen=True)
class Partition:
    """A lever in pieces.

    Attributes
    ----------
    pieces : list of PartitionPiece
    shared : dict of (int, int) to list of Edge
        The edges that two pieces share, by their numbers, the lower first.
    """

    pieces: list[PartitionPiece]
    shared: dict[tuple[int, int], list[frozenset[Point]]]

    def neighbours(self, number: int) -> set[int]:
        """Return the pieces that touch one along an edge."""
        return {other for pair in self.shared if number in pair for other in pair} - {number}

    def reached(self, start: set[int], without: set[int]) -> set[int]:
        """Return the pieces that some are connected with, other than through these."""
        reached, new = set(start) - without, set(start) - without
        while new:
            new = set().union(*(self.neighbours(piece) for piece in new)) - reached - without
            reached |= new
        return reached

    def part_of(self, number: int) -> set[int]:
        """Return the pieces that make one part of the body with one, whatever lies on them."""
        own = self.pieces[number].layers[0]
        others = {other for other, piece in enumerate(self.pieces) if piece.layers[0] != own}
        return self.reached({number}, others)

    def beside(self, number: int) -> set[str]:
        """Return the parts, or the body, that border on the part of a piece."""
        around = set[int]().union(*(self.neighbours(other) for other in self.part_of(number)))
        return {self.pieces[other].layers[0] for other in around} - {self.pieces[number].layers[0]}

    def touched_by(self, ends: list[Terminal], tolerance: float) -> dict[str, set[int]]:
        """Return the numbers of the pieces that each terminal touches."""
        pieces: dict[str, set[int]] = {}
        for end in ends:
            edge = line_of(end)
            along = [piece.shape.boundary.intersection(edge).length for piece in self.pieces]
            touched = {number for number, length in enumerate(along) if length > tolerance}
            middle = edge.interpolate(0.5, normalized=True)
            away = [piece.shape.boundary.distance(middle) for piece in self.pieces]
            pieces.setdefault(end.name, set()).update(touched or {int(np.argmin(away))})
        return pieces

    def taper(self, number: int, sources: set[str], tolerance: float) -> Taper | BorderTaper | None:
        """Return how the doping of a low-doped piece is tapered from its neighbours, if it is.

        Parameters
        ----------
        number : int
            Of the piece.
        sources : set of str
            Parts, or the body, from which dopant diffuses.
        tolerance : float
        """
        group = self.part_of(number)
        borders: list[LineString] = []
        edges = [
            tuple(edge)
            for pair, edges in self.shared.items()
            for inside, outside in (pair, pair[::-1])
            if inside in group and self.pieces[outside].layers[0] in sources
            for edge in edges
        ]
        if edges:
            merged = shapely.line_merge(MultiLineString(edges))
            borders = sorted(
                shapely.get_parts(merged).tolist(), key=lambda border: border.coords[0]
            )
        if not borders:
            return None
        shape = self.pieces[number].shape
        if len(group) > 1:
            # where a film ends on it is no corner of the part
            shapes = [self.pieces[index].shape for index in sorted(group)]
            shape = shapely.union_all(shapes).simplify(GRID)
        strip = _strip(shape, borders, tolerance)
        if strip is not None:
            return strip
        return BorderTaper(tuple(tuple((x, y) for x, y in border.coords) for border in borders))


def partitioned(
    body: tuple[str, Polygon],
    parts: Mapping[str, BaseGeometry],
    films: Mapping[str, BaseGeometry] | None = None,
) -> Partition:
    """Cut a body, with its name, along the outlines of its parts and of the films on it.

    Raises
    ------
    DrawingError
        If two parts overlap.
    """
    (body_name, outline), films = body, films or {}
    names = list(parts)
    for index, name in enumerate(names):
        for other in names[:index]:
            both = parts[name].intersection(parts[other])
            if any(overlap.buffer(-10 * GRID).area > 0 for overlap in parts_of(both)):
                raise DrawingError(f"it overlaps with '{other}'", name, place=both)
    drawn = [*parts.values(), *films.values()]
    noded = shapely.union_all(
        [outline.boundary, *(shape.boundary for shape in drawn)], grid_size=GRID
    )
    kinds: dict[tuple[str, ...], list[Polygon]] = defaultdict(list)
    for face in shapely.get_parts(shapely.polygonize(list(shapely.get_parts(noded)))):
        at = face.representative_point()
        if outline.covers(at):
            part = next((name for name in names if parts[name].covers(at)), body_name)
            on_it = [name for name, shape in films.items() if shape.covers(at)]
            kinds[part, *on_it].append(face)
    order = [*names, body_name]
    pieces = [
        PartitionPiece(kind, orient(shape))
        for kind in sorted(kinds, key=lambda kind: order.index(kind[0]))
        for shape in sorted(parts_of(shapely.union_all(kinds[kind])), key=lambda shape: -shape.area)
    ]
    owners: dict[frozenset[Point], list[int]] = defaultdict(list)
    for number, piece in enumerate(pieces):
        for face in kinds[piece.layers]:
            if piece.shape.covers(face.representative_point()):
                for edge in map(frozenset, outline_edges(face)):
                    owners[edge].append(number)
    shared: dict[tuple[int, int], list[frozenset[Point]]] = defaultdict(list)
    for edge, touching in owners.items():
        if len(touching) == 2 and touching[0] != touching[1]:
            shared[min(touching), max(touching)].append(edge)
    return Partition(pieces, dict(shared))


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
    distances = [float(end.mean(axis=0) @ normal) for end in ends]
    away = np.abs(np.array(shape.exterior.coords) @ normal - np.reshape(distances, (2, 1)))
    if abs(distances[1] - distances[0]) < tolerance or away.min(axis=0).max() > tolerance:
        return None
    middle = (ends[0].mean(axis=0) + ends[1].mean(axis=0)) / 2
    axis = normal if distances[1] > distances[0] else -normal
    return Taper(
        (float(middle[0]), float(middle[1])),
        (float(axis[0]), float(axis[1])),
        abs(distances[1] - distances[0]),
    )
