"""What lies on one another at the quadrature points of a mesh, how thick, and how doped."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hotlever.lever.elements import FiniteElements
from hotlever.probe.layout import Film, Layout
from hotlever.probe.mesh import ProbeMesh
from hotlever.probe.solid import SolidMesh
from hotlever.types import Array, Index

#: As good as infinitely far from a border (µm).
FAR = 1e6


@dataclass(frozen=True)
class PlacedFilm:
    """The quadrature points at which a film lies, or the body of the lever.

    Attributes
    ----------
    material : str
    points : ndarray of int, shape (k,)
    thickness_um : float or ndarray, shape (k, 1)
    counted_um : float or ndarray, shape (k, 1)
        The thickness that makes a sheet conductance: 1 where the elements have it themselves.
    level : int
        How many films are below; 0 of the body.
    dopant_from : str or None
        The material from which dopant diffuses into this one.
    faces : float or ndarray, shape (k, 1)
        How many of its faces are on the outside: of a stack the lowest film has one, the uppermost
        the other; none in a solid, see `hotlever.lever.rim`.
    distances : ndarray, shape (borders, k, 1)
        From the borders of each point's region with that material (µm); `FAR` where it has fewer
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
        kept = np.isin(self.points, points)
        return replace(
            self,
            points=np.searchsorted(points, self.points[kept]),
            thickness_um=at_some(self.thickness_um, kept),
            counted_um=at_some(self.counted_um, kept),
            faces=at_some(self.faces, kept),
            distances=self.distances[:, kept],
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
    mesh: ProbeMesh | SolidMesh, elements: FiniteElements
) -> tuple[tuple[PlacedFilm, ...], float | Array, float | Array]:
    """Return what lies at the quadrature points of a mesh.

    Returns
    -------
    films : tuple of PlacedFilm
    thickness_um, plate_um : float or ndarray, shape (points, 1)
        Of all that lies on one another, and of the plate as the air sees it.
    """
    layout, positions = mesh.layout, elements.positions
    region = np.repeat(mesh.region, elements.per_element)
    # elements of a solid have their thickness themselves
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
    distances = np.full((max(map(len, by_region.values())), region.size, 1), FAR)
    for number, away in by_region.items():
        distances[: len(away), region == number, 0] = away
    return distances
