"""Levers that a PI controller brings to a resistance: poles, steps in time, limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import curve_fit

from hotlever.errors import InputError
from hotlever.lever import Lever, State
from hotlever.lever.lever import COARSE
from hotlever.lever.set_points import hold
from hotlever.lever.transient import Controller, simulate
from hotlever.lever.transient.closed_loop import ClosedLoop

#: Of a set point (Ω).
STEP = 2.0


@pytest.fixture(scope="module")
def states(coarse, in_air):
    """States at 3 kΩ by lever, the coldest first."""
    reader = {"kind": "supply", "bias_V": 2.0, "series_resistance_ohm": 500.0}
    both = coarse.probe.with_(**{f"circuit.reader.{key}": value for key, value in reader.items()})
    levers = {"vacuum": coarse, "air": in_air, "held reader": Lever(both, COARSE)}
    return {name: hold(lever, "resistance", [3000.0]).states for name, lever in levers.items()}


@pytest.fixture(scope="module")
def loop(states):
    """The closed loop at the colder state in vacuum."""
    return ClosedLoop.at(states["vacuum"][0])


def answer(state, gains, at, step=STEP):
    """How far the resistance is off its set point, per step, the odd part of both directions."""
    off = []
    for each in (step, -step):
        controller = Controller(3000.0 + each, *gains, state.bias_V, 2.0 * state.bias_V)
        history = simulate(state.lever, controller, at=at, start=state, tolerance_K=5e-4)
        off.append((history.resistance_ohm.values - controller.set_ohm) / each)
    return (off[0] + off[1]) / 2.0


@pytest.mark.parametrize(
    ("lever", "number", "gains"),
    [
        ("vacuum", 0, (1.0, 100.0)),
        ("vacuum", 1, (-10.0, -3e4)),
        ("held reader", 0, (-1.0, -100.0)),
    ],
)
def test_a_small_step_is_the_sum_of_the_poles(states, lever, number, gains):
    state = states[lever][number]
    poles, shares = ClosedLoop.at(state).closed(*gains)
    assert poles.real.max() < 0.0
    seen = poles[np.abs(shares) > 0.05]
    at = np.linspace(0.1, 2.0, 20) / abs(seen[0].real)
    expected = (shares * np.exp(np.multiply.outer(at, poles))).sum(axis=1).real
    off = answer(state, gains, at)
    assert off == pytest.approx(expected, abs=5e-3 * np.abs(off).max())


def test_decay_and_frequency_are_those_of_the_slowest_poles(states, loop):
    state, gains = states["vacuum"][0], (0.0, 30.0)
    pole = loop.closed(*gains)[0][0]
    at = np.linspace(1.0, 3.0, 40) / abs(pole.real)

    def oscillation(t, decay, turns, cosine, sine):
        return np.exp(-decay * t) * (cosine * np.cos(turns * t) + sine * np.sin(turns * t))

    begin = (0.7 * abs(pole.real), 1.1 * abs(pole.imag), 1.0, 0.0)
    (decay, turns, *_), _ = curve_fit(oscillation, at, answer(state, gains, at), begin)
    assert decay == pytest.approx(-pole.real, rel=0.01)
    assert turns == pytest.approx(abs(pole.imag), rel=0.01)


def test_a_loop_that_is_not_stable_ends_between_the_limits_of_the_bias(states, loop):
    state, gains = states["vacuum"][0], (0.1, 1e5)
    grows, _ = loop.settling(*gains)
    assert -3.0 < grows < 0.0
    controller = Controller(3010.0, *gains, state.bias_V, 1.1 * state.bias_V)
    history = simulate(state.lever, controller, 8.0, start=state)
    time, off = history.time.values, np.abs(history.resistance_ohm.values - 3010.0)
    assert history.bias_V.values.max() == pytest.approx(controller.limit_V, rel=1e-6)
    assert off[time > 5.0].max() > 5.0 * off[time < 1.0].max()
    assert imbalance(history) < 1e-6


def imbalance(history):
    """Energy that is unaccounted for, over what was supplied."""
    rise = history.stored_nJ + history.air_stored_nJ
    missing = history.supplied_nJ - (rise - rise[0]) - history.lost_nJ
    return float(np.abs(missing).max() / history.supplied_nJ.values[-1])


@pytest.mark.parametrize("lever", ["vacuum", pytest.param("air", marks=pytest.mark.slow)])
def test_a_step_ends_at_the_state_that_is_held(states, lever):
    start = hold(states[lever][0].lever, "resistance", [2500.0]).states[0]
    end = states[lever][0]
    # the bias meets its limit on the way, and is back soon after
    controller = Controller(3000.0, 5.0, 100.0, start.bias_V, 1.1 * end.bias_V)
    history = simulate(end.lever, controller, 400.0, start=start)
    assert history.tip_K.values[0] == pytest.approx(start.tip_K, abs=1e-6)
    assert history.bias_V.values.max() == pytest.approx(controller.limit_V, rel=1e-6)
    assert history.tip_K.values[-1] == pytest.approx(end.tip_K, abs=0.05)
    assert history.tip_K.values.max() < end.tip_K + 5.0
    assert history.set_ohm.values.tolist() == [3000.0] * history.time.size
    assert imbalance(history) < 1e-6


def test_a_lever_at_its_set_point_stays_there(states):
    state = states["vacuum"][1]
    controller = Controller(3000.0, -1.0, -100.0, state.bias_V, 12.0)
    history = simulate(state.lever, controller, 100.0, start=state)
    assert np.ptp(history.tip_K.values) < 1e-3


@pytest.mark.parametrize(("number", "sign"), [(0, 1.0), (1, -1.0)])
def test_gains_have_the_sign_of_the_slope_of_the_resistance(states, number, sign):
    held = ClosedLoop.at(states["vacuum"][number])
    assert held.settling(sign * 0.1, sign * 10.0)[0] > 0.0
    assert held.settling(-sign * 0.1, -sign * 10.0)[0] < 0.0


def test_a_map_holds_the_verdict_of_single_loops(loop):
    data = loop.gain_map(1.0)
    for row, column in ((10, 75), (60, 30), (30, 40)):
        growth = data.growth_per_us.values[row, column]
        P, per_ms = data.proportional.values[row], data.integral.values[column]
        assert growth == pytest.approx(loop.closed(P, per_ms)[0][0].real, rel=1e-6)
        assert np.isnan(data.settling_us.values[row, column]) == (growth >= 0.0)
    assert 0.02 < np.isnan(data.settling_us.values).mean() < 0.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"integral": 0.0}, "I other than 0"),
        ({"proportional": np.inf}, "expected finite ones"),
        ({"set_ohm": -1.0}, "expected one above 0"),
        ({"filter_us": 0.0}, "found a filter of 0 µs"),
        ({"limit_V": 7.0}, "expected at least the bias from which"),
    ],
)
def test_what_no_controller_has_is_refused(change, message):
    values = {"set_ohm": 3e3, "proportional": 1.0, "integral": 10.0, "before_V": 8.0, "limit_V": 9}
    with pytest.raises(InputError, match=message):
        Controller(**(values | change))


def test_a_controller_begins_with_a_current(coarse):
    controller = Controller(3000.0, 1.0, 10.0, 8.0, 9.0)
    cold = State(coarse, np.zeros((coarse.space.size + 1, 1)))
    with pytest.raises(InputError, match="cannot start without a current"):
        simulate(coarse, controller, 10.0, start=cold)
