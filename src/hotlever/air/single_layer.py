"""The single-layer operator of a surface: densities on its panels to potentials.

Galerkin's method with constant densities: V_ij = Σ_m s_m ∫_i ∫_{m(j)} G(r)/4π, where r is the
distance, m runs over the mirrors that stand for symmetry or for isothermal planes, s_m is their
sign, and G the kernel: 1/r (`hotlever.air.laplace`) or what air adds that takes up heat itself
(`Screened`). V is symmetric; with 1/r it is positive definite, and for ∇²θ = 0 outside
the surface, θ given on it and no flux at infinity, the heat that leaves panel i is A_i q_i with
V q = b, b_i = ∫_i θ.

A temperature that changes as exp(st) obeys ∇²θ = q²θ in air of diffusivity α, with q = √(s/α); its
kernel is exp(−qR)/(4πR). Its difference from that at rest, 1/(4πR), has no pole. Integrated over
one panel in polar coordinates about the foot of a point, it is a smooth integral along the edges.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hotlever.air.panels import (
    COINCIDENT,
    IDENTITY,
    Mirror,
    Panels,
    gauss_rule,
    spreads,
    square_distances,
    traces,
)
from hotlever.types import Array, Index, Progress
from hotlever.work import one_blas_thread

# Real or complex, as the kernel is.
Numbers = NDArray[Any]


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

    def far_pairs(self, first: Panels, second: Panels, square: Array) -> Numbers:
        """Return ∫∫ G over all pairs that are far, (..., n, m), by their `square_distances`."""
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
    matrix: Numbers = np.zeros((*kernel.shape, count, count), dtype=kernel.dtype)
    for done, mirror in enumerate(mirrors):
        share = mirror.sign / (4.0 * np.pi)
        images = panels.reflected(mirror)
        for body in (panels, images):
            # what is known of all is known of a part
            _ = body.radii, body.moments, body.frame, body.half_sizes
        near = []
        rows_at_once = 32  # whose arrays stay in the cache
        for start in range(0, count, rows_at_once):
            # each pair once: the matrix is symmetric
            rows, others = slice(start, start + rows_at_once), slice(start, count)
            some, rest = panels.chosen(rows), images.chosen(others)
            square = square_distances(some, rest)
            values = kernel.far_pairs(some, rest, square)
            reach = kernel.far * np.add.outer(some.radii, rest.radii)
            i, j = np.nonzero(square < reach**2)
            values[..., i, j] = 0.0
            values *= share
            matrix[..., rows, others] += values
            half = i <= j
            near.append(start + np.stack([i[half], j[half]]))
        pairs = np.concatenate(near, axis=1)
        pairs_at_once = 8192
        for start in range(0, pairs.shape[1], pairs_at_once):
            i, j = pairs[:, start : start + pairs_at_once]
            matrix[..., i, j] += share * kernel.near_pairs(panels, images, i, j)
            if progress is not None:
                percent = int(100 * min(start + pairs_at_once, pairs.shape[1]) / pairs.shape[1])
                progress(100 * done + percent, 100 * len(mirrors))
    for start in range(0, count, 256):
        # what is below the diagonal, from above it
        rows, others = slice(start, start + 256), slice(start + 256, count)
        matrix[..., others, rows] = np.swapaxes(matrix[..., rows, others], -1, -2)
        upper = np.triu(matrix[..., rows, rows])
        matrix[..., rows, rows] = upper + np.swapaxes(np.triu(upper, 1), -1, -2)
    return matrix


def separations(first: Panels, second: Panels, i: Index, j: Index) -> Array:
    """Return how far the centroids of pairs are apart, over the sums of their radii, (n,)."""
    x, y, z = (first.centres[i] - second.centres[j]).T
    distances = np.sqrt(x**2 + y**2 + z**2)
    return np.asarray(distances / (first.radii[i] + second.radii[j]))


def pairs_by_points_of_both(
    first: Panels,
    second: Panels,
    i: Index,
    j: Index,
    between_points: Callable[[Array], Numbers],
    order: int,
) -> Numbers:
    """Integrate over pairs of any panels by Gauss points of both: of those that are apart.

    Parameters
    ----------
    first, second : Panels
    i, j : ndarray of int, shape (n,)
        Numbers of the panels of each pair.
    between_points : callable
        Returns the kernel at offsets from points of the second to points of the first, (3, ...).
    order : int
        Points per direction.

    Returns
    -------
    ndarray, shape (..., n)
    """
    bodies = []
    for panels in (first, second):
        points, weights = panels.points(order)
        bodies.append((points.transpose(2, 1, 0).copy(), weights.T.copy()))
    (at, weights), (others_at, other_weights) = bodies
    integrals = []
    # pairs last, and so many that their arrays stay in the cache
    for pairs in np.array_split(np.arange(len(i)), 1 + len(i) * order**4 // 32768):
        own, other = i[pairs], j[pairs]
        offsets = at[:, :, None, own] - others_at[:, None, :, other]
        values = between_points(offsets)
        integrals.append(
            np.einsum("an,bn,...abn->...n", weights[:, own], other_weights[:, other], values)
        )
    return np.concatenate(integrals, axis=-1)


def pairs_by_points(
    first: Panels,
    second: Panels,
    over_panel: Callable[[Array, Array], Numbers],
    orders: Sequence[tuple[int, float]],
    swapped: ArrayLike = 1.0,
) -> Numbers:
    """Integrate over pairs of any panels: exactly over the larger, by Gauss points over the other.

    Parameters
    ----------
    first, second : Panels, n each
    over_panel : callable
        Returns the integral over panels (..., 4, 3), as seen from points (..., 3).
    orders : sequence of (int, float)
        Gauss points per direction, and up to how many times the sum of their radii the centroids of
        two panels are apart for which they suffice.
    swapped : array_like
        By what each function of the kernel is multiplied where the two panels change places.

    Returns
    -------
    ndarray, shape (..., n)
    """
    every = np.arange(len(first))
    gaps = separations(first, second, every, every)
    smaller = (first.radii <= second.radii)[:, None, None]
    under = Panels(np.where(smaller, first.corners, second.corners))
    source = np.where(smaller, second.corners, first.corners)
    which = np.searchsorted([farthest for _, farthest in orders], gaps, side="right")
    integrals, numbers = [], []
    for number, (order, _) in enumerate(orders):
        here = np.flatnonzero(which == number)
        for pairs in np.array_split(here, 1 + here.size * order**2 // 8192):
            points, weights = under.chosen(pairs).points(order)
            values = over_panel(points, source[pairs, None])
            integrals.append(np.einsum("nq,...nq->...n", weights, values))
            numbers.append(pairs)
    whole = np.concatenate(integrals, axis=-1)[..., np.argsort(np.concatenate(numbers))]
    return np.where(smaller[:, 0, 0], whole, np.expand_dims(swapped, -1) * whole)


# --- air that takes up heat -----------------------------------------------------------------------


class Screened:
    """The kernels (exp(−qR) − 1)/R; see `Kernel`.

    Parameters
    ----------
    q : ndarray, shape (k,)
        1/µm, with a real part that is not negative: real where a temperature grows, complex where
        it oscillates.
    """

    far = 2.0

    def __init__(self, q: Numbers) -> None:
        self._q, self.shape, self.dtype = q, q.shape, q.dtype

    def far_pairs(self, first: Panels, second: Panels, square: Array) -> Numbers:
        """Integrate over distant pairs, (k, n, m), to second order in size over distance."""
        square = np.maximum(square, COINCIDENT)
        distance, along = np.sqrt(square), spreads(first, second) / square
        across = traces(first, second) - along
        x = np.multiply.outer(self._q, distance)
        less = _decay(self._q, distance)
        more = x * (1.0 + less)
        slope = -(more + less)  # times R²
        bend = x * more + 2.0 * (more + less)  # times R³
        areas = np.multiply.outer(first.areas, second.areas) / distance
        return np.asarray(areas * (less + 0.5 * (slope * across + bend * along) / square))

    def near_pairs(self, first: Panels, second: Panels, i: Index, j: Index) -> Numbers:
        """Integrate over pairs of any panels, (k, n): over the larger by its edges."""

        def over_panel(points: Array, corners: Array) -> Numbers:
            return screened_potential(points, corners, self._q)

        def between_points(offsets: Array) -> Numbers:
            x, y, z = offsets
            distance = np.sqrt(x**2 + y**2 + z**2)
            return np.asarray(_decay(self._q, distance) / distance)

        gaps = separations(first, second, i, j)
        result = np.empty((*self.shape, len(i)), dtype=self.dtype)
        # the kernel has no pole: it bends at R = 0 alone
        for order, nearest, farthest in ((2, 1.0, np.inf), (3, 0.5, 1.0)):
            here = (gaps >= nearest) & (gaps < farthest)
            result[..., here] = pairs_by_points_of_both(
                first, second, i[here], j[here], between_points, order
            )
        near = gaps < 0.5
        result[..., near] = pairs_by_points(
            first.chosen(i[near]), second.chosen(j[near]), over_panel, ((4, np.inf),)
        )
        return result


def screened_potential(points: Array, corners: Array, q: Numbers) -> Numbers:
    """Return ``∫ (exp(−qR) − 1)/R dA`` over convex polygons.

    Parameters
    ----------
    points : ndarray, shape (..., 3)
        Where (µm).
    corners : ndarray, shape (..., c, 3)
        Corners of the flat polygon that belongs to each point; leading dimensions are broadcast.
    q : ndarray, shape (k,)
        1/µm.

    Returns
    -------
    ndarray, shape (k, ...)
        µm.
    """
    normal = np.cross(
        corners[..., 2, :] - corners[..., 0, :], corners[..., -1, :] - corners[..., 1, :]
    )
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    to_corner = corners - points[..., None, :]
    height = np.abs(np.einsum("...d,...d->...", to_corner[..., 0, :], normal))
    # along each half of an edge ∫ (exp(−qR) − 1) dR from the plane's height on, by its points
    nodes, weights = gauss_rule(4)
    rates = q.reshape(-1, *(1,) * height.ndim)
    screened, alone = np.zeros((len(q), *height.shape), dtype=q.dtype), np.zeros(height.shape)
    last = corners.shape[-2] - 1
    for corner in range(last + 1):
        start = to_corner[..., corner, :]
        edge = to_corner[..., 0 if corner == last else corner + 1, :] - start
        length = np.maximum(np.linalg.norm(edge, axis=-1), 1e-12)
        edge = edge / length[..., None]
        # from the foot of the point: away from the edge's line, and along it
        away = np.einsum("...d,...d->...", start, np.cross(edge, normal))
        begin = np.einsum("...d,...d->...", start, edge)
        nearest = np.clip(0.0, begin, begin + length)
        for low, high in ((begin, nearest), (nearest, begin + length)):
            # the nearest place of the line is where the integrand bends
            half = 0.5 * (high - low)
            for node, weight in zip(nodes, weights, strict=True):
                flat = away**2 + (low + half * (1.0 + node)) ** 2
                apart = np.sqrt(flat + height**2) - height
                share = weight * half * away / np.maximum(flat, 1e-24)
                screened += share * _decay(q, apart)
                alone += share * apart
    return np.asarray(-(1.0 + _decay(q, height)) * screened / rates - alone)


def _decay(q: Numbers, distance: Array) -> Numbers:
    """Return exp(−qR) − 1, (k, ...); of twice the last q as its square, in a tenth of the time."""
    decay = np.empty((*q.shape, *distance.shape), dtype=q.dtype)
    for number, rate in enumerate(q):
        if number and rate == 2.0 * q[number - 1]:
            before = decay[number - 1]
            np.multiply(before, before + 2.0, out=decay[number])
        else:
            np.expm1(-rate * distance, out=decay[number])
    return decay
