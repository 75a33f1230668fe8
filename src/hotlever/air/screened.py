"""The single layer of air that takes up heat itself, less that of air at rest.

A temperature that changes as exp(st) obeys ∇²θ = q²θ in air of diffusivity α, with q = √(s/α); its
kernel is exp(−qR)/(4πR). Its difference from that at rest, 1/(4πR), has no pole. Integrated over
one panel in polar coordinates about the foot of a point, it is a smooth integral along the edges.
The rest is as in `hotlever.air.single_layer`.
"""

from __future__ import annotations

import numpy as np

from hotlever.air.panels import Panels
from hotlever.air.single_layer import Numbers, pairs_by_points
from hotlever.types import Array, Index

#: Pairs whose centroids are this many times the sum of their radii apart are far.
_FAR = 2.0
#: For near pairs, see `hotlever.air.single_layer.Orders`; and points along each half of an edge.
_ORDERS, _ALONG = ((4, 0.5), (3, 1.0), (2, np.inf)), 4


class Screened:
    """The kernels (exp(−qR) − 1)/R; see `hotlever.air.single_layer.Kernel`.

    Parameters
    ----------
    q : ndarray, shape (k,)
        1/µm, with a real part that is not negative: real where a temperature grows, complex where
        it oscillates.
    """

    far = _FAR

    def __init__(self, q: Numbers) -> None:
        self._q, self.shape, self.dtype = q, q.shape, q.dtype

    def far_pairs(self, first: Panels, second: Panels, offsets: Array) -> Numbers:
        """Integrate over distant pairs, (k, n, m), to second order in size over distance."""
        square = np.maximum(np.einsum("nmd,nmd->nm", offsets, offsets), 1e-12)
        distance = np.sqrt(square)
        moments = first.moments[:, None] + second.moments
        along = np.einsum("nmd,nmde,nme->nm", offsets, moments, offsets, optimize=True) / square
        across = np.trace(moments, axis1=2, axis2=3) - along
        x = np.multiply.outer(self._q, distance)
        less = np.expm1(-x)
        more = x * (1.0 + less)
        slope = -(more + less)  # times R²
        bend = x * more + 2.0 * (more + less)  # times R³
        areas = np.multiply.outer(first.areas, second.areas) / distance
        return np.asarray(areas * (less + 0.5 * (slope * across + bend * along) / square))

    def near_pairs(self, first: Panels, second: Panels, i: Index, j: Index) -> Numbers:
        """Integrate over pairs of any panels, (k, n): over the larger by its edges."""

        def over_panel(points: Array, corners: Array) -> Numbers:
            return screened_potential(points, corners, self._q)

        return pairs_by_points(first.chosen(i), second.chosen(j), over_panel, _ORDERS)


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
    nodes, weights = np.polynomial.legendre.leggauss(_ALONG)
    total = np.zeros((len(q), *to_corner.shape[:-2]), dtype=q.dtype)
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
                far = np.sqrt(flat + height**2)
                share = weight * half * away / np.maximum(flat, 1e-24)
                total += share * _between(q, height, far)
    return total


def _between(q: Numbers, near: Array, far: Array) -> Numbers:
    """Return ∫ (exp(−qR) − 1) dR between two distances, (k, ...)."""
    rates, apart = q.reshape(-1, *(1,) * far.ndim), far - near
    return np.asarray(-np.exp(-rates * near) * np.expm1(-rates * apart) / rates - apart)
