"""What must hold of every lever: flat, solid and reduced, in vacuum and in air.

The same cases run through all of them: ordinary circuits, none, one so small that the ramp ends at
the fold, one so large that it jumps; no power; a lever without a reader.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from taylor import remainder_orders

from hotlever.errors import BranchEndError
from hotlever.estimate.experiment import ExperimentAtRest
from hotlever.lever import Branch, Lever
from hotlever.lever.branch import Reach, branch_end
from hotlever.lever.dataset import MonitorMap
from hotlever.lever.equations import BALANCES, balance_columns
from hotlever.lever.lever import COARSE
from hotlever.lever.observables import Linearised, by_parameter
from hotlever.lever.reduced_lever import ReducedLever
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.space import LEVER, TIP
from hotlever.lever3d import SolidLever
from hotlever.materials import PARAMETERS, published
from hotlever.probe import Circuit, Probe
from hotlever.probe.mesh import SolidMeshOptions
from hotlever.probe.surroundings import Physics
from of_materials import metal_film_probe, p_type_probe

MATERIAL = published("option III").material
#: Biases (V) of a ramp that reaches the hot branch, and the circuit it runs in.
RAMP = np.array([0.0, 0.5, 4.0, 7.5, 8.3, 9.5])
NORMAL = Circuit()


@dataclass(frozen=True)
class One:
    """One kind of lever, and how far its ramps go."""

    lever: Lever | ReducedLever
    hottest_V: float
    #: Whether no other kind, nor `test_sensitivities.py`, has derivatives by these materials.
    own_laws: bool = False

    @property
    def probe(self) -> Probe:
        """Its probe, or one that differs from it in nothing that matters, with option III."""
        reduced = isinstance(self.lever, ReducedLever)
        probe = self.lever.drawn if reduced else self.lever.probe
        material = MATERIAL.model_copy(update={"scattering_exponent": 0.3})
        return probe.model_copy(update={"material": material})

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters of its materials."""
        if isinstance(self.lever, ReducedLever):
            return self.lever.names
        named, effects = self.probe.materials.items(), ()
        own = [f"{name}.{one}" for name, kind in named for one in kind.usual]
        if self.probe.physics:
            effects = ("n_hd", "scattering_exponent", "emissivity")
            own += [f"{name}.emissivity" for name in self.probe.materials]
        return tuple(own or [*PARAMETERS, *effects])

    @property
    def solver(self) -> SimilarLevers | ReducedLever:
        """What solves it for any material."""
        known = isinstance(self.lever, ReducedLever)
        return self.lever if known else SimilarLevers(self.lever)

    def branch(self, circuit: Circuit = NORMAL, bias: float | None = None) -> Branch:
        """Its branch with option III until a bias."""
        bias = self.hottest_V if bias is None else bias
        return self.solver.linearised(self.probe, Reach(circuit, bias)).branch


#: All that counts beyond the paper.
ALL = Probe.reference().with_physics(Physics.model_fields)
SOLID = SolidMeshOptions(refinement=0.4, grading=0.7)
KINDS: dict[str, Callable[[pytest.FixtureRequest], One]] = {
    "flat": lambda request: One(request.getfixturevalue("coarse"), 9.5),
    "flat, in air": lambda request: One(request.getfixturevalue("in_air"), 9.5, own_laws=True),
    "reduced": lambda request: One(request.getfixturevalue("reduced"), 9.5, own_laws=True),
    "reduced, in air": lambda request: One(request.getfixturevalue("reduced_in_air"), 9.5),
    "no reader": lambda _: One(Lever(Probe.u_shape(), COARSE), 9.5),
    "solid": lambda _: One(SolidLever(Probe.reference(), SOLID), 4.0),
    "all effects, in air": lambda _: One(Lever(ALL.in_medium("air"), COARSE), 9.5, own_laws=True),
    "boron-doped, all effects": lambda _: One(
        Lever(p_type_probe().with_physics(Physics.model_fields), COARSE), 9.5, own_laws=True
    ),
    "all effects, solid": lambda _: One(SolidLever(ALL, SOLID), 4.0),
    "metal film, all effects": lambda _: One(
        Lever(metal_film_probe().with_physics(Physics.model_fields), COARSE), 4.0, own_laws=True
    ),
    "metal film, in air": lambda _: One(Lever(metal_film_probe().in_medium("air"), COARSE), 4.0),
}


@pytest.fixture(scope="module", params=KINDS)
def one(request) -> One:
    return KINDS[request.param](request)


@pytest.fixture(scope="module")
def branch(one) -> Branch:
    return one.branch()


def hot(branch: Branch) -> np.ndarray:
    """States with power."""
    return branch.x[:, 1:]


