"""A solved lever's heat into the air: where it leaves, by region, and how hot the air gets."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import meshio
import numpy as np
import shapely
from shapely import Polygon

from hotlever.air.operator import PanelledAir
from hotlever.air.panels import Panels
from hotlever.datasets import labelled
from hotlever.errors import InputError
from hotlever.files import whole_file
from hotlever.lever.discretisation import plate_of
from hotlever.lever.lever import Lever, State
from hotlever.materials.air import temperature_from_kirchhoff
from hotlever.types import Array
from hotlever.units import PER_CM_TO_MILLI_PER_UM

if TYPE_CHECKING:
    import xarray as xr


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
