"""The path of the current through the tip: a streamline of the current, from supply to ground."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from hotlever.lever.full_space import FullSpace
from hotlever.types import Array

#: Steps along the path, as a share of the longer side of the lever; and their greatest number.
_STEP, _MOST_STEPS = 1 / 400, 4000
#: Quadrature points over which the direction of the current is averaged.
_NEAR = 6


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
    elements = space.elements
    inside = np.repeat(space.conducting, elements.per_element)
    slopes = (elements.sampling[inside.size :] @ potential).reshape(2, -1)
    places, flow = elements.positions.T[inside], -slopes.T[inside]
    tree = cKDTree(places)
    # what is farther from all points of the lever is outside
    reach = 2.0 * float(tree.query(places, k=2)[0][:, 1].max())
    step = _STEP * float(np.ptp(places, axis=0).max())

    def direction(at: Array) -> Array | None:
        far, near = tree.query(at, k=_NEAR)
        mean = flow[near].mean(axis=0)
        length = float(np.hypot(*mean))
        return mean / length if far[0] < reach and length > 0.0 else None

    def followed(at: Array, sign: float) -> list[Array]:
        path: list[Array] = []
        while len(path) < _MOST_STEPS and (first := direction(at)) is not None:
            middle = direction(at + 0.5 * sign * step * first)
            if middle is None:
                break
            at = at + sign * step * middle
            path.append(at)
        return path

    start = places[tree.query(space.mesh.layout.tip)[1]]
    points = np.array([*followed(start, -1.0)[::-1], start, *followed(start, 1.0)])
    points = points[space.mesh.layout.contains(points)]
    return points, step * np.arange(len(points), dtype=float)