def test_states_solve_the_equations_at_their_tip_temperatures(branch):
    equations, x = branch.equations, hot(branch)
    rest = equations.balance(x)
    current = rest[-1].copy()
    np.testing.assert_allclose(equations.space.tip_rise(x), branch.u[1:] ** 2, rtol=1e-7)
    # one step of Newton's method would move no state by a millikelvin
    rest[-1] = 0.0
    step = equations.factorised(x).solve(rest, np.arange(x.shape[1])) / equations.scale
    assert np.abs(step).max() < 2e-3
    np.testing.assert_allclose(current, branch.values[1:, 1])


def test_charge_and_energy_are_conserved(one, branch):
    if isinstance(one.lever, ReducedLever):
        pytest.skip("its modes are no test functions of the terminals")
    columns = dict(zip(BALANCES, balance_columns(branch.equations, hot(branch)).T, strict=True))
    power = branch.values[1:, 0] * branch.values[1:, 1]
    np.testing.assert_allclose(columns["ground_current_mA"], branch.values[1:, 1], rtol=1e-7)
    ways = ("end_heat_mW", "air_heat_mW", "radiated_mW")
    np.testing.assert_allclose(sum(columns[way] for way in ways), power, rtol=1e-6)


def test_monitors_show_the_fields_of_the_elements(one, branch):
    layout = one.probe.layout()
    equations, states = branch.equations, branch.x[:, -2:]
    full = equations.space.full
    inside = np.isin(full.mesh.region, layout.named("heater"))
    some = np.flatnonzero(inside)[0]
    (x, y), other = layout.tip, full.mesh.elements.p[:2, full.mesh.elements.t[:, some]].mean(axis=1)
    monitors = {
        "top": {"point_um": [x, y]},
        "line": {"line_um": [[x, y], other.tolist()], "points": 2},
        "hot": {"region": "heater"},
    }
    monitor_map = MonitorMap(one.probe.with_monitors(**monitors), equations)
    columns = monitor_map.columns(monitor_map.values(states).T)
    np.testing.assert_allclose(columns["top_K"], branch.base_temperature_K + branch.u[-2:] ** 2)
    expanded = equations.space.expanded(states)
    base, ends = equations.base_temperature_K, equations.terminals.end_rises
    basis = full.elements.basis
    places = np.zeros((basis.mesh.dim(), 2))
    places[:2] = np.transpose([(x, y), other])
    for number in range(2):
        for unit, nodal in zip("KV", full.nodal(expanded[:, number], base, ends), strict=True):
            there = basis.probes(places) @ nodal
            np.testing.assert_allclose(columns[f"line_{unit}"][number], there, rtol=1e-9)
            each = np.asarray(basis.interpolate(nodal))
            mean = np.average(each[inside], weights=basis.dx[inside])
            assert columns[f"hot_{unit}"][number] == pytest.approx(mean, rel=1e-9)
    change = np.random.default_rng(2).normal(size=states.shape)
    difference = monitor_map.values(states + change) - monitor_map.values(states)
    np.testing.assert_allclose(monitor_map.changes(change), difference, atol=1e-9)


def test_the_jacobian_passes_a_taylor_test(branch):
    x = hot(branch)[:, -1:]
    orders = remainder_orders(branch.equations, x, seed=1, steps=(0.2, 0.1, 0.05))
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


@pytest.mark.parametrize("constraint", [TIP, LEVER], ids=["tip", "lever voltage"])
def test_linear_systems_are_solved(branch, constraint):
    equations, x = branch.equations, hot(branch)[:, -2:]
    expected = np.random.default_rng(0).normal(size=(*x.shape, 3)) * equations.scale[..., None]
    right = equations.balance_change(x, expected)
    right[-1] = constraint.of(equations.space, expected)
    found = equations.solve_linear(x, equations.factorised(x, constraint), right, constraint)
    np.testing.assert_allclose(
        found / equations.scale[..., None], expected / equations.scale[..., None], atol=1e-4
    )


def test_slopes_along_the_branch_are_those_of_the_curve(branch):
    """Half way between two states the curve meets a state that is solved by itself."""
    u = branch.u[-3:-1].mean()
    guess = branch.states(np.array([u]))
    equations = branch.equations
    residual = equations.balance(guess)
    residual[-1] = 0.0
    away = equations.factorised(guess).solve(residual, np.array([0])) / equations.scale
    assert np.abs(away).max() < 0.05


@pytest.fixture(scope="module")
def start(one) -> Linearised:
    return one.solver.linearised(one.probe, Reach(NORMAL, 4.0))


def test_derivatives_by_the_material_have_taylor_order_two(one, start):
    """At fixed tip temperatures, of everything an instrument shows."""
    for name in one.names if one.own_laws else one.names[:1]:
        assert taylor_order(one, start, name) > 1.7, name


