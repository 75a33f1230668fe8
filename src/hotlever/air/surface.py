"""The surfaces of a lever and of the chip that holds it, as panels.

The lever is a plate of its true thickness with top, bottom and side faces. The flux into air is
singular at the edges and its source is the heater, so panels are small at both. The leg ends are
at base temperature and have no panels.

The chip body is a block behind x = 0 whose lower face continues the lever's lower face and which
rises above it, as where a lever is etched from the device layer and the tip points away from the
chip. Its faces reach `REACH` lever lengths to all sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.integrate import cumulative_trapezoid

from hotlever.air.panels import Panels
from hotlever.errors import InputError
from hotlever.probe.layout import Layout, Region
from hotlever.types import Array, Index

#: Extent of the chip in lever lengths; four times as much changes the loss by less than 2e-4.
REACH = 8.0
#: Largest panels, as a share of the lever's length, and growth of the size with the distance from
#: edges and from the heater.
_LARGEST, _GROWTH = 0.03, 1.2
#: Panels of the chip at the lever's root, as a share of its width, and their growth with distance.
_ROOT, _ROOT_GROWTH = 0.1, 0.5
_ON_LINE = 1e-6  # µm


@dataclass(frozen=True)
class PanelOptions:
    """Sizes of the panels.

    Attributes
    ----------
    refinement : float
        Divides all sizes and their growth: 2 halves them.
    edge : float
        At an edge of the lever, as a share of its thickness.
    heater : float
        In the heater, as a share of its narrow side.
    """

    refinement: float = 1.0
    edge: float = 0.15
    heater: float = 0.3


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
    """

    panels: Panels
    sites: Array
    site: Index


def lever_surface(
    layout: Layout, options: PanelOptions | None = None, *, mirrored: bool = True
) -> LeverSurface:
    """Cover a lever with panels.

    Parameters
    ----------
    layout : Layout
    options : PanelOptions, optional
    mirrored : bool
        Only above the mid-plane: enough where the surroundings are symmetric about it.

    Raises
    ------
    InputError
        If a region is not an axis-parallel rectangle.
    """
    sizes = _Sizes(layout, options or PanelOptions())
    boxes = [_rectangle(region) for region in layout.regions]
    half = layout.thickness_um / 2
    upright = sizes.upright(half, mirrored)
    corners = []
    for box in boxes:
        # by the axis (0 or 1) that a side is normal to, and at which end of it (0 low, 1 high)
        exposed = {side: _exposed(box, *side, boxes, layout) for side in product((0, 1), (0, 1))}
        # an edge that is shared along its whole length is no edge of the lever
        x, y = (
            sizes.breaks(box[0, axis], box[1, axis], axis, [bool(exposed[axis, n]) for n in (0, 1)])
            for axis in (0, 1)
        )
        corners += [grid(2, z, x, y) for z in ([half] if mirrored else [half, -half])]
        for (axis, end), intervals in exposed.items():
            for low, high in intervals:
                along = sizes.breaks(low, high, 1 - axis, (True, True))
                corners.append(grid(axis, box[end, axis], along, upright))
    panels = Panels(np.concatenate(corners))
    places = panels.corners.mean(axis=1)[:, :2].round(9)
    sites, site = np.unique(places, axis=0, return_inverse=True)
    return LeverSurface(panels, sites, site.ravel())


def chip_panels(layout: Layout, options: PanelOptions) -> Panels:
    """Return the front and the lower face of the chip body."""
    (x0, low), (x1, high) = layout.box
    half, reach = layout.thickness_um / 2, REACH * (x1 - x0)
    smallest = _ROOT * (high - low) / options.refinement

    def breaks(start: float, stop: float, near: tuple[float, float]) -> Array:
        at = np.linspace(start, stop, 20001)
        away = np.abs(at - at.clip(*near))
        return divided(at, smallest + _ROOT_GROWTH / options.refinement * away)

    across = breaks(low - reach, high + reach, (low, high))
    up = breaks(half, half + reach, (half, half))
    behind = breaks(x0 - reach, x0, (x0, x0))
    return Panels(np.concatenate([grid(0, x0, across, up), grid(2, -half, behind, across)]))


