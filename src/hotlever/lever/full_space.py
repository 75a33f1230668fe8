"""The full lever: finite elements on a mesh, sparse Jacobians.

The unknowns are the temperature and the potential at the nodes, without those held at the base
temperature or at ground; the nodes of a contact share one unknown, that of the swept supply the
lever voltage. Where nothing conducts there is no potential.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from typing import Any, get_args

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import SuperLU, splu

from hotlever.air.coupling import AirLoss
from hotlever.air.operator import AirOperator
from hotlever.air.stores import HeatInAir
from hotlever.lever.elements import FiniteElements, sums_by_index
from hotlever.lever.space import (
    FAR,
    AirTangent,
    Constraint,
    LinearMap,
    PlacedFilm,
    Space,
    Tangent,
    at_some,
)
from hotlever.probe.circuit import Circuit, Wiring
from hotlever.probe.layout import Film, Layout, Part
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
        self._number_unknowns(ends, conducts)
        # in the middle of the silicon's thickness
        tip = np.zeros(len(self.elements.positions))
        tip[:2] = mesh.layout.tip
        (element,), (weights,), _ = self.elements.at_points(tip[None])
        self.tip = (self._T[self.elements.dofs[element]], weights)
        self.wired = self.wiring.contacts
        self.contacts = np.array([self._V[self.contact_nodes[name][0]] for name in self.wired], int)
        self._lay_out_matrix()
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
        self._place_films(region)
        parts = np.array([region.part for region in mesh.layout.regions])[region]
        self.parts = {part: np.flatnonzero(parts == part) for part in get_args(Part)}

    # --- where things are -------------------------------------------------------------------------

    def _number_unknowns(self, ends: Index, conducts: Index) -> None:
        """Give every nodal value its unknown, in an order with little fill.

        Values that are held get -1, the potential of the swept supply V_l; a contact has that of
        its first node.
        """
        order = _fill_reducing_order(self.elements.dofs, self.elements.size)
        nodes, wiring = self.contact_nodes, self.wiring
        free = np.zeros((2, self.elements.size), dtype=bool)
        free[0], free[1, conducts] = True, True
        free[0, ends] = free[1, nodes[wiring.swept]] = False
        for name in wiring.grounds:
            free[1, nodes[name]] = False
        for name in wiring.contacts:
            free[1, nodes[name][1:]] = False
        number = np.full((self.elements.size, 2), -1, dtype=np.intp)
        flat = free[:, order].T
        self.size = int(flat.sum())
        places = np.full(flat.shape, -1, dtype=np.intp)
        places[flat] = np.arange(self.size)
        number[order] = places
        self._T, self._V = number.T.copy()
        self._V[nodes[wiring.swept]] = self.size
        for name in wiring.contacts:
            self._V[nodes[name]] = self._V[nodes[name][0]]
        self.is_temperature = np.zeros(self.size + 1, dtype=bool)
        self.is_temperature[self._T[self._T >= 0]] = True

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
        ones = np.zeros(self.elements.size)
        ones[nodes] = 1.0
        return np.asarray(self.elements.sampling @ ones)

    def _place_films(self, region: Index) -> None:
        """Find what lies at the points, by the region of each point."""
        layout, positions = self.mesh.layout, self.elements.positions
        # elements of a solid have their thickness themselves
        flat = len(positions) == 2
        body = thickness_at(layout, positions[:2])
        where: dict[tuple[int, Film, str | None], list[int]] = {}
        for number, of_layout in enumerate(layout.regions):
            for level, film in enumerate(of_layout.stack):
                tapered = not level and of_layout.taper is not None
                source = of_layout.dopant_from if tapered else None
                where.setdefault((level, film, source), []).append(number)
        films = []
        for (_, film, source), numbers in where.items():
            points = np.flatnonzero(np.isin(region, numbers))
            is_body = film.thickness_um is None
            thickness = at_some(body, points) if film.thickness_um is None else film.thickness_um
            even = np.empty((0, points.size, 1))
            films.append(
                PlacedFilm(
                    film.material,
                    points,
                    thickness,
                    counted_um=thickness if flat else 1.0,
                    is_body=is_body,
                    dopant_from=source,
                    distances=even if source is None else self._from_borders(region, points),
                )
            )
        self.films = tuple(films)
        self.thickness_um = self.plate_um = body if flat else 1.0
        if len(films) > 1 and not all(film.is_body for film in films):
            self.thickness_um = np.zeros((region.size, 1))
            for placed in films:
                self.thickness_um[placed.points] += placed.counted_um
            self.plate_um = body + (layout.thickest_um - layout.thickness_um)

    def _from_borders(self, region: Index, points: Index) -> Array:
        """Return how far points in low-doped regions are from the borders of each one's region."""
        tapers, of_points = [part.taper for part in self.mesh.layout.regions], region[points]
        by_region = {
            number: taper.distances(self.elements.positions[:2, points[of_points == number]])
            for number in np.unique(of_points)
            if (taper := tapers[number]) is not None
        }
        distances = np.full((max(map(len, by_region.values())), points.size, 1), FAR)
        for number, away in by_region.items():
            distances[: len(away), of_points == number, 0] = away
        return distances

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
        """Return the free rises of the temperature (K), (places, n), of states."""
        return x[self.is_temperature]

    def rise_at(self, places: Array, x: Array) -> Array:
        """Return the rise of the temperature (K) at places (k, 2) in states, (k, n)."""
        element, shares, _ = self.elements.at_points(places)
        unknowns = self._T[self.elements.dofs[element]]
        nodal = np.where((unknowns >= 0)[..., None], x[unknowns], 0.0)
        return np.asarray(np.einsum("ks,ksn->kn", shares, nodal))

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
        nodes = self.elements.dofs.shape[1]
        slots = self._slots[element, :nodes, :nodes]
        unknowns = self._T[self.elements.dofs[element]]
        space = copy(self)
        space.air = AirLoss(air, unknowns, shares, slots, self.size + 1)
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
        # any element around a node knows where its diagonal entry is
        _, first = np.unique(self.elements.dofs, return_index=True)
        element, node = np.divmod(first[surface], self.elements.dofs.shape[1])
        slots = self._slots[element, node, node][:, None, None]
        space = copy(self)
        shares = np.ones((surface.size, 1))
        space.air = AirLoss(air, self._T[surface, None], shares, slots, self.size + 1)
        return space

    # --- the matrix -------------------------------------------------------------------------------

    def _lay_out_matrix(self) -> None:
        """Find the structure of the Jacobian; its last row is that of a constraint."""
        count = self.size + 1
        dofs = self.elements.dofs
        unknowns = np.concatenate([self._T[dofs], self._V[dofs]], axis=1)
        keys = np.where(
            # the row of V_l is the current, which the constraint replaces
            (unknowns[:, :, None] >= 0)
            & (unknowns[:, :, None] < self.size)
            & (unknowns[:, None, :] >= 0),
            unknowns[:, None, :] * count + unknowns[:, :, None],
            count**2,  # after all others: dropped
        )
        of_constraint = np.append(self.tip[0], self.size) * count + self.size
        diagonal = self.contacts * (count + 1)
        every = np.concatenate([keys.ravel(), of_constraint, diagonal])
        unique, slots = np.unique(every, return_inverse=True)
        unique = unique[unique < count**2]
        self._entries = unique.size
        self._slots = slots[: keys.size].reshape(keys.shape)
        self._constraint_slots, self._contact_slots = np.split(
            slots[keys.size :], [of_constraint.size]
        )
        self._rows = (unique % count).astype(np.int32)
        self._starts = np.searchsorted(unique // count, np.arange(count + 1)).astype(np.int32)

    def factorised(
        self, tangent: Tangent, air: AirTangent, constraint: Constraint, conductance: Array
    ) -> SparseFactors:
        """Put the Jacobians of all states together, the constraint last, and factorise."""
        solvers = []
        for state in range(tangent.sigma.shape[-1]):
            kappa = air.kappa[:, state]
            entries = self._assembled(tangent.of(state))
            entries[self._contact_slots] += conductance
            entries += self.air.local_entries(kappa, self._entries)
            factors = self._lu(entries, constraint.among(state))
            solvers.append(self.air.solver(factors, kappa, air.taken_up))
        return SparseFactors(solvers)

    def _assembled(self, tangent: Tangent) -> Array:
        """Return the entries of one state's Jacobian, without the constraint."""
        elements, nodes = self.elements.dofs.shape
        matrices = self.elements.matrices
        element = np.empty((elements, 2 * nodes, 2 * nodes))
        element[:, :nodes, :nodes] = matrices(
            value_value=tangent.heat_source_T,
            slope_value=tangent.heat_flux_T,
            slope_slope=tangent.kappa,
        )
        element[:, :nodes, nodes:] = matrices(value_slope=tangent.heat_source_V)
        element[:, nodes:, :nodes] = matrices(slope_value=tangent.charge_flux_T)
        element[:, nodes:, nodes:] = matrices(slope_slope=tangent.sigma)
        return sums_by_index(self._slots, element, self._entries + 1)[: self._entries]

    def _lu(self, entries: Array, constraint: Constraint) -> SuperLU:
        """Factorise; the unknowns are already ordered for little fill."""
        entries[self._constraint_slots] = np.append(constraint.tip * self.tip[1], constraint.lever)
        count = self.size + 1
        return splu(
            csc_matrix((entries, self._rows, self._starts), shape=(count, count)),
            permc_spec="NATURAL",
            diag_pivot_thresh=0.01,
            options={"SymmetricMode": True},
        )


class SparseFactors:
    """The factorised Jacobian of each of some states; see `Factors`."""

    def __init__(self, solvers: list[Any]) -> None:
        self._solvers = solvers

    def solve(self, right_hand_side: Array, states: Index, *, transposed: bool = False) -> Array:
        """Solve for right-hand sides (size + 1, n) or (size + 1, n, k) of these n states."""
        solution, how = np.empty_like(right_hand_side), "T" if transposed else "N"
        for column, state in enumerate(states):
            solution[:, column] = self._solvers[state].solve(right_hand_side[:, column], how)
        return solution

    def replaced(self, states: Index, other: SparseFactors) -> SparseFactors:
        """Return the same factors, those of some states taken from others, in their order."""
        solvers = dict(enumerate(self._solvers)) | dict(zip(states, other._solvers, strict=True))
        return SparseFactors(list(solvers.values()))


def thickness_at(layout: Layout, positions: Array) -> float | Array:
    """Return the body's thickness (µm); where there is a cone, at positions (2, points)."""
    if layout.cone is None:
        return float(layout.thickness_um)
    distance = np.linalg.norm(positions - np.reshape(layout.tip, (2, 1)), axis=0)
    return np.asarray(layout.thickness_um + layout.cone.thickening_um(distance))[:, None]


def _fill_reducing_order(dofs: Index, size: int) -> Index:
    """Order nodes for little fill: SuperLU's minimum degree ordering of the nodes' pattern.

    It is found once, so that each factorisation can take the natural order.
    """
    nodes = dofs.shape[1]
    rows = np.repeat(dofs, nodes, axis=1).ravel()
    columns = np.tile(dofs, (1, nodes)).ravel()
    pattern = csc_matrix((np.ones(rows.size), (rows, columns)), shape=(size, size))
    pattern.data[:] = 1.0
    pattern.setdiag(size)
    return np.argsort(splu(pattern, permc_spec="MMD_AT_PLUS_A").perm_c)
