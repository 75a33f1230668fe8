"""Thermoelectricity of strips in one dimension, against exact solutions and Kelvin's relation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from skfem import MeshTri

from hotlever.lever.elements import FiniteElements
from hotlever.lever.equations import LeverEquations, heat_left
from hotlever.lever.full_space import FullSpace
from hotlever.lever.newton import NewtonOptions, find_roots
from hotlever.lever.solved_states import Constrained
from hotlever.lever.space import LEVER
from hotlever.materials.kinds import MetalFilm
from hotlever.probe import Circuit, Layout, ProbeMesh, Region, Terminal
from hotlever.probe.surroundings import Physics
from hotlever.studies.thermoelectric_shift import SIDES, Heats

LENGTH, THICK = 12.0, 0.4
#: mA/(V µm) and mW/(K µm): of a resistivity of 1e-4 Ω cm, and of 0.5 W/(cm K).
SIGMA, KAPPA = 1e3, 0.05
COLD, WARM = 293.0, 593.0
#: V/K; with the strip's high conductivity a wrong sign shows by tens of kelvin.
STRONG = 2e-4


def film(seebeck: float) -> MetalFilm:
    """A metal of these conductivities and of a Seebeck coefficient (V/K)."""
    kind = MetalFilm(resistivity=1e-4, tcr=0.0, kappa=0.5)
    return kind.model_copy(update={"seebeck": 1e6 * seebeck})


@dataclass(frozen=True)
class Strip:
    """A strip along x of even sections, supply at x = 0; the leg end at ground may be warm."""

    sections: tuple[MetalFilm, ...]
    elements: int = 24
    warm_K: float = COLD

    @property
    def equations(self) -> LeverEquations:
        count, across = len(self.sections), np.array([0.0, 1.0])
        mesh = MeshTri.init_tensor(np.linspace(0.0, LENGTH, self.elements + 1), across)
        width = LENGTH / count
        regions = tuple(
            Region(
                f"part {number}",
                "heater" if number == 0 else "leg 1",
                square(number * width, width),
                material=f"m{number}",
            )
            for number in range(count)
        )
        ends = {"supply": 0.0, "ground": LENGTH}
        terminals = tuple(Terminal(name, (at, 0.0), (at, 1.0)) for name, at in ends.items())
        layout = Layout(regions, terminals, (0.5 * LENGTH, 0.5), THICK)
        middle = mesh.p[0, mesh.t].mean(axis=0)
        facets = {
            name: np.flatnonzero(np.abs(mesh.p[0, mesh.facets] - at).max(axis=0) < 1e-9)
            for name, at in ends.items()
        }
        probe_mesh = ProbeMesh(layout, mesh, (middle / width).astype(np.intp), facets)
        space = FullSpace(probe_mesh, FiniteElements(mesh, None, 6))
        kinds = {f"m{number}": kind for number, kind in enumerate(self.sections)}
        values = {"ground": {"kind": "ground", "base_temperature_K": self.warm_K}}
        circuit = Circuit.from_values(values if self.warm_K != COLD else {}, "test")
        return LeverEquations(space, kinds, circuit, Physics(thermoelectric=True))

    def solved(self, volts: float) -> tuple[LeverEquations, np.ndarray]:
        """The equations, and the state at a voltage between the ends."""
        equations = self.equations
        problem = Constrained(equations, LEVER, np.array([volts]))
        rest = np.zeros((equations.space.size + 1, 1))
        return equations, find_roots(problem, rest, NewtonOptions(1e-11, max_iterations=60)).x


def square(start: float, width: float) -> tuple[tuple[float, float], ...]:
    return ((start, 0.0), (start + width, 0.0), (start + width, 1.0), (start, 1.0))


def along(strip: Strip, volts: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Positions, temperatures (K) at the nodes and the current density (mA/µm²) along x."""
    equations, x = strip.solved(volts)
    T, _ = equations.space.nodal(x[:, 0], COLD, equations.terminals.end_rises)
    return equations.space.elements.nodes[0], T, float(equations.balance(x)[-1, 0]) / THICK


