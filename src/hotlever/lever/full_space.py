"""The full lever: finite elements on a mesh.

The unknowns are the temperature and the potential at the nodes, without those held at the base
temperature or at ground; the nodes of a contact share one unknown, that of the swept supply the
lever voltage. Where nothing conducts there is no potential.
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
from hotlever.lever.elements import FacetPoints, FiniteElements
from hotlever.lever.films import placed_films
from hotlever.lever.linear_map import LinearMap
from hotlever.lever.rim import Rim
from hotlever.lever.space import Constraint, Space, SurfaceTangent, Tangent
from hotlever.lever.sparse import SparseFactors, SparseJacobian, numbered
from hotlever.probe.circuit import Circuit, Wiring
from hotlever.probe.layout import Part
from hotlever.probe.mesh import ProbeMesh
from hotlever.probe.solid import SolidMesh
from hotlever.types import Array, Index


class FullSpace(Space):
    """Unknowns, maps and matrix structure of one meshed layout.

    Parameters
    ----------
    mesh : ProbeMesh or SolidMesh
        Of triangles in the lever's plane, or of tetrahedra.
    elements : FiniteElements, optional
        Made on ``mesh.elements`` by default.
    wiring : Wiring, optional
        Which terminals are what; by default as in the paper.

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
        mesh: ProbeMesh | SolidMesh,
        elements: FiniteElements | None = None,
        wiring: Wiring | None = None,
    ) -> None:
        self.mesh = mesh
        self.wiring = wiring or Circuit().wiring(mesh.terminal_facets)
        self.elements = elements or FiniteElements(mesh.elements)
        self.end_nodes = {
            name: self.elements.facet_nodes(facets) for name, facets in mesh.terminal_facets.items()
        }
        ends = np.unique(np.concatenate(list(self.end_nodes.values())))
        insulates = np.array([region.insulates for region in mesh.layout.regions])
        self.conducting = ~insulates[mesh.region]
        # a contact is where a terminal meets a conductor
        conducts = np.unique(self.elements.dofs[self.conducting])
        self.contact_nodes = {
            name: np.intersect1d(nodes, conducts) for name, nodes in self.end_nodes.items()
        }
        self._T, self._V, self.size = numbered(
            self.elements, ends, conducts, self.contact_nodes, self.wiring
        )
        self.is_temperature = np.zeros(self.size + 1, dtype=bool)
        self.is_temperature[self._T[self._T >= 0]] = True
        # in the middle of the silicon's thickness
        (element,), (weights,), _ = self.elements.at_points(np.array([mesh.layout.tip]))
        self.tip = (self._T[self.elements.dofs[element]], weights)
        self.held = {name: int(self._V[self.contact_nodes[name][0]]) for name in self.wiring.held}
        unknowns = np.stack([self._T, self._V])
        self._jacobian = SparseJacobian(self.elements, unknowns, self.size, self.held, self.tip)
        self._losses: dict[str, csr_matrix] = {}
        self.air = AirLoss.nothing(self.size + 1)
        measurable = "reader" in self.wiring.measurable
        self.reader = self.potential_at("reader") if measurable else None
        sampling, points = self.elements.sampling, self.elements.weights.size
        kinds = 1 + len(self.elements.positions)
        self.temperature = LinearMap(sampling @ self._selection(self._T), kinds)
        self.potential = LinearMap(sampling[points:] @ self._selection(self._V), kinds - 1)
        self.weights = self.elements.weights[:, None]
        self.end_test = self._sampled_sum(ends).reshape(kinds, points)
        self.end_tests = {
            name: self._sampled_sum(nodes).reshape(kinds, points)
            for name, nodes in self.end_nodes.items()
        }
        self.charge_tests = {
            name: self._sampled_sum(nodes).reshape(kinds, points)[1:]
            for name, nodes in self.contact_nodes.items()
        }
        region = np.repeat(mesh.region, self.elements.per_element)
        self.films, self.thickness_um, self.plate_um = placed_films(mesh, self.elements)
        parts = np.array([region.part for region in mesh.layout.regions])[region]
        self.parts = {part: np.flatnonzero(parts == part) for part in get_args(Part)}

    # --- where things are -------------------------------------------------------------------------

    def potential_at(self, name: str) -> tuple[Index, Array]:
        """Return unknowns and weights that give the mean potential of a terminal."""
        nodes = self.contact_nodes[name]
        return self._V[nodes], np.full(nodes.size, 1.0 / nodes.size)

    def _selection(self, unknowns: Index) -> csr_matrix:
        """Return the matrix from unknowns to nodal values, those held being zero."""
        nodes = np.flatnonzero(unknowns >= 0)
        return csr_matrix(
            (np.ones(nodes.size), (nodes, unknowns[nodes])), shape=(unknowns.size, self.size + 1)
        )

    def _sampled_sum(self, nodes: Index) -> Array:
        """Return values and slopes of the sum of some nodes' functions."""
        indicator = np.zeros(self.elements.size)
        indicator[nodes] = 1.0
        return np.asarray(self.elements.sampling @ indicator)

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

    def from_nodal(self, rise: Array, potential: Array, lever_V: float) -> Array:
        """Return the state with these nodal rises (K) and potentials (V)."""
        x = np.zeros(self.size + 1)
        for unknowns, values in ((self._T, rise), (self._V, potential)):
            free = (unknowns >= 0) & (unknowns < self.size)
            x[unknowns[free]] = values[free]
        x[-1] = lever_V
        return x

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
        return rises @ self._selection(self._T) + potentials @ self._selection(self._V)

    @cached_property
    def rim(self) -> Rim:
        """The surface at which the mesh ends."""
        return Rim.of(self.mesh, self.elements, self._selection(self._T), self.end_nodes)

    @cached_property
    def footprint(self) -> Rim:
        """Points of the circle on which the tip stands, whose weights are shares of its area."""
        layout = self.mesh.layout
        if layout.cone is None:
            return Rim.nothing(self.size)
        return Rim.under_a_cone(layout, self.elements, self._selection(self._T))

    def _losses_at(self, name: str) -> csr_matrix:
        """Return the matrix from slopes of what leaves at the rim or footprint to the entries."""
        if name not in self._losses:
            facets: FacetPoints = getattr(self, name).facet_points
            self._losses[name] = self._jacobian.of_losses(facets.elements, facets.shares)
        return self._losses[name]

    # --- the air ----------------------------------------------------------------------------------

    def in_vacuum(self) -> FullSpace:
        """Return the same space in vacuum; everything is shared."""
        space = copy(self)
        space.air = AirLoss.nothing(self.size + 1)
        return space

    def in_air(self, air: AirOperator, around: Callable[[float], HeatInAir]) -> FullSpace:
        """Return the same space with this air around it; everything is shared.

        What the air takes up in time is made once it is asked for.
        """
        element, shares, _ = self.elements.at_points(air.sites)
        losses = self._jacobian.of_losses(element, shares)
        unknowns = self._T[self.elements.dofs[element]]
        space = copy(self)
        space.air = AirLoss(air, unknowns, shares, losses, self.size + 1)
        space.air.around = around
        return space

    def in_gas(self, conductivity: float) -> FullSpace:
        """Return the same space in a gas that conducts so many times as well as air."""
        space = copy(self)
        space.air = self.air.in_gas(conductivity)
        return space

    def in_air_at_nodes(self, air: Any, surface: Index) -> FullSpace:
        """Return the same space in air whose sites are these nodes; everything is shared.

        The air is what has the attributes of an `AirOperator`.
        """
        # any element around a node will do
        _, first = np.unique(self.elements.dofs, return_index=True)
        nodes = self.elements.dofs.shape[1]
        element, node = np.divmod(first[surface], nodes)
        losses = self._jacobian.of_losses(element, np.eye(nodes)[node])
        space = copy(self)
        shares = np.ones((surface.size, 1))
        space.air = AirLoss(air, self._T[surface, None], shares, losses, self.size + 1)
        return space

    def factorised(
        self, tangent: Tangent, surface: SurfaceTangent, constraint: Constraint, conductance: Array
    ) -> SparseFactors:
        """Put the Jacobians of all states together, the constraint last, and factorise."""
        solvers = []
        for state in range(tangent.sigma.shape[-1]):
            kappa = surface.kappa[:, state]
            entries = self._jacobian.entries(tangent.of(state), conductance)
            entries += self.air.local_entries(kappa)
            for name, slopes in surface.at_points.items():
                entries += self._losses_at(name) @ slopes[:, state]
            factors = self._jacobian.factorised(entries, constraint.among(state))
            solvers.append(self.air.solver(factors, kappa, surface.taken_up))
        return SparseFactors(solvers)
