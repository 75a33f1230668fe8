"""Triangles for a layout, graded to the heater and to the re-entrant corners."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hotlever.errors import ComputationError
from hotlever.probe.circuit import Wiring
from hotlever.probe.layout import Layout, Point, Region
from hotlever.types import Array, Index

if TYPE_CHECKING:
    from skfem import MeshTet, MeshTri

#: How far off (µm) a point is still on a line, or a corner.
ON_LINE = 1e-6
#: As many squares of its width as a drawn heater may have: it is meshed in steps of its width.
MOST_SQUARES = 100.0


@dataclass(frozen=True)
class MeshSizes:
    """Sizes of triangles or tetrahedra, in proportion to the layout.

    Attributes
    ----------
    refinement : float
        Divides all sizes: 2 halves them.
    heater : float
        Largest edge in the heater, as a share of its narrow side.
    corner : float
        Edge at re-entrant corners, as a share of the heater's narrow side.
    lever : float
        Largest edge elsewhere in the silicon, as a share of the lever's length.
    grading : float
        How fast sizes may grow away from small ones (0 to 1).
    """

    refinement: float = 1.0
    heater: float = 0.25
    corner: float = 0.02
    lever: float = 0.1
    grading: float = 0.5


@dataclass(frozen=True)
class MeshOptions(MeshSizes):
    """Sizes of the triangles; see `MeshSizes`.

    The defaults keep I_h and V_r within 1e-4 and T_tip within 0.1 K of a converged mesh, from
    1 to 11 V and for all published parameters; ``benchmarks/convergence.py mesh`` prints it.

    Attributes
    ----------
    panels : float
        Divides the sizes of the panels that stand for the air, see `hotlever.air.surface`.
    panels_over_surface : float
        The same where a surface is below, unless `panels` is less: both faces have panels there.
        Rises of the temperature, and slopes of voltages by the distance, are within 1e-3 of those
        of finer panels, rises within 1.5e-3 where the air's temperature does not jump;
        ``benchmarks/reader.py panels`` prints it.
    """

    panels: float = 1.0
    panels_over_surface: float = 0.7


@dataclass(frozen=True)
class ProbeMesh:
    """A layout cut into triangles, or tetrahedra.

    Attributes
    ----------
    layout : Layout
    elements : skfem.MeshTri or skfem.MeshTet
        Vertices (2 or 3, n) in µm and elements (3 or 4, m).
    region : ndarray of int, shape (m,)
        Index into ``layout.regions`` of each element; a tip belongs to the heater.
    terminal_facets : mapping of str to ndarray of int
        Facets of `elements` on each terminal, by the terminal's name.
    """

    layout: Layout
    elements: MeshTri | MeshTet
    region: Index
    terminal_facets: Mapping[str, Index]

    def refined(self, triangles: Index) -> ProbeMesh:
        """Return the mesh with these triangles, by their numbers, split into four.

        Of their neighbours, some are split too, so that the mesh stays conforming.
        """
        from skfem import MeshTri  # see `_netgen`

        parts = {str(index): self.region == index for index in range(len(self.layout.regions))}
        named = self.elements.with_subdomains(
            {name: np.flatnonzero(inside) for name, inside in parts.items()}
        )
        elements = named.refined(triangles)
        region = np.empty(elements.nelements, dtype=self.region.dtype)
        for name in parts:
            region[elements.subdomains[name]] = int(name)
        elements = MeshTri(elements.p, elements.t)
        return ProbeMesh(self.layout, elements, region, terminal_facets(elements, self.layout))


def mesh_layout(
    layout: Layout, options: MeshOptions | None = None, wiring: Wiring | None = None
) -> ProbeMesh:
    """Triangulate a layout with Netgen.

    Where current flows, and so where triangles are small, depends on the wiring, by default as in
    the paper.

    Raises
    ------
    ComputationError
        If Netgen cannot mesh it, or a terminal has no edge on the outline.
    """
    not_meshed = "Netgen could not mesh this layout; are its parts of too different a size?"
    try:
        heaters = layout.heaters(wiring)
        mesh, region = _netgen(layout, heaters, options or MeshOptions())
    except RuntimeError as error:
        raise ComputationError(f"{not_meshed} ({error})") from error
    # where Netgen fails at a face it says so to the terminal only, and leaves a hole
    area = sum(region.area for region in layout.regions)
    if not np.isclose(np.abs(doubled_areas(mesh.p[:, mesh.t])).sum() / 2, area, rtol=1e-9):
        raise ComputationError(not_meshed)
    return ProbeMesh(layout, mesh, region, terminal_facets(mesh, layout))


def doubled_areas(corners: Array) -> Array:
    """Return twice the signed areas of triangles (2, 3, n)."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(first[0] * second[1] - first[1] * second[0])


