"""Leg ends on a chip that the lever warms."""

from __future__ import annotations

import numpy as np
import pytest
from taylor import remainder_orders

from hotlever.lever import Lever
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import pulse, rise_times, simulate, spectrum
from hotlever.lever.transient.frequency_domain import harmonics
from hotlever.lever.transient.modes import slowest_modes
from hotlever.probe import Probe
from hotlever.probe.parts import mean_inverse_distance, spreading_K_per_mW
from hotlever.probe.priors import Prior, as_known, known_beforehand

CHIP = 3.0


@pytest.fixture(scope="module", params=["vacuum", "air"])
def lever(request):
    return Lever(Probe.reference().with_(chip_K_per_mW=CHIP, medium=request.param), COARSE)


@pytest.mark.parametrize("tip_K", [500.0, 900.0, 1150.0])
def test_in_vacuum_it_is_a_lever_at_a_warmer_base(coarse, tip_K):
    on_chip = Lever(Probe.reference().with_(chip_K_per_mW=CHIP), COARSE)
    branch = on_chip.branch()
    lever_V, current_mA, *_ = branch.curve(branch.u_at(np.array([tip_K]))).T
    warmer = 293.0 + CHIP * float(lever_V[0] * current_mA[0])
    other = Lever(Probe.reference().with_(base_temperature_K=warmer), COARSE).branch()
    expected_V, expected_mA, *_ = other.curve(other.u_at(np.array([tip_K]))).T
    assert lever_V == pytest.approx(expected_V, rel=3e-5)
    assert current_mA == pytest.approx(expected_mA, rel=3e-5)


def test_heat_through_the_ends_is_what_warms_the_chip(lever):
    sweep = lever.sweep([8.0])
    ends = sweep.end_heat_mW.item()
    (state,) = lever.solve([8.0])
    unknowns, weights = lever.space.chip
    assert weights @ state.x[unknowns, 0] == pytest.approx(CHIP * ends, rel=1e-6)
    power = sweep.lever_V.item() * sweep.current_mA.item()
    assert power == pytest.approx(ends + sweep.air_heat_mW.item(), rel=1e-4)


def test_jacobian_and_derivative_by_the_chip_have_taylor_order_two(lever):
    branch = lever.branch()
    x = branch.x[:, [len(branch.u) // 2]]
    assert remainder_orders(lever.equations, x, 0, (1.0, 0.5, 0.25))[-1] > 1.9
    slope = lever.equations.by_parameter(x, ["chip_K_per_mW"])[..., 0]
    rest = []
    for step in (0.2, 0.1, 0.05):
        other = lever.probe.replace({"chip_K_per_mW": CHIP + step})
        balance = LeverEquations.of_probe(lever.space, other).balance(x)
        rest.append(np.abs(balance - lever.equations.balance(x) - step * slope).max())
    assert np.log2(rest[1] / rest[2]) > 1.9


def potential_of_a_rectangle(a, b, x, y):
    """∫ dA/r over a rectangle about the origin, at points in its plane."""
    total = 0.0
    for s, u in ((1, x + a / 2), (-1, x - a / 2)):
        for t, v in ((1, y + b / 2), (-1, y - b / 2)):
            total = total + s * t * (u * np.arcsinh(v / np.abs(u)) + v * np.arcsinh(u / np.abs(v)))
    return total


@pytest.mark.parametrize("sides", [(1.0, 1.0), (6.44, 0.4), (3.46, 0.4), (30.0, 1.0)])
def test_spreading_is_that_of_a_rectangle_on_a_half_space(sides):
    a, b = sides
    points, weights = np.polynomial.legendre.leggauss(80)
    x, y = np.meshgrid(a / 2 * points, b / 2 * points, indexing="ij")
    mean = weights @ potential_of_a_rectangle(a, b, x, y) @ weights / 4.0
    assert mean_inverse_distance(a, b) == pytest.approx(mean / (a * b), rel=2e-4)


def test_legs_share_the_heat_and_warm_each_other():
    layout, kappa = Probe.reference().layout(), 0.1414
    alone = [mean_inverse_distance(w, 0.4) / (2.0 * np.pi * kappa) for w in (6.44, 3.46, 3.46)]
    together = 1.0 / sum(1.0 / each for each in alone)
    spread = spreading_K_per_mW(layout, 300.0)
    assert together < spread < 1.4 * together


def test_in_pulses_the_holder_stays_cold():
    probe = Probe.reference()
    spread = spreading_K_per_mW(probe.layout(), 293.0)
    assert probe.in_pulses() is probe
    assert probe.with_(chip_K_per_mW=5.0).in_pulses().circuit.chip_K_per_mW == spread
    assert probe.with_(chip_K_per_mW=0.3).in_pulses().circuit.chip_K_per_mW == 0.3


def test_a_long_pulse_ends_where_a_lever_on_its_chip_rests(coarse):
    on_chip = Lever(Probe.reference().with_(chip_K_per_mW=5.0), COARSE)
    history = simulate(on_chip, pulse(5.0, 1000.0), at=[0.0, 1000.0])
    rest = on_chip.in_pulses().sweep([5.0])
    assert history.tip_K.values[0] == pytest.approx(293.0, abs=0.01)
    assert history.tip_K.values[1] == pytest.approx(rest.tip_K.item(), abs=0.3)
    assert "the holder of the chip stays cold" in history.notes
    assert simulate(on_chip.in_pulses(), pulse(5.0, 1.0), at=[1.0]).notes == ""


def test_the_holder_does_not_follow_what_oscillates(run):
    on_chip = Lever(Probe.reference().with_(chip_K_per_mW=20.0), COARSE)
    spread = on_chip.in_pulses().circuit.chip_K_per_mW
    (state,) = on_chip.solve([6.0])
    # in vacuum a holder that stays as warm is a warmer base
    warmer = 293.0 + (20.0 - spread) * state.lever_V * state.current_mA
    like = Probe.reference().with_(chip_K_per_mW=spread, base_temperature_K=warmer)
    (other,) = Lever(like, COARSE).solve([6.0])
    frequency = [1.0, 3e3, 1e6]
    answers = [spectrum(each, frequency) for each in (state, other)]
    for name in ("impedance_real_ohm", "tip_per_bias_K_per_V"):
        found, expected = (answer[name].values for answer in answers)
        np.testing.assert_allclose(found, expected, rtol=1e-4)
    constants = [slowest_modes(each)[0] for each in (state, other)]
    np.testing.assert_allclose(*constants, rtol=1e-4)
    first, expected = (
        harmonics(each.lever, 6.0, 1e-3, frequency).first_harmonic_V.values
        for each in (state, other)
    )
    np.testing.assert_allclose(first, expected, rtol=5e-4)
    times = [rise_times(each, [4.0]).heating_us for each in (on_chip, on_chip.in_pulses())]
    assert times[0] == times[1]
    words = ("--bias", "6", "--frequency", "1kHz", "--set", "chip_K_per_mW=20")
    assert "note: the holder of the chip does not follow" in run("spectrum", *words)[2]


def test_calibrations_are_on_a_chip_unless_laws_are_the_papers():
    probe = Probe.reference()
    assert as_known(probe, None).circuit.chip_K_per_mW == probe.usual_chip_K_per_mW
    for priors in ({}, {"laws": "paper"}):
        assert as_known(probe, priors) is probe
    stated = known_beforehand(as_known(probe, None), {"chip_K_per_mW": "2 ± 1"})
    assert stated["chip_K_per_mW"] == Prior(2.0, 1.0, relative=False)
