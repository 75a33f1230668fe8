"""The surface of a lever as panels: top, bottom and side faces of a plate of true thickness.

The flux into air is singular at the edges and its source is the heater, so panels are small at
both. The leg ends are at base temperature and have no panels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.air.panels import Mirror, Panels
from hotlever.errors import InputError
from hotlever.probe.layout import Layout, Region

Array = NDArray[np.float64]
Index = NDArray[np.intp]

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
    largest : float
        As a share of the lever's length.
    growth : float
        Growth of the size with the distance from edges and from the heater.
    """

    refinement: float = 1.0
    edge: float = 0.15
    heater: float = 0.3
    largest: float = 0.03
    growth: float = 1.2


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
    mirrored : bool
        Whether these are the panels above the mid-plane only.
    """

    panels: Panels
    sites: Array
    site: Index
    mirrored: bool

    @property
    def mid_plane(self) -> list[Mirror]:
        """The mirror that makes the lower half; none if its panels are there."""
        return [Mirror.in_plane((0, 0, 0), (0, 0, 1), +1.0)] if self.mirrored else []


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
    boxes = [_box(region) for region in layout.regions]
    half = layout.thickness_um / 2
    levels = [half] if mirrored else [half, -half]
    corners, places = [], []
    for box in boxes:
        exposed = [_exposed(box, side, boxes, layout) for side in _SIDES]
        # an edge that is shared along its whole length is no edge of the lever
        ends = [bool(exposed[number]) for number in range(4)]
        x = sizes.breaks(box[0, 0], box[1, 0], 0, (ends[0], ends[1]))
        y = sizes.breaks(box[0, 1], box[1, 1], 1, (ends[2], ends[3]))
        for z in levels:
            face = grid(x, y)
            corners.append(np.concatenate([face, np.full((*face.shape[:2], 1), z)], axis=2))
            places.append(face.mean(axis=1))
        for side, intervals in zip(_SIDES, exposed, strict=True):
            for low, high in intervals:
                along = sizes.breaks(low, high, 1 - side.axis, (True, True))
                upright = sizes.across(half, mirrored)
                wall = grid(along, upright)
                panel = np.empty((*wall.shape[:2], 3))
                panel[..., side.axis] = box[side.end, side.axis]
                panel[..., 1 - side.axis] = wall[..., 0]
                panel[..., 2] = wall[..., 1]
                corners.append(panel)
                places.append(panel.mean(axis=1)[:, :2])
    sites, site = np.unique(np.round(np.concatenate(places), 9), axis=0, return_inverse=True)
    return LeverSurface(Panels(np.concatenate(corners)), sites, site.ravel(), mirrored)


@dataclass(frozen=True)
class _Side:
    """A side of a box: the axis it is normal to, and at which end (0 low, 1 high)."""

    axis: int
    end: int


_SIDES = tuple(_Side(axis, end) for axis in (0, 1) for end in (0, 1))


class _Sizes:
    """How large panels may be where."""

    def __init__(self, layout: Layout, options: PanelOptions) -> None:
        low, high = lever_box(layout)
        self._heater = _box(layout.heater)
        fine = 1.0 / options.refinement
        self._growth = fine * options.growth
        self._edge = fine * options.edge * layout.thickness_um
        self._narrow = fine * options.heater * float(np.ptp(self._heater, axis=0).min())
        self._largest = fine * options.largest * float((high - low).max())

    def breaks(self, low: float, high: float, axis: int, edges: tuple[bool, bool]) -> Array:
        """Divide an interval along an axis; `edges` says which ends are edges of the lever."""
        at = np.linspace(low, high, 2001)
        start, stop = self._heater[:, axis]
        away = np.maximum(np.maximum(start - at, at - stop), 0.0)
        size = np.minimum(self._largest, self._narrow + self._growth * away)
        for end, is_edge in zip((low, high), edges, strict=True):
            if is_edge:
                size = np.minimum(size, self._edge + self._growth * np.abs(at - end))
        return divided(at, size)

    def across(self, half: float, mirrored: bool) -> Array:
        """Divide a side face from bottom (or the mid-plane) to top."""
        at = np.linspace(0.0 if mirrored else -half, half, 401)
        return divided(at, self._edge + self._growth * (half - np.abs(at)))


def divided(at: Array, size: Array) -> Array:
    """Return break points between the ends of `at` whose distances follow `size`."""
    density = 1.0 / size
    counted = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(at))])
    pieces = max(1, int(np.ceil(counted[-1] - 1e-6)))
    breaks = np.interp(np.linspace(0.0, counted[-1], pieces + 1), counted, at)
    breaks[[0, -1]] = at[[0, -1]]
    return breaks


def grid(u: Array, v: Array) -> Array:
    """Return the corners (cells, 4, 2) of all cells between two sets of lines."""
    low_u, low_v = (grid.ravel() for grid in np.meshgrid(u[:-1], v[:-1], indexing="ij"))
    high_u, high_v = (grid.ravel() for grid in np.meshgrid(u[1:], v[1:], indexing="ij"))
    return np.stack(
        [
            np.stack([low_u, low_v], axis=1),
            np.stack([high_u, low_v], axis=1),
            np.stack([high_u, high_v], axis=1),
            np.stack([low_u, high_v], axis=1),
        ],
        axis=1,
    )


def lever_box(layout: Layout) -> Array:
    """Return the least and largest corner of a lever, shape (2, 2)."""
    outline = np.concatenate([region.outline for region in layout.regions])
    return np.stack([outline.min(axis=0), outline.max(axis=0)])


def _box(region: Region) -> Array:
    """Return the least and largest corner of a rectangular region, shape (2, 2)."""
    outline = np.array(region.outline)
    box = np.stack([outline.min(axis=0), outline.max(axis=0)])
    at_corner = np.abs(outline[:, None] - box).min(axis=1).max() < _ON_LINE
    if len(outline) != 4 or not at_corner:
        raise InputError(
            f"air: region '{region.name}' has {len(outline)} corners, expected a rectangle "
            "parallel to the axes"
        )
    return box


def _exposed(
    box: Array, side: _Side, boxes: list[Array], layout: Layout
) -> list[tuple[float, float]]:
    """Return the parts of a side that touch neither another region nor a terminal."""
    axis, other = side.axis, 1 - side.axis
    line = box[side.end, axis]
    covered = [
        (neighbour[0, other], neighbour[1, other])
        for neighbour in boxes
        if abs(neighbour[1 - side.end, axis] - line) < _ON_LINE
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
