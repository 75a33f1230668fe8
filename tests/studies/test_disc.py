"""A disc between two planes: limits, and an independent solution."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.studies.air_scaling import loss_between_planes


def disc_loss(distance):
    return loss_between_planes(distance).loss.values


def test_far_planes_leave_eight():
    assert disc_loss(1e4) == pytest.approx(8.0, rel=1e-3)


def test_the_approach_to_free_space_is_that_of_the_image_charges():
    # alternating images at 2 h m: potential at the disc lowered by Q ln 2 / (4 π h)
    h = 40.0
    assert disc_loss(h) == pytest.approx(
        8.0 / (1.0 - 8.0 * np.log(2.0) / (4.0 * np.pi * h)), rel=1e-5
    )


@pytest.mark.parametrize("h", [0.03, 0.1, 0.3])
def test_near_planes_give_the_plate_capacitor_with_its_edge(h):
    # a half-plane between two planes gains a strip 2 h ln 2 / π wide on its edge
    strip = 2.0 * h * np.log(2.0) / np.pi
    expected = 2.0 * np.pi / h * (1.0 + 2.0 * strip)
    assert disc_loss(h) == pytest.approx(expected, rel=0.6 * h**1.5 + 2e-3)


def test_the_loss_falls_with_distance_between_its_limits():
    limits = loss_between_planes(np.geomspace(0.05, 50.0, 12))
    assert np.all(np.diff(limits.loss) < 0)
    assert np.all(limits.loss > np.maximum(limits.near, limits.far))


def test_distances_that_cannot_be_resolved_are_refused():
    with pytest.raises(ValueError, match=r"found h/r = 0\.001, expected 0\.02 or more"):
        disc_loss([1.0, 0.001])
