"""The Kohlrausch relation: an exact highest temperature for any shape of one material.

With both electrodes at T0 and all else insulated, ∫(T0→T_max) κ ρ dT = V²/8. On an L-shape the
re-entrant corner tests the solver where it is weakest.
"""

from __future__ import annotations

import numpy as np
import pytest
from bare import bare_equations, state_at
from skfem import MeshTri
from skfem.element import ElementTriP2, ElementTriP3

from hotlever.materials import published
from hotlever.probe import Taper, Terminal

SUPPLY = Terminal("supply", (2.0, 0.0), (2.0, 1.0))
GROUND = Terminal("ground", (0.0, 2.0), (1.0, 2.0))
CORNER = np.array([1.0, 1.0])
HIGH_DOPED = {0.5: 328.64, 1.0: 459.42, 1.5: 755.67}
LOW_DOPED = {4.5702: 400.0, 10.6089: 831.0, 12.3267: 1150.0}


def l_shape() -> MeshTri:
    """An L of two arms; the line of symmetry through its corners is made of edges."""
    points = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0, 2], [1, 2]], dtype=float)
    triangles = [[0, 1, 4], [0, 4, 3], [1, 2, 4], [2, 5, 4], [3, 4, 6], [4, 7, 6]]
    return MeshTri(points.T, np.array(triangles).T)


def graded(mesh: MeshTri, levels: int) -> MeshTri:
    """Refine again and again where triangles touch the re-entrant corner."""
    for _ in range(levels):
        near = np.linalg.norm(mesh.p - CORNER[:, None], axis=0) < 1e-9
        mesh = mesh.refined(np.flatnonzero(near[mesh.t].any(axis=0)))
    return mesh


def temperatures(mesh, voltage, *, element=None, taper=None, quadrature=6):
    """Temperature on the line of symmetry, where it is highest, and the highest of any node."""
    equations = bare_equations(
        mesh,
        SUPPLY,
        GROUND,
        (0.5, 0.5),
        published("option III").material,
        element=element,
        taper=taper,
        quadrature=quadrature,
    )
    return temperatures_of(equations, voltage)


def temperatures_of(equations, voltage):
    """The same of equations at hand."""
    x = state_at(equations, voltage)
    rises = equations.space.tip_rise(x), equations.space.rises(x).max(axis=0)
    return tuple(293.0 + rise.item() for rise in rises)


def exact_high_doped(voltage):
    """T_max from the integral, to more digits than reference.md prints."""
    from scipy.integrate import quad
    from scipy.optimize import brentq

    from hotlever.materials.heat import thermal_conductivity
    from hotlever.materials.silicon import conductivity_high_doped

    material = published("option III").material

    def kappa_rho(T):
        kappa, _ = thermal_conductivity(T, material.c_kappa)
        sigma, _ = conductivity_high_doped(T, material.a0, material.a1)
        return kappa / sigma

    def excess(T_max):
        points = [680.0] if T_max > 680 else None
        return quad(kappa_rho, 293.0, T_max, points=points, epsabs=1e-13)[0] - voltage**2 / 8

    return brentq(excess, 293.0, 1500.0, xtol=1e-10)


@pytest.mark.parametrize("voltage", HIGH_DOPED)
def test_exact_values_are_those_of_the_reference(voltage):
    assert exact_high_doped(voltage) == pytest.approx(HIGH_DOPED[voltage], abs=0.005)


@pytest.fixture(scope="module")
def of_graded_l_shape():
    """Equations on it."""
    mesh = graded(l_shape().refined(4), 12)
    material = published("option III").material
    return bare_equations(mesh, SUPPLY, GROUND, (0.5, 0.5), material, quadrature=10)


@pytest.mark.parametrize("voltage", HIGH_DOPED)
def test_highest_temperature_on_a_graded_l_shape(of_graded_l_shape, voltage):
    on_line, anywhere = temperatures_of(of_graded_l_shape, voltage)
    exact = exact_high_doped(voltage)
    assert on_line == pytest.approx(exact, rel=1e-6)
    assert anywhere == pytest.approx(exact, rel=2e-6)


@pytest.mark.parametrize("element", [ElementTriP2(), ElementTriP3()], ids=["P2", "P3"])
def test_uniform_refinement_converges_with_the_order_of_the_corner(element):
    """Near a 270° corner V − V_l/2 goes like r^(2/3), and T_max − T like its square, r^(4/3).

    On the line of symmetry the temperature then converges with twice that exponent, h^(8/3),
    whatever the element; grading the mesh to the corner takes the limit away.
    """
    exact = exact_high_doped(1.0)
    errors = [
        abs(temperatures(l_shape().refined(k), 1.0, element=element)[0] - exact) for k in (2, 3, 4)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 8 / 3, atol=0.15)


@pytest.mark.parametrize("voltage", LOW_DOPED)
def test_highest_temperature_of_low_doped_silicon(voltage):
    """The heater's own law, far from any taper: a heater so long that its ends do not matter."""
    taper = Taper((0.0, 0.0), (1.0, 0.0), 1000.0)
    mesh = graded(l_shape().refined(3), 12)
    # the printed voltages have four decimals, 0.02 K near the inversion temperature
    assert temperatures(mesh, voltage, taper=taper)[0] == pytest.approx(
        LOW_DOPED[voltage], abs=0.03
    )
