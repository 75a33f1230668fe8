"""A probe made ready for its equations: its mesh, refined where needed, and the air around it.

A lever without power is solved twice on the same triangles, with cubic elements as always and with
quadratic ones. How far the two are apart, in the energy of their currents and of their heat flows,
bounds the error of the resistance and of the temperature per power with quadratic elements. With
cubic ones it is some ten times smaller (``benchmarks/convergence.py estimate``). Where it is too
large, as for a border of the doping that is sharper than the triangles of a wide heater, the
triangles that make most of it are split.

What the air takes up in time is made once it is asked for, and cached.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property, lru_cache, partial

import numpy as np
from scipy.sparse import diags
from scipy.sparse.linalg import eigsh

from hotlever.air.operator import PanelledAir, air_operator
from hotlever.air.stores import AirStores, HeatInAir, stores_of
from hotlever.cache import cache_file, store_arrays, stored
from hotlever.lever.elements import FiniteElements
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.materials import Kind
from hotlever.materials.air import heat_capacity_of_air, thermal_conductivity_of_air
from hotlever.probe import Circuit, Layout, MeshOptions, Probe, Wiring, mesh_layout
from hotlever.probe.surroundings import Surroundings
from hotlever.types import Array, Index, Progress
from hotlever.units import PER_CM3_TO_NANO_PER_UM3, PER_CM_TO_MILLI_PER_UM
from hotlever.work import one_blas_thread


@lru_cache(maxsize=4)
def flat_space(layout: Layout, mesh: MeshOptions, wiring: Wiring) -> FullSpace:
    """Return mesh and operators of a layout in vacuum; levers of one shape share them."""
    return FullSpace(mesh_layout(layout, mesh, wiring), wiring=wiring)


def chosen_space(probe: Probe) -> FullSpace:
    """Return mesh and operators of a probe in vacuum, fine enough for its shape and materials."""
    # what is behind the swept supply does not matter
    circuit = probe.circuit.model_copy(update={"series_resistance_ohm": 0.0})
    return _chosen(probe.layout(), probe.wiring, circuit, tuple(probe.made_of.items()))


@lru_cache(maxsize=4)
def _chosen(
    layout: Layout,
    wiring: Wiring,
    circuit: Circuit,
    kinds: tuple[tuple[str, Kind], ...],
) -> FullSpace:
    space = flat_space(layout, MeshOptions(), wiring)
    for _ in range(10):
        by_element = energy_between_degrees(space, dict(kinds), circuit)
        # with so little energy between quadratic and cubic elements currents are within 2e-4 of a
        # converged mesh, and T_tip within 0.2 K; the usual mesh of the reference probe has 2.3e-4
        if by_element.sum() <= 5e-4:
            break
        # the triangles that make most of that energy are split at once
        space = FullSpace(space.mesh.refined(making(by_element, 0.8)), wiring=wiring)
    return space


def making(by_element: Array, share: float) -> Index:
    """Return the fewest triangles, by number, that make a share of the whole energy."""
    order = np.argsort(-by_element)
    reached = np.cumsum(by_element[order])
    return np.sort(order[: 1 + np.searchsorted(reached, share * reached[-1])])


def energy_between_degrees(space: FullSpace, kinds: Mapping[str, Kind], circuit: Circuit) -> Array:
    """Return the energy between quadratic and cubic elements, without power, of each triangle.

    It is the sum of ∫ σ (∇δV)² and ∫ κ (∇δT)², with δ what the two differ by, each over the
    same of the whole lever; the first is the difference of the resistances (Galerkin
    orthogonality).

    Parameters
    ----------
    space : FullSpace
        Of cubic triangles, in vacuum.
    kinds : mapping of str to Kind
        The materials by name.
    circuit : Circuit

    Returns
    -------
    ndarray, shape (elements,)
    """
    from skfem import ElementTriP2  # see `hotlever.probe.mesh`

    quadratic = FullSpace(
        space.mesh, FiniteElements(space.mesh.elements, ElementTriP2()), space.wiring
    )
    slopes = []
    for of_degree in (quadratic, space):
        # held supplies and warm leg ends are switched off
        equations = LeverEquations(of_degree, kinds, circuit).driven(0.0)
        potential, rise = (of_degree.fields(x) for x in equations.cold())
        slopes.append((potential.grad_V, rise.grad_T))
    properties = equations.at(np.zeros((space.size + 1, 1)))[1]
    energy = np.zeros(len(space.elements.dofs))
    for coefficient, low, high in zip((properties.sigma, properties.kappa), *slopes, strict=True):
        weight = space.weights * coefficient
        whole = (weight * (high**2).sum(axis=0)).sum()
        apart = weight * ((high - low) ** 2).sum(axis=0)
        energy += apart.reshape(len(energy), -1).sum(axis=1) / whole
    return energy


# --- the air --------------------------------------------------------------------------------------


def plate_of(probe: Probe) -> Layout:
    """Return a lever as the air sees it: as thick everywhere as where most lies on one another."""
    layout = probe.layout()
    return replace(layout, thickness_um=layout.thickest_um)


def surrounded(
    space: FullSpace, probe: Probe, panels: float, progress: Progress | None = None
) -> FullSpace:
    """Return a space in the surroundings of its probe; all but the air is shared."""
    around, base = probe.surroundings, probe.circuit.base_temperature_K
    if around.medium == "vacuum":
        return space.in_vacuum()
    plate = plate_of(probe)

    stores = StoresAround(partial(taken_up_around, space, plate, around, base))
    air = air_operator(plate, around, base, panels, progress)
    in_air = space.in_air(air, stores)
    return in_air.with_air(in_air.air.in_gas(around.gas_conductivity))


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
    # twice as many modes, or panels, change a history by less than what its steps are off by
    count, fineness = 48, 0.5
    facts = {
        "nodes": space.elements.nodes,
        "thickness_um": layout.thickness_um,
        "cone": layout.cone_in_air and layout.cone_in_air.model_dump(),
        "surroundings": surroundings.model_dump(exclude={"medium", "gas_conductivity"}),
        "base_K": base_temperature_K,
        "panels": fineness,
    }
    path = cache_file("stores", facts)
    names = tuple(AirStores.__dataclass_fields__)
    cache_entry = stored(
        path, lambda a: (a["modes"], AirStores(**{name: a[name] for name in names}))
    )
    if cache_entry is None:
        modes = conduction_modes(space, count)
        panelled = PanelledAir(layout, surroundings, base_temperature_K, fineness)
        sites = panelled.surface.sites
        # the modes are orthonormal over the lever's area
        inside = layout.thickness_um * np.eye(count)
        length = float(np.ptp(layout.corners, axis=0).max())
        cache_entry = modes, stores_of(panelled, space.rise_at(sites, modes), inside, length)
        store_arrays(path, {"modes": modes, **vars(cache_entry[1])})
    modes, stores = cache_entry
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
    if space.chip is not None:
        hot = np.setdiff1d(hot, space.chip[0])
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
