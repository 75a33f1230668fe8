"""A lever in the surroundings of its probe: what the air takes, and what it takes up in time.

The latter is made once it is asked for, and cached.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from functools import cached_property, partial

import numpy as np
from scipy.sparse import diags
from scipy.sparse.linalg import eigsh

from hotlever.air.operator import PanelledAir, air_operator
from hotlever.air.panels import PanelOptions
from hotlever.air.stores import AirStores, HeatInAir, stores_of
from hotlever.cache import cache_file, store_arrays, stored
from hotlever.lever.full_space import FullSpace
from hotlever.materials.air import heat_capacity_of_air, thermal_conductivity_of_air
from hotlever.probe import Layout, Probe
from hotlever.probe.surroundings import Surroundings
from hotlever.threads import one_blas_thread
from hotlever.types import Array, Progress
from hotlever.units import PER_CM3_TO_NANO_PER_UM3, PER_CM_TO_MILLI_PER_UM

#: Modes of the lever, and how fine the panels are: twice as many change a history by less than
#: what its steps are off by.
_MODES, _PANELS = 48, PanelOptions(refinement=0.5)


def plate_of(probe: Probe) -> Layout:
    """Return a lever as the air sees it: as thick everywhere as where most lies on one another."""
    layout = probe.layout()
    return replace(layout, thickness_um=layout.thickest_um)


def surrounded(
    space: FullSpace, probe: Probe, panels: PanelOptions, progress: Progress | None = None
) -> FullSpace:
    """Return a space in the surroundings of its probe; all but the air is shared."""
    around, base = probe.surroundings, probe.circuit.base_temperature_K
    if around.medium == "vacuum":
        return space.in_vacuum()
    plate = plate_of(probe)

    stores = StoresAround(partial(taken_up_around, space, plate, around, base))
    air = air_operator(plate, around, base, panels, progress)
    return space.in_air(air, stores).in_gas(around.gas_conductivity)


class StoresAround:
    """Makes what the air around a lever takes up in time, once it is asked for.

    Parameters
    ----------
    make : callable
        Makes the heat in air; what it is can be pickled, as a lever can.
    """

    def __init__(self, make: Callable[[], HeatInAir]) -> None:
        self._make = make
        self._last: tuple[float, HeatInAir] | None = None

    def __call__(self, gas_conductivity: float) -> HeatInAir:
        """Return the heat in a gas that conducts so many times as well as air."""
        # an answer in time asks again and again for that of one gas
        if self._last is None or self._last[0] != gas_conductivity:
            self._last = gas_conductivity, self._in_air.in_gas(gas_conductivity)
        return self._last[1]

    @cached_property
    def _in_air(self) -> HeatInAir:
        return self._make()


@one_blas_thread
def taken_up_around(
    space: FullSpace, layout: Layout, surroundings: Surroundings, base_temperature_K: float
) -> HeatInAir:
    """Return the heat that the air around a lever takes up, from the cache or made and cached.

    Parameters
    ----------
    space : FullSpace
        In air.
    layout : Layout
        As the air sees it.
    surroundings : Surroundings
    base_temperature_K : float

    Raises
    ------
    ComputationError
        If the dimensions of the lever differ too much.
    """
    facts = {
        "nodes": space.elements.nodes,
        "thickness_um": layout.thickness_um,
        "cone": layout.cone_in_air and layout.cone_in_air.model_dump(),
        "surroundings": surroundings.model_dump(exclude={"medium", "gas_conductivity"}),
        "base_K": base_temperature_K,
        "panels": asdict(_PANELS),
    }
    path = cache_file("stores", facts)
    names = tuple(AirStores.__dataclass_fields__)
    kept = stored(path, lambda a: (a["modes"], AirStores(**{name: a[name] for name in names})))
    if kept is None:
        modes = conduction_modes(space, _MODES)
        panelled = PanelledAir(layout, surroundings, base_temperature_K, _PANELS)
        sites = panelled.surface.sites
        # the modes are orthonormal over the lever's area
        inside = layout.thickness_um * np.eye(_MODES)
        length = float(np.ptp(layout.corners, axis=0).max())
        kept = modes, stores_of(panelled, space.rise_at(sites, modes), inside, length)
        store_arrays(path, {"modes": modes, **vars(kept[1])})
    modes, stores = kept
    ends = space.end_test[0]
    at_points = space.weights * space.temperature.at_points(modes)[0]
    mass = space.temperature.tested(
        np.concatenate([at_points[None], np.zeros((2, *at_points.shape))])
    )
    kappa, _ = thermal_conductivity_of_air(base_temperature_K)
    capacity, _ = heat_capacity_of_air(base_temperature_K, surroundings.pressure_mbar)
    return HeatInAir(
        stores,
        mass.T,
        at_points.sum(axis=0),
        ends @ at_points,
        PER_CM_TO_MILLI_PER_UM * float(kappa),
        PER_CM3_TO_NANO_PER_UM3 * float(capacity),
    )


def conduction_modes(space: FullSpace, count: int) -> Array:
    """Return the slowest modes of heat conduction in the plane of a lever, (size + 1, count).

    They vanish at the leg ends and are orthonormal over the area.
    """
    hot = np.flatnonzero(space.is_temperature)
    kinds, points = space.temperature.kinds, space.weights.size
    maps = space.temperature.matrix[:, hot].tocsr()
    weights = diags(space.weights[:, 0])
    value, *slopes = (maps[kind * points : (kind + 1) * points] for kind in range(kinds))
    mass = (value.T @ weights @ value).tocsc()
    stiffness = sum(slope.T @ weights @ slope for slope in slopes).tocsc()
    _, shapes = eigsh(stiffness, count, mass, sigma=0.0, v0=np.ones(hot.size))
    modes = np.zeros((space.size + 1, count))
    modes[hot] = shapes
    return modes
