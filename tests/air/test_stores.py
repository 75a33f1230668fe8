"""What air takes up itself: its kernel, a sphere in a medium, and stores that only take."""

from __future__ import annotations

import numpy as np
import pytest
from plates import disc
from scipy.spatial import ConvexHull

from hotlever.air.laplace import Laplace
from hotlever.air.operator import PanelledAir
from hotlever.air.panels import Panels
from hotlever.air.single_layer import Screened, screened_potential, single_layer_matrix
from hotlever.air.stores import stores_of
from hotlever.probe.surroundings import Surroundings


@pytest.mark.parametrize("q", [0.01, 3.0, 1.0 + 1.0j, 2.0j])
def test_the_kernel_is_integrated_over_a_panel(q):
    corners = np.array([[[0, 0, 0], [2, 0, 0], [2.2, 1, 0], [0, 1, 0]]], dtype=float)
    # inside, above, beyond, at an edge, above one
    points = np.array([[0.3, 0.4, 0], [0.3, 0.4, 0.2], [3, 0.4, 0.2], [1, 0, 0], [1, 1e-6, 0.3]])
    at, weights = Panels(corners).points(300)
    away = np.linalg.norm(at - points[:, None], axis=2)
    brute = (weights * np.expm1(-q * away) / away).sum(axis=1)
    found = screened_potential(points, corners, np.array([q]))[0]
    np.testing.assert_allclose(found, brute, rtol=2e-4)


def sphere(halvings: int) -> Panels:
    """An icosahedron whose edges are halved so often, with the area of the unit sphere."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    one = np.array([[0.0, a, b * golden] for a in (-1, 1) for b in (-1, 1)])
    corners = np.vstack([one, one[:, [1, 2, 0]], one[:, [2, 0, 1]]])
    triangles = corners[ConvexHull(corners).simplices]
    for _ in range(halvings):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = a + b, b + c, c + a
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        scale = np.linalg.norm(triangles, axis=2).mean()
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
        triangles *= scale / np.linalg.norm(triangles, axis=2, keepdims=True)
    panels = Panels(np.concatenate([triangles, triangles[:, 2:]], axis=1))
    return Panels(panels.corners * np.sqrt(4.0 * np.pi / panels.areas.sum()))


@pytest.fixture(scope="module")
def spheres():
    """Panels and their static layers, of which the error of one is a fourth of the other's."""
    return [(panels, single_layer_matrix(panels, Laplace())) for panels in map(sphere, (1, 2))]


@pytest.mark.parametrize("turns", [1e-3, 0.1, 1.0, 4.0])
def test_a_sphere_in_a_medium_loses_as_it_should(spheres, turns):
    """4πa(1 + a √(iω/α)), with ω a²/α given; the single layer fills the sphere with air too."""
    q = np.sqrt(1j * turns)
    loss = []
    for panels, layer in spheres:
        screened = single_layer_matrix(panels, Screened(np.array([q])))[0]
        loss.append(panels.areas @ np.linalg.solve(layer + screened, panels.areas))
    inside = 4.0 * np.pi * (q / np.tanh(q) - 1.0)
    outside = (4.0 * loss[1] - loss[0]) / 3.0 - inside
    assert outside == pytest.approx(4.0 * np.pi * (1.0 + q), rel=1e-3)


@pytest.fixture(scope="module")
def plate():
    """A disc in air, and its stores for two shapes: even, and rising to one side."""
    layout = disc(20.0, 0.5, corners=24)
    air = PanelledAir(layout, Surroundings(medium="air"), 293.0, 0.5)
    x = air.surface.sites[:, 0] / 20.0
    shapes = np.stack([np.ones_like(x), x], axis=1)
    inside = 0.5 * np.pi * 20.0**2 * np.diag([1.0, 0.25])
    return air, shapes, inside, stores_of(air, shapes, inside, 40.0)


def answered(stores, square):
    """Y(s) − Y(0), with s over the diffusivity."""
    lagging = np.tensordot(square / (square + stores.rates), stores.conductances, axes=1)
    return lagging + square * stores.volume


@pytest.mark.parametrize("turn", [1.0, 1.0j], ids=["growing", "oscillating"])
def test_a_few_stores_answer_as_the_air_does(plate, turn):
    air, shapes, inside, stores = plate
    squares = turn * np.geomspace(3e-4, 0.1, 5)
    still, *found = air.admittances(np.sqrt(np.append(1e-18 * turn, squares)), shapes)
    for square, one in zip(squares, found, strict=True):
        exact = one - still - square * inside
        np.testing.assert_allclose(np.diag(answered(stores, square)), np.diag(exact), rtol=6e-3)


def test_no_store_gives_what_it_did_not_take(plate):
    stores = plate[-1]
    for matrix in (*stores.conductances, stores.volume):
        assert np.linalg.eigvalsh(matrix).min() > -1e-12 * np.abs(matrix).max()


def test_what_goes_along_is_the_even_part_of_the_answer(plate):
    """In powers of √s, those of s itself; at low rates its first, which no wave carries off."""
    air, shapes, inside, stores = plate
    q = np.array([1e-9, 2e-3])
    still, some = air.admittances(1j * q, shapes).real
    np.testing.assert_allclose(
        np.diag(stores.bound[0]), np.diag((still - some) / q[1] ** 2 - inside), rtol=0.01
    )
