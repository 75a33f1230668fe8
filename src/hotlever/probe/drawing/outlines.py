"""From outlines as they are drawn to polygons that can be cut and meshed.

Whatever is nearer than the drawing's tolerance is the same: slits are closed, corners that are
hardly any are dropped, and the outlines of low-doped parts snap to that of the silicon. What is
wrong by more is a `DrawingError` that says where.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from itertools import product
from typing import Any

import numpy as np
import shapely
from scipy import spatial
from shapely import MultiPolygon, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from hotlever.errors import InputError
from hotlever.probe.layout import Point, ring_area
from hotlever.types import Array

# A polygon, or a line of two points.
Ring = tuple[Point, ...]

#: Coordinates are rounded to this (µm) where outlines cross: far less than matters.
GRID = 1e-9
#: No part of a lever is narrower than this many tolerances, nor are two that do not touch nearer.
NARROWEST = 5.0


class DrawingError(InputError):
    """A drawing is at fault.

    Parameters
    ----------
    what : str
    part : str
        What is drawn wrongly: ``silicon``, ``heater``, a terminal, ...
    polygon : int or sequence of Polygon, optional
        Its number among those of the part, from 1; or all of them, of which it is the nearest.
    place : tuple of float or geometry, optional
        Where (µm): a point, or some point of a shape.
    outlines : mapping of str to rings
        All that is drawn, by part.
    where, drawn : str
        The file, and the layer of the part.
    """

    def __init__(
        self,
        what: str,
        part: str,
        polygon: int | Sequence[Polygon] | None = None,
        place: Sequence[float] | BaseGeometry | None = None,
        *,
        outlines: Mapping[str, tuple[Ring, ...]] | None = None,
        where: str = "",
        drawn: str | None = None,
    ) -> None:
        if isinstance(place, BaseGeometry):
            place = place.representative_point().coords[0]
        self.place = None if place is None else (float(place[0]), float(place[1]))
        if isinstance(polygon, Sequence):
            away = [candidate.boundary.distance(shapely.Point(self.place)) for candidate in polygon]
            polygon = 1 + int(np.argmin(away))
        self.what, self.part, self.polygon = what, part, polygon
        self.outlines = dict(outlines or {})
        words = [part if drawn is None else f"{part} (layer {drawn})"]
        if polygon is not None:
            words.append(f"polygon {polygon}")
        if self.place is not None:
            words.append(f"at ({self.place[0]:.3f}, {self.place[1]:.3f}) µm")
        start = f"{where}: " if where else ""
        super().__init__(f"{start}{', '.join(words)}: {what}")

    def again(self, **changes: Any) -> DrawingError:
        """Return the same with another place, or with the file and all that is drawn in it."""
        same = {name: getattr(self, name) for name in ("what", "part", "polygon", "place")}
        return DrawingError(**{**same, **changes})


def rings_of(shape: BaseGeometry) -> tuple[Ring, ...]:
    """Return the outlines of a polygon or several, each with its holes after it."""
    return tuple(
        tuple((float(x), float(y)) for x, y in ring.coords[:-1])
        for part in shapely.get_parts(shape)
        for ring in (part.exterior, *part.interiors)
    )


def polygons(part: str, rings: Iterable[Ring], tolerance: float) -> list[Polygon]:
    """Return each outline as a valid polygon.

    An outline may run along itself to enclose a hole, as those of GDSII do.

    Raises
    ------
    DrawingError
        If an outline is not closed, has no area, or crosses itself.
    """
    areas = []
    for number, ring in enumerate(rings, start=1):
        if len(ring) < 3:
            start = ring[0] if ring else None
            raise DrawingError("an outline that is not closed", part, number, start)
        polygon = Polygon(ring)
        if not polygon.is_valid:
            polygon = _unfolded(polygon, part, number)
        if polygon.area < tolerance**2:
            raise DrawingError("an outline without an area", part, number, ring[0])
        areas.append(polygon)
    return areas


def _unfolded(polygon: Polygon, part: str, number: int) -> Polygon:
    """Return the polygon with holes of an outline that runs along itself."""
    unfolded = shapely.make_valid(polygon)
    enclosed = ring_area(np.array(polygon.exterior.coords))
    if unfolded.geom_type == "GeometryCollection":
        areas = [area for area in unfolded.geoms if area.area > 0]
        unfolded = areas[0] if len(areas) == 1 else MultiPolygon()
    if unfolded.geom_type == "Polygon" and math.isclose(unfolded.area, enclosed, rel_tol=1e-6):
        return unfolded
    reason = shapely.is_valid_reason(polygon)
    point = tuple(map(float, reason.partition("[")[2].rstrip("]").split()[:2])) or None
    raise DrawingError("an outline that crosses or touches itself", part, number, point)


def _levels(areas: Sequence[Polygon], tolerance: float) -> dict[int, int]:
    """Return how many polygons lie around each, by its index; of the same ones the first counts.

    Of polygons that lie around one, those that lie around each other count.
    """
    shapes = np.array(areas, dtype=object)
    boxes = spatial.cKDTree(shapely.bounds(shapes).reshape(-1, 4))
    levels = dict.fromkeys(range(len(areas)), 0)
    for first, second in boxes.query_pairs(tolerance, p=math.inf):
        rims = areas[first].boundary, areas[second].boundary
        if shapely.hausdorff_distance(*rims) <= tolerance:
            levels.pop(max(first, second), None)
    around: dict[int, list[int]] = {index: [] for index in levels}
    for inner, outer in zip(*STRtree(shapes).query(shapes, predicate="covered_by"), strict=True):
        if inner != outer and inner in levels and outer in levels:
            around[int(inner)].append(int(outer))
    for index in sorted(levels, key=lambda index: -areas[index].area):
        levels[index] = 1 + max((levels[outer] for outer in around[index]), default=-1)
    return levels


def together(areas: Sequence[Polygon], tolerance: float) -> BaseGeometry:
    """Return the union of polygons; one that lies inside another is a hole in it."""
    whole: BaseGeometry = Polygon()
    by_level: dict[int, list[Polygon]] = {}
    for index, level in _levels(areas, tolerance).items():
        by_level.setdefault(level, []).append(areas[index])
    for level in sorted(by_level):
        here = shapely.union_all(by_level[level], grid_size=GRID)
        whole = whole.difference(here) if level % 2 else whole.union(here)
    return whole


def holes(areas: Sequence[Polygon], tolerance: float) -> list[int]:
    """Return the numbers of polygons, from 1, that are holes in others (`together`)."""
    levels = _levels(areas, tolerance)
    return sorted(1 + index for index, level in levels.items() if level % 2)


def united(
    rings: tuple[Ring, ...], fills: Sequence[tuple[tuple[Ring, ...], str]], tolerance: float
) -> tuple[Ring, ...]:
    """Return outlines of what lies inside some, or in areas that are filled.

    Parameters
    ----------
    rings : tuple of rings
        One inside another is a hole in it.
    fills : sequence of (rings, str)
        Outlines of one area each, and which part of them is filled: ``even-odd``, between the
        ``outer`` ones and those next to them, or ``all``.
    tolerance : float
        Slits and holes that are narrower are closed.
    """
    if not fills:
        return rings
    try:
        drawn = together(polygons("", rings, tolerance), tolerance)
    except DrawingError:
        # what is wrong is told where the layer is used, with its place
        return rings
    areas = [drawn, *(_filled(own, rule) for own, rule in fills)]
    whole = _closed(shapely.union_all(areas, grid_size=GRID), tolerance)
    return tuple(ring for ring in rings_of(whole) if Polygon(ring).area > tolerance**2)


def _filled(rings: tuple[Ring, ...], rule: str) -> BaseGeometry:
    """Return the area that outlines enclose by a rule of `united`; they may cross themselves."""
    areas = [shapely.make_valid(Polygon(ring)) for ring in rings]
    if rule == "all":
        return shapely.union_all(areas, grid_size=GRID)
    if rule == "outer":
        levels = _levels(areas, 0.0)
        areas = [areas[index] for index in sorted(levels) if levels[index] < 2]
    return reduce(lambda whole, area: whole.symmetric_difference(area, grid_size=GRID), areas)


def without_nested(rings: tuple[Ring, ...]) -> tuple[Ring, ...]:
    """Return the outlines of a GDSII layer without those inside others, where they add nothing."""
    # those that run along themselves around a hole are taken apart
    sound = [shapely.make_valid(Polygon(ring) if len(ring) > 2 else Polygon()) for ring in rings]
    inner, outer = STRtree(sound).query(sound, predicate="within")
    # of equal ones the first stays
    nested = {
        int(a)
        for a, b in zip(inner, outer, strict=True)
        if a != b and (sound[a].area < sound[b].area or b < a)
    }
    return tuple(ring for number, ring in enumerate(rings) if number not in nested)


def healed(part: str, areas: list[Polygon], tolerance: float) -> BaseGeometry:
    """Return the union of polygons, slits of less than the tolerance closed."""
    # corners must stand out by a share of the tolerance
    whole = _closed(together(areas, tolerance), tolerance).simplify(0.25 * tolerance)
    corners = shapely.count_coordinates(whole)
    # with more its mesh takes minutes
    most = 2000
    if corners > most:
        raise DrawingError(
            f"{corners} corners, expected at most {most}; a larger tolerance_um than "
            f"{tolerance:g} makes curves of fewer",
            part,
        )
    return whole


def _closed(whole: BaseGeometry, tolerance: float) -> BaseGeometry:
    """Return a shape whose slits of less than the tolerance are closed."""
    half = tolerance / 2
    style = {"join_style": "mitre"}
    closed = whole.buffer(half * 1.01, **style).buffer(-half * 1.01, **style)
    # where there is no slit, closing changes the outline by rounding errors
    added = [
        gap
        for gap in parts_of(closed.difference(whole))
        if gap.area > GRID * (gap.length + tolerance)
    ]
    if added:
        whole = shapely.union_all(
            [whole, *(gap.buffer(GRID, **style) for gap in added)], grid_size=GRID
        )
    return whole


def parts_of(shape: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a shape; lines and points are left out."""
    return [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"] + [
        inner
        for part in shapely.get_parts(shape)
        if part.geom_type in ("MultiPolygon", "GeometryCollection")
        for inner in parts_of(part)
    ]


