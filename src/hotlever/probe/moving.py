"""How a drawing, and the mesh on it, move with a dimension.

The vertices of a mesh follow the corners of the drawing: along edges in proportion, inside as
smoothly as possible. So a lever whose dimensions are a little different has the same mesh, moved,
and what it shows is differentiable by its dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment
from scipy.sparse.linalg import splu

from hotlever.errors import ComputationError, InputError
from hotlever.probe.layout import BorderTaper, Layout, Point, Region
from hotlever.probe.mesh import ProbeMesh, doubled_areas, on_line
from hotlever.probe.parts import ProbeParts
from hotlever.probe.probe_parameters import OF_THE_TIP
from hotlever.probe.tip import Tip
from hotlever.types import Array

#: What is no match costs more than any (µm²).
_UNLIKE = 1e12


@dataclass(frozen=True)
class Movement:
    """How a layout and the vertices of its mesh move, per unit of a dimension.

    Attributes
    ----------
    now, before, after : Layout
        The same regions and corners, as they are and with the dimension less and more by `step`.
    step : float
    velocity : ndarray, shape (2, vertices)
    """

    now: Layout
    before: Layout
    after: Layout
    step: float
    velocity: Array

    def rate(self, before: ArrayLike, after: ArrayLike) -> Array:
        """Return how fast numbers or places change."""
        return np.subtract(after, before) / (2 * self.step)

    def cone(self, change: float) -> Tip | None:
        """Return the tip's body after a small change of the dimension."""
        now, before, after = (layout.cone for layout in (self.now, self.before, self.after))
        if now is None or before is None or after is None:
            return None
        values, low, high = now.model_dump(), before.model_dump(), after.model_dump()
        rates = {name: float(self.rate(low[name], high[name])) for name in OF_THE_TIP}
        return now.model_copy(update={n: values[n] + change * rates[n] for n in rates})

    @property
    def thickness(self) -> float:
        """Rate of the thickness."""
        return float(self.rate(self.before.thickness_um, self.after.thickness_um))

    @property
    def films(self) -> float:
        """Rate of what films add to the thickness where most lie on one another."""
        least, most = (
            layout.thickest_um - layout.thickness_um for layout in (self.before, self.after)
        )
        return float(self.rate(least, most))

    def thickness_of_films(self, level: int) -> Array:
        """Return the rate of the films at a level above the body, by region, shape (regions,)."""
        return np.array(
            [
                float(self.rate(*(region.stack[level].thickness_um or 0.0 for region in both)))
                if len(both[0].stack) > level
                else 0.0
                for both in zip(self.before.regions, self.after.regions, strict=True)
            ]
        )

    @property
    def tip(self) -> Array:
        """Velocity of the tip, shape (2,)."""
        return self.rate(self.before.tip, self.after.tip)


class MovingMesh:
    """A flat mesh that follows its probe."""

    def __init__(self, mesh: ProbeMesh, probe: ProbeParts) -> None:
        self._mesh, self._probe = mesh, probe
        corners = _corners(mesh.layout)
        self._positions, which = np.unique(corners.round(6), axis=0, return_inverse=True)
        self._which = which.ravel()

    def movement(self, probe: ProbeParts, name: str) -> Movement:
        """Return how mesh and layout of a similar probe move with a dimension.

        Raises
        ------
        InputError
            If parts would come apart or get other corners.
        """
        value = float(probe.values([name])[0])
        # corners that are no sums of dimensions, as those of a rounding, move by this to within
        # 1e-6
        step = 1e-3 * (value or 1.0)
        layouts = [probe.replace({name: value + way}).layout() for way in (0.0, -step, step)]
        alike = [in_order for each in layouts if (in_order := _in_order(self._mesh.layout, each))]
        if len(alike) < len(layouts):
            raise InputError(
                f"{name} cannot change by itself here: parts of the lever would come apart or get "
                "other corners; expected a fit or priors without it"
            )
        now, before, after = alike
        displacement = self._follow(after) - self._follow(before)
        return Movement(now, before, after, step, displacement / (2 * step))

    def mesh_of(self, probe: ProbeParts) -> ProbeMesh:
        """Return the mesh of a probe with other dimensions.

        Raises
        ------
        ComputationError
            If the layout has other parts or corners, or a triangle would turn over.
        """
        from skfem import MeshTri  # see `hotlever.probe.mesh`

        try:
            layout = _in_order(self._mesh.layout, probe.layout())
        except InputError as error:
            raise ComputationError(f"no such lever can be drawn: {error}") from None
        if layout is None:
            raise ComputationError(
                "the mesh cannot follow so large a change of the dimensions: the lever gets other "
                "parts or corners"
            )
        before, triangles = self._mesh.elements.p, self._mesh.elements.t
        points = before + self._follow(layout) - self._follow(self._mesh.layout)
        if np.any(doubled_areas(before[:, triangles]) * doubled_areas(points[:, triangles]) <= 0):
            raise ComputationError("the mesh cannot follow so large a change of the dimensions")
        return replace(self._mesh, layout=layout, elements=MeshTri(points, triangles))

    def _follow(self, layout: Layout) -> Array:
        """Return where the corners of a layout take the vertices, shape (2, vertices)."""
        corners = _corners(layout)
        # where regions meet, each has the corner
        count = np.bincount(self._which)
        mean = [np.bincount(self._which, corners[:, axis]) / count for axis in (0, 1)]
        return np.stack(mean) @ self._shares.T

    @cached_property
    def _shares(self) -> Array:
        """The share of each corner in the movement of each vertex, shape (vertices, corners)."""
        # see `hotlever.probe.mesh`
        from skfem import CellBasis, ElementTriP1
        from skfem.models.poisson import laplace

        points, positions = self._mesh.elements.p, self._positions.T
        shares = np.zeros((points.shape[1], len(self._positions)))
        held = np.zeros(points.shape[1], dtype=bool)
        for region in self._mesh.layout.regions:
            for start, end in region.edges:
                along, near = on_line(start, end, points)
                knots, on = on_line(start, end, positions)
                order = np.flatnonzero(on)[np.argsort(knots[on])]
                for corner, basis in zip(order, np.eye(order.size), strict=True):
                    shares[near, corner] = np.interp(along[near], knots[order], basis)
                held |= near
        stiffness = laplace.assemble(CellBasis(self._mesh.elements, ElementTriP1())).tocsc()
        inside = np.flatnonzero(~held)
        if inside.size:
            load = -(stiffness[inside][:, held] @ shares[held])
            shares[inside] = splu(stiffness[inside][:, inside].tocsc()).solve(load)
        return shares


