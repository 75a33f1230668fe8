"""Tetrahedra for a lever of its true thickness, alone or in a sphere of air.

The lever's mid-plane is z = 0; a tip points to −z. Around the lever, if asked for, is a sphere
of air, and beside it a second ball of the same radius whose surface is meshed like the
sphere's: the image of all space outside under the Kelvin transform (`hotlever.lever3d.still_air`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import ComputationError, InputError
from hotlever.probe.circuit import Wiring
from hotlever.probe.layout import Layout, Region
from hotlever.probe.mesh import ON_LINE, MeshSizes, ProbeMesh, face_of, terminal_facets
from hotlever.types import Array, Index


@dataclass(frozen=True)
class SolidMeshOptions(MeshSizes):
    """Sizes of the tetrahedra; see `hotlever.probe.mesh.MeshSizes`.

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
    from skfem import MeshTet  # see `hotlever.probe.mesh`

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
