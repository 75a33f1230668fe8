"""Fits of twins whose truth is known, and of the example."""

from __future__ import annotations

import dataclasses
import json
from functools import cache
from importlib.resources import as_file, files

import numpy as np
import pytest

from experiments import full_experiment, on_coarse_meshes, reduced_experiment
from hotlever.errors import BranchEndError, ComputationError, InputError
from hotlever.estimation import Measurement, fit, read_measurement
from hotlever.estimation.diagnosis import Diagnosis
from hotlever.estimation.lack_of_fit import outlier_notes
from hotlever.estimation.residuals import Residuals
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced.lever import ReducedLever
from hotlever.materials import PARAMETERS
from hotlever.measurement import with_measured_circuit
from hotlever.probe import Probe

TRUTH = {"c_kappa": 0.66, "delta": 0.69, "n_d": 4.6e17, "p": 2.72, "a0": 9.9e-4, "a1": 1.18e-6}
BIAS = np.linspace(1, 11, 13)


@cache
def true_sweep(lever: Lever):
    return lever.with_material(lever.probe.material.with_(**TRUTH)).sweep(BIAS)


def twin(lever: Lever, noise: float = 0.0, seed: int = 5, **settings) -> Measurement:
    """A measurement made by the model itself; noise in units of each largest value.

    That is what the weights of a fit assume.
    """
    sweep = true_sweep(lever)
    rng = np.random.default_rng(seed)

    def noisy(values):
        return values.values + noise * values.values.max() * rng.normal(size=values.size)

    empty = np.full(BIAS.size, np.nan)
    return Measurement(
        BIAS, noisy(sweep.current_mA), noisy(sweep.reader_V), noisy(sweep.tip_K), empty, **settings
    )


@pytest.fixture(scope="module")
def coarse_model(coarse):
    """The coarse lever as forward model: the same equations on both sides."""
    return lambda probe, bias: full_experiment(coarse.with_probe(probe), bias)


@pytest.fixture(scope="module")
def coarse_fast(coarse, reduced):
    """The reduced lever of the same coarse mesh."""
    return lambda probe, bias: reduced_experiment(coarse.with_probe(probe), reduced, bias)


@pytest.fixture(scope="module")
def exact_fit(coarse, coarse_model):
    return fit(twin(coarse), model=coarse_model)


@pytest.mark.parametrize("name", PARAMETERS)
def test_exact_data_give_the_true_parameters(exact_fit, name):
    assert exact_fit.parameters[name].value == pytest.approx(TRUTH[name], rel=1e-4)


def test_a_good_optimum_needs_few_steps(exact_fit):
    assert exact_fit.steps <= 10
    assert max(exact_fit.residual_rms.values()) < 0.01


def test_noise_gives_errors_of_its_size(coarse, coarse_fast):
    result = fit(twin(coarse, noise=2e-3), model=coarse_fast)
    for name, fitted in result.parameters.items():
        assert fitted.stderr is not None
        assert abs(fitted.value - TRUTH[name]) < 4 * fitted.stderr
    assert np.allclose(np.diag(result.correlation), 1.0)
    assert np.allclose(result.correlation, result.correlation.T)
    assert 0 < result.inversion_temperature_stderr_K < 60


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


def test_the_band_is_the_spread_of_repeated_experiments(coarse, coarse_fast):
    """Fits of data with new noise each scatter in tip temperature as the band says."""
    tips, errors = [], []
    for seed in range(8):
        band = fit(twin(coarse, noise=2e-3, seed=seed), model=coarse_fast).band
        tips.append(band.tip_K.values)
        errors.append(band.tip_stderr_K.values)
    hot = BIAS > 6
    ratio = np.std(tips, axis=0)[hot].mean() / np.mean(errors, axis=0)[hot].mean()
    # eight fits know a spread to 27 %
    assert 0.6 < ratio < 1.6


def test_wrong_points_are_named_and_a_robust_fit_sets_them_aside(coarse, coarse_fast, monkeypatch):
    # the plain fit is not that of such a lever; why, is not what is asked here
    monkeypatch.setattr(Diagnosis, "named", lambda _: "")
    data = twin(coarse, noise=2e-3)
    current = data.current_mA.copy()
    current[3] *= 10  # a wrong decade
    spoilt = Measurement(data.bias_V, current, data.reader_V, data.tip_K, data.tip_error_K)
    plain = fit(spoilt, model=coarse_fast)
    robust = fit(spoilt, robust=True, model=coarse_fast)
    for result in (plain, robust):
        assert any(f"current at {BIAS[3]:g} V is" in note for note in result.notes)
    for name, fitted in robust.parameters.items():
        assert abs(fitted.value - TRUTH[name]) < 5 * fitted.stderr
    truth = TRUTH["c_kappa"]
    off = [abs(result.parameters["c_kappa"].value - truth) for result in (plain, robust)]
    assert not plain.describes_data or off[0] > 10 * off[1]


def test_of_many_wrong_points_the_worst_are_named(coarse):
    data = Measurement.of_sweep(coarse.sweep(np.linspace(1.0, 9.0, 200)))
    values = np.stack([data.current_mA, data.reader_V, data.tip_K])
    data.current_mA[::3] *= 1.1
    data.current_mA[30] *= 2.0
    *named, last = outlier_notes(Residuals(data, ["current", "tip"]), values, robust=False)
    assert len(named) == 10
    assert any(f"at {data.bias_V[30]:g} V" in text for text in named)
    assert last == f"{67 - 10} more data are as far from the fit"


