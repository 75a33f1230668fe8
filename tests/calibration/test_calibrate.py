"""Calibrations of twin levers: right temperatures, honest errors, clear words."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

from hotlever.calibration.budget import (
    Tolerances,
    fit_variations,
    geometry_variations,
    material_variations,
    refitted,
)
from hotlever.calibration.calibration import TABLE_COLUMNS, read_calibration
from hotlever.calibration.knee import IVCurve
from hotlever.calibration.power_law import EQ12, read_power_law
from hotlever.calibration.procedure import calibrate
from hotlever.calibration.transfer import curve_of_law, curve_of_model
from hotlever.errors import InputError
from hotlever.fitting import Measurement, fit, read_fit
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Circuit, Probe
from hotlever.spieser2017 import published
from made_up import GONE, damaged
from synthetic_curves import measured_curve

#: Leave out what needs other levers to be solved.
FEW = Tolerances(geometry=0.0, material=0.0)


def measurement_of(curve: IVCurve) -> Measurement:
    nothing = np.full(curve.bias_V.size, np.nan)
    return Measurement(curve.bias_V, curve.current_mA, nothing, nothing, nothing)


@pytest.fixture(scope="module")
def calibrated(reference):
    """The reference lever, measured with noise and calibrated as if unknown."""
    curve = measured_curve(reference, np.random.default_rng(0))
    return calibrate(measurement_of(curve))


@pytest.fixture(scope="module")
def example():
    return Path(__file__).parents[2] / "examples" / "lever-a.csv"


@pytest.fixture(scope="module")
def shared_fit(tmp_path_factory, example):
    """A fit file of an example measurement."""
    path = tmp_path_factory.mktemp("fit") / "fit.json"
    fit(example).write(path)
    return path


def test_the_table_gives_the_true_temperature(calibrated, reference):
    table = calibrated.table
    true = reference.tip_temperature(table.power_mW)
    assert np.nanmax(np.abs(table.tip_K - true)) < 15.0
    assert table.sizes["bias"] == 101
    assert np.all(np.diff(table.power_mW) > 0)
    np.testing.assert_allclose(table.lever_V + 5.6 * table.current_mA, table.bias_V, rtol=1e-9)


def test_the_bias_for_a_temperature_is_that_of_the_lever(calibrated, lever, reference):
    wanted = np.array([400.0, 700.0, 1000.0])
    exact = reference.bias(wanted, lever.circuit)
    np.testing.assert_allclose(lever.sweep(exact).tip_K, wanted, atol=0.05)
    np.testing.assert_allclose(calibrated.bias_for(wanted), exact, atol=0.1)
    other = Circuit(series_resistance_ohm=3000.0)
    np.testing.assert_allclose(
        calibrated.bias_for(wanted, other), reference.bias(wanted, other), atol=0.1
    )
    power = calibrated.table.power_mW.values[[20, 80]]
    np.testing.assert_allclose(
        calibrated.tip_temperature(power), calibrated.table.tip_K.values[[20, 80]]
    )
    assert np.isnan(calibrated.bias_for([294.0, 1500.0])).all()


def test_k_is_the_power_of_the_knee_over_the_threshold(calibrated, reference):
    assert calibrated.k == pytest.approx(1.0, abs=0.015)
    assert calibrated.k == calibrated.knee.power_mW / calibrated.power_law.threshold_mW
    assert calibrated.power_law.threshold_mW == pytest.approx(reference.knee.power_mW, rel=1e-3)
    assert calibrated.knee_tip_K == pytest.approx(reference.knee.tip_K, abs=1.0)


def test_the_budget_adds_up_and_every_source_counts(calibrated):
    budget = calibrated.table.budget_K
    assert set(budget.source.values) == {"k", "electronics", "geometry", "material"}
    together = np.sqrt((budget**2).sum("source"))
    np.testing.assert_allclose(calibrated.table.tip_stderr_K, together)
    assert (budget.max("bias") > 0.3).all()
    assert calibrated.tip_temperature_uncertainty_K == np.nanmax(calibrated.table.tip_stderr_K)


def test_another_lever_is_within_a_few_stated_errors(calibrated, lever_3):
    curve = measured_curve(lever_3, np.random.default_rng(1), to_V=9.5)
    law = calibrated.power_law
    with_law = calibrate(measurement_of(curve), law=law, tolerances=FEW)
    error = np.abs(with_law.table.tip_K - lever_3.tip_temperature(with_law.table.power_mW))
    stated = np.hypot(
        with_law.table.tip_stderr_K, calibrated.table.budget_K.sel(source="material").max()
    )
    assert np.nanmax(error / stated) < 2.0
    assert with_law.table.budget_K.sel(source="power law").max() < 40.0
    assert with_law.route == "power law"
    assert with_law.power_law == law


def test_calibration_files(calibrated, tmp_path):
    path = tmp_path / "cal.json"
    calibrated.write(path)
    content = json.loads(path.read_text())
    assert {"power_law", "k", "knee", "tip_temperature_uncertainty_K", "table"} <= set(content)
    assert set(content["knee"]) >= {"lever_V", "current_mA", "power_mW", "tip_K"}
    assert content["power_law"]["threshold_K"] > 850
    assert set(content["table"][0]) == set(TABLE_COLUMNS)
    assert len(content["table"]) == 101
    assert read_power_law(path) == calibrated.power_law
    rows = list(csv.DictReader(io.StringIO(calibrated.table_csv())))
    assert float(rows[50]["tip_K"]) == pytest.approx(content["table"][50]["tip_K"], rel=1e-5)


def test_a_knee_outside_is_estimated_with_a_larger_error(reference, calibrated):
    curve = measured_curve(reference, np.random.default_rng(2), to_V=7.6)
    estimated = calibrate(
        measurement_of(curve), law=calibrated.power_law, tolerances=Tolerances(geometry=0.0)
    )
    assert not estimated.knee.measured
    assert any("estimated from the points below it" in note for note in estimated.notes)
    found, stderr = estimated.knee.power_mW, estimated.knee.power_mW_stderr
    assert stderr > 2 * calibrated.knee.power_mW_stderr
    assert abs(found - reference.knee.power_mW) < 3 * stderr
    content = estimated.content()
    assert content["knee"]["lever_V"] is None
    assert content["knee"]["measured"] is False


def test_a_curve_too_cold_is_refused(reference):
    curve = measured_curve(reference, np.random.default_rng(3), to_V=1.8, from_V=0.9)
    with pytest.raises(InputError, match=r"too cold|too little to calibrate with"):
        calibrate(measurement_of(curve), law=EQ12, tolerances=FEW)


def test_routes_exclude_each_other(reference):
    curve = measurement_of(measured_curve(reference, np.random.default_rng(4)))
    with pytest.raises(InputError, match="exclude each other"):
        calibrate(curve, law=EQ12, probe=Probe.reference())
    with pytest.raises(InputError, match="leave the medium out"):
        calibrate(curve, law=EQ12, medium="air")


def test_a_scaled_model_is_the_paper_s_rule(reference):
    curve = curve_of_model({"vacuum": reference}, "vacuum")
    power = np.linspace(0.5, 4.0, 8)
    np.testing.assert_allclose(
        curve.at(1.29 * power, 1.29 * reference.knee.power_mW), reference.tip_temperature(power)
    )
    law = curve_of_law(EQ12, 293.0)
    np.testing.assert_allclose(law.at(1.29 * power, 1.29 * 2.95), EQ12.tip_temperature(power))


def test_a_measured_knee_takes_the_place_of_the_model_s(reference):
    """A model whose knee is 6 % off leaves the temperature of its own lever as it is."""
    measured = 1.06 * reference.knee.power_mW
    curve = curve_of_model({"vacuum": reference}, "vacuum", ("vacuum", measured))
    power = np.linspace(0.5, 4.0, 8)
    np.testing.assert_allclose(curve.at(power, measured), reference.tip_temperature(power))


def test_variations_are_of_the_size_asked_for(shared_fit):
    probe = Probe.reference()
    names = [variation.name for variation in geometry_variations(probe, 0.05)]
    assert "heater_width_um" in names
    assert "reader_length_um" not in names
    assert list(geometry_variations(probe, 0.0)) == []
    materials = [variation.probe.material for variation in material_variations(probe)]
    mean = np.mean([np.log(material.n_d) for material in materials])
    assert mean == pytest.approx(np.log(probe.material.n_d))
    fit = read_fit(shared_fit)
    origin = np.array([getattr(fit.probe.material, name) for name in fit.names])
    moved = (
        np.array(
            [
                [getattr(variation.probe.material, name) for name in fit.names]
                for variation in fit_variations(fit)
            ]
        )
        - origin
    )
    spread = np.sqrt(np.diag(fit.covariance))
    np.testing.assert_allclose(np.sqrt((moved**2).sum(axis=0)), spread, rtol=0.1)
    with pytest.raises(InputError, match="expected a relative error"):
        Tolerances(geometry=5.0)


def test_errors_of_dimensions_are_made_up_for_by_a_fit(shared_fit):
    """A refitted lever of another heater length shows the data the first one does."""
    fit = read_fit(shared_fit)
    changed = fit.probe.with_(heater_length_um=4.08)
    again = refitted(fit, changed)
    assert again.material != fit.probe.material
    before, wrong, after = (
        Lever(probe, COARSE).sweep([6.0, 8.0, 10.0]).tip_K.values
        for probe in (fit.probe, changed, again)
    )
    assert np.abs(wrong - before).max() > 5.0
    assert np.abs(after - before).max() < 1.0


def test_a_calibration_file_is_read_back_whole(calibrated, tmp_path):
    path = tmp_path / "cal.json"
    calibrated.write(path)
    again = read_calibration(path)
    assert again.content() == calibrated.content()
    np.testing.assert_array_equal(
        again.bias_for([500.0, 900.0]), calibrated.bias_for([500.0, 900.0])
    )
    assert repr(again) == repr(calibrated)


def test_a_fit_as_object_or_file_and_data_as_object_or_file_are_one(shared_fit, example):
    by_path = calibrate(example, fit=shared_fit, tolerances=FEW)
    one = read_fit(shared_fit)
    by_object = calibrate(one.measurement, fit=one, tolerances=FEW)
    np.testing.assert_allclose(by_path.table.tip_K, by_object.table.tip_K)


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("probe",), GONE, "not a calibration file: probe is missing"),
        (("data",), 3, "data = 3"),
        (("data", "columns"), {"I_h": [1.0]}, "columns: V_b is missing"),
        (("data", "columns", "I_h"), [1.0, 2.0], "I_h: expected numbers in 40 places"),
        (("knee",), "none", "knee = 'none'"),
        (("table",), [], "expected rows of rising bias"),
        (("table", 5, "tip_K"), "hot", "tip_K = 'hot'"),
        (("budget_K", "k"), [1.0], "budget_K: k: expected numbers in 101 places"),
        (("power_law", "exponents"), 2.0, "did you mean 'exponent'"),
        (("k",), 10**400, "expected a finite number"),
        (("notes",), {}, "notes = {}"),
    ],
)
def test_damaged_calibration_files_get_one_line(calibrated, tmp_path, keys, value, message):
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(damaged(calibrated.content(), *keys, value=value)))
    with pytest.raises(InputError, match=re.escape(message)) as no:
        read_calibration(path)
    assert "\n" not in str(no.value)


def test_what_is_no_json_is_no_calibration(tmp_path):
    for text in ("", "[", "[" * 5000, '{"k": NaN}', "3"):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(InputError, match=r"bad\.json"):
            read_calibration(tmp_path / "bad.json")


def test_calibrate_command_with_a_fit(run, tmp_path, shared_fit, example):
    status, out, err = run(
        "calibrate", example, "--fit", shared_fit, "-o", "cal.json", "--table", "t.csv",
        "--plot", "cal.png", "--tolerance", "0",
    )  # fmt: skip
    assert status == 0, err
    assert "based on a fit of this lever in vacuum" in out
    content = json.loads((tmp_path / "cal.json").read_text())
    # the data of the fit are those calibrated
    assert content["k"] == pytest.approx(1.0, abs=1e-6)
    assert set(content["uncertainty_budget_K"]) == {"k", "electronics", "fit", "Raman"}
    assert content["tip_temperature_uncertainty_K"] < 40
    assert (tmp_path / "t.csv").read_text().startswith("bias_V,lever_V,current_mA,power_mW,tip_K")
    assert (tmp_path / "cal.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--fit", "a", "--probe", "b"), "--fit and --probe: expected at most one of"),
        (("--medium", "vacum"), "--medium vacum: expected vacuum or air"),
        (("--table", "t.txt"), "unknown file type '.txt'"),
        (("--tolerance", "3"), "geometry = 3, expected a relative error"),
        (("--fit", "none.json"), "none.json: no such file"),
    ],
)
def test_calibrate_command_errors_are_one_line(run, example, arguments, message):
    status, out, err = run("calibrate", example, *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_a_file_without_current_is_refused(run, tmp_path):
    (tmp_path / "iv.csv").write_text("V_b (V),T_tip (K)\n1,300\n2,310\n")
    status, _, err = run("calibrate", "iv.csv")
    assert status == 2
    assert "no values of I_h" in err


def test_air_calibration_uses_the_model_in_air(lever, reference):
    """A lever in air calibrated with the air model, and by the rule of a constant k."""
    air = lever.in_medium("air").branch()
    curve = measurement_of(measured_curve(air, np.random.default_rng(5), to_V=12.0))
    with_model = calibrate(curve, medium="air", tolerances=FEW)
    assert with_model.k == pytest.approx(air.knee.power_mW / reference.knee.power_mW, rel=0.015)
    true = air.tip_temperature(with_model.table.power_mW)
    assert np.nanmax(np.abs(with_model.table.tip_K - true)) < 15.0


def test_published_materials_are_what_a_material_may_be():
    probe = Probe.reference().with_(**published("lever 3").material.model_dump())
    scatter = {variation.name: variation.probe for variation in material_variations(probe)}
    assert set(scatter) == {"lever 1", "lever 2", "lever 3", "lever 4"}
