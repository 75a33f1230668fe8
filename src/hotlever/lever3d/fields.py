"""Fields of a solved lever with the air around it: on all vertices, on slices, by region."""

from __future__ import annotations

import os
from dataclasses import dataclass

import meshio
import numpy as np
from numpy.typing import NDArray

from hotlever.errors import InputError
from hotlever.files import whole_file
from hotlever.lever.equations import PER_CM_TO_MILLI_PER_UM
from hotlever.lever3d.lever import SolidLever
from hotlever.lever3d.still_air import ngsolve
from hotlever.materials.air import temperature_from_kirchhoff
from hotlever.probe.solid import AIR, IMAGE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SolidFields:
    """Temperature and potential at the vertices of the mesh.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        µm.
    tetrahedra : ndarray of int, shape (m, 4)
        The silicon's first.
    region : ndarray of int, shape (m,)
        Index into the layout's regions; -1 in air.
    temperature, potential : ndarray, shape (n,)
        K and V; the potential is NaN off the silicon.
    """

    points: Array
    tetrahedra: NDArray[np.intp]
    region: NDArray[np.intp]
    temperature: Array
    potential: Array


def solid_fields(lever: SolidLever, x: Array) -> SolidFields:
    """Return the fields of a state in the silicon and, if there is any, in the meshed air."""
    solid, base = lever.solid, lever.probe.circuit.base_temperature_K
    T, V = lever.space.nodal(x, base)
    at_vertices = lever.space.operators.basis.nodal_dofs[0]
    points = np.array(solid.netgen.Coordinates())
    temperature = np.full(len(points), base)
    potential = np.full(len(points), np.nan)
    tetrahedra, region = solid.vertices[solid.elements.t.T], solid.region
    if lever.air is not None:
        theta = lever.air.at_vertices(lever.in_the_air(x)[0])
        temperature = temperature_from_kirchhoff(theta / PER_CM_TO_MILLI_PER_UM, base)
        elements = solid.netgen.Elements3D().NumPy()
        names = [solid.netgen.GetMaterial(int(k)) for k in range(1, elements["index"].max() + 1)]
        of_air = np.array([name == AIR for name in names])[elements["index"] - 1]
        air = elements["nodes"][of_air, :4].astype(np.intp) - 1
        tetrahedra = np.concatenate([tetrahedra, air])
        region = np.concatenate([region, np.full(len(air), -1, dtype=np.intp)])
    temperature[solid.vertices] = T[at_vertices]
    potential[solid.vertices] = V[at_vertices]
    used, numbers = np.unique(tetrahedra, return_inverse=True)
    return SolidFields(
        points[used],
        numbers.reshape(tetrahedra.shape),
        region,
        temperature[used],
        potential[used],
    )


def write_solid_vtu(lever: SolidLever, x: Array, path: str | os.PathLike[str]) -> None:
    """Write a state as VTU, for ParaView and the like: lever and air in one file.

    Point data: temperature_K, potential_V. Cell data: region, -1 in air.
    """
    fields = solid_fields(lever, x)
    mesh = meshio.Mesh(
        fields.points,
        [("tetra", fields.tetrahedra)],
        point_data={"temperature_K": fields.temperature, "potential_V": fields.potential},
        cell_data={"region": [fields.region.astype(np.int32)]},
    )
    with whole_file(path) as temporary:
        mesh.write(temporary, file_format="vtu")


def temperature_at(lever: SolidLever, x: Array, points: Array) -> Array:
    """Return the temperature at any points inside the sphere of air.

    Parameters
    ----------
    lever : SolidLever
        In air.
    x : ndarray
        Unknowns of a solved state.
    points : ndarray, shape (n, 3)
        µm.

    Returns
    -------
    ndarray, shape (n,)
        K, linear between the vertices of the mesh; NaN outside the sphere.
    """
    air = lever.air
    if air is None:
        raise InputError("this lever is in vacuum: expected one in air")
    fields = solid_fields(lever, x)
    every = np.full(air.mesh.nv, lever.probe.circuit.base_temperature_K)
    inside = np.unique(
        [v.nr for part in air.mesh.Elements() if part.mat != IMAGE for v in part.vertices]
    )
    every[inside] = fields.temperature
    ng = ngsolve()
    linear = ng.GridFunction(ng.H1(air.mesh, order=1))
    linear.vec.FV().NumPy()[:] = every
    centre, radius = np.array(air.centre), air.radius_um
    result = np.full(len(points), np.nan)
    near = np.linalg.norm(points - centre, axis=1) < 0.97 * radius
    result[near] = linear(air.mesh(*points[near].T)).ravel()
    return result


def heat_by_region(lever: SolidLever, x: Array) -> dict[str, float]:
    """Return the heat (mW) that each region of the lever gives to the air.

    A node on the border of regions gives to each by its share of the surface around the node.
    """
    heat = np.zeros(lever.space.operators.size)
    heat[lever.surface] = lever.in_the_air(x)[1]
    mesh, basis = lever.solid.elements, lever.space.operators.basis
    facets = mesh.boundary_facets()
    a, b, c = np.moveaxis(mesh.p[:, mesh.facets[:, facets]], 1, 0)
    area = np.linalg.norm(np.cross((b - a).T, (c - a).T), axis=1) / 2
    region = lever.solid.region[mesh.f2t[0, facets]]
    names = [one.name for one in lever.solid.layout.regions]
    share = np.zeros((len(names), heat.size))
    for number in range(len(names)):
        mine = facets[region == number]
        nodes = np.concatenate(
            [basis.nodal_dofs[0, mesh.facets[:, mine]], basis.edge_dofs[0, _edges(mesh, mine)]]
        )
        np.add.at(share[number], nodes, np.broadcast_to(area[region == number], nodes.shape))
    total = share.sum(axis=0)
    share = np.divide(share, total, out=np.zeros_like(share), where=total > 0)
    return dict(zip(names, (share @ heat).tolist(), strict=True))


def _edges(mesh: object, facets: NDArray[np.intp]) -> NDArray[np.intp]:
    """Numbers of the three edges of each facet, shape (3, facets)."""
    edges: NDArray[np.intp] = np.asarray(mesh.f2e)[:, facets]  # type: ignore[attr-defined]
    return edges
