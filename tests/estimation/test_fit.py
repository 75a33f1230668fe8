"""Fits of twins whose truth is known, and of the example."""

from __future__ import annotations

import dataclasses
import json
from importlib.resources import as_file, files

import numpy as np
import pytest
from fit_twins import BIAS, TRUTH, twin

from experiments import on_coarse_meshes
from hotlever.errors import BranchEndError, ComputationError, InputError
from hotlever.estimate import Measurement, fit, read_fit, read_measurement
from hotlever.estimate.diagnosis import Diagnosis, outlier_notes
from hotlever.estimate.options import Numerics, SearchOptions
from hotlever.estimate.residuals import Residuals
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced_lever import ReducedLever
from hotlever.materials import PARAMETERS
from hotlever.measurement import with_measured_circuit
from hotlever.probe import Probe


@pytest.fixture(scope="module")
def exact_fit(coarse, coarse_model):
    return fit(twin(coarse), model=coarse_model)


@pytest.mark.parametrize("name", PARAMETERS)
def test_exact_data_give_the_true_parameters(exact_fit, name):
    assert exact_fit.parameters[name].value == pytest.approx(TRUTH[name], rel=1e-4)


def test_a_good_optimum_needs_few_steps(exact_fit):
    assert exact_fit.steps <= 10
    assert max(exact_fit.residual_rms.values()) < 0.01


def test_fixed_parameters_are_held_and_marked(coarse, coarse_model):
    result = fit(twin(coarse), fixed={"n_d": TRUTH["n_d"], "a1": None}, model=coarse_model)
    assert result.parameters["n_d"].value == TRUTH["n_d"]
    assert result.parameters["a1"].value == coarse.probe.material.a1
    assert result.parameters["n_d"].stderr is None
    assert not result.parameters["n_d"].vary
    assert result.names == ["c_kappa", "delta", "p", "a0"]
    assert result.correlation.shape == (4, 4)


def test_only_the_chosen_observables_enter(coarse, coarse_model):
    data = twin(coarse)
    wrong_tip = Measurement(
        data.bias_V, data.current_mA, data.reader_V, data.tip_K + 100, data.tip_error_K
    )
    result = fit(wrong_tip, observables=["reader", "current"], model=coarse_model)
    assert result.observables == ("current", "reader")
    assert result.residual_rms["tip_K"] == pytest.approx(100, abs=5)
    assert result.parameters["c_kappa"].value == pytest.approx(TRUTH["c_kappa"], rel=0.02)


def test_a_wrong_point_is_named_and_a_robust_fit_sets_it_aside(coarse, coarse_fast):
    data = twin(coarse, noise=2e-3)
    current = data.current_mA.copy()
    current[3] *= 10  # a wrong decade
    spoilt = Measurement(data.bias_V, current, data.reader_V, data.tip_K, data.tip_error_K)
    robust = fit(spoilt, robust=True, model=coarse_fast)
    assert any(f"current at {BIAS[3]:g} V is" in note for note in robust.notes)
    for name, fitted in robust.parameters.items():
        assert abs(fitted.value - TRUTH[name]) < 5 * fitted.stderr


def test_of_many_wrong_points_the_worst_are_named(coarse):
    data = Measurement.of_sweep(coarse.sweep(np.linspace(1.0, 9.0, 200)))
    values = np.stack([data.current_mA, data.reader_V, data.tip_K])
    data.current_mA[::3] *= 1.1
    data.current_mA[30] *= 2.0
    *named, last = outlier_notes(Residuals(data, ["current", "tip"]), values, robust=False)
    assert len(named) == 10
    assert any(f"at {data.bias_V[30]:g} V" in text for text in named)
    assert last == f"{67 - 10} more data are as far from the fit"


def test_what_the_data_do_not_determine_is_said_in_words(coarse, coarse_model):
    data = twin(coarse, noise=2e-3)
    cold = np.where(BIAS < 5, 1.0, np.nan)
    low_bias = Measurement(
        data.bias_V, data.current_mA * cold, data.reader_V * cold, data.tip_K * cold, cold
    )
    result = fit(low_bias, fixed={"p": None}, model=coarse_model)
    assert any("determined by these data" in note for note in result.notes)
    assert any("hardly told apart" in note for note in result.notes)
    assert "standard error of at most" in result.notes[-1]


