"""The path of the current through the tip: a streamline of the current, from supply to ground."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hotlever.errors import InputError
from hotlever.lever.full_space import FullSpace
from hotlever.types import Array


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
    elements, layout = space.elements, space.mesh.layout
    # steps along the path are this share of the longer side of the lever
    longest = 1 / 150 * float(np.ptp(layout.box, axis=0).max())

    def direction(at: Array) -> Array:
        (element,), _, slopes = elements.at_points(at[None])
        if not space.conducting[element]:
            raise InputError("no current flows there")
        flow = -slopes[:, 0] @ potential[elements.dofs[element]]
        return np.asarray(flow / np.linalg.norm(flow))

    def streamline(at: Array, sign: float) -> Iterator[Array]:
        size, steps = sign * longest, 0
        # to end at the edge steps are halved six times
        while abs(size) > longest / 2**6 and steps < 2000:
            try:
                middle = at + 0.5 * size * direction(at)
                after = at + size * direction(middle)
                direction(after)
            except InputError:  # beyond the edge
                size /= 2
                continue
            at, steps = after, steps + 1
            yield at

    start = np.array(layout.tip)
    try:
        direction(start)
    except InputError:
        positions = elements.positions.T[np.repeat(space.conducting, elements.per_element)]
        start = positions[np.argmin(np.linalg.norm(positions - start, axis=1))]
    points = np.array([*[*streamline(start, -1.0)][::-1], start, *streamline(start, 1.0)])
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return points, np.concatenate([[0.0], np.cumsum(lengths)])