def of_sections(seebeck: list[float], volts: float, warm_K: float) -> tuple[np.ndarray, float]:
    """The exact temperatures at the joints, ends included, and the current density along x.

    Between the joints Joule's heat makes a parabola; at a joint the current sets free the heat
    J T (S before − S after). By hand: Peltier heat is nothing but this.
    """
    count = len(seebeck)
    step = LENGTH / count

    def joints(j: float) -> np.ndarray:
        matrix, right = np.eye(count + 1), np.zeros(count + 1)
        right[0], right[-1] = COLD, warm_K
        for k in range(1, count):
            peltier = j * (seebeck[k - 1] - seebeck[k])
            matrix[k, k - 1 : k + 2] = -KAPPA / step, 2 * KAPPA / step - peltier, -KAPPA / step
            right[k] = step * j**2 / SIGMA
        return np.linalg.solve(matrix, right)

    def lacking(j: float) -> float:
        driven = sum(S * rise for S, rise in zip(seebeck, np.diff(joints(j)), strict=True))
        return j * LENGTH / SIGMA + driven - volts

    j = float(brentq(lacking, -20.0, 20.0, xtol=1e-15, rtol=1e-14))
    return joints(j), j


def between(T: np.ndarray, j: float, x: np.ndarray) -> np.ndarray:
    """The parabolas between joints."""
    step = LENGTH / (T.size - 1)
    left = np.minimum((x / step).astype(int), T.size - 2)
    away = x - left * step
    straight = T[left] + (T[left + 1] - T[left]) * away / step
    return straight + j**2 / (2 * SIGMA * KAPPA) * away * (step - away)


@pytest.mark.parametrize("volts", [0.1, -0.1])
@pytest.mark.parametrize(
    "seebeck", [[STRONG], [STRONG, -STRONG], [0.0, STRONG, 0.0]], ids=["one", "halves", "borders"]
)
@pytest.mark.parametrize("warm_K", [COLD, WARM])
def test_sections_of_even_coefficients_have_peltier_heat_at_their_joints(seebeck, volts, warm_K):
    strip = Strip(tuple(map(film, seebeck)), warm_K=warm_K)
    x, T, j = along(strip, volts)
    at_joints, exact = of_sections(seebeck, volts, warm_K)
    assert j == pytest.approx(exact, rel=1e-9)
    np.testing.assert_allclose(T, between(at_joints, exact, x), rtol=1e-9)


@pytest.mark.parametrize("volts", [0.1, -0.1])
@pytest.mark.parametrize("ends", [(0.0, 0.0), (0.4 * STRONG, -0.2 * STRONG)])
def test_peltier_heat_at_the_borders_of_a_heater_is_that_by_hand(volts, ends):
    """J T (S before − S after) is set free at a border: as heat, and as what flows off."""
    seebeck = [ends[0], STRONG, ends[1]]
    strip = Strip(tuple(map(film, seebeck)))
    at_joints, j = of_sections(seebeck, volts, COLD)
    by_hand = THICK * j * at_joints[1:3] * -np.diff(seebeck)
    equations, x = strip.solved(volts)
    before = (equations.space.elements.positions[0] < 0.5 * LENGTH)[:, None].astype(float)
    heats = Heats(equations, strip.sections[1], {"supply": before, "ground": 1.0 - before})
    tested = heats.tested(x, -equations.fluxes(x).charge)
    peltier = [heats.power(tested["Peltier", side]) for side in SIDES]
    np.testing.assert_allclose(peltier, by_hand, rtol=1e-4)
    assert all(abs(heats.power(tested["Thomson", side])) < 1e-12 for side in SIDES)
    # κ times the bend of the temperature, with the parabolas of Joule's heat on either side
    at, T, _ = along(strip, volts)
    joints, width = np.array([1.0, 2.0]) * LENGTH / 3.0, LENGTH / 3.0
    slopes = np.array(
        [
            [
                np.polynomial.Polynomial.fit(at[here], T[here], 2).deriv()(joint)
                for here in (
                    abs(at - joint + width / 2) <= width / 2,
                    abs(at - joint - width / 2) <= width / 2,
                )
            ]
            for joint in joints
        ]
    )
    flows_off = THICK * KAPPA * (slopes[:, 0] - slopes[:, 1])
    np.testing.assert_allclose(flows_off, by_hand, rtol=1e-4)
    assert abs(by_hand).min() > 1e-2


