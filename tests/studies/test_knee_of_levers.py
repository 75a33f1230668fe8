"""The knee of a lever: why it is where it is, what a tip changes, and what remains of the 50 K."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever import Lever, Probe, fit
from hotlever.errors import ComputationError
from hotlever.lever.lever import COARSE
from hotlever.materials.heat import thermal_conductivity
from hotlever.materials.silicon import intrinsic_density
from hotlever.measurement import Measurement
from hotlever.spieser2017 import RAMP
from hotlever.studies import knee_study as knee
from hotlever.studies.knee_study import (
    Suspect,
    by_covariance,
    carried_by,
    measured_carriers,
    read_by_the_line,
    reasons_of_the_knee,
    scattered_at_surfaces,
    steps_at_the_knee,
    steps_to_the_knee,
    suspect_lever,
    tip_effects,
)
from hotlever.studies.raman_check import paper_check
from hotlever.studies.simulation_based_calibration import MinimosMaterial


@pytest.mark.usefixtures("coarse_meshes")
def test_a_lever_that_is_as_the_model_carries_nothing():
    shift_K, missed, off_the_ramp, _ = carried_by(Probe.reference(), "nothing")
    assert shift_K == 0.0
    assert off_the_ramp == pytest.approx(0.0, abs=0.05)
    assert missed == pytest.approx(0.0, abs=0.05)


@pytest.mark.usefixtures("coarse_meshes")
def test_a_thermoelectric_lever_is_measured_by_its_other_polarity():
    shift_K, missed, *_ = carried_by(Probe.reference(), Suspect.AWAY)
    lever = Lever(Probe.reference().with_(thermoelectric=True), COARSE)
    there = lever.branch_to(0.0, lowest=-11.0).mirrored.knee
    assert shift_K == pytest.approx(
        there.tip_K - Lever(Probe.reference(), COARSE).knee().tip_K.item()
    )
    assert 0.0 < abs(missed) < 3.0


def test_the_line_reads_what_the_raman_check_says_it_does():
    check = paper_check()
    reads = check.reads_at_hottest.values[0]
    assert read_by_the_line(check.hottest_K) == pytest.approx(reads)
    assert np.all(np.diff(read_by_the_line(np.linspace(300.0, 1200.0, 50))) > 0)


def test_a_suspect_has_one_thing_more_and_all_together_have_everything():
    probe = Probe.reference().in_medium("air")
    for suspect in Suspect:
        lever, by_line = suspect_lever(probe, suspect)
        more = (
            lever.tip is not None,
            *lever.physics.effects,
            lever.material.c_kappa == "thickness",
            lever.material.kappa_1,
            lever.material.n_i_1 or lever.material.intrinsic_scale != 1.0,
            isinstance(lever.material, MinimosMaterial),
            lever.circuit.chip_K_per_mW,
            by_line,
        )
        assert sum(map(bool, more)) == (8 if suspect == Suspect.TOGETHER else 1), suspect
    together = suspect_lever(probe, Suspect.TOGETHER)[0]
    assert together.tip.in_air
    assert not suspect_lever(Probe.reference(), Suspect.TOGETHER)[0].tip.in_air


def test_a_coefficient_of_a_law_is_a_suspect_of_one_standard_deviation():
    lever, by_line = suspect_lever(Probe.reference(), "mobility_2")
    assert lever == Probe.reference().with_(mobility_2=1.0)
    assert not by_line


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_meshes")
def test_the_covariance_of_a_fit_gives_the_knee_a_standard_error_that_goes_with_the_noise():
    probe, noise = Probe.reference(), np.random.default_rng(0).normal(size=(2, len(RAMP)))
    sweep = Lever(probe, COARSE).sweep(RAMP)
    errors = []
    for share in (1e-3, 2e-3):
        exact = Measurement.of_sweep(sweep)
        noisy = Measurement(
            np.array(RAMP),
            exact.current_mA * (1 + share * noise[0]),
            exact.reader_V * (1 + share * noise[1]),
            exact.tip_K,
            np.full(len(RAMP), 2.0),
        )
        errors.append(by_covariance(fit(noisy, probe)))
    assert errors[0] > 0.0
    assert errors[1] == pytest.approx(2.0 * errors[0], rel=0.5)


def test_a_suspect_that_does_not_count_carries_nothing(monkeypatch):
    carried = {suspect: (1.0 + k, 2.0 + k) for k, suspect in enumerate(Suspect)}
    monkeypatch.setattr(knee, "carried_by", lambda probe, suspect, _: carried[suspect])
    monkeypatch.setattr(knee, "by_covariance", lambda result: 3.0)
    study = knee.compare_suspects(Probe.reference(), None)
    assert np.isnan(study.shift_K.sel(suspect=Suspect.IN_AIR))
    assert study.shift_K.sel(suspect=Suspect.RAMAN).item() == 2.0
    assert study.left_K == pytest.approx(study.discrepancy_K - carried[Suspect.TOGETHER][1])
    assert study.stderr_K == 3.0


def test_surfaces_take_as_much_away_as_c_kappa_where_it_is_cold_and_less_where_it_is_hot():
    T = np.array([300.0, 600.0, 1000.0])
    over = scattered_at_surfaces(T, 0.686)
    assert over[0] == pytest.approx(1.0)
    # what surfaces add does not grow with the temperature
    bulk = thermal_conductivity(T)[0]
    added = 1.0 / (0.686 * bulk * over) - 1.0 / bulk
    assert added == pytest.approx(added[0])
    assert over[2] * 0.686 == pytest.approx(0.91, abs=0.01)


def test_measured_carriers_are_more_than_those_of_the_paper():
    # 1.22 and 1.32 times as many at 700 and 900 K
    over = measured_carriers([700.0, 900.0]) / intrinsic_density(np.array([700.0, 900.0]), 0.0)[0]
    assert over == pytest.approx([1.22, 1.32], abs=0.01)


def test_a_knee_is_read_off_another_row_if_a_current_is_off(coarse):
    steps = steps_at_the_knee(coarse)
    ramp = coarse.sweep(RAMP)
    row = int(np.argmin(abs(ramp.tip_K.values - steps["row_K"])))
    for way, other in (("up", row + 1), ("down", row - 1)):
        current = ramp.current_mA.values.copy()
        lever_V = ramp.bias_V.values - coarse.circuit.series_kohm * current
        assert lever_V[row] > lever_V[other]
        assert steps[f"{way}_K"] == pytest.approx(ramp.tip_K.values[other] - steps["row_K"])
        # with less current behind the same bias V_l is higher
        current[other] *= 1.0 - steps[f"{way}_current"]
        lever_V = ramp.bias_V.values - coarse.circuit.series_kohm * current
        assert lever_V[other] == pytest.approx(lever_V[row])


def test_reasons_for_the_knee_add_up(coarse):
    reasons = reasons_of_the_knee(coarse)
    steps = dict(steps_to_the_knee(reasons))
    assert reasons.inversion_K + sum(steps.values()) == pytest.approx(
        reasons.knee_K.sel(lever="as it is").item()
    )
    assert all(kelvins > 0 for kelvins in steps.values())
    # the paper: approximately 15 K
    assert steps["the legs have a resistance"] == pytest.approx(15, abs=3)
    cold = coarse.with_material(coarse.probe.material.with_(n_d=5e18))
    with pytest.raises(ComputationError, match=r"as it is.*no knee"):
        reasons_of_the_knee(cold)


ONE = ((0.7, 20.0),)


@pytest.mark.usefixtures("coarse_meshes")
def test_in_vacuum_a_tip_only_conducts_and_a_tipless_fit_takes_it_in():
    effects = tip_effects(Probe.reference(), ONE)
    assert effects.moved_K.item() == pytest.approx(0.9, abs=0.2)
    assert effects.knee_V.item() == pytest.approx(effects.without_V + effects.moved_V.item())
    for name in ("surface_moved_K", "surface_moved_V", "surface_at_power_K"):
        assert effects[name].item() == 0.0
    assert abs(effects.missed_K.item()) < 0.1


@pytest.mark.slow
def test_in_air_its_surface_moves_the_knee_by_less_than_a_kelvin():
    effects = tip_effects(Probe.reference().in_medium("air"), ONE)
    assert effects.surface_moved_K.item() == pytest.approx(-0.2, abs=0.1)
    assert effects.surface_moved_V.item() == pytest.approx(0.7e-3, abs=0.3e-3)
    assert effects.surface_at_power_K.item() == pytest.approx(-0.6, abs=0.2)
    assert abs(effects.missed_K.item()) < 0.2
