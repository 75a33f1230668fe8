"""The full three-dimensional simulation: a lever of its true thickness, in vacuum or in still air.

The silicon uses the equations of `hotlever.lever` on tetrahedra; the air, Laplace's equation for
the Kirchhoff variable θ, is solved by NGSolve, the extra ``hotlever[air3d]``. Inside a sphere of
radius R the air is meshed as it is. All space outside is mapped into a ball of the same radius by
the Kelvin transform: a point at the distance r from the centre goes to r' = R²/r, and θ = (r'/R) w
with a smooth w that is harmonic in the ball. The energy of the outside is then ∫|∇w|² over the ball
plus (1/R) ∫w² over its surface (E. M. Freeman and D. A. Lowther, IEEE Trans. Magn. 25, 4135 (1989),
with the factor r'/R taken out). At infinity θ = 0; the heat that arrives there is 4π R w(0).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Self

import meshio
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator
from scipy.spatial import KDTree
from skfem.element import ElementTetP2

from hotlever.air.bodies import lever_axes
from hotlever.cache import cache_file, store_arrays, stored
from hotlever.datasets import labelled
from hotlever.errors import ComputationError, InputError, as_far_as_possible
from hotlever.files import whole_file
from hotlever.lever.branch import Branch, Reading, there_and_back
from hotlever.lever.dataset import at_bias, checked_bias, with_ramp
from hotlever.lever.elements import FiniteElements
from hotlever.lever.fields import Surface, fields_file, seen_from_above, write_fields
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import Lever, State
from hotlever.materials.air import temperature_from_kirchhoff
from hotlever.probe import Layout, Probe, Wiring
from hotlever.probe.mesh import (
    SolidMesh,
    SolidMeshOptions,
    material_names,
    mesh_solid,
    middle_and_reach,
)
from hotlever.types import Array, Index, Progress
from hotlever.units import PER_CM_TO_MILLI_PER_UM


@lru_cache(maxsize=2)
def _in_vacuum(layout: Layout, mesh: SolidMeshOptions | None, wiring: Wiring) -> FullSpace:
    """Return mesh and operators of a layout in vacuum; levers of one shape share them."""
    return _space(mesh_solid(layout, mesh, wiring=wiring), wiring)


def _space(solid: SolidMesh, wiring: Wiring) -> FullSpace:
    return FullSpace(solid, FiniteElements(solid.elements, ElementTetP2(), 4), wiring)


class SolidLever(Lever):
    """A lever of tetrahedra; everything else is as with `Lever`.

    States at a bias are solved from those of the flat lever, which are a kelvin or two away, and
    kept in the cache: a sweep that was stopped goes on where it was.

    Parameters
    ----------
    probe : Probe or path
        Its surroundings say whether it is in vacuum or in air, and then in free space.
    mesh : SolidMeshOptions, optional
    sphere_radius_um : float, optional
        Radius of the meshed air around the lever: the paper's 60 µm by default, or more around a
        large lever. The air reaches to infinity with any radius.
    air_order : int
        Order of the elements in the air, 2 or more; on the lever θ is quadratic.

    Raises
    ------
    InputError
        If the sphere does not hold the lever, NGSolve is not installed, or the surroundings are
        more than free space.
    """

    def __init__(
        self,
        probe: Probe | str | os.PathLike[str],
        mesh: SolidMeshOptions | None = None,
        *,
        sphere_radius_um: float | None = None,
        air_order: int = 3,
    ) -> None:
        self._options: dict[str, Any] = {
            "mesh": mesh,
            "sphere_radius_um": sphere_radius_um,
            "air_order": air_order,
        }
        self.probe = Probe.coerce(probe)
        self.space = self._meshed(**self._options)
        self._prepare()

    def _meshed(
        self, mesh: SolidMeshOptions | None, sphere_radius_um: float | None, air_order: int
    ) -> FullSpace:
        """Mesh the silicon, and the air around it if there is any: one mesh for both."""
        in_air = self.medium == "air"
        if in_air:
            ngsolve()  # says what to install, before the meshing
            around = self.probe.surroundings
            if around != type(around)(medium="air", gas_conductivity=around.gas_conductivity):
                raise InputError(
                    "[surroundings]: the full 3-D simulation knows free space only; expected no "
                    "surface below, no chip and no temperature jump"
                )
        layout = self.probe.layout()
        if any(region.films for region in layout.regions):
            raise InputError(
                "[layers]: the full 3-D simulation knows one material across the thickness, "
                "expected a lever without films"
            )
        # the radius of the paper (µm), or twice as far as a lever reaches from its middle
        radius = sphere_radius_um or max(60.0, 2.0 * middle_and_reach(layout)[1])
        wiring = self.probe.wiring
        if not in_air:
            return _in_vacuum(layout, mesh, wiring)
        solid = mesh_solid(layout, mesh, sphere_radius_um=radius, wiring=wiring)
        space = _space(solid, wiring)
        air = OpenAir(solid.netgen, solid.centre, radius, order=air_order)
        space = space.in_air_at_nodes(air, surface_nodes(space.elements, air))
        return self._surrounded(space)

    def _surrounded(self, space: FullSpace, progress: Progress | None = None) -> FullSpace:
        """Return the space in the probe's gas: in free space the air is the same at any base."""
        return space.with_air(space.air.in_gas(self.probe.surroundings.gas_conductivity))

    def with_probe(self, probe: Probe) -> Self:
        """Return the lever of a probe of the same shape and tip; another medium is meshed anew."""
        if probe.surroundings.medium != self.medium:
            return type(self)(probe, **self._options)
        other = super().with_probe(probe)
        other._flat = self._flat.with_probe(probe)
        return other

    def sweep(
        self,
        bias: ArrayLike,
        *,
        sensitivities: bool = False,
        and_back: bool = False,
        progress: Progress | None = None,
    ) -> xr.Dataset:
        """Solve the lever at each of some biases; see `Lever.sweep`.

        Sensitivities are those of the flat lever.
        """
        values = checked_bias(bias, self.probe, and_back)
        every = there_and_back(values) if and_back else values
        states, failure = as_far_as_possible(
            lambda: self.solve(values, progress, and_back=and_back)
        )
        notes = self._flat.read(values, and_back=and_back)[1].notes(values)
        data = at_bias(self.dataset(states, notes), every[: len(states)])
        if and_back:
            data = with_ramp(data, np.arange(len(states)) < values.size)
        if sensitivities:
            flat = self._flat.sweep(values[: len(states)], sensitivities=True, and_back=and_back)
            data = data.assign(sensitivity=flat.sensitivity)
        if failure is not None:
            failure.partial = data
            raise failure
        return data

    # --- from the flat lever ----------------------------------------------------------------------

    @cached_property
    def _flat(self) -> Lever:
        return Lever(self.probe)

    @cached_property
    def _from_flat(self) -> csr_matrix:
        """The matrix from nodal values of the flat lever to those of this one."""
        flat = self._flat.space.elements
        return flat.interpolation(self.space.elements.nodes[:2].T)[0]

    def read(
        self, bias: Array, progress: Progress | None = None, *, and_back: bool = False
    ) -> tuple[Branch, Reading, ComputationError | None]:
        """Return the branch of the flat lever; see `Lever`."""
        return self._flat.read(bias, progress, and_back=and_back)

    def _state_at(self, branch: Branch, u: float, bias: float) -> State:
        """Return a state from the cache, or solve it from that of the flat lever."""
        solved = self.probe.model_copy(update={"monitor": None})
        facts: dict[str, Any] = {"probe": solved.sections(), "bias_V": bias}
        facts["nodes"] = self.space.elements.nodes
        if self.medium == "air":
            air = self.space.air.operator
            facts["air"] = [air.radius_um, air.order, air.size]
        file = cache_file("states", facts)
        x = stored(file, lambda arrays: arrays["x"])
        if x is not None and len(x) == self.space.size + 1:
            return State(self, x)
        flat = self._flat._state_at(branch, u, bias)
        T, V = (self._from_flat @ values for values in flat.nodal)
        base = self.circuit.base_temperature_K
        guess = self.space.from_nodal(T - base, V, flat.lever_V)[:, None]
        state = self.polished(guess, bias, branch.parametrisation.constraint(np.array([u])))
        store_arrays(file, {"x": state.x})
        return state

    # --- what only a solid has --------------------------------------------------------------------

    @property
    def solid(self) -> SolidMesh:
        """The mesh of the silicon, and of the air around it."""
        mesh = self.space.mesh
        assert isinstance(mesh, SolidMesh)
        return mesh

    def in_the_air(self, state: State) -> tuple[Array, Array]:
        """Return what a state gives to the air.

        Returns
        -------
        coefficients : ndarray
            Of θ in the air (mW/µm); see `OpenAir`.
        heat : ndarray
            From each node of the silicon's surface (mW), in the order of `OpenAir`.

        Raises
        ------
        InputError
            If the lever is in vacuum.
        """
        if self.medium == "vacuum":
            raise InputError("this lever is in vacuum: it gives no heat to air")
        coefficients, heat = self.space.air.operator.solve(
            self.equations.kirchhoff(state.x)[0][:, 0]
        )
        return coefficients, heat


