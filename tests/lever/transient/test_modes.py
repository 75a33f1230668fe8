"""Time constants: what a history does late, the runaway, and what the source holds."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import ComputationError, InputError
from hotlever.lever.transient import (
    pulse,
    rise_times,
    simulate,
    sine,
    time_constants,
    with_times,
)
from hotlever.lever.transient.modes import slowest_modes
from hotlever.lever.transient.runge_kutta import Stepper
from hotlever.lever.transient.transient_problem import TransientProblem
from hotlever.probe import Circuit


def slowest(lever, bias, source="bias"):
    return float(time_constants(lever, [bias], source).time_constant_us[0, 0])


@pytest.mark.parametrize(
    ("bias", "source", "runs_away"),
    [
        (4.0, "bias", False),
        (8.268, "bias", False),
        (4.0, "voltage", False),
        (10.0, "voltage", True),
    ],
)
def test_a_small_change_decays_or_grows_as_its_mode_says(coarse, bias, source, runs_away):
    """Beyond the fold, a state that the resistor holds is no longer held without it."""
    (state,) = coarse.solve([bias])
    constants, changes = slowest_modes(state, source)
    assert (constants[0] < 0) == runs_away
    assert (constants[1:] > 0).all()
    mode = changes[:, [0]] / coarse.space.tip_rise(changes[:, 0])
    start = state.x + 1e-3 * mode
    circuit = coarse.circuit if source == "bias" else Circuit(series_resistance_ohm=0.0)
    held = bias if source == "bias" else state.lever_V
    problem = TransientProblem(coarse.equations, circuit, lambda t: held)
    until = 2.0 * abs(constants[0])
    *_, last = Stepper(problem, 1e-6).steps(0.0, until, start, np.inf)
    left = float(coarse.space.tip_rise(last.x[:, 1] - state.x[:, 0]))
    assert left == pytest.approx(1e-3 * np.exp(2.0 if runs_away else -2.0), rel=2e-3)


def test_without_power_the_source_does_not_matter(coarse):
    found = [slowest(coarse, 0.01, source) for source in ("bias", "voltage", "current", "power")]
    np.testing.assert_allclose(found, found[0], rtol=1e-4)


def test_heating_that_raises_the_resistance_slows_a_driven_current_down(coarse):
    """Below the knee: a current heats more when the resistance rises, a voltage less."""
    found = {name: slowest(coarse, 6.5, name) for name in ("voltage", "power", "bias", "current")}
    assert found["voltage"] < found["power"] < found["bias"] < found["current"]


@pytest.fixture(scope="module")
def rises(coarse):
    return rise_times(coarse, [1.0, 8.268, 4.0])


def test_rise_times_are_read_off_histories(coarse, rises):
    tau = slowest(coarse, 1.0)
    # several modes: less than ln 9 of the slowest
    assert 1.5 * tau < float(rises.heating_us[0]) < np.log(9.0) * tau
    assert float(rises.cooling_us[0]) == pytest.approx(float(rises.heating_us[0]), rel=0.05)
    # a hot lever is slow to heat towards its knee, and fast to cool
    assert float(rises.heating_us[1]) > 2.0 * float(rises.cooling_us[1])
    assert rises.tip_K.values[1] == pytest.approx(coarse.solve([8.268])[0].tip_K)


def test_a_history_says_how_fast_it_is(coarse, rises):
    states = []
    history = simulate(
        coarse, pulse(4.0, 300.0), 600.0, per_step=8, callback=lambda t, state: states.append(state)
    )
    found = with_times(history, states[0], states[-1]).attrs
    alone = rises.sel(bias=4.0)
    assert found["heating_us"] == pytest.approx(alone.heating_us.item(), rel=5e-3)
    assert found["cooling_us"] == pytest.approx(alone.cooling_us.item(), rel=5e-3)
    # cold at both ends, but without a bias nothing feeds back
    constants = [found[f"time_constants_us_at_{end}"] for end in ("start", "end")]
    assert constants[0][0] > constants[1][0] == pytest.approx(slowest(coarse, 1e-3), rel=1e-3)
    at_rest = simulate(coarse, sine(4.0, 0.0, 2e4), 100.0)
    assert 0.0 < np.ptp(at_rest.tip_K.values) < 1e-4
    flat = with_times(at_rest, states[0], states[-1]).attrs
    assert np.isnan([flat["heating_us"], flat["cooling_us"]]).all()
    few = with_times(history, states[0], states[-1], resolved=False).attrs
    assert "heating_us" not in few


def test_what_does_not_exist_is_refused(coarse):
    with pytest.raises(InputError, match="did you mean 'voltage'"):
        time_constants(coarse, [1.0], "voltag")
    with pytest.raises(ComputationError, match="without power"):
        time_constants(coarse, [0.0], "power")
