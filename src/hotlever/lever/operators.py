"""Linear operators between unknowns and quadrature points.

The equations of the lever (`hotlever.lever.equations`) see only these: unknowns go to values
and gradients at quadrature points, quadrature points go to weak forms and matrices. Here they
are finite elements on a triangulation; a reduced model multiplies the same by a basis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from skfem import CellBasis, Mesh
from skfem.element import Element, ElementTriP3

from hotlever.errors import InputError

Array = NDArray[np.float64]


def sums_by_index(index: NDArray[np.intp], values: Array, size: int) -> Array:
    """Return the sums of `values` with equal `index`, shape (size,); the arrays match."""
    # numpy's stubs overlook that weights make the counts floats
    return np.bincount(index.ravel(), values.ravel(), minlength=size)  # type: ignore[return-value]


class FiniteElements:
    """Values, gradients and weak forms of a scalar field on a mesh.

    Parameters
    ----------
    mesh : skfem.Mesh
    element : skfem.element.Element, optional
        Scalar Lagrange element; cubic triangles by default, which reach a given accuracy with
        fewer unknowns than quadratic ones.
    quadrature : int or (ndarray, ndarray), optional
        Polynomial degree integrated exactly, or points (dimension, points) and weights
        (points,) on the reference element.

    Attributes
    ----------
    size : int
        Number of nodal values of one field.
    dofs : ndarray of int, shape (elements, nodes)
        Global number of each element's nodes.
    weights : ndarray, shape (elements, points)
        Quadrature weights, areas included.
    positions : ndarray, shape (dimension, elements, points)
        Quadrature points.
    nodes : ndarray, shape (dimension, size)
        Positions of the nodes.

    Notes
    -----
    At a quadrature point a field is the vector (value, gradient). ``_table`` holds this linear
    map for every element: shape (elements, points × (1 + dimension), nodes).
    """

    def __init__(
        self,
        mesh: Mesh,
        element: Element | None = None,
        quadrature: int | tuple[Array, Array] = 5,
    ) -> None:
        rule = {"intorder" if isinstance(quadrature, int) else "quadrature": quadrature}
        self.basis = CellBasis(mesh, element or ElementTriP3(), **rule)
        self.size = int(self.basis.N)
        self.dofs = np.ascontiguousarray(self.basis.element_dofs.T)
        self.weights = np.ascontiguousarray(self.basis.dx)
        self.positions = np.asarray(self.basis.global_coordinates())
        self.nodes = self.basis.doflocs
        elements, points = self.weights.shape
        dimension = self.positions.shape[0]
        table = np.empty((elements, points, 1 + dimension, self.dofs.shape[1]))
        for node, (field,) in enumerate(self.basis.basis):
            table[:, :, 0, node] = np.broadcast_to(field, (elements, points))
            table[:, :, 1:, node] = np.moveaxis(np.asarray(field.grad), 0, -1)
        self._table = table
        self._rows = table.reshape(elements, -1, self.dofs.shape[1])
        self._columns = np.ascontiguousarray(self._rows.transpose(0, 2, 1))

    def evaluate(self, nodal: Array) -> tuple[Array, Array]:
        """Return values and gradients of a field at the quadrature points.

        Parameters
        ----------
        nodal : ndarray, shape (size,)

        Returns
        -------
        value : ndarray, shape (elements, points)
        gradient : ndarray, shape (dimension, elements, points)
        """
        flat = np.matmul(self._rows, nodal[self.dofs][:, :, None])
        samples = flat.reshape(self._table.shape[:3])
        return samples[:, :, 0], np.moveaxis(samples[:, :, 1:], -1, 0)

    def weak_form(self, source: Array | float, flux: Array | float) -> Array:
        """Return ∫ (source φ + flux·∇φ) for every basis function φ, element by element.

        Parameters
        ----------
        source : ndarray, shape (elements, points)
        flux : ndarray, shape (dimension, elements, points)

        Returns
        -------
        ndarray, shape (elements, nodes)
        """
        samples = np.empty(self._table.shape[:3])
        samples[:, :, 0] = source
        samples[:, :, 1:] = np.moveaxis(np.broadcast_to(flux, self.positions.shape), 0, -1)
        samples *= self.weights[:, :, None]
        return np.matmul(self._columns, samples.reshape(len(samples), -1, 1))[:, :, 0]

    def matrix(
        self,
        value_value: Array | None = None,
        value_gradient: Array | None = None,
        gradient_value: Array | None = None,
        gradient_gradient: Array | None = None,
    ) -> Array:
        """Return the element matrices of a bilinear form, test function first.

        The form is ∫ φ a ψ + φ b·∇ψ + ∇φ·c ψ + d ∇φ·∇ψ with test function φ and trial
        function ψ.

        Parameters
        ----------
        value_value : ndarray, shape (elements, points), optional
            The coefficient a.
        value_gradient, gradient_value : ndarray, shape (dimension, elements, points), optional
            The coefficients b and c.
        gradient_gradient : ndarray, shape (elements, points), optional
            The coefficient d.

        Returns
        -------
        ndarray, shape (elements, nodes, nodes)
        """
        trial = np.zeros_like(self._table)
        w, table = self.weights[:, :, None], self._table
        if value_value is not None:
            trial[:, :, 0] += (w[..., 0] * value_value)[..., None] * table[:, :, 0]
        if value_gradient is not None:
            slope = w * np.moveaxis(value_gradient, 0, -1)
            trial[:, :, 0] += np.einsum("eqd,eqdn->eqn", slope, table[:, :, 1:])
        if gradient_value is not None:
            slope = w * np.moveaxis(gradient_value, 0, -1)
            trial[:, :, 1:] += slope[..., None] * table[:, :, :1]
        if gradient_gradient is not None:
            trial[:, :, 1:] += (w[..., 0] * gradient_gradient)[..., None, None] * table[:, :, 1:]
        return np.matmul(self._columns, trial.reshape(self._rows.shape))

    def gather(self, element_vectors: Array) -> Array:
        """Sum element vectors (elements, nodes) into a nodal vector (size,)."""
        return sums_by_index(self.dofs, element_vectors, self.size)

    def facet_nodes(self, facets: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the numbers of the nodes on some facets of the mesh."""
        return np.asarray(self.basis.get_dofs(facets).flatten(), dtype=np.intp)

    def at_points(self, points: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the element at each point, and its basis functions there.

        Parameters
        ----------
        points : ndarray, shape (n, 2)
            In or on the edge of the mesh, which is of triangles; a point outside by rounding is
            given the nearest element.

        Returns
        -------
        elements : ndarray of int, shape (n,)
        values : ndarray, shape (n, nodes)
        """
        mesh = self.basis.mesh
        corners = mesh.p[:, mesh.t]
        elements = np.empty(len(points), dtype=np.intp)
        for number, point in enumerate(points):
            offset = corners - np.reshape(point, (2, 1, 1))
            following = np.roll(offset, -1, axis=1)
            # twice the areas of the triangles that the point makes with each side
            areas = offset[0] * following[1] - offset[1] * following[0]
            elements[number] = np.argmax((areas / areas.sum(axis=0)).min(axis=0))
        where = self.basis.mapping.invF(points.T[:, :, None], tind=elements)
        values = [
            np.asarray(self.basis.elem.gbasis(self.basis.mapping, where, node, tind=elements)[0])
            for node in range(self.dofs.shape[1])
        ]
        return elements, np.stack([value.reshape(-1) for value in values], axis=1)

    def point_weights(self, point: tuple[float, ...]) -> tuple[NDArray[np.intp], Array]:
        """Return nodes and weights that interpolate a field at a point of the mesh.

        Raises
        ------
        InputError
            If the point lies outside the mesh.
        """
        where = np.array(point, dtype=float)[:, None]
        try:
            row = self.basis.probes(where).tocsr()
        except ValueError as error:
            raise InputError(f"the point {point} µm lies outside the lever") from error
        return row.indices, row.data
