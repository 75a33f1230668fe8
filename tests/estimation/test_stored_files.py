"""Files that former versions wrote are read, and go on to be used."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from experiments import on_coarse_meshes
from hotlever.errors import InputError
from hotlever.estimate import calibrate, read_calibration, read_fit

FOLDERS = sorted((Path(__file__).parents[1] / "stored").iterdir())

each_version = pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)


@each_version
def test_a_fit_says_what_it_said(folder):
    content = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    fit = read_fit(folder / "fit.json")
    assert fit.describes_data
    assert set(fit.parameters) == set(content["parameters"])
    for name, stated in content["parameters"].items():
        parameter = fit.parameters[name]
        assert (parameter.value, parameter.vary) == (stated["value"], stated["vary"])
        assert parameter.stderr == pytest.approx(stated["stderr"], rel=1e-12)
    assert fit.inversion_temperature_K == pytest.approx(content["inversion_temperature_K"])
    assert fit.observables == tuple(content["observables"])
    # it can be solved, and is as near to its data as it was
    off = fit.model().current_mA.values - fit.measurement.current_mA
    rms = float(np.sqrt(np.mean(off**2)))
    assert rms == pytest.approx(content["residual_rms"]["current_mA"], rel=0.02)


@each_version
def test_a_calibration_says_what_it_said(folder):
    content = json.loads((folder / "calibration.json").read_text(encoding="utf-8"))
    calibration = read_calibration(folder / "calibration.json")
    table = content["table"]
    assert calibration.describes_data
    for column in ("bias_V", "tip_K", "tip_stderr_K", "tip_low_K", "tip_high_K"):
        np.testing.assert_array_equal(calibration.table[column], [row[column] for row in table])
    # tables of 0.1.0 have rows 50 K apart, and no jump
    tips = calibration.table.tip_K.values
    assert np.isfinite(calibration.bias_for(np.linspace(tips.min(), tips.max(), 300))).all()
    hottest = table[-1]
    assert calibration.bias_for(hottest["tip_K"]) == pytest.approx(hottest["bias_V"])
    assert calibration.knee.power_mW == content["knee"]["power_mW"]


def test_a_calibration_of_pulses_says_what_it_said():
    path = FOLDERS[0] / "calibration.json"
    heights = json.loads(path.read_text(encoding="utf-8"))["pulse"]["table"]
    peak = read_calibration(path).pulse.tip_temperature(heights[-1]["height_V"])
    assert peak == pytest.approx(heights[-1]["peak_K"])


@each_version
def test_what_is_written_again_is_the_same(folder):
    for name, read in (("fit", read_fit), ("calibration", read_calibration)):
        before = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
        after = read(folder / f"{name}.json").content()
        before.get("options", {}).pop("drift", None)  # zeros drift no more
        # those of calibrations stand beside the data, and so do now those of fits
        weights = before["data"].pop("weights", [])
        assert weights == list(after["weights"].values() if weights else [])
        # with uncertain laws, as calibrations have them, it had the error by doping and p alone
        stderr = "inversion_temperature_stderr_K"
        if name == "fit":
            assert after[stderr] == pytest.approx(before[stderr], rel=1e-5)
        for key in before.keys() - {"software", "tip_temperature_uncertainty_K", stderr}:
            if key in ("correlation", "priors", "parameters"):
                continue  # the same to rounding, with more said of each
            assert of_before(before[key], after[key]) == before[key], key


def test_a_fit_whose_zeros_drifted_is_refused(tmp_path):
    content = json.loads((FOLDERS[0] / "fit.json").read_text(encoding="utf-8"))
    content["options"]["drift"] = True
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=r"fit\.json: options: zeros that drift are no part of"):
        read_fit(path)


def of_before(before, after):
    """What is written now, without the keys that a file did not have then."""
    if isinstance(before, list) and len(before) == len(after):
        return [of_before(*pair) for pair in zip(before, after, strict=True)]
    if not isinstance(before, dict):
        return after
    return {key: of_before(value, after.get(key)) for key, value in before.items()}


@each_version
@pytest.mark.slow
def test_a_lever_that_was_fitted_is_calibrated(folder):
    fit = read_fit(folder / "fit.json")
    with on_coarse_meshes():
        calibration = calibrate(fit.measurement, fit=fit)
    assert calibration.describes_data
    stored = read_calibration(folder / "calibration.json").table
    away = np.interp(stored.bias_V, calibration.table.bias_V, calibration.table.tip_K)
    assert np.all(np.abs(away - stored.tip_K) < 3.0 * stored.tip_stderr_K)
