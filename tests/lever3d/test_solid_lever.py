"""The lever of its true thickness: against the flat one, its derivatives, its balances."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.lever.continuation import AT_BIAS
from hotlever.lever3d import SolidLever
from hotlever.probe import Probe
from hotlever.probe.solid import SolidMeshOptions


def test_without_air_it_is_the_flat_lever(lever):
    """benchmarks/air_3d.py prints the difference over all biases and for finer meshes."""
    bias = [5.0, 8.3, 11.0]
    solid = SolidLever(Probe.reference(), sphere_radius_um=None).sweep(bias)
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
    # of the heat into the air all but a little, which warms the cold leg ends, goes far
    assert 0.9 < (sweep.far_heat_mW / sweep.air_heat_mW).item() < 1.0


def test_all_heat_that_leaves_the_surface_arrives_at_infinity(in_air, ramp):
    loss = in_air.equations.loss(ramp.states[0].x)
    assert in_air.air.at_infinity(loss.coefficients) == pytest.approx(loss.heat.sum(), rel=1e-3)


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


def test_the_linear_solver_needs_few_iterations(in_air, ramp):
    equations, x = in_air.equations, ramp.states[0].x
    solver = equations.pinned(AT_BIAS, 5.0).factorised(x)
    right_hand_side = np.random.default_rng(1).normal(size=x.size)
    solution = solver.solve(right_hand_side)
    matrix = equations.jacobian(x).completed(equations.series_kohm, *AT_BIAS)
    rest = matrix @ solution - right_hand_side
    assert np.abs(rest).max() < 1e-4 * np.abs(right_hand_side).max()
    assert solver.iterations < 10


def test_sensitivities_are_those_of_a_changed_material(in_air, ramp, sweep):
    material, step = in_air.probe.material, 1e-3
    changed = in_air.with_material(material.with_(c_kappa=material.c_kappa * (1 + step)))
    moved = changed.dataset(changed.polish([state.x for state in ramp.states]))
    slope = sweep.sensitivity.sel(observable="tip", parameter="c_kappa").item()
    change = (moved.tip_K - sweep.tip_K).item() / (step * material.c_kappa)
    assert slope == pytest.approx(change, rel=0.01)


def test_the_sphere_must_hold_the_lever():
    with pytest.raises(InputError, match=r"radius 20 µm does not hold .* expected more than"):
        SolidLever(Probe.reference(), sphere_radius_um=20.0)


def test_without_ngsolve_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ngsolve", None)
    with pytest.raises(InputError, match=r"pip install 'hotlever\[air3d\]'"):
        SolidLever(Probe.reference(), SolidMeshOptions(refinement=0.5))
