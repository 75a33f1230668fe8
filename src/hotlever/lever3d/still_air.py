"""Still air around a body, to infinity: Laplace's equation for the Kirchhoff variable θ.

Inside a sphere of radius R the air is meshed as it is. All space outside is mapped into a ball
of the same radius by the Kelvin transform: a point at the distance r from the centre goes to
r' = R²/r, and θ = (r'/R) w with a smooth w that is harmonic in the ball. The energy of the
outside is then ∫|∇w|² over the ball plus (1/R) ∫w² over its surface (E. M. Freeman and
D. A. Lowther, IEEE Trans. Magn. 25, 4135 (1989), with the factor r'/R taken out). At infinity
θ = 0; the heat that arrives there is 4π R w(0).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator

from hotlever.errors import InputError
from hotlever.types import Array, Index


def ngsolve() -> Any:
    """Import NGSolve.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        import ngsolve
    except ImportError:
        raise InputError(
            "the full 3-D simulation in air needs NGSolve: install it with "
            "pip install 'hotlever[air3d]'"
        ) from None
    return ngsolve


class OpenAir:
    """The linear operator from θ on a body's surface to the heat it gives to the air.

    Parameters
    ----------
    mesh : netgen.meshing.Mesh
        Made by `hotlever.probe.mesh.in_a_sphere`: air and image ball, surfaces named.
    centre : tuple of float
        Of the sphere (µm).
    radius_um : float
        Radius of the sphere.
    order : int
        Of the elements in the air, 2 or more. On the body θ is quadratic.

    Attributes
    ----------
    size : int
        Unknowns, those on the body included.
    vertices : ndarray of int, shape (n,)
        Vertices of the mesh on the body.
    edges : ndarray of int, shape (m, 2)
        Edges of the mesh on the body, each by its vertices, the smaller one first.
    """

    filling = 0.0  # no air is modelled inside the silicon

    def __init__(
        self,
        mesh: Any,
        centre: tuple[float, float, float],
        radius_um: float,
        *,
        order: int = 2,
    ) -> None:
        ng = ngsolve()
        self.centre, self.radius_um, self.order = centre, radius_um, order
        self.mesh = ng.Mesh(mesh)
        self.mesh.Curve(2)
        self.space = ng.Periodic(ng.H1(self.mesh, order=order, definedon="air|image"))
        trial, test = self.space.TnT()
        form = ng.BilinearForm(self.space, symmetric=True)
        for part in ("air", "image"):
            form += ng.grad(trial) * ng.grad(test) * ng.dx(part)
        form += (1.0 / radius_um) * trial * test * ng.ds("sphere")
        form.Assemble()
        rows, columns, values = form.mat.COO()
        shape = (self.space.ndof, self.space.ndof)
        self._matrix = csr_matrix(
            (np.array(values), (np.array(rows), np.array(columns))), shape=shape
        )
        diagonal = self._matrix.diagonal()
        self.size = int(np.count_nonzero(diagonal))
        free = diagonal != 0
        free[self._lay_out_surface(ng)] = False
        self._inverse = form.mat.Inverse(ng.BitArray(free.tolist()), inverse="sparsecholesky")
        self._right, self._left = form.mat.CreateColVector(), form.mat.CreateColVector()
        self._form = form  # the inverse refers to its matrix

    def _lay_out_surface(self, ng: Any) -> Index:
        """Number the body's nodes, vertices first, and map their values to coefficients.

        Returns the degrees of freedom on the body, which θ there determines.
        """
        surface = self.mesh.Boundaries("lever")
        vertices = {vertex.nr for face in surface.Elements() for vertex in face.vertices}
        edges = {edge.nr: edge for face in surface.Elements() for edge in face.edges}
        ordered = [edges[number] for number in sorted(edges)]
        ends = [sorted(vertex.nr for vertex in self.mesh[edge].vertices) for edge in ordered]
        self.vertices = np.array(sorted(vertices), dtype=np.intp)
        self.edges = np.array(ends, dtype=np.intp).reshape(-1, 2)
        of_vertices = self._vertex_dofs(ng, self.vertices)
        of_edges = np.array([self.space.GetDofNrs(edge)[0] for edge in ordered], dtype=np.intp)
        # hierarchical basis: an edge's function is zero at its ends and `peak` in its middle
        peak = float(ng.fem.H1FE(ng.ET.SEGM, 2).CalcShape(0.5)[2])
        count, more = len(of_vertices), len(of_edges)
        values = np.repeat([1.0, 1.0 / peak, -0.5 / peak], [count, more, 2 * more])
        rows = np.concatenate([of_vertices, of_edges, of_edges, of_edges])
        at_ends = np.searchsorted(self.vertices, self.edges).T.ravel()
        columns = np.concatenate([np.arange(count + more), at_ends])
        self._to_coefficients = csr_matrix(
            (values, (rows, columns)), shape=(self.space.ndof, count + more)
        )
        return np.flatnonzero(list(self.space.GetDofs(surface)))

    def _vertex_dofs(self, ng: Any, vertices: Iterable[int]) -> Index:
        """Return the degree of freedom of each of some vertices, negative where there is no air."""
        nodes = (ng.NodeId(ng.VERTEX, int(vertex)) for vertex in vertices)
        return np.array([self.space.GetDofNrs(node)[0] for node in nodes], dtype=np.intp)

    @property
    def matrix(self) -> LinearOperator:
        """The operator from θ to heat, for `hotlever.air.coupling.AirLoss`."""
        return self.less(np.zeros(self._to_coefficients.shape[1]))

    @property
    def sites(self) -> Array:
        """The body's nodes, shape (n + m, 3) (µm)."""
        points = np.array(self.mesh.ngmesh.Coordinates())
        return np.concatenate([points[self.vertices], points[self.edges].mean(axis=1)])

    def less(self, diagonal: Array) -> LinearOperator:
        """Return the operator less a diagonal matrix."""

        def product(theta: Array) -> Array:
            theta = theta.ravel()
            heat: Array = self.solve(theta)[1] - diagonal * theta
            return heat

        return LinearOperator((diagonal.size, diagonal.size), matvec=product, dtype=float)

    def solve(self, theta: Array) -> tuple[Array, Array]:
        """Solve the air for θ on the body.

        Parameters
        ----------
        theta : ndarray, shape (n + m,)
            At the vertices and then in the middles of the edges.

        Returns
        -------
        coefficients : ndarray
            Of θ in the air and of w in the image ball.
        heat : ndarray, shape (n + m,)
            Heat given to the air at each node (θ times µm): the reactions, whose sum is the
            total.
        """
        coefficients = self._to_coefficients @ theta
        self._right.FV().NumPy()[:] = -(self._matrix @ coefficients)
        self._left.data = self._inverse * self._right
        coefficients += self._left.FV().NumPy()
        return coefficients, self._to_coefficients.T @ (self._matrix @ coefficients)

    def at_infinity(self, coefficients: Array) -> float:
        """Return the heat that arrives at infinity (θ times µm), by the value of w at zero."""
        x, y, z = self.centre
        field = ngsolve().GridFunction(self.space)
        field.vec.FV().NumPy()[:] = coefficients
        w = field(self.mesh(x + 3 * self.radius_um, y, z))
        return float(4 * np.pi * self.radius_um * w)

    def at_vertices(self, coefficients: Array) -> Array:
        """Return a solution at all vertices of the mesh; zero where there is no air."""
        dofs = self._vertex_dofs(ngsolve(), range(self.mesh.nv))
        return np.where(dofs >= 0, coefficients[dofs], 0.0)
