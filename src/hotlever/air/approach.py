"""How integrals of 1/R over pairs of flat panels change where the second one moves: closed forms.

So the single layer of a lever changes with the gap to a surface, whose images all move along its
normal. The closed forms are derivatives of those of `hotlever.air.laplace`, up to terms that cancel
between the limits.
"""

from __future__ import annotations

import numpy as np

from hotlever.air.laplace import FAR, ORDERS, by_orientation, in_one_frame, seen_from, spreads
from hotlever.air.panels import Panels
from hotlever.air.single_layer import pairs_by_points
from hotlever.types import Array, Index

#: Stands for zero below a fraction whose factor vanishes there.
_TINY = 1e-150
#: Signs of the limits: where both panels extend, and where one does.
_TWICE, _ONCE = np.array([1.0, -1.0, -1.0, 1.0]), np.array([1.0, -1.0])


class Approach:
    """The kernel m·∇(1/R), the derivative of 1/R by a motion m of the second point.

    See `hotlever.air.single_layer.Kernel`.

    Parameters
    ----------
    motion : ndarray, shape (3,)
    """

    shape: tuple[int, ...] = ()
    dtype, far = np.dtype(float), FAR

    def __init__(self, motion: Array) -> None:
        self._motion, self._upwards = motion, not motion[:2].any()

    def far_pairs(self, first: Panels, second: Panels, offsets: Array) -> Array:
        """Return the integrals over distant pairs: the derivative of the same expansion."""
        inverse = 1.0 / np.maximum(np.einsum("nmd,nmd->nm", offsets, offsets), _TINY)
        along = offsets @ self._motion
        spread, traces = spreads(first, second, offsets)
        turned = np.einsum("nmd,nd->nm", offsets, first.moments @ self._motion)
        turned += np.einsum("nmd,md->nm", offsets, second.moments @ self._motion)
        slope = along * (1.0 + inverse * (7.5 * spread * inverse - 1.5 * traces))
        slope -= 3.0 * turned * inverse
        return np.asarray(np.outer(first.areas, second.areas) * slope * inverse**1.5)

    def near_pairs(self, first: Panels, second: Panels, i: Index, j: Index) -> Array:
        """Return the integrals: closed for rectangles in one frame that move upwards."""
        closed = in_one_frame(first, second, i, j) & self._upwards
        result = np.empty(len(i))
        result[closed] = self._motion[2] * _rectangle_pairs(
            first.chosen(i[closed]), second.chosen(j[closed])
        )
        result[~closed] = self._by_points(first.chosen(i[~closed]), second.chosen(j[~closed]))
        return result

    def _by_points(self, first: Panels, second: Panels) -> Array:
        # points are taken on the smaller panel, which is to be the first
        other = first.radii > second.radii
        turned = other[:, None, None]
        smaller = Panels(np.where(turned, second.corners, first.corners))
        larger = Panels(np.where(turned, first.corners, second.corners))

        def over_panel(points: Array, corners: Array) -> Array:
            sides = seen_from(points, corners)
            in_plane = ((sides.outward @ self._motion) * sides.inverse).sum(axis=-1)
            return in_plane + (sides.normal @ self._motion) * np.sign(sides.height) * sides.angle

        return np.where(other, -1.0, 1.0) * pairs_by_points(smaller, larger, over_panel, ORDERS)


def _rectangle_pairs(first: Panels, second: Panels) -> Array:
    """Return the derivatives by the height of the second of rectangles in one frame, (n,)."""
    result = np.empty(len(first))
    for pairs, (normal, other_normal), d in by_orientation(first, second):
        if normal == other_normal == 2:
            terms = _apart(*_grid(d, 0, 1), d[0, :, 2])
            total = np.einsum("u,v,uvn->n", _TWICE, _TWICE, terms)
        elif normal == other_normal:
            terms = _aside(*_grid(d, 1 - normal, 2), d[0, :, normal])
            total = np.einsum("u,v,uvn->n", _TWICE, _TWICE, terms)
        else:
            # along the normal of one rectangle only the other extends
            shared = 3 - normal - other_normal
            a = d[:, :, shared][:, None, None]
            b, c = d[[0, 1], :, other_normal][None, :, None], d[[0, 2], :, normal][None, None, :]
            if shared == 2:
                terms = _box(a, b, c)
            else:
                terms = _aside(a, c, b) if other_normal == 2 else _aside(a, b, c)
            total = np.einsum("u,v,w,uvwn->n", _TWICE, _ONCE, _ONCE, terms)
        # the differences fall as the second rises
        result[pairs] = -total
    return result


def _grid(d: Array, u: int, v: int) -> tuple[Array, Array]:
    return d[:, :, u][:, None], d[:, :, v][None, :]


def _apart(a: Array, b: Array, c: Array) -> Array:
    """Return −∫∫∫∫ c/R³ by a and b twice each, at the distance c."""
    aa, bb, cc = a * a, b * b, c * c
    distance = np.sqrt(aa + bb + cc)
    size = np.abs(c)
    terms = size * (distance - a * _asinh(a, bb + cc) - b * _asinh(b, aa + cc))
    return np.asarray(np.sign(c) * (terms - a * b * np.arctan2(a * b, size * distance)))


def _aside(a: Array, b: Array, c: Array) -> Array:
    """Return ∫∫∫ 1/R by a twice and b once, at the distance c."""
    aa, bb, cc = a * a, b * b, c * c
    distance = np.sqrt(aa + bb + cc)
    terms = a * b * _asinh(a, bb + cc) + 0.5 * (aa - cc) * _asinh(b, aa + cc) - 0.5 * b * distance
    return np.asarray(terms - a * np.abs(c) * np.arctan2(a * b, np.abs(c) * distance))


def _box(a: Array, b: Array, c: Array) -> Array:
    """Return ∫∫∫ 1/R by a, b and c once each."""
    total = np.zeros(np.broadcast_shapes(a.shape, b.shape, c.shape))
    distance = np.sqrt(a * a + b * b + c * c)
    for u, v, w in ((a, b, c), (b, c, a), (c, a, b)):
        total += u * v * _asinh(w, u * u + v * v)
        below = np.abs(u) * distance
        total -= 0.5 * u * np.abs(u) * np.arctan2(v * w, below)
    return total


def _asinh(length: Array, square: Array) -> Array:
    return np.asarray(np.arcsinh(length / np.maximum(np.sqrt(square), _TINY)))
