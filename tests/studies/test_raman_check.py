"""The paper's linear Raman law against silicon's."""

from __future__ import annotations

import pytest

from hotlever.errors import InputError
from hotlever.raman import anharmonic
from hotlever.raman.thermometer import published_raman_calibration
from hotlever.spieser2017 import HOTTEST_TIP_K
from hotlever.studies.raman_check import conclusion, paper_check


def test_papers_check_of_its_linear_law():
    check = paper_check()
    # our reference page, found independently: 50 to 100 K too hot at 1050 to 1150 K
    for error in check.error.transpose("line", "temperature_K"):
        low, high = error.interp(temperature_K=[1050.0, HOTTEST_TIP_K]).values
        assert 40.0 < low < 75.0
        assert 75.0 < high < 105.0
    law = published_raman_calibration().linear
    for number in range(2):
        line = check.isel(line=number)
        shift, _ = anharmonic.shift(line.true_at_knee.item(), 293.0)
        if number == 0:
            assert law.temperature(shift, 293.0) == pytest.approx(943.0, abs=0.05)
        assert line.discrepancy.item() == pytest.approx(line.true_at_knee.item() - 893.0)
        assert line.explained.item() == pytest.approx((943.0 - line.true_at_knee.item()) / 50.0)
        assert 0.3 < line.explained.item() < 0.6
    assert "of the 50 K discrepancy remain" in conclusion(check)


def test_a_calibration_of_ones_own_is_taken_for_true():
    published = published_raman_calibration()
    law = published.anharmonic.model_copy(update={"three_phonon_cm": -3.0})
    own = published.model_copy(update={"anharmonic": law, "source": "ours"})
    check = paper_check(own)
    assert check.truth == "ours"
    difference = check.error_at_hottest - paper_check().error_at_hottest.values
    assert 0.5 < abs(difference[0].item()) < 25.0


def test_a_law_without_a_temperature_at_the_knee_is_refused():
    published = published_raman_calibration()
    law = published.anharmonic.model_copy(update={"three_phonon_cm": -0.1, "four_phonon_cm": -0.01})
    with pytest.raises(InputError, match="no temperature at a shift"):
        paper_check(published.model_copy(update={"anharmonic": law}))
