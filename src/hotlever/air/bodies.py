"""What stands beside a lever's plate in the air: the chip that holds it, and its tip.

The chip body is a block behind the base line, on which the leg ends of supply and ground lie. Its
lower face continues the lever's lower face and it rises above it, as where a lever is etched from
the device layer and the tip points away from the chip. Its faces reach `REACH` lever lengths to
all sides.

The tip is a cone with a flat end. Its panels belong to the places of the lever above them. What a
panel gives to the air comes from there along the cone, in one dimension: its θ is lower than the
lever's by the resistance of the way that its heat has in common with that of every other panel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hotlever.air.panels import Panels, divided
from hotlever.errors import InputError
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.probe.layout import Layout
from hotlever.probe.tip import Tip
from hotlever.types import Array

#: Extent of the chip in lever lengths; four times as much changes the loss by less than 2e-4.
REACH = 8.0


# --- the chip -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class BaseLine:
    """The line on which the leg ends of supply and ground lie.

    Attributes
    ----------
    origin : ndarray, shape (2,)
        A point on it (µm).
    axes : ndarray, shape (2, 2)
        Unit vectors: normal to it, towards the lever, which is the lever's direction; and on it,
        to the left of that.
    """

    origin: Array
    axes: Array

    @classmethod
    def of(cls, layout: Layout, needed_by: str) -> BaseLine:
        """Find the base line of a lever.

        Parameters
        ----------
        layout : Layout
        needed_by : str
            Names in an error what asks for it.

        Raises
        ------
        InputError
            If leg ends are not on one line, or the lever is on both sides of it.
        """
        ends = [terminal for terminal in layout.terminals if terminal.name in ("supply", "ground")]
        points = np.array([point for terminal in ends for point in (terminal.start, terminal.end)])
        origin = points[0]
        away = np.linalg.norm(points - origin, axis=1)
        x, y = (points[away.argmax()] - origin) / away.max()
        along = np.array([y, -x])
        if (np.array(layout.tip) - origin) @ along < 0:
            along = -along
        line = cls(origin, np.array([along, [-along[1], along[0]]]))
        off = np.abs(line.seen(points)[:, 0])
        off_line = 0.02  # µm, more than drawings are rounded by
        if off.max() > off_line:
            x, y = points[off.argmax()]
            raise InputError(
                f"surroundings: {needed_by} takes leg ends of supply and ground on one line; "
                f"({x:.6g}, {y:.6g}) µm is {off.max():.3g} µm off it"
            )
        corners = layout.corners
        behind = line.seen(corners)[:, 0]
        if behind.min() < -off_line:
            x, y = corners[behind.argmin()]
            raise InputError(
                f"surroundings: {needed_by} takes a lever in front of the line of its leg ends; "
                f"({x:.6g}, {y:.6g}) µm is {-behind.min():.3g} µm behind it"
            )
        return line

    def seen(self, points: Array) -> Array:
        """Return points (n, 2) by their distances along the lever and across it (µm)."""
        return (points - self.origin) @ self.axes.T

    def placed(self, corners: Array) -> Array:
        """Return points (..., 3), given along, across and up, in space."""
        along, across = self.axes
        level = corners[..., :1] * along + corners[..., 1:2] * across + self.origin
        return np.concatenate([level, corners[..., 2:]], axis=-1)


def lever_axes(layout: Layout) -> Array:
    """Return unit vectors along a lever and across it, (2, 2); x and y where that means nothing."""
    try:
        return BaseLine.of(layout, "the direction of the lever").axes
    except InputError:
        return np.eye(2)


def chip_panels(layout: Layout, refinement: float = 1.0) -> Panels:
    """Return the front and the lower face of the chip body.

    Raises
    ------
    InputError
        If leg ends are not on one line, or the lever is on both sides of it.
    """
    line = BaseLine.of(layout, "the chip")
    seen = line.seen(layout.corners)
    low, high = float(seen[:, 1].min()), float(seen[:, 1].max())
    half, reach = layout.thickness_um / 2, REACH * float(seen[:, 0].max())
    # panels are smallest at the lever's root, as a share of its width
    smallest = 0.1 * (high - low) / refinement

    def breaks(start: float, stop: float, near: tuple[float, float]) -> Array:
        at = np.linspace(start, stop, 20001)
        away = np.abs(at - at.clip(*near))
        return divided(at, smallest + 0.5 / refinement * away)

    across = breaks(low - reach, high + reach, (low, high))
    up = breaks(half, half + reach, (half, half))
    behind = breaks(-reach, 0.0, (0.0, 0.0))
    faces = [_grid(0, 0.0, across, up), _grid(2, -half, behind, across)]
    return Panels(line.placed(np.concatenate(faces)))


def _grid(axis: int, at: float, u: Array, v: Array) -> Array:
    """Return the corners (cells, 4, 3) of all cells between two sets of lines in a plane.

    The plane is normal to a coordinate axis and stands at a place on it.
    """
    corners_u = np.stack([u[:-1], u[1:], u[1:], u[:-1]], axis=1)[:, None]
    corners_v = np.stack([v[:-1], v[:-1], v[1:], v[1:]], axis=1)
    cells = np.stack(np.broadcast_arrays(corners_u, corners_v), axis=-1).reshape(-1, 4, 2)
    return np.insert(cells, axis, at, axis=2)


# --- the tip --------------------------------------------------------------------------------------


def cone_panels(cone: Tip, refinement: float = 1.0) -> Panels:
    """Return panels on the side of a cone and on its flat end.

    Its axis is that of z, and it points down from z = 0. The base, where it meets the lever, is
    no surface.

    Parameters
    ----------
    cone : Tip
    refinement : float
        Divides all sizes.
    """
    base, apex, fine = cone.base_radius_um, cone.apex_radius_um, 1.0 / refinement
    length = math.hypot(cone.height_um, base - apex)
    # panels are half as large as the radius at the ends of the side and at the rim of the flat end,
    # and grow with the distance from these
    side = _breaks(length, fine * 0.5 * base, fine * 0.5 * apex, fine * 0.5)
    end = _breaks(apex, fine * 0.5 * apex, apex, fine * 0.5)[1:]
    radius = np.append(base + side * (apex - base), apex * (1.0 - end))
    depth = np.append(side, np.ones(end.size)) * cone.height_um
    return revolved(np.stack([radius, -depth], axis=1), round(12 * refinement))


def _breaks(length: float, first: float, last: float, growth: float) -> Array:
    """Return where panels on a line meet, from 0 to 1, of their sizes (µm) at its ends."""
    # sizes differ by orders of magnitude: they are read at distances that do so too
    away = np.append(0.0, np.geomspace(0.01 * min(first, last, length), length / 2, 400))
    along = np.concatenate([away, length - away[-2::-1]])
    size = np.minimum(first + growth * along, last + growth * (length - along))
    return divided(along / length, size / length)


def revolved(profile: Array, around: int) -> Panels:
    """Return panels on a surface of revolution about the axis of z.

    Parameters
    ----------
    profile : ndarray, shape (k, 2)
        Radius and height (µm) at which rings of panels meet, from one end to the other.
    around : int
        Panels in a ring: a polygon of the area of the circle.
    """
    angle = 2.0 * np.pi * np.arange(around + 1) / around
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1) / np.sqrt(np.sinc(2.0 / around))
    lines = np.empty((len(profile), around + 1, 3))
    lines[..., :2] = profile[:, 0, None, None] * circle
    lines[..., 2] = profile[:, 1, None]
    # of a triangle the last two corners are the same: those on the axis
    from_axis = (profile[:-1, 0] == 0)[:, None, None]
    first = np.where(from_axis, lines[1:], lines[:-1])
    last = np.where(from_axis, lines[:-1], lines[1:])
    corners = np.stack([first[:, :-1], first[:, 1:], last[:, 1:], last[:, :-1]], axis=2)
    return Panels(corners.reshape(-1, 4, 3))


def conduction(cone: Tip, panels: Panels, at_K: float = 900.0) -> Array:
    """Return by how much θ on `panels` is below that of the lever, per heat from each.

    Between the base and a depth z, where the radius is r, a cone of base radius r₀ has the
    resistance z / (π κ r₀ r).

    Parameters
    ----------
    cone : Tip
    panels : Panels, n
        Of `cone_panels`.
    at_K : float
        Temperature at which tip and air are taken to conduct: a hot tip's, where it matters most.

    Returns
    -------
    ndarray, shape (n, n)
        1/µm, symmetric and positive semi-definite.
    """
    depth, base = -panels.centres[:, 2], cone.base_radius_um
    to_panel = depth / (np.pi * base * (base - depth * cone.slope))
    of_air, _ = thermal_conductivity_of_air(at_K)
    # what two panels have in common is the way to the nearer one
    return np.asarray(of_air / cone.kappa * np.minimum.outer(to_panel, to_panel))