def test_data_that_are_all_zero_are_refused(coarse, coarse_model):
    data = twin(coarse)
    dead = Measurement(
        data.bias_V, data.current_mA, 0 * data.reader_V, data.tip_K, data.tip_error_K
    )
    with pytest.raises(InputError, match="all values of reader are 0"):
        fit(dead, model=coarse_model)


def test_order_and_repetition_of_the_rows_do_not_matter(coarse, coarse_model, exact_fit):
    data = twin(coarse)
    rows = np.r_[np.random.default_rng(0).permutation(BIAS.size), 3, 3]
    mixed = Measurement(
        data.bias_V[rows],
        data.current_mA[rows],
        data.reader_V[rows],
        data.tip_K[rows],
        data.tip_error_K[rows],
    )
    result = fit(mixed, model=coarse_model)
    for name in PARAMETERS:
        assert result.parameters[name].value == pytest.approx(
            exact_fit.parameters[name].value, rel=1e-3
        )


def test_the_measured_circuit_wins_and_a_note_says_so(coarse):
    probe, notes = with_measured_circuit(
        Probe.reference(), twin(coarse, series_resistance_ohm=5000.0, base_temperature_K=293.0)
    )
    assert probe.circuit.series_resistance_ohm == 5000.0
    assert notes[1:] == [
        "series_resistance_ohm: the data file's 5000 is used, not the probe's 5600"
    ]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"observables": ["tipp"]}, "did you mean 'tip'"),
        ({"observables": []}, "no observables"),
        ({"numeric": Numerics()}, "did you mean 'numerics'"),
        ({"fixed": {"ckappa": 1.0}}, "did you mean 'c_kappa'"),
        ({"fixed": {"p": -1.0}}, "p = -1: expected at least 0.5"),
        ({"fixed": dict.fromkeys(PARAMETERS)}, "nothing is left to fit"),
    ],
)
def test_impossible_requests_are_refused(coarse, options, message):
    with pytest.raises(InputError, match=message):
        fit(twin(coarse), **options)


def test_an_observable_without_data_is_refused(coarse):
    data = twin(coarse)
    empty = np.full(BIAS.size, np.nan)
    no_tip = Measurement(data.bias_V, data.current_mA, data.reader_V, empty, empty)
    with pytest.raises(InputError, match=r"no values of tip \(column T_tip\)"):
        fit(no_tip, observables=["tip"])


@pytest.mark.parametrize("rows", [1, 30])
def test_too_few_data_are_refused_and_the_same_row_again_is_no_further_datum(rows):
    equal = Measurement(*(np.full(rows, value) for value in (5.0, 0.7, 0.3, 380.0, 5.0)))
    with pytest.raises(InputError, match=r"3 different data for 6 parameters; .* more biases"):
        fit(equal)


@pytest.mark.slow
def test_a_start_that_does_not_reach_the_data_is_no_obstacle(coarse, coarse_fast, monkeypatch):
    """No lever shows them without the resistor, and the fit says so, and what may be behind it."""
    monkeypatch.setattr(Diagnosis, "named", lambda _: "is it the resistor?")
    result = fit(twin(coarse, series_resistance_ohm=0.0), model=coarse_fast)
    assert result.describes_data is False
    assert "is it the resistor?" in result.reason


def test_data_without_a_series_resistor_are_fitted_up_to_the_fold(
    coarse, coarse_model, coarse_fast
):
    """The circuit is none of the lever's business: R_s = 0 is one among others."""
    truth = coarse.probe.material.with_(**TRUTH)
    lever = coarse.with_probe(coarse.probe.with_(series_resistance_ohm=0.0)).with_material(truth)
    data = Measurement.of_sweep(lever.sweep(np.linspace(0.0, 2.9, 13)))
    assert data.series_resistance_ohm == 0.0
    for model in (coarse_model, coarse_fast):
        result = fit(data, fixed={"p": TRUTH["p"]}, model=model)
        assert result.parameters["n_d"].value == pytest.approx(TRUTH["n_d"], rel=1e-2)
        assert result.residual_rms["tip_K"] < 0.05


