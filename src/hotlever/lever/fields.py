"""Fields of a solved state as they are drawn and saved: on a fine triangulation, on a line.

And its heat into the air: where it leaves, by region, and how hot the air gets.

`write_fields` writes those of any lever: another kind of lever than `Lever` registers how its own
are written.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, singledispatch
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import meshio
import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from shapely import Polygon
from skfem import MeshTri

from hotlever.air.operator import PanelledAir
from hotlever.air.panels import Panels
from hotlever.datasets import labelled
from hotlever.errors import InputError
from hotlever.files import whole_file, write_text
from hotlever.lever.discretisation import plate_of
from hotlever.lever.elements import FiniteElements
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import Lever, State
from hotlever.materials.air import temperature_from_kirchhoff
from hotlever.materials.kinds import HighDopedSilicon
from hotlever.materials.silicon import tapered_doping
from hotlever.types import Array
from hotlever.units import PER_CM_TO_MILLI_PER_UM

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class FieldMap:
    """Fields of one state on a triangulation finer than the mesh.

    Attributes
    ----------
    bias : float
        V.
    points : ndarray, shape (n, 2)
        µm. Neighbouring elements have points of their own.
    triangles : ndarray of int, shape (m, 3)
    temperature, potential : ndarray, shape (n,)
        K and V; the potential is NaN where nothing conducts.
    region : ndarray of int, shape (m,)
        Index into the layout's regions.
    current_density : ndarray, shape (m, 2)
        mA/µm².
    heat_flux : ndarray, shape (m, 2)
        mW/µm².
    resistivity : ndarray, shape (m,)
        Ω cm, the mean of what lies on one another; infinite where nothing conducts.
    """

    bias: float
    points: Array
    triangles: NDArray[np.intp]
    temperature: Array
    potential: Array
    region: NDArray[np.intp]
    current_density: Array
    heat_flux: Array
    resistivity: Array


@dataclass(frozen=True)
class Surface:
    """A lever seen from above, as triangles.

    Attributes
    ----------
    points : ndarray, shape (n, 2)
        µm.
    triangles : ndarray of int, shape (m, 3)
    sampling : csr_matrix, shape (n, nodes)
        From values at the nodes of the lever's elements to those at the points.
    """

    points: Array
    triangles: NDArray[np.intp]
    sampling: csr_matrix


@singledispatch
def seen_from_above(lever: Lever, cuts: int = 3) -> Surface:
    """Return a lever as it is drawn: every triangle of its mesh is cut into ``cuts²`` of them."""
    reference = _cut_triangle(cuts)
    rule = reference.p, np.full(reference.p.shape[1], 1.0)
    mesh, element = lever.space.mesh, lever.space.elements.basis.elem
    corners = FiniteElements(mesh.elements, element, rule)
    offsets = corners.per_element * np.arange(len(corners.dofs))[:, None, None]
    triangles = (offsets + reference.t.T).reshape(-1, 3)
    return Surface(corners.positions.T, triangles, corners.sampling[: corners.weights.size])


def mapped_fields(lever: Lever, states: Iterable[State], cuts: int = 3) -> Iterator[FieldMap]:
    """Yield the fields of states of a lever; every triangle is cut into ``cuts²`` smaller ones.

    Raises
    ------
    InputError
        If it is one of tetrahedra.
    """
    if lever.space.mesh.elements.dim() != 2:
        raise InputError("found a lever of tetrahedra, expected a flat one")
    reference, surface = _cut_triangle(cuts), seen_from_above(lever, cuts)
    mesh, conducting = lever.space.mesh, lever.space.conducting
    centres = reference.p[:, reference.t].mean(axis=1)
    middle = centres, np.full(centres.shape[1], 0.5 / cuts**2)
    elements = FiniteElements(mesh.elements, lever.space.elements.basis.elem, middle)
    space = FullSpace(mesh, elements, lever.space.wiring)
    at_centres = LeverEquations.of_probe(space, lever.probe)

    def per_triangle(vectors: Array) -> Array:
        return np.asarray((vectors / space.thickness_um)[:, :, 0].T)

    for state in states:
        T, V = (surface.sampling @ values for values in state.nodal)
        # where nothing conducts there is no potential
        V[np.repeat(~conducting, T.size // conducting.size)] = np.nan
        properties, fluxes = at_centres.at(state.x)[1], at_centres.fluxes(state.x)
        yield FieldMap(
            bias=state.bias_V,
            points=surface.points,
            triangles=surface.triangles,
            temperature=T,
            potential=V,
            region=np.repeat(mesh.region, elements.per_element),
            current_density=per_triangle(-fluxes.charge),
            heat_flux=per_triangle(-fluxes.heat),
            resistivity=_resistivity(space.thickness_um, properties.sigma),
        )


def _resistivity(thickness_um: float | Array, sigma: Array) -> Array:
    """Return the resistivity (Ω cm) of sheets of some conductivity (mA/V), (points, 1)."""
    sheet = np.broadcast_to(PER_CM_TO_MILLI_PER_UM * thickness_um, sigma.shape)
    nothing = np.full_like(sigma, np.inf)
    return np.divide(sheet, sigma, out=nothing, where=sigma > 0).ravel()


def _cut_triangle(cuts: int) -> MeshTri:
    """The reference triangle, cut into equal ones."""
    points = [(i, j) for j in range(cuts + 1) for i in range(cuts + 1 - j)]
    number = {point: index for index, point in enumerate(points)}
    triangles = []
    for i, j in points:
        if i + j < cuts:
            triangles.append((number[i, j], number[i + 1, j], number[i, j + 1]))
        if i + j < cuts - 1:
            triangles.append((number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]))
    return MeshTri(np.array(points, dtype=float).T / cuts, np.array(triangles).T)


def write_vtu(fields: FieldMap, path: str | os.PathLike[str]) -> None:
    """Write a field map as VTU, for ParaView and the like.

    Point data: temperature_K, potential_V. Cell data: region, current_density_mA_um2,
    heat_flux_mW_um2, resistivity_ohm_cm.
    """

    def in_space(vectors: Array) -> Array:
        return np.column_stack([vectors, np.zeros(len(vectors))])

    mesh = meshio.Mesh(
        in_space(fields.points),
        [("triangle", fields.triangles)],
        point_data={"temperature_K": fields.temperature, "potential_V": fields.potential},
        cell_data={
            "region": [fields.region.astype(np.int32)],
            "current_density_mA_um2": [in_space(fields.current_density)],
            "heat_flux_mW_um2": [in_space(fields.heat_flux)],
            "resistivity_ohm_cm": [fields.resistivity],
        },
    )
    with whole_file(path) as temporary:
        mesh.write(temporary, file_format="vtu")


@singledispatch
def write_fields(
    lever: Lever,
    states: Sequence[State],
    folder: Path,
    draw_slices: Callable[[xr.Dataset, Path], None],
) -> None:
    """Write the fields of states to a folder as VTU, with those of the air where there is some.

    Parameters
    ----------
    lever : Lever
    states : sequence of State
    folder : Path
        The files are named by the bias.
    draw_slices : callable
        Called with temperatures on slices through the air and the file to draw them to, if the
        lever knows the temperature all around it.
    """
    air = AirFields(lever) if lever.medium == "air" else None
    for state, fields in zip(states, mapped_fields(lever, states), strict=True):
        write_vtu(fields, fields_file(folder, state, ".vtu"))
        if air is not None:
            air.write_vtu(state, fields_file(folder, state, "_air.vtu"))


def fields_file(folder: Path, state: State, suffix: str) -> Path:
    """Return the file of a state's fields, named by its bias."""
    return folder / f"bias_{state.bias_V:08.4f}V{suffix}"


