"""What lies on one another at the points of a mesh, how thick, and how doped; and its rim.

The rim is the surface at which the mesh ends, where heat is radiated. Of a flat lever these are the
edges of its outline, as high as each film that ends there; its faces are where its quadrature
points are. Of a solid the rim is all of the surface. Terminals are not part of it. Points under a
tip in contact, where heat enters it, are of the same kind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from hotlever.lever.elements import FacetPoints, FiniteElements, LinearMap
from hotlever.probe.layout import Film, Layout
from hotlever.probe.mesh import ProbeMesh
from hotlever.types import Array, Index


@dataclass(frozen=True)
class PlacedFilm:
    """The points at which a film lies, or the body of the lever; of a rim, at which it ends.

    Attributes
    ----------
    material : str
    points : ndarray of int, shape (k,)
    thickness_um : float or ndarray, shape (k, 1)
    counted_um : float or ndarray, shape (k, 1)
        The thickness that makes a sheet conductance, and the height of an edge: 1 where the
        elements have it themselves.
    level : int
        How many films are below; 0 of the body.
    dopant_from : str or None
        The material from which dopant diffuses into this one.
    faces : float or ndarray, shape (k, 1)
        How many of its faces are on the outside: of a stack the lowest film has one, the uppermost
        the other; none in a solid, whose faces are its rim.
    distances : ndarray, shape (borders, k, 1)
        From the borders of each point's region with that material (µm); 1e6 where it has fewer
        than others. No borders where the doping is even.
    """

    material: str
    points: Index
    thickness_um: float | Array
    counted_um: float | Array
    level: int
    dopant_from: str | None
    faces: float | Array
    distances: Array

    def among(self, points: Index) -> PlacedFilm:
        """Return the film at some of the quadrature points, by their number there."""
        mask = np.isin(self.points, points)
        return replace(
            self,
            points=np.searchsorted(points, self.points[mask]),
            thickness_um=at_some(self.thickness_um, mask),
            counted_um=at_some(self.counted_um, mask),
            faces=at_some(self.faces, mask),
            distances=self.distances[:, mask],
        )


def at_some(values: float | Array, points: Any) -> float | Array:
    """Return values at some points, or the value that all have."""
    return values if isinstance(values, float) else values[points]


def thickness_at(layout: Layout, positions: Array) -> float | Array:
    """Return the body's thickness (µm); where there is a cone, at positions (2, points)."""
    if layout.cone is None:
        return float(layout.thickness_um)
    distance = np.linalg.norm(positions - np.reshape(layout.tip, (2, 1)), axis=0)
    return np.asarray(layout.thickness_um + layout.cone.thickening_um(distance))[:, None]


def placed_films(
    layout: Layout, region: Index, positions: Array
) -> tuple[tuple[PlacedFilm, ...], float | Array, float | Array]:
    """Return what lies at points inside a mesh or on its rim, whose regions these are.

    Parameters
    ----------
    layout : Layout
    region : ndarray of int, shape (points,)
    positions : ndarray, shape (dimension, points)
        µm. Elements of a solid have their thickness themselves, facets of it their height.

    Returns
    -------
    films : tuple of PlacedFilm
    thickness_um, plate_um : float or ndarray, shape (points, 1)
        Of all that lies on one another, and of the plate as the air sees it.
    """
    flat = len(positions) == 2
    body = thickness_at(layout, positions[:2])
    levels = np.array([len(of_layout.stack) for of_layout in layout.regions])[region]
    where: dict[tuple[int, Film, str | None], list[int]] = {}
    for number, of_layout in enumerate(layout.regions):
        for level, film in enumerate(of_layout.stack):
            tapered = not level and of_layout.taper is not None
            source = of_layout.dopant_from if tapered else None
            where.setdefault((level, film, source), []).append(number)
    films = []
    for (level, film, source), numbers in where.items():
        points = np.flatnonzero(np.isin(region, numbers))
        thickness = at_some(body, points) if film.thickness_um is None else film.thickness_um
        even = np.empty((0, points.size, 1))
        uppermost = (levels[points] == level + 1)[:, None]
        films.append(
            PlacedFilm(
                film.material,
                points,
                thickness,
                counted_um=thickness if flat else 1.0,
                level=level,
                dopant_from=source,
                faces=float(level == 0) + uppermost if flat else 0.0,
                distances=even
                if source is None
                else _from_borders(layout, region[points], positions[:2, points]),
            )
        )
    if len(films) == 1 or not any(film.level for film in films):
        alone = body if flat else 1.0
        return tuple(films), alone, alone
    total = np.zeros((region.size, 1))
    for placed in films:
        total[placed.points] += placed.counted_um
    return tuple(films), total, body + (layout.thickest_um - layout.thickness_um)


