"""Fields of a solved lever with the air around it: on all vertices, on slices, by region."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import meshio
import numpy as np
import xarray as xr
from scipy.sparse import csr_matrix

from hotlever.air.bodies import lever_axes
from hotlever.datasets import labelled
from hotlever.errors import InputError
from hotlever.files import whole_file
from hotlever.lever.fields import Surface, fields_file, seen_from_above, write_fields
from hotlever.lever.lever import State
from hotlever.lever3d.solid_lever import SolidLever, surface_nodes
from hotlever.lever3d.still_air import ngsolve
from hotlever.materials.air import temperature_from_kirchhoff
from hotlever.probe.mesh import material_names
from hotlever.types import Array
from hotlever.units import PER_CM_TO_MILLI_PER_UM


@write_fields.register
def _(
    lever: SolidLever,
    states: Sequence[State],
    folder: Path,
    draw_slices: Callable[[xr.Dataset, Path], None],
) -> None:
    """Write lever and air in one file for each state, and in air slices through both."""
    for state in states:
        write_solid_vtu(state, fields_file(folder, state, ".vtu"))
        if lever.medium == "air":
            draw_slices(temperature_slices(state), fields_file(folder, state, ".png"))


@seen_from_above.register
def _(lever: SolidLever, cuts: int = 1) -> Surface:
    """See its upper side, whose triangles are not cut."""
    mesh, elements = lever.solid.elements, lever.space.elements
    facets = mesh.facets[:, mesh.boundary_facets()]
    height = mesh.p[2, facets].min(axis=0)
    vertices, triangles = np.unique(facets[:, height == height.max()], return_inverse=True)
    indicator = np.ones(vertices.size), elements.basis.nodal_dofs[0, vertices]
    rows = np.arange(vertices.size + 1)
    sampling = csr_matrix((*indicator, rows), shape=(vertices.size, elements.size))
    return Surface(mesh.p[:2, vertices].T, triangles.reshape(3, -1).T, sampling)


def write_solid_vtu(state: State, path: str | os.PathLike[str]) -> None:
    """Write a state as VTU, for ParaView and the like: lever and air in one file.

    Point data: temperature_K, potential_V (NaN off the silicon). Cell data: region, -1 in air.
    """
    solid = _solid(state).solid
    points, elements = np.array(solid.netgen.Coordinates()), solid.netgen.Elements3D().NumPy()
    air = elements["nodes"][material_names(solid.netgen) == "air", :4].astype(np.intp) - 1
    # the image ball is not part of it
    tetrahedra = np.concatenate([solid.vertices[solid.elements.t.T], air])
    used, numbers = np.unique(tetrahedra, return_inverse=True)
    potential = np.full(len(points), np.nan)
    potential[solid.vertices] = _of_vertices(state)[1]
    mesh = meshio.Mesh(
        points[used],
        [("tetra", numbers.reshape(tetrahedra.shape))],
        point_data={"temperature_K": _temperature(state)[used], "potential_V": potential[used]},
        cell_data={"region": [np.append(solid.region, np.full(len(air), -1)).astype(np.int32)]},
    )
    with whole_file(path) as temporary:
        mesh.write(temporary, file_format="vtu")


def _of_vertices(state: State) -> tuple[Array, Array]:
    """Return temperature (K) and potential (V) at the vertices of the silicon."""
    T, V = state.nodal
    vertices = state.lever.space.elements.basis.nodal_dofs[0]
    return T[vertices], V[vertices]


def _temperature(state: State) -> Array:
    """Return the temperature (K) at all vertices of Netgen's mesh; without meaning in the image."""
    lever = _solid(state)
    solid, base, air = lever.solid, lever.circuit.base_temperature_K, lever.space.air.operator
    temperature = np.full(len(solid.netgen.Coordinates()), base)
    if lever.medium == "air":
        theta = air.at_vertices(lever.in_the_air(state)[0])
        temperature = temperature_from_kirchhoff(theta / PER_CM_TO_MILLI_PER_UM, base)
    temperature[solid.vertices] = _of_vertices(state)[0]
    return temperature


def temperature_at(state: State, points: Array) -> Array:
    """Return the temperature at any points inside the sphere of air.

    Parameters
    ----------
    state : State
        Of a solid lever in air.
    points : ndarray, shape (n, 3)
        µm.

    Returns
    -------
    ndarray, shape (n,)
        K, linear between the vertices of the mesh; NaN outside the sphere.
    """
    lever = _solid(state)
    if lever.medium == "vacuum":
        raise InputError("this lever is in vacuum: expected one in air")
    air = lever.space.air.operator
    ng = ngsolve()
    linear = ng.GridFunction(ng.H1(air.mesh, order=1))
    linear.vec.FV().NumPy()[:] = _temperature(state)
    centre, radius = np.array(air.centre), air.radius_um
    result = np.full(len(points), np.nan)
    near = np.linalg.norm(points - centre, axis=1) < 0.97 * radius
    result[near] = linear(air.mesh(*points[near].T)).ravel()
    return result


