"""A strip whose ends have different temperatures: its κ integrates (Kirchhoff)."""

from __future__ import annotations

import numpy as np
from bare import bare_equations
from skfem import MeshTri

from hotlever.lever.continuation import without_bias
from hotlever.lever.equations import LeverEquations, heat_left
from hotlever.materials import LOW_DOPED, published
from hotlever.probe import Circuit, Taper, Terminal

LENGTH = 10.0


def test_without_power_the_integral_of_kappa_is_linear_between_the_ends():
    supply = Terminal("supply", (0.0, 0.0), (0.0, 1.0))
    ground = Terminal("ground", (LENGTH, 0.0), (LENGTH, 1.0))
    mesh = MeshTri.init_tensor(np.linspace(0.0, LENGTH, 21), np.linspace(0.0, 1.0, 3))
    taper = Taper((LENGTH / 2, 0.5), (1.0, 0.0), LENGTH)
    material = published("option III").material
    cold = bare_equations(mesh, supply, ground, (LENGTH / 2, 0.5), material, taper=taper)
    circuit = Circuit.from_values(
        {"ground": {"kind": "ground", "base_temperature_K": 593.0}}, "test"
    )
    equations = LeverEquations(cold.space, cold.materials, circuit)
    rest = without_bias(equations)
    T, V = cold.space.nodal(rest[:, 0], 293.0, equations.terminals.end_rises)
    assert np.abs(V).max() < 1e-12
    np.testing.assert_allclose(heat_left(equations, rest), 0.0, atol=1e-10)
    grid = np.linspace(293.0, 593.0, 20001)
    kappa = cold.materials[LOW_DOPED].thermal_conductivity(grid, 0.4)[0]
    integral = np.append(0.0, np.cumsum(0.5 * (kappa[1:] + kappa[:-1])))
    along = cold.space.elements.nodes[0] / LENGTH
    np.testing.assert_allclose(T, np.interp(along, integral / integral[-1], grid), atol=1e-3)
