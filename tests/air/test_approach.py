"""How the air changes with the distance of a surface, against differences and in the near limit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hotlever.air.laplace import Approach, Laplace
from hotlever.air.operator import AirOperator, PanelledAir, air_operator
from hotlever.air.panels import Panels, square_distances
from hotlever.materials.air import temperature_jump_length
from hotlever.probe import Probe
from hotlever.probe.drawing import Drawing, Layer
from hotlever.probe.drawing import rectangle as rectangle_of
from hotlever.probe.surroundings import Surroundings

LAYOUT = Probe.reference().layout()
DOWN = np.array([0.0, 0.0, -2.0])
TURN = np.array(
    [[np.cos(0.1), 0.0, np.sin(0.1)], [0.0, 1.0, 0.0], [-np.sin(0.1), 0.0, np.cos(0.1)]]
)


def rectangle(axis: int, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    u, v = (other for other in range(3) if other != axis)
    corners = np.tile(low, (4, 1))
    corners[1:3, u], corners[2:4, v] = high[u], high[v]
    return corners


def slope(function: Callable[[float], float], step: float) -> float:
    """A derivative at 0 by differences of fourth order."""
    near, far = (function(step * n) - function(-step * n) for n in (1, 2))
    return (8 * near - far) / (12 * step)


def check(first: np.ndarray, second: np.ndarray, motion: np.ndarray) -> None:
    fixed, pair, moving = Panels(first[None]), np.array([0]), Approach(motion)

    def near(share: float) -> float:
        displaced_panels = Panels((second + share * motion)[None])
        return Laplace().near_pairs(fixed, displaced_panels, pair, pair)[0]

    def far(share: float) -> float:
        displaced_panels = Panels((second + share * motion)[None])
        square = square_distances(fixed, displaced_panels)
        return Laplace().far_pairs(fixed, displaced_panels, square)[0, 0]

    there = Panels(second[None])
    square = square_distances(fixed, there)
    value, change = moving.near_pairs(fixed, there, pair, pair)[:, 0]
    assert value == pytest.approx(near(0.0), rel=1e-13)
    assert change == pytest.approx(slope(near, 1e-4), rel=1e-7)
    value, change = moving.far_pairs(fixed, there, square)[:, 0, 0]
    assert value == pytest.approx(far(0.0), rel=1e-13)
    assert change == pytest.approx(slope(far, 1e-4), rel=1e-7)


@pytest.mark.parametrize("one", range(3))
@pytest.mark.parametrize("other", range(3))
def test_rectangles_that_come_nearer(one, other):
    low = np.random.default_rng(3 * one + other).uniform(-1, 1, (2, 3))
    low[1, 2] -= 1.5
    high = low + np.array([[0.5, 0.8, 0.3], [0.4, 0.9, 0.7]])
    check(rectangle(one, low[0], high[0]), rectangle(other, low[1], high[1]), DOWN)


def test_panels_that_are_no_rectangles_in_one_frame():
    flat = rectangle(2, np.zeros(3), np.array([1.0, 0.7, 0.0]))
    tilted = (rectangle(2, np.zeros(3), np.array([1.3, 0.7, 0.0])) - [0.0, 0.0, 0.5]) @ TURN.T
    triangle = flat[[0, 1, 2, 2]]
    motion = np.array([0.3, 0.1, -2.0])
    for first, second in ((flat, tilted), (tilted, flat), (triangle, tilted), (tilted, triangle)):
        check(first, second, motion)


def operator(gap: float, refinement: float = 0.2, **more: object) -> AirOperator:
    around = Surroundings(surface_gap_um=gap, **more)
    return air_operator(LAYOUT, around, 293.0, refinement)


@pytest.mark.parametrize(
    "more", [{"accommodation": 1.0}, {"surface_tilt_deg": 2.0, "accommodation": 0.8, "chip": True}]
)
def test_the_operator_s_derivative_by_the_gap(more):
    gap = 1.0 if "chip" not in more else 4.0
    here = operator(gap, **more)
    warm = np.linspace(0.0, 1.0, len(here.sites))
    by_heat = slope(lambda step: warm @ operator(gap + step, **more).matrix @ warm, 1e-3 * gap)
    assert warm @ here.matrix_by_gap @ warm == pytest.approx(by_heat, rel=1e-4)
    by_filling = slope(lambda step: operator(gap + step, **more).filling, 1e-3 * gap)
    assert here.filling_by_gap == pytest.approx(by_filling, rel=1e-3)


@pytest.mark.parametrize("pressure_mbar", [None, 1e5])
def test_near_a_surface_the_loss_is_that_of_plates(pressure_mbar):
    """κ/z without a jump, κ/(z + g + g') with jumps, all so short that edges do not count."""
    gaps, jumps, more = np.array([0.005, 0.01]), 0.0, {}
    if pressure_mbar is not None:
        more = {"accommodation": 1.0, "pressure_mbar": pressure_mbar}
        jumps = sum(
            float(temperature_jump_length(T, pressure_mbar, 1.0)[0]) for T in (600.0, 293.0)
        )
        assert jumps > 0.3 * gaps[1]
    slopes = [-operator(gap, **more).matrix_by_gap.sum() for gap in gaps.tolist()]
    area = sum(float(np.prod(np.ptp(np.array(r.outline), axis=0))) for r in LAYOUT.regions)
    assert np.array(slopes) * (gaps + jumps) ** 2 / area == pytest.approx(1.0, abs=0.02)


def test_the_air_inside_a_plate_carries_nothing_from_face_to_face():
    """In the middle of a wide strip all the jumps are in series with the gap."""
    drawing = Drawing(
        layers={"silicon": Layer(rectangle_of(0.0, -15.0, 40.0, 15.0), "strip")},
        terminals={name: [(x, -15), (x, 15)] for name, x in (("supply", 0.0), ("ground", 40.0))},
        tip_um=(20.0, 0.0),
        thickness_um=0.1,
    )
    materials = {"strip": Probe.reference().kinds["low-doped"]}
    layout = Probe.from_sections({**drawing.sections(), "materials": materials}, "strip").layout()
    around = Surroundings(surface_gap_um=0.2, accommodation=1.0)
    air = PanelledAir(layout, around, 293.0, 0.3)
    flux = air.densities(np.ones((len(air.surface.sites), 1)))[:, 0]
    lower = air.surface.across[:, 1]
    away = np.linalg.norm(air.panels.centres[lower, :2] - [20.0, 0.0], axis=1)
    face = air.panels.centres[lower[[away.argmin()]]]
    near, far = air.theta(face - [[0.0, 0.0, 0.02], [0.0, 0.0, 0.04]], flux)
    jumps = sum(float(temperature_jump_length(T, 1013.25, 1.0)[0]) for T in (600.0, 293.0))
    assert (near - far) / 0.02 * (0.2 + jumps) == pytest.approx(1.0, abs=1e-3)
