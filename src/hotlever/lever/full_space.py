"""The full lever: finite elements on a mesh.

The unknowns are the temperature and the potential at the nodes, without those held at the base
temperature or at ground; the nodes of a contact share one unknown, that of the swept supply the
lever voltage, and so do leg ends on a chip that gets warmer. Where nothing conducts there is no
potential.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from functools import cached_property
from typing import Any, get_args

import numpy as np
from scipy.sparse import csr_matrix

from hotlever.air.coupling import AirLoss
from hotlever.air.operator import AirOperator
from hotlever.air.stores import HeatInAir
from hotlever.lever.elements import FacetPoints, FiniteElements, LinearMap, numbered
from hotlever.lever.factorisation import FactorisationOptions
from hotlever.lever.layers_at_points import Rim, placed_films
from hotlever.lever.space import Constraint, Space, SurfaceTangent
from hotlever.lever.sparse_jacobian import ElementLosses, SparseJacobian
from hotlever.lever.transport import Tangent
from hotlever.probe.circuit import Circuit, Wiring
from hotlever.probe.layout import Part
from hotlever.probe.mesh import ProbeMesh
from hotlever.types import Array, Index, LinearSolver, Mask


class FullSpace(Space):
    """Unknowns, maps and matrix structure of one meshed layout.

    Parameters
    ----------
    mesh : ProbeMesh
        Of triangles in the lever's plane, or of tetrahedra.
    elements : FiniteElements, optional
        Made on ``mesh.elements`` by default.
    wiring : Wiring, optional
        Which terminals are what; by default as in the paper.
    factorisation : FactorisationOptions, optional
        How Jacobians are factorised.

    Attributes
    ----------
    end_nodes, contact_nodes : dict of str to ndarray of int
        Nodes of each terminal, and those of them that conduct.
    parts : dict of str to ndarray of int
        Quadrature points of the regions of each part.
    conducting : ndarray of bool, shape (elements,)
        Where a current may flow.
    charge_tests : dict of str to ndarray, shape (dimension, points)
        Slopes of the function that is one where each terminal conducts.
    """

    def __init__(
        self,
        mesh: ProbeMesh,
        elements: FiniteElements | None = None,
        wiring: Wiring | None = None,
        factorisation: FactorisationOptions | None = None,
    ) -> None:
        self.wiring = wiring or Circuit().wiring(mesh.terminal_facets)
        self.elements = elements or FiniteElements(mesh.elements)
        self.end_nodes = {
            name: np.asarray(self.elements.basis.get_dofs(facets).flatten(), dtype=np.intp)
            for name, facets in mesh.terminal_facets.items()
        }
        ends = np.unique(np.concatenate(list(self.end_nodes.values())))
        insulates = np.array([region.insulates for region in mesh.layout.regions])
        self.conducting = ~insulates[mesh.region]
        # a contact is where a terminal meets a conductor
        conducts = np.unique(self.elements.dofs[self.conducting])
        self.contact_nodes = {
            name: np.intersect1d(nodes, conducts) for name, nodes in self.end_nodes.items()
        }
        on_chip = np.unique(
            np.concatenate([ends[:0], *(self.end_nodes[name] for name in self.wiring.on_chip)])
        )
        self._T, self._V, self.size = numbered(
            self.elements, ends, conducts, self.contact_nodes, self.wiring, on_chip
        )
        self.is_temperature = np.zeros(self.size + 1, dtype=bool)
        self.is_temperature[self._T[self._T >= 0]] = True
        self.held = {name: int(self._V[self.contact_nodes[name][0]]) for name in self.wiring.held}
        self.chip = (self._T[on_chip[:1]], np.ones(1)) if on_chip.size else None
        self.air = AirLoss.nothing(self.size + 1)
        self.reader = None
        if "reader" in self.wiring.measurable:
            nodes = self.contact_nodes["reader"]
            self.reader = self._V[nodes], np.full(nodes.size, 1.0 / nodes.size)
        self._place(mesh)
        unknowns = np.stack([self._T, self._V])
        behind = [*self.held.values(), *(self._T[on_chip[:1]].tolist())]
        self._jacobian = SparseJacobian(
            self.elements, unknowns, self.size, behind, self.tip, factorisation
        )

    def _place(self, mesh: ProbeMesh) -> None:
        """Take up where the elements are on a mesh, and what that makes of the maps."""
        self.mesh, self._losses = mesh, dict[str, ElementLosses]()
        # in the middle of the silicon's thickness
        (element,), (weights,), _ = self.elements.at_points(np.array([mesh.layout.tip]))
        self.tip = (self._T[self.elements.dofs[element]], weights)
        sampling, points = self.elements.sampling, self.elements.weights.size
        kinds = 1 + len(self.elements.positions)
        self.temperature = LinearMap(sampling @ _selection(self._T, self.size), kinds)
        self.potential = LinearMap(sampling[points:] @ _selection(self._V, self.size), kinds - 1)
        self.weights = self.elements.weights[:, None]
        ends = np.unique(np.concatenate(list(self.end_nodes.values())))
        self.end_test = _sampled_sum(self.elements, ends)
        self.end_tests = {
            name: _sampled_sum(self.elements, nodes) for name, nodes in self.end_nodes.items()
        }
        self.charge_tests = {
            name: _sampled_sum(self.elements, nodes)[1:]
            for name, nodes in self.contact_nodes.items()
        }
        region = np.repeat(mesh.region, self.elements.per_element)
        placed = placed_films(mesh.layout, region, self.elements.positions)
        self.films, self.thickness_um, self.plate_um = placed
        parts = np.array([region.part for region in mesh.layout.regions])[region]
        self.parts = {part: np.flatnonzero(parts == part) for part in get_args(Part)}

    def moved(self, mesh: ProbeMesh) -> FullSpace:
        """Return the same unknowns on the same mesh with its vertices elsewhere, in vacuum."""
        space = copy(self)
        for found in ("rim", "footprint"):
            vars(space).pop(found, None)
        basis = self.elements.basis
        space.elements = FiniteElements(mesh.elements, basis.elem, (basis.X, basis.W))
        space.air = AirLoss.nothing(self.size + 1)
        space._place(mesh)
        space._jacobian = self._jacobian.moved(space.elements, space.tip)
        return space

    # --- where things are -------------------------------------------------------------------------

    def nodal(
        self, x: Array, base_temperature_K: float, end_rises: Mapping[str, float] | None = None
    ) -> tuple[Array, Array]:
        """Return temperature (K) and potential (V) of a state at all nodes, each (nodes,).

        Some leg ends may be warmer than the base temperature.
        """
        rises = self.nodal_rises(x[:, None], end_rises)[:, 0]
        return base_temperature_K + rises, np.where(self._V >= 0, x[self._V], 0.0)

    def nodal_rises(self, x: Array, end_rises: Mapping[str, float] | None = None) -> Array:
        """Return the rises of the temperature (K) of states at all nodes, (nodes, n)."""
        rises = np.where((self._T >= 0)[:, None], x[self._T], 0.0)
        for name, rise in (end_rises or {}).items():
            rises[self.end_nodes[name]] += rise
        return rises

    def from_nodal(self, rise: Array, potential: Array, lever_V: float | Array) -> Array:
        """Return the state with these nodal rises (K) and potentials (V), or several of them."""
        x = np.zeros((self.size + 1, *rise.shape[1:]))
        for unknowns, values in ((self._T, rise), (self._V, potential)):
            free = (unknowns >= 0) & (unknowns < self.size)
            x[unknowns[free]] = values[free]
        x[-1] = lever_V
        return x

    def prolonged(self, coarse: FullSpace, x: Array) -> Array:
        """Return states (size + 1, n) of another mesh of the same lever, interpolated on this."""
        at_nodes, _ = coarse.elements.interpolation(self.elements.nodes.T)
        nothing = csr_matrix(at_nodes.shape)
        rise = coarse.combined(at_nodes, nothing) @ x
        return self.from_nodal(rise, coarse.combined(nothing, at_nodes) @ x, x[-1])

    def rises(self, x: Array) -> Array:
        """Return the free rises of the temperature (K), (nodes, n), of states."""
        return x[self.is_temperature]

    def rise_at(self, points: Array, x: Array) -> Array:
        """Return the rise of the temperature (K) at points (k, 2) in states, (k, n)."""
        return np.asarray(self.elements.interpolation(points)[0] @ self.nodal_rises(x))

    @property
    def full(self) -> FullSpace:
        """It is no reduced one."""
        return self

    def combined(self, rises: csr_matrix, potentials: csr_matrix) -> csr_matrix:
        """Return the map from the unknowns to combinations of what is at the nodes, (k, nodes)."""
        return rises @ _selection(self._T, self.size) + potentials @ _selection(self._V, self.size)

    @cached_property
    def rim(self) -> Rim:
        """The surface at which the mesh ends."""
        return Rim.of(self.mesh, self.elements, _selection(self._T, self.size), self.end_nodes)

    @cached_property
    def footprint(self) -> Rim:
        """Points of the circle on which the tip stands, whose weights are shares of its area."""
        layout = self.mesh.layout
        if layout.cone is None:
            return Rim.nothing(self.size)
        return Rim.under_a_cone(layout, self.elements, _selection(self._T, self.size))

    def _losses_at(self, name: str) -> ElementLosses:
        """Return the losses at the points of the rim or footprint."""
        if name not in self._losses:
            facets: FacetPoints = getattr(self, name).facet_points
            self._losses[name] = ElementLosses(facets.elements, facets.shares)
        return self._losses[name]

    # --- the air ----------------------------------------------------------------------------------

    def with_air(self, air: AirLoss) -> FullSpace:
        """Return the same space with another loss to the air; everything else is shared."""
        space = copy(self)
        space.air = air
        return space

    def in_vacuum(self) -> FullSpace:
        """Return the same space in vacuum."""
        return self.with_air(AirLoss.nothing(self.size + 1))

    def in_air(self, air: AirOperator, around: Callable[[float], HeatInAir]) -> FullSpace:
        """Return the same space with this air around it.

        What the air takes up in time is made once it is asked for.
        """
        element, shares, _ = self.elements.at_points(air.sites)
        loss = self._loss_to(air, element, shares)
        loss.around = around
        return self.with_air(loss)

    def in_air_at_nodes(self, air: Any, surface: Index) -> FullSpace:
        """Return the same space in air whose sites are these nodes.

        The air is what has the attributes of an `AirOperator`.
        """
        # any element around a node will do
        _, first = np.unique(self.elements.dofs, return_index=True)
        nodes = self.elements.dofs.shape[1]
        element, node = np.divmod(first[surface], nodes)
        return self.with_air(self._loss_to(air, element, np.eye(nodes)[node]))

    def _loss_to(self, air: Any, element: Index, shares: Array) -> AirLoss:
        """Return the loss to air at sites in elements, with their basis functions there."""
        unknowns = self._T[self.elements.dofs[element]]
        losses = ElementLosses(element, shares)
        return AirLoss(air, unknowns, shares, self.size + 1, losses.add_to)

    def factorised(
        self, tangent: Tangent, surface: SurfaceTangent, constraint: Constraint, conductance: Array
    ) -> SparseFactors:
        """Put the Jacobians of all states together, the constraint last, and factorise."""
        solvers = []
        for state in range(tangent.sigma.shape[-1]):
            kappa = surface.kappa[:, state]
            matrices = self._jacobian.element_matrices(tangent.of(state))
            self.air.add_local_loss(matrices, kappa)
            for name, slopes in surface.at_points.items():
                self._losses_at(name).add_to(matrices, slopes[:, state])
            own_constraint = constraint.among(state)
            factors = self._jacobian.factorised(matrices, conductance, own_constraint)
            solvers.append(self.air.solver(factors, kappa, surface.taken_up, surface.left))
        return SparseFactors(solvers)


def _selection(unknowns: Index, size: int) -> csr_matrix:
    """Return the matrix from unknowns to nodal values, those held being zero."""
    nodes = np.flatnonzero(unknowns >= 0)
    entries = np.ones(nodes.size), (nodes, unknowns[nodes])
    return csr_matrix(entries, shape=(unknowns.size, size + 1))


def _sampled_sum(elements: FiniteElements, nodes: Index) -> Array:
    """Return values and slopes of the sum of some nodes' functions, (kinds, points)."""
    indicator = np.zeros(elements.size)
    indicator[nodes] = 1.0
    return np.asarray((elements.sampling @ indicator).reshape(-1, elements.weights.size))