def test_good_data_raise_no_suspicion(coarse, coarse_fast):
    notes = fit(twin(coarse, noise=2e-3), model=coarse_fast).notes
    assert not any("standard deviations" in note for note in notes)


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
    assert notes == ["series_resistance_ohm: the data file's 5000 is used, not the probe's 5600"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"observables": ["tipp"]}, "did you mean 'tip'"),
        ({"observables": []}, "no observables"),
        ({"fixed": {"ckappa": 1.0}}, "did you mean 'c_kappa'"),
        ({"fixed": {"p": -1.0}}, "p = -1.0: input should be greater than or equal to 0.5"),
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


def test_too_few_data_are_refused(coarse):
    one = Measurement(*(np.array([value]) for value in (5.0, 0.7, 0.3, 380.0, 5.0)))
    with pytest.raises(InputError, match="3 different data for 6 parameters"):
        fit(one)


def test_the_same_row_again_is_no_further_datum(coarse):
    equal = Measurement(*(np.full(30, value) for value in (5.0, 0.7, 0.3, 380.0, 5.0)))
    with pytest.raises(InputError, match=r"3 different data for 6 parameters; .* more biases"):
        fit(equal)


def test_a_start_that_does_not_reach_the_data_is_no_obstacle(coarse, coarse_fast):
    """No lever shows them without the resistor, and the fit says so, and why."""
    result = fit(twin(coarse, series_resistance_ohm=0.0), model=coarse_fast)
    assert result.describes_data is False
    assert "is the series resistance, with contacts, rather 5.6" in result.reason


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


def test_reduced_and_full_lever_give_the_same_fit(coarse, coarse_model, coarse_fast):
    """On noisy data, with parameters well away from the start."""
    data = twin(coarse, noise=2e-3)
    full, reduced = fit(data, model=coarse_model), fit(data, model=coarse_fast)
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


# --- measurement errors as weights, and what standard errors are worth ---------------------------


def with_errors(measurement, current=None, reader=None, tip=None):
    size = measurement.bias_V.size

    def column(value):
        return None if value is None else np.full(size, value)

    return dataclasses.replace(
        measurement,
        current_error_mA=column(current),
        reader_error_V=column(reader),
        tip_error_K=np.full(size, np.nan) if tip is None else column(tip),
    )


def test_measurement_errors_weigh_the_data(coarse, coarse_fast, monkeypatch):
    # a reader that does not count contradicts the lever; why, is not what is asked here
    monkeypatch.setattr(Diagnosis, "named", lambda _: "")
    measurement = twin(coarse, noise=0.003)
    trusted = with_errors(measurement, current=1e-3, reader=0.3, tip=600.0)
    # what a current alone hardly tells is held
    given = {"fixed": {"n_d": TRUTH["n_d"], "a1": None}, "model": coarse_fast}
    result = fit(trusted, coarse.probe, weights="errors", **given)
    alone = fit(measurement, coarse.probe, observables=["current"], **given)
    assert result.residual_rms["current_mA"] == pytest.approx(
        alone.residual_rms["current_mA"], rel=1e-3
    )
    assert any("times the measurement errors" in note for note in result.notes)


def test_without_measurement_errors_the_scatter_takes_their_place(coarse, coarse_fast):
    measurement = twin(coarse, noise=0.003)
    weighed = fit(measurement, coarse.probe, weights="errors", model=coarse_fast)
    scatter = {
        name: weighed.residual_rms[column]
        for name, column in (("current", "current_mA"), ("reader", "reader_V"), ("tip", "tip_K"))
    }
    again = fit(
        with_errors(measurement, **scatter), coarse.probe, weights="errors", model=coarse_fast
    )
    for name, parameter in weighed.parameters.items():
        assert abs(again.parameters[name].value - parameter.value) < 0.1 * parameter.stderr


def test_some_missing_measurement_errors_are_an_error(coarse, coarse_fast):
    measurement = with_errors(twin(coarse, noise=0.003), tip=5.0)
    measurement.tip_error_K[3] = np.nan
    with pytest.raises(InputError, match=r"tip has no error above 0 at 3\.5 V"):
        fit(measurement, coarse.probe, weights="errors", model=coarse_fast)


def test_unknown_weights_are_an_error(coarse):
    with pytest.raises(InputError, match="did you mean 'errors'"):
        fit(twin(coarse), coarse.probe, weights="error")


def test_standard_errors_follow_the_noise_of_each_observable(coarse, coarse_fast):
    # a reader a hundred times as noisy widens the resistivity, not the heater's parameters
    quiet = twin(coarse, noise=1e-4)
    rng = np.random.default_rng(3)
    noise = 1e-2 * np.nanmax(quiet.reader_V) * rng.normal(size=quiet.bias_V.size)
    noisy = dataclasses.replace(quiet, reader_V=quiet.reader_V + noise)
    before = fit(quiet, coarse.probe, model=coarse_fast).parameters
    after = fit(noisy, coarse.probe, model=coarse_fast).parameters
    assert after["a0"].stderr > 20.0 * before["a0"].stderr
    assert after["p"].stderr / after["p"].value < after["a0"].stderr / after["a0"].value


def test_a_start_that_melts_is_given_up_for_the_usual_one(coarse, coarse_fast):
    """A lever that loses little heat melts below the highest bias of the data."""
    data = Measurement.of_sweep(coarse.sweep(np.linspace(1.0, 11.0, 12)))
    probe = coarse.probe.with_(c_kappa=0.4)
    with pytest.raises(BranchEndError, match="silicon melts"):
        coarse.with_probe(probe).sweep(data.bias_V)
    fixed = {"p": 2.65, "a0": 9.34e-4, "a1": 1.11e-6}
    found = fit(data, probe, fixed=fixed, model=coarse_fast)
    assert found.parameters["c_kappa"].value == pytest.approx(0.686, rel=1e-3)
