"""The surface of a lever as panels.

The lever is a plate of its true thickness and of any outline, with top, bottom and side faces. The
flux into air is singular at the edges and its source is the heater, so panels are small at both.
The leg ends are at base temperature and have no panels; borders between regions are no edges.
A tip that stands in the air (`hotlever.air.bodies`) has panels of its own. Those of the lever go on
below it: between two bodies of one temperature nothing flows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, MultiLineString, Polygon

from hotlever.air.bodies import conduction, cone_panels
from hotlever.air.panelling import GRID, panelled, parts, rings, turns
from hotlever.air.panels import Panels, divided
from hotlever.probe.layout import Layout
from hotlever.types import Array, Index

#: Largest panels, as a share of the lever's length, and growth of the size with the distance from
#: edges, and from the heater.
_LARGEST, _GROWTH, _FROM_HEATER = 0.025, 1.2, 0.4
#: Sizes of panels: at an edge of the lever, as a share of its thickness; in the heater, as a share
#: of its narrow side; and on the lever where a tip stands, as a share of the radius of its base.
EDGE, HEATER, TIP = 0.15, 0.3, 0.4
#: Share of the size at an edge by which a panel may be off a curve that is made of short lines.
_OFF_CURVE = 0.1
#: Panels are small at corners of the outline that turn by more (rad).
_SHARP = 0.4
#: How far off (µm) a line is still on another; where regions touch coordinates are rounded to less.
_ON_LINE = 1e-5
#: Shorter edges (µm) beside a terminal are left out.
_SHORTEST = 1e-3


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
        self._growth, self._from_fine = fine * _GROWTH, fine * _FROM_HEATER
        self._edge = fine * EDGE * layout.thickness_um
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
        self._exact = shapely.union_all(list(shapes.values()), grid_size=GRID)
        simplified = parts(self._exact.simplify(_OFF_CURVE * self._edge))
        self._shape = max(simplified, key=lambda part: part.area)
        around = np.array(shapely.minimum_rotated_rectangle(self._shape).exterior.coords)
        length = np.linalg.norm(np.diff(around, axis=0), axis=1).max()
        self._largest = fine * _LARGEST * float(length)
        self._fine = [
            (shape, fine * HEATER * region.narrow_um)
            for region, shape in shapes.items()
            if region.part == "heater"
        ]
        if (cone := layout.cone_in_air) is not None:
            base = shapely.Point(self.tip).buffer(cone.base_radius_um)
            self._fine.append((base, fine * TIP * cone.base_radius_um))
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
        off = _ON_LINE + shapely.hausdorff_distance(self._shape, self._exact)
        held = shapely.union_all(ends).buffer(off, cap_style="flat")
        edges, corners = [], []
        for ring in rings(self._shape):
            free = [
                [line for line in parts(LineString(pair).difference(held), "LineString")
                 if line.length > _SHORTEST]
                for pair in zip(ring, np.roll(ring, -1, axis=0), strict=True)
            ]  # fmt: skip
            edges += [np.array(line.coords) for some in free for line in some]
            exposed = np.array([bool(some) for some in free])
            corners.append(ring[(np.abs(turns(ring)) > _SHARP) & exposed & np.roll(exposed, 1)])
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
