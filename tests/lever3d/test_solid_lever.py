"""The lever of its true thickness: against the flat one, its derivatives, its balances."""

from __future__ import annotations

import sys

import meshio
import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.lever.continuation import AT_BIAS, BranchFollower
from hotlever.lever.state_store import StateStore
from hotlever.lever3d import SolidLever
from hotlever.lever3d.fields import heat_by_region, temperature_at, write_solid_vtu
from hotlever.probe import Probe


def test_without_air_it_is_the_flat_lever(lever):
    """benchmarks/air_3d.py prints the difference over all biases and for finer meshes."""
    bias = [7.6]  # where the difference is largest
    solid = SolidLever(Probe.reference()).sweep(bias)
    flat = lever.sweep(bias)
    np.testing.assert_allclose(solid.tip_K, flat.tip_K, rtol=0, atol=0.3)
    np.testing.assert_allclose(solid.current_mA, flat.current_mA, rtol=3e-4)
    np.testing.assert_allclose(solid.reader_V, flat.reader_V, rtol=3e-4)
    assert solid.attrs["medium"] == "vacuum"


def test_heat_goes_to_the_leg_ends_and_the_air_and_charge_to_ground(sweep):
    assert sweep.attrs["medium"] == "air"
    lost = sweep.end_heat_mW + sweep.air_heat_mW
    np.testing.assert_allclose(lost, sweep.power_mW, rtol=1e-7)
    np.testing.assert_allclose(sweep.ground_current_mA, sweep.current_mA, rtol=1e-7)


def test_all_heat_that_leaves_the_surface_arrives_at_infinity(in_air, ramp, sweep):
    coefficients, heat = in_air.in_the_air(ramp.states[0].x)
    assert heat.sum() == pytest.approx(sweep.air_heat_mW.item())
    assert in_air.air.at_infinity(coefficients) == pytest.approx(heat.sum(), rel=1e-3)


def test_the_regions_give_all_the_heat_and_the_bridge_the_most(in_air, ramp, sweep):
    shares = heat_by_region(in_air, ramp.states[0].x)
    assert sum(shares.values()) == pytest.approx(sweep.air_heat_mW.item())
    assert max(shares, key=shares.__getitem__) == "bridge"


def test_air_cools(sweep, lever):
    vacuum = lever.sweep(sweep.bias_V)
    assert 293 + 5 < sweep.tip_K.item() < vacuum.tip_K.item() - 5


def test_solves_with_the_jacobian_undo_small_changes(in_air, ramp):
    """J⁻¹ (F(x + h d) − F(x)) / h − d shrinks like h."""
    x = ramp.states[0].x
    pinned = in_air.equations.pinned(AT_BIAS, 5.0)
    direction = np.random.default_rng(3).normal(size=x.size) * in_air.equations.scale
    solver = pinned.factorised(x)
    start = pinned.residual(x)
    rest = [
        np.abs(solver.solve((pinned.residual(x + h * direction) - start) / h) - direction).max()
        for h in (0.2, 0.1, 0.05)
    ]
    orders = np.log2(np.array(rest[:-1]) / rest[1:])
    np.testing.assert_allclose(orders, 1.0, atol=0.1)


def test_the_linear_solver_needs_few_iterations(in_air, ramp, monkeypatch):
    equations, x = in_air.equations, ramp.states[0].x
    solver = equations.pinned(AT_BIAS, 5.0).factorised(x)
    right_hand_side = np.random.default_rng(1).normal(size=x.size)
    applied = []
    monkeypatch.setattr(
        in_air.air, "solve", lambda theta, solve=in_air.air.solve: applied.append(0) or solve(theta)
    )
    solution = solver.solve(right_hand_side)
    assert len(applied) < 20
    matrix = equations.jacobian(x).completed(equations.series_kohm, *AT_BIAS)
    rest = matrix @ solution - right_hand_side
    assert np.abs(rest).max() < 1e-6 * np.abs(right_hand_side).max()


def test_sensitivities_are_those_of_a_changed_material(in_air, ramp, sweep):
    material, step = in_air.probe.material, 1e-3
    changed = in_air.with_material(material.with_(c_kappa=material.c_kappa * (1 + step)))
    moved = changed.dataset(changed.polish([state.x for state in ramp.states]))
    slope = sweep.sensitivity.sel(observable="tip", parameter="c_kappa").item()
    change = (moved.tip_K - sweep.tip_K).item() / (step * material.c_kappa)
    assert slope == pytest.approx(change, rel=0.01)


def test_the_sphere_must_hold_the_lever():
    with pytest.raises(InputError, match=r"radius 20 µm does not hold .* expected more than"):
        SolidLever(Probe.reference().in_medium("air"), sphere_radius_um=20.0)


def test_without_ngsolve_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ngsolve", None)
    with pytest.raises(InputError, match=r"pip install 'hotlever\[air3d\]'"):
        SolidLever(Probe.reference().in_medium("air"))


def test_only_free_space_is_known():
    probe = Probe.reference().in_medium("air").with_values({"surface_gap_um": 1.0})
    with pytest.raises(InputError, match=r"\[surroundings\]: .* knows free space only"):
        SolidLever(probe)


def test_a_sweep_goes_on_from_the_states_in_the_store(coarse, monkeypatch):
    bias = [2.0, 4.0, 6.0]
    store = StateStore({"name": "goes on"})
    whole = coarse.solve(bias)
    coarse.solve(bias[:2], store=store)
    advanced = []
    monkeypatch.setattr(
        BranchFollower,
        "advance_to",
        lambda self, value, advance=BranchFollower.advance_to: (
            advanced.append(value) or advance(self, value)
        ),
    )
    resumed = coarse.solve(bias, store=store)
    assert advanced == bias[2:]
    for one, other in zip(resumed.states, whole.states, strict=True):
        np.testing.assert_allclose(one.x, other.x, rtol=1e-6, atol=1e-6)


def test_the_temperature_is_continuous_from_silicon_to_air_and_cold_far_away(in_air, ramp):
    x = ramp.states[0].x
    across, along = in_air.solid.layout.tip[1], in_air.solid.layout.tip[0]
    heights = np.array([0.0, 0.21, 1.0, 10.0, 45.0, 70.0])
    points = np.column_stack([np.full(6, along), np.full(6, across), heights])
    T = temperature_at(in_air, x, points)
    assert T[0] == pytest.approx(in_air.space.tip_temperature(x), abs=0.5)
    assert T[1] == pytest.approx(T[0], abs=1.0)
    assert (np.diff(T[:5]) < 0).all()
    assert T[4] < T[3] - 10
    assert np.isnan(T[5])


def test_the_file_of_a_state_holds_lever_and_air(in_air, ramp, tmp_path):
    write_solid_vtu(in_air, ramp.states[0].x, tmp_path / "state.vtu")
    mesh = meshio.read(tmp_path / "state.vtu")
    region = mesh.cell_data["region"][0]
    assert set(region) == {-1, *range(7)}
    assert mesh.point_data["temperature_K"].max() == pytest.approx(
        in_air.space.highest_temperature(ramp.states[0].x), abs=2.0
    )