class _Sizes:
    """How large panels may be where."""

    def __init__(self, layout: Layout, options: PanelOptions) -> None:
        self._heater = layout.heater.box
        fine = 1.0 / options.refinement
        self._growth = fine * _GROWTH
        self._edge = fine * options.edge * layout.thickness_um
        self._narrow = fine * options.heater * layout.heater.narrow_um
        self._largest = fine * _LARGEST * float(np.ptp(layout.box, axis=0).max())

    def breaks(self, low: float, high: float, axis: int, edges: Sequence[bool]) -> Array:
        """Divide an interval along an axis; `edges` says which ends are edges of the lever."""
        at = np.linspace(low, high, 2001)
        away = np.abs(at - at.clip(*self._heater[:, axis]))
        size = np.minimum(self._largest, self._narrow + self._growth * away)
        for end, is_edge in zip((low, high), edges, strict=True):
            if is_edge:
                size = np.minimum(size, self._edge + self._growth * np.abs(at - end))
        return divided(at, size)

    def upright(self, half: float, mirrored: bool) -> Array:
        """Divide a side face from bottom (or the mid-plane) to top."""
        at = np.linspace(0.0 if mirrored else -half, half, 401)
        return divided(at, self._edge + self._growth * (half - np.abs(at)))


def divided(at: Array, size: Array) -> Array:
    """Return break points between the ends of `at` whose distances follow `size`."""
    counted = cumulative_trapezoid(1.0 / size, at, initial=0.0)
    pieces = max(1, int(np.ceil(counted[-1] - 1e-6)))
    breaks = np.interp(np.linspace(0.0, counted[-1], pieces + 1), counted, at)
    breaks[[0, -1]] = at[[0, -1]]
    return breaks


def grid(axis: int, at: float, u: Array, v: Array) -> Array:
    """Return the corners (cells, 4, 3) of all cells between two sets of lines in a plane.

    The plane is normal to a coordinate axis and stands at a place on it.
    """
    corners_u = np.stack([u[:-1], u[1:], u[1:], u[:-1]], axis=1)[:, None]
    corners_v = np.stack([v[:-1], v[:-1], v[1:], v[1:]], axis=1)
    cells = np.stack(np.broadcast_arrays(corners_u, corners_v), axis=-1).reshape(-1, 4, 2)
    return np.insert(cells, axis, at, axis=2)


def _rectangle(region: Region) -> Array:
    """Return the least and largest corner of a region, and refuse what is no rectangle."""
    outline, box = np.array(region.outline), region.box
    at_corner = np.abs(outline[:, None] - box).min(axis=1).max() < _ON_LINE
    if len(outline) != 4 or not at_corner:
        raise InputError(
            f"air: region '{region.name}' has {len(outline)} corners, expected a rectangle "
            "parallel to the axes; a drawn lever can be simulated in vacuum only so far"
        )
    return box


def _exposed(
    box: Array, axis: int, end: int, boxes: list[Array], layout: Layout
) -> list[tuple[float, float]]:
    """Return the parts of a side that touch neither another region nor a terminal."""
    other, line = 1 - axis, box[end, axis]
    covered = [
        (neighbour[0, other], neighbour[1, other])
        for neighbour in boxes
        if abs(neighbour[1 - end, axis] - line) < _ON_LINE
    ]
    for terminal in layout.terminals:
        ends = np.array([terminal.start, terminal.end])
        if np.abs(ends[:, axis] - line).max() < _ON_LINE:
            covered.append((ends[:, other].min(), ends[:, other].max()))
    free = [(float(box[0, other]), float(box[1, other]))]
    for low, high in covered:
        free = [
            piece
            for start, stop in free
            for piece in ((start, min(stop, low)), (max(start, high), stop))
            if piece[1] - piece[0] > _ON_LINE
        ]
    return free
