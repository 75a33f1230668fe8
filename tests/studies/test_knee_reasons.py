"""Why the knee is not at the inversion temperature."""

from __future__ import annotations

import pytest

from hotlever.errors import ComputationError
from hotlever.studies.knee_study import reasons_of_the_knee, steps_to_the_knee


def test_reasons_for_the_knee_add_up(coarse):
    reasons = reasons_of_the_knee(coarse)
    steps = dict(steps_to_the_knee(reasons))
    assert reasons.inversion_K + sum(steps.values()) == pytest.approx(
        reasons.knee_K.sel(lever="as it is").item()
    )
    assert all(kelvins > 0 for kelvins in steps.values())
    # the paper: approximately 15 K
    assert steps["the legs have a resistance"] == pytest.approx(15, abs=3)
    cold = coarse.with_material(coarse.probe.material.with_(n_d=5e18))
    with pytest.raises(ComputationError, match=r"as it is.*no knee"):
        reasons_of_the_knee(cold)
