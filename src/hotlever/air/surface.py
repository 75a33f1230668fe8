"""The surface of a lever as panels.

The lever is a plate of its true thickness and of any outline, with top, bottom and side faces. The
flux into air is singular at the edges and its source is the heater, so panels are small at both.
The leg ends are at base temperature and have no panels; borders between regions are no edges.
A tip that stands in the air (`hotlever.air.bodies`) has panels of its own. Those of the lever go on
below it: between two bodies of one temperature nothing flows.

Its plane faces have strips along their edges, and pieces inside. Strips lie between curves at fixed
depths below the exposed edges. Cuts from corner to corner of these curves make faces of them, one
or two to an edge, and each face is divided along its longest side, and across where it is too wide.
Neighbours need not meet at corners: the flux on a panel is its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, MultiLineString, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from hotlever.air.bodies import conduction, cone_panels
from hotlever.air.panels import Panels, divided
from hotlever.probe.layout import Layout
from hotlever.types import Array, Index

#: Where lines cross, coordinates are rounded to this (µm).
_GRID = 1e-8
#: Narrower pieces (µm) are left out: they come of rounding.
_NARROWEST = 1e-5
#: A strip reaches so many times its depth into the corner between two edges, at most.
_MITRE = 10.0


@dataclass(frozen=True)
class LeverSurface:
    """Panels on the faces of a lever, and where on the lever each one is.

    Attributes
    ----------
    panels : Panels
        In space; the lever's mid-plane is z = 0.
    sites : ndarray, shape (n, 2)
        Places in the plane of the lever (µm); the temperature does not depend on z.
    site : ndarray of int, shape (len(panels),)
        The site of each panel.
    across : ndarray of int, shape (m, 2)
        Panels of both faces above each other; none where one face stands for both.
    through_tip : ndarray, shape (k, k)
        By how much θ is lower than at their sites on the last k panels, those of a tip, per heat
        from each of them (1/µm).
    """

    panels: Panels
    sites: Array
    site: Index
    across: Index
    through_tip: Array


def lever_surface(
    layout: Layout, refinement: float = 1.0, *, mirrored: bool = True
) -> LeverSurface:
    """Panel the surface of a lever.

    Parameters
    ----------
    layout : Layout
    refinement : float
        Divides all sizes of panels and their growth: 2 halves them.
    mirrored : bool
        Only above the mid-plane: enough where the surroundings are symmetric about it.
    """
    outline = _Outline(layout, refinement)
    half = layout.thickness_um / 2
    upright = outline.upright(half, mirrored)
    cells = outline.cells()
    corners = [np.insert(cells, 2, z, axis=2) for z in ([half] if mirrored else [half, -half])]
    corners += [_wall(line, upright) for line in outline.divided_edges()]
    across = np.arange(0 if mirrored else 2 * len(cells)).reshape(2, -1).T
    through_tip = np.empty((0, 0))
    if (cone := layout.cone_in_air) is not None:
        of_cone = cone_panels(cone, refinement)
        through_tip = conduction(cone, of_cone)
        corners.append(of_cone.corners + np.append(outline.tip, -half))
    panels = Panels(np.concatenate(corners))
    sites, site = np.unique(panels.centres[:, :2].round(9), axis=0, return_inverse=True)
    placed = panels.corners.copy()
    placed[..., :2] = outline.on_the_lever(panels.corners[..., :2])
    within = outline.on_the_lever(outline.moved_inside(sites))
    return LeverSurface(Panels(placed), within, site.ravel(), across, through_tip)


class _Outline:
    """The outline of a lever, and how large panels may be where.

    It is seen from its supply leg end, along which the first coordinate runs: so a lever has the
    same panels anywhere on a wafer and in any orientation.
    """

    def __init__(self, layout: Layout, refinement: float) -> None:
        fine = 1.0 / refinement
        # the size grows with the distance from edges, and from the heater
        self._growth, self._from_fine = fine * 1.2, fine * 0.4
        # panels at an edge are a share of the thickness, those in the heater of its narrow side,
        # and those where a tip stands of the radius of its base
        self._edge = fine * 0.15 * layout.thickness_um
        first = next(terminal for terminal in layout.terminals if terminal.name == "supply")
        self._origin = np.array(first.start)
        x, y = (self._origin - first.end) / np.linalg.norm(self._origin - first.end)
        self._axes = np.array([[x, y], [-y, x]])
        self.tip = self._seen(layout.tip)
        shapes = {
            region: Polygon(self._seen(region.outline), [self._seen(hole) for hole in region.holes])
            for region in layout.regions
        }
        #: As drawn, and with fewer corners where it is curved.
        self._exact = shapely.union_all(list(shapes.values()), grid_size=_GRID)
        # a panel may be off a curve that is made of short lines by a tenth of the size at an edge
        simplified = parts(self._exact.simplify(0.1 * self._edge))
        self._shape = max(simplified, key=lambda part: part.area)
        around = np.array(shapely.minimum_rotated_rectangle(self._shape).exterior.coords)
        length = np.linalg.norm(np.diff(around, axis=0), axis=1).max()
        # largest panels, as a share of the lever's length
        self._largest = fine * 0.025 * float(length)
        self._fine = [
            (shape, fine * 0.3 * region.narrow_um)
            for region, shape in shapes.items()
            if region.part == "heater"
        ]
        if (cone := layout.cone_in_air) is not None:
            base = shapely.Point(self.tip).buffer(cone.base_radius_um)
            self._fine.append((base, fine * 0.4 * cone.base_radius_um))
        self._edges, self._corners = self._exposed(layout)

    def _seen(self, points: object) -> Array:
        return (np.asarray(points) - self._origin) @ self._axes.T

    def on_the_lever(self, points: Array) -> Array:
        """Return points (..., 2) of the outline in the coordinates of the layout."""
        return points @ self._axes + self._origin

    def _exposed(self, layout: Layout) -> tuple[list[Array], Array]:
        """Return the edges that no terminal holds, and the sharp corners between two of them."""
        ends = [
            LineString(self._seen([terminal.start, terminal.end])) for terminal in layout.terminals
        ]
        # coordinates are rounded to less
        off = 1e-5 + shapely.hausdorff_distance(self._shape, self._exact)
        held = shapely.union_all(ends).buffer(off, cap_style="flat")
        edges, corners = [], []
        for ring in rings(self._shape):
            free = [
                [line for line in parts(LineString(pair).difference(held), "LineString")
                 if line.length > 1e-3]
                for pair in zip(ring, np.roll(ring, -1, axis=0), strict=True)
            ]  # fmt: skip
            edges += [np.array(line.coords) for some in free for line in some]
            exposed = np.array([bool(some) for some in free])
            # panels are small at corners of the outline that turn by more
            corners.append(ring[(np.abs(turns(ring)) > 0.4) & exposed & np.roll(exposed, 1)])
        return edges, np.concatenate(corners)

    def size(self, places: Array) -> Array:
        """Return the largest edge (µm) that a panel may have at some places (n, 2)."""
        size = np.full(len(places), self._largest)
        points = shapely.points(places)
        for shape, smallest in self._fine:
            size = np.minimum(size, smallest + self._from_fine * shapely.distance(points, shape))
        if len(self._corners):
            away = np.linalg.norm(places[:, None] - self._corners, axis=2).min(axis=1)
            size = np.minimum(size, self._edge + self._growth * away)
        return size

    def cells(self) -> Array:
        """Return panels (n, 4, 2) on a face."""
        # one panel between two depths, until panels are as large as anywhere
        most = np.log(max(2.0, 2.0 * self._largest / self._edge)) / self._growth
        depths = self._edge / self._growth * np.expm1(self._growth * np.arange(1.0, most + 1.0))
        exposed = shapely.line_merge(MultiLineString([edge.tolist() for edge in self._edges]))
        return panelled(self._shape, exposed, depths, self.size)

    def divided_edges(self) -> list[Array]:
        """Return the breaks (k, 2) between panels along every exposed edge."""
        lines = []
        for start, end in self._edges:
            share = np.linspace(0.0, 1.0, 513)
            length = np.linalg.norm(end - start)
            size = self.size(start + share[:, None] * (end - start))
            breaks = divided(share, size / length)
            lines.append(start + breaks[:, None] * (end - start))
        return lines

    def moved_inside(self, places: Array) -> Array:
        """Return places (n, 2), those beyond a curve moved onto it."""
        points = shapely.points(places)
        outside = shapely.distance(points, self._exact) > 0
        nearest = shapely.shortest_line(self._exact, points[outside])
        places_inside = places.copy()
        places_inside[outside] = shapely.get_coordinates(shapely.get_point(nearest, 0))
        return places_inside

    def upright(self, half: float, mirrored: bool) -> Array:
        """Divide a side face from bottom (or the mid-plane) to top."""
        at = np.linspace(0.0 if mirrored else -half, half, 401)
        return divided(at, self._edge + self._growth * (half - np.abs(at)))


def _wall(line: Array, heights: Array) -> Array:
    """Return the corners (cells, 4, 3) of upright panels over a divided line (k, 2)."""
    ends = np.stack([line[:-1], line[1:], line[1:], line[:-1]], axis=1)[:, None]
    up = np.stack([heights[:-1], heights[:-1], heights[1:], heights[1:]], axis=1)[..., None]
    shape = (len(line) - 1, len(heights) - 1, 4)
    level, upwards = np.broadcast_to(ends, (*shape, 2)), np.broadcast_to(up, (*shape, 1))
    return np.concatenate([level, upwards], axis=-1).reshape(-1, 4, 3)


# --- plane outlines of any shape -----------------------------------------------------------------


def panelled(
    shape: Polygon, exposed: BaseGeometry, depths: Array, size: Callable[[Array], Array]
) -> Array:
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
    cells = [
        cell
        for face in _faces(shape, exposed, depths)
        for piece in _convex(face)
        for cell in _divided(piece, size)
    ]
    corners = _quadrilaterals(np.array(cells))
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
    """Return by how much (rad) rings (..., n, 2) turn to the left at each of their corners."""
    after = np.roll(ring, -1, axis=-2) - ring
    before = np.roll(after, 1, axis=-2)
    crossed = before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]
    return np.asarray(np.arctan2(crossed, (before * after).sum(axis=-1)))


def _faces(shape: Polygon, exposed: BaseGeometry, depths: Array) -> list[Polygon]:
    """Return what curves at some depths, and cuts between their corners, make of a polygon."""
    lines = [shape.boundary]
    inner: BaseGeometry = shape
    above = 0.0
    for depth in depths:
        rim = exposed.buffer(depth, cap_style="square", join_style="mitre", mitre_limit=_MITRE)
        layer, inner = inner, shape.difference(rim, grid_size=_GRID)
        # strips have the corners of the outline; what is inside the last needs fewer
        last = depth == depths[-1]
        inner = inner.simplify(0.05 * (depth - above) if last else 10 * _GRID)
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
        # a cut goes on a little farther than to the other side, for rounding
        ends.append(ring + step * both * reach[:, None] * (1.0 + 1e-6))
    pairs = np.stack([np.concatenate(starts), np.concatenate(ends)], axis=1)
    # on the edge of the shape a curve ends
    pairs = pairs[shapely.distance(shapely.points(pairs[:, 0]), shape.boundary) > 10 * _GRID]
    clipped = shapely.intersection(shapely.linestrings(pairs), layer.difference(inner))
    # what lies beyond the curve above belongs to another corner
    return [
        part
        for line, corner in zip(clipped, shapely.points(pairs[:, 0]), strict=True)
        for part in parts(line, "LineString")
        if part.distance(corner) < 10 * _GRID
    ]


def _cut_by(shape: Polygon, lines: list[LineString]) -> list[Polygon]:
    """Return the faces that lines make of a polygon, without what comes of rounding."""
    noded = shapely.union_all(lines, grid_size=_GRID)
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
        # an outline that turns by less is as good as straight, or by less than 0.5 part of a curve
        for number in np.flatnonzero(turned < -0.05):
            ways = [before[number], -along[number]]
            if turned[number] > -0.5:
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


def _divided(piece: Polygon, size: Callable[[Array], Array]) -> list[Polygon]:
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
    count = 129
    at = np.linspace(low_u, high_u, count)
    middle = back(np.stack([at, np.full(count, (low_v + high_v) / 2)], axis=1))
    breaks = divided(at, size(middle))
    low, high = _between(local, breaks)
    centres = back(np.stack([(breaks[:-1] + breaks[1:]) / 2, (low + high) / 2], axis=1))
    counts = np.maximum(1, np.ceil((high - low) / size(centres) - 1e-6)).astype(int)
    boxes = [
        (left, start, right, stop)
        for (left, right), *ends in zip(pairwise(breaks), low, high, counts + 1, strict=True)
        for start, stop in pairwise(np.linspace(*ends))
    ]
    if len(boxes) == 1:
        return [piece]
    cells = shapely.intersection(shapely.box(*np.array(boxes).T), Polygon(local))
    # of collections the parts' parts
    pieces = shapely.get_parts(shapely.get_parts(cells))
    pieces = pieces[shapely.get_type_id(pieces) == shapely.GeometryType.POLYGON]
    pieces = pieces[shapely.area(pieces) > _NARROWEST * shapely.length(pieces)]
    return list(shapely.transform(pieces, back))


def _between(ring: Array, breaks: Array) -> tuple[Array, Array]:
    """Return the least and the greatest ordinates of a convex ring from each break to the next."""
    start, end = (each[:, :, None] for each in (ring, np.roll(ring, -1, axis=0)))
    along = (breaks - start[:, 0]) / np.where(end == start, np.inf, end - start)[:, 0]
    crossing = (start[:, 0] - breaks) * (end[:, 0] - breaks) < 0
    at_breaks = start[:, 1] + along * (end - start)[:, 1]
    inside = (start[:, 0] >= breaks[:-1]) & (start[:, 0] <= breaks[1:])
    ends = []
    for which, none in ((np.min, np.inf), (np.max, -np.inf)):
        lines = which(np.where(crossing, at_breaks, none), axis=0)
        corners = which(np.where(inside, start[:, 1], none), axis=0)
        ends.append(which([lines[:-1], lines[1:], corners], axis=0))
    low, high = ends
    return low, high


def _quadrilaterals(cells: NDArray[np.object_]) -> Array:
    """Return the corners (n, 4, 2) of quadrilaterals and triangles that make up cells."""
    cells = shapely.simplify(cells, 10 * _GRID)
    four = np.flatnonzero(
        (shapely.get_num_coordinates(cells) == 5) & (shapely.get_num_interior_rings(cells) == 0)
    )
    around = shapely.get_coordinates(cells[four]).reshape(-1, 5, 2)[:, :4]
    turned = turns(around)
    around = np.where((turned.sum(axis=1) < 0)[:, None, None], around[:, [0, 3, 2, 1]], around)
    # nearly all are such that nothing needs to be cut
    convex = (np.abs(turned) > 1e-6).all(axis=1) & (np.ptp(np.sign(turned), axis=1) == 0)
    whole = dict(zip(four[convex].tolist(), around[convex], strict=True))
    every = (
        [whole[number]] if number in whole else _cut_into_quadrilaterals(cell)
        for number, cell in enumerate(cells)
    )
    return np.array([corners for some in every for corners in some]).reshape(-1, 4, 2)


def _cut_into_quadrilaterals(cell: Polygon) -> list[Array]:
    """Return the corners (4, 2) of quadrilaterals and triangles that make up a cell."""
    ring = rings(cell)[0]
    # a corner that turns by less is none
    ring = ring[np.abs(turns(ring)) > 1e-6]
    if len(ring) < 3:
        return []
    if (turns(ring) < 0).any() or cell.interiors:
        triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(cell))
        return [np.array(triangle.exterior.coords)[[0, 1, 2, 2]] for triangle in triangles]
    return [
        ring[[0, first, first + 1, min(first + 2, len(ring) - 1)]]
        for first in range(1, len(ring) - 1, 2)
    ]
