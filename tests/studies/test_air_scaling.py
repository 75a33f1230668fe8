"""k of levers, made up and solved; and a disc between two planes, against limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from hotlever.studies.air_scaling import (
    find_scale_factor,
    loss_between_planes,
    one_sided_study,
    unevenness,
)


@dataclass
class Straight:
    """A branch whose tip rises in proportion to its power."""

    mW_per_K: float

    def power(self, tip_K):
        return self.mW_per_K * (np.asarray(tip_K, dtype=float) - 293.0)

    def tip_temperature(self, power_mW):
        return 293.0 + np.asarray(power_mW) / self.mW_per_K


def test_levers_that_differ_by_a_factor_have_that_k():
    factor = find_scale_factor(Straight(0.004), Straight(0.0052))
    np.testing.assert_allclose(factor.k, 1.3)
    assert unevenness(factor) == pytest.approx(1.0)
    assert factor.best_error_K.item() == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_a_surface_far_away_is_free_space_and_a_near_one_takes_more(coarse):
    study = one_sided_study(coarse.probe, (1.0, 1e4, np.inf))
    assert study.gap_um.values.tolist() == [1.0, 1e4, np.inf]
    near, far, free = (study.k.isel(gap_um=number) for number in range(3))
    np.testing.assert_allclose(far, free, rtol=1e-3)
    assert (near > 1.5 * free).all()
    # no constant in either
    assert (study.k.max("tip_K") > 1.15 * study.k.min("tip_K")).all()


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


def test_distances_that_cannot_be_resolved_are_refused():
    with pytest.raises(ValueError, match=r"found h/r = 0\.001, expected 0\.02 or more"):
        disc_loss([1.0, 0.001])
