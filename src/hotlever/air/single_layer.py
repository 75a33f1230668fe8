"""The single-layer operator of a surface: densities on its panels to potentials.

Galerkin's method with constant densities: V_ij = Σ_m s_m ∫_i ∫_{m(j)} 1/(4π|x − y|), where m runs
over the mirrors that stand for symmetry or for isothermal planes and s_m is their sign. V is
symmetric and positive definite; for ∇²θ = 0 outside the surface, θ given on it and no flux at
infinity, the heat that leaves panel i is A_i q_i with V q = b, b_i = ∫_i θ.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hotlever.air.integrals import far_pairs, potential, rectangle_pairs
from hotlever.air.panels import IDENTITY, Mirror, Panels
from hotlever.threads import one_blas_thread
from hotlever.types import Array, Index, Progress

#: Pairs whose centroids are this many times the sum of their radii apart are far.
FAR = 3.0
#: Gauss points per direction for near pairs that have no closed form, and up to how many times the
#: sum of their radii the centroids are apart.
ORDERS = ((8, 0.5), (6, 1.0), (4, 1.5), (3, 2.0), (2, np.inf))
#: Rectangles turned by less (rad) against each other are parallel.
_SAME_ANGLE = 2e-6
#: Panels expanded, pairs integrated and Gauss points taken at once: arrays that stay in the cache.
_ROWS, _PAIRS, _POINTS = 32, 8192, 8192


@one_blas_thread
def single_layer_matrix(
    panels: Panels, mirrors: Sequence[Mirror] = (IDENTITY,), progress: Progress | None = None
) -> Array:
    """Return the Galerkin matrix of 1/(4πR).

    Parameters
    ----------
    panels : Panels
    mirrors : sequence of Mirror, optional
        The identity among them; each its own inverse.
    progress : callable, optional
        Called with steps done and their number.

    Returns
    -------
    ndarray, shape (n, n)
        µm³, symmetric.
    """
    count = len(panels)
    matrix = np.zeros((count, count))
    for done, mirror in enumerate(mirrors):
        images = panels.reflected(mirror)
        one = np.empty_like(matrix)
        near: list[tuple[Index, Index]] = []
        for start in range(0, count, _ROWS):
            rows = np.arange(start, min(start + _ROWS, count))
            some = panels.chosen(rows)
            offsets = some.centres[:, None] - images.centres
            one[rows] = far_pairs(some, images, offsets)
            reach = FAR * (some.radii[:, None] + images.radii)
            i, j = np.nonzero(np.einsum("nmd,nmd->nm", offsets, offsets) < reach**2)
            half = rows[i] <= j
            near.append((rows[i][half], j[half]))
        first, second = (np.concatenate(numbers) for numbers in zip(*near, strict=True))
        closed = _in_one_frame(panels.frame, images.frame, first, second)
        for pairs, integrals in ((closed, rectangle_pairs), (~closed, _by_quadrature)):
            some_i, some_j = first[pairs], second[pairs]
            for start in range(0, some_i.size, _PAIRS):
                i, j = some_i[start : start + _PAIRS], some_j[start : start + _PAIRS]
                values = integrals(panels.chosen(i), images.chosen(j))
                one[i, j] = values
                one[j, i] = values
                if progress is not None:
                    share = int(100 * min(start + _PAIRS, some_i.size) / some_i.size)
                    progress(100 * done + share, 100 * len(mirrors))
        matrix += mirror.sign * one
    return matrix / (4.0 * np.pi)


@one_blas_thread
def layer_potential(points: Array, panels: Panels, density: Array) -> Array:
    """Return the potential of densities on panels.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        µm.
    panels : Panels
    density : ndarray, shape (len(panels),)

    Returns
    -------
    ndarray, shape (n,)
        ∫ density/(4πR).
    """
    result = np.empty(len(points))
    traces = np.trace(panels.moments, axis1=1, axis2=2)
    for start in range(0, len(points), 4 * _ROWS):
        some = points[start : start + 4 * _ROWS]
        offsets = some[:, None] - panels.centres
        square = np.einsum("nmd,nmd->nm", offsets, offsets)
        near = square < (FAR * panels.radii) ** 2
        inverse = 1.0 / np.sqrt(np.where(near, np.inf, square))
        spread = np.einsum("nmd,mde,nme->nm", offsets, panels.moments, offsets, optimize=True)
        integrals = inverse + 0.5 * inverse**3 * (3.0 * spread * inverse**2 - traces)
        integrals *= panels.areas
        i, j = np.nonzero(near)
        integrals[i, j] = potential(some[i], panels.corners[j])
        result[start : start + len(some)] = integrals @ density
    return result / (4.0 * np.pi)


def _in_one_frame(
    frame: tuple[Index, Array], other: tuple[Index, Array], first: Index, second: Index
) -> NDArray[np.bool_]:
    """Whether pairs of panels are rectangles with sides along the same three axes."""
    (axis, angle), (other_axis, other_angle) = frame, other
    between = np.abs(angle[first] - other_angle[second])
    same = np.minimum(between, np.pi / 2 - between) < _SAME_ANGLE
    return (axis[first] >= 0) & (other_axis[second] >= 0) & same


def _by_quadrature(first: Panels, second: Panels) -> Array:
    """Integrate 1/R over pairs of any panels.

    In closed form over the larger of the two and by Gauss points over the other.
    """
    gaps = np.linalg.norm(first.centres - second.centres, axis=1) / (first.radii + second.radii)
    smaller = (first.radii <= second.radii)[:, None, None]
    under = Panels(np.where(smaller, first.corners, second.corners))
    source = np.where(smaller, second.corners, first.corners)
    result = np.empty(len(first))
    which = np.searchsorted([farthest for _, farthest in ORDERS], gaps, side="right")
    for number, (order, _) in enumerate(ORDERS):
        here = np.flatnonzero(which == number)
        for pairs in np.array_split(here, 1 + here.size * order**2 // _POINTS):
            points, weights = under.chosen(pairs).points(order)
            values = potential(points, source[pairs, None])
            result[pairs] = np.einsum("nq,nq->n", weights, values)
    return result
