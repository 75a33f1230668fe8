"""A strip whose laws do not change with the temperature: the sum of its modes, to six digits."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from bare import bare_equations
from skfem import MeshTri

from hotlever.lever.lever import State
from hotlever.lever.transient.modes import slowest_modes
from hotlever.lever.transient.runge_kutta import Stepper
from hotlever.lever.transient.transient_problem import TransientProblem
from hotlever.materials import published
from hotlever.materials.kinds import MetalFilm
from hotlever.probe import Circuit, Terminal

MATERIAL = published("option III").material
LENGTH, WIDTH, BIAS = 10.0, 1.0, 1.0
#: W/(cm K), S/cm and J/(cm³ K).
KAPPA, SIGMA, CAPACITY = 1.0, 1000.0, 1.7
#: Diffusivity (µm²/µs), and the rise (K) where it has come to rest.
DIFFUSIVITY, END = 100.0 * KAPPA / CAPACITY, SIGMA * BIAS**2 / (8.0 * KAPPA)


@pytest.fixture
def strip():
    """Equations of a strip with constant laws."""
    film = MetalFilm(
        resistivity=1.0 / SIGMA, tcr=0.0, kappa=KAPPA, heat_capacity=CAPACITY, melting_point_K=4000
    )
    mesh = MeshTri.init_tensor(np.linspace(0, LENGTH, 21), np.linspace(0, WIDTH, 3))
    supply = Terminal("supply", (LENGTH, 0.0), (LENGTH, WIDTH))
    ground = Terminal("ground", (0.0, 0.0), (0.0, WIDTH))
    return bare_equations(
        mesh, supply, ground, (0.5 * LENGTH, 0.5 * WIDTH), MATERIAL, stack={"film": (film, 0.4)}
    )


class Alone(TransientProblem):
    """A lever whose parts are not told apart."""

    def monitored(self, x):
        return np.zeros((1, x.shape[1]))


def rise_in_the_middle(t):
    n = np.arange(1, 400, 2)
    settled = 32.0 * END / (n * np.pi) ** 3 * np.sin(n * np.pi / 2)
    return float(np.sum(settled * (1.0 - np.exp(-DIFFUSIVITY * (n * np.pi / LENGTH) ** 2 * t))))


def test_a_strip_heats_as_the_sum_of_its_modes(strip):
    problem = Alone(strip, Circuit(series_resistance_ohm=0.0), lambda t: BIAS)
    start = np.zeros((strip.space.size + 1, 1))
    slowest = (LENGTH / np.pi) ** 2 / DIFFUSIVITY
    compared = 0
    for step in Stepper(problem, 1e-7 * END).steps(0.0, 5.0 * slowest, start, np.inf):
        if step.end > 0.05 * slowest:
            found = float(strip.space.tip_rise(step.x[:, 1]))
            assert found == pytest.approx(rise_in_the_middle(step.end), abs=1e-6 * END)
            compared += 1
    assert compared > 10


def test_its_time_constants_are_those_of_its_modes(strip):
    lever = SimpleNamespace(equations=strip, circuit=Circuit(series_resistance_ohm=0.0))
    lever.in_pulses = lambda: lever
    state = State(lever, np.zeros((strip.space.size + 1, 1)))
    found, _ = slowest_modes(state, count=3)
    expected = (LENGTH / np.pi / np.array([1, 2, 3])) ** 2 / DIFFUSIVITY
    np.testing.assert_allclose(found, expected, rtol=1e-6)
