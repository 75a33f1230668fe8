"""The full lever: finite elements on a mesh.

The unknowns are the temperature and the potential at the nodes, without those held at the base
temperature or at ground; the nodes of a contact share one unknown, that of the swept supply the
lever voltage, and so do leg ends on a chip that gets warmer. Where nothing conducts there is no
potential.

Nodes inside an element meet those of no other. Their unknowns are eliminated element by element
before the Jacobian is factorised, and found afterwards (static condensation; E. L. Wilson, Int. J.
Numer. Methods Eng. 8, 198 (1974)). Of cubic triangles a fifth of the unknowns is left out so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import Any, get_args

import numpy as np
from scipy.sparse import csr_matrix

from hotlever.air.coupling import AirLoss
from hotlever.air.operator import AirOperator
from hotlever.air.stores import HeatInAir
from hotlever.lever.elements import FacetPoints, FiniteElements, LinearMap, numbered
from hotlever.lever.factorisation import Factorisation, FactorisationOptions
from hotlever.lever.layers_at_points import Rim, placed_films
from hotlever.lever.space import Constraint, Space, SurfaceTangent
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


# --- its Jacobian, put together element by element ------------------------------------------------


class SparseJacobian:
    """The structure of the Jacobian of a lever of finite elements.

    Its last row is that of a constraint.

    Parameters
    ----------
    elements : FiniteElements
    unknowns : ndarray of int, shape (2, nodes)
        Those of temperature and potential at each node, -1 where they are held.
    size : int
        How many there are, without the lever voltage, which has this number itself.
    held : sequence of int
        Unknowns on whose diagonal there are conductances: held terminals, and the chip.
    tip : tuple of (ndarray of int, ndarray)
        Unknowns and weights that give the rise of the tip temperature.
    options : FactorisationOptions, optional
    """

    def __init__(
        self,
        elements: FiniteElements,
        unknowns: Index,
        size: int,
        held: Sequence[int],
        tip: tuple[Index, Array],
        options: FactorisationOptions | None = None,
    ) -> None:
        self._elements = elements
        self._made_of = unknowns, size, held, options
        number = np.concatenate(unknowns[:, elements.dofs], axis=1)
        nodes = elements.dofs.shape[1]
        self._tip_unknowns, self._tip = _of_tip(tip)
        # the row of V_l is the current, which the constraint replaces
        has_column, has_row = number >= 0, (number >= 0) & (number < size)
        inside = np.tile(np.arange(nodes) >= nodes - elements.inner, 2)
        # the constraint belongs to no element from which it could be condensed
        of_tip = np.isin(number[:, inside], self._tip_unknowns).any(axis=1, keepdims=True)
        is_inner: Mask = has_row & inside & ~of_tip
        self._condensation = _Condensation(number, is_inner, has_row, has_column, inside)
        # what is left is counted anew
        outer = self._condensation.outer
        count, left = outer.size, np.zeros(size + 1, dtype=np.intp)
        left[outer] = np.arange(count)
        row, column = left[number][:, :, None], left[number][:, None, :]
        keys = np.where(
            (has_row & ~is_inner)[:, :, None] & (has_column & ~is_inner)[:, None, :],
            column * count + row,
            count**2,  # after all others: dropped
        )
        of_constraint = left[np.append(self._tip_unknowns, size)] * count + count - 1
        diagonal = left[np.array(held, dtype=int)] * (count + 1)
        every = np.concatenate([keys.ravel(), of_constraint, diagonal])
        unique, slots = np.unique(every, return_inverse=True)
        unique = unique[unique < count**2]
        self._entries = unique.size
        self._slots, self._constraint_slots, self._held_slots = np.split(
            slots, np.cumsum([keys.size, of_constraint.size])
        )
        starts = np.searchsorted(unique // count, np.arange(count + 1))
        self._factorisation = Factorisation.of_pattern(unique % count, starts, options)

    def moved(self, elements: FiniteElements, tip: tuple[Index, Array]) -> SparseJacobian:
        """Return that of the same elements elsewhere; the structure is shared."""
        tip_unknowns, weights = _of_tip(tip)
        if not np.array_equal(tip_unknowns, self._tip_unknowns):
            unknowns, size, held, options = self._made_of
            return SparseJacobian(elements, unknowns, size, held, tip, options)
        other = copy(self)
        other._elements, other._tip = elements, weights
        return other

    def element_matrices(self, tangent: Tangent) -> Array:
        """Return those of one state's tangent, (elements, 2 nodes, 2 nodes), temperatures first."""
        elements, nodes = self._elements.dofs.shape
        matrices = self._elements.matrices
        element = np.empty((elements, 2 * nodes, 2 * nodes))
        element[:, :nodes, :nodes] = matrices(
            value_value=tangent.heat_source_T,
            value_slope=tangent.heat_source_slope,
            slope_value=tangent.heat_flux_T,
            slope_slope=tangent.kappa,
        )
        element[:, :nodes, nodes:] = matrices(
            value_slope=tangent.heat_source_V, slope_slope=tangent.heat_V
        )
        element[:, nodes:, :nodes] = matrices(
            slope_value=tangent.charge_flux_T, slope_slope=tangent.charge_T
        )
        element[:, nodes:, nodes:] = matrices(slope_slope=tangent.sigma)
        return element

    def factorised(
        self, element_matrices: Array, conductance: Array, constraint: Constraint
    ) -> LinearSolver:
        """Factorise the sum of element matrices, which are used up, with a constraint below.

        Behind each held terminal is a conductance (mA/V), and last that of the chip (mW/K).
        """
        condensed = self._condensation.of(element_matrices)
        # numpy's stubs overlook that weights make the counts floats
        sums: Any = np.bincount(self._slots, element_matrices.ravel(), minlength=self._entries + 1)
        entries: Array = sums[: self._entries]
        entries[self._held_slots] += conductance
        entries[self._constraint_slots] = np.append(constraint.tip * self._tip, constraint.lever)
        return _CondensedFactors(self._factorisation.factorised(entries), *condensed)