def one_piece(part: str, shape: BaseGeometry, drawn: list[Polygon]) -> Polygon:
    """Return a shape that must be one polygon.

    Raises
    ------
    DrawingError
        If it is in several pieces, with the place where the two nearest nearly touch.
    """
    pieces = sorted(parts_of(shape), key=lambda piece: -piece.area)
    if not pieces:
        raise DrawingError("no area", part)
    largest, *others = pieces
    if others:
        nearest = min(others, key=largest.distance)
        apart = f"{len(pieces)} pieces, {largest.distance(nearest):.3g} µm apart"
        point = shapely.shortest_line(nearest, largest).coords[0]
        raise DrawingError(f"{apart}, expected one piece", part, drawn, point)
    return largest


def snapped(shape: BaseGeometry, outline: BaseGeometry, distance: float) -> BaseGeometry:
    """Return a shape whose corners and edges lie on an outline where they are near it."""
    near = shapely.snap(shape, outline, distance)
    lines = shapely.get_parts(outline.boundary if "Polygon" in outline.geom_type else outline)

    def onto(coordinates: Array) -> Array:
        points = shapely.points(coordinates)
        along = shapely.line_locate_point(lines, points[:, None])
        feet = shapely.line_interpolate_point(lines, along)
        away = shapely.distance(feet, points[:, None])
        best, rows = away.argmin(axis=1), np.arange(len(points))
        nearest = shapely.get_coordinates(feet[rows, best])
        return np.where((away[rows, best] < distance)[:, None], nearest, coordinates)

    snapped_shape = shapely.transform(near, onto)
    return snapped_shape if snapped_shape.is_valid else shapely.make_valid(snapped_shape)


