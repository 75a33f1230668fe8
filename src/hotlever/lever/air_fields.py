"""A solved lever's heat into the air: where it leaves, by region, and how hot the air gets."""

from __future__ import annotations

import os
from functools import cached_property

import meshio
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from hotlever.air.operator import PanelledAir
from hotlever.air.panels import Panels
from hotlever.errors import InputError
from hotlever.files import whole_file
from hotlever.lever.equations import PER_CM_TO_MILLI_PER_UM
from hotlever.lever.lever import Lever, Ramp
from hotlever.materials.air import kirchhoff_variable, temperature_from_kirchhoff

Array = NDArray[np.float64]


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
        if lever.space.air is None:
            raise InputError("the lever is in vacuum, expected one in air")
        self._lever, self._air = lever, lever.space.air
        self._base = lever.probe.circuit.base_temperature_K

    @cached_property
    def _panelled(self) -> PanelledAir:
        """The panels: made again, since the operator on disk is without them."""
        probe = self._lever.probe
        return PanelledAir(probe.layout(), probe.surroundings, self._base)

    @property
    def panels(self) -> Panels:
        """The lever's panels; above its mid-plane only where the surroundings are symmetric."""
        return self._panelled.surface.panels

    def flux(self, x: Array) -> Array:
        """Return the heat flux (mW/µm²) into the air from each of `panels`."""
        return self._densities(x)[: len(self.panels)]

    def temperature(self, x: Array, points: Array) -> Array:
        """Return the temperature (K) of the air.

        Parameters
        ----------
        x : ndarray
            Unknowns of a solved state.
        points : ndarray, shape (n, 3)
            µm; the lever's mid-plane is z = 0. Inside the lever the result is its surface's.
        """
        theta = self._panelled.theta(points, self._densities(x))
        return temperature_from_kirchhoff(theta / PER_CM_TO_MILLI_PER_UM, self._base)

    def heat_by_region(self, x: Array) -> dict[str, float]:
        """Return the heat (mW) that each region of the layout loses to the air."""
        heat = self._air.matrix @ self._theta(x)
        sites, regions = self._air.sites, self._lever.space.mesh.layout.regions
        boxes = np.array([(np.min(r.outline, axis=0), np.max(r.outline, axis=0)) for r in regions])
        outside = np.maximum(boxes[:, 0] - sites[:, None], sites[:, None] - boxes[:, 1])
        region = outside.max(axis=2).argmin(axis=1)
        return {one.name: float(heat[region == k].sum()) for k, one in enumerate(regions)}

    def shares(self, ramp: Ramp) -> xr.Dataset:
        """Return the heat that each region loses to the air along a ramp of the bias.

        Returns
        -------
        xarray.Dataset
            ``air_heat_mW`` on (region, bias), with ``bias_V``, ``tip_K`` and ``power_mW``.
        """
        found = [self.heat_by_region(state.x) for state in ramp.states]
        sweep = self._lever.dataset(ramp)
        data = sweep[["tip_K", "power_mW"]]
        table = np.array([list(one.values()) for one in found]).T
        data["air_heat_mW"] = (("region", "bias"), table, sweep.air_heat_mW.attrs)
        return data.assign_coords(region=list(found[0]))

    def write_vtu(self, x: Array, path: str | os.PathLike[str]) -> None:
        """Write the panels with heat_flux_into_air_mW_um2 as VTU, whole or not at all."""
        corners = self.panels.corners
        mesh = meshio.Mesh(
            corners.reshape(-1, 3),
            [("quad", np.arange(4 * len(corners)).reshape(-1, 4))],
            cell_data={"heat_flux_into_air_mW_um2": [self.flux(x)]},
        )
        with whole_file(path) as temporary:
            mesh.write(temporary, file_format="vtu")

    def _theta(self, x: Array) -> Array:
        theta, _ = kirchhoff_variable(self._air.temperature(x, self._base), self._base)
        return PER_CM_TO_MILLI_PER_UM * theta

    def _densities(self, x: Array) -> Array:
        return self._panelled.densities(self._theta(x))
