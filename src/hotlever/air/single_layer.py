"""The single-layer operator of a surface: densities on its panels to potentials.

Galerkin's method with constant densities: V_ij = Σ_m s_m ∫_i ∫_{m(j)} G(r)/4π, where r is the
distance, m runs over the mirrors that stand for symmetry or for isothermal planes, s_m is their
sign, and G the kernel: 1/r (`hotlever.air.laplace`) or what air adds that takes up heat itself
(`hotlever.air.screened`). V is symmetric; with 1/r it is positive definite, and for ∇²θ = 0 outside
the surface, θ given on it and no flux at infinity, the heat that leaves panel i is A_i q_i with
V q = b, b_i = ∫_i θ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hotlever.air.panels import IDENTITY, Mirror, Panels
from hotlever.threads import one_blas_thread
from hotlever.types import Array, Index, Progress

# Real or complex, as the kernel is.
Numbers = NDArray[Any]
# Gauss points per direction, and up to how many times the sum of their radii the centroids of two
# panels are apart for which they suffice.
Orders = Sequence[tuple[int, float]]

#: Panels expanded, pairs integrated and Gauss points taken at once: arrays that stay in the cache.
_ROWS, _PAIRS, _POINTS = 32, 8192, 8192


class Kernel(Protocol):
    """Integrals of one or several functions of the distance R over pairs of panels.

    Attributes
    ----------
    shape : tuple of int
        Of the functions side by side.
    dtype : dtype
        Of the integrals.
    far : float
        Pairs whose centroids are this many times the sum of their radii apart are far.
    """

    shape: tuple[int, ...]
    dtype: Any
    far: float

    def far_pairs(self, first: Panels, second: Panels, offsets: Array) -> Numbers:
        """Return ∫∫ G over all pairs that are far, (..., n, m), of their centroids' offsets."""
        ...

    def near_pairs(self, first: Panels, second: Panels, i: Index, j: Index) -> Numbers:
        """Return ∫∫ G over pairs of panels, by their numbers (n,) in both, (..., n)."""
        ...


@one_blas_thread
def single_layer_matrix(
    panels: Panels,
    kernel: Kernel,
    mirrors: Sequence[Mirror] = (IDENTITY,),
    progress: Progress | None = None,
) -> Numbers:
    """Return the Galerkin matrix of a kernel.

    Parameters
    ----------
    panels : Panels
    kernel : Kernel
    mirrors : sequence of Mirror, optional
        The identity among them; each its own inverse.
    progress : callable, optional
        Called with steps done and their number.

    Returns
    -------
    ndarray, shape (..., n, n)
        µm³, symmetric; one for each function of the kernel.
    """
    count = len(panels)
    matrix = np.zeros((*kernel.shape, count, count), dtype=kernel.dtype)
    for done, mirror in enumerate(mirrors):
        images = panels.reflected(mirror)
        image = np.empty_like(matrix)
        near = []
        for start in range(0, count, _ROWS):
            rows = np.arange(start, min(start + _ROWS, count))
            some = panels.chosen(rows)
            offsets = some.centres[:, None] - images.centres
            image[..., rows, :] = kernel.far_pairs(some, images, offsets)
            reach = kernel.far * (some.radii[:, None] + images.radii)
            i, j = np.nonzero(np.einsum("nmd,nmd->nm", offsets, offsets) < reach**2)
            half = rows[i] <= j
            near.append(np.stack([rows[i][half], j[half]]))
        pairs = np.concatenate(near, axis=1)
        for start in range(0, pairs.shape[1], _PAIRS):
            i, j = pairs[:, start : start + _PAIRS]
            values = kernel.near_pairs(panels, images, i, j)
            image[..., i, j] = values
            image[..., j, i] = values
            if progress is not None:
                share = int(100 * min(start + _PAIRS, pairs.shape[1]) / pairs.shape[1])
                progress(100 * done + share, 100 * len(mirrors))
        matrix += mirror.sign * image
    return np.asarray(matrix / (4.0 * np.pi))


def pairs_by_points(
    first: Panels, second: Panels, over_panel: Callable[[Array, Array], Numbers], orders: Orders
) -> Numbers:
    """Integrate over pairs of any panels: exactly over the larger, by Gauss points over the other.

    Parameters
    ----------
    first, second : Panels, n each
    over_panel : callable
        Returns the integral over panels (..., 4, 3), as seen from points (..., 3).
    orders : sequence of (int, float)

    Returns
    -------
    ndarray, shape (..., n)
    """
    gaps = np.linalg.norm(first.centres - second.centres, axis=1) / (first.radii + second.radii)
    smaller = (first.radii <= second.radii)[:, None, None]
    under = Panels(np.where(smaller, first.corners, second.corners))
    source = np.where(smaller, second.corners, first.corners)
    which = np.searchsorted([farthest for _, farthest in orders], gaps, side="right")
    integrals, numbers = [], []
    for number, (order, _) in enumerate(orders):
        here = np.flatnonzero(which == number)
        for pairs in np.array_split(here, 1 + here.size * order**2 // _POINTS):
            points, weights = under.chosen(pairs).points(order)
            values = over_panel(points, source[pairs, None])
            integrals.append(np.einsum("nq,...nq->...n", weights, values))
            numbers.append(pairs)
    return np.concatenate(integrals, axis=-1)[..., np.argsort(np.concatenate(numbers))]
