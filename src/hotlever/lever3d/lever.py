"""A lever of its true thickness, in vacuum or in still air."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray
from skfem.element import ElementTetP2

from hotlever import __version__
from hotlever.errors import ComputationError
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import Lever
from hotlever.lever.operators import FiniteElements
from hotlever.lever.reduced_cache import cache_folder
from hotlever.lever.space import LeverSpace
from hotlever.lever.state_store import StateStore
from hotlever.lever3d.equations import SolidEquations
from hotlever.lever3d.still_air import OpenAir, ngsolve
from hotlever.probe import Probe
from hotlever.probe.solid import SolidMesh, SolidMeshOptions, mesh_solid

Index = NDArray[np.intp]

#: Radius of the sphere of air in the paper (µm).
SPHERE_RADIUS = 60.0

#: What the sweep of a lever in air tells about the air.
AIR_COLUMNS = {
    "air_heat_mW": ("mW", "net heat from the lever into the air"),
    "far_heat_mW": ("mW", "heat that the air takes to infinity"),
}


class SolidLever(Lever):
    """A lever of tetrahedra; everything else is as with `Lever`.

    Parameters
    ----------
    probe : Probe
    mesh : SolidMeshOptions, optional
    sphere_radius_um : float or None
        Radius of the meshed air around the lever; None for vacuum. The air reaches to
        infinity with any radius.
    air_order : int
        Order of the elements in the air.

    Raises
    ------
    InputError
        If the sphere does not hold the lever, or NGSolve is not installed.
    """

    def __init__(
        self,
        probe: Probe,
        mesh: SolidMeshOptions | None = None,
        *,
        sphere_radius_um: float | None = SPHERE_RADIUS,
        air_order: int = 2,
    ) -> None:
        if sphere_radius_um is not None:
            ngsolve()  # says what to install, before the meshing
        solid = mesh_solid(probe.layout(), mesh, sphere_radius_um=sphere_radius_um)
        self.solid = solid
        self.space = LeverSpace(solid, FiniteElements(solid.elements, ElementTetP2(), 4))
        self.air: OpenAir | None = None
        if sphere_radius_um is not None:
            self.air = OpenAir(solid.netgen, solid.centre, sphere_radius_um, order=air_order)
            self._surface = surface_nodes(solid, self.space.operators, self.air)
        super().__init__(probe, space=self.space)

    @property
    def medium(self) -> str:
        """What surrounds the lever."""
        return "vacuum" if self.air is None else "air"

    def store(self) -> StateStore | None:
        """Return where the states of this very lever are kept; None if the cache is off."""
        folder = cache_folder()
        if folder is None:
            return None
        points = np.round(self.space.operators.nodes, 9).tobytes()
        return StateStore(
            folder,
            {
                "version": __version__,
                "probe": self.probe.values(),
                "nodes": hashlib.sha256(points).hexdigest(),
                "air": self.air and (self.air.radius_um, self.air.order, self.air.size),
            },
        )

    @property
    def more_columns(self) -> dict[str, tuple[str, str]]:
        """Variables of a sweep beyond `SWEEP_COLUMNS`: name, unit, what it is."""
        return super().more_columns | ({} if self.air is None else AIR_COLUMNS)

    def _equations(self) -> LeverEquations:
        if self.air is None:
            return super()._equations()
        return SolidEquations(
            self.space, self._surface, self.air, self.probe.circuit, self.probe.material
        )


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
