"""The reference lever against what must hold: balances, published points, a finer mesh."""

from __future__ import annotations

import numpy as np
import pytest
from skfem.element import ElementTriP2

from hotlever.errors import BranchEndError
from hotlever.estimate.power_law import EQ12
from hotlever.lever import Lever
from hotlever.lever.elements import FiniteElements
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import COARSE
from hotlever.materials import PUBLISHED, published
from hotlever.probe import MeshOptions, Probe, mesh_layout
from hotlever.spieser2017 import OPERATING_POINTS

BIAS = np.linspace(1.0, 11.0, 25)


@pytest.fixture(scope="module")
def sweep(lever):
    return lever.dataset(lever.solve(BIAS))


def test_charge_is_conserved(sweep):
    np.testing.assert_allclose(sweep.ground_current_mA, sweep.current_mA, rtol=1e-9)


def test_all_electrical_power_leaves_by_the_leg_ends(sweep):
    np.testing.assert_allclose(sweep.end_heat_mW, sweep.power_mW, rtol=1e-6)


def test_circuit_equation_holds(lever, sweep):
    np.testing.assert_allclose(sweep.lever_V + 5.6 * sweep.current_mA, BIAS, rtol=1e-9)


def test_resistances_add_up_to_the_lever(sweep):
    # but for the few 1e-9 that the fringing current dissipates in the reader branch
    np.testing.assert_allclose(sweep.lever_ohm, 1000 * sweep.lever_V / sweep.current_mA, rtol=1e-7)


def test_reader_senses_the_voltage_across_the_second_leg(sweep):
    """V_r sees only high-doped silicon: within the spreading in the bridge it is I_h R_l2."""
    drop = sweep.leg2_ohm * sweep.current_mA / 1000
    np.testing.assert_allclose(sweep.reader_V, drop, rtol=0.03)
    assert (sweep.reader_V < drop).all()


def test_no_current_flows_into_the_reader_branch(lever, sweep):
    (state,) = lever.solve([8.0])
    fields, sheet, _ = lever.equations.at(state.x)
    heat = sheet.sigma * (fields.grad_V**2).sum(axis=0) * lever.space.weights
    branch = heat[lever.space.parts["reader branch"]].sum()
    assert 0 <= branch < 2e-3 * heat.sum()
    # next to the bridge the current fringes into the leg; behind the reader none is left
    behind = np.repeat(lever.space.mesh.region == 4, lever.space.elements.per_element)
    assert np.abs(sheet.sigma[behind] * fields.grad_V[:, behind]).max() < 1e-9


@pytest.mark.parametrize("point", OPERATING_POINTS, ids=lambda point: point.name)
def test_published_operating_points(lever, point):
    ours = lever.sweep([point.lever_V + 5.6 * point.current_mA])
    assert ours.lever_V.item() == pytest.approx(point.lever_V, rel=0.01)
    assert ours.current_mA.item() == pytest.approx(point.current_mA, rel=0.01)
    if point.tip_K is not None:
        assert ours.tip_K.item() == pytest.approx(point.tip_K, abs=5.0)


def test_temperature_follows_the_published_power_law_below_its_hot_end(sweep):
    difference = np.abs(sweep.tip_K - EQ12.tip_temperature(sweep.power_mW))
    assert difference.where(sweep.power_mW <= 3.3).max() < 30.0


def test_knee_lies_above_the_inversion_temperature(lever):
    from hotlever.materials.silicon import inversion_temperature

    material = lever.probe.material
    assert lever.knee().tip_K.item() > inversion_temperature(material.n_d, material.p) + 15


@pytest.mark.parametrize("name", ["option I", "option II", "option III"])
def test_default_mesh_is_accurate_for_the_published_parameters(lever, name):
    """Against halved sizes and a higher quadrature; benchmarks/convergence.py mesh goes on."""
    material = published(name).material
    fine_mesh = mesh_layout(lever.probe.layout(), MeshOptions(refinement=2.0))
    fine = Lever(
        lever.probe, space=FullSpace(fine_mesh, FiniteElements(fine_mesh.elements, quadrature=8))
    )
    bias = np.linspace(1, 11, 9)
    ours, best = (one.with_material(material).sweep(bias) for one in (lever, fine))
    np.testing.assert_allclose(ours.current_mA, best.current_mA, rtol=1e-4)
    np.testing.assert_allclose(ours.reader_V, best.reader_V, rtol=1e-4)
    np.testing.assert_allclose(ours.tip_K, best.tip_K, rtol=0, atol=0.1)


