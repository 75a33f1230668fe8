"""The 3ω method on a strip: its exact answer, Dames and Chen, RSI 76, 124902 (2005)."""

from __future__ import annotations

import numpy as np
import pytest
from bare import bare_equations
from skfem import MeshTri

from hotlever.lever.transient.frequency_domain import HarmonicBalance
from hotlever.materials import published
from hotlever.materials.kinds import MetalFilm
from hotlever.probe import Circuit, Terminal

LENGTH, WIDTH = 10.0, 1.0
#: W/(cm K), S/cm, J/(cm³ K), 1/K; current (mA).
KAPPA, SIGMA, CAPACITY, ALPHA, CURRENT = 1.0, 1000.0, 1.7, 1e-3, 0.05
#: Diffusivity (µm²/µs); a series resistance that makes a source of current.
DIFFUSIVITY, SERIES_KOHM = 100.0 * KAPPA / CAPACITY, 1e4


@pytest.fixture
def strip():
    """Equations of a strip whose resistivity grows with the temperature."""
    film = MetalFilm(resistivity=1.0 / SIGMA, tcr=ALPHA, kappa=KAPPA, heat_capacity=CAPACITY)
    mesh = MeshTri.init_tensor(np.linspace(0, LENGTH, 13), np.linspace(0, WIDTH, 2))
    supply = Terminal("supply", (LENGTH, 0.0), (LENGTH, WIDTH))
    ground = Terminal("ground", (0.0, 0.0), (0.0, WIDTH))
    material = published("option III").material
    tip = (0.5 * LENGTH, 0.5 * WIDTH)
    return bare_equations(mesh, supply, ground, tip, material, stack={"film": (film, 0.4)})


def exact_third_harmonic(strip, frequency):
    """Their suspended wire: uniform heating at 2ω between ends that are held, in V."""
    section = 1e-4 * WIDTH * strip.space.thickness_um  # in µm cm
    ohm = 1e-4 * LENGTH / (SIGMA * 1e-4 * section)
    power = 0.5 * (1e-3 * CURRENT) ** 2 * ohm  # W, at 2ω
    q = LENGTH * np.sqrt(2j * 2e-6 * np.pi * frequency / DIFFUSIVITY)
    mean = 1e-4 * LENGTH / (KAPPA * 1e-4 * section) * (1.0 - np.tanh(q / 2) / (q / 2)) / q**2
    return 0.5 * 1e-3 * CURRENT * ohm * ALPHA * power * mean


@pytest.mark.parametrize("frequency", [1e2, 1e5, 1e6, 5e6])
def test_the_third_harmonic_of_a_strip(strip, frequency):
    circuit = Circuit(series_resistance_ohm=1e3 * SERIES_KOHM)
    start = np.zeros((strip.space.size + 1, 1))
    balance = HarmonicBalance(strip, circuit, start, 0.0, SERIES_KOHM * CURRENT)
    found, _ = balance.solved(frequency)
    exact = exact_third_harmonic(strip, frequency)
    assert found[2] == pytest.approx(exact, rel=1e-3)
    assert abs(found[1]) < 1e-6 * abs(found[0])
