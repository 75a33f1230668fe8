"""Melting points, rows in and out of contact, and approaches to a sample."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from experiments import on_coarse_meshes
from hotlever import Measurement, Probe, fit, read_calibration
from hotlever.contact.law import INTERFACE
from hotlever.errors import InputError
from hotlever.estimate import CalibrationOptions, Estimate, FitOptions
from hotlever.estimate.diagnosis import Diagnosis
from hotlever.estimate.experiment import ExperimentAtRest, with_distances
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import solve
from hotlever.estimate.summary import calibration_text
from hotlever.estimate.tip_temperature import calibrated
from hotlever.estimate.verdict import verdict_on
from hotlever.lever import Lever
from hotlever.lever.contact import out_of_contact, sweep_in_contact
from hotlever.lever.lever import COARSE
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import read_measurement
from hotlever.measurement.data import as_attributes
from hotlever.measurement.rows import averaged
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.quantities import FITTED

TIP = {"tip.height_um": 0.7, "tip.half_angle_deg": 20.0, "tip.apex_radius_um": 0.05}
TRUE_K_PER_MW = 4e3
BIAS = np.linspace(4.0, 10.0, 13)
MELTING = [3, 6, 8]
ROWS = {name: row for row, name in enumerate(FITTED)}


@pytest.fixture(scope="module")
def probe() -> Probe:
    return Probe.reference().with_(**TIP, sample="glass", interface_K_per_mW=2e3)


@pytest.fixture(scope="module")
def touching(probe) -> Lever:
    return Lever(probe.with_(interface_K_per_mW=TRUE_K_PER_MW), COARSE)


@pytest.fixture(scope="module")
def measured(touching) -> Measurement:
    """Currents in and out of contact, and three melting points, from levers solved one by one."""
    random = np.random.default_rng(3)
    data, free = sweep_in_contact(touching, BIAS), out_of_contact(touching).sweep(BIAS)
    bias = np.concatenate([BIAS, BIAS, BIAS[MELTING]])
    current = np.concatenate([data.current_mA, free.current_mA, np.full(3, np.nan)])
    nothing = np.full(bias.size, np.nan)
    melts = nothing.copy()
    melts[-3:] = data.surface_K.values[MELTING] + 1.0 * random.normal(size=3)
    return Measurement(
        bias,
        current * (1.0 + 1e-4 * random.normal(size=bias.size)),
        *(nothing, nothing, nothing),
        further={
            "surface_K": melts,
            "surface_error_K": np.where(np.isfinite(melts), 1.0, np.nan),
        },
        distance_um=np.repeat([0.0, 0.5, 0.0], (13, 13, 3)),
    )


def experiment(probe: Probe, names: tuple[str, ...], distance: np.ndarray) -> ExperimentAtRest:
    bias = np.full(distance.size, 8.0)
    model = ExperimentAtRest(SimilarLevers(Lever(probe, COARSE)), None, bias, names)
    return with_distances(model, probe, distance).measuring(bias, None, distance)


def test_what_is_predicted_is_what_levers_show(probe, touching):
    names = (INTERFACE, "apex_radius_um", "c_kappa", "base_temperature_K")
    model = experiment(probe, names, np.array([0.0, 0.3]))
    near = model.predict(probe)
    parameters = near.probe.values(names) * np.array([1.05, 0.98, 1.01, 1.001])
    there = probe.replace(dict(zip(names, parameters.tolist(), strict=True)))
    solved = model.predict(there, near)
    away = np.abs(solved.values - near.values).max(axis=1)
    for values, slopes in (
        near.surrogate.predict(parameters),
        (near.surrogate.values_at(parameters), None),
    ):
        off = np.abs(values - solved.values).max(axis=1)
        # there is no bridge
        assert ((off < 0.02 * away) | np.isnan(off)).all()
        assert np.isnan(off).sum() == 1
        if slopes is not None:
            steps = slopes @ (1e-4 * parameters)
            change = near.surrogate.values_at(1.0001 * parameters) - near.surrogate.values_at(
                0.9999 * parameters
            )
            np.testing.assert_allclose(2.0 * steps, change, rtol=5e-3, atol=1e-7)
    # by itself: an independent statement of what is read there
    data = sweep_in_contact(touching.with_probe(probe), [8.0])
    free = out_of_contact(touching.with_probe(probe)).sweep([8.0])
    np.testing.assert_allclose(
        near.values[ROWS["current"]], [data.current_mA[0], free.current_mA[0]], rtol=1e-6
    )
    assert near.values[ROWS["apex"], 0] == pytest.approx(data.apex_K.item(), abs=0.01)
    surface = 293.0 + (data.sample_mW * data.spreading_K_per_mW).item()
    assert near.values[ROWS["melting"], 0] == pytest.approx(surface, abs=0.01)


@pytest.mark.slow
def test_an_approach_in_air_is_followed_between_a_few_distances(probe):
    in_air = probe.with_(medium="air", surface_gap_um=0.7)
    distance = np.geomspace(0.01, 20.0, 9)
    currents = experiment(in_air, ("c_kappa",), distance).predict(in_air).values[0]
    for row in (1, 5):
        gap = 0.7 + float(distance[row])
        there = out_of_contact(Lever(in_air, COARSE)).probe.replace({"surface_gap_um": gap})
        current = Lever(there, COARSE).sweep([8.0]).current_mA.item()
        assert currents[row] == pytest.approx(current, rel=2e-5)
    assert np.ptp(currents) > 5e-3 * currents[0]


def test_the_interface_follows_from_rows_in_and_out_of_contact(probe, measured):
    rows = measured.part(np.isfinite(measured.current_mA))
    held = {"fixed": dict.fromkeys(usual_parameters(probe))}
    with on_coarse_meshes():
        both = fit(rows, probe, free=(INTERFACE,), **held).parameters[INTERFACE]
    assert both.stderr < 0.1 * TRUE_K_PER_MW
    assert abs(both.value - TRUE_K_PER_MW) < 4.0 * both.stderr


@pytest.fixture(scope="module")
def calibration(probe, measured):
    """With what takes a while, the dimensions and most of the material, held."""
    known = {INTERFACE: "×/ 10", "apex_radius_um": "± 2%", "c_kappa": "± 2%"}
    held = dict.fromkeys(name for name in usual_parameters(probe) if name not in known)
    with on_coarse_meshes():
        found = solve(Problem.of(measured, probe, FitOptions(fixed=held, priors=known)))
        one = Estimate.of(found, *verdict_on(found))
        return calibrated(found, one, measured, CalibrationOptions(at_V=8.0, budget_of="apex"))


def test_the_apex_joins_the_calibration_with_its_error_by_source(calibration, touching):
    assert calibration.describes_data
    table, data = calibration.table, sweep_in_contact(touching, BIAS)
    for name in ("tip", "apex", "surface"):
        off = np.interp(BIAS, table.bias_V, table[f"{name}_K"]) - data[f"{name}_K"].values
        error = np.interp(BIAS, table.bias_V, table[f"{name}_stderr_K"])
        assert (np.abs(off) < 4.0 * error).all()
    whole = np.sqrt((table.apex_budget_K**2).sum("source"))
    np.testing.assert_allclose(whole, table.apex_stderr_K)
    assert table.apex_budget_K.sel(source="contact").max() > 0.0
    stated, row = calibration.gum, table.sel(bias=8.0)
    assert stated.estimate_K == row.apex_K.item() != row.tip_K.item()
    assert stated.budget.u == pytest.approx(row.apex_stderr_K.item(), rel=1e-6)
    low, high = (stated.estimate_K + way * 1.96 * stated.budget.u for way in (-1.0, 1.0))
    assert stated.limits_K == pytest.approx((low, high), rel=1e-3)
    use = calibration.priors[INTERFACE]
    assert use.spread_ratio < 0.1
    assert "apex (K)" in calibration_text(calibration)
    path_rows = calibration.table_csv().splitlines()
    assert path_rows[0].endswith("apex_K,apex_stderr_K,surface_K,surface_stderr_K")


def test_a_calibration_with_an_apex_is_read_as_it_was_written(calibration, tmp_path):
    calibration.write(tmp_path / "cal.json")
    again = read_calibration(tmp_path / "cal.json")
    assert again.columns == calibration.columns
    np.testing.assert_allclose(again.table.apex_budget_K, calibration.table.apex_budget_K)
    assert again.gum.measurand == "apex temperature in contact at a bias of 8 V"
    assert again.gum.limits_K == pytest.approx(calibration.gum.limits_K)
    content = json.loads((tmp_path / "cal.json").read_text())
    del content["apex_budget_K"]["contact"]
    (tmp_path / "cal.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="apex_budget_K: expected the sources measurement"):
        read_calibration(tmp_path / "cal.json")


def test_rows_at_two_distances_are_not_averaged(measured):
    many = measured.part(np.tile(np.arange(26), 100))
    few = averaged(many, robust=True)
    assert few.bias_V.size == 26
    assert few.out_of_contact.sum() == 13


TWO_COLUMNS = "# V_b (V): 8\n# R_s (kOhm): 5.6\nD (nm),I_h (mA)\n500,1.07\n100,1.071\n0,1.065\n"


def test_two_columns_are_enough_for_an_approach(tmp_path):
    path = tmp_path / "approach.csv"
    path.write_text(TWO_COLUMNS)
    data = read_measurement(path)
    assert data.bias_V.tolist() == [8.0] * 3
    np.testing.assert_allclose(data.distance_um, [0.5, 0.1, 0.0])
    assert data.out_of_contact.tolist() == [True, True, False]
    path.write_text(TWO_COLUMNS.replace("# V_b (V): 8\n", ""))
    with pytest.raises(InputError, match="expected 'V_b"):
        read_measurement(path)


def test_melting_points_are_read(tmp_path):
    path = tmp_path / "melting.csv"
    path.write_text("V_b (V),I_h (mA),T_melt (°C),dT_melt (K)\n5,0.7,,\n6,0.8,60,2\n")
    data = read_measurement(path)
    assert data.observables == ("current", "melting")
    assert data.further["surface_K"][1] == pytest.approx(333.15)
    assert data.distance_um is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"contact": None}, r"T_melt: .* touches nothing, expected a section \[contact\]"),
        ({"interface_K_per_mW": 0.0}, "interface_K_per_mW = 0: expected a value above 0"),
    ],
)
def test_a_probe_that_cannot_show_it_is_refused(probe, measured, changes, message):
    other = probe.model_copy(update=changes) if "contact" in changes else probe.with_(**changes)
    free = () if "contact" in changes else (INTERFACE,)
    with pytest.raises(InputError, match=message) as caught:
        fit(measured, other, free=free)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"surface_K": 280.0}, "T_melt is 280 K at .*, expected more than the base temperature"),
        ({"distance_um": 0.1}, "T_melt is .* expected D of 0, in contact"),
    ],
)
def test_melting_points_that_cannot_be(probe, measured, changes, message):
    columns = {name: values.copy() for name, values in measured.columns.items()}
    for name, value in changes.items():
        columns[name][-1] = value
    with pytest.raises(InputError, match=message):
        fit(replace(measured, **as_attributes(columns)), probe)


def test_melting_points_that_contradict_each_other_are_no_estimate(probe, measured, monkeypatch):
    # what may be behind it is not what is asked here
    monkeypatch.setattr(Diagnosis, "named", lambda _: "")
    surface_K = measured.columns["surface_K"] + 40.0 * (measured.bias_V == BIAS[6])
    other = replace(measured, further={**measured.further, "surface_K": surface_K})
    other = other.part(~measured.out_of_contact)
    known = {"fixed": dict.fromkeys(usual_parameters(probe)), "priors": {INTERFACE: "×/ 10"}}
    with on_coarse_meshes():
        result = fit(other, probe, **known)
    assert result.describes_data is False
    assert "melting is off by" in result.reason
    assert result.parameters[INTERFACE].stderr is None
