"""A manufactured solution in time with the real laws: the method shows its order."""

from __future__ import annotations

import numpy as np
from made_up_fields import BASE, BIAS, LENGTH, WIDTH, Exact, nodal_state, silicon_strip, source
from skfem.element import ElementTriP3

from hotlever.lever.transient.runge_kutta import Stepper
from hotlever.lever.transient.transient_problem import TransientProblem
from hotlever.materials.heat import heat_capacity
from hotlever.probe import Circuit

#: Period (µs), of the order of what heat takes along the strip; and amplitude (K).
PERIOD, AMPLITUDE = 0.4, 250.0


def exact_at(t: float) -> Exact:
    phase = 2 * np.pi * t / PERIOD
    return Exact(AMPLITUDE * (1 - 0.8 * np.cos(phase)) / 1.8, BIAS + 0.4 * np.sin(phase))


class Loaded(TransientProblem):
    """The lever with the sources that the made-up fields need."""

    def residual(self, t: float, x: np.ndarray) -> np.ndarray:
        exact, space = exact_at(t), self.equations.space
        places = space.elements.positions
        heat, charge = exact.loads(*places)
        T = exact.temperature(*places)[0]
        rate = 2 * np.pi / PERIOD * np.sin(2 * np.pi * t / PERIOD)
        rise = 0.8 * AMPLITUDE / 1.8 * rate * np.sin(np.pi / LENGTH * places[0])
        rise *= 1 + 0.3 * np.cos(np.pi / WIDTH * places[1])
        # J/(cm³ µs) is 10⁶ W/cm³, and 10⁸ W/cm³ are one W/(cm µm²)
        heat = heat + 1e-2 * heat_capacity(T)[0] * rise
        loads = space.from_nodal(source(space, heat), source(space, charge), 0.0)
        return super().residual(t, x) - loads[:, None]

    def monitored(self, x: np.ndarray) -> np.ndarray:
        return np.zeros((0, x.shape[1]))


def largest_error(tolerance: float, longest: float) -> float:
    """Largest nodal error (K) of the temperature over one period."""
    equations = silicon_strip(ElementTriP3(), 8)
    problem = Loaded(equations, Circuit(series_resistance_ohm=0.0), lambda t: exact_at(t).bias)
    largest = 0.0
    start = nodal_state(equations.space, exact_at(0.0))
    for step in Stepper(problem, tolerance).steps(0.0, PERIOD, start, longest):
        found, _ = equations.space.nodal(step.x[:, 1], BASE)
        true = exact_at(step.end).temperature(*equations.space.elements.nodes)[0]
        largest = max(largest, float(np.abs(found - true).max()))
    return largest


def test_the_order_of_the_method_is_observed():
    coarse, fine = (largest_error(0.05, PERIOD / count) for count in (10, 20))
    assert np.log2(coarse / fine) > 3.3


def test_the_tolerance_is_one_of_the_error():
    for tolerance in (1.0, 0.1):
        assert largest_error(tolerance, np.inf) < 2.0 * tolerance
