"""Newton's method for several systems at once, with plain numbers."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import NewtonError
from hotlever.lever.newton import NewtonOptions, find_roots


class Slopes:
    """The slopes of some cubes, as factors."""

    def __init__(self, slopes: np.ndarray) -> None:
        self.slopes = slopes

    def solve(self, right_hand_side, states):
        with np.errstate(divide="ignore", invalid="ignore"):
            return right_hand_side / self.slopes[:, states]

    def replaced(self, states, other) -> Slopes:
        slopes = self.slopes.copy()
        slopes[:, states] = other.slopes
        return Slopes(slopes)


class Cubes:
    """x³ = a for several a."""

    scale, step_limit = np.ones((1, 1)), np.full((1, 1), 0.5)

    def __init__(self, *cubes: float) -> None:
        self.cubes, self.factorised_for = np.array([cubes]), []

    def residual(self, x, which):
        return x**3 - self.cubes[:, which]

    def factorised(self, x, which):
        self.factorised_for.append(which.tolist())
        return Slopes(3 * x**2)


def test_it_keeps_to_its_step_limit_and_converges_for_all():
    cubes = Cubes(2.0, 27.0)
    result = find_roots(cubes, np.array([[0.1, 2.9]]), NewtonOptions(tolerance=1e-12))
    np.testing.assert_allclose(result.x, [[2 ** (1 / 3), 3.0]], atol=1e-9)
    # the second was near its root: no Jacobian was made for it alone
    assert cubes.factorised_for[0] == [0, 1]
    assert all(which == [0] for which in cubes.factorised_for[1:])


def test_old_factors_serve_as_long_as_the_steps_shrink():
    cubes = Cubes(27.0)
    near = cubes.factorised(np.array([[2.95]]), np.array([0]))
    cubes.factorised_for.clear()
    result = find_roots(cubes, np.array([[2.95]]), NewtonOptions(tolerance=1e-9), near)
    np.testing.assert_allclose(result.x, 3.0, atol=1e-8)
    assert cubes.factorised_for == []
    wrong = Slopes(np.array([[1.0]]))
    again = find_roots(cubes, np.array([[2.95]]), NewtonOptions(tolerance=1e-9), wrong)
    np.testing.assert_allclose(again.x, 3.0, atol=1e-8)
    assert cubes.factorised_for
    assert wrong.slopes.item() == 1.0  # what is given is not changed


def test_failures_carry_the_last_iterate():
    with pytest.raises(NewtonError, match="not finite"):
        find_roots(Cubes(2.0), np.array([[0.0]]), NewtonOptions())
    with pytest.raises(NewtonError, match="not converged after 2") as caught:
        find_roots(Cubes(2.0), np.array([[5.0]]), NewtonOptions(max_iterations=2))
    assert caught.value.partial.item() == pytest.approx(4.0)
