"""The rim of a lever: the surface at which its mesh ends, where heat is radiated.

Of a flat lever these are the edges of its outline, as high as each film that ends there; its faces
are where its quadrature points are. Of a solid the rim is all of the surface. Terminals are not
part of it. Points under a tip in contact, where heat enters it, are of the same kind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from hotlever.lever.elements import FacetPoints, FiniteElements
from hotlever.lever.films import at_some, thickness_at
from hotlever.lever.linear_map import LinearMap
from hotlever.probe.layout import Layout
from hotlever.probe.mesh import ProbeMesh
from hotlever.types import Array, Index

#: Rings of points in the circle under a cone, and points in a ring.
_RINGS, _AROUND = 4, 12


@dataclass(frozen=True)
class RimFilm:
    """The points of a rim at which a film ends, or the body of the lever.

    Attributes
    ----------
    material : str
    points : ndarray of int, shape (k,)
    height_um : float or ndarray, shape (k, 1)
        Of the edge; 1 of a solid, whose points stand for areas.
    level : int
        How many films are below; 0 of the body.
    """

    material: str
    points: Index
    height_um: float | Array
    level: int


@dataclass(frozen=True)
class Rim:
    """Quadrature points on the surface at which a mesh ends; see the module's text.

    Attributes
    ----------
    temperature : LinearMap
        Gives the values.
    weights : ndarray, shape (points, 1)
        µm, or of a solid µm².
    films : tuple of RimFilm
    end_tests : dict of str to ndarray, shape (points,)
        The function that is one at each leg end.
    places : FacetPoints
    """

    temperature: LinearMap
    weights: Array
    films: tuple[RimFilm, ...]
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
            _films(mesh.layout, mesh.region[points.elements], points.positions),
            tests,
            points,
        )

    @classmethod
    def under_a_cone(cls, layout: Layout, elements: FiniteElements, selection: csr_matrix) -> Rim:
        """Return the circle on which a layout's tip stands; weights are shares of its area."""
        cone = layout.cone
        assert cone is not None
        nodes, weights = np.polynomial.legendre.leggauss(_RINGS)
        angle = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
        # Gauss's points in the square of the radius, which the area goes with
        radius = cone.base_radius_um * np.sqrt((1.0 + nodes) / 2.0)
        at = np.multiply.outer(radius, [np.cos(angle), np.sin(angle)]).swapaxes(1, 2)
        flat = at.reshape(-1, 2) + layout.tip
        bottom = np.full((len(flat), len(elements.positions) - 2), -layout.thickness_um / 2.0)
        positions = np.hstack([flat, bottom])
        element, shares, _ = elements.at_points(positions)
        share = np.repeat(weights / (2.0 * _AROUND), _AROUND)
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


def _films(layout: Layout, region: Index, positions: Array) -> tuple[RimFilm, ...]:
    """Return what ends at points, whose regions these are."""
    # points on a solid's surface have an area themselves
    flat = len(positions) == 2
    body = thickness_at(layout, positions) if flat else 1.0
    films = []
    stacks = [tuple(enumerate(each.stack)) for each in layout.regions]
    for level, film in dict.fromkeys(pair for stack in stacks for pair in stack):
        numbers = [number for number, stack in enumerate(stacks) if (level, film) in stack]
        points = np.flatnonzero(np.isin(region, numbers))
        height = at_some(body, points) if film.thickness_um is None else film.thickness_um
        films.append(RimFilm(film.material, points, height, level))
    return tuple(films)
