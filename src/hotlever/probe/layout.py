"""A probe's layout: named regions, terminals and the tip, all in the plane of the lever.

A parametric shape (`hotlever.probe.shapes`) or any other source makes a `Layout`; meshing,
drawing and solving know only this. Lengths are in µm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hotlever.probe.tip import Tip
from hotlever.types import Array

Point = tuple[float, float]

# What a region is to the measuring circuit: R_h, R_l1, R_l2 of the paper's Fig. 1(c), or
# the reader branch, which carries no current.
Part = Literal["heater", "leg 1", "leg 2", "reader branch"]


@dataclass(frozen=True)
class Taper:
    """Axis along which the doping of a low-doped region is tapered.

    From its `centre` along the current, `axis` (a unit vector), over the geometrical length l_h.
    """

    centre: Point
    axis: Point
    length_um: float


@dataclass(frozen=True)
class Region:
    """A polygon of one kind of silicon: high-doped, or low-doped with a taper."""

    name: str
    part: Part
    outline: tuple[Point, ...]
    taper: Taper | None = None

    @property
    def box(self) -> Array:
        """Least and largest corner, shape (2, 2)."""
        outline = np.array(self.outline)
        return np.stack([outline.min(axis=0), outline.max(axis=0)])

    @property
    def sides(self) -> Array:
        """Extent along x and y, shape (2,)."""
        low, high = self.box
        return np.asarray(high - low)


@dataclass(frozen=True)
class Terminal:
    """A straight edge held at the base temperature, where current may enter or leave.

    The names ``supply``, ``ground`` and ``reader`` have a meaning for the circuit.
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
        Thickness of the silicon (µm).
    cone : Tip, optional
        The tip's body; left out where it is not modelled.
    """

    regions: tuple[Region, ...]
    terminals: tuple[Terminal, ...]
    tip: Point
    thickness_um: float
    cone: Tip | None = None

    @property
    def heater(self) -> Region:
        """The region that heats the tip."""
        return next(region for region in self.regions if region.part == "heater")

    @property
    def heater_taper(self) -> Taper:
        """Axis and length of the heater."""
        taper = self.heater.taper
        if taper is None:
            raise ValueError("the heater of a layout must be low-doped, with a taper")
        return taper

    @property
    def box(self) -> Array:
        """Least and largest corner of the lever, shape (2, 2)."""
        boxes = np.array([region.box for region in self.regions])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    def reentrant_corners(self) -> list[Point]:
        """Corners where the silicon spans more than 180°, at which fields are singular."""
        corners = {(round(x, 6), round(y, 6)) for region in self.regions for x, y in region.outline}
        return sorted(
            corner
            for corner in corners
            if math.pi + 1e-6
            < sum(_angle_at(corner, region.outline) for region in self.regions)
            < 2 * math.pi - 1e-6
        )


def rectangle(x0: float, y0: float, x1: float, y1: float) -> tuple[Point, ...]:
    """Outline of an axis-parallel rectangle, counter-clockwise from (x0, the lower y)."""
    y0, y1 = sorted((y0, y1))
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def _angle_at(point: Point, outline: tuple[Point, ...]) -> float:
    """Angle (rad) that a counter-clockwise polygon spans at `point` on its outline, else 0."""
    for i, corner in enumerate(outline):
        before, after = outline[i - 1], outline[(i + 1) % len(outline)]
        if math.dist(point, corner) < 1e-6:
            inward = math.atan2(before[1] - corner[1], before[0] - corner[0])
            outward = math.atan2(after[1] - corner[1], after[0] - corner[0])
            return (inward - outward) % (2 * math.pi)
        along = math.dist(corner, point) + math.dist(point, after) - math.dist(corner, after)
        if abs(along) < 1e-9 and math.dist(point, after) > 1e-6:
            return math.pi
    return 0.0
