"""A lever of its true thickness, in vacuum or in still air."""

from __future__ import annotations

import os
from functools import cached_property, lru_cache
from typing import Any, Self

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix
from scipy.spatial import KDTree
from skfem.element import ElementTetP2

from hotlever.cache import cache_file, store_arrays, stored
from hotlever.errors import ComputationError, InputError, as_far_as_possible
from hotlever.lever.branch import Branch
from hotlever.lever.dataset import at_bias, checked_bias, with_ramp
from hotlever.lever.elements import FiniteElements
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import Lever, State
from hotlever.lever.readings import Reading, there_and_back
from hotlever.lever3d.still_air import OpenAir, ngsolve
from hotlever.probe import Layout, Probe, Wiring
from hotlever.probe.mesh import SolidMesh, SolidMeshOptions, mesh_solid, middle_and_reach
from hotlever.types import Array, Index, Progress


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
