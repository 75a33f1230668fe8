"""A lever of its true thickness, in vacuum or in still air."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix
from scipy.spatial import KDTree
from skfem.element import ElementTetP2

from hotlever.cache import cache_file, store_arrays, stored
from hotlever.errors import ComputationError, InputError
from hotlever.lever.dataset import at_bias, checked_bias
from hotlever.lever.elements import FiniteElements
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import Lever, State
from hotlever.lever3d.still_air import OpenAir, ngsolve
from hotlever.probe import Probe
from hotlever.probe.solid import SolidMesh, SolidMeshOptions, mesh_solid, middle_and_reach
from hotlever.types import Array, Index, Progress

#: Radius of the sphere of air: that of the paper (µm), or so many times as far as a lever reaches
#: from its middle.
SPHERE_RADIUS, _ROOM = 60.0, 2.0
#: Nodes nearer than this (µm) are the same.
_SAME_UM = 1e-6


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
        self._options, self._sphere_radius_um, self._air_order = mesh, sphere_radius_um, air_order
        self.probe = Probe.coerce(probe)
        self.space = self._meshed()
        self._prepare()

    def _prepare(self) -> None:
        super()._prepare()
        # a copy for another probe has a flat lever of its own
        for name in ("_flat", "_from_flat"):
            vars(self).pop(name, None)

    def _meshed(self) -> FullSpace:
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
        radius = self._sphere_radius_um or max(SPHERE_RADIUS, _ROOM * middle_and_reach(layout)[1])
        sphere, wiring = radius if in_air else None, self.probe.wiring
        solid = mesh_solid(layout, self._options, sphere_radius_um=sphere, wiring=wiring)
        elements = FiniteElements(solid.elements, ElementTetP2(), 4)
        space = FullSpace(solid, elements, wiring)
        if not in_air:
            return space
        air = OpenAir(solid.netgen, solid.centre, radius, order=self._air_order)
        space = space.in_air_at_nodes(air, surface_nodes(space.elements, air))
        return space.in_gas(self.probe.surroundings.gas_conductivity)

    def _surrounded(self, space: FullSpace, progress: Progress | None = None) -> FullSpace:
        """Return the space in the probe's surroundings; air needs a mesh of its own."""
        return self._meshed()

    def solve(self, bias: ArrayLike, progress: Progress | None = None) -> list[State]:
        """Find the states that a slow ramp of the bias takes; see `Lever.solve`."""
        values = checked_bias(bias, self.circuit)
        try:
            guesses = self._flat.solve(values)
        except ComputationError as error:
            error.partial = self._from_guesses(values, error.partial, progress)
            raise
        return self._from_guesses(values, guesses, progress)

    def _from_guesses(
        self, values: Array, guesses: Sequence[State], progress: Progress | None
    ) -> list[State]:
        """Solve at some biases, as many as there are states of the flat lever."""
        states: list[State] = []
        for value, guess in zip(values.tolist(), guesses, strict=False):
            try:
                states.append(self._kept(value) or self._solved(value, guess))
            except ComputationError as error:
                error.partial = states
                raise
            if progress is not None:
                progress(len(states), values.size)
        return states

    def sweep(
        self,
        bias: ArrayLike,
        *,
        sensitivities: bool = False,
        progress: Progress | None = None,
    ) -> xr.Dataset:
        """Solve the lever at each of some biases; see `Lever.sweep`."""
        if sensitivities:
            raise InputError("sensitivities are known of the flat lever only")
        values = checked_bias(bias, self.circuit)
        try:
            states = self.solve(values, progress)
        except ComputationError as error:
            error.partial = self._table(values, error.partial)
            raise
        return self._table(values, states)

    def _table(self, values: Array, states: Sequence[State]) -> xr.Dataset:
        """Return what is observed of states, with the notes on jumps of the flat lever's ramp."""
        reading = self._flat.branch_to(float(values.max())).read(self.circuit, values)
        data = self.dataset(states, reading.notes(values))
        return at_bias(data, values[: len(states)])

    # --- from the flat lever ----------------------------------------------------------------------

    @cached_property
    def _flat(self) -> Lever:
        return Lever(self.probe)

    @cached_property
    def _from_flat(self) -> csr_matrix:
        """The matrix from nodal values of the flat lever to those of this one."""
        flat, nodes = self._flat.space.elements, self.space.elements.nodes
        element, shares, _ = flat.at_points(nodes[:2].T)
        rows = np.repeat(np.arange(len(element)), shares.shape[1])
        return csr_matrix(
            (shares.ravel(), (rows, flat.dofs[element].ravel())), shape=(len(element), flat.size)
        )

    def _solved(self, bias: float, flat: State) -> State:
        """Solve at a bias from the flat lever's state, and keep the result."""
        T, V = (self._from_flat @ values for values in flat.nodal)
        base = self.circuit.base_temperature_K
        guess = self.space.from_nodal(T - base, V, flat.lever_V)[:, None]
        branch = self._flat.branch_to(bias)
        u = branch.read(self.circuit, np.array([bias])).u
        state = self.polished(guess, bias, branch.parametrisation.constraint(u))
        store_arrays(self._file(bias), {"x": state.x})
        return state

    def _kept(self, bias: float) -> State | None:
        """Return the state at a bias that was solved before; None if there is none."""
        x = stored(self._file(bias), lambda arrays: arrays["x"])
        return None if x is None or len(x) != self.space.size + 1 else State(self, x)

    def _file(self, bias: float) -> Path | None:
        air = None if self.medium == "vacuum" else self.space.air.operator
        facts = {
            "probe": self.probe.sections(),
            "nodes": self.space.elements.nodes,
            "air": None if air is None else [air.radius_um, air.order, air.size],
            "bias_V": bias,
        }
        return cache_file("states", facts)

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
    if away.max() > _SAME_UM:
        raise ComputationError("the air does not touch the silicon node by node")
    return np.asarray(nodes)