def write_fields_in_time(
    lever: Lever, times: Sequence[float], states: Sequence[State], folder: Path
) -> None:
    """Write the fields of states at some times (µs) to a folder as VTU, with their index."""
    names = [f"fields_{index:04d}.vtu" for index in range(len(states))]
    for name, fields in zip(names, mapped_fields(lever, states), strict=True):
        write_vtu(fields, folder / name)
    write_pvd(times, names, folder / "fields.pvd")


def write_pvd(times: Sequence[float], names: Sequence[str], path: str | os.PathLike[str]) -> None:
    """Write the index of a series of VTU files in time (µs), which ParaView opens as one."""
    collection = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    parts = ElementTree.SubElement(collection, "Collection")
    for time, name in zip(times, names, strict=True):
        ElementTree.SubElement(parts, "DataSet", timestep=f"{time:.10g}", file=name)
    ElementTree.indent(collection)
    write_text(path, ElementTree.tostring(collection, encoding="unicode") + "\n")


def heater_profile(state: State, count: int = 161) -> xr.Dataset:
    """Return temperature, doping and resistivity along the heater's axis (paper's Fig. 7).

    Parameters
    ----------
    state : State
    count : int
        Points from end to end.

    Returns
    -------
    xarray.Dataset
        On the coordinate ``position`` (µm from the heater's centre): ``temperature`` (K),
        ``doping`` (cm⁻³), ``inversion_temperature`` (K; NaN where the doping is too high for
        one below 1700 K), ``resistivity`` (Ω cm), and ``resistivity_slope`` (dρ/dT, Ω cm/K).

    Raises
    ------
    InputError
        If the heater is no strip of low-doped silicon between two parallel straight borders.
    """
    lever = state.lever
    layout, silicon = lever.space.mesh.layout, lever.probe.heater_silicon
    taper = layout.heater_taper
    beside = lever.probe.kinds[layout.heater.dopant_from]
    # only low-doped silicon beside high-doped silicon has a taper
    assert silicon is not None
    assert isinstance(beside, HighDopedSilicon)
    # stay inside: the ends are shared with high-doped silicon
    position = np.linspace(-0.5, 0.5, count) * taper.length_um * (1 - 1e-9)
    points = np.reshape(taper.centre, (2, 1)) + np.outer(taper.axis, position)
    T = lever.space.elements.interpolation(points.T)[0] @ state.nodal[0]
    away, n_d, delta = taper.distances(points), silicon.n_d, silicon.delta
    n, _ = tapered_doping(away, n_d, delta, n_hd=beside.n_hd, front=silicon.front)
    sigma, sigma_by = silicon.electrical_conductivity(T, n)
    columns = {
        "temperature": T,
        "doping": n,
        "inversion_temperature": silicon.inversion_temperature(n),
        "resistivity": 1.0 / sigma,
        "resistivity_slope": -sigma_by["T"] / sigma**2,
    }
    seen = {name: getattr(state, name) for name in ("lever_V", "current_mA", "tip_K")}
    return labelled(columns, "position", {"position": position}, **seen, lever=lever.probe.title)


