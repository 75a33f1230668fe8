"""A lever of its true thickness, in vacuum or in still air."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from skfem.element import ElementTetP2

from hotlever import __version__
from hotlever.errors import ComputationError, InputError
from hotlever.lever.equations import PER_CM_TO_MILLI_PER_UM
from hotlever.lever.lever import Lever
from hotlever.lever.operators import FiniteElements
from hotlever.lever.space import LeverSpace
from hotlever.lever.state_store import StateStore
from hotlever.lever3d.still_air import OpenAir, ngsolve
from hotlever.materials.air import kirchhoff_variable
from hotlever.probe import Probe
from hotlever.probe.solid import SolidMesh, SolidMeshOptions, mesh_solid

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Radius of the sphere of air in the paper (µm).
SPHERE_RADIUS = 60.0


class SolidLever(Lever):
    """A lever of tetrahedra; everything else is as with `Lever`.

    Parameters
    ----------
    probe : Probe
        Its surroundings say whether it is in vacuum or in air, and then in free space.
    mesh : SolidMeshOptions, optional
    sphere_radius_um : float
        Radius of the meshed air around the lever. The air reaches to infinity with any radius.
    air_order : int
        Order of the elements in the air, 2 or more; on the lever θ is quadratic.

    Attributes
    ----------
    solid : SolidMesh
    air : OpenAir or None
        None in vacuum.
    surface : ndarray of int
        Nodes of the silicon on its surface, in the order of `air`.

    Raises
    ------
    InputError
        If the sphere does not hold the lever, NGSolve is not installed, or the surroundings are
        more than free space.
    """

    def __init__(
        self,
        probe: Probe,
        mesh: SolidMeshOptions | None = None,
        *,
        sphere_radius_um: float = SPHERE_RADIUS,
        air_order: int = 3,
    ) -> None:
        around = probe.surroundings
        in_air = around.medium == "air"
        if in_air:
            ngsolve()  # says what to install, before the meshing
            if around != type(around)(medium="air"):
                raise InputError(
                    "[surroundings]: the full 3-D simulation knows free space only; expected no "
                    "surface below, no chip and no temperature jump"
                )
        self.solid = mesh_solid(
            probe.layout(), mesh, sphere_radius_um=sphere_radius_um if in_air else None
        )
        space = LeverSpace(self.solid, FiniteElements(self.solid.elements, ElementTetP2(), 4))
        self.air: OpenAir | None = None
        self.surface: Index = np.empty(0, dtype=np.intp)
        if in_air:
            self.air = OpenAir(
                self.solid.netgen, self.solid.centre, sphere_radius_um, order=air_order
            )
            self.surface = surface_nodes(self.solid, space.operators, self.air)
            space = space.in_air_at_nodes(self.air, self.surface)
        super().__init__(probe, space=space)

    def store(self) -> StateStore:
        """Return where the states of this very lever are kept."""
        air = self.air
        return StateStore(
            {
                "version": __version__,
                "probe": self.probe.values(),
                "nodes": self.space.operators.nodes,
                "air": None if air is None else [air.radius_um, air.order, air.size],
            }
        )

    def apex_temperature(self, x: Array) -> float:
        """Return the temperature (K) of the tip's apex; without a tip that of the lever there."""
        base = self.probe.circuit.base_temperature_K
        points, (tip_x, tip_y) = self.solid.elements.p, self.solid.layout.tip
        lowest = points[2] + 1e-3 * np.hypot(points[0] - tip_x, points[1] - tip_y)
        near = np.hypot(points[0] - tip_x, points[1] - tip_y) < self.solid.layout.thickness_um
        vertex = int(np.argmin(np.where(near, lowest, np.inf)))
        node = self.space.operators.basis.nodal_dofs[0, vertex]
        return float(self.space.nodal(x, base)[0][node])

    def in_the_air(self, x: Array) -> tuple[Array, Array]:
        """Return what a state gives to the air.

        Returns
        -------
        coefficients : ndarray
            Of θ in the air (mW/µm); see `OpenAir`.
        heat : ndarray
            From each node of `surface` (mW).

        Raises
        ------
        InputError
            If the lever is in vacuum.
        """
        if self.air is None:
            raise InputError("this lever is in vacuum: it gives no heat to air")
        base = self.probe.circuit.base_temperature_K
        theta, _ = kirchhoff_variable(self.space.nodal(x, base)[0][self.surface], base)
        return self.air.solve(PER_CM_TO_MILLI_PER_UM * theta)


def surface_nodes(mesh: SolidMesh, operators: FiniteElements, air: OpenAir) -> Index:
    """Return the numbers of the silicon's nodes on its surface, in the order of the air's.

    Raises
    ------
    ComputationError
        If the two meshes do not match.
    """
    basis = operators.basis
    vertices = np.searchsorted(mesh.vertices, air.vertices)
    edges = np.sort(np.searchsorted(mesh.vertices, air.edges), axis=1)
    count = len(mesh.vertices)
    keys = np.sort(mesh.elements.edges, axis=0)
    known = keys[0] * count + keys[1]
    order = np.argsort(known)
    wanted = edges[:, 0] * count + edges[:, 1]
    place = order[np.searchsorted(known[order], wanted).clip(max=order.size - 1)]
    if not (
        np.array_equal(mesh.vertices[vertices.clip(max=count - 1)], air.vertices)
        and np.array_equal(known[place], wanted)
    ):
        raise ComputationError("the air does not touch the silicon node by node")
    return np.concatenate([basis.nodal_dofs[0, vertices], basis.edge_dofs[0, place]])
