"""A search ends at a minimum, wherever it began, or says that it has not come to one."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hotlever
from experiments import full_experiment
from foreign_levers import owners_probe
from hotlever.errors import InputError
from hotlever.estimate import Measurement, calibrate, fit
from hotlever.estimate.experiment import ExperimentAtRest, Predictor
from hotlever.estimate.objective import Objective
from hotlever.estimate.options import FitOptions, SearchOptions
from hotlever.estimate.posterior import standard_errors
from hotlever.estimate.problem import Problem
from hotlever.estimate.residuals import Residuals
from hotlever.estimate.search import Optimiser, solve
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from twins import little_known_lever

pytestmark = pytest.mark.usefixtures("coarse_meshes")

NOISE = 5e-4
FOLDER = Path(hotlever.__file__).parent / "examples"


def curve(probe: Probe, highest_V: float, rows: int = 25, **settings) -> Measurement:
    """The I-V curve of a lever, with noise."""
    bias = np.linspace(0.4, highest_V, rows)
    current = Lever(probe, COARSE).sweep(bias).current_mA.values
    noise = NOISE * np.random.default_rng(3).standard_normal(rows)
    nothing = np.full(rows, np.nan)
    return Measurement(bias, current * (1.0 + noise), nothing, nothing, nothing, **settings)


@pytest.fixture(scope="module")
def reference_curve():
    return curve(Probe.reference(), 11.0)


def test_data_of_another_lever_are_fitted_to_their_noise_or_not_described():
    """The probe forgotten: a search that shrinks its steps is at no minimum."""
    other = curve(Probe.u_shape(), 8.0)
    result = fit(other)
    rms = result.residual_rms["current_mA"] / other.current_mA.max()
    assert result.describes_data
    assert rms < 2.0 * NOISE


@pytest.mark.slow
def test_at_the_optimum_no_parameter_lowers_the_sum_of_squares(reference_curve):
    def model(probe: Probe, bias: np.ndarray) -> ExperimentAtRest:
        return full_experiment(Lever(probe, COARSE), bias)

    found = solve(Problem.of(reference_curve, Probe.u_shape(), FitOptions(), model=model))
    objective, at = found.objective, found.prediction
    least, optimum = objective.squares(at), objective.point(at.probe)
    noise = found.residuals.errors.noise_squares(found.residuals.difference(at.values))
    assert found.converged
    jacobian = objective.jacobian(at.slopes, optimum)
    axes = np.linalg.svd(jacobian)[2]
    for axis in axes:
        size = float(np.linalg.norm(jacobian @ axis))
        for way in (-1.0, 1.0):
            # one standard error along each axis, or as far as powers tell of other levers
            step = min(np.sqrt(noise) / size, 0.2)
            there = objective.at(at.probe, optimum + way * step * axis)
            assert (
                objective.squares(found.predictor.experiment.predict(there, at))
                > least - 0.05 * noise
            )


@pytest.mark.parametrize(
    ("n_d", "known"), [(2e17, 1.5e17), pytest.param(4e17, 3e17, marks=pytest.mark.slow)]
)
def test_a_fit_of_data_below_the_knee_ends_though_they_leave_a_valley_open(n_d, known):
    """Each step along it gained a hundredth of the noise, until no more levers were left."""
    true = Probe.u_shape().with_(n_d=n_d)
    data = curve(true, 5.0)

    def model(probe: Probe, bias: np.ndarray) -> ExperimentAtRest:
        return full_experiment(Lever(probe, COARSE), bias)

    nominal = true.with_(n_d=known, c_kappa=0.8)
    found = solve(Problem.of(data, nominal, FitOptions(), model=model))
    truth = found.predictor.experiment.predict(true, found.prediction)
    noise = found.residuals.errors.noise_squares(found.residuals.difference(truth.values))
    least = found.objective.squares(found.prediction)
    assert found.converged
    assert found.predictor.evaluations <= 20
    assert least < found.objective.squares(truth) + noise
    # what is open is said: the tip may be anywhere
    off = found.prediction.columns["tip_K"] - truth.columns["tip_K"]
    error = standard_errors(found.prediction.tip_slopes, found.posterior.covariance)
    assert np.all(np.abs(off) < error)


@pytest.mark.slow
def test_a_current_that_saturates_is_not_described(reference_curve):
    top = np.sort(reference_curve.current_mA)[-5]
    beyond = np.maximum(reference_curve.current_mA - top, 0.0)
    saturated = replace(reference_curve, current_mA=reference_curve.current_mA - 0.9 * beyond)
    result = fit(saturated)
    # where the lever jumps at a row a search has no derivatives to come to its end by
    assert not result.describes_data
    assert result.parameters["n_d"].stderr is None


@pytest.mark.slow
def test_a_fit_names_what_was_stated_wrongly(reference_curve):
    result = fit(reference_curve, Probe.reference().with_(series_resistance_ohm=2000.0))
    assert not result.describes_data
    assert re.search(r"series resistance, with contacts, rather 5\.[56]", result.reason)


@pytest.mark.slow
def test_a_wrong_medium_is_named_or_its_error_is_stated(reference_curve):
    """Six free parameters describe a curve in vacuum in air as well, and say how little they know.

    Where parameters are known beforehand the medium is named.
    """
    in_air = Probe.reference().in_medium("air")
    true = Lever(Probe.reference(), COARSE).sweep(reference_curve.bias_V).tip_K.values
    free = fit(reference_curve, in_air)
    band = free.band_columns
    off = np.interp(reference_curve.bias_V, band["bias_V"], band["tip_K"]) - true
    stderr = np.interp(reference_curve.bias_V, band["bias_V"], band["tip_stderr_K"])
    assert not free.describes_data or np.all(np.abs(off) < stderr)
    known = calibrate(reference_curve, probe=in_air, priors={"laws": "paper"})
    assert not known.describes_data
    assert "is the lever in vacuum, not in air?" in known.reason
    # laws that may depart explain it too, far from what is known of the gas
    doubted = calibrate(reference_curve, probe=in_air)
    asked = [note for note in doubted.notes if "is the lever in vacuum, not in air?" in note]
    assert not doubted.describes_data or asked


@pytest.mark.parametrize(
    ("bias", "current", "question"),
    [
        (lambda v, i: i, lambda v, i: v, "columns of V_b and I_h swapped"),
        (lambda v, i: v - 5.6 * i, lambda v, i: i, "V_b the lever's own voltage"),
    ],
)
def test_hints_on_a_file_are_tried(tmp_path, reference_curve, bias, current, question):
    volts, milliampere = reference_curve.bias_V, reference_curve.current_mA
    rows = np.stack([bias(volts, milliampere), current(volts, milliampere)], axis=1)
    path = tmp_path / "wrong.csv"
    lines = [f"{row[0]:.6g},{row[1]:.6g}" for row in rows]
    path.write_text("\n".join(["# R_s (kOhm): 5.6", "V_b (V),I_h (mA)", *lines]), encoding="utf-8")
    with pytest.raises(InputError, match=question):
        fit(path)


@pytest.mark.slow
def test_a_current_whose_unit_is_wrong_is_told_from_other_scales(reference_curve):
    thousandth = replace(reference_curve, current_mA=reference_curve.current_mA / 1000.0)
    with pytest.raises(InputError, match="1000 times too small"):
        calibrate(thousandth)


def test_a_search_that_was_ended_says_that_it_has_not_converged(coarse):
    far = Probe.reference().with_(n_d=1.2e17, c_kappa=1.0)
    data = curve(Probe.reference(), 9.0, 15)
    residuals = Residuals(data, ["current"])
    model = full_experiment(coarse, residuals.bias).measuring(residuals.bias, residuals.measured)
    options = SearchOptions(most_branches=2)
    objective = Objective(residuals, far, model.names, list(PARAMETERS))
    search = Optimiser(objective, Predictor(model), options)
    optimum = search.solve(far)
    assert not optimum.converged
    assert optimum.decrement > 1e-3 * search.objective.squares(optimum.prediction)


def test_levers_of_earlier_searches_count_in_the_bound_of_an_estimate(coarse):
    far = Probe.reference().with_(n_d=1.2e17, c_kappa=1.0)
    residuals = Residuals(curve(Probe.reference(), 9.0, 15), ["current"])
    model = full_experiment(coarse, residuals.bias).measuring(residuals.bias, residuals.measured)
    predictor = Predictor(model, before=SearchOptions().most_in_estimate - 2)
    objective = Objective(residuals, far, model.names, list(PARAMETERS))
    assert not Optimiser(objective, predictor).solve(far).converged
    assert predictor.evaluations == SearchOptions().most_in_estimate


def test_of_the_levers_at_hand_only_the_latest_is_factorised(coarse):
    model = full_experiment(coarse, np.linspace(0.5, 6.0, 5))
    predictor = Predictor(model)
    levers = [Probe.reference().with_(n_d=n_d) for n_d in (5e17, 5.2e17, 5.4e17)]
    latest = [predictor.predict(lever) for lever in levers][-1]
    assert latest.linearised.factors is not None
    assert [other.linearised.factors for other in predictor.others(latest)] == [None, None]


@pytest.mark.slow
def test_a_search_in_air_of_a_lever_in_vacuum_takes_less_than_a_gigabyte(tmp_path):
    """Freed factorisations stayed in pieces between others: 2.1 GB."""
    probe = Probe.u_shape().with_(length_um=120.0)
    data = curve(probe, 7.5, 40)
    rows = (f"{v:.6g},{i:.7g}" for v, i in zip(data.bias_V, data.current_mA, strict=True))
    (tmp_path / "iv.csv").write_text("\n".join(["V_b (V),I_h (mA)", *rows]))
    probe.to_file(tmp_path / "probe.toml")
    program = (
        "import resource; from hotlever import fit, Probe; "
        "fit('iv.csv', Probe.from_file('probe.toml'), medium='air'); "
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert int(done.stdout) < 1e6


@pytest.mark.slow
def test_levers_that_cannot_be_drawn_bound_a_search():
    """Once the search walked until a bar was 0.6 nm long, as if the input were at fault."""
    probe = Probe.u_shape().with_(
            gap_um=20.0, heater_length_um=16.0, heater_width_um=8.0, leg_width_um=15.0,
            length_um=110.0, bridge_width_um=15.0, thickness_um=1.0, n_d=3e16,
        ).in_medium("air")  # fmt: skip
    priors = {"n_d": "± 60%", "dimensions": "± 30%", "thickness_um": "± 30%"}
    result = calibrate(FOLDER / "uiuc-lever.csv", probe=probe, priors=priors)
    assert result.describes_data
    assert result.table.tip_K.max() == pytest.approx(500.0, abs=40.0)


@pytest.mark.slow
def test_a_fold_that_moves_past_a_row_is_no_obstacle():
    """Values are not smooth there, and no step gains what the derivatives promise."""
    unknown = little_known_lever(38)
    assert calibrate(unknown.measurement, probe=unknown.nominal).describes_data


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_meshes")
def test_a_lever_that_melts_before_the_last_rows_is_none_of_these_data():
    """It had their resistance where it ended, and was refused after the search."""
    unknown = little_known_lever(123, obey=True)
    found = calibrate(unknown.measurement, probe=unknown.nominal)
    assert found.describes_data
    bias = unknown.measurement.bias_V
    tip, stated = (
        np.interp(bias, found.table.bias_V, found.table[name]) for name in ("tip_K", "tip_stderr_K")
    )
    assert np.all(np.abs(tip - unknown.tip_K(bias)) < 3.0 * stated)


def test_a_lever_that_cannot_be_drawn_is_none_to_try(reference_curve):
    """Its heater is longer than the bridge, though as long as heaters may be."""
    residuals, names = Residuals(reference_curve, ("current",)), ["heater_length_um"]
    probe = Probe.u_shape()
    objective = Objective(residuals, probe, names, names)
    shorter, longer = (probe.replace({names[0]: length}) for length in (3.0, 25.0))
    assert objective.at(probe, objective.point(shorter)) == shorter
    with pytest.raises(InputError, match="probe: heater_length_um"):
        objective.at(probe, objective.point(longer))


#: I_h (mA) at 40 even biases up to 13 V of a u-shape with other laws, whose tip is at 690 K at
#: 12.36 V (lever 33 of `foreign_levers`).
FOREIGN_MA = """
0.05273474 0.1054503 0.1585658 0.21133 0.2645211 0.3174807 0.3690855 0.4216711 0.4727949
0.5274337 0.5787637 0.6304764 0.6844372 0.7375838 0.7868016 0.8400557 0.893717 0.9441552
1.002909 1.048046 1.101948 1.154418 1.20528 1.255238 1.306643 1.357486 1.413838 1.459589
1.509704 1.560474 1.610007 1.65811 1.708375 1.76246 1.806561 1.86102 1.902516 1.952108 1.996894
2.030201
"""


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_meshes")
def test_a_lever_that_jumps_where_the_data_do_not_is_left_for_another(tmp_path):
    """It described the currents less well, and stated 928 K with a band from 838 K on."""
    current = FOREIGN_MA.split()
    bias = np.linspace(0.325, 13.0, len(current))
    data, probe = tmp_path / "iv.csv", tmp_path / "probe.toml"
    rows = [f"{volts:.7g},{milliamps}" for volts, milliamps in zip(bias, current, strict=True)]
    data.write_text("\n".join(["V_b (V),I_h (mA)", *rows]))
    probe.write_text(owners_probe("u-shape", "vacuum"))
    found = calibrate(data, probe=probe)
    low, high = (
        np.interp(12.36, found.table.bias_V, found.table[name])
        for name in ("tip_low_K", "tip_high_K")
    )
    assert found.describes_data
    assert low < 690.0 < high
    assert not any("jumps" in note for note in found.notes)
