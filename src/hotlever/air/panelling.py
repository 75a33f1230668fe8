"""The panelling of a plane outline of any shape: strips along its edges, pieces inside.

Strips lie between curves at fixed depths below the exposed edges. Cuts from corner to corner of
these curves make faces of them, one or two to an edge, and each face is divided along its longest
side, and across where it is too wide. Neighbours need not meet at corners: the flux on a panel is
its own.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from hotlever.air.panels import divided
from hotlever.types import Array

# the largest edge that a panel may have at each of some places (n, 2), shape (n,)
Size = Callable[[Array], Array]

#: Where lines cross, coordinates are rounded to this (µm).
GRID = 1e-8
#: Narrower pieces (µm) are left out: they come of rounding.
_NARROWEST = 1e-5
#: A strip reaches so many times its depth into the corner between two edges, at most.
_MITRE = 10.0
#: A cut goes on so much farther than to the other side, for rounding.
_BEYOND = 1.0 + 1e-6
#: Inside a face an outline that turns by less (rad) is as good as straight, or part of a curve.
_STRAIGHT, _CURVED = 0.05, 0.5
#: How far the last curve may be off its depth, as a share of its strip's width.
_OFF_CURVE = 0.05
#: A corner that turns by less (rad) is none.
_IN_LINE = 1e-6
#: Places at which the size is asked for along a face.
_SAMPLES = 129


def panelled(shape: Polygon, exposed: BaseGeometry, depths: Array, size: Size) -> Array:
    """Cut a polygon into convex panels.

    Parameters
    ----------
    shape : Polygon
    exposed : LineString or MultiLineString
        Those of its edges that have strips.
    depths : ndarray, shape (k,)
        Of the curves between strips (µm), rising.
    size : callable
        Largest edge of a panel at some places.

    Returns
    -------
    ndarray, shape (n, 4, 2)
        Corners of quadrilaterals; in a triangle the last two are the same.
    """
    panels = [
        quadrilateral
        for face in _faces(shape, exposed, depths)
        for piece in _convex(face)
        for cell in _divided(piece, size)
        for quadrilateral in _quadrilaterals(cell)
    ]
    corners = np.array(panels).reshape(-1, 4, 2)
    diagonals = corners[:, 2:] - corners[:, :2]
    area = np.abs(diagonals[:, 0, 0] * diagonals[:, 1, 1] - diagonals[:, 0, 1] * diagonals[:, 1, 0])
    # narrower ones come of rounding
    return corners[area > _NARROWEST * np.linalg.norm(diagonals, axis=2).sum(axis=1)]


def parts(shape: BaseGeometry, kind: str = "Polygon") -> list[BaseGeometry]:
    """Return the simple parts of one kind that a geometry is made of."""
    simple = shapely.get_parts(shape)
    if any(part.geom_type == "GeometryCollection" for part in simple):
        simple = shapely.get_parts(simple)
    return [part for part in simple if part.geom_type == kind and not part.is_empty]


def rings(shape: Polygon) -> list[Array]:
    """Return the corners of outline and holes, the polygon to their left, without repetition."""
    turned = orient(shape)
    return [np.array(ring.coords)[:-1] for ring in (turned.exterior, *turned.interiors)]


def turns(ring: Array) -> Array:
    """Return by how much (rad) a ring turns to the left at each of its corners."""
    after = np.roll(ring, -1, axis=0) - ring
    before = np.roll(after, 1, axis=0)
    crossed = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turned: Array = np.arctan2(crossed, np.einsum("nd,nd->n", before, after))
    return turned


def _faces(shape: Polygon, exposed: BaseGeometry, depths: Array) -> list[Polygon]:
    """Return what curves at some depths, and cuts between their corners, make of a polygon."""
    lines = [shape.boundary]
    inner: BaseGeometry = shape
    above = 0.0
    for depth in depths:
        rim = exposed.buffer(depth, cap_style="square", join_style="mitre", mitre_limit=_MITRE)
        layer, inner = inner, shape.difference(rim, grid_size=GRID)
        # strips have the corners of the outline; what is inside the last needs fewer
        last = depth == depths[-1]
        inner = inner.simplify(_OFF_CURVE * (depth - above) if last else 10 * GRID)
        if inner.is_empty:
            break
        for part in parts(inner):
            lines.append(part.boundary)
            lines += _mitres(part, shape, layer, depth - above)
        above = depth
    return _cut_by(shape, lines)


def _mitres(inner: Polygon, shape: Polygon, layer: BaseGeometry, step: float) -> list[LineString]:
    """Return cuts from the corners of a curve outwards, to those of the curve above it."""
    starts, ends = [], []
    for ring in rings(inner):
        along = np.roll(ring, -1, axis=0) - ring
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
        both = outward + np.roll(outward, 1, axis=0)
        # as long as the mitre: 1 / cos of half the turn
        reach = 2.0 / np.maximum(np.einsum("nd,nd->n", both, both), 4.0 / (2 * _MITRE) ** 2)
        starts.append(ring)
        ends.append(ring + step * both * reach[:, None] * _BEYOND)
    pairs = np.stack([np.concatenate(starts), np.concatenate(ends)], axis=1)
    # on the edge of the shape a curve ends
    pairs = pairs[shapely.distance(shapely.points(pairs[:, 0]), shape.boundary) > 10 * GRID]
    clipped = shapely.intersection(shapely.linestrings(pairs), layer.difference(inner))
    # what lies beyond the curve above belongs to another corner
    return [
        part
        for line, corner in zip(clipped, shapely.points(pairs[:, 0]), strict=True)
        for part in parts(line, "LineString")
        if part.distance(corner) < 10 * GRID
    ]


def _cut_by(shape: Polygon, lines: list[LineString]) -> list[Polygon]:
    """Return the faces that lines make of a polygon, without what comes of rounding."""
    noded = shapely.union_all(lines, grid_size=GRID)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    inside = shapely.covers(shape, shapely.point_on_surface(faces))
    return [face for face in faces[inside] if face.area > _NARROWEST * face.length]


def _convex(face: Polygon) -> list[Polygon]:
    """Cut a face into pieces that are convex but for corners that hardly turn.

    At each corner that points inwards one of its edges goes on, the one that is sooner at the
    other side; from a curve a cut goes straight across.
    """
    cuts = []
    for ring in rings(face):
        along = np.roll(ring, -1, axis=0) - ring
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        before, turned = np.roll(along, 1, axis=0), turns(ring)
        for number in np.flatnonzero(turned < -_STRAIGHT):
            ways = [before[number], -along[number]]
            if turned[number] > -_CURVED:
                x, y = before[number] + along[number]
                ways = [np.array([-y, x])]
            rays = [_ray(face, ring[number], way) for way in ways]
            cuts.append(min(rays, key=_length_and_slope))
    return _cut_by(face, [face.boundary, *cuts]) if cuts else [face]


def _ray(face: Polygon, start: Array, direction: Array) -> LineString:
    """Return the way from a corner into a face to its other side."""
    x0, y0, x1, y1 = face.bounds
    far = start + direction * (np.hypot(x1 - x0, y1 - y0) / np.linalg.norm(direction))
    line = LineString([start, far])
    ways = parts(line.intersection(face), "LineString")
    origin = shapely.Point(start)
    return min(ways, key=origin.distance, default=line)


def _length_and_slope(line: LineString) -> tuple[float, float]:
    """Return what tells one straight line from another, whatever rounding makes of equal ones."""
    start, end = np.array(line.coords)
    return round(line.length, 6), round(abs(end[1] - start[1]) / line.length, 6)


def _divided(piece: Polygon, size: Size) -> list[Polygon]:
    """Divide a convex piece along its longest side, and each part across where it is too wide."""
    ring = rings(piece)[0]
    sides = [LineString(pair) for pair in zip(ring, np.roll(ring, -1, axis=0), strict=True)]
    longest = max(sides, key=_length_and_slope)
    x, y = np.diff(longest.coords, axis=0)[0] / longest.length
    turn = np.array([[x, -y], [y, x]])  # times it: to the frame of the longest side
    local = ring @ turn

    def back(points: Array) -> Array:
        return points @ turn.T

    (low_u, low_v), (high_u, high_v) = local.min(axis=0), local.max(axis=0)
    at = np.linspace(low_u, high_u, _SAMPLES)
    middle = back(np.stack([at, np.full(_SAMPLES, (low_v + high_v) / 2)], axis=1))
    boxes = []
    for left, right in pairwise(divided(at, size(middle))):
        bounds = _between(local, left, right)
        centre = back(np.array([[(left + right) / 2, np.mean(bounds)]]))
        count = max(1, int(np.ceil((bounds[1] - bounds[0]) / size(centre)[0] - 1e-6)))
        across = np.linspace(*bounds, count + 1)
        boxes += [(left, low, right, high) for low, high in pairwise(across)]
    if len(boxes) == 1:
        return [piece]
    cells = shapely.intersection(shapely.box(*np.array(boxes).T), Polygon(local))
    pieces = [part for cell in cells for part in parts(cell)]
    return [
        shapely.transform(part, back) for part in pieces if part.area > _NARROWEST * part.length
    ]


def _between(ring: Array, left: float, right: float) -> tuple[float, float]:
    """Return the least and the greatest ordinate of a convex ring between two abscissas."""
    start, end = ring, np.roll(ring, -1, axis=0)
    ordinates = [ring[(ring[:, 0] >= left) & (ring[:, 0] <= right), 1]]
    for at in (left, right):
        crossing = (start[:, 0] - at) * (end[:, 0] - at) < 0
        share = (at - start[crossing, 0]) / (end[crossing, 0] - start[crossing, 0])
        ordinates.append(start[crossing, 1] + share * (end[crossing, 1] - start[crossing, 1]))
    values = np.concatenate(ordinates)
    return float(values.min()), float(values.max())


def _quadrilaterals(cell: Polygon) -> list[Array]:
    """Return the corners (4, 2) of quadrilaterals and triangles that make up a cell."""
    cell = cell.simplify(10 * GRID)
    ring = rings(cell)[0]
    ring = ring[np.abs(turns(ring)) > _IN_LINE]
    if len(ring) < 3:
        return []
    if (turns(ring) < 0).any() or cell.interiors:
        triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(cell))
        return [np.array(triangle.exterior.coords)[[0, 1, 2, 2]] for triangle in triangles]
    return [
        ring[[0, first, first + 1, min(first + 2, len(ring) - 1)]]
        for first in range(1, len(ring) - 1, 2)
    ]
