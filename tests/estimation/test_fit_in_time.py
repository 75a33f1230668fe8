"""Fits of what was measured in time: its rows and wave form, and the lever found again."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from experiments import on_coarse_meshes
from hotlever import read_measurement
from hotlever.errors import InputError
from hotlever.estimate import Measurement, fit, read_fit
from hotlever.estimate.experiment_in_time import ExperimentInTime
from hotlever.lever.transient import pulse, simulate, sine, step
from hotlever.probe import Probe

TIMES = np.array([0.2, 1.0, 3.0, 6.0, 10.0, 15.0, 20.0])
WAVE = pulse(9.0, 30.0)


def read(text, waveform=None, **options):
    Path("data.csv").write_text(text)
    return read_measurement("data.csv", waveform=waveform, **options)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
def test_a_scale_of_the_heat_capacity_is_found(coarse):
    names = ["heat_capacity_scale", "n_d"]
    twin = coarse.with_probe(coarse.probe.replace({"heat_capacity_scale": 1.08, "n_d": 5.9e17}))
    history = simulate(twin, WAVE, at=TIMES, tolerance_K=0.02)
    noise = np.random.default_rng(0).normal(1.0, 1e-5, (2, TIMES.size))
    measured = Measurement.in_time(
        TIMES, WAVE, history.current_mA.values * noise[0], history.reader_V.values * noise[1]
    )
    # a model may have its parameters in another order than the fit
    as_it_is = partial(ExperimentInTime.of, waveform=WAVE, names=names[::-1], lever=coarse)
    found = fit(measured, coarse.probe, model=as_it_is, free=["n_d"])
    assert found.names == names
    values = {name: found.parameters[name].value for name in names}
    assert values == {
        "heat_capacity_scale": pytest.approx(1.08, abs=3e-3),
        "n_d": pytest.approx(5.9e17, rel=1e-3),
    }
    assert 0.0 < found.parameters["heat_capacity_scale"].stderr < 3e-3
    np.testing.assert_allclose(found.band.tip_K, history.tip_K, atol=0.5)
    assert (found.band.tip_stderr_K < 0.5).all()
    assert found.evaluations < 10


def test_the_command_fits_a_file_in_time(coarse, run, refused):
    """Few rows: a pulse is followed by both levers for each of some parameters."""
    times = np.array([0.5, 1.0, 2.0, 3.0])
    twin = coarse.with_probe(coarse.probe.replace({"heat_capacity_scale": 1.1}))
    current = simulate(twin, step(9.0), at=times).current_mA.values
    rows = [f"{t / 1e3:g},{i:.6f}\n" for t, i in zip(times, current, strict=True)]
    Path("data.csv").write_text(f"Time/ms,I_h (mA)\n{''.join(rows)}")
    words = ("--step", "9V", "-o", "fit.json", "--report", "page")
    with on_coarse_meshes():
        status, out, err = run("fit", "data.csv", *words)
    assert status == 0, err
    assert "in time, 4 rows; step to 9 V" in err
    assert "tip temperature: " in out
    content = json.loads(Path("fit.json").read_text())
    scale = content["parameters"]["heat_capacity_scale"]
    assert scale["vary"]
    assert scale["value"] == pytest.approx(1.1, abs=0.01)
    assert content["data"]["waveform"]["text"] == "step to 9 V"
    again = read_fit("fit.json")
    assert again.in_time
    assert again.band.time_us.values.tolist() == times.tolist()
    assert Path("page/fit_in_time.pdf").exists()
    content["data"]["waveform"]["volts"] = [9.0, 9.0, 9.0]
    Path("bad.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="data: waveform: expected the one that belongs"):
        read_fit("bad.json")
    for words in (("data.csv", "--column", "t (ms)=Time"), ("iv.csv", "--fit", "fit.json")):
        Path("iv.csv").write_text("V_b (V),I_h (mA)\n1,0.14\n2,0.28\n3,0.42\n")
        Path("data.csv").write_text("Time/ms,V_b (V),I_h (mA)\n0.001,9,1.28\n0.002,9,1.27\n")
        assert "expects a slow sweep of the bias" in refused("calibrate", *words, below_notes=True)


def test_the_full_lever_too_is_one_whose_holder_stays_cold():
    on_chip = Probe.reference().with_(chip_K_per_mW=20.0)
    with on_coarse_meshes():
        model = ExperimentInTime.of(on_chip, np.array([1.0, 500.0]), step(6.0), ["n_d"])
    at = model.predict(on_chip)
    # by the same mesh there is nothing to correct
    confirmed = model.confirmed(at).predict(on_chip, at)
    np.testing.assert_allclose(confirmed.values, at.values, rtol=1e-4)


def test_very_many_rows_lie_on_a_spline_between_few(coarse):
    rows = np.linspace(0.01, 40.0, 2000)
    model = ExperimentInTime.of(coarse.probe, rows, WAVE, ["n_d"], lever=coarse)
    at = model.times.at
    assert at.size < 120

    def shape(t):
        # diffusion at first, then a time constant, and cooling from 30 µs on
        return np.sqrt(t) / (3.0 + np.sqrt(t)) - 0.3 * np.exp(-np.maximum(t - 30.0, 0.0) / 9.0)

    seen = model.times.at_rows(np.stack([shape(at), np.full(at.size, np.nan), shape(at)]))
    np.testing.assert_allclose(seen[::2], np.stack([shape(rows)] * 2), atol=2e-4)
    # a lever without a bridge shows none, whatever else it does
    assert np.isnan(seen[1]).all()


PULSE = "t (us),V_b (V),I_h (mA)\n"


def test_a_wave_form_is_found_in_noise(folder):
    times = np.arange(-2.0, 30.0, 0.1)
    on = (times > 0.0) & (times < 10.05)
    bias = 8.0 * on + np.random.default_rng(0).normal(0.0, 0.02, times.size)
    rows = "".join(
        f"{1e3 * t:.0f},{v:.4f},{i}\n" for t, v, i in zip(times, bias, on * 1, strict=True)
    )
    data = read(PULSE.replace("us", "ns") + rows)
    wave = data.waveform
    assert len(wave.times) < 12
    np.testing.assert_allclose(data.time_us, times + 2.0, atol=1e-9)
    middle = [1.0, 3.0, 11.0, 20.0]
    np.testing.assert_allclose(wave.bias(np.array(middle)), [0.0, 8.0, 8.0, 0.0], atol=0.02)
    assert "V_b jumps" in data.notes[0]
    assert data.along[1] == "µs"


def test_bias_and_current_follow_from_the_lever_voltage(folder):
    text = "# R_s (kOhm): 5\nt (s),V_l (V)\n0,0\n1e-6,1.0\n2e-6,1.5\n"
    data = read(text, step(6.0))
    # when the bias jumps nothing is known
    np.testing.assert_allclose(data.current_mA, [np.nan, 1.0, 0.9])
    assert "the bias jumps at this time" in data.notes[-1]
    with_both = read("# R_s (kOhm): 5\nt (s),V_l (V),I_h (mA)\n1e-6,1.0,1\n2e-6,1.5,0.9\n")
    np.testing.assert_allclose(with_both.bias_V, [6.0, 6.0])
    assert (with_both.waveform.times[0], with_both.waveform.before_V) == (0.0, 0.0)


def test_a_slow_sweep_with_times_stays_one(folder):
    data = read("time (s),V_b (V),I_h (mA)\n0,1,0.1\n1,2,0.2\n")
    assert data.time_us is None
    assert "column 'time (s)' is not used" in data.unused[0]
    assert read("time (s),V_b (V),I_h (mA)\n09:51:02,1,0.1\n09:51:03,2,0.2\n").time_us is None


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (
            PULSE + "0,0,0\n1,0,0\n1,5,0.5\n",
            {},
            "line 4: t is '1', expected a time after that above, '1'",
        ),
        (PULSE + "1,0,0\n,5,0.5\n3,5,0.5\n", {}, "line 3: t is '', expected a time"),
        (PULSE + "1,0,0\n2,,0.5\n", {}, "line 3: V_b is '', expected a bias"),
        (PULSE + "-1,4,0.1\n2,4,0.5\n", {}, r"line 2: V_b is 4 V at -1 µs, expected a bias of 0"),
        (PULSE + "-1,0,0\n2,4,0.5\n", {"waveform": step(4.0)}, "t is '-1', expected times from 0"),
        (PULSE + "1,0,0\n2,4,x\n", {}, "line 3: I_h: found 'x', expected a number"),
        (PULSE + "x1,0,0\n", {"waveform": step(4.0)}, "line 2: t: found 'x1', expected a number"),
        ("t (us),I_h (mA)\n1,0.1\n2,0.2\n", {}, "or a wave form such as --pulse"),
        ("V_b (V),I_h (mA)\n1,0.1\n2,0.2\n", {"waveform": step(4.0)}, "no column of the time"),
        ("t (us),V_l (V)\n1,1\n2,1\n", {"waveform": step(4.0)}, "and R_s alone"),
    ],
    ids=str,
)
def test_what_is_wrong_is_said(folder, text, options, message):
    with pytest.raises(InputError, match=message):
        read(text, **options)


def test_noise_without_a_wave_form_is_refused(folder):
    noise = np.random.default_rng(0).uniform(0.0, 9.0, 2000)
    rows = "".join(f"{t},{v:.3f},0.1\n" for t, v in enumerate(noise))
    bumps = "".join(f"{t},{9 * (t // 3 % 2)},0.1\n" for t in range(3000))
    for text in (rows, bumps):
        with pytest.raises(InputError, match="more than 500 straight parts"):
            read(PULSE + text)


@pytest.mark.parametrize(
    ("wave", "options", "message"),
    [
        (step(4.0), {"free": ["heater_width_um"]}, "heater_width_um: cannot be varied in time"),
        (sine(3.0, 0.5, 2e4), {}, "begins at 3 V"),
        (step(4.0), {"fixed": {"heat_capacity_scale": None}}, "all parameters are fixed"),
        (step(4.0), {"free": ["n_d", "p", "a0"]}, "fix some or measure at more times"),
    ],
    ids=str,
)
def test_what_cannot_be_varied_is_said(coarse, wave, options, message):
    measured = Measurement.in_time([1.0, 2.0], wave, [0.5, 0.5])
    with pytest.raises(InputError, match=message):
        fit(measured, coarse.probe, **options)


def test_columns_that_do_not_match_are_refused():
    for times, current in (([1.0, 2.0], [1.0]), ([2.0, 1.0], [1.0, 1.0])):
        with pytest.raises(InputError, match="expected times that rise"):
            Measurement.in_time(times, WAVE, current)
