"""The chip that holds a lever, and the direction in which the lever leaves it.

The chip body is a block behind the base line, on which the leg ends of supply and ground lie. Its
lower face continues the lever's lower face and it rises above it, as where a lever is etched from
the device layer and the tip points away from the chip. Its faces reach `REACH` lever lengths to
all sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hotlever.air.panels import Panels
from hotlever.errors import InputError
from hotlever.probe.layout import Layout
from hotlever.types import Array

#: Extent of the chip in lever lengths; four times as much changes the loss by less than 2e-4.
REACH = 8.0
#: Panels of the chip at the lever's root, as a share of its width, and their growth with distance.
_ROOT, _ROOT_GROWTH = 0.1, 0.5
#: How far (µm) leg ends may be off one line: more than drawings are rounded by.
_OFF_LINE = 0.02


@dataclass(frozen=True)
class BaseLine:
    """The line on which the leg ends of supply and ground lie.

    Attributes
    ----------
    origin : ndarray, shape (2,)
        A point on it (µm).
    along : ndarray, shape (2,)
        Unit vector normal to it, towards the lever: the lever's direction.
    across : ndarray, shape (2,)
        Unit vector on it, to the left of `along`.
    """

    origin: Array
    along: Array
    across: Array

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
        line = cls(origin, along, np.array([-along[1], along[0]]))
        off = np.abs(line.seen(points)[:, 0])
        if off.max() > _OFF_LINE:
            x, y = points[off.argmax()]
            raise InputError(
                f"surroundings: {needed_by} takes leg ends of supply and ground on one line; "
                f"({x:.6g}, {y:.6g}) µm is {off.max():.3g} µm off it"
            )
        corners = layout.corners
        behind = line.seen(corners)[:, 0]
        if behind.min() < -_OFF_LINE:
            x, y = corners[behind.argmin()]
            raise InputError(
                f"surroundings: {needed_by} takes a lever in front of the line of its leg ends; "
                f"({x:.6g}, {y:.6g}) µm is {-behind.min():.3g} µm behind it"
            )
        return line

    def seen(self, points: Array) -> Array:
        """Return points (n, 2) by their distances along the lever and across it (µm)."""
        return (points - self.origin) @ np.stack([self.along, self.across], axis=1)

    def placed(self, corners: Array) -> Array:
        """Return points (..., 3), given along, across and up, in space."""
        level = corners[..., :1] * self.along + corners[..., 1:2] * self.across + self.origin
        return np.concatenate([level, corners[..., 2:]], axis=-1)


def lever_axes(layout: Layout) -> Array:
    """Return unit vectors along a lever and across it, (2, 2); x and y where that means nothing."""
    try:
        line = BaseLine.of(layout, "the direction of the lever")
    except InputError:
        return np.eye(2)
    return np.stack([line.along, line.across])


def chip_panels(layout: Layout, refinement: float = 1.0) -> Panels:
    """Return the front and the lower face of the chip body.

    Raises
    ------
    InputError
        If leg ends are not on one line, or the lever is on both sides of it.
    """
    from hotlever.air.panelling import divided  # loads Shapely; see `PanelledAir`

    line = BaseLine.of(layout, "the chip")
    seen = line.seen(layout.corners)
    low, high = float(seen[:, 1].min()), float(seen[:, 1].max())
    half, reach = layout.thickness_um / 2, REACH * float(seen[:, 0].max())
    smallest = _ROOT * (high - low) / refinement

    def breaks(start: float, stop: float, near: tuple[float, float]) -> Array:
        at = np.linspace(start, stop, 20001)
        away = np.abs(at - at.clip(*near))
        return divided(at, smallest + _ROOT_GROWTH / refinement * away)

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
