"""Levers solved at tip temperatures instead of biases."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.calibration.characteristic import characteristic, states_at_tip
from hotlever.errors import InputError


def test_states_at_a_tip_temperature_are_those_of_a_sweep(lever):
    sweep = lever.sweep([2.0, 7.5, 8.6])
    ramp = states_at_tip(lever, sweep.tip_K.values[::-1])
    np.testing.assert_allclose([state.bias for state in ramp.states], sweep.bias_V, rtol=1e-6)


def test_the_curve_between_the_states_is_that_of_a_sweep(lever, reference):
    sweep = lever.sweep([0.3, 1.7, 5.0, 7.3, 7.9, 8.4, 9.7, 10.9])
    np.testing.assert_allclose(reference.tip_temperature(sweep.power_mW), sweep.tip_K, atol=0.03)
    np.testing.assert_allclose(reference.lever_voltage(sweep.tip_K), sweep.lever_V, atol=2e-4)
    np.testing.assert_allclose(reference.power(sweep.tip_K), sweep.power_mW, atol=2e-4)


def test_the_knee_is_that_of_the_lever(lever, reference):
    exact = lever.knee()
    assert reference.knee.tip_K == pytest.approx(exact.tip_K.item(), abs=0.02)
    assert reference.knee.power_mW == pytest.approx(exact.power_mW.item(), rel=1e-4)
    assert reference.knee.lever_V == pytest.approx(exact.lever_V.item(), rel=1e-5)
    assert reference.knee.current_mA == pytest.approx(exact.current_mA.item(), rel=1e-4)


def test_the_series_resistor_does_not_matter(coarse):
    bare = type(coarse)(coarse.probe.with_values({"series_resistance_ohm": 0}), space=coarse.space)
    with_resistor, without = (characteristic(one, 1000.0) for one in (coarse, bare))
    np.testing.assert_allclose(with_resistor.data.power_mW, without.data.power_mW, rtol=1e-8)
    assert with_resistor.data.bias_V[-1] > without.data.bias_V[-1]


def test_a_lever_too_cold_has_no_knee(coarse):
    assert characteristic(coarse, 700.0).knee is None


def test_nothing_is_said_beyond_the_hottest_state(reference):
    assert np.isnan(reference.tip_temperature(reference.highest_power_mW + 0.1))
    assert np.isnan(reference.power([280.0, 1400.0])).all()


@pytest.mark.parametrize("tip", [293.0, 200.0, 2000.0, np.nan])
def test_impossible_tip_temperatures_are_refused(coarse, tip):
    with pytest.raises(InputError, match="above the base temperature of 293 K"):
        states_at_tip(coarse, [tip])
