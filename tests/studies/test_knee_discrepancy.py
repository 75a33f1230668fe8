"""What remains of the 50 K at the knee: the suspects one by one."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever import Lever, Probe, figures, fit
from hotlever.lever.lever import COARSE
from hotlever.measurement import Measurement
from hotlever.spieser2017 import RAMP
from hotlever.studies import knee_study as knee
from hotlever.studies.knee_study import (
    AWAY,
    IN_AIR,
    RAMAN,
    SUSPECTS,
    TOGETHER,
    by_covariance,
    carried_by,
    read_by_the_line,
    suspect_lever,
)
from hotlever.studies.raman_check import paper_check


@pytest.mark.usefixtures("coarse_meshes")
def test_a_lever_that_is_as_the_model_carries_nothing():
    shift_K, missed = carried_by(Probe.reference(), "nothing")
    assert shift_K == 0.0
    assert missed == pytest.approx(0.0, abs=0.05)


@pytest.mark.usefixtures("coarse_meshes")
def test_a_thermoelectric_lever_is_measured_by_its_other_polarity():
    shift_K, missed = carried_by(Probe.reference(), AWAY)
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
    for suspect in SUSPECTS:
        lever, by_line = suspect_lever(probe, suspect)
        more = (lever.tip is not None, *lever.physics.effects, *(["line"] if by_line else []))
        assert sum(map(bool, more)) == (4 if suspect == TOGETHER else 1)
    together = suspect_lever(probe, TOGETHER)[0]
    assert together.tip.in_air
    assert not suspect_lever(Probe.reference(), TOGETHER)[0].tip.in_air


@pytest.mark.usefixtures("coarse_meshes")
def test_the_covariance_of_a_fit_gives_the_knee_a_standard_error_that_goes_with_the_noise():
    probe, noise = Probe.reference(), np.random.default_rng(0).normal(size=(2, RAMP.size))
    sweep = Lever(probe, COARSE).sweep(RAMP)
    errors = []
    for share in (1e-3, 2e-3):
        exact = Measurement.of_sweep(sweep)
        noisy = Measurement(
            RAMP,
            exact.current_mA * (1 + share * noise[0]),
            exact.reader_V * (1 + share * noise[1]),
            exact.tip_K,
            np.full(RAMP.size, 2.0),
        )
        errors.append(by_covariance(fit(noisy, probe)))
    assert errors[0] > 0.0
    assert errors[1] == pytest.approx(2.0 * errors[0], rel=0.5)


def test_a_suspect_that_does_not_count_is_left_out_of_the_figure(tmp_path, monkeypatch):
    carried = {suspect: (1.0 + k, 2.0 + k) for k, suspect in enumerate(SUSPECTS)}
    monkeypatch.setattr(knee, "carried_by", lambda probe, suspect, _: carried[suspect])
    monkeypatch.setattr(knee, "by_covariance", lambda result: 3.0)
    monkeypatch.setattr(knee, "by_layout", lambda probe, progress: 4.0)
    study = knee.compare_suspects(Probe.reference(), None)
    assert np.isnan(study.shift_K.sel(suspect=IN_AIR))
    assert study.shift_K.sel(suspect=RAMAN).item() == 2.0
    assert study.left_K == pytest.approx(study.discrepancy_K - carried[TOGETHER][1])
    assert study.total_stderr_K == pytest.approx(5.0)
    path = tmp_path / "figure.png"
    figures.save_figure(figures.knee_discrepancy({"vacuum": study}), path)
    assert path.stat().st_size > 5000