def test_fit_file_has_the_keys_of_the_contract(exact_fit, tmp_path):
    exact_fit.write(tmp_path / "fit.json")
    content = json.loads((tmp_path / "fit.json").read_text())
    assert set(content["parameters"]) == set(PARAMETERS)
    for entry in content["parameters"].values():
        assert set(entry) == {"value", "stderr", "unit", "vary"}
    assert set(content["correlation"]) == {"names", "matrix"}
    assert set(content["residual_rms"]) == {"current_mA", "reader_V", "tip_K"}
    assert {
        "observables",
        "inversion_temperature_K",
        "evaluations",
        "seconds",
        "probe",
    } <= set(content)
    assert {"path", "sha256"} <= set(content["data"])
    assert Probe.from_sections(content["probe"], "fit") == exact_fit.probe


def test_numbers_that_steer_a_fit_are_told_to_it_and_stand_in_its_file(
    exact_fit, coarse, coarse_model, tmp_path
):
    few = Numerics(search=SearchOptions(most_branches=1))
    result = fit(twin(coarse), model=coarse_model, numerics=few)
    assert exact_fit.describes_data
    assert result.describes_data is None
    result.write(tmp_path / "fit.json")
    assert read_fit(tmp_path / "fit.json").options.numerics == few
    assert "numerics" not in exact_fit.content()["options"]


def test_reduced_and_full_lever_give_the_same_fit_and_good_data_no_suspicion(
    coarse, coarse_model, noisy_fit
):
    """On noisy data, with parameters well away from the start."""
    full, reduced = fit(twin(coarse, noise=2e-3), model=coarse_model), noisy_fit
    assert not any("standard deviations" in note or "zero" in note for note in reduced.notes)
    for name, parameter in full.parameters.items():
        assert parameter.stderr is not None
        assert abs(reduced.parameters[name].value - parameter.value) < 0.1 * parameter.stderr
    for name, rms in full.residual_rms.items():
        assert reduced.residual_rms[name] == pytest.approx(rms, rel=2e-3)


def test_where_the_reduced_lever_fails_a_coarse_one_takes_over(coarse, coarse_fast, monkeypatch):
    def stopped(*_, **__):
        raise ComputationError("stopped")

    monkeypatch.setattr(ReducedLever, "linearised", stopped)
    result = fit(twin(coarse), model=coarse_fast)
    assert result.parameters["c_kappa"].value == pytest.approx(TRUTH["c_kappa"], rel=1e-3)


def test_a_reader_that_the_probe_does_not_have_is_not_fitted():
    lever = Lever(Probe.u_shape(), COARSE)
    sweep = lever.sweep(BIAS)
    data = dataclasses.replace(Measurement.of_sweep(sweep), reader_V=0.3 * sweep.lever_V.values)
    with on_coarse_meshes():
        result = fit(data, lever.probe, fixed={"n_d": None, "p": None})
    assert result.observables == ("current", "tip")
    assert any("the probe has no reader" in note for note in result.notes)
    with pytest.raises(InputError, match="the probe has no reader"):
        fit(data, lever.probe, observables=["reader"])


def test_example_fit_on_the_default_mesh():
    """The virtual-lab lever: an independent solver's data, noise of a few kelvin and 0.3 %."""
    with as_file(files("hotlever") / "examples" / "lever-a.csv") as path:
        result = fit(read_measurement(path))
    # those before the confirmation by full solves, and the few after it
    assert result.steps <= 15
    assert result.residual_rms["current_mA"] < 0.004
    assert result.residual_rms["reader_V"] < 0.001
    # the file's own temperature errors are 5 to 24 K
    assert result.residual_rms["tip_K"] < 10.0
    for fitted in result.parameters.values():
        assert fitted.stderr is not None
        assert fitted.stderr < 0.2 * fitted.value


def test_a_start_that_melts_is_given_up_for_the_usual_one(coarse, coarse_fast):
    """A lever that loses little heat melts below the highest bias of the data."""
    data = Measurement.of_sweep(coarse.sweep(np.linspace(1.0, 11.0, 12)))
    probe = coarse.probe.with_(c_kappa=0.4)
    with pytest.raises(BranchEndError, match="silicon melts"):
        coarse.with_probe(probe).sweep(data.bias_V)
    fixed = {"p": 2.65, "a0": 9.34e-4, "a1": 1.11e-6}
    found = fit(data, probe, fixed=fixed, model=coarse_fast)
    assert found.parameters["c_kappa"].value == pytest.approx(0.686, rel=1e-3)
