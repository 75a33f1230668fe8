"""Twins of one material: what is measured of them, and what their fits have in common."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.probe import Probe
from hotlever.spieser2017 import HOTTEST_TIP_K, NOMINAL_DOPING
from hotlever.studies.simulation_based_calibration import (
    DEPARTURES,
    ERRORS,
    FREE,
    HELD,
    LaboratoryOptions,
    consistency_study,
    largest_deviation,
    published_levers,
    twin_measurement,
)

pytestmark = pytest.mark.usefixtures("coarse_meshes")


NOISELESS = LaboratoryOptions(noise=0.0, raman_errors=(0.0, 0.02))


def test_errors_are_those_that_calibrations_are_judged_by():
    assert all(name in DEPARTURES for names in ERRORS.values() for name in names)
    assert set(ERRORS["all"]) == {name for names in ERRORS.values() for name in names}


def test_without_noise_and_errors_twins_have_the_parameters_that_they_were_made_of():
    progress = []
    probe = Probe.reference().with_(c_kappa=0.66, n_d=5e17)
    geometries = {"short": {"length_um": 45.0}, "other heater": {"heater_width_um": 2.0}}
    study = consistency_study(
        probe,
        geometries,
        ("none",),
        laboratory=NOISELESS,
        progress=lambda done, total: progress.append((done, total)),
    )
    assert progress[-1] == (2, 2)
    free = study.value.sel(error="none", doping=FREE)
    np.testing.assert_allclose(free, np.broadcast_to(study.true_value, free.shape), rtol=2e-3)
    assert (study.value.sel(doping=HELD, parameter="n_d") == NOMINAL_DOPING).all()
    assert (largest_deviation(study).sel(doping=FREE) < 2e-3).all()


def test_a_thermometer_that_is_off_reads_all_rises_off_alike():
    probe, rng = Probe.reference(), np.random.default_rng
    right, wrong = (
        twin_measurement(probe, names, rng(0), NOISELESS) for names in ((), ("thermometer",))
    )
    assert right.tip_K.max() == pytest.approx(HOTTEST_TIP_K, abs=0.5)
    ratio = (wrong.tip_K - 293.0) / (right.tip_K - 293.0)
    assert np.ptp(ratio) < 1e-9
    assert 1e-4 < abs(ratio[0] - 1.0) < 0.08
    np.testing.assert_array_equal(right.current_mA, wrong.current_mA)


def test_the_paper_s_levers_agree_within_ten_per_cent_only_with_their_doping_held():
    away = largest_deviation(published_levers())
    # by hand: 0.686, 0.687, 0.688 and 0.613 have the mean 0.6685
    assert away.sel(doping=FREE, parameter="c_kappa").item() == pytest.approx(0.083, abs=5e-4)
    assert away.sel(doping=FREE, parameter="delta").item() == pytest.approx(0.149, abs=5e-4)
    assert away.sel(doping=HELD).max() < 0.1