# --- the path of the current ---------------------------------------------------------------------


def current_path(space: FullSpace, potential: Array) -> tuple[Array, Array]:
    """Return the path of the current that leads through the tip, or next to it.

    It follows −∇V in the plane of the lever, along which the current flows where the conductivity
    is isotropic (σ positive, thermoelectric currents apart), both ways from the tip by the midpoint
    rule.

    Parameters
    ----------
    space : FullSpace
        Of a lever in the plane.
    potential : ndarray, shape (nodes,)
        V, of a state in which a current flows; see `FullSpace.nodal`.

    Returns
    -------
    points : ndarray, shape (n, 2)
        µm, from the higher potential to the lower one, all inside the lever.
    along : ndarray, shape (n,)
        Length of the path up to each (µm).
    """
    elements, layout = space.elements, space.mesh.layout
    # steps along the path are this share of the longer side of the lever
    longest = 1 / 150 * float(np.ptp(layout.box, axis=0).max())

    def direction(at: Array) -> Array:
        (element,), _, slopes = elements.at_points(at[None])
        if not space.conducting[element]:
            raise InputError("no current flows there")
        flow = -slopes[:, 0] @ potential[elements.dofs[element]]
        return np.asarray(flow / np.linalg.norm(flow))

    def streamline(at: Array, sign: float) -> Iterator[Array]:
        size, steps, along = sign * longest, 0, direction(at)
        # to end at the edge steps are halved six times
        while abs(size) > longest / 2**6 and steps < 2000:
            try:
                after = at + size * direction(at + 0.5 * size * along)
                along_there = direction(after)
            except InputError:  # beyond the edge
                size /= 2
                continue
            at, along, steps = after, along_there, steps + 1
            yield at

    start = np.array(layout.tip)
    try:
        direction(start)
    except InputError:
        positions = elements.positions.T[np.repeat(space.conducting, elements.per_element)]
        start = positions[np.argmin(np.linalg.norm(positions - start, axis=1))]
    points = np.array([*[*streamline(start, -1.0)][::-1], start, *streamline(start, 1.0)])
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return points, np.concatenate([[0.0], np.cumsum(lengths)])


