"""Triangles for a layout, graded to the heater and to the re-entrant corners; or tetrahedra.

These are for a lever of its true thickness, alone or in a sphere of air. Its mid-plane is z = 0; a
tip points to −z. Around the lever, if asked for, is a sphere of air, and beside it a second ball of
the same radius whose surface is meshed like the sphere's: the image of all space outside under the
Kelvin transform (`hotlever.lever3d`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import ComputationError, InputError
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


# --- tetrahedra -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class SolidMeshOptions(MeshSizes):
    """Sizes of the tetrahedra; see `MeshSizes`.

    The defaults keep T_tip within 0.3 K and I_h within 3e-4 of the flat lever, from 1 to 11 V
    without air; ``benchmarks/air.py`` prints it.

    Attributes
    ----------
    rim : float
        Largest edge along the edges of the silicon, as a share of its thickness: the flux into
        the air is singular there.
    sphere : float
        Largest edge in the air and in the image ball, as a share of the sphere's radius.
    """

    heater: float = 0.15
    corner: float = 0.04
    lever: float = 0.05
    rim: float = 2.0
    sphere: float = 0.3


@dataclass(frozen=True)
class SolidMesh(ProbeMesh):
    """A lever cut into tetrahedra, and the mesh of the air around it.

    Attributes
    ----------
    netgen : netgen.meshing.Mesh
        The whole mesh, with the air if there is any.
    vertices : ndarray of int, shape (n,)
        Number in the whole mesh of each vertex of the silicon.
    centre : tuple of float
        Of the sphere (µm).
    """

    netgen: Any
    vertices: Index
    centre: tuple[float, float, float]


def mesh_solid(
    layout: Layout,
    options: SolidMeshOptions | None = None,
    *,
    sphere_radius_um: float | None = None,
    wiring: Wiring | None = None,
) -> SolidMesh:
    """Cut a lever of its true thickness into tetrahedra with Netgen.

    Parameters
    ----------
    layout : Layout
    options : SolidMeshOptions, optional
    sphere_radius_um : float, optional
        Mesh the air too, in a sphere of this radius around the middle of the lever.
    wiring : Wiring, optional
        Says where currents flow; by default as in the paper.

    Raises
    ------
    InputError
        If the sphere does not contain the lever with some room, or the lever takes too many
        tetrahedra.
    ComputationError
        If Netgen makes no mesh.
    """
    from netgen.occ import OCCGeometry

    _check_size(layout)
    options = options or SolidMeshOptions()
    middle, reach = middle_and_reach(layout)
    centre = (float(middle[0]), float(middle[1]), 0.0)
    shape = _silicon(layout, layout.heaters(wiring), options)
    largest = options.lever * np.ptp(layout.box, axis=0).max() / options.refinement
    if sphere_radius_um is not None:
        if not sphere_radius_um > 1.1 * reach:
            raise InputError(
                f"a sphere of radius {sphere_radius_um:g} µm does not hold the lever with some "
                f"room: expected more than {1.1 * reach:.3g} µm"
            )
        shape = in_a_sphere(shape, centre, sphere_radius_um)
        largest = options.sphere * sphere_radius_um / options.refinement
    try:
        mesh = OCCGeometry(shape).GenerateMesh(maxh=largest, grading=options.grading)
    except Exception as error:  # Netgen's own type is not exported
        raise ComputationError(f"Netgen could not mesh the lever: {error}") from error
    return _take_out_silicon(mesh, layout, centre)


def middle_and_reach(layout: Layout) -> tuple[Array, float]:
    """Return the middle of a lever's box, and how far away from it its corners are (µm)."""
    middle = layout.box.mean(axis=0)
    return middle, float(np.linalg.norm(layout.corners - middle, axis=1).max())


def _check_size(layout: Layout) -> None:
    """Refuse a lever that would take hours and gigabytes with tetrahedra of the default sizes."""
    sizes, thickness = SolidMeshOptions(), layout.thickness_um
    edges = sum(math.dist(a, b) for region in layout.regions for a, b in region.edges)
    narrow = layout.heater.narrow_um
    along_rims = edges / (sizes.rim * thickness)
    in_heater = layout.heater.area * thickness / (sizes.heater * narrow) ** 3
    # at so many steps along the rims, or cells in the heater, a lever takes two minutes to solve
    if max(along_rims / 4000, in_heater / 2500) > 1:
        raise InputError(
            f"full 3-D simulation: with a thickness of {thickness:g} µm, edges of {edges:.4g} µm "
            f"in all and a heater {narrow:g} µm narrow this lever takes too many tetrahedra; "
            "expected sizes that differ less"
        )


