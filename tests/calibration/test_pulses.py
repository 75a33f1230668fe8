"""Pulses of a calibrated lever: the true lever's temperatures, honest errors, a file."""

from __future__ import annotations

import json

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.estimate import calibrate, read_calibration
from hotlever.estimate.options import Numerics, PulseOptions
from hotlever.estimate.power_law import EQ12
from hotlever.estimate.summary import calibration_text
from hotlever.estimate.tip_table import PULSE_COLUMNS, PulseTiming
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import pulse, simulate
from synthetic_curves import measured_curve, measurement_of

pytestmark = pytest.mark.usefixtures("coarse_meshes")


@pytest.fixture(scope="module")
def measured(reference):
    return measurement_of(measured_curve(reference, np.random.default_rng(0)))


@pytest.fixture(scope="module")
def calibrated(measured):
    """The reference lever, measured with noise; few heights, and laws that are no unknowns."""
    few = Numerics(pulses=PulseOptions(heights=7, chosen=(6, 3)))
    priors = {"laws": "paper"}
    return calibrate(measured, priors=priors, pulse=PulseTiming(5.0), numerics=few)


@pytest.mark.slow
def test_the_true_lever_is_within_the_band(calibrated, lever):
    """At rest its errors are of the order of those stated; in a pulse too."""
    for height in (3.0, 6.0, 8.0):
        true = simulate(lever, pulse(height, 5.0), 10.0, per_step=8)
        tip, during = true.tip_K.values, true.time.values <= 5.0
        mean = np.trapezoid(tip[during], true.time.values[during]) / 5.0
        row = calibrated.pulse.table.interp(height=height)
        for moment, value in (("peak", tip.max()), ("end", tip[during][-1]), ("mean", mean)):
            stderr = row[f"{moment}_stderr_K"].item()
            assert abs(row[f"{moment}_K"].item() - value) < 3.0 * stderr
            assert stderr < 0.1 * (value - 293.0) + 1.2


@pytest.mark.slow
def test_its_own_lever_has_these_temperatures(calibrated):
    own = Lever(calibrated.probe)
    heights = calibrated.pulse.table.height_V.values[[40, 90]]
    true = [
        simulate(own, pulse(h, 5.0), 10.0, per_step=8).tip_K.max().item() for h in heights.tolist()
    ]
    np.testing.assert_allclose(calibrated.pulse.tip_temperature(heights), true, atol=0.2)
    np.testing.assert_allclose(calibrated.pulse.height_for(true), heights, atol=0.02)
    assert np.isnan(calibrated.pulse.height_for([200.0, 2000.0])).all()
    with pytest.raises(InputError, match="did you mean 'mean'"):
        calibrated.pulse.tip_temperature(5.0, "meen")


@pytest.mark.slow
def test_sources_add_up_and_a_cold_tip_is_as_sure_as_the_base(calibrated):
    table = calibrated.pulse.table
    together = np.sqrt((table.budget_K**2).sum("source"))
    np.testing.assert_allclose(table.peak_stderr_K, together)
    assert {"geometry", "material", "heat capacity", "model"} <= set(table.source.values.tolist())
    of_base = calibrated.priors["base_temperature_K"].posterior_spread
    assert table.peak_stderr_K[0].item() == pytest.approx(of_base, rel=0.2)


def test_more_heat_capacity_is_a_slower_lever(coarse, monkeypatch):
    usual = simulate(coarse, pulse(8.0, 5.0 / 1.03), at=[5.0 / 1.03], tolerance_K=1e-3).tip_K.item()
    other = Lever(coarse.probe, COARSE)
    laws = other.equations.laws
    held = laws.heat_density
    monkeypatch.setattr(laws, "heat_density", lambda T: tuple(1.03 * value for value in held(T)))
    slower = simulate(other, pulse(8.0, 5.0), at=[5.0], tolerance_K=1e-3).tip_K.item()
    assert slower == pytest.approx(usual, abs=2e-3)


@pytest.mark.slow
def test_the_file_reads_back(calibrated, tmp_path):
    path = tmp_path / "calibration.json"
    calibrated.write(path)
    again = read_calibration(path).pulse
    assert again.timing == calibrated.pulse.timing
    for name in (*PULSE_COLUMNS, "budget_K"):
        np.testing.assert_allclose(again.table[name], calibrated.pulse.table[name])
    assert calibrated.table_csv().splitlines()[0] == ",".join(PULSE_COLUMNS)
    assert "a pulse of 5 µs:" in calibration_text(calibrated)
    content = json.loads(path.read_text())
    del content["pulse"]["table"][0]
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match="pulse: budget_K"):
        read_calibration(path)


def test_the_rule_knows_no_pulse(measured):
    with pytest.raises(InputError, match="says nothing about a pulse"):
        calibrate(measured, law=EQ12, pulse=PulseTiming(5.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("5", "--pulse"),
        ("5us,", "--pulse"),
        ("5us,3us", "--pulse: found a period of 3"),
        ("-1us", ""),
    ],
)
def test_a_wrong_timing_is_one_line(refused, text, message):
    assert message in refused("calibrate", "src/hotlever/examples/lever-a.csv", "--pulse", text)
