"""Finite elements: what fields are at the quadrature points, and the matrices of weak forms.

Linear maps lead from the unknowns of a lever to fields at points, and back to the weak equations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

from hotlever.errors import InputError
from hotlever.probe.circuit import Wiring
from hotlever.types import Array, Index

if TYPE_CHECKING:
    from skfem import Mesh
    from skfem.element import Element


@dataclass(frozen=True)
class FacetPoints:
    """Quadrature points on facets, each seen from the element behind it.

    Attributes
    ----------
    facets, elements : ndarray of int, shape (points,)
    shares : ndarray, shape (points, nodes)
        Its basis functions there.
    weights : ndarray, shape (points,)
        Lengths or areas included.
    positions : ndarray, shape (dimension, points)
    """

    facets: Index
    elements: Index
    shares: Array
    weights: Array
    positions: Array


class FiniteElements:
    """Lagrange elements on triangles or tetrahedra with straight edges.

    Quadrature points are counted element by element; ``points`` is their number.

    Parameters
    ----------
    mesh : skfem.Mesh
    element : skfem.element.Element, optional
        Cubic triangles by default, which reach a given accuracy with fewer unknowns than
        quadratic ones.
    quadrature : int or (ndarray, ndarray), optional
        Polynomial degree integrated exactly, or points (dimension, n) and weights (n,) on the
        reference element.

    Attributes
    ----------
    size : int
        Number of nodal values of one field.
    dofs : ndarray of int, shape (elements, nodes)
        Global number of each element's nodes.
    inner : int
        How many of each element's nodes are inside it; they are its last ones.
    nodes : ndarray, shape (dimension, size)
        Positions of the nodes.
    weights : ndarray, shape (points,)
        Quadrature weights, areas or volumes included.
    positions : ndarray, shape (dimension, points)
        Quadrature points.
    inverse : ndarray, shape (elements, dimension, dimension)
        Of each element's map from the reference element.
    sampling : csr_matrix, shape ((1 + dimension) × points, size)
        From nodal values to the values, then to the slopes along each axis at all points.
    """

    def __init__(
        self,
        mesh: Mesh,
        element: Element | None = None,
        quadrature: int | tuple[Array, Array] = 5,
    ) -> None:
        from skfem import CellBasis, ElementTriP3  # see `hotlever.probe.mesh`

        rule = {"intorder" if isinstance(quadrature, int) else "quadrature": quadrature}
        self.basis = CellBasis(mesh, element or ElementTriP3(), **rule)
        self.size = int(self.basis.N)
        self.dofs = np.ascontiguousarray(self.basis.element_dofs.T)
        self.inner = int(self.basis.elem.interior_dofs)
        self.nodes = self.basis.doflocs
        elements, self.per_element = self.basis.dx.shape
        self.weights = np.ascontiguousarray(self.basis.dx).ravel()
        self.positions = np.asarray(self.basis.global_coordinates()).reshape(
            -1, elements * self.per_element
        )
        # With straight edges every element is an affine image of one, so that element matrices are
        # sums of a few fixed matrices whose factors differ from element to element.
        nodes = range(self.dofs.shape[1])
        shape = [self.basis.elem.lbasis(self.basis.X, node) for node in nodes]
        # (1 + dimension, points, nodes): values, then slopes on the reference element
        self._shape = np.stack([np.vstack([value[None], slope]) for value, slope in shape], axis=-1)
        products = np.einsum("rqi,sqj->rsqij", self._shape, self._shape)
        self._products = products.reshape(*products.shape[:3], -1)
        # slopes in space are these combinations of those on the reference element
        self.inverse = np.moveaxis(np.asarray(self.basis.mapping.invA), -1, 0)
        self._metric = np.einsum("era,esa->rse", self.inverse, self.inverse)
        slopes = np.einsum("era,rqn->aeqn", self.inverse, self._shape[1:])
        values = np.broadcast_to(self._shape[0], (1, *slopes.shape[1:]))
        data = np.concatenate([values, slopes])
        columns = np.broadcast_to(self.dofs[:, None], data.shape)
        starts = np.arange(0, data.size + 1, len(nodes))
        rows = data.ravel(), columns.ravel(), starts
        self.sampling = csr_matrix(rows, shape=(starts.size - 1, self.size))

    def matrices(
        self,
        value_value: Array | None = None,
        value_slope: Array | None = None,
        slope_value: Array | None = None,
        slope_slope: Array | None = None,
    ) -> Array:
        """Return the element matrices, (elements, nodes, nodes), of a bilinear form.

        It is ∫ φ a ψ + φ b·∇ψ + ∇φ·c ψ + d ∇φ·∇ψ with test function φ and trial function ψ. The
        coefficients come in this order: a and d have shape (points,), b and c (dimension, points).
        """
        elements, nodes = self.dofs.shape
        factors, tables, products = [], [], self._products

        def weighted(coefficient: Array) -> Array:
            return (self.weights * coefficient).reshape(-1, elements, self.per_element)

        if value_value is not None:
            factors.append(weighted(value_value))
            tables.append(products[0, 0])
        for vector, table in ((value_slope, products[0, 1:]), (slope_value, products[1:, 0])):
            if vector is not None:
                factors.append(np.einsum("era,aeq->req", self.inverse, weighted(vector)))
                tables.append(np.concatenate(table))
        if slope_slope is not None:
            for metric, table in zip(self._metric, products[1:, 1:], strict=True):
                factors.append(metric[:, :, None] * weighted(slope_slope))
                tables.append(np.concatenate(table))
        together = np.concatenate(factors).transpose(1, 0, 2).reshape(elements, -1)
        return np.asarray(together @ np.concatenate(tables)).reshape(elements, nodes, nodes)

    @cached_property
    def _lattice(self) -> Array:
        """The basis functions on a lattice over an element, (nodes, points)."""
        # four times as many steps along an edge as a cubic element has
        steps_along = 12
        steps = product(range(steps_along + 1), repeat=len(self.positions))
        points = np.array([point for point in steps if sum(point) <= steps_along]).T / steps_along
        nodes = range(self.dofs.shape[1])
        return np.stack([self.basis.elem.lbasis(points, node)[0] for node in nodes])

    def near_highest(self, values: Array, share: float) -> Index:
        """Return the elements in which one of n fields (size, n) has a share of its highest value.

        The fields are not negative.
        """
        most = values[self.dofs].max(axis=1)
        return np.flatnonzero((most >= share * most.max(axis=0)).any(axis=1))

    def highest(self, values: Array, dofs: Index | None = None) -> Array:
        """Return the highest values of fields (size, n), those between the nodes too, (n,).

        The fields may be given on some elements alone, with the nodes of these among them.
        """
        each = values[self.dofs if dofs is None else dofs]
        most = each.max(axis=1)
        highest = most.max(axis=0)
        # how far above its nodes an element may reach, from the difference between these
        reached = most + 0.25 * (most - each.min(axis=1))
        element, field = np.nonzero(reached >= highest)
        np.maximum.at(highest, field, (each[element, :, field] @ self._lattice).max(axis=1))
        return np.asarray(highest)

    def on_reference(self, point: Array, element: int) -> Array:
        """Return where a point lies on the reference element, seen from an element."""
        corner = self.basis.mesh.p[:, self.basis.mesh.t[0, element]]
        return np.asarray(self.inverse[element] @ (point - corner))

    def on_facets(self, facets: Index) -> FacetPoints:
        """Return quadrature points on some facets of the mesh, facet by facet."""
        from skfem import FacetBasis  # see `hotlever.probe.mesh`

        element = self.basis.elem
        basis = FacetBasis(self.basis.mesh, element, facets=facets, intorder=2 * element.maxdeg - 1)
        positions = np.asarray(basis.global_coordinates())
        each = basis.dx.shape[1]
        return FacetPoints(
            facets=np.repeat(facets, each),
            elements=np.repeat(basis.tind, each),
            shares=np.stack([np.ravel(value[0]) for value in basis.basis], axis=1),
            weights=np.ravel(basis.dx),
            positions=positions.reshape(len(positions), -1),
        )

    def interpolation(
        self, points: Array, elements: Index | None = None
    ) -> tuple[csr_matrix, Index]:
        """Return the matrix from nodal values to those at points, and the element of each.

        See `at_points`.
        """
        elements, shares, _ = self.at_points(points, elements)
        starts = np.arange(0, shares.size + 1, shares.shape[1])
        matrix = (shares.ravel(), self.dofs[elements].ravel(), starts)
        return csr_matrix(matrix, shape=(len(points), self.size)), elements

    def at_points(self, points: Array, elements: Index | None = None) -> tuple[Index, Array, Array]:
        """Return the element at each point, and its basis functions there, with their slopes.

        Parameters
        ----------
        points : ndarray, shape (n, dimension)
            µm; a last coordinate left out is zero. A point outside by rounding is given the nearest
            element.
        elements : ndarray of int, shape (n,), optional
            In which the points lie, if that is known.

        Returns
        -------
        elements : ndarray of int, shape (n,)
        values : ndarray, shape (n, nodes)
        slopes : ndarray, shape (dimension, n, nodes)

        Raises
        ------
        InputError
            If a point lies outside the mesh.
        """
        points = np.pad(points, ((0, 0), (0, len(self.positions) - points.shape[1])))
        if elements is None:
            elements = self._around(points)
        away = points - self._corners[:, elements].T
        local = np.einsum("nra,na->rn", self.inverse[elements], away)
        shape = [self.basis.elem.lbasis(local, node) for node in range(self.dofs.shape[1])]
        values = np.stack([value for value, _ in shape], axis=1)
        slopes = np.stack([slope for _, slope in shape], axis=-1)
        return elements, values, np.einsum("nra,rnk->ank", self.inverse[elements], slopes)

    @property
    def _corners(self) -> Array:
        """The first corner of each element, (dimension, elements)."""
        return np.asarray(self.basis.mesh.p[:, self.basis.mesh.t[0]])

    def _around(self, points: Array) -> Index:
        """Return the element at each point (n, dimension); see `at_points`."""
        elements, corners = np.empty(len(points), dtype=np.intp), self._corners
        together = 256
        for first in range(0, len(points), together):
            some = slice(first, first + together)
            # where the points lie on the reference element, seen from each element
            away = points[some].T[:, None] - corners[:, :, None]
            here = np.einsum("era,aen->ern", self.inverse, away)
            depth = np.minimum(here.min(axis=1), 1.0 - here.sum(axis=1))
            nearest = depth.argmax(axis=0)
            number = np.arange(nearest.size)
            # a point a little outside an element is taken to lie on its edge: that is rounding
            outside = np.flatnonzero(depth[nearest, number] < -1e-3)
            if outside.size:
                where = ", ".join(f"{value:g}" for value in points[some][outside[0]])
                raise InputError(f"the point ({where}) µm lies outside the lever")
            elements[some] = nearest
        return elements


def numbered(
    elements: FiniteElements,
    ends: Index,
    conducts: Index,
    contact_nodes: Mapping[str, Index],
    wiring: Wiring,
    on_chip: Index,
) -> tuple[Index, Index, int]:
    """Give every nodal value its unknown, in an order with little fill.

    Values that are held get -1, the potential of the swept supply the number after all others. A
    held terminal has one number, and so have leg ends on the chip. These come last but for it,
    since they meet so many others that the matrix would fill up behind them.

    Parameters
    ----------
    elements : FiniteElements
    ends, conducts : ndarray of int
        Nodes at leg ends, and where a current may flow.
    contact_nodes : mapping of str to ndarray of int
        Those of each terminal that conduct.
    wiring : Wiring
    on_chip : ndarray of int
        Those nodes of leg ends that have the temperature of the chip below.

    Returns
    -------
    T, V : ndarray of int, shape (nodes,)
    size : int
        How many there are, without the lever voltage.
    """
    order = _fill_reducing_order(elements)
    free = np.zeros((2, elements.size), dtype=bool)
    free[0], free[1, conducts] = True, True
    free[0, ends] = free[1, contact_nodes[wiring.swept]] = False
    free[0, on_chip[:1]] = True
    for name in wiring.grounds:
        free[1, contact_nodes[name]] = False
    for name in wiring.held:
        free[1, contact_nodes[name][1:]] = False
    shared = np.zeros_like(free)
    shared[0, on_chip[:1]] = True
    for name in wiring.held:
        shared[1, contact_nodes[name][0]] = True
    flat = free[:, order].T
    size = int(flat.sum())
    ordered = np.full(flat.shape, -1, dtype=np.intp)
    alone, together = flat & ~shared[:, order].T, flat & shared[:, order].T
    ordered[alone] = np.arange(alone.sum())
    ordered[together] = np.arange(alone.sum(), size)
    number = np.full((elements.size, 2), -1, dtype=np.intp)
    number[order] = ordered
    T, V = number.T.copy()
    T[on_chip] = T[on_chip[:1]]
    V[contact_nodes[wiring.swept]] = size
    for name in wiring.held:
        V[contact_nodes[name]] = V[contact_nodes[name][0]]
    return T, V, size


def _fill_reducing_order(elements: FiniteElements) -> Index:
    """Order nodes for little fill: SuperLU's minimum degree ordering of the nodes' pattern.

    It is found once, so that each factorisation can take the natural order.
    """
    nodes, shape = elements.dofs.shape[1], (elements.size, elements.size)
    rows = np.repeat(elements.dofs, nodes, axis=1).ravel()
    columns = np.tile(elements.dofs, (1, nodes)).ravel()
    pattern = csc_matrix((np.ones(rows.size), (rows, columns)), shape=shape)
    pattern.data[:] = 1.0
    pattern.setdiag(elements.size)
    return np.argsort(splu(pattern, permc_spec="MMD_AT_PLUS_A").perm_c)


class LinearMap:
    """From unknowns to a field and its slopes at the quadrature points, and back.

    Parameters
    ----------
    matrix : matrix, shape (kinds × points, columns)
        Sparse or dense; first the values (where there are any), then the slope along each axis.
    kinds : int
    columns : slice
        The unknowns that matter.
    """

    def __init__(self, matrix: Any, kinds: int, columns: slice = slice(None)) -> None:
        self.matrix, self.kinds, self.columns = matrix, kinds, columns
        self._transposed = matrix.T.tocsr() if hasattr(matrix, "tocsr") else matrix.T
        self._of_values: Any = None

    def among(self, points: Index) -> LinearMap:
        """Return the same dense map to some of the points."""
        rows = self.matrix.reshape(self.kinds, -1, self.matrix.shape[1])[:, points]
        return LinearMap(rows.reshape(-1, rows.shape[2]), self.kinds, self.columns)

    def integrands(self, samples: Array) -> Array:
        """Return what a dense map integrates to test samples (kinds, points), (columns, points).

        Given may be the first of the kinds alone.
        """
        rows = self.matrix.reshape(self.kinds, samples.shape[1], -1)[: len(samples)]
        return np.asarray(np.einsum("dqm,dq->mq", rows, samples))

    def at_points(self, x: Array) -> Array:
        """Return the samples (kinds, points, ...) of states (size + 1, ...)."""
        if not self.matrix.shape[0]:  # there are no points; SciPy takes its time over nothing
            return np.zeros((self.kinds, 0, *x.shape[1:]))
        chosen = x[self.columns]
        samples = np.asarray(self.matrix @ chosen.reshape(len(chosen), -1))
        return samples.reshape(self.kinds, -1, *x.shape[1:])

    def tested(self, samples: Array) -> Array:
        """Return what weighted samples (kinds, points, ...) do to each unknown (columns, ...)."""
        rows = self._transposed.shape[1]
        tested = np.asarray(self._transposed @ samples.reshape(rows, -1))
        return tested.reshape(-1, *samples.shape[2:])

    def values_tested(self, samples: Array) -> Array:
        """Return the same of weighted samples of the value alone, (points, ...)."""
        if self._of_values is None:
            self._of_values = self._transposed[:, : len(samples)]
        tested = np.asarray(self._of_values @ samples.reshape(len(samples), -1))
        return tested.reshape(-1, *samples.shape[1:])