class Thomson(MetalFilm):
    """A metal whose Seebeck coefficient rises with the temperature, by 0.2 µV/K per kelvin."""

    def thermoelectric(self, T, n, carrier):
        (sigma, by), S, slope = self.electrical_conductivity(T, n), 2e-7 * T, 2e-7
        by_T = np.stack([by["T"] * S + sigma * slope, by["T"] * S**2 + 2 * sigma * S * slope])
        return np.stack([sigma * S, sigma * S**2]), {"T": by_T}


def with_thomson(volts: float) -> tuple[object, float]:
    """κT″ = −j²/σ + j S′ T T′ by collocation, with j from the voltage."""
    slope = 2e-7

    def rates(x, y, p):
        T, dT, _ = y
        driven = p[0] / SIGMA + slope * T * dT
        return dT, (-(p[0] ** 2) / SIGMA + p[0] * slope * T * dT) / KAPPA, driven

    def ends(a, b, p):
        return a[0] - COLD, b[0] - WARM, a[2], b[2] - volts

    x = np.linspace(0.0, LENGTH, 200)
    guess = np.stack([COLD + (WARM - COLD) * x / LENGTH, 25.0 + 0 * x, volts * x / LENGTH])
    exact = solve_bvp(rates, ends, x, guess, [0.0], tol=1e-11, max_nodes=50_000)
    assert exact.success
    return exact.sol, float(exact.p[0])


@pytest.mark.parametrize("volts", [0.1, -0.1])
def test_a_coefficient_that_rises_with_temperature_has_thomson_heat(volts):
    kind = Thomson(resistivity=1e-4, tcr=0.0, kappa=0.5)
    exact, current = with_thomson(volts)
    errors = []
    for elements in (8, 16, 32):
        x, T, j = along(Strip((kind,), elements, WARM), volts)
        errors.append(np.abs(T - exact(x)[0]).max())
    assert j == pytest.approx(current, rel=1e-6)
    np.testing.assert_allclose(T, exact(x)[0], rtol=1e-6)
    # cubic elements: from one mesh to the next the order at the nodes alternates
    assert 0.5 * np.log2(errors[0] / errors[-1]) > 3.6


def test_kelvins_relation_and_the_energy_balance():
    """The linear answer of heat to a voltage is T times that of charge to a temperature."""
    kinds = (film(STRONG), film(-0.3 * STRONG))
    equations = Strip(kinds).equations
    space, rest = equations.space, np.zeros((equations.space.size + 1, 1))
    units = np.eye(space.size + 1)
    jacobian = equations.balance_change(np.repeat(rest, len(units), axis=1), units)
    hot = space.is_temperature
    by_V, by_T = jacobian[np.ix_(hot, ~hot)], jacobian[np.ix_(~hot, hot)]
    np.testing.assert_allclose(by_V, COLD * by_T.T, atol=1e-9 * np.abs(by_V).max())
    assert np.abs(by_T).max() > 0.0
    for volts in (0.1, -0.1):
        equations, x = Strip(kinds, warm_K=WARM).solved(volts)
        np.testing.assert_allclose(heat_left(equations, x), equations.power(x), rtol=1e-9)


def test_the_other_polarity_is_that_of_carriers_of_the_other_sign():
    kinds = (film(STRONG), film(-0.3 * STRONG))
    _, negative = Strip(kinds).solved(-0.1)
    mirrored, positive = replace(Strip(kinds)).equations.mirrored, Strip(kinds).solved(0.1)[1]
    turned = np.where(mirrored.space.is_temperature[:, None], negative, -negative)
    residual = mirrored.balance(turned)[:-1]
    assert np.abs(residual).max() < 1e-9
    assert np.abs(turned - positive).max() > 1.0
