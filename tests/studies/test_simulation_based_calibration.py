"""Simulated levers depart from the model as is said, and are judged by their own truth."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import made_up
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.materials import LOW_DOPED
from hotlever.materials.kinds import NSilicon
from hotlever.probe import Probe
from hotlever.studies import simulation_based_calibration as study
from hotlever.studies.simulation_based_calibration import (
    DEPARTURES,
    ESTIMATE,
    WAYS,
    LaboratoryOptions,
    MinimosMaterial,
    MinimosSilicon,
    draw,
    judge,
    measure,
)

# what is tested here does not depend on the mesh
LABORATORY = LaboratoryOptions(mesh=COARSE)


@pytest.fixture
def solved_once(monkeypatch):
    """A lever that is not solved for every number anew."""
    points = LABORATORY.points
    sweep = Lever(Probe.reference(), COARSE).sweep(np.linspace(0.275, 11.0, points))
    monkeypatch.setattr(Lever, "sweep", lambda *_: sweep)
    return sweep


def data_of(number, departures, what="iv", probe=None):
    rng = np.random.default_rng(number)
    return measure(probe or Probe.reference(), rng, what, departures, laboratory=LABORATORY)[0]


def test_a_departure_that_is_left_out_changes_nothing_else():
    everything, nominal = draw(np.random.default_rng(0), 0, "vacuum")
    probes = {
        name: draw(
            np.random.default_rng(0), 0, "vacuum", [other for other in DEPARTURES if other != name]
        )[0]
        for name in ("tip", "drawing")
    }
    assert all(
        probe.material == everything.material != nominal.material for probe in probes.values()
    )
    assert everything.tip is not None
    assert probes["tip"].tip is None
    assert probes["tip"].shape == everything.shape != nominal.shape
    assert probes["drawing"].shape == nominal.shape
    assert probes["drawing"].tip == everything.tip


def test_the_jump_is_of_levers_in_air_alone():
    rng = np.random.default_rng
    assert draw(rng(1), 1, "air")[0].surroundings.accommodation == 0.9
    without = draw(rng(1), 1, "air", ["drawing"])[0]
    assert without.surroundings.accommodation == Probe.reference().surroundings.accommodation
    assert draw(rng(1), 1, "vacuum")[0].surroundings.accommodation != 0.9


def test_outliers_are_far_off_few_and_in_a_third_of_the_levers(solved_once):
    some = 0
    for number in range(300):
        with_, without = (data_of(number, more).current_mA for more in (["outliers"], []))
        off = np.abs(with_ / without - 1.0) / LABORATORY.noise
        outliers = off[off > 1e-9]
        assert outliers.size <= 2
        assert np.all((outliers > 9.9) & (outliers < 50.1))
        some += outliers.size > 0
    assert 80 <= some <= 120


def test_drift_grows_over_the_ramp(solved_once):
    off = [
        data_of(number, ["drift"]).current_mA / data_of(number, []).current_mA - 1.0
        for number in range(100)
    ]
    spread = np.std(off, axis=0)
    assert spread[0] == pytest.approx(0.0, abs=1e-12)
    assert spread[-1] == pytest.approx(LABORATORY.drift, rel=0.25)


def test_another_mobility_changes_the_lever_and_nobody_else_s():
    probe = Probe.reference()
    before = Lever(probe, COARSE).sweep([5.0, 9.0])
    changed = probe.with_material("material", MinimosMaterial)
    other = Lever(changed, COARSE)
    assert isinstance(other.equations.laws.made_of[LOW_DOPED], MinimosSilicon)
    assert abs(other.sweep([5.0, 9.0]).current_mA / before.current_mA - 1).max() > 5e-3
    again = Lever(probe, COARSE)
    assert type(again.equations.laws.made_of[LOW_DOPED]) is NSilicon
    xr.testing.assert_allclose(again.sweep([5.0, 9.0]).current_mA, before.current_mA)
    assert type(changed.with_(n_d=4e17).kinds[LOW_DOPED]) is MinimosSilicon


def test_raman_temperatures_have_the_errors_that_they_state(solved_once):
    data, tip = data_of(0, [], "raman"), solved_once.tip_K.values
    measured = np.isfinite(data.tip_K)
    assert measured.sum() == LABORATORY.raman_points
    assert np.all(np.abs(data.tip_K - tip)[measured] < 4 * data.tip_error_K[measured])
    assert tip[measured].min() > 390


def test_a_reader_is_measured_where_there_is_one():
    assert np.isfinite(data_of(0, ["mesh"], "reader").reader_V).all()
    assert np.isnan(data_of(0, ["mesh"], "reader", Probe.u_shape()).reader_V).all()


@pytest.mark.slow
def test_a_lever_like_the_model_is_calibrated_within_the_stated_error():
    judged = judge(0, departures=["mesh"], laboratory=LABORATORY)
    assert judged.refused == ""
    hot = judged.tip_K.values > LABORATORY.hot_K
    estimate = judged.off_K.sel(way=ESTIMATE).values
    assert np.array_equal(np.isfinite(estimate), hot)
    assert np.nanmax(np.abs(estimate / judged.stated_K.values)) < 3.0
    largest = np.abs(judged.off_K).max("row")
    assert largest.sel(way=ESTIMATE) < largest.sel(way="knee at T_i")
    assert not judged.other_law


def test_a_lever_without_an_answer_is_kept_with_the_reason(monkeypatch):
    def refuse(*_, **__):
        raise study.HotleverError("no lever like this")

    monkeypatch.setattr(study, "calibrate", refuse)
    judged = judge(0, departures=["mesh"], laboratory=LABORATORY)
    assert judged.refused == "no lever like this"
    assert judged.off_K.isnull().all()


def test_a_summary_counts_what_the_bands_hold():
    """Errors of 0.5, 1.5 and 3 stated ones throughout; the last lever was refused."""
    total = study.summary(made_up.judged_levers())
    assert total.answered == 3
    assert total.largest_K.sel(way=ESTIMATE).values == pytest.approx([15.0, 27.0, 30.0])
    assert total.largest_K.sel(way=WAYS[1], percentile=100) == pytest.approx(60.0)
    assert total.coverage.sel(level=0.68).values == pytest.approx(np.full(10, 1 / 3))
    assert total.coverage.sel(level=0.95).values == pytest.approx(np.full(10, 2 / 3))
    assert total.everywhere == pytest.approx(2 / 3)
    assert total.rms == pytest.approx(np.sqrt((0.5**2 + 1.5**2 + 3**2) / 3))