def surface_nodes(of_silicon: FiniteElements, air: OpenAir) -> Index:
    """Return the numbers of the silicon's nodes on its surface, in the order of the air's.

    Raises
    ------
    ComputationError
        If the two meshes do not match.
    """
    away, nodes = KDTree(of_silicon.nodes.T).query(air.sites)
    if away.max() > 1e-6:
        raise ComputationError("the air does not touch the silicon node by node")
    return np.asarray(nodes)


# --- fields: on all vertices, on slices, by region ------------------------------------------------


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


# --- the air --------------------------------------------------------------------------------------


def ngsolve() -> Any:
    """Import NGSolve.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        import ngsolve
    except ImportError:
        raise InputError(
            "the full 3-D simulation in air needs NGSolve: install it with "
            "pip install 'hotlever[air3d]'"
        ) from None
    return ngsolve


class OpenAir:
    """The linear operator from θ on a body's surface to the heat it gives to the air.

    Parameters
    ----------
    mesh : netgen.meshing.Mesh
        Made by `hotlever.probe.mesh.in_a_sphere`: air and image ball, surfaces named.
    centre : tuple of float
        Of the sphere (µm).
    radius_um : float
        Radius of the sphere.
    order : int
        Of the elements in the air, 2 or more. On the body θ is quadratic.

    Attributes
    ----------
    size : int
        Unknowns, those on the body included.
    vertices : ndarray of int, shape (n,)
        Vertices of the mesh on the body.
    edges : ndarray of int, shape (m, 2)
        Edges of the mesh on the body, each by its vertices, the smaller one first.
    """

    filling = 0.0  # no air is modelled inside the silicon

    def __init__(
        self,
        mesh: Any,
        centre: tuple[float, float, float],
        radius_um: float,
        *,
        order: int = 2,
    ) -> None:
        ng = ngsolve()
        self.centre, self.radius_um, self.order = centre, radius_um, order
        self.mesh = ng.Mesh(mesh)
        self.mesh.Curve(2)
        self.space = ng.Periodic(ng.H1(self.mesh, order=order, definedon="air|image"))
        trial, test = self.space.TnT()
        form = ng.BilinearForm(self.space, symmetric=True)
        for part in ("air", "image"):
            form += ng.grad(trial) * ng.grad(test) * ng.dx(part)
        form += (1.0 / radius_um) * trial * test * ng.ds("sphere")
        form.Assemble()
        rows, columns, values = form.mat.COO()
        shape = (self.space.ndof, self.space.ndof)
        self._matrix = csr_matrix(
            (np.array(values), (np.array(rows), np.array(columns))), shape=shape
        )
        diagonal = self._matrix.diagonal()
        self.size = int(np.count_nonzero(diagonal))
        free = diagonal != 0
        free[self._lay_out_surface(ng)] = False
        self._inverse = form.mat.Inverse(ng.BitArray(free.tolist()), inverse="sparsecholesky")
        self._right, self._left = form.mat.CreateColVector(), form.mat.CreateColVector()
        self._form = form  # the inverse refers to its matrix

    def _lay_out_surface(self, ng: Any) -> Index:
        """Number the body's nodes, vertices first, and map their values to coefficients.

        Returns the degrees of freedom on the body, which θ there determines.
        """
        surface = self.mesh.Boundaries("lever")
        vertices = {vertex.nr for face in surface.Elements() for vertex in face.vertices}
        edges = {edge.nr: edge for face in surface.Elements() for edge in face.edges}
        ordered = [edges[number] for number in sorted(edges)]
        ends = [sorted(vertex.nr for vertex in self.mesh[edge].vertices) for edge in ordered]
        self.vertices = np.array(sorted(vertices), dtype=np.intp)
        self.edges = np.array(ends, dtype=np.intp).reshape(-1, 2)
        of_vertices = self._vertex_dofs(ng, self.vertices)
        of_edges = np.array([self.space.GetDofNrs(edge)[0] for edge in ordered], dtype=np.intp)
        # hierarchical basis: an edge's function is zero at its ends and `peak` in its middle
        peak = float(ng.fem.H1FE(ng.ET.SEGM, 2).CalcShape(0.5)[2])
        count, more = len(of_vertices), len(of_edges)
        values = np.repeat([1.0, 1.0 / peak, -0.5 / peak], [count, more, 2 * more])
        rows = np.concatenate([of_vertices, of_edges, of_edges, of_edges])
        at_ends = np.searchsorted(self.vertices, self.edges).T.ravel()
        columns = np.concatenate([np.arange(count + more), at_ends])
        self._to_coefficients = csr_matrix(
            (values, (rows, columns)), shape=(self.space.ndof, count + more)
        )
        return np.flatnonzero(list(self.space.GetDofs(surface)))

    def _vertex_dofs(self, ng: Any, vertices: Iterable[int]) -> Index:
        """Return the degree of freedom of each of some vertices, negative where there is no air."""
        nodes = (ng.NodeId(ng.VERTEX, int(vertex)) for vertex in vertices)
        return np.array([self.space.GetDofNrs(node)[0] for node in nodes], dtype=np.intp)

    @property
    def matrix(self) -> LinearOperator:
        """The operator from θ to heat, for `hotlever.air.coupling.AirLoss`."""
        return self.less(np.zeros(self._to_coefficients.shape[1]))

    @property
    def sites(self) -> Array:
        """The body's nodes, shape (n + m, 3) (µm)."""
        points = np.array(self.mesh.ngmesh.Coordinates())
        return np.concatenate([points[self.vertices], points[self.edges].mean(axis=1)])

    def less(self, diagonal: Array) -> LinearOperator:
        """Return the operator less a diagonal matrix."""

        def product(theta: Array) -> Array:
            theta = theta.ravel()
            heat: Array = self.solve(theta)[1] - diagonal * theta
            return heat

        return LinearOperator((diagonal.size, diagonal.size), matvec=product, dtype=float)

    def solve(self, theta: Array) -> tuple[Array, Array]:
        """Solve the air for θ on the body.

        Parameters
        ----------
        theta : ndarray, shape (n + m,)
            At the vertices and then in the middles of the edges.

        Returns
        -------
        coefficients : ndarray
            Of θ in the air and of w in the image ball.
        heat : ndarray, shape (n + m,)
            Heat given to the air at each node (θ times µm): the reactions, whose sum is the
            total.
        """
        coefficients = self._to_coefficients @ theta
        self._right.FV().NumPy()[:] = -(self._matrix @ coefficients)
        self._left.data = self._inverse * self._right
        coefficients += self._left.FV().NumPy()
        return coefficients, self._to_coefficients.T @ (self._matrix @ coefficients)

    def at_infinity(self, coefficients: Array) -> float:
        """Return the heat that arrives at infinity (θ times µm), by the value of w at zero."""
        x, y, z = self.centre
        field = ngsolve().GridFunction(self.space)
        field.vec.FV().NumPy()[:] = coefficients
        w = field(self.mesh(x + 3 * self.radius_um, y, z))
        return float(4 * np.pi * self.radius_um * w)

    def at_vertices(self, coefficients: Array) -> Array:
        """Return a solution at all vertices of the mesh; zero where there is no air."""
        dofs = self._vertex_dofs(ngsolve(), range(self.mesh.nv))
        return np.where(dofs >= 0, coefficients[dofs], 0.0)
