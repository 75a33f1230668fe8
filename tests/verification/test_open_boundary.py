"""Bodies of one temperature in open air, whose heat loss is known exactly.

The panels are halved; the loss converges with order 2 and is extrapolated from both sizes.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve

from hotlever.air.laplace import Laplace
from hotlever.air.panels import Mirror, Panels, mirror_group
from hotlever.air.single_layer import single_layer_matrix

#: Symmetry about x = 0, y = 0 and z = 0.
PLANES = [Mirror.in_plane((0, 0, 0), normal, +1.0) for normal in np.eye(3)]


def heat(panels: Panels, planes: list[Mirror]) -> float:
    """Heat that leaves the panels and all their images for θ = 1 on them."""
    mirrors = mirror_group(planes)
    layer = single_layer_matrix(panels, Laplace(), mirrors)
    return len(mirrors) * float(panels.areas @ cho_solve(cho_factor(layer), panels.areas))


def octant(cuts: int, semi_axes: tuple[float, float, float]) -> Panels:
    """An eighth of an ellipsoid: a triangle cut into equal ones, blown up."""
    number = {(i, j): 0 for i in range(cuts + 1) for j in range(cuts + 1 - i)}
    number = {place: count for count, place in enumerate(number)}
    flat = np.array([(i, j, cuts - i - j) for i, j in number], dtype=float)
    triangles = [
        [number[place] for place in corners]
        for i, j in number
        for corners in (
            ((i, j), (i + 1, j), (i, j + 1)),
            ((i + 1, j), (i + 1, j + 1), (i, j + 1)),
        )
        if all(place in number for place in corners)
    ]
    points = flat / np.linalg.norm(flat, axis=1, keepdims=True) * semi_axes
    return Panels(points[np.array(triangles)[:, [0, 1, 2, 2]]])


def quarter_disc(cuts: int) -> Panels:
    """A quarter of the unit disc in rings that get thin at the edge."""
    radii = np.sin(np.linspace(0.0, np.pi / 2, cuts + 1))
    angles = np.linspace(0.0, np.pi / 2, cuts + 1)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
    return Panels(
        np.array(
            [
                [inner * ring[k], outer * ring[k], outer * ring[k + 1], inner * ring[k + 1]]
                for inner, outer in pairwise(radii)
                for k in range(cuts)
            ]
        )
    )


def quarter_square(cuts: int) -> Panels:
    """A quarter of a square of side 2, with lines that crowd at the edge."""
    lines = np.sin(np.linspace(0.0, np.pi / 2, cuts + 1))
    return Panels(
        np.array(
            [
                [[a, c, 0.0], [b, c, 0.0], [b, d, 0.0], [a, d, 0.0]]
                for a, b in pairwise(lines)
                for c, d in pairwise(lines)
            ]
        )
    )


def spheroid(semi_axis: float) -> float:
    """Exact heat of an oblate spheroid with equatorial semi-axis 1 (µm, for θ = 1 mW/µm)."""
    return 4 * np.pi * np.sqrt(1 - semi_axis**2) / np.arccos(semi_axis)


BODIES = {
    "sphere": (lambda n: octant(n, (1, 1, 1)), PLANES, 4 * np.pi),
    "oblate spheroid": (lambda n: octant(n, (1, 1, 0.3)), PLANES, spheroid(0.3)),
    "disc, both faces": (quarter_disc, PLANES[:2], 8.0),
}


@pytest.mark.parametrize("name", BODIES)
def test_heat_loss_converges_to_the_exact_one(name):
    make, planes, exact = BODIES[name]
    coarse, fine = (heat(make(cuts), planes) for cuts in (12, 24))
    assert fine == pytest.approx(exact, rel=1e-3)
    assert np.log2((coarse / exact - 1) / (fine / exact - 1)) == pytest.approx(2, abs=0.05)
    assert (4 * fine - coarse) / 3 == pytest.approx(exact, rel=5e-5)


def test_square_plate():
    # capacitance of the unit square, 0.36678 (4πε₀): Read, J. Comput. Phys. 133, 1 (1997)
    found = heat(quarter_square(20), PLANES[:2]) / (4 * np.pi * 2)
    assert found == pytest.approx(0.36678, rel=1e-3)


def test_disc_above_an_isothermal_plane_goes_to_both_limits():
    disc = quarter_disc(16)

    def above(height):
        raised = Panels(disc.corners + np.array([0, 0, height]))
        return heat(raised, [*PLANES[:2], Mirror.in_plane((0, 0, 0), (0, 0, 1), -1.0)]) / 2

    assert above(1e4) == pytest.approx(heat(disc, PLANES[:2]), rel=1e-4)
    # Kirchhoff's circular capacitor: area/h and the fringe field
    fringe = 2 * (np.log(8 * np.pi / 0.01) - 1)
    assert above(0.01) == pytest.approx(np.pi / 0.01 + fringe, rel=2.5e-3)
