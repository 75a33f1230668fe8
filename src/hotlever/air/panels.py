"""Flat panels that cover a surface, and the mirrors that copy them.

A panel is a convex quadrilateral; a triangle is one whose last two corners coincide. Lengths are
in µm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hotlever.types import Array, Index

#: Square of the distance (µm²) for that of panels in one place, which are never expanded.
COINCIDENT = 1e-12


@dataclass(frozen=True)
class Mirror:
    """Reflection of space in planes, with the sign that an image source takes.

    Attributes
    ----------
    matrix : ndarray, shape (3, 3)
    shift : ndarray, shape (3,)
        A point p goes to ``matrix @ p + shift``.
    sign : float
        +1 where the plane is one of symmetry (no flux through it), −1 where it is isothermal.
    """

    matrix: Array
    shift: Array
    sign: float

    @classmethod
    def in_plane(cls, point: ArrayLike, normal: ArrayLike, sign: float) -> Mirror:
        """Return the reflection in the plane through `point` (µm) with this normal."""
        direction = np.asarray(normal, dtype=float)
        direction = direction / np.linalg.norm(direction)
        offset = 2.0 * (direction @ np.asarray(point, dtype=float)) * direction
        return cls(np.eye(3) - 2.0 * np.outer(direction, direction), offset, sign)

    def after(self, other: Mirror) -> Mirror:
        """Return `other` followed by this one."""
        return Mirror(
            self.matrix @ other.matrix,
            self.matrix @ other.shift + self.shift,
            self.sign * other.sign,
        )


IDENTITY = Mirror(np.eye(3), np.zeros(3), 1.0)


def mirror_group(mirrors: Sequence[Mirror]) -> list[Mirror]:
    """Return all products of reflections in planes at right angles, the identity first."""
    group = [IDENTITY]
    for mirror in mirrors:
        group += [mirror.after(product) for product in group]
    return group


@dataclass(frozen=True)
class Panels:
    """Flat convex panels.

    Attributes
    ----------
    corners : ndarray, shape (n, 4, 3)
        In order around the panel (µm).
    """

    corners: Array

    def __len__(self) -> int:
        return len(self.corners)

    def chosen(self, index: NDArray[Any] | slice) -> Panels:
        """Return some of the panels, by number, mask or range; what is known of them stays."""
        some = Panels(self.corners[index])
        for name in vars(self).keys() & {"areas", "centres", "radii", "moments", "half_sizes"}:
            vars(some)[name] = vars(self)[name][index]
        if "frame" in vars(self):
            vars(some)["frame"] = tuple(each[index] for each in self.frame)
        return some

    def reflected(self, mirror: Mirror) -> Panels:
        """Return the images of the panels."""
        return Panels(self.corners @ mirror.matrix.T + mirror.shift)

    @cached_property
    def _halves(self) -> tuple[Array, Array]:
        """Corners (n, 2, 3, 3) and areas (n, 2) of the two triangles of each panel."""
        corners = self.corners[:, [[0, 1, 2], [0, 2, 3]]]
        sides = corners[:, :, 1:] - corners[:, :, :1]
        return corners, 0.5 * np.linalg.norm(np.cross(sides[:, :, 0], sides[:, :, 1]), axis=2)

    @cached_property
    def areas(self) -> Array:
        """Areas (µm²), shape (n,)."""
        return self._halves[1].sum(axis=1)

    @cached_property
    def centres(self) -> Array:
        """Centroids (µm), shape (n, 3)."""
        corners, areas = self._halves
        return np.einsum("nh,nhd->nd", areas, corners.mean(axis=2)) / self.areas[:, None]

    @cached_property
    def radii(self) -> Array:
        """Distance from the centroid to the farthest corner (µm), shape (n,)."""
        return np.linalg.norm(self.corners - self.centres[:, None], axis=2).max(axis=1)

    @cached_property
    def moments(self) -> Array:
        """Mean of the outer square of the position about the centroid (µm²), shape (n, 3, 3)."""
        corners, areas = self._halves
        at = corners - self.centres[:, None, None]
        # of a triangle: (Σ v vᵀ + (Σ v)(Σ v)ᵀ) / 12
        whole = at.sum(axis=2)
        square = np.einsum("nhkd,nhke->nhde", at, at) + np.einsum("nhd,nhe->nhde", whole, whole)
        total = np.einsum("nh,nhde->nde", areas / 12.0, square)
        return np.asarray(total / self.areas[:, None, None])

    @cached_property
    def frame(self) -> tuple[Index, Array]:
        """How rectangles that lie flat or stand upright are turned.

        Returns
        -------
        axis : ndarray of int, shape (n,)
            Of the coordinate axes turned about z by the angle, the one normal to the panel; −1 of
            a panel that is no such rectangle.
        angle : ndarray, shape (n,)
            From 0 to π/2; next to both it means the same.
        """
        sides = np.roll(self.corners, -1, axis=1) - self.corners
        tolerance = 1e-6 * self.radii
        level = np.abs(sides[:, :, 2]) < tolerance[:, None]
        upright = np.linalg.norm(sides[:, :, :2], axis=2) < tolerance[:, None]
        # the first side, or the second where the first is upright
        x, y, _ = np.where(upright[:, :1], sides[:, 1], sides[:, 0]).T
        quarters = np.floor(np.arctan2(y, x) / (np.pi / 2)).astype(np.intp)
        angle = np.arctan2(y, x) - quarters * (np.pi / 2)
        opposite = np.linalg.norm(sides[:, :2] + sides[:, 2:], axis=2).max(axis=1) < tolerance
        first, second = np.moveaxis(sides[:, :2], 1, 0)
        shorter = np.linalg.norm(sides[:, :2], axis=2).min(axis=1)
        square = np.abs(np.einsum("nd,nd->n", first, second)) < tolerance * shorter
        proper = opposite & square & (shorter > 0)
        flat = level.all(axis=1)
        standing = (level ^ upright).all(axis=1)
        axis = np.where(flat, 2, np.where(standing, 1 - quarters % 2, -1))
        return np.where(proper, axis, -1), angle

    @cached_property
    def half_sizes(self) -> Array:
        """Half of how far panels reach along the axes of their own `frame` (µm), shape (n, 3)."""
        _, angle = self.frame
        cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
        x, y, z = np.moveaxis(self.corners, 2, 0)
        turned = np.stack([cosine * x + sine * y, cosine * y - sine * x, z], axis=2)
        return np.asarray(0.5 * np.ptp(turned, axis=1))

    @cached_property
    def _by_order(self) -> dict[int, tuple[Array, Array]]:
        return {}

    def points(self, order: int) -> tuple[Array, Array]:
        """Return Gauss points (n, order², 3) and weights (n, order²) on each panel."""
        if order not in self._by_order:
            self._by_order[order] = self._gauss_points(order)
        return self._by_order[order]

    def _gauss_points(self, order: int) -> tuple[Array, Array]:
        nodes, weights = gauss_rule(order)
        s, t = np.stack(np.meshgrid(nodes, nodes, indexing="ij")).reshape(2, -1, 1) / 2 + 0.5
        a, b, c, d = np.moveaxis(self.corners, 1, 0)[:, :, None]
        # a bilinear map of the unit square, from the side a b to the side d c
        near, far = a + s * (b - a), d + s * (c - d)
        along, across = (b - a) + t * (c - d - b + a), far - near
        areas = np.linalg.norm(np.cross(along, across), axis=2)
        return near + t * across, areas * np.outer(weights, weights).ravel() / 4


@lru_cache
def gauss_rule(order: int) -> tuple[Array, Array]:
    """Return the points and weights of Gauss's rule from −1 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    return nodes, weights


