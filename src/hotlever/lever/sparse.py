"""The sparse Jacobian of a full lever: its unknowns, where its entries stand, and their factors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import SuperLU, splu

from hotlever.lever.elements import FiniteElements, sums_by_index
from hotlever.lever.space import Constraint, Tangent
from hotlever.probe.circuit import Wiring
from hotlever.types import Array, Index


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
    held : mapping of str to int
        Unknowns on whose diagonal there are conductances, by terminal.
    tip : tuple of (ndarray of int, ndarray)
        Unknowns and weights that give the rise of the tip temperature.

    Attributes
    ----------
    slots : ndarray of int, shape (elements, 2 nodes, 2 nodes)
        Where the entries of each element stand, temperatures first.
    """

    def __init__(
        self,
        elements: FiniteElements,
        unknowns: Index,
        size: int,
        held: Mapping[str, int],
        tip: tuple[Index, Array],
    ) -> None:
        self._elements, self._count, self._tip = elements, size + 1, tip[1]
        count, number = self._count, np.concatenate(unknowns[:, elements.dofs], axis=1)
        keys = np.where(
            # the row of V_l is the current, which the constraint replaces
            (number[:, :, None] >= 0) & (number[:, :, None] < size) & (number[:, None, :] >= 0),
            number[:, None, :] * count + number[:, :, None],
            count**2,  # after all others: dropped
        )
        of_constraint = np.append(tip[0], size) * count + size
        diagonal = np.array(list(held.values()), dtype=int) * (count + 1)
        every = np.concatenate([keys.ravel(), of_constraint, diagonal])
        unique, slots = np.unique(every, return_inverse=True)
        unique = unique[unique < count**2]
        self._entries = unique.size
        self.slots = slots[: keys.size].reshape(keys.shape)
        self._constraint_slots, self._held_slots = np.split(
            slots[keys.size :], [of_constraint.size]
        )
        self._rows = (unique % count).astype(np.int32)
        self._starts = np.searchsorted(unique // count, np.arange(count + 1)).astype(np.int32)

    def entries(self, tangent: Tangent, conductance: Array) -> Array:
        """Return the entries of one state's Jacobian, without the constraint."""
        elements, nodes = self._elements.dofs.shape
        matrices = self._elements.matrices
        element = np.empty((elements, 2 * nodes, 2 * nodes))
        source, heat, charge = tangent.thermoelectric or (None, None, None)
        element[:, :nodes, :nodes] = matrices(
            value_value=tangent.heat_source_T,
            value_slope=source,
            slope_value=tangent.heat_flux_T,
            slope_slope=tangent.kappa,
        )
        element[:, :nodes, nodes:] = matrices(value_slope=tangent.heat_source_V, slope_slope=heat)
        element[:, nodes:, :nodes] = matrices(slope_value=tangent.charge_flux_T, slope_slope=charge)
        element[:, nodes:, nodes:] = matrices(slope_slope=tangent.sigma)
        entries = sums_by_index(self.slots, element, self._entries + 1)[: self._entries]
        entries[self._held_slots] += conductance
        return entries

    def of_losses(self, element: Index, shares: Array) -> csr_matrix:
        """Return the matrix (entries, points) from slopes of local losses to what they add.

        Each point lies in an element, (points,), with its basis functions there, (points, nodes);
        the slopes are by the temperature.
        """
        nodes = shares.shape[1]
        slots = self.slots[element, :nodes, :nodes]
        products = shares[:, :, None] * shares[:, None, :]
        points = np.broadcast_to(np.arange(len(element))[:, None, None], slots.shape)
        counted = (products != 0) & (slots < self._entries)
        return csr_matrix(
            (products[counted], (slots[counted], points[counted])),
            shape=(self._entries, len(element)),
        )

    def factorised(self, entries: Array, constraint: Constraint) -> SuperLU:
        """Factorise; the unknowns are already ordered for little fill."""
        entries[self._constraint_slots] = np.append(constraint.tip * self._tip, constraint.lever)
        return splu(
            csc_matrix((entries, self._rows, self._starts), shape=(self._count, self._count)),
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


def numbered(
    elements: FiniteElements,
    ends: Index,
    conducts: Index,
    contact_nodes: Mapping[str, Index],
    wiring: Wiring,
) -> tuple[Index, Index, int]:
    """Give every nodal value its unknown, in an order with little fill.

    Values that are held get -1, the potential of the swept supply the number after all others; a
    held terminal has that of its first node.

    Parameters
    ----------
    elements : FiniteElements
    ends, conducts : ndarray of int
        Nodes at leg ends, and where a current may flow.
    contact_nodes : mapping of str to ndarray of int
        Those of each terminal that conduct.
    wiring : Wiring

    Returns
    -------
    T, V : ndarray of int, shape (nodes,)
    size : int
        How many there are, without the lever voltage.
    """
    order = _fill_reducing_order(elements.dofs, elements.size)
    free = np.zeros((2, elements.size), dtype=bool)
    free[0], free[1, conducts] = True, True
    free[0, ends] = free[1, contact_nodes[wiring.swept]] = False
    for name in wiring.grounds:
        free[1, contact_nodes[name]] = False
    for name in wiring.held:
        free[1, contact_nodes[name][1:]] = False
    flat = free[:, order].T
    size = int(flat.sum())
    ordered = np.full(flat.shape, -1, dtype=np.intp)
    ordered[flat] = np.arange(size)
    number = np.full((elements.size, 2), -1, dtype=np.intp)
    number[order] = ordered
    T, V = number.T.copy()
    V[contact_nodes[wiring.swept]] = size
    for name in wiring.held:
        V[contact_nodes[name]] = V[contact_nodes[name][0]]
    return T, V, size


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
