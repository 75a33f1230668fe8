"""The air around a lever as one linear operator, made once for a geometry.

Still air obeys Laplace's equation in the Kirchhoff variable θ = ∫κ_air dT. So all of it, open
space included, is a symmetric positive matrix from θ on the lever's surface to the heat that
leaves there. The single layer of `hotlever.air.single_layer` also fills the plate with air;
what that air would conduct along the plate is taken off the silicon in
`hotlever.lever.equations`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.linalg.lapack import dpotri
from scipy.sparse import csr_matrix

from hotlever.air.bodies import BaseLine, chip_panels
from hotlever.air.laplace import Approach, Laplace, layer_potential
from hotlever.air.panels import Mirror, Panels, mirror_group
from hotlever.air.single_layer import Numbers, Screened, single_layer_matrix
from hotlever.cache import cache_file, store_arrays, stored
from hotlever.errors import ComputationError, InputError
from hotlever.probe.layout import Layout
from hotlever.probe.surroundings import Surroundings
from hotlever.spieser2017 import BASE_TEMPERATURE_K
from hotlever.types import Array, Progress

if TYPE_CHECKING:
    from hotlever.air.surface import LeverSurface


@dataclass(frozen=True)
class AirOperator:
    """Heat lost to air at some places of a lever.

    Attributes
    ----------
    sites : ndarray, shape (n, 2)
        Places in the plane of the lever (µm).
    matrix : ndarray, shape (n, n)
        Symmetric and positive semi-definite (µm): from θ (mW/µm) at the sites to the heat (mW)
        lost by the panels there.
    filling : float
        Share of κ_air by which the air that the single layer puts inside the plate conducts: one,
        and less where the temperature jumps at the surface.
    gap_um : float
        To a surface below; NaN without one.
    matrix_by_gap : ndarray, shape (n, n)
        Derivative of the matrix by the gap; empty without one.
    filling_by_gap : float
    """

    sites: Array
    matrix: Array
    filling: float = 1.0
    gap_um: float = math.nan
    matrix_by_gap: Array = field(default_factory=lambda: np.empty((0, 0)))
    filling_by_gap: float = 0.0

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any]) -> AirOperator:
        """Return what was stored under the names of the attributes."""
        return cls(**{each.name: arrays[each.name][()] for each in fields(cls)})

    def less(self, diagonal: Array) -> NDArray[np.float32]:
        """Return the matrix less a diagonal one, to seven digits: it is read many times."""
        less = self.matrix.astype(np.float32)
        less[np.diag_indices_from(less)] -= diagonal
        return less

    def at_gap(self, gap_um: float) -> AirOperator:
        """Return that with the surface at another distance nearby.

        It is linear in the inverse gap, as the loss to a near surface is.
        """
        change = self.gap_um - self.gap_um**2 / gap_um
        slope = (self.gap_um / gap_um) ** 2
        return replace(
            self,
            matrix=self.matrix + change * self.matrix_by_gap,
            filling=self.filling + change * self.filling_by_gap,
            gap_um=gap_um,
            matrix_by_gap=slope * self.matrix_by_gap,
            filling_by_gap=slope * self.filling_by_gap,
        )


def air_operator(
    layout: Layout,
    surroundings: Surroundings | None = None,
    base_temperature_K: float = BASE_TEMPERATURE_K,
    refinement: float = 1.0,
    progress: Progress | None = None,
) -> AirOperator:
    """Return the operator of a lever in its surroundings, from the cache or made and cached.

    Parameters
    ----------
    layout : Layout
    surroundings : Surroundings, optional
        Free space by default.
    base_temperature_K : float
        Of the surroundings; matters only where the temperature jumps at surfaces.
    refinement : float
        Divides the sizes of the panels.
    progress : callable, optional
        Called while an operator is made, with steps done and their number.

    Raises
    ------
    InputError
        If the surface below crosses the lever; or, with a chip or a tilted surface, the leg ends
        are not on one line (see `hotlever.air.bodies.BaseLine`).
    ComputationError
        If the dimensions of the lever differ too much.
    """
    surroundings = surroundings or Surroundings()
    facts = {
        "layout": asdict(replace(layout, cone=None)),
        "cone": layout.cone_in_air and layout.cone_in_air.model_dump(),
        "surroundings": surroundings.model_dump(exclude={"medium", "gas_conductivity"}),
        "jump_um": surroundings.jump_length_um(base_temperature_K),
        "refinement": refinement,
    }
    path = cache_file("air", facts)
    cached_operator = stored(path, AirOperator.from_arrays)
    if cached_operator is not None:
        return cached_operator
    operator = PanelledAir(
        layout, surroundings, base_temperature_K, refinement, progress
    ).operator()
    store_arrays(
        path, {each.name: np.asarray(getattr(operator, each.name)) for each in fields(operator)}
    )
    return operator


class PanelledAir:
    """Panels on a lever and its surroundings, with their single layer.

    Parameters and errors are those of `air_operator`.

    Attributes
    ----------
    surface : LeverSurface
        The lever's own panels: the first of `panels`.
    panels : Panels
        These, and the chip's.
    mirrors : list of Mirror
        That make the rest of the sources.
    """

    def __init__(
        self,
        layout: Layout,
        surroundings: Surroundings,
        base_temperature_K: float,
        refinement: float = 1.0,
        progress: Progress | None = None,
    ) -> None:
        symmetric = surroundings.symmetric and layout.cone_in_air is None
        bodies = _bodies(layout, refinement, symmetric, surroundings.chip)
        self.surface, self.panels = bodies.surface, bodies.panels
        # the matrix of so many panels, the most without finer ones than the default, has half a
        # gigabyte
        most = int(8000 * refinement**2)
        if len(self.panels) > most:
            raise ComputationError(
                f"air: this lever takes {len(self.panels)} panels, more than {most}; are its "
                "thickness and heater too small for its other dimensions?"
            )
        self._gap = math.nan if (gap := surroundings.surface_gap_um) is None else gap
        below = _mirrors_below(layout, surroundings, base_temperature_K, self.panels)
        mid_plane = [Mirror.in_plane((0, 0, 0), (0, 0, 1), +1.0)] if symmetric else []
        self._halves = 1.0 + len(mid_plane)
        self.mirrors = mirror_group([*mid_plane, *below])
        own = np.arange(len(self.surface.panels))
        jump = np.full(len(self.panels), surroundings.jump_length_um(base_temperature_K))
        jump[own] = surroundings.jump_length_um(surroundings.jump_temperature_K)
        self._over_thickness = float(jump[0]) / layout.thickness_um
        if below:
            # the images move twice as far as the surface, along its normal
            motion = (np.eye(3) - below[0].matrix) @ np.array([0.0, 0.0, -1.0])
            layer, self._layer_by_gap = single_layer_matrix(
                self.panels, Approach(motion), below, progress
            )
            # at other distances the lever itself is the same
            layer += bodies.layer
        else:
            layer = single_layer_matrix(self.panels, Laplace(), self.mirrors, progress)
        areas, on_tip = self.panels.areas, own[len(own) - len(self.surface.through_tip) :]
        self._resistances = jump * areas
        layer[np.diag_indices_from(layer)] += self._resistances
        at_tip = np.outer(areas[on_tip], areas[on_tip])
        layer[np.ix_(on_tip, on_tip)] += self.surface.through_tip * at_tip
        self._layer = layer
        self._basis = _by_sites(self.surface, areas)
        self._to_unknowns = self._basis.T.tocsr()
        self._site_areas = np.bincount(self.surface.site, areas[own])

    def _by_unknowns(self, layer: Numbers) -> Numbers:
        """Return a symmetric layer between the unknowns of the basis, not the panels."""
        to_unknowns, between = self._to_unknowns, np.empty_like(layer)
        rows_at_once = 128  # whole matrices in between would take longer to allocate than to fill
        for start in range(0, len(layer), rows_at_once):
            rows = slice(start, start + rows_at_once)
            of_rows = np.ascontiguousarray((to_unknowns[rows] @ layer).T)
            between[rows] = (to_unknowns @ of_rows).T
        return between

    def _condensed(self, layer: Numbers) -> tuple[Numbers, Numbers]:
        """Return the layer between the densities of sites, and the other unknowns by these.

        Of a jump only what flows outside the plate is let through. Where the jumps at both faces
        differ, the air that fills the plate would conduct from one to the other, by its thickness:
        so much is left out where one face is compared with the other. That is positive definite
        still, since a layer between the faces holds at most half the thickness.
        """
        own = self._by_unknowns(layer)
        sites, rest = len(self._site_areas), len(own) - len(self.surface.across)
        upper = self.surface.across[:, 0]
        outside = 1.0 - 2.0 * self._over_thickness
        between_faces = outside * own[rest:, rest:]
        resistances = 2.0 * (self._resistances / self.panels.areas**2)[upper]
        between_faces[np.diag_indices_from(between_faces)] += (1.0 - outside) * resistances
        of_faces = -outside * _solved(between_faces, own[rest:, :rest])
        own = own[:rest, :rest] + own[:rest, rest:] @ of_faces
        others = -_solved(own[sites:, sites:], own[sites:, :sites])
        between_sites = own[:sites, :sites] + own[:sites, sites:] @ others
        return between_sites, np.vstack(
            [others, of_faces[:, :sites] + of_faces[:, sites:] @ others]
        )

    @cached_property
    def _by_theta(self) -> tuple[Array, Array]:
        """Densities of sites by θ there, (sites, sites), and the other unknowns by densities."""
        between_sites, others = self._condensed(self._layer)
        return _inverse(between_sites) * self._site_areas, others

    def densities(self, theta: Array) -> Array:
        """Return the densities (mW/µm²) of the single layer, for θ (mW/µm) at the sites.

        Those of both faces together are the heat flux into air.
        """
        by_theta, others = self._by_theta
        of_sites = by_theta @ theta
        return np.asarray(self._basis @ np.concatenate([of_sites, others @ of_sites]))

    def operator(self) -> AirOperator:
        """Return the matrix from θ at the sites to heat, and how full of air the lever seems."""
        by_theta, others = self._by_theta
        heat = self._halves * self._site_areas[:, None] * by_theta
        heat = 0.5 * (heat + heat.T)
        # of a lever of one temperature: θ of the air at the surface as a share of the lever's; the
        # energy of the air inside goes with its square
        own = len(self.surface.panels)
        per_heat = self._resistances[0] / self.panels.areas[0] / self.panels.areas[:own].sum()
        per_heat /= self._halves
        jumped = per_heat * heat.sum()
        operator = AirOperator(self.surface.sites, heat, float((1.0 - jumped) ** 2), self._gap)
        if math.isnan(self._gap):
            return operator
        # the largest products of matrices here, of which no more than six digits are asked
        sites, change = len(heat), self._by_unknowns(self._layer_by_gap).astype(np.float32)
        by_theta, others = by_theta.astype(np.float32), others.astype(np.float32)
        # the change is symmetric: half of what is between the other unknowns on either side
        half = others.T @ (
            change[sites:, :sites] + np.float32(0.5) * (change[sites:, sites:] @ others)
        )
        between_sites = change[:sites, :sites] + half + half.T
        more = -self._halves * (by_theta.T @ (between_sites @ by_theta)).astype(float)
        return replace(
            operator,
            matrix_by_gap=0.5 * (more + more.T),
            filling_by_gap=float(-2.0 * (1.0 - jumped) * per_heat * more.sum()),
        )

    def admittances(self, q: Numbers, shapes: Array) -> Numbers:
        """Return the heat lost (mW) where θ changes in time, as it is tested with some shapes.

        Parameters
        ----------
        q : ndarray, shape (k,)
            √(rate / diffusivity) (1/µm), see `hotlever.air.single_layer`.
        shapes : ndarray, shape (sites, m)
            Of θ (mW/µm), by their values at the sites.

        Returns
        -------
        ndarray, shape (k, m, m)
            µm, symmetric; with what the air would take up that fills the plate.
        """
        moments = self._site_areas[:, None] * shapes
        heat = []
        for screened in single_layer_matrix(self.panels, Screened(q), self.mirrors):
            between_sites, _ = self._condensed(self._layer + screened)
            heat.append(self._halves * (moments.T @ _solved(between_sites, moments)))
        heats = np.array(heat)
        return np.asarray(0.5 * (heats + heats.swapaxes(1, 2)))

    def theta(self, points: Array, flux: Array) -> Array:
        """Return θ (mW/µm) of the air at some points (n, 3), for the flux from every panel."""
        total = np.zeros(len(points))
        for mirror in self.mirrors:
            total += mirror.sign * layer_potential(points, self.panels.reflected(mirror), flux)
        return total


def _by_sites(surface: LeverSurface, areas: Array) -> csr_matrix:
    """Return the densities of all panels by other unknowns, of which the first alone heat sites.

    These are a density for each site; then heat that goes from the first panels of a site to
    another one, and heat of the chip's panels; and last heat from the upper face to the lower one.
    What gives no heat is eliminated, so that a solution for each site costs what sites do, not what
    panels do.
    """
    panels, site = np.arange(len(areas)), surface.site
    order = np.argsort(site, kind="stable")
    first = np.searchsorted(site[order], site[order])
    place, sum_before = np.arange(len(site)) - first, np.cumsum(areas[order]) - areas[order]
    sum_before -= sum_before[first]
    lower = surface.across[:, 1]
    others = np.setdiff1d(panels, np.append(order[place == 0], lower))
    unknown = np.empty_like(panels)
    heated = np.append(others, lower)
    unknown[heated] = panels[len(panels) - len(heated) :]
    entries = [(panels[: len(site)], site, np.ones(len(site)))]
    entries += [(heated, unknown[heated], 1.0 / areas[heated])]
    for back in range(1, place.max() + 1):
        here = np.flatnonzero(place >= back)
        entries += [(order[here - back], unknown[order[here]], -1.0 / sum_before[here])]
    rows, columns, values = (np.concatenate(each) for each in zip(*entries, strict=True))
    return csr_matrix((values, (rows, columns)), shape=(len(panels), len(panels)))


def _solved(matrix: Numbers, right: Numbers) -> Numbers:
    """Solve with a symmetric matrix, which is positive definite where it is real."""
    if np.iscomplexobj(matrix):
        return np.linalg.solve(matrix, right)
    return np.asarray(cho_solve(_factors(matrix), right))


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a symmetric positive definite matrix."""
    inverse, _ = dpotri(*_factors(matrix))
    return np.asarray(np.tril(inverse) + np.tril(inverse, -1).T)


