"""Calibrations of twin levers: right temperatures, honest errors, clear words."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import asdict, replace

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.estimate import calibrate, read_calibration
from hotlever.estimate.diagnosis import Diagnosis
from hotlever.estimate.knee import curve_of_law, curve_of_model
from hotlever.estimate.options import DiagnosisOptions, Numerics
from hotlever.estimate.power_law import EQ12, read_power_law
from hotlever.estimate.summary import calibration_text
from hotlever.estimate.tip_table import TABLE_COLUMNS
from hotlever.lever import Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.materials.departures import DEPARTURES
from hotlever.probe import Circuit, Probe
from hotlever.probe.priors import PriorUse, as_known, default_priors
from made_up import GONE, damaged
from synthetic_curves import measured_curve, measurement_of

#: Keys of the budget after the GUM, which older files have not.
GUM = (
    *("gum", "gum_bias_V", "effective_dof", "coverage_factor", "expanded_uncertainty_K"),
    *("gum_monte_carlo", "gum_linear", "gum_of"),
)

pytestmark = pytest.mark.usefixtures("coarse_meshes")


@pytest.fixture(scope="module")
def noted(reference):
    """The reference lever, measured with noise and calibrated as if unknown.

    And the levers that were solved from the cold for it.
    """
    from_the_cold, linearised = [], SimilarLevers.linearised

    def noting(levers, probe, reach, near=None, names=None):
        if near is None:
            from_the_cold.append(probe)
        return linearised(levers, probe, reach, near, names)

    curve = measured_curve(reference, np.random.default_rng(0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SimilarLevers, "linearised", noting)
        return calibrate(measurement_of(curve)), from_the_cold


@pytest.fixture(scope="module")
def calibrated(noted):
    return noted[0]


def test_the_lever_as_stated_is_solved_once_from_the_cold(noted):
    """It is compared with the data, and the search begins with it."""
    assert len(noted[1]) == 1


def test_the_table_gives_the_true_temperature(calibrated, reference):
    table = calibrated.table
    true = reference.tip_temperature(table.power_mW)
    assert np.nanmax(np.abs(table.tip_K - true)) < 15.0
    assert np.diff(table.tip_K).max() < 11.0
    assert np.all(np.diff(table.power_mW) > 0)
    bias = calibrated.probe.circuit.bias(table.lever_V, table.current_mA)
    np.testing.assert_allclose(bias, table.bias_V, rtol=1e-9)


def test_the_bias_for_a_temperature_is_that_of_the_lever(calibrated, lever, reference):
    target_K = np.array([400.0, 700.0, 1000.0])
    exact = reference.bias(target_K, lever.circuit)
    np.testing.assert_allclose(lever.sweep(exact).tip_K, target_K, atol=0.05)
    np.testing.assert_allclose(calibrated.bias_for(target_K), exact, atol=0.1)
    other = Circuit(series_resistance_ohm=3000.0)
    np.testing.assert_allclose(
        calibrated.bias_for(target_K, other), reference.bias(target_K, other), atol=0.1
    )
    power = calibrated.table.power_mW.values[[20, 80]]
    np.testing.assert_allclose(
        calibrated.tip_temperature(power), calibrated.table.tip_K.values[[20, 80]]
    )
    assert np.isnan(calibrated.bias_for([294.0, 1500.0])).all()


def test_the_knee_is_that_of_the_estimated_lever(calibrated, reference):
    assert calibrated.k == 1.0  # in vacuum the law is the lever's own
    assert calibrated.power_law.threshold_mW == pytest.approx(calibrated.knee.power_mW, rel=1e-6)
    knee, true = calibrated.knee, reference.knee
    for name in ("lever_V", "current_mA", "power_mW", "tip_K"):
        error = getattr(knee, f"{name}_stderr")
        assert 0 < error < 0.03 * getattr(true, name)
        assert abs(getattr(knee, name) - getattr(true, name)) < 4 * error


def test_the_budget_adds_up_and_every_source_counts(calibrated):
    budget = calibrated.table.budget_K
    sources = {"measurement", "electronics", "base temperature", "geometry", "material", "model"}
    assert set(budget.source.values) == sources | {"laws"}
    together = np.sqrt((budget**2).sum("source"))
    np.testing.assert_allclose(calibrated.table.tip_stderr_K, together)
    assert (budget.max("bias") > 0.1).all()
    assert calibrated.tip_temperature_uncertainty_K == np.nanmax(calibrated.table.tip_stderr_K)
    table = calibrated.table
    np.testing.assert_allclose(table.tip_high_K - table.tip_low_K, 3.92 * table.tip_stderr_K)


def assert_same(content, before):
    """Compare contents of files: a covariance is made of standard errors and correlations."""
    stderr = "inversion_temperature_stderr_K"
    assert content[stderr] == pytest.approx(before[stderr], rel=1e-12)
    assert content | {stderr: None} == before | {stderr: None}


def test_the_budget_after_the_gum_is_the_table_s_row_by_row(calibrated, tmp_path):
    content = calibrated.content()
    hottest, rows = calibrated.table.isel(bias=-1), content["gum"]
    stderr = hottest.tip_stderr_K.item()
    assert content["gum_bias_V"] == hottest.bias_V.item() == calibrated.table.bias_V.max()
    parts = {row["quantity"]: row["contribution_K"] for row in rows}
    assert np.linalg.norm(list(parts.values())) == pytest.approx(stderr, rel=1e-6)
    # a law has one row, whatever its coefficients
    of_laws = {name for each in DEPARTURES.values() for name in each.names}
    others = {name for name in calibrated.priors if name not in of_laws}
    laws = {f"law.{law}" for law in DEPARTURES}
    assert set(parts) == {"noise of current", "model", *others, *laws}
    together = np.linalg.norm([parts[law] for law in laws])
    assert together == pytest.approx(hottest.budget_K.sel(source="laws").item(), rel=1e-6)
    for source, names in {
        "measurement": ("noise of current", "current_scale"),
        "electronics": ("series_resistance_ohm",),
    }.items():
        together = np.linalg.norm([parts[name] for name in names])
        of_table = hottest.budget_K.sel(source=source).item()
        assert together == pytest.approx(of_table, rel=1e-6)
    # what was estimated, and the prior beside it
    by_name = {row["quantity"]: row for row in rows}
    for name in others:
        use = calibrated.priors[name]
        assert (by_name[name]["estimate"], by_name[name]["prior"]) == (
            use.posterior_value,
            use.value,
        )
    coefficients = calibrated.probe.values(DEPARTURES["kappa"].names)
    at_1000_K = float(coefficients @ DEPARTURES["kappa"].modes(1000.0))
    assert by_name["law.kappa"]["estimate"] == pytest.approx(at_1000_K)
    assert by_name["law.kappa"]["prior"] == 0.0
    assert by_name["model"]["prior"] is None
    for row in rows:
        assert abs(row["sensitivity"]) * row["u"] == pytest.approx(row["contribution_K"])
        assert (row["type"] == "A") == (row["quantity"] == "noise of current")
        assert (row["dof"] is None) == (row["type"] == "B")
    # of forty data the fit has taken up several; what models are off by is in the error as well
    assert 15.0 < rows[0]["dof"] < 60.0
    assert content["expanded_uncertainty_K"] == content["coverage_factor"] * calibrated.gum.budget.u
    effective = stderr**4 / (rows[0]["contribution_K"] ** 4 / rows[0]["dof"])
    assert content["effective_dof"] == pytest.approx(effective)
    old = {key: value for key, value in content.items() if key not in GUM}
    (tmp_path / "old.json").write_text(json.dumps(old))
    assert_same(read_calibration(tmp_path / "old.json").content(), old)


def test_priors_say_what_was_known_and_what_the_data_made_of_it(calibrated):
    priors = default_priors(as_known(Probe.reference(), None))
    assert set(calibrated.priors) == {*priors, "current_scale"}
    use = calibrated.priors["n_d"]
    assert (use.value, use.spread) == (5.75e17, pytest.approx(0.15 * 5.75e17))
    assert use.posterior_spread < use.spread
    assert calibrated.describes_data
    text = calibration_text(calibrated)
    assert "as known before, since the data do not tell: " in text
    assert "gap_um" in text


def test_what_is_far_from_its_prior_is_asked_about(calibrated, reference, monkeypatch):
    """Of usual levers nothing is."""
    assert not [note for note in calibrated.notes if "from what is known of" in note]
    monkeypatch.setattr(Diagnosis, "named", lambda *_: "is it in air?")
    easily = Numerics(diagnosis=DiagnosisOptions(doubtful_shift=0.1))
    curve = measured_curve(reference, np.random.default_rng(0))
    doubted = calibrate(measurement_of(curve), priors={"laws": "paper"}, numerics=easily)
    (note,) = (note for note in doubted.notes if "from what is known of" in note)
    assert doubted.describes_data
    found = re.match(r"the data are \d\.\d σ from what is known of (\w+), .*; is it in air\?", note)
    assert found is not None
    assert found[1] in doubted.priors


def test_nobody_is_told_to_measure_what_was_measured(calibrated):
    """Temperatures were advised beside 24 of them."""
    known = replace(calibrated, observables=(*calibrated.observables, "tip"))
    with_some = calibration_text(known)
    without = calibration_text(calibrated)
    assert "tip temperatures at some points" in without
    assert "more tip temp" not in without
    assert "more tip temperatures" in with_some
    assert "at some points" not in with_some


def test_a_power_law_is_used_by_the_paper_s_rule(calibrated, lever_3):
    curve = measured_curve(lever_3, np.random.default_rng(1), to_V=9.5)
    law = calibrated.power_law
    with_law = calibrate(measurement_of(curve), law=law)
    error = np.abs(with_law.table.tip_K - lever_3.tip_temperature(with_law.table.power_mW))
    assert np.nanmax(error / (with_law.table.tip_stderr_K + 1.0)) < 2.0
    assert with_law.table.budget_K.sel(source="power law").max() < 40.0
    assert set(with_law.table.source.values) >= {"k", "electronics", "other levers"}
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
    assert read_power_law(path) == calibrated.power_law
    rows = list(csv.DictReader(io.StringIO(calibrated.table_csv())))
    tips = [float(row["tip_K"]) for row in rows]
    assert [tips[0], tips[-1]] == pytest.approx(
        [content["table"][end]["tip_K"] for end in (0, -1)], rel=1e-5
    )


def test_rows_even_in_temperature_are_the_lever_s(calibrated):
    rows = list(csv.DictReader(io.StringIO(calibrated.table_csv("temperature", 20.0))))
    steep = [row for row in rows if row["tip_K"] in ("400", "600", "700", "800", "900", "1100")]
    assert len(steep) == 6
    sweep = Lever(calibrated.probe).sweep([float(row["bias_V"]) for row in steep])
    np.testing.assert_allclose([float(row["tip_K"]) for row in steep], sweep.tip_K, atol=0.5)


def test_a_knee_outside_is_estimated_with_a_larger_error(reference, calibrated):
    law = calibrated.power_law
    within, beyond = (
        calibrate(
            measurement_of(measured_curve(reference, np.random.default_rng(2), to_V=to_V)), law=law
        )
        for to_V in (11.0, 7.6)
    )
    assert within.knee.measured
    assert not beyond.knee.measured
    assert any("estimated from the points below it" in note for note in beyond.notes)
    stderr = beyond.knee.power_mW_stderr
    assert stderr > 2 * within.knee.power_mW_stderr
    assert abs(beyond.knee.power_mW - reference.knee.power_mW) < 3 * stderr
    content = beyond.content()
    assert content["knee"]["lever_V"] is None
    assert content["knee"]["measured"] is False


def test_a_curve_too_cold_is_refused_by_the_rule(reference):
    curve = measured_curve(reference, np.random.default_rng(3), to_V=1.8, from_V=0.9)
    with pytest.raises(InputError, match=r"too cold|too little to calibrate with"):
        calibrate(measurement_of(curve), law=EQ12)
    few = replace(measurement_of(curve.rows(np.arange(3))), path="iv.csv")
    with pytest.raises(InputError, match=r"^iv.csv: 3 points with bias and current"):
        calibrate(few, law=EQ12)


def test_a_knee_of_another_power_is_refused_by_the_rule(reference):
    """Bias and current in other units have the resistance of such a lever, and a knee."""
    data = measurement_of(measured_curve(reference, np.random.default_rng(3)))
    wrong = replace(data, bias_V=data.bias_V / 1e3, current_mA=data.current_mA / 1e3)
    with pytest.raises(InputError, match="expected within a factor of 100; are bias and current"):
        calibrate(wrong, law=EQ12)


def test_routes_exclude_each_other(reference):
    curve = measurement_of(measured_curve(reference, np.random.default_rng(4)))
    with pytest.raises(InputError, match="exclude each other"):
        calibrate(curve, law=EQ12, probe=Probe.reference())
    with pytest.raises(InputError, match="leave the medium out"):
        calibrate(curve, law=EQ12, medium="air")
    with pytest.raises(InputError, match="the paper's rule has no posterior"):
        calibrate(curve, law=EQ12, samples=10)


@pytest.mark.slow
def test_posterior_samples_of_a_usual_lever_are_enough_and_near_its_limits(calibrated):
    """Beyond the knee, where data pull on a tip that gets hotter more than on one that does not."""
    sampled = calibrate(calibrated.measurement, samples=2000)
    assert any("quantiles of posterior samples" in note for note in sampled.notes)
    np.testing.assert_allclose(sampled.table.tip_K, calibrated.table.tip_K, atol=0.01)
    for name in ("tip_low_K", "tip_high_K"):
        limits, usual = (each.table[name] - each.table.tip_K for each in (sampled, calibrated))
        np.testing.assert_allclose(limits, usual, rtol=0.3)


def test_a_scaled_model_is_the_paper_s_rule(reference):
    curve = curve_of_model(reference)
    power = np.linspace(0.5, 4.0, 8)
    np.testing.assert_allclose(
        curve.at(1.29 * power, 1.29 * reference.knee.power_mW), reference.tip_temperature(power)
    )
    law = curve_of_law(EQ12, 293.0)
    np.testing.assert_allclose(law.at(1.29 * power, 1.29 * 2.95), EQ12.tip_temperature(power))


def test_a_calibration_file_is_read_back_whole(calibrated, tmp_path):
    path = tmp_path / "cal.json"
    calibrated.write(path)
    again = read_calibration(path)
    assert_same(again.content(), calibrated.content())
    np.testing.assert_array_equal(
        again.bias_for([500.0, 900.0]), calibrated.bias_for([500.0, 900.0])
    )
    assert repr(again) == repr(calibrated)


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("probe",), GONE, "not a calibration file (hotlever calibrate -o): probe is missing"),
        (("data",), 3, "data = 3"),
        (("data", "columns"), {"I_h": [1.0]}, "columns: V_b is missing"),
        (("data", "columns", "I_h"), [1.0, 2.0], "I_h: expected numbers in 40 places"),
        (("knee",), "none", "knee = 'none'"),
        (("table",), [], "expected rows of rising bias"),
        (("table",), [{"bias_V": 1.0, "tip_K": None}], "expected a tip temperature (tip_K)"),
        (("table", 5, "tip_K"), "hot", "tip_K = 'hot'"),
        (("budget_K", "k"), [1.0], "budget_K: k: expected numbers in 1"),
        (("power_law", "exponents"), 2.0, "did you mean 'exponent'"),
        (("k",), 10**400, "expected a finite number"),
        (("notes",), {}, "notes = {}"),
        (("gum_bias_V",), 99.0, "gum_bias_V: expected the bias of a row of the table"),
        (("gum", 0, "type"), "C", "gum.0.type = 'C'"),
        (("gum", 0, "u"), None, "gum.0.u = None"),
        (("gum", 0, "dof"), 0.0, "gum.0.dof = 0: expected more than 0"),
        (("k_stderr",), -1.0, "k_stderr = -1: expected at least 0"),
        (
            *(("priors", "n_q"), asdict(PriorUse(1.0, 0.1, 1.0, 0.1))),
            "unknown prior 'n_q': did you mean 'n_d'",
        ),
        (("route",), "by eye", "route = 'by eye'"),
        (("gum_correlation",), [[1.0]], "gum_correlation: expected numbers in"),
    ],
)
def test_damaged_calibration_files_get_one_line(calibrated, tmp_path, keys, value, message):
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(damaged(calibrated.content(), *keys, value=value)))
    with pytest.raises(InputError, match=re.escape(message)) as no:
        read_calibration(path)
    assert "\n" not in str(no.value)


def test_a_budget_out_of_the_data_is_refused_before_the_work(calibrated, monkeypatch):
    monkeypatch.setattr("hotlever.estimate.estimator.solve", None)
    with pytest.raises(InputError, match="at 99 V: expected a bias in the measured range, from"):
        calibrate(calibrated.measurement, at_V=99.0)


def test_what_is_no_json_is_no_calibration(tmp_path):
    for text in ("", "[", "[" * 5000, '{"k": NaN}', "3"):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(InputError, match=r"bad\.json"):
            read_calibration(tmp_path / "bad.json")