def _corners(layout: Layout) -> Array:
    """Return the corners of all regions, shape (n, 2)."""
    return np.array([*chain.from_iterable(chain(*region.rings) for region in layout.regions)])


def _in_order(like: Layout, layout: Layout) -> Layout | None:
    """Return a layout with regions and corners in the order of another, None if it has others.

    A drawing's come as its outlines are cut, which is another order where two areas are equal.
    """
    if len(layout.regions) != len(like.regions):
        return None
    if sorted(layout.terminal_names) != sorted(like.terminal_names):
        return None
    what = [(_made_of(region), region) for region in layout.regions]
    pairs = [
        [_region(old, new) if of_new == of_old else (_UNLIKE, new) for of_new, new in what]
        for of_old, old in ((_made_of(region), region) for region in like.regions)
    ]
    chosen = _cheapest(pairs)
    return None if chosen is None else replace(layout, regions=tuple(chosen))


def _region(like: Region, region: Region) -> tuple[float, Region]:
    """Return how far a region is from one like it, and it with its corners in that order."""
    cost, outline = _ring(like.outline, region.outline)
    holes = None
    if cost < _UNLIKE and len(region.holes) == len(like.holes):
        holes = _cheapest([[_ring(old, new) for new in region.holes] for old in like.holes])
    if holes is None:
        return _UNLIKE, region
    return cost, replace(region, name=like.name, outline=outline, holes=tuple(holes))


def _made_of(region: Region) -> tuple[Any, ...]:
    """Return what a region is, wherever it is and however thick its films are."""
    borders = len(region.taper.borders) if isinstance(region.taper, BorderTaper) else 0
    materials = [film.material for film in region.stack]
    taper = region.taper is not None, borders
    return region.part, region.dopant_from, region.insulates, taper, materials


def _ring(like: tuple[Point, ...], ring: tuple[Point, ...]) -> tuple[float, tuple[Point, ...]]:
    """Return how far a ring is from another (µm²), and the ring from its first corner on."""
    count = len(ring)
    if count != len(like):
        return _UNLIKE, ring
    away = ((np.array(like)[:, None] - np.array(ring)) ** 2).sum(axis=2)
    corner = np.arange(count)
    by_first = away[corner, (corner + corner[:, None]) % count].sum(axis=1)
    first = int(by_first.argmin())
    return float(by_first[first]), (*ring[first:], *ring[:first])


def _cheapest(pairs: list[list[tuple[float, Any]]]) -> list[Any] | None:
    """Return for each row the one that makes all together cheapest, None if one is unlike."""
    if not pairs:
        return []
    costs = np.array([[cost for cost, _ in row] for row in pairs])
    rows, columns = linear_sum_assignment(costs)
    if (costs[rows, columns] >= _UNLIKE).any():
        return None
    return [pairs[row][column][1] for row, column in zip(rows, columns, strict=True)]
