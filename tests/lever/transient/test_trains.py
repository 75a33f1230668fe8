"""Trains of pulses on modes: as the full lever, and saying so."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import HistoryEndError
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.lever.transient import integrate, pulse, simulate, step
from hotlever.lever.transient.reduced import reduced_in_time
from hotlever.lever.transient.trains import Train

TRAIN = pulse(9.0, 4.0, 20.0, 20)
TIMES = [4.0, 60.0, 64.0, 384.0, 396.0, 400.0]


@pytest.fixture(scope="module")
def states():
    return []


@pytest.fixture(scope="module")
def train(coarse, states):
    return simulate(coarse, TRAIN, at=TIMES, callback=lambda t, state: states.append((t, state)))


@pytest.mark.slow
def test_a_train_on_modes_is_that_of_the_full_lever(coarse, train, states):
    full = integrate(coarse, TRAIN, at=TIMES)
    np.testing.assert_array_equal(train.time, TIMES)
    np.testing.assert_allclose(train.tip_K, full.tip_K, atol=0.1)
    np.testing.assert_allclose(train.max_K, full.max_K, atol=0.1)
    for name in ("current_mA", "reader_V", "stored_nJ", "lost_nJ", "supplied_nJ"):
        np.testing.assert_allclose(train[name], full[name], rtol=5e-3, atol=1e-3)
    assert "modes, within 0.0" in train.attrs["notes"]
    assert "modes" not in full.attrs["notes"]
    assert [t for t, _ in states] == TIMES
    for (_, state), tip in zip(states, train.tip_K.values, strict=True):
        assert isinstance(state.lever.space, FullSpace)
        assert state.tip_K == pytest.approx(tip, abs=1e-6)


def test_periods_that_are_alike_are_copied(coarse):
    """A lever on modes, with itself followed all the way, also where the train ends."""
    snapshots = []
    integrate(coarse, TRAIN, 40.0, per_step=2, callback=lambda t, state: snapshots.append(state.x))
    reduced = reduced_in_time(coarse, np.hstack(snapshots))
    at = np.array([0.0, *TIMES, 403.0, 430.0])
    train = Train(reduced, TRAIN, 20.0, 430.0, at, 0.1)
    copied, full = train.history, integrate(reduced, TRAIN, 430.0, at)
    assert 4 < train.cyclic_from < 16
    np.testing.assert_array_equal(copied.time_us, at)
    np.testing.assert_array_equal(copied.bias_V, full.bias_V)
    np.testing.assert_allclose(copied.tip_K, full.tip_K, atol=0.01)
    for name in ("supplied_nJ", "stored_nJ", "lost_nJ"):
        np.testing.assert_allclose(copied[name], full[name], rtol=1e-4, atol=2e-3)
    assert [t for t, _ in train.states] == at.tolist()
    assert [state.tip_K for _, state in train.states] == pytest.approx(copied.tip_K.values.tolist())


def test_what_melts_or_is_short_is_followed_in_full(coarse):
    with pytest.raises(HistoryEndError, match=r"melts after 1\.2"):
        simulate(coarse, pulse(40.0, 4.0, 20.0, 30))
    assert not simulate(coarse, pulse(9.0, 4.0, 20.0, 30), at=[4.0]).attrs["notes"]


@pytest.mark.slow
def test_a_train_from_a_warm_lever_is_not_that_of_a_cold_one(coarse):
    (warm,) = coarse.solve([5.0])
    found = simulate(coarse, TRAIN, at=[0.0, 400.0], start=warm)
    assert found.tip_K.values[0] == pytest.approx(warm.tip_K)
    assert "modes" not in found.attrs["notes"]


def test_laws_that_are_looked_up_are_the_laws(coarse):
    snapshots = []
    integrate(coarse, step(8.0), 50.0, callback=lambda t, state: snapshots.append(state.x))
    reduced = reduced_in_time(coarse, np.hstack(snapshots))
    exact = LeverEquations(reduced.space, coarse.probe.kinds, coarse.circuit).laws
    T = np.random.default_rng(0).uniform(293.0, 1600.0, (reduced.space.weights.size, 3))
    tabulated = reduced.equations.laws
    (looked_up, by), (true, true_by) = tabulated.properties(T), exact.properties(T)
    np.testing.assert_allclose(looked_up.kappa, true.kappa, rtol=2e-4)
    np.testing.assert_allclose(looked_up.sigma, true.sigma, rtol=1e-6)
    np.testing.assert_allclose(by["T"].sigma, true_by["T"].sigma, rtol=1e-3, atol=1e-6)
    for found, expected in zip(tabulated.heat_density(T), exact.heat_density(T), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-5)
    # Newton's method may stray beyond the table
    hot = np.full_like(T, 2500.0)
    assert (tabulated.heat_density(hot)[0] > exact.heat_density(T)[0]).all()
