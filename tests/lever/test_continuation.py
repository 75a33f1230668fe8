"""Following the branch through any series resistance."""

from __future__ import annotations

import numpy as np
import pytest
from taylor import remainder_orders

from hotlever.errors import BranchEndError, InputError, NewtonError
from hotlever.lever import Lever
from hotlever.lever.newton import NewtonOptions, newton


def with_series(lever: Lever, ohm: float) -> Lever:
    return Lever(lever.probe.with_values({"series_resistance_ohm": ohm}), space=lever.space)


def test_without_a_series_resistor_the_branch_ends_at_the_knee(coarse):
    knee = coarse.knee()
    with pytest.raises(BranchEndError, match="branch of a slow bias ramp ends") as caught:
        with_series(coarse, 0.0).sweep(np.linspace(0.5, 5, 10))
    error = caught.value
    assert error.bias_reached == pytest.approx(knee.lever_V.item(), abs=1e-6)
    assert error.partial.bias_V.values.tolist() == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert error.partial.tip_K.values[-1] < knee.tip_K.item()


def test_knee_state_does_not_depend_on_the_series_resistor(coarse):
    knees = [with_series(coarse, ohm).knee() for ohm in (0.0, 5600.0, 20000.0)]
    for name in ("lever_V", "current_mA", "tip_K"):
        values = [knee[name].item() for knee in knees]
        np.testing.assert_allclose(values, values[0], rtol=1e-9)


def test_branch_end_of_zero_resistance_is_the_limit_of_small_ones(coarse):
    ends = []
    for ohm in (0.0, 100.0, 200.0):
        lever = with_series(coarse, ohm)
        follower = lever.follower()
        for _ in follower.follow_arc(lambda _, follower=follower: not follower.folds):
            pass
        ends.append(follower.folds[0].bias)
    assert ends[1] - ends[0] == pytest.approx(ends[2] - ends[1], rel=0.05)


def test_a_large_resistor_makes_the_lever_jump_and_the_sweep_says_so(coarse):
    lever = with_series(coarse, 30000.0)
    bias = np.linspace(25, 36, 23)
    sweep = lever.sweep(bias)
    assert "jumps from a tip at" in sweep.attrs["notes"]
    rise = np.diff(sweep.tip_K)
    assert rise.max() > 80  # the jump
    assert (rise > 0).all()
    np.testing.assert_allclose(sweep.lever_V + 30.0 * sweep.current_mA, sweep.bias_V, rtol=1e-9)


def test_without_a_jump_nothing_is_noted(coarse):
    assert coarse.sweep([1.0, 5.0]).attrs["notes"] == ""


def test_steps_do_not_change_the_states(coarse):
    """One bias directly, or with many on the way."""
    direct = coarse.sweep([9.0])
    fine = coarse.sweep(np.linspace(0.5, 9.0, 60)).isel(bias=-1)
    np.testing.assert_allclose(direct.tip_K.item(), fine.tip_K.item(), atol=1e-6)


def test_biases_may_come_in_any_order_and_twice(coarse):
    sweep = coarse.sweep([5.0, 1.0, 5.0])
    assert sweep.bias_V.values.tolist() == [5.0, 1.0, 5.0]
    assert sweep.tip_K[0] == sweep.tip_K[2] > sweep.tip_K[1]


def test_zero_bias_is_the_base_temperature(coarse):
    sweep = coarse.sweep([0.0])
    assert sweep.tip_K.item() == pytest.approx(293.0)
    assert sweep.current_mA.item() == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(sweep.heater_ohm.item())


@pytest.mark.parametrize("bias", [[-1.0], [np.nan], [np.inf]])
def test_impossible_biases_are_refused(coarse, bias):
    with pytest.raises(InputError, match="expected finite biases of 0 or more"):
        coarse.sweep(bias)


def test_a_melting_lever_ends_the_branch(coarse):
    with pytest.raises(BranchEndError, match="silicon melts") as caught:
        coarse.sweep([10.0, 40.0])
    assert caught.value.partial.bias_V.values.tolist() == [10.0]
    assert 11.0 < caught.value.bias_reached < 40.0


def test_extrapolated_laws_are_noted(coarse):
    assert (
        "above 1300 K, where the material laws are extrapolated"
        in (coarse.sweep([13.0]).attrs["notes"])
    )


def test_jacobian_passes_a_taylor_test(coarse):
    x = coarse.solve([8.5]).states[0].x
    orders = remainder_orders(coarse.equations, x, seed=1, steps=(0.4, 0.2, 0.1))
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


class Polynomial:
    """x³ = 2 with plain numbers, for the solver alone."""

    scale = np.ones(1)
    step_limit = np.full(1, 0.5)

    def residual(self, x):
        return x**3 - 2

    def factorised(self, x):
        slope = 3 * x**2

        class Solver:
            @staticmethod
            def solve(b):
                with np.errstate(divide="ignore", invalid="ignore"):
                    return b / slope

        return Solver()


def test_newton_keeps_to_its_step_limit_and_converges():
    result = newton(Polynomial(), np.array([0.1]), NewtonOptions(tolerance=1e-12))
    assert result.x[0] == pytest.approx(2 ** (1 / 3), abs=1e-9)


def test_newton_raises_with_the_last_iterate():
    with pytest.raises(NewtonError, match="not finite"):
        newton(Polynomial(), np.array([0.0]), NewtonOptions())
    with pytest.raises(NewtonError, match="not converged after 2") as caught:
        newton(Polynomial(), np.array([5.0]), NewtonOptions(max_iterations=2))
    assert caught.value.partial[0] == pytest.approx(4.0)