def _silicon(layout: Layout, heaters: tuple[Region, ...], options: SolidMeshOptions) -> Any:
    """The regions as solids, named by their number; the tip belongs to the heater."""
    from netgen.occ import Axes, Axis, Glue, Pnt, WorkPlane, X, Y, Z

    narrow = layout.heater.narrow_um / options.refinement
    whole = np.ptp(layout.box, axis=0).max() / options.refinement
    bottom = -layout.thickness_um / 2
    solids = []
    for index, region in enumerate(layout.regions):
        face = face_of(region, WorkPlane(Axes((0, 0, bottom), Z, X)))
        solid = face.Extrude(layout.thickness_um)
        solid.mat(f"{index}")
        solid.maxh = (options.heater * narrow) if region in heaters else options.lever * whole
        solids.append(solid)
    if layout.cone is not None:
        cone = layout.cone
        x, y = layout.tip
        # half of the cone's section, turned about its axis
        section = WorkPlane(Axes((x, y, bottom), Y, X))
        section.MoveTo(0, 0).LineTo(cone.base_radius_um, 0)
        section.LineTo(cone.apex_radius_um, cone.height_um).LineTo(0, cone.height_um)
        solid = section.Close().Face().Revolve(Axis(Pnt(x, y, bottom), Z), 360)
        solid.mat(f"{layout.regions.index(layout.heater)}")
        solid.maxh = min(0.5 * cone.base_radius_um, options.heater * narrow)
        solids.append(solid)
    silicon = Glue(solids)
    reentrant = layout.reentrant_corners()
    rim = options.rim * layout.thickness_um / options.refinement
    for edge in silicon.edges:
        edge.maxh = min(edge.maxh, rim)
        ends = [(vertex.p[0], vertex.p[1]) for vertex in edge.vertices]
        if any(max(math.dist(end, corner) for end in ends) < ON_LINE for corner in reentrant):
            edge.maxh = options.corner * narrow
    return silicon


def in_a_sphere(body: Any, centre: tuple[float, float, float], radius: float) -> Any:
    """Put a body (an OCC shape) in a sphere of air, with an image ball beside it (µm)."""
    from netgen.meshing import IdentificationType
    from netgen.occ import Compound, Glue, Pnt, Sphere, Vec, gp_Trsf

    ball = Sphere(Pnt(*centre), radius)
    ball.faces.name = "sphere"
    air = ball - body
    air.mat("air")
    inside = Glue([body, air])
    for solid in inside.solids:
        if solid.name == "air":
            for face in solid.faces:
                face.name = face.name if face.name == "sphere" else "lever"
    # the image ball, whose surface is meshed like the sphere's
    shift = Vec(3 * radius, 0, 0)
    image = Sphere(Pnt(*centre), radius).Move(shift)
    image.mat("image")
    image.faces.name = "image"
    (outer,) = [face for face in inside.faces if face.name == "sphere"]
    # with longer edges on the sphere Netgen fails to pair it with the image ball
    image.faces.maxh = outer.maxh = 0.25 * radius
    outer.Identify(
        image.faces[0], "kelvin", IdentificationType.PERIODIC, gp_Trsf.Translation(shift)
    )
    return Compound([inside, image])


def material_names(mesh: Any) -> NDArray[np.str_]:
    """Return the name of the part of space that each of Netgen's tetrahedra belongs to."""
    numbers = mesh.Elements3D().NumPy()["index"]
    return np.array([mesh.GetMaterial(number + 1) for number in range(numbers.max())])[numbers - 1]


def _take_out_silicon(mesh: Any, layout: Layout, centre: tuple[float, float, float]) -> SolidMesh:
    from skfem import MeshTet  # see `_netgen`

    elements = mesh.Elements3D().NumPy()
    if not len(elements):
        raise ComputationError("Netgen made no tetrahedra for this lever")
    names = material_names(mesh)
    silicon = np.char.isdecimal(names)
    tetrahedra = elements["nodes"][silicon, :4].astype(np.intp) - 1
    vertices, numbers = np.unique(tetrahedra, return_inverse=True)
    # a copy: Coordinates() is a view of memory that goes away with Netgen's mesh
    points = np.array(mesh.Coordinates())[vertices]
    solid = MeshTet(
        np.ascontiguousarray(points.T), np.ascontiguousarray(numbers.reshape(tetrahedra.shape).T)
    )
    region, facets = names[silicon].astype(np.intp), terminal_facets(solid, layout)
    return SolidMesh(layout, solid, region, facets, mesh, vertices, centre)
