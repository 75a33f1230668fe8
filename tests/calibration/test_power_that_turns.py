"""A lever whose tip gets hotter with less power: what is told by power, and what by bias."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from hotlever import figures
from hotlever.errors import InputError
from hotlever.estimate import Estimate, calibrate, read_calibration
from hotlever.estimate.knee import IVCurve
from hotlever.estimate.summary import calibration_text
from hotlever.lever import Branch, Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.report.result_pages import calibration_page
from synthetic_curves import measurement_of

#: A heater that is no longer than its border is wide, all within what a fit may vary: its heat
#: moves from the legs to the tip while that gets hotter.
PROBE = Probe.u_shape().with_(
    n_d=6e16,
    delta=1.93,
    p=3.85,
    a0=8e-4,
    a1=5e-8,
    impurity_exponent=1.5,
    length_um=50.0,
    leg_width_um=3.1,
    gap_um=4.5,
    bridge_width_um=6.4,
    heater_length_um=1.8,
    heater_width_um=0.86,
    thickness_um=0.64,
)


@pytest.fixture(scope="module")
def branch() -> Branch:
    return Lever(PROBE, COARSE).branch()


@pytest.fixture(scope="module")
def calibrated(branch: Branch) -> Estimate:
    bias = np.linspace(1.0, 15.5, 40)
    current = branch.electrical_outputs(branch.read(PROBE.circuit, bias).u)["current_mA"]
    current *= 1.0 + 0.002 * np.random.default_rng(0).standard_normal(bias.size)
    return calibrate(measurement_of(IVCurve.of(bias, current, PROBE.circuit)), probe=PROBE)


def test_a_branch_says_where_its_power_turns(branch, reference):
    assert reference.power_turns_K is None
    turn = branch.power_turns_K
    tips = np.linspace(turn - 60.0, turn + 60.0, 7)
    rises = np.diff(branch.power(tips)) > 0
    assert rises[:2].all()
    assert not rises[-2:].any()


def test_a_power_tells_a_temperature_only_where_it_has_one(branch):
    tips = np.linspace(300.0, branch.hottest_K, 500)
    power, highest = branch.power(tips), branch.by_power.highest_mW
    assert highest < power.max()
    cold = tips[power < highest]
    cold = cold[cold < branch.power_turns_K]
    np.testing.assert_allclose(branch.tip_temperature(branch.power(cold)), cold, atol=1e-3)
    assert np.isnan(branch.tip_temperature([highest * 1.0001, power.max()])).all()
    # its slope is that of the tip by the power
    some = np.linspace(0.1, 0.9, 5) * highest
    step = 1e-4
    slope = (branch.tip_temperature(some + step) - branch.tip_temperature(some - step)) / 2 / step
    np.testing.assert_allclose(branch.by_power.slope(some), slope, rtol=1e-3)
    assert branch.tip_temperature(0.5 * highest).shape == ()


def test_the_lever_is_calibrated_by_bias(calibrated, branch, tmp_path):
    assert calibrated.describes_data
    table = calibrated.table
    true = branch.tip_K(branch.read(PROBE.circuit, table.bias_V.values).u)
    assert np.abs(table.tip_K - true).max() < 3 * calibrated.tip_temperature_uncertainty_K
    assert float(calibrated.bias_for(true[50])) == pytest.approx(table.bias_V.item(50), rel=0.05)
    calibrated.write(tmp_path / "cal.json")
    content = json.loads((tmp_path / "cal.json").read_text())
    assert content["power_law"] is None
    assert content["k"] is None
    note = next(note for note in content["notes"] if "falls from a tip of" in note)
    assert "there is no power law, and the table is read by bias" in note
    again = read_calibration(tmp_path / "cal.json")
    assert again.power_law is None
    assert calibration_text(again) == calibration_text(calibrated)


def test_words_page_and_figure_go_by_bias(calibrated):
    text = calibration_text(calibrated)
    assert "no power law: the power falls while the tip gets hotter" in text
    assert "held supplies" not in text
    assert "V_b (V)" in text
    assert "P_l (mW)" not in text
    labels = {line.get_label() for line in figures.calibration_curves(calibrated).axes[0].lines}
    assert "power law at P$_l$/k" not in labels
    page = calibration_page(calibrated)
    assert any("read by bias" in block.get("text", "") for block in page.blocks)


def test_a_power_is_no_question_to_ask(calibrated):
    with pytest.raises(InputError, match="the power of this lever falls while the tip gets hotter"):
        calibrated.tip_temperature(1.0)
    with pytest.raises(
        InputError, match="the paper's rule: in vacuum the power of the lever falls"
    ):
        calibrate(replace(calibrated.measurement, medium="air"), probe=PROBE, medium="vacuum")
