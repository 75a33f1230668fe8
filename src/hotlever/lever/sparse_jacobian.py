"""The Jacobian of a lever of finite elements: put together element by element, and factorised.

Nodes inside an element meet those of no other. Their unknowns are eliminated element by element
before the matrix is factorised, and found afterwards (static condensation; E. L. Wilson, Int. J.
Numer. Methods Eng. 8, 198 (1974)). Of cubic triangles a fifth of the unknowns is left out so.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from hotlever.lever.elements import FiniteElements
from hotlever.lever.factorisation import Factorisation, FactorisationOptions
from hotlever.lever.space import Constraint
from hotlever.lever.transport import Tangent
from hotlever.types import Array, Index, LinearSolver, Mask


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