def taylor_order(one: One, start: Linearised, name: str) -> float:
    """Return the lowest order with which what first derivatives leave falls."""
    reach = Reach(NORMAL, 4.0)
    u = start.branch.u[1:]
    value, remainders = float(one.probe.values([name])[0]), []
    slope = by_parameter(start.branch.equations, hot(start.branch), [name])
    for step in (0.02, 0.01):
        perturbed_probe = one.probe.replace({name: value * (1 + step)})
        other = one.solver.linearised(perturbed_probe, reach, start).branch
        np.testing.assert_allclose(other.u[1 : u.size + 1], u)
        change = (other.values[: u.size + 1] - start.branch.values)[1:, :3].T
        remainders.append(np.abs(change - step * value * slope[:, :3, 0].T))
    size = np.abs(start.branch.values[1:, :3].T)
    with np.errstate(divide="ignore", invalid="ignore"):
        orders = np.log2(remainders[0] / remainders[1])
    # a straight line leaves no remainder to measure an order of
    linear = ~(remainders[0] > 2e-6 * size)
    return float(orders[~linear].min(initial=2.0))


# --- in circuits ------------------------------------------------------------------------------


def ohm(value: float) -> Circuit:
    return Circuit(series_resistance_ohm=value)


def test_a_ramp_takes_states_of_its_biases_and_none_at_zero(one, branch):
    bias = RAMP[one.hottest_V >= RAMP]
    reading = branch.read(NORMAL, bias)
    outputs = branch.electrical_outputs(reading.u)
    assert reading.u[0] == 0.0
    assert reading.jumps == []
    np.testing.assert_allclose(
        NORMAL.bias(outputs["lever_V"], outputs["current_mA"]), bias, rtol=1e-12, atol=1e-12
    )
    assert np.all(np.diff(reading.u) > 0)


def test_with_little_resistance_the_ramp_ends_at_the_fold_or_jumps_there(one):
    """In air the lever voltage rises again beyond the fold, so that a ramp jumps and goes on."""
    if one.hottest_V < 9.0:
        pytest.skip("its ramps do not reach the knee")
    circuit = ohm(50.0)
    branch = one.branch(circuit, 20.0)
    reading = branch.read(circuit, np.array([0.0, 1.0, 2.0, 20.0]))
    assert np.isfinite(reading.u[:3]).all()
    assert np.isnan(reading.u[3])
    outputs = branch.electrical_outputs(np.linspace(0.0, branch.end_u, 4001))
    bias = circuit.bias(outputs["lever_V"], outputs["current_mA"])
    ended = branch_end(branch, reading)
    assert isinstance(ended, BranchEndError)
    assert ended.bias_reached == pytest.approx(bias.max(), abs=1e-5)
    assert f"at a bias of {bias.max():.4f} V" in str(ended)
    if reading.jumps:
        fold = bias[np.flatnonzero(np.diff(bias) < 0)[0]]
        assert reading.jumps[0][0] == pytest.approx(fold, abs=1e-5)
    if not str(ended).startswith("the reduced lever ends"):
        assert ("silicon melts" in str(ended)) == bool(reading.jumps)


def test_a_model_of_it_refuses_a_bias_beyond_the_fold_in_one_line(one):
    if one.hottest_V < 9.0:
        pytest.skip("its ramps do not reach the knee")
    probe = one.probe.with_(series_resistance_ohm=0.0)
    model = ExperimentAtRest(one.solver, None, np.array([0.0, 1.0, 20.0]), one.names)
    ends = r"no steady state|silicon melts|^the reduced lever ends"
    with pytest.raises(BranchEndError, match=ends):
        model.predict(probe)
    # with biases below it all is well, the row at zero bias included
    values = (
        ExperimentAtRest(one.solver, None, np.array([1.0, 0.0]), one.names).predict(probe).values
    )
    assert values[0, 1] == 0.0
    assert values[2].tolist()[1] == pytest.approx(293.0)
    assert values[2, 0] > 293.0


def test_with_a_large_resistance_the_ramp_jumps(one):
    if one.hottest_V < 9.0:
        pytest.skip("its ramps do not reach the knee")
    circuit = ohm(30e3)
    branch = one.branch(circuit, 40.0)
    bias = np.linspace(25.0, 40.0, 61)
    reading = branch.read(circuit, bias)
    ((fold, tip),) = reading.jumps
    assert "jumps from a tip at" in reading.notes(bias)[0]
    before, after = reading.u[bias <= fold].max(), reading.u[bias > fold].min()
    assert before**2 <= tip - branch.base_temperature_K < after**2 - 50.0
