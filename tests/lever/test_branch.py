"""A lever as one curve by tip temperature, and how a circuit reads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hotlever.errors import BranchEndError, ComputationError, InputError
from hotlever.lever import Branch, Lever
from hotlever.lever.continuation import continued
from hotlever.lever.lever import COARSE
from hotlever.lever.newton import NewtonOptions
from hotlever.lever.solved_states import solve_at
from hotlever.probe import Probe

pytestmark = pytest.mark.usefixtures("coarse_meshes")

EXAMPLES = Path(__file__).parents[2] / "src/hotlever/examples"


def with_series(lever: Lever, ohm: float) -> Lever:
    return lever.with_probe(lever.probe.with_(series_resistance_ohm=ohm))


# --- the curve between the states -----------------------------------------------------------------


def test_what_is_read_between_states_is_what_is_solved_there(lever):
    """The reading of a sweep against states solved by themselves."""
    bias = [0.3, 1.7, 5.0, 7.3, 7.9, 8.268, 8.4, 9.7, 10.9]
    read, solved = lever.sweep(bias), lever.dataset(lever.solve(bias))
    np.testing.assert_allclose(read.current_mA, solved.current_mA, rtol=2e-5)
    np.testing.assert_allclose(read.lever_V, solved.lever_V, rtol=2e-5)
    np.testing.assert_allclose(read.reader_V, solved.reader_V, rtol=2e-5)
    np.testing.assert_allclose(read.tip_K, solved.tip_K, rtol=0, atol=0.02)
    np.testing.assert_allclose(read.max_K, solved.max_K, rtol=0, atol=0.05)
    np.testing.assert_allclose(read.end_heat_mW, solved.end_heat_mW, rtol=5e-5, atol=1e-6)
    np.testing.assert_allclose(solved.bias_V, bias, rtol=1e-10)


def highest_in(state):
    """The highest temperature (K) of a state, by points far closer than the nodes."""
    elements = state.lever.space.elements
    steps = 30
    points = [(i, j) for i in range(steps + 1) for j in range(steps + 1 - i)]
    points = np.array(points).T / steps
    shape = [elements.basis.elem.lbasis(points, node)[0] for node in range(10)]
    return float((state.nodal[0][elements.dofs] @ np.stack(shape)).max())


HOT = [Probe.reference(), Probe.reference().in_medium("air"), Probe.u_shape(), "boron", "palladium"]
HIGHEST_V = [13.2, 18.2, 12.3, 6.6, 1.06]


@pytest.mark.parametrize(("probe", "highest_V"), list(zip(HOT, HIGHEST_V, strict=True)))
def test_the_highest_temperature_is_as_exact_as_that_of_the_tip(probe, highest_V):
    """In the reference probe a leg overtakes the heater, between two states of the branch."""
    files = {"boron": "boron-lever.toml", "palladium": "palladium-on-nitride.toml"}
    lever = Lever(EXAMPLES / files[probe] if isinstance(probe, str) else probe, COARSE)
    bias = np.append(highest_V * np.array([0.1, 0.5, 0.8, 0.9, 1.0]), highest_V - 0.38)
    read = lever.sweep(bias)
    np.testing.assert_allclose(
        read.max_K, [highest_in(state) for state in lever.solve(bias)], rtol=0, atol=0.05
    )


def test_a_warm_leg_end_may_be_the_hottest():
    ends = {"circuit.ground.kind": "ground", "circuit.ground.base_temperature_K": 350.0}
    lever = Lever(Probe.reference().with_(**ends), COARSE)
    assert lever.sweep([0.0]).max_K.item() == pytest.approx(350.0, abs=1e-9)


def test_a_branch_ends_where_its_hottest_place_melts(lever):
    branch = lever.branch(1550.0)
    assert branch.melts
    highest = branch.base_temperature_K + branch.highest_rise_at(np.array([branch.end_u]))[0]
    assert highest == pytest.approx(lever.equations.laws.limit[0], abs=1e-3)
    # the heater, where the tip is, is far from melting
    assert branch.hottest_K < highest - 150.0


def test_the_curve_converges_with_the_spacing_of_the_states(coarse):
    """Every second state is left out: the error grows as the sixth power, or little less."""
    branch = coarse.branch(1000.0)
    some = np.r_[0, 1 : branch.u.size : 2]
    from hotlever.piecewise import smooth_curve

    sparse = smooth_curve(branch.u[some], branch.values[some], branch.value_slopes[some])
    middle = branch.u[3:-1:2]
    dense = continued(coarse.equations, lambda _: True, branch).curve(middle)
    away = np.abs(sparse(middle) - dense)[:, 1] / dense[:, 1]
    assert away.max() < 3e-3


def test_power_and_temperature_are_inverse(reference):
    tip = np.array([293.5, 400.0, 700.0, 899.0, 950.0, 1200.0])
    np.testing.assert_allclose(reference.tip_temperature(reference.power(tip)), tip, atol=0.02)
    power, step = np.array([0.5, 2.0, 2.9, 3.8]), 1e-4
    by_difference = (
        reference.tip_temperature(power + step) - reference.tip_temperature(power - step)
    ) / (2 * step)
    np.testing.assert_allclose(reference.by_power.slope(power), by_difference, rtol=1e-5)


def test_of_both_polarities_the_power_is_that_of_positive_biases():
    """Power rises on either side of the cold lever: read together they were no function."""
    lever = Lever(Probe.reference().with_physics(("thermoelectric",)), COARSE)
    both, one = lever.branch_to(8.0, lowest=-8.0), lever.branch_to(8.0)
    assert both.u[0] < 0.0
    power = np.linspace(0.0, 2.2, 12)
    np.testing.assert_allclose(both.tip_temperature(power), one.tip_temperature(power), rtol=1e-6)


def test_the_bias_of_a_temperature_heats_to_it(lever, reference):
    tip = np.array([350.0, 600.0, 1100.0])
    sweep = lever.sweep(reference.bias(tip, lever.circuit))
    np.testing.assert_allclose(sweep.tip_K, tip, atol=1e-6)


def test_nothing_is_said_beyond_the_hottest_state_or_below_the_base(reference):
    assert np.isnan(reference.tip_temperature(reference.by_power.highest_mW + 0.1))
    assert np.isnan(reference.power([280.0, reference.hottest_K + 1.0])).all()
    assert reference.power(293.0) == 0.0


@pytest.mark.parametrize("thermoelectric", [False, True])
def test_a_state_has_the_polarity_of_its_branch_wherever_it_is_looked_for(coarse, thermoelectric):
    """Heat does not know the direction of a current: a tip temperature has one state each way."""
    lever = coarse
    if thermoelectric:
        lever = Lever(coarse.probe.with_physics(("thermoelectric",)), COARSE)
    branch = lever.branch(600.0)
    u, x = branch.u[1:], branch.x[:, 1:]
    potentials = ~lever.equations.space.is_temperature[:, None]
    some_reversed = np.where(potentials & (np.arange(u.size) % 2 == 0), -x, x)
    found = solve_at(lever.equations, u, some_reversed, NewtonOptions(tolerance=1e-8))
    scale = lever.equations.scale
    np.testing.assert_allclose(found.x / scale, x / scale, rtol=0, atol=1e-5)
    # with the factors of these states: what is found is differentiated with them
    along = Branch.of_roots(lever.equations, u, found)
    np.testing.assert_allclose(along.value_slopes, branch.value_slopes[1:], rtol=1e-5, atol=1e-9)


def test_a_branch_goes_on_from_just_before_a_step_of_a_law(coarse):
    """So that of a lever ends whose base has become a little warmer than that of the one before."""
    whole = coarse.branch(800.0)
    step = float(next(u for u in whole.steps if u > 0))
    before = np.append(whole.u[whole.u < step], np.sqrt(step**2 - 5e-5))
    roots = solve_at(coarse.equations, before[1:], whole.states(before[1:]), NewtonOptions(1e-5))
    start = Branch.whole(coarse.equations, before[1:], roots)
    longer = continued(coarse.equations, lambda branch: branch.u[-1] >= whole.u[-1], start)
    u = np.linspace(0.0, whole.u[-1], 50)
    np.testing.assert_allclose(longer.curve(u), whole.curve(u), rtol=1e-4, atol=1e-6)


# --- the knee -------------------------------------------------------------------------------------


def test_the_knee_is_where_the_lever_voltage_is_highest(lever, reference):
    knee = lever.knee()
    bias = knee.bias_V.item() + np.array([-0.02, 0.0, 0.02])
    around = lever.sweep(bias)
    assert around.lever_V.values[1] == pytest.approx(knee.lever_V.item(), abs=1e-7)
    assert around.lever_V.values.argmax() == 1
    # one knee, wherever it is read
    assert reference.knee.tip_K == pytest.approx(knee.tip_K.item(), abs=1e-9)
    assert reference.knee.power_mW == pytest.approx(knee.power_mW.item(), rel=1e-12)


def test_a_lever_too_cold_has_no_knee_yet(coarse):
    branch = continued(coarse.equations, lambda branch: branch.u[-1] ** 2 > 400)
    assert branch.knee is None


# --- in circuits ----------------------------------------------------------------------------------


def test_without_a_series_resistor_the_ramp_ends_at_the_knee(coarse):
    knee = coarse.knee()
    with pytest.raises(BranchEndError, match="branch of a slow bias ramp ends") as caught:
        with_series(coarse, 0.0).sweep(np.linspace(0.5, 5, 10))
    error = caught.value
    assert error.bias_reached == pytest.approx(knee.lever_V.item(), abs=1e-9)
    assert error.partial.bias_V.values.tolist() == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert error.partial.tip_K.values[-1] < knee.tip_K.item()
    with pytest.raises(BranchEndError) as solved:
        with_series(coarse, 0.0).solve(np.linspace(0.5, 5, 10))
    assert len(solved.value.partial) == 6


def test_what_was_reached_before_a_failure_is_kept(coarse, monkeypatch):
    short = continued(coarse.equations, lambda branch: branch.u[-1] ** 2 > 300)

    def fails(*_):
        raise ComputationError("no state was found", partial=short)

    monkeypatch.setattr(Lever, "branch_to", fails)
    with pytest.raises(ComputationError, match="no state was found") as solved:
        coarse.solve([1.0, 4.0, 9.0])
    assert [round(state.bias_V, 9) for state in solved.value.partial] == [1.0, 4.0]
    with pytest.raises(ComputationError, match="no state was found") as read:
        coarse.sweep([9.0, 1.0, 4.0])
    assert read.value.partial.bias_V.values.tolist() == [1.0, 4.0]


def test_a_lever_that_jumps_goes_back_another_way(coarse):
    lever = with_series(coarse, 30000.0)
    sweep = lever.sweep(np.linspace(25, 36, 23), and_back=True)
    assert "jumps from a tip at" in sweep.attrs["notes"]
    up, down = (sweep.isel(bias=(sweep.ramp == way).values) for way in ("up", "down"))
    assert up.bias_V.values.tolist() == np.linspace(25, 36, 23).tolist()
    assert down.bias_V.values.tolist() == np.linspace(25, 36, 23)[-2::-1].tolist()
    assert np.diff(up.tip_K).max() > 80  # the jump
    warmer = down.tip_K.values[::-1] - up.tip_K.values[:-1]
    assert warmer.max() > 200  # between the jumps
    assert (warmer > -1e-9).all()
    bias = sweep.lever_V + 30.0 * sweep.current_mA
    np.testing.assert_allclose(bias, sweep.bias_V, rtol=1e-9)
    solved = lever.dataset(lever.solve(np.linspace(25, 36, 23), and_back=True))
    np.testing.assert_allclose(sweep.tip_K, solved.tip_K, rtol=0, atol=0.02)


def test_jumps_are_where_solved_states_turn(coarse):
    """The highest and lowest bias of states around a fold, each solved at its tip temperature."""
    lever = with_series(coarse, 30000.0)
    branch, reading, failure = lever.read(np.linspace(25, 36, 3), and_back=True)
    assert failure is None
    ((upper_V, upper_K),), ((lower_V, lower_K),) = reading.jumps, reading.jumps_back
    assert upper_V > lower_V
    for fold_V, tip_K, turn in ((upper_V, upper_K, np.max), (lower_V, lower_K, np.min)):
        u = branch.u_at(tip_K + np.linspace(-2.0, 2.0, 9))
        states = solve_at(lever.equations, u, branch.states(u), NewtonOptions())
        lever_V, current_mA, *_ = lever.equations.observed(states.x)
        biases = lever.circuit.bias(lever_V, current_mA)
        parabola = np.polynomial.Polynomial.fit(u, biases, 4)
        assert fold_V == pytest.approx(turn(parabola(np.linspace(u[0], u[-1], 4001))), abs=1e-6)


def test_a_lever_without_jumps_goes_back_as_it_came(coarse):
    sweep = coarse.sweep([0.0, 4.0, 8.0], and_back=True)
    assert sweep.bias_V.values.tolist() == [0.0, 4.0, 8.0, 4.0, 0.0]
    assert sweep.tip_K.values == pytest.approx(sweep.tip_K.values[::-1], abs=1e-9)
    assert sweep.attrs["notes"] == ""


@pytest.mark.parametrize("bias", [[2.0, 1.0], [1.0, 1.0], [-1.0, 1.0]])
def test_biases_that_go_back_rise_before(coarse, bias):
    with pytest.raises(InputError, match="expected"):
        coarse.sweep(bias, and_back=True)


def test_biases_may_come_in_any_order_and_twice(coarse):
    sweep = coarse.sweep([5.0, 1.0, 5.0])
    assert sweep.bias_V.values.tolist() == [5.0, 1.0, 5.0]
    assert sweep.tip_K[0] == sweep.tip_K[2] > sweep.tip_K[1]


def test_zero_bias_is_the_base_temperature(coarse):
    sweep = coarse.sweep([0.0])
    assert sweep.tip_K.item() == 293.0
    assert sweep.current_mA.item() == 0.0
    assert np.isnan(sweep.heater_ohm.item())
    (state,) = coarse.solve([0.0])
    assert (state.tip_K, state.current_mA, state.bias_V) == (293.0, 0.0, 0.0)


@pytest.mark.parametrize("bias", [[-1.0], [np.nan], [np.inf], [], [[4.0, 8.0]], [4j]])
def test_impossible_biases_are_refused(coarse, bias):
    with pytest.raises(InputError, match="expected"):
        coarse.sweep(bias)


def test_a_melting_lever_ends_the_ramp(coarse):
    with pytest.raises(BranchEndError, match="silicon melts") as caught:
        coarse.sweep([10.0, 40.0])
    assert caught.value.partial.bias_V.values.tolist() == [10.0]
    assert 11.0 < caught.value.bias_reached < 40.0


def test_extrapolated_laws_are_noted(coarse):
    notes = coarse.sweep([13.0]).attrs["notes"]
    assert "above 1300 K, where the material laws are extrapolated" in notes


def test_a_thousand_biases_cost_no_more_states(coarse):
    few, many = (Lever(coarse.probe, space=coarse.space) for _ in range(2))
    few.sweep(np.linspace(1, 11, 25))
    many.sweep(np.linspace(1, 11, 1000))
    states: list[Branch] = [lever.branch_to(11.0) for lever in (few, many)]
    assert states[0].u.size == states[1].u.size < 25
