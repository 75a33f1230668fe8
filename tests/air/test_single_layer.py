"""Integrals of 1/R over panels against Gauss quadrature and each other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hotlever.air.laplace import Approach, Laplace, potential, rectangle_pairs
from hotlever.air.panels import Mirror, Panels, mirror_group, square_distances
from hotlever.air.single_layer import Screened, separations, single_layer_matrix


def rectangle(axis: int, low, high) -> Panels:
    """An axis-parallel rectangle at the low end of its normal axis."""
    u, v = (other for other in range(3) if other != axis)
    corners = np.tile(np.asarray(low, dtype=float), (4, 1))
    corners[1:3, u] = high[u]
    corners[2:4, v] = high[v]
    return Panels(corners[None])


def length(offsets):
    return np.linalg.norm(offsets, axis=-1)


def by_gauss(first: Panels, second: Panels, kernel=lambda offsets: 1 / length(offsets)):
    (x,), (wx,) = first.points(12)
    (y,), (wy,) = second.points(12)
    return wx @ kernel(x[:, None] - y) @ wy


@pytest.mark.parametrize("one", range(3))
@pytest.mark.parametrize("other", range(3))
def test_separate_rectangles(one, other):
    rng = np.random.default_rng(3 * one + other)
    low = rng.uniform(-1, 1, (2, 3))
    low[1, 2] += 3
    high = low + rng.uniform(0.3, 1, (2, 3))
    first, second = rectangle(one, low[0], high[0]), rectangle(other, low[1], high[1])
    expected = by_gauss(first, second)
    assert (first.frame[0][0], second.frame[0][0]) == (one, other)
    assert rectangle_pairs(first, second)[0] == pytest.approx(expected, rel=1e-11)
    (points,), (weights,) = first.points(12)
    assert weights @ potential(points, second.corners[0]) == pytest.approx(expected, rel=1e-11)
    square = square_distances(first, second)
    assert Laplace().far_pairs(first, second, square)[0, 0] == pytest.approx(expected, rel=2e-3)


def test_a_square_on_itself():
    # ∫∫ 1/R over the unit square: 4 ln(1 + √2) + 4 (1 − √2)/3
    square = rectangle(2, (0, 0, 0), (1, 1, 0))
    exact = 4 * np.log(1 + np.sqrt(2)) + 4 * (1 - np.sqrt(2)) / 3
    assert rectangle_pairs(square, square)[0] == pytest.approx(exact, rel=1e-13)


@pytest.mark.parametrize("second", [(1, (0, 0, 0), (1, 0, 1)), (2, (1, 0, 0), (2, 0.3, 0))])
def test_rectangles_that_share_an_edge(second):
    first, second = rectangle(2, (0, 0, 0), (1, 1, 0)), rectangle(*second)
    (points,), (weights,) = second.points(60)
    outer = weights @ potential(points, first.corners[0])
    assert rectangle_pairs(first, second)[0] == pytest.approx(outer, rel=1e-6)


@pytest.mark.parametrize("other", range(3))
def test_points_of_both_serve_pairs_that_are_apart(other):
    first = rectangle(2, (0, 0, 0), (1, 0.4, 0))
    motion, pair = np.array([0.0, 0.0, 1.0]), np.zeros(1, dtype=int)
    # just beyond where closed forms end, then kernels without a pole
    second = rectangle(other, (2.75, 0.2, 0.9), (3.25, 1.0, 1.4))
    assert 2.5 < separations(first, second, pair, pair)[0] < 3.2
    (found,) = Laplace().near_pairs(first, second, pair, pair)
    assert found == pytest.approx(rectangle_pairs(first, second)[0], rel=3e-4)

    def approach(offsets):
        return offsets[..., 2] / length(offsets) ** 3

    _, (found,) = Approach(motion).near_pairs(first, second, pair, pair)
    assert found == pytest.approx(by_gauss(first, second, approach), rel=3e-3)


@pytest.mark.parametrize(("x", "error"), [(0.9, 3e-4), (1.4, 1.5e-3)])
@pytest.mark.parametrize("q", [1.0j, 2.0j, 0.5])
def test_kernels_without_a_pole_by_points_of_both(q, x, error):
    first, pair = rectangle(2, (0, 0, 0), (1, 0.4, 0)), np.zeros(1, dtype=int)
    second = rectangle(0, (x, 0.2, 0.1), (x, 1.0, 0.6))
    assert (separations(first, second, pair, pair)[0] > 1.0) == (x > 1.0)

    def screened(offsets):
        return np.expm1(-q * length(offsets)) / length(offsets)

    ((found,),) = Screened(np.array([q])).near_pairs(first, second, pair, pair)
    exact = by_gauss(first, second, screened)
    assert found == pytest.approx(exact, rel=error)


def test_far_expansion_has_order_four():
    panel = rectangle(2, (0, 0, 0), (1, 0.4, 0))
    errors = []
    for distance in (6.0, 12.0):
        other = rectangle(0, (distance, 0.2, 0.1), (distance, 1.0, 0.7))
        exact = rectangle_pairs(panel, other)[0]
        square = square_distances(panel, other)
        errors.append(abs(Laplace().far_pairs(panel, other, square)[0, 0] / exact - 1))
    assert np.log2(errors[0] / errors[1]) > 2.8


def test_quadrature_and_closed_form_agree_in_the_matrix():
    # the same rectangles, tilted: then Gauss points are used
    lines = np.array([0.0, 0.1, 0.4, 1.0])
    corners = [
        [[a, c, z], [b, c, z], [b, d, z], [a, d, z]]
        for a, b in pairwise(lines)
        for c, d in pairwise(lines)
        for z in (0.0, 0.4)
    ]
    panels = Panels(np.array(corners))
    angle = 0.3
    turn = np.array(
        [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    )
    tilted = Panels(panels.corners @ turn.T)
    assert (panels.frame[0] == 2).all()
    assert (tilted.frame[0] == -1).all()
    exact, quadrature = (
        single_layer_matrix(panels, Laplace()),
        single_layer_matrix(tilted, Laplace()),
    )
    assert np.abs(quadrature / exact - 1).max() < 2e-3  # six Gauss points each way
    heats = [panels.areas @ np.linalg.solve(layer, panels.areas) for layer in (exact, quadrature)]
    assert heats[1] == pytest.approx(heats[0], rel=1e-4)


@pytest.mark.parametrize("angle", [0.3, 1e-9, np.pi / 2, 2.0, -3.0])
def test_rectangles_turned_in_the_plane_are_still_in_one_frame(angle):
    low, high = np.array([[0, 0, 0], [0.5, 0.2, 0.1], [0.1, 2, 0]]), np.array([1, 3, 2.5])
    panels = Panels(
        np.concatenate([rectangle(axis, low[axis], high).corners for axis in (2, 1, 0)])
    )
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    turned = Panels(panels.corners @ turn.T)
    assert (panels.frame[0] == [2, 1, 0]).all()
    assert (turned.frame[0] >= 0).all()
    exact = single_layer_matrix(panels, Laplace())
    np.testing.assert_allclose(single_layer_matrix(turned, Laplace()), exact, rtol=1e-10)


def test_what_is_no_rectangle_has_no_frame():
    trapezoid = [[0, 0, 0], [2, 0, 0], [1.9, 1, 0], [0.1, 1, 0]]
    triangle = [[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 1, 0]]
    rhombus = [[0, 0, 0], [2, 0, 0], [3, 1, 0], [1, 1, 0]]
    leaning = [[0, 0, 0], [2, 0, 0], [2, 1, 1], [0, 1, 1]]
    panels = Panels(np.array([trapezoid, triangle, rhombus, leaning], dtype=float))
    assert (panels.frame[0] == -1).all()


def test_trapezoids_and_triangles_by_gauss_points():
    """A rectangle in two pieces that have no closed form is the rectangle."""
    other = rectangle(1, (1.2, -0.3, 0.1), (2.5, 0, 0.6))
    whole = rectangle(2, (0, 0, 0), (2, 1, 0))
    corners = [
        [[0, 0, 0], [1.3, 0, 0], [0.8, 1, 0], [0, 1, 0]],
        [[1.3, 0, 0], [2, 0, 0], [2, 1, 0], [2, 1, 0]],
        [[1.3, 0, 0], [2, 1, 0], [0.8, 1, 0], [0.8, 1, 0]],
    ]
    matrix = single_layer_matrix(
        Panels(np.concatenate([np.array(corners), other.corners])), Laplace()
    )
    exact = single_layer_matrix(Panels(np.concatenate([whole.corners, other.corners])), Laplace())
    assert matrix[:3, :3].sum() == pytest.approx(exact[0, 0], rel=1e-3)
    assert matrix[:3, 3].sum() == pytest.approx(exact[0, 1], rel=1e-4)


def test_panel_geometry():
    triangle = Panels(np.array([[[0, 0, 0], [3, 0, 0], [0, 3, 0.0], [0, 3, 0.0]]]))
    assert triangle.areas == pytest.approx([4.5])
    assert triangle.centres[0] == pytest.approx([1, 1, 0])
    for panels in (triangle, rectangle(1, (0, 2, 0), (2, 0, 1))):
        points, weights = panels.points(4)
        assert weights.sum() == pytest.approx(panels.areas[0])
        offset = points[0] - panels.centres[0]
        moments = np.einsum("q,qd,qe->de", weights[0], offset, offset) / panels.areas[0]
        assert moments == pytest.approx(panels.moments[0], abs=1e-14)


def test_mirrors_at_right_angles_form_a_group():
    planes = [Mirror.in_plane((1, 0, 0), (1, 0, 0), -1.0), Mirror.in_plane((0, 0, 2), (0, 0, 1), 1)]
    group = mirror_group(planes)
    assert [mirror.sign for mirror in group] == [1, -1, 1, -1]
    point = np.array([0.2, 0.3, 0.5])
    images = np.array([mirror.matrix @ point + mirror.shift for mirror in group])
    assert images == pytest.approx(
        np.array([[0.2, 0.3, 0.5], [1.8, 0.3, 0.5], [0.2, 0.3, 3.5], [1.8, 0.3, 3.5]])
    )