def check_widths(part: str, shape: Polygon, drawn: list[Polygon], narrowest: float) -> None:
    """Refuse a polygon that is narrow somewhere, or nearly touches itself.

    Raises
    ------
    DrawingError
        With the place where it does.
    """
    for ring, other in product((shape.exterior, *shape.interiors), repeat=2):
        starts = np.array(ring.coords)[:-1]
        ends = np.array(other.coords)
        edges = shapely.linestrings(np.stack([ends[:-1], ends[1:]], axis=1))
        corner, edge = STRtree(edges).query(
            shapely.points(starts), predicate="dwithin", distance=narrowest
        )
        if ring is other:
            # along the outline, neighbours are near by nature
            length = ring.length
            at = np.append(0.0, np.cumsum(shapely.length(edges)))
            gap = np.stack([(at[corner] - at[edge + 1]) % length, (at[edge] - at[corner]) % length])
            inside = (edge == corner) | (edge == (corner - 1) % len(edges))
            away = (gap.min(axis=0) > 4 * narrowest) & ~inside
            corner, edge = corner[away], edge[away]
        if corner.size:
            points = shapely.points(starts[corner])
            distance = shapely.distance(points, edges[edge])
            worst = int(distance.argmin())
            raise DrawingError(
                f"a corner only {distance[worst]:.3g} µm from another edge of its outline, "
                f"expected {narrowest:g} µm or more",
                part,
                drawn,
                points[worst],
            )
    _check_angles(part, shape, drawn)


def _check_angles(part: str, shape: Polygon, drawn: list[Polygon]) -> None:
    for ring in (shape.exterior, *shape.interiors):
        corners = np.array(ring.coords)[:-1]
        before, after = (np.roll(corners, way, axis=0) - corners for way in (1, -1))
        cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        angle = np.abs(np.arctan2(cross, (before * after).sum(axis=1)))
        # nothing is meshed in sharper corners
        if angle.min() < math.radians(1.0):
            raise DrawingError(
                f"a corner of {math.degrees(angle.min()):.2g}°, expected 1° or more",
                part,
                drawn,
                corners[int(angle.argmin())],
            )
