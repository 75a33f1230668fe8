"""Triangles for a layout, graded to the heater and to the re-entrant corners."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet, MeshTri

from hotlever.errors import ComputationError
from hotlever.probe.layout import Layout, Point, Terminal

_ON_LINE = 1e-6  # µm


@dataclass(frozen=True)
class MeshOptions:
    """Sizes of the triangles, in proportion to the layout.

    The defaults keep I_h and V_r within 1e-4 and T_tip within 0.1 K of a converged mesh, from
    1 to 11 V and for all published parameters; ``benchmarks/mesh_convergence.py`` prints it.

    Attributes
    ----------
    refinement : float
        Divides all sizes: 2 halves them.
    heater : float
        Largest edge in the heater, as a share of its narrow side.
    corner : float
        Edge at re-entrant corners, as a share of the heater's narrow side.
    lever : float
        Largest edge elsewhere, as a share of the lever's length.
    grading : float
        How fast sizes may grow away from small ones (0 to 1).
    """

    refinement: float = 1.0
    heater: float = 0.25
    corner: float = 0.02
    lever: float = 0.1
    grading: float = 0.5


@dataclass(frozen=True)
class ProbeMesh:
    """A triangulated layout.

    Attributes
    ----------
    layout : Layout
    triangles : skfem.MeshTri
        Vertices (2, n) in µm and triangles (3, m).
    region : ndarray of int, shape (m,)
        Index into ``layout.regions`` of each triangle.
    terminal_facets : mapping of str to ndarray of int
        Facet indices of `triangles` on each terminal, by the terminal's name.
    """

    layout: Layout
    triangles: MeshTri
    region: NDArray[np.intp]
    terminal_facets: Mapping[str, NDArray[np.intp]]

    @property
    def elements(self) -> MeshTri:
        """The triangles."""
        return self.triangles


def mesh_layout(layout: Layout, options: MeshOptions | None = None) -> ProbeMesh:
    """Triangulate a layout with Netgen.

    Parameters
    ----------
    layout : Layout
    options : MeshOptions, optional

    Raises
    ------
    ComputationError
        If Netgen makes no mesh, or a terminal has no edge on the outline.
    """
    options = options or MeshOptions()
    points, triangles, region = _netgen(layout, options)
    mesh = MeshTri(points.T.copy(), triangles.T.copy())
    edges = {terminal.name: facets_on(mesh, terminal) for terminal in layout.terminals}
    return ProbeMesh(layout, mesh, region, edges)


def _netgen(
    layout: Layout, options: MeshOptions
) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]:
    # imported here: OpenCASCADE takes a quarter of a second to load, and a saved sweep can be
    # read and drawn without it
    from netgen.occ import Glue, OCCGeometry, WorkPlane

    def extent(points: tuple[Point, ...]) -> NDArray[np.float64]:
        return np.ptp(np.array(points), axis=0)

    narrow = extent(layout.heater.outline).min() / options.refinement
    whole = max(extent(region.outline).max() for region in layout.regions) / options.refinement
    faces = []
    for index, region in enumerate(layout.regions):
        plane = WorkPlane().MoveTo(*region.outline[0])
        for point in region.outline[1:]:
            plane.LineTo(*point)
        face = plane.Close().Face()
        face.name = f"{index}"
        if region.part == "heater":
            face.maxh = options.heater * narrow
        faces.append(face)
    shape = Glue(faces)
    corners = layout.reentrant_corners()
    for vertex in shape.vertices:
        if any(math.dist((vertex.p[0], vertex.p[1]), corner) < _ON_LINE for corner in corners):
            vertex.maxh = options.corner * narrow
    # gluing keeps the faces' names but not their order
    names = [int(face.name) for face in shape.faces]
    mesh = OCCGeometry(shape, dim=2).GenerateMesh(
        maxh=options.lever * whole, grading=options.grading
    )
    elements = mesh.Elements2D().NumPy()
    if not len(elements):
        raise ComputationError("Netgen made no triangles for this layout")
    # a copy: Coordinates() is a view of memory that goes away with Netgen's mesh
    points = np.array(mesh.Coordinates())[:, :2]
    triangles = elements["nodes"][:, :3].astype(np.intp) - 1
    region = np.array(names)[elements["index"] - 1]
    return points, triangles, region


def facets_on(mesh: MeshTri | MeshTet, terminal: Terminal) -> NDArray[np.intp]:
    """Return the boundary facets with all corners on the terminal's line, or above or below it.

    Raises
    ------
    ComputationError
        If there are none.
    """
    facets = mesh.boundary_facets()
    corners = mesh.p[:2, mesh.facets[:, facets].ravel()]
    on = _on_segment(corners, terminal.start, terminal.end).reshape(-1, facets.size).all(axis=0)
    if not on.any():
        kind = "edge" if mesh.dim() == 2 else "face"
        raise ComputationError(f"terminal '{terminal.name}' touches no {kind} of the lever")
    return np.asarray(facets[on], dtype=np.intp)


def _on_segment(points: NDArray[np.float64], start: Point, end: Point) -> NDArray[np.bool_]:
    """Whether points (2, n) lie on the segment from `start` to `end`."""
    a, b = np.array(start), np.array(end)
    length = np.linalg.norm(b - a)
    along = (b - a) @ (points - a[:, None]) / length
    across = (b - a)[0] * (points[1] - a[1]) - (b - a)[1] * (points[0] - a[0])
    return (np.abs(across / length) < _ON_LINE) & (along > -_ON_LINE) & (along < length + _ON_LINE)
