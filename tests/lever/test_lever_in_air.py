"""A lever in air: balances, derivatives, and independence of the panels."""

from __future__ import annotations

import numpy as np
import pytest
from taylor import remainder_orders

from hotlever.air.operator import air_operator
from hotlever.air.surface import PanelOptions
from hotlever.lever import Lever, probe_of, read_sweep, write_sweep
from hotlever.lever.equations import OBSERVABLES
from hotlever.lever.lever import OBSERVABLE_COLUMNS
from hotlever.lever.space import LeverSpace
from hotlever.probe import Probe

BIAS = [4.0, 8.268, 10.748]


@pytest.fixture(scope="module")
def in_air(lever) -> Lever:
    return lever.in_medium("air")


def test_power_leaves_by_the_leg_ends_and_into_the_air(in_air):
    sweep = in_air.sweep([1.0, *BIAS])
    missing = sweep.power_mW - sweep.end_heat_mW - sweep.air_heat_mW
    assert np.abs(missing / sweep.power_mW).max() < 1e-8
    assert (sweep.air_heat_mW > 0.1 * sweep.power_mW).all()
    vacuum = in_air.in_medium("vacuum").sweep([1.0, *BIAS])
    assert (vacuum.air_heat_mW == 0).all()
    assert (vacuum.tip_K > sweep.tip_K).all()


def test_jacobian_is_the_derivative_of_the_residual(in_air):
    x = in_air.solve([9.0]).states[0].x
    orders = remainder_orders(in_air.equations, x, 4, [2.0**-k for k in range(1, 6)])
    assert orders == pytest.approx(np.full(4, 2.0), abs=0.05)


def test_linear_systems_are_solved(in_air):
    x = in_air.solve([9.0]).states[0].x
    jacobian = in_air.equations.jacobian(x)
    right = np.random.default_rng(0).normal(size=(x.size, 3)) * in_air.equations.scale[:, None]
    right = np.stack([jacobian.completed(5.6, 1.0, 0.0) @ column for column in right.T], axis=1)
    solution = jacobian.factorised(5.6, 1.0, 0.0).solve(right)
    again = np.stack([jacobian.completed(5.6, 1.0, 0.0) @ column for column in solution.T], axis=1)
    assert np.abs(again - right).max() < 1e-6 * np.abs(right).max()


@pytest.mark.parametrize("name", ["c_kappa", "n_d", "a1"])
def test_sensitivities_have_taylor_order_two(coarse, name):
    start = coarse.in_medium("air")
    value = getattr(start.probe.material, name)
    at = start.sweep(BIAS, sensitivities=True)
    steps = (0.02, 0.01)
    moved = [
        start.with_material(start.probe.material.with_(**{name: value * (1 + step)})).sweep(BIAS)
        for step in steps
    ]
    for observable in OBSERVABLES:
        column = OBSERVABLE_COLUMNS[observable]
        slope = at.sensitivity.sel(observable=observable, parameter=name)
        rest = [
            np.abs(one[column] - at[column] - step * value * slope).max().item()
            for step, one in zip(steps, moved, strict=True)
        ]
        assert np.log2(rest[0] / rest[1]) > 1.75


def test_halved_panels_change_less_than_a_thousandth(lever, in_air):
    probe = in_air.probe
    finer = air_operator(probe.layout(), options=PanelOptions(refinement=1.4))
    fine = Lever(probe, space=LeverSpace(lever.space.mesh, lever.space.operators, finer))
    coarser = air_operator(probe.layout(), options=PanelOptions(refinement=0.7))
    coarse = Lever(probe, space=LeverSpace(lever.space.mesh, lever.space.operators, coarser))
    a, b, c = (one.sweep(BIAS) for one in (coarse, in_air, fine))
    rise = b.tip_K - 293.0
    assert np.abs((c.tip_K - a.tip_K) / rise).max() < 1e-3
    assert np.abs(c.air_heat_mW / a.air_heat_mW - 1).max() < 1.5e-3
    assert np.abs(c.current_mA / a.current_mA - 1).max() < 2e-4
    # the default lies between them
    assert np.abs((c.tip_K - b.tip_K) / rise).max() < 5e-4


def test_vacuum_is_the_limit_of_low_pressure(lever):
    thin = lever.probe.with_values({"accommodation": 0.9, "pressure_mbar": 1e-4})
    rare = Lever(thin, space=lever.space).in_medium("air").sweep(BIAS)
    assert np.abs(rare.tip_K - lever.sweep(BIAS).tip_K).max() < 0.01


def test_knee_in_air_is_cooled(in_air):
    knee, vacuum = in_air.knee(), in_air.in_medium("vacuum").knee()
    assert knee.attrs["medium"] == "air"
    assert knee.power_mW.item() > 1.2 * vacuum.power_mW.item()
    assert knee.tip_K.item() == pytest.approx(vacuum.tip_K.item(), abs=60)


def test_a_sweep_says_its_medium_and_surroundings(coarse, tmp_path):
    probe = coarse.probe.with_values({"surface_gap_um": 10.0, "medium": "air"})
    data = Lever(probe, space=coarse.space).sweep([2.0])
    write_sweep(data, tmp_path / "sweep.nc")
    again = read_sweep(tmp_path / "sweep.nc")
    assert again.attrs["medium"] == "air"
    assert probe_of(again) == probe
    assert again.air_heat_mW.attrs["units"] == "mW"


def test_a_lever_without_reader_works_in_air():
    data = Lever(Probe.u_shape().in_medium("air")).sweep([5.0])
    balance = data.power_mW - data.end_heat_mW - data.air_heat_mW
    assert abs(balance.item()) < 1e-8 * data.power_mW.item()
