"""Calibrations of levers that a held supply heats too: by bias, without a power law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hotlever import Lever, Probe
from hotlever.errors import InputError
from hotlever.estimate import Estimate, Measurement, calibrate, read_calibration, read_power_law
from hotlever.estimate.power_law import EQ12
from hotlever.estimate.summary import calibration_text
from hotlever.estimate.tip_table import PulseTiming
from hotlever.lever.lever import COARSE

pytestmark = pytest.mark.usefixtures("coarse_meshes")

HELD = {"kind": "supply", "bias_V": 2.0, "series_resistance_ohm": 500.0}
PROBE = Probe.reference().with_(**{f"circuit.reader.{key}": HELD[key] for key in HELD})
TRUE = PROBE.replace({"c_kappa": 0.66, "n_d": 5.3e17, "p": 2.6})


@pytest.fixture(scope="module")
def truth():
    return Lever(TRUE, COARSE).sweep([-5.0, -2.0, 0.0, 1.5, 3.0, 4.5, 6.0, 6.5, 7.0, 7.5, 8.0])


@pytest.fixture(scope="module")
def measured(truth) -> Measurement:
    rng = np.random.default_rng(3)
    noisy = truth.current_mA.values * (1.0 + 1e-3 * rng.normal(size=truth.bias.size))
    return replace(Measurement.of_sweep(truth), current_mA=noisy)


@pytest.fixture(scope="module")
def calibration(measured) -> Estimate:
    return calibrate(measured, probe=PROBE, priors={})


def read(calibration: Estimate, column: str, bias: np.ndarray) -> np.ndarray:
    return np.interp(bias, calibration.table.bias_V, calibration.table[column])


@pytest.mark.slow
def test_the_table_is_by_the_bias_of_the_swept_supply(calibration, truth):
    bias = truth.bias_V.values
    off = read(calibration, "tip_K", bias) - truth.tip_K.values
    # the coarse mesh is off by some kelvins
    assert np.all(np.abs(off) < 3.0 * read(calibration, "tip_stderr_K", bias) + 3.0)
    assert np.abs(off).max() < 10.0
    total = (truth.power_mW + truth.reader_V * truth.reader_mA).values
    np.testing.assert_allclose(read(calibration, "total_power_mW", bias), total, rtol=0.01)
    np.testing.assert_allclose(read(calibration, "power_mW", bias), truth.power_mW, atol=0.02)
    knee = Lever(TRUE, COARSE).knee()
    assert calibration.knee.tip_K == pytest.approx(knee.tip_K.item(), abs=10.0)
    assert calibration.knee.lever_V == pytest.approx(knee.lever_V.item(), rel=0.01)
    # the tip is coldest near zero bias, and a bias for it is sought from there on
    at = float(calibration.bias_for(truth.tip_K.values[-2]))
    assert at == pytest.approx(truth.bias_V.values[-2], abs=0.1)


def test_no_power_tells_the_temperature(calibration, measured, tmp_path):
    assert calibration.power_law is None
    assert np.isnan(calibration.k)
    assert "no power law: with held supplies" in calibration_text(calibration)
    held = r"\[circuit.reader\]: .* takes a lever that only the swept supply heats"
    with pytest.raises(InputError, match=held):
        calibration.tip_temperature(1.0)
    with pytest.raises(InputError, match=held):
        calibrate(measured, probe=PROBE, pulse=PulseTiming(5.0))
    with pytest.raises(InputError, match=held):
        calibrate(replace(measured, medium="air"), probe=PROBE, medium="vacuum")
    calibration.write(tmp_path / "calibration.json")
    again = read_calibration(tmp_path / "calibration.json")
    assert again.power_law is None
    assert again.table.total_power_mW.values.tolist() == pytest.approx(
        calibration.table.total_power_mW.values.tolist()
    )
    assert calibration_text(again) == calibration_text(calibration)
    assert again.table_csv().splitlines()[0].endswith(",tip_high_K,total_power_mW")
    with pytest.raises(InputError, match="found no power law"):
        read_power_law(tmp_path / "calibration.json")


def test_another_levers_resistance_is_refused(measured):
    other = replace(measured, current_mA=5.0 * measured.current_mA)
    with pytest.raises(
        InputError, match=r"the change of V_b over that of I_h is .* expected about"
    ):
        calibrate(other, probe=PROBE)
    with pytest.raises(InputError, match="a fit, a probe and a power law exclude each other"):
        calibrate(measured, probe=PROBE, law=EQ12)


@pytest.mark.slow
def test_priors_and_a_curve_alone_tell_the_temperature(measured, truth):
    nothing = np.full(truth.bias.size, np.nan)
    estimated = calibrate(replace(measured, tip_K=nothing), probe=PROBE)
    bias = truth.bias_V.values
    off = read(estimated, "tip_K", bias) - truth.tip_K.values
    assert np.abs(off / read(estimated, "tip_stderr_K", bias)).max() < 3.0
    assert {"material", "geometry", "electronics"} <= set(estimated.table.source.values.tolist())