def _of_tip(tip: tuple[Index, Array]) -> tuple[Index, Array]:
    """Return the unknowns that the rise of the tip depends on, in rising order, and weights."""
    unknowns, weights = (each[tip[1] != 0] for each in tip)
    order = np.argsort(unknowns)
    return unknowns[order], weights[order]


class ElementLosses:
    """What losses at points, by the temperature there, add to the matrices of elements.

    Parameters
    ----------
    elements : ndarray of int, shape (points,)
        In which each point lies.
    shares : ndarray, shape (points, nodes)
        The basis functions of its element there.
    """

    def __init__(self, elements: Index, shares: Array) -> None:
        points, self._nodes = shares.shape
        self._elements, place = np.unique(elements, return_inverse=True)
        entries = self._nodes**2
        rows = place[:, None] * entries + np.arange(entries)
        columns = np.broadcast_to(np.arange(points)[:, None], rows.shape)
        products = (shares[:, :, None] * shares[:, None, :]).ravel()
        shape = (self._elements.size * entries, points)
        self._products = csr_matrix((products, (rows.ravel(), columns.ravel())), shape=shape)

    def add_to(self, element_matrices: Array, slopes: Array) -> None:
        """Add those of losses with these slopes (points,)."""
        nodes = self._nodes
        added = (self._products @ slopes).reshape(self._elements.size, nodes, nodes)
        element_matrices[self._elements, :nodes, :nodes] += added


class _Condensation:
    """Which unknowns are eliminated element by element, and how.

    Parameters
    ----------
    number : ndarray of int, shape (elements, 2 nodes)
        The unknowns of each element.
    is_inner, has_row, has_column : ndarray of bool, shape (elements, 2 nodes)
        Which of them are eliminated, and which have a row and a column in the matrix.
    inside : ndarray of bool, shape (2 nodes,)
        Which may be eliminated.

    Attributes
    ----------
    outer : ndarray of int
        The unknowns that are left, in rising order.
    """

    def __init__(
        self,
        number: Index,
        is_inner: Mask,
        has_row: Mask,
        has_column: Mask,
        inside: Mask,
    ) -> None:
        self._inside, self._is_inner = np.flatnonzero(inside), is_inner[:, inside]
        self._both = self._is_inner[:, :, None] & self._is_inner[:, None, :]
        self._unit = np.eye(self._inside.size)
        self._has_row, self._has_column = has_row[:, None], has_column[:, None]
        self._inner, size = number[is_inner], int(number.max()) + 1
        self.outer = np.setdiff1d(np.arange(size), self._inner)
        # each inner unknown has all of its element in its row
        shape = *self._is_inner.shape, number.shape[1]
        columns = np.broadcast_to(np.where(has_column, number, 0)[:, None], shape)
        self._columns = columns[self._is_inner].ravel().astype(np.int32)
        self._starts = np.arange(self._inner.size + 1, dtype=np.int32) * number.shape[1]
        self._shape = self._inner.size, size

    def of(self, element_matrices: Array) -> tuple[csr_matrix, csr_matrix, Index, Index]:
        """Condense element matrices, and return what `_CondensedFactors` needs besides factors."""
        inside = self._inside
        rows, columns = element_matrices[:, inside], element_matrices[:, :, inside]
        own = np.where(self._both, rows[:, :, inside], self._unit)
        inverse = np.where(self._both, np.linalg.inv(own), 0.0)
        by_rows, by_columns = inverse @ rows, (columns @ inverse).swapaxes(1, 2)
        element_matrices -= columns @ by_rows
        by_rows[:, :, inside], by_columns[:, :, inside] = -inverse, -inverse.swapaxes(1, 2)
        each = self._sparse(by_rows * self._has_column), self._sparse(by_columns * self._has_row)
        return *each, self._inner, self.outer

    def _sparse(self, by_element: Array) -> csr_matrix:
        data = by_element[self._is_inner].ravel()
        return csr_matrix((data, self._columns, self._starts), shape=self._shape)


class _CondensedFactors:
    """A factorised matrix with what was eliminated from it before.

    Of the matrix with blocks A of inner unknowns i and outer ones o, ``by_rows`` has A_ii⁻¹ A_io in
    the columns of the outer ones and −A_ii⁻¹ in those of the inner ones; ``by_columns`` is the same
    of the transposed matrix. The factors are those of A_oo − A_oi A_ii⁻¹ A_io.
    """

    def __init__(
        self,
        factors: LinearSolver,
        by_rows: csr_matrix,
        by_columns: csr_matrix,
        inner: Index,
        outer: Index,
    ) -> None:
        self._factors, self._inner, self._outer = factors, inner, outer
        # before and after the factors; in air there are many right-hand sides one by one
        self._around = {False: (by_columns.T, by_rows), True: (by_rows.T, by_columns)}

    def solve(self, right_hand_side: Array, transposed: bool = False) -> Array:
        """See `LinearSolver`."""
        before, after = self._around[transposed]
        inner, outer = self._inner, self._outer
        solution = right_hand_side - before @ right_hand_side[inner]
        solution[outer] = self._factors.solve(solution[outer], transposed)
        solution[inner] = right_hand_side[inner]
        solution[inner] = -(after @ solution)
        return np.asarray(solution)
