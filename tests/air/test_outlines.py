"""What plates of several outlines lose: exact values, and the same in any orientation."""

from __future__ import annotations

import numpy as np
import pytest
from plates import disc, plate, turned

from hotlever.air.operator import air_operator
from hotlever.probe import Layout, Probe
from hotlever.probe.surroundings import Surroundings

#: Capacity of a square plate over 4πε and its side (F. H. Read, J. Comput. Phys. 133, 1 (1997)).
SQUARE = 0.3667874
BOX = ((0, 0), (10, 0), (10, 10), (0, 10))


def loss(layout: Layout, refinement: float = 1.0, **surroundings) -> float:
    """Heat lost by a plate of one temperature, θ = 1."""
    return float(
        air_operator(layout, Surroundings(**surroundings), refinement=refinement).matrix.sum()
    )


def without_thickness(make, thicknesses=(0.04, 0.02)) -> float:
    """The loss of a plate that is infinitely thin, from two that are not."""
    thick, thin = (loss(make(one), 0.7) for one in thicknesses)
    # it goes nearly in proportion to the thickness
    return 2 * thin - thick


def test_a_thin_disc():
    found = without_thickness(lambda thickness: disc(10.0, thickness))
    assert found == pytest.approx(8 * 10.0, rel=1e-3)


def test_a_thin_square():
    found = without_thickness(lambda thickness: turned(plate(BOX, thickness), 0.4))
    assert found == pytest.approx(4 * np.pi * SQUARE * 10.0, rel=1e-3)


@pytest.mark.parametrize(
    "outline",
    [
        [(0, 0), (30, 0), (30, 4), (0, 4)],
        pytest.param([(0, 0), (20, -1), (20, 3), (8, 6)], marks=pytest.mark.slow),
        pytest.param([(0, 0), (12, 0), (12, 9), (9, 9), (9, 2), (0, 2)], marks=pytest.mark.slow),
    ],
    ids=["rectangle", "slanted", "angle"],
)
def test_panels_are_fine_enough_and_turning_changes_nothing(outline):
    whole = plate(outline, 0.4)
    here = loss(whole)
    assert here == pytest.approx(loss(whole, 1.5), rel=1e-3)
    assert loss(turned(whole, -2.0, (50.0, 900.0))) == pytest.approx(here, rel=1e-5)


def test_a_hole_that_is_small_changes_little_and_a_large_one_more():
    frame = [(0, 0), (8, 0), (8, 8), (0, 8)]

    def hole(half):
        low, high = 4 - half, 4 + half
        return [(low, low), (low, high), (high, high), (high, low)]

    whole, small, large = (
        loss(plate(frame, 0.4, holes), 0.7) for holes in ([], [hole(0.2)], [hole(2.7)])
    )
    assert small == pytest.approx(whole, rel=2e-3)
    # a frame shields its hole
    assert 0.85 * whole < large < 0.99 * whole


def test_all_surroundings_turn_with_the_lever():
    layout = Probe.reference().layout()
    surroundings = {"surface_gap_um": 8.0, "surface_tilt_deg": 10.0, "chip": True}
    here, there = (
        loss(one, 0.5, **surroundings) for one in (layout, turned(layout, 2.2, (-70.0, 30.0)))
    )
    # Gauss points against closed integrals
    assert there == pytest.approx(here, rel=1e-4)
