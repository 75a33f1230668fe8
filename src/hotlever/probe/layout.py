"""A probe's layout: named regions, terminals and the tip, all in the plane of the lever.

A parametric shape (`hotlever.probe.shapes`) or a drawing makes a `Layout`; meshing,
drawing and solving know only this. Lengths are in µm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import InputError
from hotlever.materials import HIGH_DOPED
from hotlever.probe.circuit import Wiring
from hotlever.probe.tip import Tip
from hotlever.types import Array

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Point = tuple[float, float]

# What a region is to the measuring circuit: R_h, R_l1, R_l2 of the paper's Fig. 1(c), or what
# carries no current: the reader branch, and all that insulates.
Part = Literal["heater", "leg 1", "leg 2", "reader branch"]


@dataclass(frozen=True)
class Taper:
    """How the doping of a low-doped strip between two parallel straight borders is tapered.

    From its `centre` along the current, `axis` (a unit vector), over the geometrical length l_h.
    """

    centre: Point
    axis: Point
    length_um: float

    def shifted(self, outward_um: float) -> Taper:
        """Return it with both borders so far outside (µm)."""
        return replace(self, length_um=self.length_um + 2 * outward_um)

    def distances(self, points: Array) -> Array:
        """Return how far points (2, n) are from the lines of both borders (µm), shape (2, n)."""
        along = np.tensordot(self.axis, points - np.reshape(self.centre, (2, 1)), axes=1)
        return np.stack([self.length_um / 2 - along, self.length_um / 2 + along])


@dataclass(frozen=True)
class BorderTaper:
    """How the doping of a low-doped region of any outline is tapered: from its borders.

    Each of the `borders` with high-doped silicon is a line through its points; those that touch
    are one. All may lie some way outside of the lines (µm).
    """

    borders: tuple[tuple[Point, ...], ...]
    outward_um: float = 0.0

    def shifted(self, outward_um: float) -> BorderTaper:
        """Return it with all borders so far outside (µm)."""
        return replace(self, outward_um=self.outward_um + outward_um)

    def distances(self, points: Array) -> Array:
        """Return how far points (2, n) are from each border (µm), shape (borders, n)."""
        away = np.stack([_distance(points, np.array(border)) for border in self.borders])
        return away + self.outward_um


@dataclass(frozen=True)
class Film:
    """A film that lies on the body of a lever, or the body itself.

    Attributes
    ----------
    material : str
        By its name in the probe.
    thickness_um : float or None
        None of the body, whose thickness is that of the layout, and of the tip's cone.
    """

    material: str
    thickness_um: float | None = None


@dataclass(frozen=True)
class Region:
    """A polygon, with holes or without, of one stack of materials.

    The outline runs counter-clockwise, holes clockwise.

    Attributes
    ----------
    taper : Taper or BorderTaper, optional
        Where the doping is low and tapered.
    material : str
        Of the body, by its name in the probe.
    dopant_from : str
        The material beside it from which dopant diffuses into it, where there is a taper.
    films : tuple of Film
        What lies on the body.
    insulates : bool
        Whether nothing in the stack carries a current.
    layers : tuple of str
        Of a drawing, those that it has.
    """

    name: str
    part: Part
    outline: tuple[Point, ...]
    taper: Taper | BorderTaper | None = None
    holes: tuple[tuple[Point, ...], ...] = ()
    material: str = HIGH_DOPED
    dopant_from: str = HIGH_DOPED
    films: tuple[Film, ...] = ()
    insulates: bool = False
    layers: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """What it may be called: its name, its part, its layers and its materials."""
        materials = (film.material for film in self.stack)
        return tuple(dict.fromkeys((self.name, self.part, *self.layers, *materials)))

    @property
    def stack(self) -> tuple[Film, ...]:
        """What it is made of, the body first."""
        return (Film(self.material), *self.films)

    @property
    def rings(self) -> tuple[tuple[Point, ...], ...]:
        """The outline and the holes."""
        return (self.outline, *self.holes)

    @property
    def polygon(self) -> Polygon:
        """It as a polygon of shapely."""
        from shapely import Polygon  # not every process has a use for it

        return Polygon(self.outline, self.holes)

    @property
    def edges(self) -> Array:
        """Both ends of every edge of outline and holes, shape (edges, 2, 2)."""
        rings = [np.array(ring) for ring in self.rings]
        return np.concatenate([np.stack([ring, np.roll(ring, -1, 0)], axis=1) for ring in rings])

    @property
    def area(self) -> float:
        """µm²."""
        outline, *holes = (ring_area(np.array(ring)) for ring in self.rings)
        return outline - sum(holes)

    @property
    def box(self) -> Array:
        """Least and largest corner, shape (2, 2)."""
        outline = np.array(self.outline)
        return np.stack([outline.min(axis=0), outline.max(axis=0)])

    @property
    def sides(self) -> Array:
        """Short and long side of the smallest rectangle along one of its edges, shape (2,)."""
        outline = np.array(self.outline)
        along = np.roll(outline, -1, axis=0) - outline
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        extents = np.ptp(np.stack([outline @ along.T, outline @ across.T]), axis=1)
        return np.sort(extents[:, extents.prod(axis=0).argmin()])

    @property
    def narrow_um(self) -> float:
        """How wide it is where it is a strip, straight or bent.

        The short side of the rectangle of the same area and the same circumference.
        """
        short, long = self.sides.tolist()
        if self.area > (1 - 1e-9) * short * long:
            return short
        half = np.linalg.norm(np.diff(self.edges, axis=1), axis=2).sum() / 2
        return min(short, 2 * self.area / (half + math.sqrt(max(half**2 - 4 * self.area, 0.0))))


@dataclass(frozen=True)
class Terminal:
    """A straight edge held at the base temperature, where current may enter or leave.

    The names ``supply``, ``ground`` and ``reader`` have a meaning for the circuit. Edges of the
    same name are one contact.
    """

    name: str
    start: Point
    end: Point


@dataclass(frozen=True)
class Layout:
    """A lever seen from above.

    Attributes
    ----------
    regions : tuple of Region
        Polygons that tile the lever and share whole edges or parts of them.
    terminals : tuple of Terminal
        Among them ``supply`` and ``ground``; ``reader`` if the lever has one.
    tip : tuple of float
        Position of the tip (µm).
    thickness_um : float
        Thickness of the lever's body (µm), without films on it.
    cone : Tip, optional
        The tip's body; left out where it is not modelled.
    """

    regions: tuple[Region, ...]
    terminals: tuple[Terminal, ...]
    tip: Point
    thickness_um: float
    cone: Tip | None = None

    @property
    def materials(self) -> tuple[str, ...]:
        """The names of all materials, each once."""
        used = (film.material for region in self.regions for film in region.stack)
        return tuple(dict.fromkeys(used))

    @property
    def thickest_um(self) -> float:
        """Thickness where most lies on one another (µm), without the tip's cone."""
        return self.thickness_um + max(
            sum(film.thickness_um or 0.0 for film in region.films) for region in self.regions
        )

    def named(self, name: str) -> list[int]:
        """Return the numbers of the regions that may be called so."""
        return [index for index, region in enumerate(self.regions) if name in region.names]

    @property
    def cone_in_air(self) -> Tip | None:
        """The tip's body where the air is to see its surface."""
        return self.cone if self.cone is not None and self.cone.in_air else None

    @property
    def heater(self) -> Region:
        """The region that heats the tip; where there are several, the first."""
        return next(region for region in self.regions if region.part == "heater")

    @property
    def heater_taper(self) -> Taper:
        """Axis and length of the heater.

        Raises
        ------
        InputError
            If it is no strip.
        """
        taper = self.heater.taper
        if not isinstance(taper, Taper):
            raise InputError(
                "the heater is no strip between two parallel straight borders, expected one: its "
                "profile is along the strip"
            )
        return taper

    @property
    def box(self) -> Array:
        """Least and largest corner of the lever, shape (2, 2)."""
        boxes = np.array([region.box for region in self.regions])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    @property
    def outline(self) -> list[list[Point]]:
        """The outer rings, and those of the holes, of all regions together (µm)."""
        from shapely import get_parts

        parts = get_parts(self.polygon)
        rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
        return [list(ring.coords) for ring in rings]

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Return which of some points (µm), shape (n, 2), lie inside, and not on the edge."""
        from shapely import contains_xy

        return np.asarray(contains_xy(self.polygon, points))

    @property
    def polygon(self) -> Polygon | MultiPolygon:
        """All of it as a polygon of shapely, or several."""
        from shapely import union_all

        return union_all([region.polygon for region in self.regions])

    @property
    def terminal_names(self) -> tuple[str, ...]:
        """The names of the terminals, each once."""
        return tuple(dict.fromkeys(terminal.name for terminal in self.terminals))

    def heaters(self, wiring: Wiring | None) -> tuple[Region, ...]:
        """Return the regions that a current heats much: with other circuits not the heater only.

        Without a wiring that is as in the paper.
        """
        beside = wiring is not None and (wiring.held or len(wiring.grounds) > 1)
        return tuple(
            region
            for region in self.regions
            if region.part == "heater" or (beside and region.taper is not None)
        )

    @property
    def corners(self) -> Array:
        """Corners of the outlines of all regions (µm), shape (n, 2)."""
        return np.array([corner for region in self.regions for corner in region.outline])

    def reentrant_corners(self, least: float = 0.27) -> list[Point]:
        """Corners where lever or conductor spans more than 180°, at which fields are singular.

        Parameters
        ----------
        least : float
            Angle (rad) beyond 180° from which on a corner counts: of less, as where an arc is made
            of short edges, slopes of the fields grow with the distance r from it as r^−0.08 at
            most.
        """
        conducting = tuple(region for region in self.regions if not region.insulates)
        corners_of = [_reentrant(some, least) for some in dict.fromkeys((self.regions, conducting))]
        return list(dict.fromkeys(corner for corners in corners_of for corner in corners))


def _reentrant(regions: tuple[Region, ...], least: float) -> list[Point]:
    """Return the corners at which some regions together span more than 180° by an angle."""
    rings = [ring for region in regions for ring in region.rings]
    corners = np.unique(np.concatenate([np.array(ring) for ring in rings]).round(6), axis=0)
    angle = sum(_angles_at(corners, np.array(ring)) for ring in rings)
    reentrant = (angle > math.pi + least) & (angle < 2 * math.pi - 1e-6)
    return [(float(x), float(y)) for x, y in corners[reentrant]]


def rectangle(x0: float, y0: float, x1: float, y1: float) -> tuple[Point, ...]:
    """Outline of an axis-parallel rectangle, counter-clockwise from (x0, the lower y)."""
    y0, y1 = sorted((y0, y1))
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def ring_area(ring: Array) -> float:
    """Return the area that a ring of points (n, 2) encloses."""
    (x, y), (x1, y1) = ring.T, np.roll(ring, -1, axis=0).T
    return abs(float((x * y1 - x1 * y).sum())) / 2


def _distance(points: Array, line: Array) -> Array:
    """Return how far points (2, n) are from a line through some points (k, 2), shape (n,)."""
    away = []
    for start, end in pairwise(line):
        along, offset = end - start, points - start[:, None]
        share = np.clip(along @ offset / (along @ along), 0.0, 1.0)
        away.append(np.linalg.norm(offset - along[:, None] * share, axis=0))
    return np.asarray(np.min(away, axis=0))


def _angles_at(points: Array, ring: Array) -> Array:
    """Return the angles (rad) to the left of a ring at points (n, 2) on it, 0 elsewhere."""
    after = np.roll(ring, -1, axis=0) - ring
    before = np.roll(-after, 1, axis=0)
    to_left = np.arctan2(before[:, 1], before[:, 0]) - np.arctan2(after[:, 1], after[:, 0])
    offset = points[:, None] - ring
    at_corner = np.linalg.norm(offset, axis=2) < 1e-6
    length = np.linalg.norm(after, axis=1)
    # as much longer as the way over the point is than the edge
    detour = np.linalg.norm(offset, axis=2) + np.linalg.norm(offset - after, axis=2) - length
    on_edge = (detour < 1e-9) & ~at_corner & ~np.roll(at_corner, -1, axis=1)
    return np.asarray(
        (at_corner * (to_left % (2 * math.pi))).sum(axis=1) + math.pi * on_edge.sum(axis=1)
    )
