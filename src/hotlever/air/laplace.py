"""The kernel 1/R of still air, and its change by a motion: integrals over flat panels.

`potential` integrates over one polygon (Wilton et al., IEEE Trans. Antennas Propag. 32, 276
(1984), doi:10.1109/TAP.1984.1143304); `rectangle_pairs` over two axis-parallel rectangles (the
integrals of Ruehli and Brennan, IEEE Trans. Microw. Theory Tech. 21, 76 (1973),
doi:10.1109/TMTT.1973.1127927). Pairs that are far are expanded about their centroids. Logarithms
are written as inverse hyperbolic sines: the two differ by terms that cancel between the limits.

And how these integrals change where the second panel moves: so the single layer of a lever changes
with the gap to a surface, whose images all move along its normal.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hotlever.air.panels import COINCIDENT, Panels, spreads, traces
from hotlever.air.single_layer import pairs_by_points, pairs_by_points_of_both, separations
from hotlever.types import Array, Index
from hotlever.work import one_blas_thread

#: Stands for zero below a fraction whose factor vanishes there.
_TINY = 1e-150
#: Signs of the limits: where both panels extend, and where one does.
_TWICE, _ONCE = np.array([1.0, -1.0, -1.0, 1.0]), np.array([1.0, -1.0])


class Laplace:
    """The kernel 1/R; see `hotlever.air.single_layer.Kernel`."""

    shape: tuple[int, ...] = ()
    dtype, far = np.dtype(float), 3.0
    #: Pairs so far apart, in sums of their radii, need no more than two points a side on both.
    apart = 2.5
    #: For nearer ones without a closed form, see `hotlever.air.single_layer.pairs_by_points`.
    orders = ((8, 0.5), (6, 1.0), (4, 1.5), (3, np.inf))

    def far_pairs(self, first: Panels, second: Panels, square: Array) -> Array:
        """Return ∫∫ 1/R over distant pairs, to second order in size over distance."""
        inverse = 1.0 / np.maximum(square, COINCIDENT)
        correction = 3.0 * spreads(first, second) * inverse - traces(first, second)
        expanded: Array = np.outer(first.areas, second.areas) * np.sqrt(inverse)
        expanded *= 1.0 + 0.5 * correction * inverse
        return expanded

    def near_pairs(self, first: Panels, second: Panels, i: Index, j: Index) -> Array:
        """Return ∫∫ 1/R over pairs: closed for rectangles in one frame, else by points."""
        apart = separations(first, second, i, j) >= self.apart
        closed = ~apart & _in_one_frame(first, second, i, j)
        others = ~(apart | closed)
        result = np.empty(len(i))
        result[apart] = pairs_by_points_of_both(
            first, second, i[apart], j[apart], lambda offsets: 1.0 / _length(offsets), 2
        )
        result[closed] = rectangle_pairs(first.chosen(i[closed]), second.chosen(j[closed]))
        result[others] = pairs_by_points(
            first.chosen(i[others]), second.chosen(j[others]), potential, self.orders
        )
        return result


class Approach:
    """The kernel 1/R and m·∇(1/R), its derivative by a motion m of the second point, side by side.

    See `hotlever.air.single_layer.Kernel`. The two are made of the same distances, logarithms and
    angles, so that the second takes a third of what it would take alone.

    Parameters
    ----------
    motion : ndarray, shape (3,)
    """

    shape: tuple[int, ...] = (2,)
    dtype, far = Laplace.dtype, Laplace.far

    def __init__(self, motion: Array) -> None:
        self._motion, self._upwards = motion, not motion[:2].any()

    def far_pairs(self, first: Panels, second: Panels, square: Array) -> Array:
        """Return the integrals over distant pairs, (2, n, m): an expansion and its derivative."""
        inverse, middle = 1.0 / np.maximum(square, COINCIDENT), first.centres.mean(axis=0)
        at, others_at = first.centres - middle, second.centres - middle
        along = np.subtract.outer(at @ self._motion, others_at @ self._motion)
        # the offsets times the moments of both along the motion
        mine, others = (panels.moments @ self._motion for panels in (first, second))
        turned = at @ others.T - mine @ others_at.T
        turned += np.subtract.outer((at * mine).sum(axis=1), (others_at * others).sum(axis=1))
        spread, both = 1.5 * spreads(first, second) * inverse, 0.5 * traces(first, second)
        expanded = np.empty((2, *square.shape))
        expanded[0] = 1.0 + inverse * (spread - both)
        expanded[1] = along * (inverse + inverse**2 * (5.0 * spread - 3.0 * both))
        expanded[1] -= 3.0 * turned * inverse**2
        expanded *= np.outer(first.areas, second.areas) * np.sqrt(inverse)
        return expanded

    def near_pairs(self, first: Panels, second: Panels, i: Index, j: Index) -> Array:
        """Return the integrals, (2, n): closed for rectangles in one frame that move upwards."""

        def over_panel(points: Array, corners: Array) -> Array:
            sides = _seen_from(points, corners)
            in_plane = ((sides.outward @ self._motion) * sides.inverse).sum(axis=-1)
            facing = (sides.normal @ self._motion) * np.sign(sides.height)
            return np.stack([sides.potential, in_plane + facing * sides.angle])

        def between_points(offsets: Array) -> Array:
            inverse = 1.0 / _length(offsets)
            along = np.tensordot(self._motion, offsets, axes=1)
            return np.stack([inverse, along * inverse**3])

        apart = separations(first, second, i, j) >= Laplace.apart
        closed = ~apart & _in_one_frame(first, second, i, j) & self._upwards
        others = ~(apart | closed)
        result = np.empty((2, len(i)))
        result[:, apart] = pairs_by_points_of_both(
            first, second, i[apart], j[apart], between_points, 2
        )
        rising = _rectangles(first.chosen(i[closed]), second.chosen(j[closed]), rising=True)
        result[:, closed] = rising * np.array([[1.0], [self._motion[2]]])
        result[:, others] = pairs_by_points(
            first.chosen(i[others]),
            second.chosen(j[others]),
            over_panel,
            Laplace.orders,
            swapped=(1.0, -1.0),
        )
        return result


def _length(offsets: Array) -> Array:
    """Return the lengths of vectors (3, ...)."""
    return np.asarray(np.sqrt(offsets[0] ** 2 + offsets[1] ** 2 + offsets[2] ** 2))


def _in_one_frame(first: Panels, second: Panels, i: Index, j: Index) -> NDArray[np.bool_]:
    """Return which pairs of panels are rectangles turned by the same angle, see `frame`."""
    (axis, angle), (other_axis, other_angle) = first.frame, second.frame
    between = np.abs(angle[i] - other_angle[j])
    # rectangles that are turned by less against each other are parallel
    parallel = np.minimum(between, np.pi / 2 - between) < 2e-6
    return np.asarray((axis[i] >= 0) & (other_axis[j] >= 0) & parallel)


def potential(points: Array, corners: Array) -> Array:
    """Return ``∫ 1/|p − y| dA(y)`` over polygons.

    Parameters
    ----------
    points : ndarray, shape (..., 3)
        Where (µm).
    corners : ndarray, shape (..., k, 3)
        Corners of the flat convex polygon that belongs to each point; leading dimensions are
        broadcast.

    Returns
    -------
    ndarray, shape (...)
        µm.
    """
    return _seen_from(points, corners).potential


class _Sides(NamedTuple):
    """A polygon as seen from points, shapes (..., k) and (..., k, 3) for its k sides."""

    outward: Array  #: unit vectors in its plane, normal to the sides
    across: Array  #: distances of the sides from the foot of the point
    inverse: Array  #: ∫ 1/R along the sides
    normal: Array  #: of the plane, (..., 3)
    height: Array  #: of the point above the plane (µm), (...)
    angle: Array  #: solid angle, (...)

    @property
    def potential(self) -> Array:
        """∫ 1/R over the polygon (µm), (...)."""
        around = (self.across * self.inverse).sum(axis=-1)
        return np.asarray(around - np.abs(self.height) * self.angle)


def _seen_from(points: Array, corners: Array) -> _Sides:
    """Return what the integrals over polygons are made of; see `potential`."""
    sides = np.roll(corners, -1, axis=-2) - corners
    lengths = np.linalg.norm(sides, axis=-1)
    along = sides / np.maximum(lengths, _TINY)[..., None]
    area_vector = np.cross(
        corners[..., 2, :] - corners[..., 0, :], corners[..., -1, :] - corners[..., 1, :]
    )
    normal = area_vector / np.linalg.norm(area_vector, axis=-1, keepdims=True)
    outward = np.cross(along, normal[..., None, :])
    # from the point to every corner; there are many points and few polygons
    height = _dot(points, normal) - _dot(corners[..., 0, :], normal)
    across = _dot(corners, outward) - _dot(points[..., None, :], outward)
    x, y, z = (corners[..., axis] - points[..., None, axis] for axis in range(3))
    square = x**2 + y**2 + z**2
    distance = np.sqrt(square)
    both = distance + np.roll(distance, -1, axis=-1)
    # ∫ 1/R along an edge is 2 artanh(length / both)
    # at a double corner of a triangle both are nothing
    ratio = np.maximum(both + lengths, _TINY) / np.maximum(both - lengths, _TINY * both + _TINY)
    angle = _solid_angle(corners, np.abs(height), square, distance)
    return _Sides(outward, across, np.log(ratio), normal, height, angle)


def _dot(first: Array, second: Array) -> Array:
    """Return products of vectors along the last axis, the others broadcast."""
    x, y, z = (first[..., axis] * second[..., axis] for axis in range(3))
    return np.asarray(x + y + z)


def _solid_angle(corners: Array, height: Array, square: Array, distance: Array) -> Array:
    """Return the solid angle of a convex polygon, of how far its plane and corners are.

    By triangles (A. van Oosterom and J. Strackee, IEEE Trans. Biomed. Eng. 30, 125 (1983)). What a
    triangle spans with the point is its area times the height, and the product of the ways to two
    corners follows from how far these are apart.
    """
    between = corners[..., :, None, :] - corners[..., None, :, :]
    apart = _dot(between, between)

    def product(k: int, m: int) -> Array:
        return np.asarray(square[..., k] + square[..., m] - apart[..., k, m])

    angle = np.zeros(height.shape)
    for k in range(1, corners.shape[-2] - 1):
        area = np.linalg.norm(np.cross(between[..., k, 0, :], between[..., k + 1, 0, :]), axis=-1)
        a, b, c = (distance[..., corner] for corner in (0, k, k + 1))
        rest = product(0, k) * c + product(0, k + 1) * b + product(k, k + 1) * a
        angle += 2.0 * np.arctan2(area * height, a * b * c + 0.5 * rest)
    return angle


def rectangle_pairs(first: Panels, second: Panels) -> Array:
    """Return ∫∫ 1/R over pairs of rectangles whose sides are parallel to the same three axes.

    Parameters
    ----------
    first, second : Panels, n each
        The pairs; by their `frame` both are rectangles turned by the same angle.

    Returns
    -------
    ndarray, shape (n,)
        µm³.
    """
    return np.asarray(_rectangles(first, second, rising=False)[0])


def _rectangles(first: Panels, second: Panels, *, rising: bool) -> Array:
    """Return what `rectangle_pairs` does, (1, n), or it and its change as the second rises."""
    result = np.empty((1 + rising, len(first)))
    for pairs, (normal, other_normal), d in _by_orientation(first, second):
        if normal == other_normal:
            u, v = (axis for axis in range(3) if axis != normal)
            by = (u, v, normal).index(2) if rising else None
            result[:, pairs] = _parallel(d[:, u], d[:, v], d[0, normal], by)
        else:
            shared = 3 - normal - other_normal
            by = (shared, other_normal, normal).index(2) if rising else None
            # along the normal of one rectangle only the other extends
            sides = d[:, shared], d[[0, 1], other_normal], d[[0, 2], normal]
            result[:, pairs] = _perpendicular(*sides, by)
    # the differences fall as the second rises
    result[1:] *= -1.0
    return result


def _by_orientation(
    first: Panels, second: Panels
) -> Iterator[tuple[NDArray[np.bool_], tuple[int, int], Array]]:
    """Give pairs of rectangles in one frame by the axes normal to both.

    With the differences of their coordinates, (4, 3, pairs): high − low, low − low, high − high,
    low − high.
    """
    (axis, angle), (other_axis, other_angle) = first.frame, second.frame
    # the same axes at angles of next to 0 and π/2
    swapped = np.abs(angle - other_angle) > np.pi / 4
    other_axis = np.where(swapped & (other_axis < 2), 1 - other_axis, other_axis)
    half, other_half = first.half_sizes.T, second.half_sizes.T
    other_half = np.where(swapped, other_half[[1, 0, 2]], other_half)
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y, z = (first.centres - second.centres).T
    between = np.stack([cosine * x + sine * y, cosine * y - sine * x, z])
    both, less = half + other_half, half - other_half
    differences = np.stack([between + both, between - less, between + less, between - both])
    for normal in range(3):
        for other_normal in range(3):
            pairs = (axis == normal) & (other_axis == other_normal)
            if pairs.any():
                yield pairs, (normal, other_normal), differences[..., pairs]


def _parallel(u: Array, v: Array, w: Array, by: int | None) -> Array:
    """Return ∫∫ 1/R over parallel rectangles: differences (4, n) along both sides, distance.

    And its derivative by the number of one of these; the first is not asked for.
    """
    a, b, c = u[:, None], v[None, :], np.abs(w)
    aa, bb, cc = a * a, b * b, c * c
    distance = np.sqrt(aa + bb + cc)
    of_a, of_b = _asinh(a, bb + cc), _asinh(b, aa + cc)
    angle = np.arctan2(a * b, c * distance)
    terms = 0.5 * (bb - cc) * a * of_a
    terms += 0.5 * (aa - cc) * b * of_b
    terms -= (aa + bb - 2.0 * cc) * distance / 6.0
    terms -= a * b * c * angle
    both = [terms]
    if by == 1:
        both.append(a * b * of_a + 0.5 * (aa - cc) * of_b - 0.5 * b * distance - a * c * angle)
    elif by == 2:
        both.append(np.sign(w) * (c * (distance - a * of_a - b * of_b) - a * b * angle))
    return np.stack([np.einsum("u,v,uvn->n", _TWICE, _TWICE, each) for each in both])


def _perpendicular(u: Array, v: Array, w: Array, by: int | None) -> Array:
    """Return ∫∫ 1/R over rectangles at right angles.

    Differences along the side that both share (4, n), and (2, n) along the other side of the
    first and of the second rectangle. And its derivative by the number of one of these.
    """
    a, b, c = u[:, None, None], v[None, :, None], w[None, None, :]
    aa, bb, cc = a * a, b * b, c * c
    distance = np.sqrt(aa + bb + cc)
    of_a, of_b, of_c = _asinh(a, bb + cc), _asinh(b, aa + cc), _asinh(c, aa + bb)
    angle_a, angle_b, angle_c = (
        np.arctan(product / np.where(np.abs(below) < _TINY, _TINY, below))
        for product, below in ((b * c, a * distance), (a * c, b * distance), (a * b, c * distance))
    )
    terms = (aa / 2 - cc / 6) * c * of_b
    terms += (aa / 2 - bb / 6) * b * of_c
    terms += a * b * c * of_a
    terms -= b * c * distance / 3.0
    terms -= a * (aa / 6 * angle_a + bb / 2 * angle_b + cc / 2 * angle_c)
    both = [terms]
    if by == 0:
        angles = aa * angle_a + bb * angle_b + cc * angle_c
        both.append(a * b * of_c + b * c * of_a + c * a * of_b - 0.5 * angles)
    elif by == 1:
        both.append(a * c * of_a + 0.5 * (aa - bb) * of_c - 0.5 * c * distance - a * b * angle_b)
    elif by == 2:
        both.append(a * b * of_a + 0.5 * (aa - cc) * of_b - 0.5 * b * distance - a * c * angle_c)
    return np.stack([np.einsum("u,v,w,uvwn->n", _TWICE, _ONCE, _ONCE, each) for each in both])


def _asinh(length: Array, square: Array) -> Array:
    return np.asarray(np.arcsinh(length / np.maximum(np.sqrt(square), _TINY)))


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
    rows = 128
    for start in range(0, len(points), rows):
        some = points[start : start + rows]
        offsets = some[:, None] - panels.centres
        square = np.einsum("nmd,nmd->nm", offsets, offsets)
        near = square < (Laplace.far * panels.radii) ** 2
        inverse = 1.0 / np.sqrt(np.where(near, np.inf, square))
        spread = np.einsum("nmd,mde,nme->nm", offsets, panels.moments, offsets, optimize=True)
        integrals = inverse + 0.5 * inverse**3 * (3.0 * spread * inverse**2 - traces)
        integrals *= panels.areas
        i, j = np.nonzero(near)
        integrals[i, j] = potential(some[i], panels.corners[j])
        result[start : start + len(some)] = integrals @ density
    return result / (4.0 * np.pi)