def _netgen(
    layout: Layout, heaters: tuple[Region, ...], options: MeshOptions
) -> tuple[MeshTri, Index]:
    # imported here: OpenCASCADE takes a quarter of a second to load, scikit-fem a tenth, and a
    # probe is written and a saved sweep read and drawn without a mesh
    from netgen.occ import Glue, OCCGeometry, WorkPlane
    from skfem import MeshTri

    narrow = layout.heater.narrow_um / options.refinement
    whole = max(region.sides.max() for region in layout.regions) / options.refinement
    faces = []
    for index, region in enumerate(layout.regions):
        face = face_of(region, WorkPlane())
        face.name = f"{index}"
        if region in heaters:
            # of a film that heats all along, some hundred steps are enough
            step = max(region.narrow_um, math.sqrt(region.area / MOST_SQUARES))
            face.maxh = options.heater * step / options.refinement
        faces.append(face)
    shape = Glue(faces)
    corners = layout.reentrant_corners()
    for vertex in shape.vertices:
        if any(math.dist((vertex.p[0], vertex.p[1]), corner) < ON_LINE for corner in corners):
            vertex.maxh = options.corner * narrow
    # gluing keeps the faces' names but not their order
    names = np.array([int(face.name) for face in shape.faces])
    mesh = OCCGeometry(shape, dim=2).GenerateMesh(
        maxh=options.lever * whole, grading=options.grading
    )
    elements = mesh.Elements2D().NumPy()
    if not len(elements):
        raise ComputationError("Netgen made no triangles for this layout")
    # copies: Coordinates() is a view of memory that goes away with Netgen's mesh
    points = np.array(mesh.Coordinates())[:, :2].T.copy()
    triangles = elements["nodes"][:, :3].astype(np.intp) - 1
    return MeshTri(points, triangles.T.copy()), names[elements["index"] - 1]


def face_of(region: Region, plane: Any) -> Any:
    """Draw a region on one of Netgen's work planes."""

    def inside(ring: tuple[Point, ...]) -> Any:
        plane.MoveTo(*ring[0])
        for point in ring[1:]:
            plane.LineTo(*point)
        return plane.Close().Face()

    face = inside(region.outline)
    for hole in region.holes:
        face = face - inside(hole)
    return face


def terminal_facets(mesh: MeshTri | MeshTet, layout: Layout) -> dict[str, Index]:
    """Return the boundary facets on, above or below the line of each terminal, by its name.

    Raises
    ------
    ComputationError
        If a terminal has none.
    """
    facets = mesh.boundary_facets()
    corners = mesh.p[:2, mesh.facets[:, facets]]
    touched: dict[str, Index] = {}
    for terminal in layout.terminals:
        _, on = on_line(terminal.start, terminal.end, corners)
        before = touched.get(terminal.name, np.empty(0, dtype=facets.dtype))
        touched[terminal.name] = np.union1d(before, facets[on.all(axis=0)])
    for name, on_it in touched.items():
        if not on_it.size:
            kind = "edge" if mesh.dim() == 2 else "face"
            raise ComputationError(f"terminal '{name}' touches no {kind} of the lever")
    return touched


def on_line(start: Point | Array, end: Point | Array, points: Array) -> tuple[Array, Array]:
    """Return where points (2, ...) are along a line, and which lie on it."""
    line = np.subtract(end, start)
    length = np.linalg.norm(line)
    x, y = points[0] - start[0], points[1] - start[1]
    along, across = (line[0] * x + line[1] * y) / length, (line[0] * y - line[1] * x) / length
    on = (np.abs(across) < ON_LINE) & (along > -ON_LINE) & (along < length + ON_LINE)
    return along, on
