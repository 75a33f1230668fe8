"""The air around a lever as one linear operator, made once for a geometry.

Still air obeys Laplace's equation in the Kirchhoff variable θ = ∫κ_air dT. So all of it, open
space included, is a symmetric positive matrix from θ on the lever's surface to the heat that
leaves there. The single layer of `hotlever.air.single_layer` also fills the plate with air;
what that air would conduct along the plate is taken off the silicon in
`hotlever.lever.equations`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from hotlever import __version__
from hotlever.air.chip import chip_panels
from hotlever.air.panels import Panels, mirror_group
from hotlever.air.single_layer import Progress, single_layer
from hotlever.air.surface import PanelOptions, lever_surface
from hotlever.air.surroundings import Surroundings
from hotlever.cache import cache_file, store_arrays, stored
from hotlever.errors import ComputationError, InputError
from hotlever.probe.layout import Layout

Array = NDArray[np.float64]


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
    """

    sites: Array
    matrix: Array
    filling: float = 1.0

    def less(self, diagonal: Array) -> Array:
        """Return the matrix less a diagonal one."""
        return self.matrix - np.diag(diagonal)


def air_operator(
    layout: Layout,
    surroundings: Surroundings | None = None,
    base_temperature_K: float = 293.0,
    options: PanelOptions | None = None,
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
    options : PanelOptions, optional
    progress : callable, optional
        Called while an operator is made, with steps done and their number.

    Raises
    ------
    InputError
        If a region of the layout is not an axis-parallel rectangle, or the surface below crosses
        the lever.
    """
    surroundings, options = surroundings or Surroundings(), options or PanelOptions()
    facts = {
        "version": __version__,
        "layout": asdict(replace(layout, cone=None)),
        "cone": layout.cone and layout.cone.model_dump(),
        "surroundings": surroundings.model_dump(exclude={"medium"}),
        "jump_um": surroundings.jump_length_um(base_temperature_K),
        "options": asdict(options),
    }
    path = cache_file("air", facts)
    known = stored(path, lambda a: AirOperator(a["sites"], a["matrix"], float(a["filling"])))
    if known is not None:
        return known
    operator = make_operator(layout, surroundings, base_temperature_K, options, progress)
    store_arrays(path, {name: np.asarray(value) for name, value in vars(operator).items()})
    return operator


def make_operator(
    layout: Layout,
    surroundings: Surroundings,
    base_temperature_K: float,
    options: PanelOptions,
    progress: Progress | None = None,
) -> AirOperator:
    """Make the operator: see `air_operator`."""
    surface = lever_surface(layout, options, mirrored=surroundings.symmetric)
    below = surroundings.surface(layout.tip, layout.thickness_um, base_temperature_K)
    chip = [chip_panels(layout, options)] if surroundings.chip else []
    panels = Panels.joined([surface.panels, *chip])
    for mirror in below:
        heights = mirror.height(panels.corners)
        if heights.min() <= 0:
            raise InputError(
                "surroundings: the surface below crosses the lever or its chip; expected a larger "
                "surface_gap_um or another surface_tilt_deg"
            )
    layer = single_layer(panels, mirror_group([*surface.mid_plane, *below]), progress)
    jump = np.full(len(panels), surroundings.jump_length_um(base_temperature_K))
    jump[: len(surface.panels)] = surroundings.jump_length_um(surroundings.jump_temperature_K)
    layer[np.diag_indices_from(layer)] += jump * panels.areas
    moments = np.zeros((len(panels), len(surface.sites)))
    moments[np.arange(len(surface.panels)), surface.site] = surface.panels.areas
    try:
        density = cho_solve(cho_factor(layer, overwrite_a=True), moments)
    except LinAlgError as error:
        raise ComputationError("the air operator of this geometry is not positive") from error
    halves = 2.0 if surface.mirrored else 1.0
    heat = halves * (moments.T @ density)
    # of a lever of one temperature: θ of the air at the surface as a share of the lever's; the
    # energy of the air inside goes with its square
    jumped = (jump * panels.areas) @ density.sum(axis=1) / surface.panels.areas.sum()
    return AirOperator(surface.sites, 0.5 * (heat + heat.T), float((1.0 - jumped) ** 2))