def test_quadratic_and_cubic_elements_agree(lever):
    mesh = mesh_layout(lever.probe.layout(), MeshOptions(refinement=2.0))
    quadratic = Lever(
        lever.probe, space=FullSpace(mesh, FiniteElements(mesh.elements, ElementTriP2(), 5))
    )
    ours, other = lever.sweep([5.0, 8.3, 11.0]), quadratic.sweep([5.0, 8.3, 11.0])
    np.testing.assert_allclose(ours.tip_K, other.tip_K, rtol=0, atol=0.2)
    np.testing.assert_allclose(ours.current_mA, other.current_mA, rtol=2e-4)


@pytest.mark.parametrize("name", [name for name in PUBLISHED if "lever" in name])
def test_every_published_lever_sweeps(coarse, name):
    sweep = coarse.with_material(published(name).material).sweep(BIAS)
    assert (np.diff(sweep.tip_K) > 0).all()


def random_probe(rng: np.random.Generator) -> Probe:
    """Draw parameters, circuit and geometry within sensible bounds."""
    u = rng.uniform
    values = {
        "c_kappa": u(0.5, 0.9),
        "delta": u(0.3, 1.0),
        "n_d": 10 ** u(17, 18.2),
        "p": u(2.2, 3.1),
        "a0": u(5e-4, 1.5e-3),
        "a1": u(0.5e-6, 2e-6),
        "series_resistance_ohm": rng.choice([0.0, 10 ** u(2, 4.6)]),
        "base_temperature_K": u(280, 400),
        "length_um": u(35, 100),
        "gap_um": u(2, 6),
        "bridge_width_um": u(2, 6),
        "heater_length_um": u(2, 7),
        "heater_width_um": u(0.6, 2.5),
        "thickness_um": u(0.2, 1.0),
    }
    if rng.random() < 0.5:
        values |= {"centre_leg_width_um": u(3, 9), "outer_leg_width_um": u(2, 6)}
        return Probe.reference().with_(**values)
    values |= {"leg_width_um": u(3, 9), "gap_um": u(7, 12)}
    values["heater_width_um"] = min(values["heater_width_um"], values["bridge_width_um"])
    return Probe.u_shape().with_(**values)


@pytest.mark.parametrize("seed", range(12))
def test_random_levers_converge_or_say_how_far_they_came(seed):
    """benchmarks/convergence.py levers does a thousand."""
    probe = random_probe(np.random.default_rng(seed))
    try:
        sweep = Lever(probe, COARSE).sweep(BIAS)
    except BranchEndError as end:
        sweep = end.partial
        reached, message = end.bias_reached, str(end)
    else:
        reached, message = BIAS[-1], f"{BIAS[-1]:.4f} V"
    assert 0 < reached <= BIAS[-1]
    assert f"{reached:.4f} V" in message
    np.testing.assert_allclose(sweep.ground_current_mA, sweep.current_mA, rtol=1e-9)


@pytest.mark.parametrize("seed", [142, 178, 269, 287])
def test_a_sweep_is_near_the_states_where_curves_bend(seed):
    """Just above the step of the thermal conductivity, and where a leg is hotter than the tip."""
    probe = random_probe(np.random.default_rng(seed))
    lever = Lever(probe, MeshOptions(refinement=0.4))
    bias = np.linspace(0.3, 0.999, 25) * lever.branch().read(probe.circuit, np.zeros(1)).last_V
    sweep, solved = lever.sweep(bias), lever.dataset(lever.solve(bias))
    np.testing.assert_allclose(sweep.current_mA.values, solved.current_mA.values, rtol=5e-5)
    np.testing.assert_allclose(sweep.tip_K.values, solved.tip_K.values, rtol=0, atol=0.05)