# --- the air --------------------------------------------------------------------------------------


class AirFields:
    """What states of a lever in air do to the air.

    Parameters
    ----------
    lever : Lever

    Raises
    ------
    InputError
        If the lever is in vacuum.
    """

    def __init__(self, lever: Lever) -> None:
        if lever.medium == "vacuum":
            raise InputError("the lever is in vacuum, expected one in air")
        self._lever, self._air = lever, lever.space.air
        self._base = lever.circuit.base_temperature_K
        self._unit = PER_CM_TO_MILLI_PER_UM * self._air.gas_conductivity

    @cached_property
    def _panelled(self) -> PanelledAir:
        """The panels: made again, since the operator on disk is without them."""
        plate, around = plate_of(self._lever.probe), self._lever.probe.surroundings
        return PanelledAir(plate, around, self._base, self._lever.panels)

    @property
    def panels(self) -> Panels:
        """The lever's panels, and last its tip's; without either a tip in the air or surroundings
        that are not symmetric, those above its mid-plane only.
        """
        return self._panelled.surface.panels

    def flux(self, state: State) -> Array:
        """Return the heat flux (mW/µm²) into the air from each of `panels`."""
        return self._densities(state)[: len(self.panels)]

    def temperature(self, state: State, points: Array) -> Array:
        """Return the temperature (K) of the air.

        Parameters
        ----------
        state : State
        points : ndarray, shape (n, 3)
            µm; the lever's mid-plane is z = 0. Inside the lever the result is its surface's.
        """
        theta = self._panelled.theta(points, self._densities(state))
        return temperature_from_kirchhoff(theta / self._unit, self._base)

    def heat_by_region(self, state: State) -> dict[str, float]:
        """Return the heat (mW) that each region of the layout loses to the air."""
        heat = self._air.operator.matrix @ self._theta(state)
        sites, regions = self._air.operator.sites, self._lever.space.mesh.layout.regions
        points = shapely.points(sites)
        away = [shapely.distance(points, Polygon(part.outline, part.holes)) for part in regions]
        region = np.argmin(away, axis=0)
        return {part.name: float(heat[region == k].sum()) for k, part in enumerate(regions)}

    def shares(self, states: Sequence[State]) -> xr.Dataset:
        """Return the heat that each region loses to the air in some states.

        Returns
        -------
        xarray.Dataset
            ``air_heat_mW`` on (region, bias), with ``bias_V``, ``tip_K`` and ``power_mW``.
        """
        by_region = [self.heat_by_region(state) for state in states]
        sweep = self._lever.dataset(states)
        table = np.array([list(heat.values()) for heat in by_region]).T
        return labelled(
            {
                "tip_K": sweep.tip_K.values,
                "power_mW": sweep.power_mW.values,
                "air_heat_mW": (("region", "bias"), table),
            },
            coordinates={"bias": sweep.bias.values, "region": list(by_region[0])},
            lever=sweep.attrs["lever"],
        )

    def write_vtu(self, state: State, path: str | os.PathLike[str]) -> None:
        """Write the panels with heat_flux_into_air_mW_um2 as VTU, whole or not at all."""
        corners = self.panels.corners
        mesh = meshio.Mesh(
            corners.reshape(-1, 3),
            [("quad", np.arange(4 * len(corners)).reshape(-1, 4))],
            cell_data={"heat_flux_into_air_mW_um2": [self.flux(state)]},
        )
        with whole_file(path) as temporary:
            mesh.write(temporary, file_format="vtu")

    def _theta(self, state: State) -> Array:
        return self._lever.equations.kirchhoff(state.x)[0][:, 0]

    def _densities(self, state: State) -> Array:
        return self._panelled.densities(self._theta(state))