def square_distances(first: Panels, second: Panels) -> Array:
    """Return the squares of the distances of all centroids from all others (µm²), (n, m)."""
    square = np.zeros((len(first), len(second)))
    for mine, others in zip(first.centres.T, second.centres.T, strict=True):
        square += np.subtract.outer(mine, others) ** 2
    return square


def spreads(first: Panels, second: Panels) -> Array:
    """Return rᵀ(M + M')r of all pairs, of their centroids' offsets r and their moments, (n, m).

    As one product of matrices, about the middle of the first: this is done for all pairs of a
    surface. Digits that are lost are those of panels near each other, which are not expanded.
    """
    middle = first.centres.mean(axis=0)
    mine, others = (_powers(panels, panels.centres - middle) for panels in (first, second))
    return np.asarray(mine[0] @ others[1].T + mine[1] @ others[0].T)


def _powers(panels: Panels, at: Array) -> tuple[Array, Array]:
    """Return what rᵀMr is made of where the moments are the panels' own, and the other's."""
    along = np.einsum("nde,ne->nd", panels.moments, at)
    own = [np.einsum("nd,nd->n", at, along)[:, None], -2.0 * along, panels.moments.reshape(-1, 9)]
    squares = (at[:, :, None] * at[:, None, :]).reshape(-1, 9)
    return np.hstack(own), np.hstack([np.ones((len(at), 1)), at, squares])


def traces(first: Panels, second: Panels) -> Array:
    """Return the sums of the traces of the moments of pairs, (n, m)."""
    mine, others = (np.trace(panels.moments, axis1=1, axis2=2) for panels in (first, second))
    return np.add.outer(mine, others)


def divided(at: Array, size: Array) -> Array:
    """Return break points between the ends of `at` whose distances follow `size`."""
    per_length = 1.0 / size
    counted = np.append(0.0, np.cumsum(np.diff(at) * (per_length[1:] + per_length[:-1]) / 2.0))
    pieces = max(1, int(np.ceil(counted[-1] - 1e-6)))
    breaks = np.interp(np.linspace(0.0, counted[-1], pieces + 1), counted, at)
    breaks[[0, -1]] = at[[0, -1]]
    return breaks
