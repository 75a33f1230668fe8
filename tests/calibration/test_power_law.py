"""The published temperature-power law."""

from __future__ import annotations

import pytest

from hotlever.calibration.power_law import EQ12


def test_eq12_jumps_by_a_few_kelvin_at_its_threshold():
    below, above = EQ12.tip_temperature([2.95, 2.95 + 1e-9])
    assert below == pytest.approx(917, abs=1)
    assert above == pytest.approx(921, abs=1)
    assert EQ12.jump_K == pytest.approx(above - below, abs=1e-5)


def test_no_power_is_the_base_temperature():
    assert EQ12.tip_temperature(0.0, 300.0) == 300.0
