"""Levers are drawn from what their owners say, measured as said, and judged by their truth."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

import twins
from hotlever.errors import ComputationError
from hotlever.lever import Lever
from hotlever.lever.discretisation import chosen_space
from hotlever.lever.lever import COARSE
from hotlever.measurement import read_measurement
from hotlever.probe import Probe
from hotlever.probe.priors import default_priors
from twins import (
    DOPING,
    FAILED,
    PRIORS,
    SHAPES,
    judge_little_known,
    little_known_lever,
)

NUMBERS = range(6, 12)


@pytest.fixture(autouse=True)
def coarse_levers(monkeypatch):
    """What is tested here does not depend on the mesh."""
    monkeypatch.setattr(twins, "_finer", lambda true: Lever(true, COARSE))


@pytest.fixture(scope="module")
def some():
    """Some levers in vacuum."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(twins, "_finer", lambda true: Lever(true, COARSE))
        return [little_known_lever(number, "vacuum") for number in NUMBERS]


@pytest.mark.slow
def test_a_lever_is_the_same_each_time_and_in_the_medium_that_is_asked_for(some):
    once, again, in_air = some[4], little_known_lever(10, "vacuum"), little_known_lever(10, "air")
    assert (once.true, once.nominal) == (again.true, again.nominal)
    np.testing.assert_array_equal(once.measurement.current_mA, again.measurement.current_mA)
    assert in_air.true.surroundings.medium == in_air.nominal.surroundings.medium == "air"
    assert in_air.nominal.in_medium("vacuum") == once.nominal


def test_every_shape_has_its_turn_and_nominal_levers_differ(some):
    assert [lever.nominal.shape.shape for lever in some] == [*SHAPES] * 2
    doping = np.array([lever.nominal.material.n_d for lever in some])
    assert np.all((doping >= 3e16) & (doping <= 1e18))
    assert doping.max() > 5 * doping.min()
    for lever in some:
        reference = Probe.u_shape() if lever.nominal.shape.shape == "u-shape" else Probe.reference()
        for name, size in lever.nominal.shape.dimensions().items():
            usual = reference.shape.dimensions().get(name)
            assert not usual or 0.5 <= size / usual <= 2.0


def test_levers_scatter_about_what_their_owners_know_as_the_priors_say():
    rng, away = np.random.default_rng(1), []
    nominal = twins._nominal(rng, "u-shape")
    priors = default_priors(nominal)
    assert priors["delta"].spread == 0.35
    assert priors["thickness_um"].spread == 0.20
    assert priors["length_um"].spread == 0.12
    assert priors["n_d"].spread in (0.6, pytest.approx(np.log(2.5)))
    while len(away) < 100:
        try:
            true = twins._drawn(rng, nominal, obey=False)
        except twins.HotleverError:
            continue
        assert true.prior is None
        values = true.values(list(priors)).tolist()
        away.append([prior.deviation(v) for prior, v in zip(priors.values(), values, strict=True)])
    # levers that cannot be drawn are left out, so that the scatter is somewhat smaller
    spread = np.std(away, axis=0)
    assert np.all((spread > 0.7) & (spread < 1.25)), dict(zip(priors, spread, strict=True))


def test_owners_state_priors_as_probe_files_do(some, tmp_path):
    for lever in some:
        stated = dict(lever.nominal.stated_priors)
        assert stated.pop("n_d") in DOPING
        outline = lever.nominal.shape.outline_moves
        assert stated == {name: PRIORS[name] for name in PRIORS if outline or name != "dimensions"}
    lever = some[2]
    lever.nominal.to_file(tmp_path / "probe.toml")
    (tmp_path / "iv.csv").write_text(lever.measurement_csv())
    again = Probe.from_file(tmp_path / "probe.toml")
    assert again.stated_priors == lever.nominal.stated_priors
    np.testing.assert_allclose(again.shape.thickness_um, lever.nominal.shape.thickness_um)
    data = read_measurement(tmp_path / "iv.csv")
    np.testing.assert_allclose(data.current_mA, lever.measurement.current_mA, rtol=1e-6)
    np.testing.assert_allclose(data.bias_V, lever.measurement.bias_V, rtol=1e-6)