def _factors(matrix: Array) -> tuple[Array, bool]:
    try:
        factors: tuple[Array, bool] = cho_factor(matrix, lower=True)
    except LinAlgError as error:
        raise ComputationError("the air operator of this geometry is not positive") from error
    return factors


@dataclass(frozen=True)
class _Bodies:
    """A lever's surface, and all panels, those of its chip included, wherever a surface is below.

    The single layer of a lever in free space is kept with them.
    """

    surface: LeverSurface
    panels: Panels

    @cached_property
    def layer(self) -> Numbers:
        """The single layer of the panels alone."""
        return single_layer_matrix(self.panels, Laplace())


# distances to a surface come one after the other
@lru_cache(maxsize=1)
def _bodies(layout: Layout, refinement: float, mirrored: bool, chip: bool) -> _Bodies:
    # only air that is not in the cache needs panels, and with them Shapely
    from hotlever.air.surface import lever_surface

    surface = lever_surface(layout, refinement, mirrored=mirrored)
    of_chip = [chip_panels(layout, refinement).corners] if chip else []
    return _Bodies(surface, Panels(np.concatenate([surface.panels.corners, *of_chip])))


def _mirrors_below(
    layout: Layout, surroundings: Surroundings, base_temperature_K: float, panels: Panels
) -> list[Mirror]:
    """Return the mirror of the flat surface below the panels, where θ = 0; none in free space.

    Every panel has a mirror panel of opposite density behind the surface. A jump length g at the
    surface moves the mirror back by g: θ falls to zero there.
    """
    if surroundings.surface_gap_um is None:
        return []
    tilt = math.radians(surroundings.surface_tilt_deg)
    normal = np.array([0.0, 0.0, 1.0])
    if tilt != 0:
        along, _ = BaseLine.of(layout, "surface_tilt_deg").axes
        normal = np.array([*(-math.sin(tilt) * along), math.cos(tilt)])
    below_tip = np.array([*layout.tip, -layout.thickness_um / 2 - surroundings.surface_gap_um])
    point = below_tip - surroundings.jump_length_um(base_temperature_K) * normal
    if ((panels.corners - point) @ normal).min() <= 0:
        raise InputError(
            "surroundings: the surface below crosses the lever, its tip or its chip; expected a "
            "larger surface_gap_um or another surface_tilt_deg"
        )
    return [Mirror.in_plane(point, normal, -1.0)]