class SparseFactors:
    """The factorised Jacobian of each of some states; see `Factors`."""

    def __init__(self, solvers: list[LinearSolver]) -> None:
        self._solvers = solvers

    def solve(self, right_hand_side: Array, states: Index, *, transposed: bool = False) -> Array:
        """Solve for right-hand sides (size + 1, n) or (size + 1, n, k) of these n states."""
        solution = np.empty_like(right_hand_side)
        for column, state in enumerate(states):
            of_state = right_hand_side[:, column]
            solution[:, column] = self._solvers[state].solve(of_state, transposed)
        return solution

    def replaced(self, states: Index, other: SparseFactors) -> SparseFactors:
        """Return the same factors, those of some states taken from others, in their order."""
        solvers = dict(enumerate(self._solvers)) | dict(zip(states, other._solvers, strict=True))
        return SparseFactors(list(solvers.values()))

    def followed_by(self, other: SparseFactors) -> SparseFactors:
        """Return the same, and those of other states after them."""
        return SparseFactors(self._solvers + other._solvers)

    def among(self, states: Mask | Index) -> SparseFactors:
        """Return those of some states, by a mask or in an order."""
        chosen = np.arange(len(self._solvers))[states].tolist()
        return SparseFactors([self._solvers[state] for state in chosen])