def test_data_end_anywhere_from_350_K_to_melting_half_of_them_below_the_knee(some):
    ends = [float(lever.branch.read(lever.true.circuit, np.array([0.0])).last_K) for lever in some]
    assert max(ends) > 1000.0
    below = sum(lever.below_knee for lever in some)
    assert 1 <= below <= 5
    for lever in some:
        tip = lever.tip_K(lever.measurement.bias_V)
        assert 18 <= tip.size <= 55
        assert np.nanmax(tip) > 345.0
        assert np.nanmax(tip) < lever.branch.hottest_K
        assert lever.branch.melts
        assert np.all(np.diff(lever.measurement.bias_V) >= 0)


def test_noise_is_half_a_per_cent_and_a_picture_is_read_by_a_share_of_its_full_scale(some):
    assert {lever.digitised for lever in some} == {False, True}
    for lever in some:
        if lever.jumps:
            continue
        data, tip = lever.measurement, lever.tip_K(lever.measurement.bias_V)
        here = np.isfinite(tip)
        current = lever.branch.electrical_outputs(lever.branch.u_at(tip[here]))["current_mA"]
        off = data.current_mA[here] - current
        if lever.digitised:
            assert 3e-4 < np.std(off) / data.current_mA.max() < 9e-3
        else:
            assert np.std(off / current) == pytest.approx(twins._NOISE, rel=0.5)


def test_the_truth_is_solved_on_a_finer_mesh_than_the_default(monkeypatch):
    monkeypatch.undo()
    probe = Probe.u_shape()
    usual, finer = chosen_space(probe), twins._finer(probe)
    assert finer.space.mesh.elements.nelements > 1.2 * usual.mesh.elements.nelements
    assert finer.panels > Lever(probe).panels


def test_a_lever_that_has_no_state_is_drawn_anew_and_counted(monkeypatch):
    failures = iter([True, True])

    def solved(true):
        if next(failures, False):
            raise ComputationError("no state")
        return Lever(true, COARSE)

    monkeypatch.setattr(twins, "_finer", solved)
    assert little_known_lever(1, "vacuum").repeated >= 2
    monkeypatch.setattr(twins, "_MOST_DRAWN", 2)
    failures = iter([True, True])
    with pytest.raises(ComputationError, match="no state"):
        little_known_lever(1, "vacuum")


@pytest.fixture
def answered(some, monkeypatch):
    """A calibration that is 10 K too hot, known to 5 K on the cold side and 20 K on the hot."""
    lever = some[0]
    bias = np.append(0.0, lever.measurement.bias_V)
    tip = lever.tip_K(bias) + 10.0

    class Answer:
        table = xr.Dataset(
            {
                "bias_V": ("bias", bias),
                "tip_K": ("bias", tip),
                "tip_low_K": ("bias", tip - 5.0 * 1.96),
                "tip_high_K": ("bias", tip + 20.0 * 1.96),
            }
        )
        describes_data, reason = True, ""

    arguments = {}

    def calibrated(data, probe, priors):
        arguments.update(data=data, probe=probe, priors=priors)
        return Answer

    monkeypatch.setattr(twins, "calibrate", calibrated)
    monkeypatch.setattr(twins, "little_known_lever", lambda *_: lever)
    return Answer, arguments, lever


def test_an_answer_is_compared_with_the_truth_by_the_error_of_that_side(answered):
    answer, arguments, lever = answered
    record = judge_little_known(0, "vacuum")
    assert arguments == {
        "data": lever.measurement,
        "probe": lever.nominal,
        "priors": {"laws": "uncertain"},
    }
    assert record["outcome"] == "described"
    count = np.isfinite(lever.tip_K(lever.measurement.bias_V)).sum()
    assert record["off_K"] == pytest.approx([10.0] * count)
    assert record["stated_K"] == pytest.approx([5.0] * count)
    assert json.loads(json.dumps(record)) == record
    answer.describes_data, answer.reason = False, "no such lever"
    assert judge_little_known(0)["outcome"] == "not described"
    assert judge_little_known(0)["reason"] == "no such lever"
    answer.describes_data = None
    assert judge_little_known(0)["outcome"] == "not converged"


def test_an_error_of_any_type_is_a_result(answered, monkeypatch):
    def broken(*_, **__):
        raise ValueError("x must be strictly increasing")

    monkeypatch.setattr(twins, "calibrate", broken)
    record = judge_little_known(0)
    assert (record["outcome"], record["exception"]) == (FAILED, "ValueError")
    assert record["reason"] == "x must be strictly increasing"
    assert "off_K" not in record
    assert record["seconds"] >= 0.0
