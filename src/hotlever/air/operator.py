"""The air around a lever as one linear operator, made once for a geometry.

Still air obeys Laplace's equation in the Kirchhoff variable θ = ∫κ_air dT. So all of it, open
space included, is a symmetric positive matrix from θ on the lever's surface to the heat that
leaves there. The single layer of `hotlever.air.single_layer` also fills the plate with air;
what that air would conduct along the plate is taken off the silicon in
`hotlever.lever.equations`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from hotlever import __version__
from hotlever.air.panels import mirror_group
from hotlever.air.single_layer import single_layer
from hotlever.air.surface import LeverSurface, PanelOptions, lever_surface
from hotlever.cache import cache_file, store_arrays, stored_arrays
from hotlever.errors import ComputationError
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
    """

    sites: Array
    matrix: Array


def air_operator(layout: Layout, options: PanelOptions | None = None) -> AirOperator:
    """Return the operator of a lever in its surroundings, from the cache or made and cached.

    Parameters
    ----------
    layout : Layout
    options : PanelOptions, optional

    Raises
    ------
    InputError
        If a region of the layout is not an axis-parallel rectangle.
    """
    options = options or PanelOptions()
    facts = {
        "version": __version__,
        "layout": asdict(layout),
        "options": asdict(options),
    }
    path = cache_file("air", facts)
    stored = stored_arrays(path)
    if stored is not None and {"sites", "matrix"} <= stored.keys():
        return AirOperator(stored["sites"], stored["matrix"])
    surface = lever_surface(layout, options)
    operator = AirOperator(surface.sites, heat_matrix(surface))
    store_arrays(path, {"sites": operator.sites, "matrix": operator.matrix})
    return operator


def heat_matrix(surface: LeverSurface) -> Array:
    """Return the matrix from θ at the sites of a surface to the heat lost there (µm)."""
    layer = single_layer(surface.panels, mirror_group(surface.mid_plane))
    areas = surface.panels.areas
    at_site = np.zeros((len(areas), len(surface.sites)))
    at_site[np.arange(len(areas)), surface.site] = areas
    try:
        density = cho_solve(cho_factor(layer, overwrite_a=True), at_site)
    except LinAlgError as error:
        raise ComputationError(
            "the air operator of this geometry is not positive definite: panels overlap or an "
            "isothermal surface crosses the lever"
        ) from error
    halves = 2.0 if surface.mirrored else 1.0
    heat = halves * (at_site.T @ density)
    symmetric: Array = 0.5 * (heat + heat.T)
    return symmetric
