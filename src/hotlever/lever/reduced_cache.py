"""Reduced levers on disk, so that a geometry is reduced once.

A file holds modes, lift and quadrature rule of one geometry, under a name made of everything they
depend on: layout, mesh, air, base temperature, options and version.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict

import numpy as np

from hotlever import __version__
from hotlever.cache import cache_file, store_arrays, stored
from hotlever.lever.lever import Lever
from hotlever.lever.reduced import ReducedSpace
from hotlever.lever.reduction import ReductionOptions, reduce


def cached_reduction(
    lever: Lever,
    options: ReductionOptions | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ReducedSpace:
    """Return the reduced space of a lever's geometry and medium, from the cache or made and cached.

    Parameters
    ----------
    lever : Lever
    options : ReductionOptions, optional
    progress : callable, optional
        Called while a space is made, with parameter sets done and their number.
    """
    options = options or ReductionOptions()
    path = cache_file("reduced", _facts(lever, options))
    space = stored(path, lambda arrays: ReducedSpace.from_arrays(lever, arrays))
    if space is None:
        space = reduce(lever, options, progress)
        store_arrays(path, space.arrays())
    return space


def _facts(lever: Lever, options: ReductionOptions) -> dict[str, object]:
    mesh, air = lever.space.mesh.elements, lever.space.air
    return {
        "version": __version__,
        "shape": lever.probe.shape.model_dump(),
        "tip": lever.probe.tip and lever.probe.tip.model_dump(),
        "base_temperature_K": lever.probe.circuit.base_temperature_K,
        "n_hd": lever.probe.material.n_hd,
        "options": asdict(options),
        "nodes": mesh.p,
        "triangles": mesh.t,
        "points": lever.space.operators.positions,
        "air": np.empty(0) if air is None else air.matrix,
    }
