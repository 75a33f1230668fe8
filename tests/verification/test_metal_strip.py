"""A strip of metal on a dielectric, heated by its own resistance: exact in one dimension.

With constant κ and ρ = ρ₀ (1 + α (T − T₀)), both ends held at T₀ and a current per width j,
K T″ + j² ρ_s (1 + α (T − T₀)) = 0, so that with m² = α j² ρ_s / K

    T − T₀ = [cos(m (x − L/2)) / cos(m L/2) − 1] / α,    V = 2 j ρ_s tan(m L/2) / m.
"""

from __future__ import annotations

import numpy as np
import pytest
from bare import bare_equations, state_at
from skfem import MeshTri
from skfem.element import ElementTriP1, ElementTriP2, ElementTriP3

from hotlever.lever import Lever
from hotlever.materials import published
from hotlever.materials.presets import material_of
from hotlever.probe import Probe, Terminal

BASE, LENGTH, WIDTH = 293.0, 20.0, 2.0
RHO, TCR, KAPPA, FILM_UM = 3e-5, 2e-3, 0.25, 0.05
NITRIDE, NITRIDE_UM = 0.03, 0.4
#: Per square (Ω), and of the stack (mW/K).
SHEET_OHM = RHO / (FILM_UM * 1e-4)
SHEET_MW_K = 0.1 * (KAPPA * FILM_UM + NITRIDE * NITRIDE_UM)
METAL = {"kind": "metal-film", "resistivity": RHO, "tcr": TCR, "kappa": KAPPA}
DIELECTRIC = {"kind": "dielectric", "kappa": NITRIDE, "kappa_exponent": 0.0}
HOTTEST = 650.0


def wave_number(middle_K: float) -> float:
    """m (1/µm) at a temperature in the middle."""
    return 2.0 / LENGTH * np.arccos(1.0 / (1.0 + TCR * (middle_K - BASE)))


def exact(middle_K: float) -> tuple[float, float]:
    """Voltage (V) and current (mA) at a temperature in the middle."""
    m = wave_number(middle_K)
    per_width = m * np.sqrt(SHEET_MW_K / (TCR * SHEET_OHM * 1e-3))  # mA/µm
    voltage = 2.0 * per_width * 1e-3 * SHEET_OHM * np.tan(m * LENGTH / 2.0) / m
    return float(voltage), float(per_width * WIDTH)


def box(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


def strip(**changes) -> Probe:
    """The strip as a drawing."""
    outline = [box(0, 0, LENGTH, WIDTH)]
    sections = {
        "probe": {"shape": "drawing", "thickness_um": NITRIDE_UM, "tip_um": [LENGTH / 2, 1.0]},
        "layers": {
            "body": {"drawn": outline, "material": "nitride"},
            "metal": {"drawn": outline, "material": "film", "thickness_um": FILM_UM},
        },
        "terminals": {
            "supply": [[LENGTH, 0.0], [LENGTH, WIDTH]],
            "ground": [[0.0, 0.0], [0.0, WIDTH]],
        },
        "materials": {"film": METAL, "nitride": DIELECTRIC},
        "circuit": {"series_resistance_ohm": 0.0},
    }
    return Probe.from_sections(sections | changes, "test")


def test_a_drawn_strip_is_within_1e_6_of_the_exact_solution():
    lever = Lever(strip())
    branch = lever.branch(HOTTEST)
    for tip in (350.0, 500.0, HOTTEST - 1.0):
        voltage, current = exact(tip)
        state = lever.polished(branch.states(branch.u_at([tip])), voltage)
        assert state.lever_V == pytest.approx(voltage, rel=1e-12)
        assert state.current_mA == pytest.approx(current, rel=1e-6)
        assert state.tip_K - BASE == pytest.approx(tip - BASE, rel=1e-6)


def test_monitors_show_the_exact_profile_and_its_means():
    line = {"line_um": [[0.0, 0.7], [LENGTH, 1.3]], "points": 41}
    probe = strip().with_monitors(line=line, all={"region": "metal"})
    lever = Lever(probe)
    branch, voltage = lever.branch(HOTTEST), exact(600.0)[0]
    state = lever.polished(branch.states(branch.u_at([600.0])), voltage)
    data, m = lever.dataset([state]).isel(bias=0), wave_number(600.0)
    phase, end = m * (np.linspace(0.0, LENGTH, 41) - LENGTH / 2), m * LENGTH / 2
    rise = (np.cos(phase) / np.cos(end) - 1.0) / TCR
    np.testing.assert_allclose(data.line_K - BASE, rise, atol=1e-6 * rise.max())
    volts = voltage / 2 * (1.0 + np.sin(phase) / np.sin(end))
    np.testing.assert_allclose(data.line_V, volts, atol=1e-6 * voltage)
    mean = (np.tan(end) / end - 1.0) / TCR
    assert data.all_K.item() - BASE == pytest.approx(mean, rel=1e-7)
    assert data.all_V.item() == pytest.approx(voltage / 2, rel=1e-9)


@pytest.mark.parametrize(
    ("element", "degree"), [(ElementTriP1(), 1), (ElementTriP2(), 2), (ElementTriP3(), 3)]
)
def test_the_observed_order_is_that_of_the_element(element, degree):
    """The current is an energy and has twice the degree, temperatures have one more."""
    voltage, current = exact(HOTTEST)
    stack = {
        "nitride": (material_of(DIELECTRIC, "test"), NITRIDE_UM),
        "film": (material_of(METAL, "test"), FILM_UM),
    }
    errors = []
    for count in (8, 16, 32):
        mesh = MeshTri.init_tensor(np.linspace(0, LENGTH, count + 1), np.array([0.0, WIDTH]))
        equations = bare_equations(
            mesh,
            Terminal("supply", (LENGTH, 0.0), (LENGTH, WIDTH)),
            Terminal("ground", (0.0, 0.0), (0.0, WIDTH)),
            (LENGTH / 2, 0.0),
            published("option III").material,
            stack=stack,
            element=element,
            quadrature=10,
        )
        x = state_at(equations, voltage)
        found = equations.observed(x)[1, 0], BASE + equations.space.tip_rise(x)[0]
        errors.append(np.abs(np.array(found) / (current, HOTTEST) - 1.0))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders[-1], [2 * degree, degree + 1], atol=0.4)
    assert errors[-1].max() < {1: 1e-3, 2: 1e-6, 3: 1e-7}[degree]


def test_two_films_of_half_the_thickness_are_one():
    layers = strip().sections()["layers"]
    half = layers["metal"] | {"thickness_um": FILM_UM / 2}
    halves = {"body": layers["body"], "below": half, "above": half}
    whole, both = (Lever(one).sweep([0.1, 0.3, 0.5]) for one in (strip(), strip(layers=halves)))
    for name in ("current_mA", "tip_K", "heater_ohm"):
        np.testing.assert_allclose(both[name], whole[name], rtol=1e-12)


def test_where_all_of_the_conductor_heats_there_are_no_legs():
    data = Lever(strip()).sweep([0.3, 0.5])
    assert np.isnan(data.legs_ohm).all()
    np.testing.assert_allclose(data.heater_ohm, 1e3 * data.lever_V / data.current_mA, rtol=1e-9)
    np.testing.assert_allclose(data.lever_ohm, data.heater_ohm)
    np.testing.assert_allclose(data.end_heat_mW, data.power_mW, rtol=1e-9)