def _from_borders(layout: Layout, region: Index, positions: Array) -> Array:
    """Return how far points in low-doped regions are from the borders of each one's region."""
    tapers = [part.taper for part in layout.regions]
    by_region = {
        number: taper.distances(positions[:, region == number])
        for number in np.unique(region)
        if (taper := tapers[number]) is not None
    }
    # as good as infinitely far from a border (µm)
    distances = np.full((max(map(len, by_region.values()), default=0), region.size, 1), 1e6)
    for number, away in by_region.items():
        distances[: len(away), region == number, 0] = away
    return distances


@dataclass(frozen=True)
class Rim:
    """Points on the surface at which a mesh ends; see the module's text.

    Attributes
    ----------
    temperature : LinearMap
        Gives the values.
    weights : ndarray, shape (points, 1)
        µm, or of a solid µm².
    films : tuple of PlacedFilm
    end_tests : dict of str to ndarray, shape (points,)
        The function that is one at each leg end.
    facet_points : FacetPoints
    """

    temperature: LinearMap
    weights: Array
    films: tuple[PlacedFilm, ...]
    end_tests: Mapping[str, Array]
    facet_points: FacetPoints

    @classmethod
    def of(
        cls,
        mesh: ProbeMesh,
        elements: FiniteElements,
        selection: csr_matrix,
        end_nodes: Mapping[str, Index],
    ) -> Rim:
        """Return the rim of a mesh.

        Parameters
        ----------
        mesh : ProbeMesh
            Of triangles or tetrahedra.
        elements : FiniteElements
        selection : csr_matrix
            From unknowns to nodal temperatures.
        end_nodes : mapping of str to ndarray of int
            Those of each terminal.
        """
        ends = np.concatenate(list(mesh.terminal_facets.values()))
        facets = np.setdiff1d(mesh.elements.boundary_facets(), ends)
        points = elements.on_facets(facets)
        nodes = elements.dofs[points.elements]
        tests = {
            name: np.where(np.isin(nodes, of_end), points.shares, 0.0).sum(axis=1)
            for name, of_end in end_nodes.items()
        }
        return cls(
            _values(points, elements, selection),
            points.weights[:, None],
            placed_films(mesh.layout, mesh.region[points.elements], points.positions)[0],
            tests,
            points,
        )

    @classmethod
    def under_a_cone(cls, layout: Layout, elements: FiniteElements, selection: csr_matrix) -> Rim:
        """Return the circle on which a layout's tip stands; weights are shares of its area."""
        cone = layout.cone
        assert cone is not None
        # four rings in the circle, with so many points in each
        nodes, weights = np.polynomial.legendre.leggauss(4)
        around = 12
        angle = 2.0 * np.pi * np.arange(around) / around
        # Gauss's points in the square of the radius, which the area goes with
        radius = cone.base_radius_um * np.sqrt((1.0 + nodes) / 2.0)
        at = np.multiply.outer(radius, [np.cos(angle), np.sin(angle)]).swapaxes(1, 2)
        flat = at.reshape(-1, 2) + layout.tip
        bottom = np.full((len(flat), len(elements.positions) - 2), -layout.thickness_um / 2.0)
        positions = np.hstack([flat, bottom])
        element, shares, _ = elements.at_points(positions)
        share = np.repeat(weights / (2.0 * around), around)
        facet_points = FacetPoints(np.empty(0, dtype=np.intp), element, shares, share, positions.T)
        return cls(_values(facet_points, elements, selection), share[:, None], (), {}, facet_points)

    def reduced(self, modes: Array) -> Rim:
        """Return the same for states that are combinations of modes (modes, size + 1)."""
        seen = np.asarray(self.temperature.matrix @ modes.T)
        return replace(self, temperature=LinearMap(seen, 1, slice(len(modes))))

    @classmethod
    def nothing(cls, size: int) -> Rim:
        """Return that of a lever of so many free values whose rim radiates nothing."""
        none, point = np.empty(0, dtype=np.intp), np.empty((0, 1))
        facet_points = FacetPoints(none, none, point, point[:, 0], point.T)
        return cls(LinearMap(csr_matrix((0, size + 1)), 1), point, (), {}, facet_points)

    def rise(self, x: Array) -> Array:
        """Return the rise of the temperature (K) at the points, (points, ...)."""
        (rise,) = self.temperature.at_points(x)
        return np.asarray(rise)

    def add_heat(self, weak: Array, heat: Array) -> None:
        """Add heat that leaves at the points (mW), (points, ...), to the balances."""
        if len(heat):
            weak[self.temperature.columns] += self.temperature.tested(heat[None])

    @property
    def end_test(self) -> Array:
        """The function that is one at all leg ends."""
        return np.asarray(sum(self.end_tests.values(), start=np.zeros(len(self.weights))))


def _values(points: FacetPoints, elements: FiniteElements, selection: csr_matrix) -> LinearMap:
    """Return the map from unknowns to the temperature at some points."""
    nodes = elements.dofs[points.elements]
    rows = np.broadcast_to(np.arange(len(nodes))[:, None], nodes.shape)
    shape = (len(nodes), elements.size)
    sampling = csr_matrix((points.shares.ravel(), (rows.ravel(), nodes.ravel())), shape=shape)
    return LinearMap(sampling @ selection, 1)
