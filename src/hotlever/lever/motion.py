"""What changes at the quadrature points of a lever when one of its dimensions does.

The mesh moves with the drawing (`hotlever.probe.moving`), every quadrature point with its element.
At a point that moves so, the values of a field stay, its slopes are strained, and the weight of
the point grows with the element. That is all that the equations need for exact derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from hotlever.lever.films import PlacedFilm, thickness_at
from hotlever.lever.full_space import FullSpace
from hotlever.lever.rim import RimFilm
from hotlever.lever.space import Fields, Fluxes, Tangent
from hotlever.probe.layout import BorderTaper, Layout, Taper
from hotlever.probe.moving import Movement
from hotlever.types import Array, Index

#: A small change of a dimension (µm), by which the thickness of a cone is differenced.
_SMALL_UM = 1e-4


@dataclass(frozen=True)
class Motion:
    """Rates at the quadrature points, per unit of a dimension.

    Attributes
    ----------
    strain : ndarray, shape (dimension, dimension, points)
        Derivative of the velocity's component i (first axis) along j.
    swelling : ndarray, shape (points, 1)
        Of the weights, relative.
    thickening_um : tuple of ndarray, shape (k, 1)
        Of each `hotlever.lever.films.PlacedFilm` (µm).
    plate_um : ndarray, shape (points, 1)
        Of the plate as the air sees it (µm).
    distances : tuple of ndarray, shape (borders, k, 1)
        Of those of each film.
    tip : ndarray, shape (nodes,)
        Of the weights that give the rise of the tip temperature.
    rim : tuple of ndarray, shape (k, 1)
        Of the surface at the points of each `hotlever.lever.rim.RimFilm`, over their weights.
    """

    strain: Array
    swelling: Array
    thickening_um: tuple[Array, ...]
    plate_um: Array
    distances: tuple[Array, ...]
    tip: Array
    rim: tuple[Array, ...]

    def strained(self, gradient: Array) -> Array:
        """Return how slopes (dimension, points, n) change, the values being the same."""
        return -self._contracted(self.strain.swapaxes(0, 1), gradient)

    def pulled(self, flux: Array) -> Array:
        """Return how a flux (dimension, points, n) changes what it is tested with.

        Its points grow, and the slopes of the test functions are strained.
        """
        return self.swelling * flux - self._contracted(self.strain, flux)

    def _contracted(self, strain: Array, vectors: Array) -> Array:
        return (strain[..., None] * vectors[None]).sum(axis=1)

    def of_fluxes(self, fields: Fields, fluxes: Fluxes, tangent: Tangent) -> Fluxes:
        """Return how fluxes change with the dimension, conductivities (points, n) being the same.

        The tangent is that of the fluxes.
        """
        slopes = self.strained(fields.grad_T), self.strained(fields.grad_V)
        strained = tangent.fluxes(Fields(np.zeros_like(fields.T), *slopes))
        return Fluxes(
            self.swelling * fluxes.heat_source + strained.heat_source,
            self.pulled(fluxes.heat) + strained.heat,
            self.pulled(fluxes.charge) + strained.charge,
        )


def motion_of(space: FullSpace, movement: Movement) -> Motion:
    """Return what changes at the points of a flat lever as it moves with a dimension."""
    elements, mesh = space.elements, space.mesh
    corners = movement.velocity[:, mesh.elements.t]
    sides = corners[:, 1:] - corners[:, :1]
    # the velocity is linear in each triangle
    strain = np.einsum("irm,mra->iam", sides, elements.inverse)
    start = corners[:, 0, :, None]
    velocity = (start + np.einsum("irm,rq->imq", sides, elements.basis.X)).reshape(2, -1)
    strain = np.repeat(strain, elements.per_element, axis=2)

    layout = mesh.layout
    body = _thickening(layout, movement, elements.positions, velocity)
    region = np.repeat(mesh.region, elements.per_element)
    (element,), _, slopes = elements.at_points(np.array([layout.tip]))
    reference = elements.on_reference(np.array(layout.tip), element)
    at_tip = corners[:, 0, element] + sides[:, :, element] @ reference
    return Motion(
        strain,
        np.asarray(strain[0, 0] + strain[1, 1])[:, None],
        tuple(_of_film(film, movement, body, region) for film in space.films),
        body + movement.films,
        tuple(_from_borders(space, film, movement, velocity, region) for film in space.films),
        tip=(movement.tip - at_tip) @ slopes[:, 0],
        rim=_of_rim(space, movement),
    )


def _of_film(film: PlacedFilm | RimFilm, movement: Movement, body: Array, region: Index) -> Array:
    """Return how a film thickens at its points, (k, 1), from the rate of the body at all points."""
    if not film.level:
        return body[film.points]
    return movement.thickness_of_films(film.level)[region[film.points], None]


def _of_rim(space: FullSpace, movement: Movement) -> tuple[Array, ...]:
    """Return how surface at the points of a rim grows, over their weights (as its heights)."""
    longer, velocity = _along_rim(space, movement)
    points = space.rim.facet_points
    body = _thickening(space.mesh.layout, movement, points.positions, velocity)
    region = space.mesh.region[points.elements]
    return tuple(
        longer[film.points, None] * film.height_um + _of_film(film, movement, body, region)
        for film in space.rim.films
    )


def _along_rim(space: FullSpace, movement: Movement) -> tuple[Array, Array]:
    """Return how edges of the rim grow, relative, and the velocity, at its points."""
    mesh, points = space.mesh.elements, space.rim.facet_points
    vertices = mesh.facets[:, points.facets]
    start, end = mesh.p[:, vertices].swapaxes(0, 1)
    moved, rate = movement.velocity[:, vertices].swapaxes(0, 1)
    side, stretch = end - start, rate - moved
    square = (side**2).sum(axis=0)
    share = ((points.positions - start) * side).sum(axis=0) / square
    return (side * stretch).sum(axis=0) / square, moved + share * stretch


def _thickening(layout: Layout, movement: Movement, at: Array, velocity: Array) -> Array:
    """Return how the body thickens at points (2, points) that move, (points, 1)."""

    def thickness(way: float) -> float | Array:
        there = tuple((layout.tip + way * movement.tip).tolist())
        thick = layout.thickness_um + way * movement.thickness
        moved = replace(layout, tip=there, thickness_um=thick, cone=movement.cone(way))
        return thickness_at(moved, at + way * velocity)

    thicker = (thickness(_SMALL_UM) - thickness(-_SMALL_UM)) / (2 * _SMALL_UM)
    return np.broadcast_to(thicker, (at.shape[1], 1))


def _from_borders(
    space: FullSpace, film: PlacedFilm, movement: Movement, velocity: Array, region: Index
) -> Array:
    """Return how the distances of a film's points from the borders of their regions change."""
    changes = np.zeros_like(film.distances)
    at, moved = space.elements.positions[:, film.points], velocity[:, film.points]
    step = movement.step
    ends = ((movement.before, -step), (movement.after, step))
    for number in np.unique(region[film.points]) if film.distances.size else ():
        here = region[film.points] == number
        distances = film.distances[:, here, 0]
        low, high = (
            _as_ordered(layout.regions[number].taper, at[:, here] + way * moved[:, here], distances)
            for layout, way in ends
        )
        changes[: len(low), here, 0] = movement.rate(low, high)
    return changes


def _as_ordered(taper: Taper | BorderTaper | None, points: Array, before: Array) -> Array:
    """Return the distances of points from borders, each border where it was before."""
    # a film with distances lies on tapered regions only
    assert taper is not None
    distances = taper.distances(points)
    apart = np.abs(before[:, None] - distances).sum(axis=2)
    return np.asarray(distances[linear_sum_assignment(apart)[1]])
