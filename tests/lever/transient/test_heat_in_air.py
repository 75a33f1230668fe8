"""Levers in air in time: against all panels at each frequency, at rest, and in a pulse."""

from __future__ import annotations

from copy import copy

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from hotlever.air.operator import PanelledAir
from hotlever.air.stores import HeatInAir
from hotlever.lever import Lever
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import COARSE, State
from hotlever.lever.transient import pulse, simulate, sine, step
from hotlever.lever.transient.frequency_domain import harmonics, spectrum
from hotlever.lever.transient.history import integrate
from hotlever.lever.transient.modes import slowest_modes
from hotlever.lever.transient.trains import cyclic_steady_state
from hotlever.materials.air import heat_capacity_of_air, thermal_conductivity_of_air
from hotlever.probe import Probe, Tip

BIAS = 4.0


@pytest.fixture(scope="module")
def state(in_air):
    return in_air.solve([BIAS])[0]


@pytest.fixture(scope="module")
def answering_at_once(in_air):
    """The same lever, without what the air takes up itself."""
    lever = copy(in_air)
    lever.space = copy(in_air.space)
    lever.space.air = copy(in_air.space.air)
    nothing = HeatInAir.nothing(lever.space.size + 1)
    lever.space.air.around = lambda gas_conductivity: nothing
    lever.equations = LeverEquations(lever.space, lever.probe.kinds, lever.circuit)
    return lever


class AllPanels:
    """The linear lever at a complex rate (1/µs), with all panels: no modes and no stores."""

    def __init__(self, state) -> None:
        lever, x = state.lever, state.x
        equations, space = lever.equations, lever.space
        unit = np.eye(len(x))
        many = np.repeat(x, len(x), axis=1)
        self.rest, self.moving = (
            equations.balance_change(many, unit),
            equations.storage_change(many, unit),
        )
        gradient = equations.observed_gradient(x)[:, 0]
        self.tip, self.output_gradient = space.tip_rise(unit), gradient[:, :2]
        surroundings, layout = lever.probe.surroundings, lever.probe.layout()
        self.air = PanelledAir(layout, surroundings, 293.0, 0.5)
        self.at_sites = csr_matrix(space.rise_at(self.air.surface.sites, unit))
        values = space.temperature.matrix[: space.weights.size]
        self.inside = layout.thickness_um * (values.T @ (space.weights * values.toarray()))
        self.kappa = 0.1 * float(thermal_conductivity_of_air(293.0)[0])
        self.alpha = self.kappa / (1e-3 * float(heat_capacity_of_air(293.0)[0]))

    def tip_by_bias(self, rates, circuit):
        """The change of the tip's temperature by that of the bias (K/V)."""
        rates = np.asarray(rates, dtype=complex)
        q = np.sqrt(np.append(1e-20, rates / self.alpha))
        still, *admittances = self.air.admittances(q, np.eye(self.at_sites.shape[0]))
        found = []
        for rate, one in zip(rates, admittances, strict=True):
            more = self.at_sites.T @ (self.at_sites.T @ (one - still)).T
            more = more - rate / self.alpha * self.inside
            matrix = self.rest + rate * self.moving + self.kappa * more
            matrix[-1] = circuit.bias(*self.output_gradient.T)
            right = np.zeros(len(matrix))
            right[-1] = 1.0
            found.append(self.tip @ np.linalg.solve(matrix, right))
        return np.array(found)


@pytest.fixture(scope="module")
def all_panels(state):
    return AllPanels(state)


def answer(data):
    return data.tip_per_bias_K_per_V * np.exp(1j * np.radians(data.tip_per_bias_deg))


def test_a_lever_that_has_cooled_has_the_time_constants_of_a_cold_one(state):
    scale = np.where(state.lever.space.is_temperature, 1e-4, 1e-42)[:, None]
    times, _ = slowest_modes(State(state.lever, scale * state.x))

    cold, _ = slowest_modes(State(state.lever, np.zeros_like(state.x)))
    np.testing.assert_allclose(times, cold, rtol=1e-4)


def test_small_signals_are_those_of_all_panels(state, all_panels, answering_at_once):
    frequency = np.array([1e4, 1e6])
    exact = all_panels.tip_by_bias(2e-6j * np.pi * frequency, state.lever.circuit)
    data, at_once = (
        spectrum(one, frequency) for one in (state, answering_at_once.solve([BIAS])[0])
    )

    np.testing.assert_allclose(answer(data), exact, rtol=2e-4)
    # 10 kHz is where the lever begins to lag
    away = np.abs(answer(at_once).values / exact - 1.0)
    assert away[0] == pytest.approx(0.04, abs=0.01)