def temperature_slices(state: State) -> xr.Dataset:
    """Return the temperature in the plane along the lever and across it, far and near the heater.

    Parameters
    ----------
    state : State
        Of a solid lever in air.

    Returns
    -------
    xarray.Dataset
        ``temperature`` (slice, z, place) at ``along_um`` and ``z_um``; bias, tip and base
        temperature as attributes, with the heat that leaves the lever and that arrives at infinity.
        ``along_um`` is x or y, as ``axis`` says, or the distance from the origin along or across a
        lever that is turned on the wafer.
    """
    lever = _solid(state)
    coefficients, heat = lever.in_the_air(state)
    layout = lever.solid.layout
    tip = np.array(layout.tip)
    directions = lever_axes(layout)
    as_drawn = np.allclose(directions, np.eye(2), rtol=0, atol=1e-9)
    names = ("x", "y") if as_drawn else ("along", "across")
    seen = layout.corners @ directions.T
    far, near = 0.675 * np.ptp(seen, axis=0).max(), 2.0 * layout.heater.sides.max()
    # in the middle of the lever, at the tip's place across it
    middle = np.array([(seen[:, 0].min() + seen[:, 0].max()) / 2, tip @ directions[1]]) @ directions
    slices = {
        "along the lever": (0, middle, far),
        "across, at the tip": (1, tip, far),
        "along, near the heater": (0, tip, near),
        "across, near the heater": (1, tip, near),
    }
    axis, centre, reach = (np.array(column) for column in zip(*slices.values(), strict=True))
    count = 161
    z = reach[:, None] * np.linspace(-1.0, 1.0, count)
    along = np.einsum("sd,sd->s", centre, directions[axis])[:, None] + z
    level = centre[:, None] + z[..., None] * directions[axis][:, None]
    points = np.empty((4, count, count, 3))
    points[..., :2] = level[:, None]
    points[..., 2] = z[..., None]
    temperature = temperature_at(state, points.reshape(-1, 3)).reshape(points.shape[:-1])
    return labelled(
        {"temperature": (("slice", "z", "place"), temperature)},
        coordinates={
            "slice": list(slices),
            "axis": ("slice", np.array(names)[axis]),
            "along_um": (("slice", "place"), along),
            "z_um": (("slice", "z"), z),
        },
        lever=lever.probe.title,
        bias_V=state.bias_V,
        tip_K=state.tip_K,
        base_K=state.lever.circuit.base_temperature_K,
        air_heat_mW=float(heat.sum()),
        heat_at_infinity_mW=lever.space.air.operator.at_infinity(coefficients),
    )


def _solid(state: State) -> SolidLever:
    if not isinstance(state.lever, SolidLever):
        raise InputError("a state of a flat lever, expected one of a SolidLever")
    return state.lever


def heat_by_region(state: State) -> dict[str, float]:
    """Return the heat (mW) that each region of the lever gives to the air.

    A node on the border of regions gives to each by its share of the surface around the node.
    """
    lever = _solid(state)
    heat = np.zeros(lever.space.elements.size)
    lost = lever.in_the_air(state)[1]
    mesh, basis = lever.solid.elements, lever.space.elements.basis
    heat[surface_nodes(lever.space.elements, lever.space.air.operator)] = lost
    facets = mesh.boundary_facets()
    a, b, c = np.moveaxis(mesh.p[:, mesh.facets[:, facets]], 1, 0)
    area = np.linalg.norm(np.cross((b - a).T, (c - a).T), axis=1) / 2
    names = [region.name for region in lever.solid.layout.regions]
    region = lever.solid.region[mesh.f2t[0, facets]]
    nodes = np.concatenate(
        [basis.nodal_dofs[0, mesh.facets[:, facets]], basis.edge_dofs[0, mesh.f2e[:, facets]]]
    )
    share = np.zeros((len(names), heat.size))
    np.add.at(share, (region, nodes), area)
    total = share.sum(axis=0)
    share = np.divide(share, total, out=np.zeros_like(share), where=total > 0)
    return dict(zip(names, (share @ heat).tolist(), strict=True))
