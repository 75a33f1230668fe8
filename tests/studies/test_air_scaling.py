"""k of made-up and of solved levers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from hotlever.studies.air_scaling import find_scale_factor, one_sided_study, unevenness


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
