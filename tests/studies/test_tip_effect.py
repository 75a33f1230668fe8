"""What a tip changes, in vacuum and by its surface in air; benchmarks/tip.py prints more."""

from __future__ import annotations

import pytest

from hotlever.probe import Probe
from hotlever.studies.knee_study import tip_effects

ONE = ((0.7, 20.0),)


@pytest.mark.usefixtures("coarse_meshes")
def test_in_vacuum_a_tip_only_conducts_and_a_tipless_fit_takes_it_in():
    effects = tip_effects(Probe.reference(), ONE)
    assert effects.moved_K.item() == pytest.approx(0.9, abs=0.2)
    assert effects.knee_V.item() == pytest.approx(effects.without_V + effects.moved_V.item())
    for name in ("surface_moved_K", "surface_moved_V", "surface_at_power_K"):
        assert effects[name].item() == 0.0
    assert abs(effects.missed_K.item()) < 0.1


@pytest.mark.slow
def test_in_air_its_surface_moves_the_knee_by_less_than_a_kelvin():
    effects = tip_effects(Probe.reference().in_medium("air"), ONE)
    assert effects.surface_moved_K.item() == pytest.approx(-0.2, abs=0.1)
    assert effects.surface_moved_V.item() == pytest.approx(0.7e-3, abs=0.3e-3)
    assert effects.surface_at_power_K.item() == pytest.approx(-0.6, abs=0.2)
    assert abs(effects.missed_K.item()) < 0.2