@pytest.mark.slow
def test_small_signals_with_a_tip_in_the_air_are_those_of_all_panels():
    tip = Tip(height_um=1.0, half_angle_deg=30.0, in_air=True)
    probe = Probe.reference().model_copy(update={"tip": tip}).in_medium("air")
    (state,) = Lever(probe, COARSE).solve([BIAS])
    frequency = np.array([1e4, 1e6])
    exact = AllPanels(state).tip_by_bias(2e-6j * np.pi * frequency, probe.circuit)
    np.testing.assert_allclose(answer(spectrum(state, frequency)), exact, rtol=2e-4)


@pytest.mark.slow
def test_a_small_step_is_its_inverse_laplace_transform(state, all_panels, in_air):
    """By Talbot's contour (Abate and Valkó, Int. J. Numer. Meth. Eng. 60, 979 (2004))."""
    time, many, by = 10.0, 7, 0.05
    angle = np.pi * np.arange(1, many) / many
    cot = 1.0 / np.tan(angle)
    base = 2.0 * many / (5.0 * time)
    contour = np.append(base, base * angle * (cot + 1j))
    weights = np.append(0.5, 1.0 + 1j * (angle + (angle * cot - 1.0) * cot))
    answers = all_panels.tip_by_bias(contour, in_air.circuit) / contour
    exact = base / many * np.sum(np.real(np.exp(contour * time) * answers * weights))
    up, down = (
        simulate(in_air, step(BIAS + way * by), at=[time], start=state, tolerance_K=1e-3)
        for way in (1.0, -1.0)
    )
    assert (up.tip_K - down.tip_K).item() / (2.0 * by) == pytest.approx(exact, rel=5e-4)


def test_at_rest_the_air_takes_up_nothing(state, in_air):
    air = in_air.equations.heat_in_air
    assert np.abs(air.taken_up(0.0)).max() == 0.0
    data = simulate(in_air, sine(BIAS, 0.0, 1e4), 50.0, tolerance_K=1e-4)
    assert np.abs(data.tip_K - state.tip_K).max() < 1e-8
    np.testing.assert_allclose(data.air_stored_nJ, data.air_stored_nJ[0], rtol=1e-9)


def test_a_pulse_in_air_has_to_heat_the_air_too(in_air, answering_at_once):
    """By the half space of a plate, 2e √(4t/π) a kelvin and area; more, by its edges."""
    wave = pulse(8.0, 10.0)
    data, at_once = (simulate(one, wave, at=[10.0, 150.0]) for one in (in_air, answering_at_once))
    less = 1.0 - (data.tip_K - 293.0) / (at_once.tip_K - 293.0)
    assert less.values[0] == pytest.approx(0.022, abs=0.004)
    # what was taken up comes back
    assert less.values[1] < 0.0
    kappa, capacity = (
        float(law(293.0)[0]) for law in (thermal_conductivity_of_air, heat_capacity_of_air)
    )
    plane = 2.0 * 4.0 / 3.0 * np.sqrt(1e-5 * kappa * capacity / np.pi) / (1.66 * 0.4e-4)
    share = float(data.air_stored_nJ[0] / data.stored_nJ[0])
    assert plane < share < 3.0 * plane


@pytest.mark.slow
def test_trains_on_modes_and_settled_periods_know_the_air(in_air):
    wave = pulse(6.0, 2.0, 5.0, 20)
    at = [2.0, 5.0, 10.0]
    modes, full = simulate(in_air, wave, at=[*at, 97.0, 100.0]), integrate(in_air, wave, at=at)
    assert "modes" in modes.notes
    np.testing.assert_allclose(modes.tip_K[:3], full.tip_K, atol=0.05)
    np.testing.assert_allclose(modes.air_stored_nJ[:3], full.air_stored_nJ, rtol=1e-2)
    period, begin = cyclic_steady_state(in_air, pulse(6.0, 2.0), 5.0)
    # another settled period follows; the air takes milliseconds to get as warm as that
    again = simulate(in_air, pulse(6.0, 2.0), 5.0, start=begin)
    assert float(again.air_stored_nJ[-1]) == pytest.approx(float(again.air_stored_nJ[0]), rel=1e-2)
    assert float(period.tip_K.max()) > float(modes.tip_K[3]) + 0.5


def test_harmonics_of_a_weak_sine_are_its_small_signals(in_air, state):
    found = harmonics(in_air, BIAS, 0.01, [1e4])
    small = spectrum(state, [1e4])
    impedance = complex(small.impedance_real_ohm.item(), small.impedance_imag_ohm.item()) / 1e3
    share = impedance / (impedance + in_air.circuit.series_kohm)
    assert found.first_harmonic_V.item() == pytest.approx(0.01 * abs(share), rel=1e-4)
    assert found.first_harmonic_deg.item() == pytest.approx(np.degrees(np.angle(share)), abs=0.01)
