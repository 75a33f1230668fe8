"""The steps in time, on problems whose solution is known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hotlever.errors import ComputationError
from hotlever.lever.transient.runge_kutta import ARK436L2SA, Stepper, StepperOptions

TIMES, STAGES, EMBEDDED = ARK436L2SA.times, ARK436L2SA.stages, ARK436L2SA.embedded
WEIGHTS = ARK436L2SA.weights


def test_the_coefficients_fulfil_the_conditions_of_their_orders():
    twice = STAGES @ TIMES
    third = {"x³": (TIMES**2, 1 / 3), "xAx": (twice, 1 / 6)}
    fourth = {
        "c³": (TIMES**3, 1 / 4),
        "cAc": (TIMES * twice, 1 / 8),
        "Ac²": (STAGES @ TIMES**2, 1 / 12),
        "AAc": (STAGES @ twice, 1 / 24),
    }
    for weights, conditions in ((WEIGHTS, third | fourth), (EMBEDDED, third)):
        assert weights.sum() == pytest.approx(1.0, abs=1e-14)
        assert weights @ TIMES == pytest.approx(1 / 2, abs=1e-14)
        for vector, value in conditions.values():
            assert weights @ vector == pytest.approx(value, abs=1e-14)
    # the embedded method is of another order, or it would tell no error
    assert abs(EMBEDDED @ TIMES**3 - 1 / 4) > 1e-4
    np.testing.assert_allclose(twice, TIMES**2 / 2, atol=1e-14)


def test_what_decays_fast_is_gone_after_one_step():
    """L-stable: the stability function vanishes at minus infinity, and is below one before."""
    one = np.ones(6)
    for z in (-1.0, -30.0, 3j, 100j, -1e9):
        grown = abs(1.0 + z * (WEIGHTS @ np.linalg.solve(np.eye(6) - z * STAGES, one)))
        assert grown <= 1.0
    assert grown < 1e-6


class Dense:
    """The inverse of a small matrix, as `LinearSolver`."""

    def __init__(self, matrix: np.ndarray) -> None:
        self.matrix = matrix

    def solve(self, right_hand_side):
        return np.linalg.solve(self.matrix, right_hand_side[:, 0])[:, None]


class Pendulum:
    """A nonlinear problem of index one: y + y³ is stored, z is algebraic.

    It has y = sin t and z = y² + cos t.
    """

    scale = np.ones((2, 1))

    def storage(self, x):
        return np.array([x[0] + x[0] ** 3, 0.0 * x[1]])

    def storage_change(self, x, changes):
        return np.array([1.0 + 3.0 * x[0] ** 2, 0.0 * x[1]])[..., None] * changes

    def residual(self, t, x):
        y, z = x
        flow = (1.0 + 3.0 * y**2) * (z - y**2) - 50.0 * (y - np.sin(t))
        return np.array([-flow, z - y**2 - np.cos(t)])

    def factorised(self, x, rate):
        (y,), (z,) = x
        flow_by_y = 6.0 * y * (z - y**2) - 2.0 * y * (1.0 + 3.0 * y**2) - 50.0
        flow_by_z = 1.0 + 3.0 * y**2
        return Dense(
            np.array([[rate * (1.0 + 3.0 * y**2) - flow_by_y, -flow_by_z], [-2.0 * y, 1.0]])
        )

    def norm(self, change):
        return float(abs(change[0, 0]))

    def monitored(self, x):
        return x[1:]


def test_changes_of_the_step_are_in_bounds():
    safety, least, most, failed = 0.9, 0.2, 6.0, 0.25
    change = StepperOptions().step_change
    assert change(0.0) == most
    assert change(1.0) == safety
    assert change(1.001) < safety
    assert change(1e9) == least
    assert change(np.inf) == failed


START = np.array([[0.0], [1.0]])


def integrate(tolerance, longest=np.inf):
    stepper = Stepper(Pendulum(), tolerance)
    return list(stepper.steps(0.0, 6.0, START, longest))


def test_the_tolerance_controls_the_error():
    for tolerance in (1e-3, 1e-5, 1e-7):
        steps = integrate(tolerance)
        y, z = np.array([step.x[:, 1] for step in steps]).T
        end = np.array([step.end for step in steps])
        assert np.abs(y - np.sin(end)).max() < 5.0 * tolerance
        assert np.abs(z - np.sin(end) ** 2 - np.cos(end)).max() < 10.0 * tolerance
        assert [step.start for step in steps[1:]] == [step.end for step in steps[:-1]]
        assert steps[-1].end == 6.0


def test_the_error_falls_with_the_fourth_power_of_the_step():
    errors = []
    for count in (60, 120):
        # the last step is any length, and the error passes zero here and there
        late = [step for step in integrate(1e-5, 6.0 / count) if step.end > 3.0]
        errors.append(max(abs(step.x[0, 1] - np.sin(step.end)) for step in late))
    assert np.log2(errors[0] / errors[1]) > 3.5


def test_slopes_and_integrals_are_those_of_the_solution():
    steps = integrate(1e-6)
    for step in steps:
        slopes = np.array([np.cos(step.end), np.sin(2 * step.end) - np.sin(step.end)])
        np.testing.assert_allclose(step.slopes[:, 1], slopes, atol=2e-2)
    # the integral of z = sin² + cos
    assert sum(step.added[0] for step in steps) == pytest.approx(
        3.0 - np.sin(12.0) / 4 + np.sin(6.0), abs=1e-5
    )
    for one, next_one in pairwise(steps):
        np.testing.assert_array_equal(one.x[:, 1], next_one.x[:, 0])


def test_algebraic_rows_that_are_not_fulfilled_are_so_first():
    stepper = Stepper(Pendulum(), 1e-4)
    first = next(stepper.steps(0.0, 1.0, np.array([[0.0], [7.0]]), np.inf))
    np.testing.assert_allclose(first.x[:, 0], [0.0, 1.0], atol=1e-8)
    np.testing.assert_allclose(first.slopes[:, 0], [1.0, 0.0], atol=1e-5)


def test_what_cannot_be_followed_ends_with_the_time():
    class Blowing(Pendulum):
        def residual(self, t, x):
            return super().residual(t, x) + (np.nan if t > 2.0 else 0.0)

    with pytest.raises(ComputationError, match="no step in time is short enough at 2"):
        list(Stepper(Blowing(), 1e-4).steps(0.0, 6.0, START, np.inf))
