"""Fields of a solved state as they are drawn and saved: on a fine triangulation, on a line."""

from __future__ import annotations

import os
from dataclasses import dataclass

import meshio
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from skfem import MeshTri

from hotlever.files import whole_file
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import Lever
from hotlever.lever.operators import FiniteElements
from hotlever.lever.space import LeverSpace
from hotlever.materials.doping import tapered_doping
from hotlever.materials.silicon import conductivity_low_doped, inversion_temperature

Array = NDArray[np.float64]


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
        K and V.
    region : ndarray of int, shape (m,)
        Index into the layout's regions.
    current_density : ndarray, shape (m, 2)
        mA/µm².
    heat_flux : ndarray, shape (m, 2)
        mW/µm².
    resistivity : ndarray, shape (m,)
        Ω cm.
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


class FieldMapper:
    """Draws states of one lever: every triangle of the mesh is cut into ``cuts²`` smaller ones."""

    def __init__(self, lever: Lever, cuts: int = 3) -> None:
        self._lever = lever
        reference = _cut_triangle(cuts)
        self._cell = reference.t.T
        mesh = lever.space.mesh
        element = lever.space.operators.basis.elem
        corners = FiniteElements(
            mesh.elements, element, (reference.p, np.full(reference.p.shape[1], 1.0))
        )
        centres = reference.p[:, reference.t].mean(axis=1)
        self._corners = corners
        space = LeverSpace(
            mesh,
            FiniteElements(
                mesh.elements, element, (centres, np.full(centres.shape[1], 0.5 / cuts**2))
            ),
        )
        self._centres = LeverEquations(space, lever.probe.circuit, lever.probe.material)

    def map(self, x: Array) -> FieldMap:
        """Return the fields of a state.

        Parameters
        ----------
        x : ndarray
            Unknowns of a solved state of the lever.
        """
        lever, corners = self._lever, self._corners
        T, V = lever.space.nodal(x, lever.probe.circuit.base_temperature_K)
        elements, per_element = corners.weights.shape
        offsets = per_element * np.arange(elements)[:, None, None]
        fields, laws = self._centres.at(x)
        thickness = self._centres.space.thickness_um

        def per_triangle(vector: Array) -> Array:
            return np.moveaxis(vector / thickness, 0, -1).reshape(-1, 2)

        return FieldMap(
            bias=float(x[-1]),
            points=np.moveaxis(corners.positions, 0, -1).reshape(-1, 2),
            triangles=(offsets + self._cell).reshape(-1, 3),
            temperature=corners.evaluate(T)[0].ravel(),
            potential=corners.evaluate(V)[0].ravel(),
            region=np.repeat(lever.space.mesh.region, len(self._cell)),
            current_density=per_triangle(-laws.sigma * fields.grad_V),
            heat_flux=per_triangle(-laws.kappa * fields.grad_T),
            resistivity=1.0 / self._centres.per_cm(laws.sigma).ravel(),
        )


def _cut_triangle(cuts: int) -> MeshTri:
    """The reference triangle, cut into equal ones."""
    number: dict[tuple[int, int], int] = {}
    for j in range(cuts + 1):
        for i in range(cuts + 1 - j):
            number[i, j] = len(number)
    triangles = []
    for i, j in number:
        if i + j < cuts:
            triangles.append((number[i, j], number[i + 1, j], number[i, j + 1]))
        if i + j < cuts - 1:
            triangles.append((number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]))
    points = np.array(list(number), dtype=float).T / cuts
    return MeshTri(points, np.array(triangles).T)


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


def heater_profile(lever: Lever, x: Array, count: int = 161) -> xr.Dataset:
    """Return temperature, doping and resistivity along the heater's axis (paper's Fig. 7).

    Parameters
    ----------
    lever : Lever
    x : ndarray
        Unknowns of a solved state.
    count : int
        Points from end to end.

    Returns
    -------
    xarray.Dataset
        On the coordinate ``position`` (µm from the heater's centre): ``temperature`` (K),
        ``doping`` (cm⁻³), ``inversion_temperature`` (K; NaN where the doping is too high for
        one below 1700 K), ``resistivity`` (Ω cm), and ``resistivity_slope`` (dρ/dT, Ω cm/K).
    """
    taper, material = lever.space.mesh.layout.heater_taper, lever.probe.material
    # stay inside: the ends are shared with high-doped silicon
    position = np.linspace(-0.5, 0.5, count) * taper.length_um * (1 - 1e-9)
    points = np.reshape(taper.centre, (2, 1)) + np.outer(taper.axis, position)
    T_nodal, _ = lever.space.nodal(x, lever.probe.circuit.base_temperature_K)
    T = lever.space.operators.basis.probes(points) @ T_nodal
    n, _ = tapered_doping(
        position, material.n_d, material.delta, length=taper.length_um, n_hd=material.n_hd
    )
    sigma, sigma_by = conductivity_low_doped(T, n, material.p)
    columns = {
        "temperature": (T, "K", "temperature"),
        "doping": (n, "cm-3", "doping concentration"),
        "inversion_temperature": (
            inversion_temperature(n, material.p),
            "K",
            "inversion temperature",
        ),
        "resistivity": (1.0 / sigma, "ohm cm", "resistivity"),
        "resistivity_slope": (-sigma_by["T"] / sigma**2, "ohm cm/K", "slope of the resistivity"),
    }
    profile = xr.Dataset(
        {
            name: ("position", values, {"units": unit, "long_name": text})
            for name, (values, unit, text) in columns.items()
        },
        coords={"position": position},
    )
    profile.position.attrs = {"units": "µm", "long_name": "position along the heater"}
    state = lever.equations.observe(x)
    profile.attrs = {name: state[name] for name in ("lever_V", "current_mA", "tip_K")}
    return profile
