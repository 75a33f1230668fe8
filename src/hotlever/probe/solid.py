"""Tetrahedra for a lever of its true thickness, alone or in a sphere of air.

The lever's mid-plane is z = 0; a tip points to −z. Around the lever, if asked for, is a sphere
of air, and beside it a second ball of the same radius whose surface is meshed like the
sphere's: the image of all space outside under the Kelvin transform (`hotlever.lever3d.still_air`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet

from hotlever.errors import ComputationError, InputError
from hotlever.probe.layout import Layout
from hotlever.probe.mesh import facets_on

_ON_LINE = 1e-6  # µm
#: Largest edge on the sphere, as a share of its radius: with longer ones Netgen fails to pair
#: the sphere with the image ball.
_COARSEST_SPHERE = 0.25

#: Names of the parts of the mesh outside the silicon.
AIR, IMAGE, SPHERE, LEVER_SURFACE = "air", "image", "sphere", "lever"


@dataclass(frozen=True)
class SolidMeshOptions:
    """Sizes of the tetrahedra.

    The defaults keep T_tip within 0.3 K and I_h within 3e-4 of the flat lever, from 1 to 11 V
    without air; ``benchmarks/air_3d.py`` prints it.

    Attributes
    ----------
    refinement : float
        Divides all sizes: 2 halves them.
    heater : float
        Largest edge in the heater, as a share of its narrow side.
    corner : float
        Edge along re-entrant corners, as a share of the heater's narrow side.
    lever : float
        Largest edge elsewhere in the silicon, as a share of the lever's length.
    rim : float
        Largest edge along the edges of the silicon, as a share of its thickness: the flux into
        the air is singular there.
    sphere : float
        Largest edge in the air and in the image ball, as a share of the sphere's radius.
    grading : float
        How fast sizes may grow away from small ones (0 to 1).
    """

    refinement: float = 1.0
    heater: float = 0.15
    corner: float = 0.04
    lever: float = 0.05
    rim: float = 2.0
    sphere: float = 0.3
    grading: float = 0.5


@dataclass(frozen=True)
class SolidMesh:
    """A lever cut into tetrahedra, and the mesh of the air around it.

    Attributes
    ----------
    layout : Layout
    elements : skfem.MeshTet
        Vertices (3, n) in µm and tetrahedra (4, m) of the silicon.
    region : ndarray of int, shape (m,)
        Index into ``layout.regions``; a tip belongs to the heater.
    terminal_facets : mapping of str to ndarray of int
        Facets of `elements` on each terminal.
    netgen : netgen.meshing.Mesh
        The whole mesh, with the air if there is any.
    vertices : ndarray of int, shape (n,)
        Number in the whole mesh of each vertex of the silicon.
    centre : tuple of float
        Of the sphere (µm).
    radius_um : float or None
        Of the sphere; None without air.
    """

    layout: Layout
    elements: MeshTet
    region: NDArray[np.intp]
    terminal_facets: Mapping[str, NDArray[np.intp]]
    netgen: Any
    vertices: NDArray[np.intp]
    centre: tuple[float, float, float]
    radius_um: float | None


def mesh_solid(
    layout: Layout,
    options: SolidMeshOptions | None = None,
    *,
    sphere_radius_um: float | None = None,
) -> SolidMesh:
    """Cut a lever of its true thickness into tetrahedra with Netgen.

    Parameters
    ----------
    layout : Layout
    options : SolidMeshOptions, optional
    sphere_radius_um : float, optional
        Mesh the air too, in a sphere of this radius around the middle of the lever.

    Raises
    ------
    InputError
        If the sphere does not contain the lever with some room.
    ComputationError
        If Netgen makes no mesh.
    """
    from netgen.occ import OCCGeometry

    options = options or SolidMeshOptions()
    corners = np.array([point for region in layout.regions for point in region.outline])
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    centre = (float(middle[0]), float(middle[1]), 0.0)
    shape = _silicon(layout, options)
    whole = max(np.ptp(corners, axis=0))
    largest = options.lever * whole / options.refinement
    if sphere_radius_um is not None:
        reach = np.linalg.norm(corners - middle, axis=1).max()
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
    return _take_out_silicon(mesh, layout, centre, sphere_radius_um)


def _silicon(layout: Layout, options: SolidMeshOptions) -> Any:
    """The regions as solids, named by their number; the tip belongs to the heater."""
    from netgen.occ import Axes, Axis, Glue, Pnt, WorkPlane, X, Y, Z

    corners = np.array([point for region in layout.regions for point in region.outline])
    narrow = np.ptp(np.array(layout.heater.outline), axis=0).min() / options.refinement
    whole = max(np.ptp(corners, axis=0)) / options.refinement
    bottom = -layout.thickness_um / 2
    solids = []
    for index, region in enumerate(layout.regions):
        plane = WorkPlane(Axes((0, 0, bottom), Z, X)).MoveTo(*region.outline[0])
        for point in region.outline[1:]:
            plane.LineTo(*point)
        solid = plane.Close().Face().Extrude(layout.thickness_um)
        solid.mat(f"{index}")
        solid.maxh = (options.heater * narrow) if region.part == "heater" else options.lever * whole
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
        if any(max(math.dist(end, corner) for end in ends) < _ON_LINE for corner in reentrant):
            edge.maxh = options.corner * narrow
    return silicon


def in_a_sphere(body: Any, centre: tuple[float, float, float], radius: float) -> Any:
    """Put a body (an OCC shape) in a sphere of air, with an image ball beside it (µm)."""
    from netgen.occ import Glue, Pnt, Sphere

    ball = Sphere(Pnt(*centre), radius)
    ball.faces.name = SPHERE
    air = ball - body
    air.mat(AIR)
    inside = Glue([body, air])
    for solid in inside.solids:
        if solid.name == AIR:
            for face in solid.faces:
                face.name = face.name if face.name == SPHERE else LEVER_SURFACE
    return with_image(inside, centre, radius)


def with_image(inside: Any, centre: tuple[float, float, float], radius: float) -> Any:
    """Set the image ball beside a sphere whose surface is named; the two are meshed alike."""
    from netgen.meshing import IdentificationType
    from netgen.occ import Compound, Pnt, Sphere, Vec, gp_Trsf

    shift = Vec(3 * radius, 0, 0)
    image = Sphere(Pnt(*centre), radius).Move(shift)
    image.mat(IMAGE)
    image.faces.name = IMAGE
    (outer,) = [face for face in inside.faces if face.name == SPHERE]
    image.faces.maxh = outer.maxh = _COARSEST_SPHERE * radius
    outer.Identify(
        image.faces[0], "kelvin", IdentificationType.PERIODIC, gp_Trsf.Translation(shift)
    )
    return Compound([inside, image])


def _take_out_silicon(
    mesh: Any, layout: Layout, centre: tuple[float, float, float], radius: float | None
) -> SolidMesh:
    elements = mesh.Elements3D().NumPy()
    if not len(elements):
        raise ComputationError("Netgen made no tetrahedra for this lever")
    names = [mesh.GetMaterial(number) for number in range(1, int(elements["index"].max()) + 1)]
    region_of = np.array([int(name) if name.isdecimal() else -1 for name in names])
    region = region_of[elements["index"] - 1]
    tetrahedra = elements["nodes"][region >= 0, :4].astype(np.intp) - 1
    vertices, numbers = np.unique(tetrahedra, return_inverse=True)
    # a copy: Coordinates() is a view of memory that goes away with Netgen's mesh
    points = np.array(mesh.Coordinates())[vertices]
    silicon = MeshTet(
        np.ascontiguousarray(points.T), np.ascontiguousarray(numbers.reshape(tetrahedra.shape).T)
    )
    facets = {terminal.name: facets_on(silicon, terminal) for terminal in layout.terminals}
    return SolidMesh(layout, silicon, region[region >= 0], facets, mesh, vertices, centre, radius)
