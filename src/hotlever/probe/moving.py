"""How a drawing, and the mesh on it, move with a dimension.

The vertices of a mesh follow the corners of the drawing: along edges in proportion, inside as
smoothly as possible. So a lever whose dimensions are a little different has the same mesh, moved,
and what it shows is differentiable by its dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from scipy.sparse.linalg import splu

from hotlever.errors import ComputationError, InputError
from hotlever.probe.layout import Layout, Point
from hotlever.probe.mesh import ProbeMesh, doubled_areas, on_line
from hotlever.probe.parameters import OF_THE_TIP, dimensions_of
from hotlever.probe.parts import ProbeParts
from hotlever.probe.tip import Tip
from hotlever.types import Array

#: Share of a dimension by which it is changed to find how the drawing moves: any would do, since
#: corners are sums of dimensions.
_STEP = 1e-3


@dataclass(frozen=True)
class Movement:
    """How a layout and the vertices of its mesh move, per unit of a dimension.

    Attributes
    ----------
    now, later : Layout
        The same regions, before and after a change by `step`.
    step : float
    velocity : ndarray, shape (2, vertices)
    """

    now: Layout
    later: Layout
    step: float
    velocity: Array

    @classmethod
    def from_probe(cls, probe: ProbeParts, name: str, mesh: ProbeMesh) -> Movement:
        """Return how a probe's layout and flat mesh move with one of its dimensions.

        Raises
        ------
        InputError
            If parts would come apart.
        """
        value = float(probe.values([name])[0])
        now, step = probe.layout(), _STEP * (value or 1.0)
        later = probe.replace({name: value + step}).layout()
        if len(later.regions) != len(now.regions):
            raise InputError(
                f"{name} cannot change by itself here: parts of the lever would come apart; "
                "expected a fit or priors without it"
            )
        return cls(now, later, step, _vertex_velocity(mesh, now, _corners(now, later, step)))

    def cone(self, change: float) -> Tip | None:
        """Return the tip's body after a small change of the dimension."""
        now, later = self.now.cone, self.later.cone
        if now is None or later is None:
            return None
        values, ends = now.model_dump(), later.model_dump()
        rates = {name: (ends[name] - values[name]) / self.step for name in OF_THE_TIP}
        return now.model_copy(update={n: values[n] + change * rates[n] for n in rates})

    def of_point(self, now: Point, later: Point) -> Array:
        """Return the velocity of a place in the drawing, shape (2,)."""
        return np.subtract(later, now) / self.step

    @property
    def thickness(self) -> float:
        """Rate of the thickness."""
        return (self.later.thickness_um - self.now.thickness_um) / self.step

    @property
    def tip(self) -> Array:
        """Velocity of the tip, shape (2,)."""
        return self.of_point(self.now.tip, self.later.tip)


def _corners(now: Layout, later: Layout, step: float) -> dict[Point, Array]:
    """Return the velocity of every corner of a region; where two meet, their mean."""
    velocities: dict[Point, list[Array]] = {}
    for before, after in zip(now.regions, later.regions, strict=True):
        for corner, moved in zip(chain(*before.rings), chain(*after.rings), strict=True):
            rounded = (round(corner[0], 9), round(corner[1], 9))
            velocities.setdefault(rounded, []).append(np.subtract(moved, corner) / step)
    return {corner: np.mean(rates, axis=0) for corner, rates in velocities.items()}


def _vertex_velocity(mesh: ProbeMesh, layout: Layout, corners: dict[Point, Array]) -> Array:
    """Return the velocity (2, vertices) of a flat mesh's vertices by that of the corners."""
    # see `hotlever.probe.mesh`
    from skfem import CellBasis, ElementTriP1
    from skfem.models.poisson import laplace

    points, places = mesh.elements.p, np.array(list(corners))
    velocities = np.array(list(corners.values()))
    velocity = np.zeros(points.shape)
    held = np.zeros(points.shape[1], dtype=bool)
    for region in layout.regions:
        for start, end in region.edges:
            along, near = on_line(start, end, points)
            knots, on = on_line(start, end, places.T)
            order = np.argsort(knots[on])
            for axis in (0, 1):
                velocity[axis, near] = np.interp(
                    along[near], knots[on][order], velocities[on, axis][order]
                )
            held |= near
    stiffness = laplace.assemble(CellBasis(mesh.elements, ElementTriP1())).tocsc()
    inside = np.flatnonzero(~held)
    if inside.size:
        load = -(stiffness[inside][:, held] @ velocity[:, held].T)
        velocity[:, inside] = splu(stiffness[inside][:, inside].tocsc()).solve(load).T
    return velocity


class MovingMesh:
    """A flat mesh that follows its probe; it moves in proportion to the change of a dimension."""

    def __init__(self, mesh: ProbeMesh, probe: ProbeParts) -> None:
        self._mesh, self._probe = mesh, probe
        self._movements: dict[str, Movement] = {}

    def movement(self, name: str) -> Movement:
        """Return how mesh and layout move with a dimension."""
        if name not in self._movements:
            self._movements[name] = Movement.from_probe(self._probe, name, self._mesh)
        return self._movements[name]

    def mesh_of(self, probe: ProbeParts) -> ProbeMesh:
        """Return the mesh of a probe with other dimensions.

        Raises
        ------
        ComputationError
            If a triangle would turn over.
        """
        from skfem import MeshTri  # see `hotlever.probe.mesh`

        points = self._mesh.elements.p.copy()
        names = dimensions_of(probe)
        changes = probe.values(names) - self._probe.values(names)
        for name, change in zip(names, changes, strict=True):
            if change:
                points += change * self.movement(name).velocity
        before, triangles = self._mesh.elements.p, self._mesh.elements.t
        if np.any(doubled_areas(before[:, triangles]) * doubled_areas(points[:, triangles]) <= 0):
            raise ComputationError("the mesh cannot follow so large a change of the dimensions")
        return replace(self._mesh, layout=probe.layout(), elements=MeshTri(points, triangles))
