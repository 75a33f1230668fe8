"""Fits of histories: what they were made with is found again, and what is missing is said."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.fitting.in_time import fit_history
from hotlever.lever.transient import pulse

TIMES = np.array([0.2, 1.0, 3.0, 6.0, 10.0, 15.0, 20.0])
WAVE = pulse(9.0, 30.0)


@pytest.fixture(scope="module")
def measured(coarse):
    """A lever of a larger heat capacity and doping, measured with a little noise."""
    twin = coarse.with_probe(coarse.probe.moved({"heat_capacity_scale": 1.08, "n_d": 5.9e17}))
    found = twin.pulse(WAVE, at=TIMES, tolerance_K=0.02)
    noise = np.random.default_rng(0).normal(1.0, 1e-5, (2, TIMES.size))
    return found.current_mA.values * noise[0], found.reader_V.values * noise[1]


def test_a_scale_of_the_heat_capacity_is_found(coarse, measured):
    current, reader = measured
    found = fit_history(
        coarse, WAVE, TIMES, current, ["heat_capacity_scale", "n_d"], reader_V=reader
    )
    assert found.probe.material.heat_capacity_scale == pytest.approx(1.08, abs=3e-3)
    assert found.probe.material.n_d == pytest.approx(5.9e17, rel=1e-3)
    assert 0.0 < found.stderr["heat_capacity_scale"] < 3e-3
    assert (found.tip_stderr_K < 0.5).all()
    assert found.evaluations < 10


def test_data_that_do_not_match_are_refused(coarse):
    for times, current in (([1.0, 2.0], [1.0]), ([2.0, 1.0], [1.0, 1.0])):
        with pytest.raises(InputError, match="expected times that rise"):
            fit_history(coarse, WAVE, times, current, ["n_d"])
    with pytest.raises(InputError, match="found no current"):
        fit_history(coarse, WAVE, [1.0], [np.nan], ["n_d"])
