"""The lever of its true thickness: against the flat one, its derivatives, its balances."""

from __future__ import annotations

import sys

import meshio
import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.figures import field_maps
from hotlever.figures import temperature_slices as draw
from hotlever.lever.fields import seen_from_above
from hotlever.lever.space import TIP
from hotlever.lever3d import (
    SolidLever,
    heat_by_region,
    temperature_at,
    temperature_slices,
    write_solid_vtu,
)
from hotlever.probe import Probe
from hotlever.probe.mesh import SolidMeshOptions, doubled_areas

COARSE = SolidMeshOptions(refinement=0.4, grading=0.7)


def test_without_air_it_is_the_flat_lever(lever):
    """benchmarks/air.py prints the difference over all biases and for finer meshes."""
    bias = [7.6]  # where the difference is largest
    own = SolidLever(Probe.reference(), SolidMeshOptions(refinement=0.6))
    solid, flat = own.dataset(own.solve(bias)), lever.sweep(bias)
    np.testing.assert_allclose(solid.tip_K, flat.tip_K, rtol=0, atol=0.8)
    np.testing.assert_allclose(solid.current_mA, flat.current_mA, rtol=6e-4)
    np.testing.assert_allclose(solid.reader_V, flat.reader_V, rtol=3e-4)
    assert solid.attrs["medium"] == "vacuum"


@pytest.mark.slow
def test_heat_goes_to_the_leg_ends_and_the_air_and_charge_to_ground(sweep):
    assert sweep.attrs["medium"] == "air"
    lost = sweep.end_heat_mW + sweep.air_heat_mW
    np.testing.assert_allclose(lost, sweep.power_mW, rtol=1e-7)
    np.testing.assert_allclose(sweep.ground_current_mA, sweep.current_mA, rtol=1e-7)


def test_a_map_is_of_its_upper_side(state):
    surface = seen_from_above(state.lever)
    corners = surface.points[surface.triangles].transpose(2, 1, 0)
    area = np.abs(doubled_areas(corners)).sum() / 2
    assert area == pytest.approx(sum(region.area for region in state.lever.probe.layout().regions))
    hottest = (surface.sampling @ state.nodal[0]).max()
    assert state.tip_K - 1.0 < hottest < state.nodal[0].max() + 1e-9
    with pytest.raises(InputError, match="expected a flat one"):
        field_maps(state)


def test_all_heat_that_leaves_the_surface_arrives_at_infinity(state, sweep):
    slices = temperature_slices(state).attrs
    assert slices["air_heat_mW"] == pytest.approx(sweep.air_heat_mW.item())
    assert slices["heat_at_infinity_mW"] == pytest.approx(slices["air_heat_mW"], rel=1e-3)


@pytest.mark.slow
def test_sensitivities_are_those_of_the_flat_lever(lever):
    solid, flat = SolidLever(Probe.reference(), COARSE), lever
    found, expected = (one.sweep([3.0], sensitivities=True).sensitivity for one in (solid, flat))
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_the_regions_give_all_the_heat_and_the_bridge_the_most(state, sweep):
    shares = heat_by_region(state)
    assert sum(shares.values()) == pytest.approx(sweep.air_heat_mW.item())
    assert max(shares, key=shares.__getitem__) == "bridge"


def test_air_cools(sweep, lever):
    vacuum = lever.sweep(sweep.bias_V)
    assert 293 + 5 < sweep.tip_K.item() < vacuum.tip_K.item() - 5


def test_solves_with_the_jacobian_undo_small_changes(in_air, state):
    """J⁻¹ (F(x + h d) − F(x)) / h − d shrinks like h; it is tests/lever's Taylor test in air."""
    equations, x = in_air.equations, state.x
    direction = np.random.default_rng(3).normal(size=x.shape) * equations.scale
    factors, start = equations.factorised(x), equations.balance(x)
    rest = []
    for h in (0.2, 0.1, 0.05):
        residual_change = (equations.balance(x + h * direction) - start) / h
        residual_change[-1] = TIP.of(in_air.space, direction)
        rest.append(np.abs(factors.solve(residual_change, np.array([0])) - direction).max())
    orders = np.log2(np.array(rest[:-1]) / rest[1:])
    np.testing.assert_allclose(orders, 1.0, atol=0.1)


def test_the_linear_solver_needs_few_iterations(in_air, state, monkeypatch):
    equations, x = in_air.equations, state.x
    air, applied = in_air.space.air.operator, []
    factors = equations.factorised(x)
    expected = np.random.default_rng(1).normal(size=x.shape) * equations.scale
    right = equations.balance_change(x, expected)
    right[-1] = TIP.of(in_air.space, expected)
    monkeypatch.setattr(
        air, "solve", lambda theta, solve=air.solve: applied.append(0) or solve(theta)
    )
    found = factors.solve(right, np.array([0]))
    assert len(applied) < 20
    assert np.abs((found - expected) / equations.scale).max() < 1e-4


def test_another_material_is_solved_as_by_a_lever_made_of_it(in_air, state):
    """The same lever otherwise is a solid lever still, with the same mesh and air."""
    other = in_air.with_material(in_air.probe.material.with_(c_kappa=0.6))
    assert type(other) is SolidLever
    assert other.space is in_air.space
    (warmer,) = other.solve([5.0])
    assert warmer.tip_K > state.tip_K + 3.0


@pytest.mark.slow
def test_in_another_medium_it_is_meshed_anew_and_solved():
    vacuum = SolidLever(Probe.reference(), COARSE, air_order=2)
    (warm,) = vacuum.solve([3.0])  # and what it then knows of its flat lever does not come along
    air = vacuum.in_medium("air")
    assert type(air) is SolidLever
    assert air.medium == "air"
    (cold,) = air.solve([3.0])
    assert 293.0 < cold.tip_K < warm.tip_K
    assert air.in_medium("vacuum").space.air.medium == "vacuum"


def test_the_sphere_must_hold_the_lever():
    with pytest.raises(InputError, match=r"radius 20 µm does not hold .* expected more than"):
        SolidLever(Probe.reference().in_medium("air"), sphere_radius_um=20.0)


def test_without_ngsolve_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ngsolve", None)
    with pytest.raises(InputError, match=r"pip install 'hotlever\[air3d\]'"):
        SolidLever(Probe.reference().in_medium("air"))


def test_only_free_space_is_known():
    probe = Probe.reference().in_medium("air").with_(surface_gap_um=1.0)
    with pytest.raises(InputError, match=r"\[surroundings\]: .* knows free space only"):
        SolidLever(probe)


def test_a_sweep_goes_on_from_the_states_in_the_cache(monkeypatch):
    bias = [1.0, 2.0]
    solid = SolidLever(Probe.reference(), COARSE)
    solid.solve(bias[:1])
    solved = []
    monkeypatch.setattr(
        SolidLever,
        "polished",
        lambda self, guess, value, *constraint, polished=SolidLever.polished: (
            solved.append(value) or polished(self, guess, value, *constraint)
        ),
    )
    resumed = SolidLever(Probe.reference(), COARSE).sweep(bias)
    assert solved == bias[1:]
    assert resumed.bias_V.values.tolist() == pytest.approx(bias)


def test_the_temperature_is_continuous_from_silicon_to_air_and_cold_far_away(in_air, state):
    across, along = in_air.solid.layout.tip[1], in_air.solid.layout.tip[0]
    heights = np.array([0.0, 0.21, 1.0, 10.0, 45.0, 70.0])
    points = np.column_stack([np.full(6, along), np.full(6, across), heights])
    T = temperature_at(state, points)
    assert T[0] == pytest.approx(state.tip_K, abs=0.5)
    assert T[1] == pytest.approx(T[0], abs=1.0)
    assert (np.diff(T[:5]) < 0).all()
    assert T[4] < T[3] - 10
    assert np.isnan(T[5])


def test_slices_through_the_tip_are_drawn(state):
    slices = temperature_slices(state)
    assert slices.temperature.dims == ("slice", "z", "place")
    assert slices.temperature.max().item() == pytest.approx(state.tip_K, abs=2.0)
    figure = draw(slices)
    titles = [axes.get_title(loc="center") for axes in figure.axes[:4]]
    assert titles == slices.slice.values.tolist()


def test_a_flat_lever_s_state_is_refused(lever):
    with pytest.raises(InputError, match="expected one of a SolidLever"):
        heat_by_region(lever.solve([1.0])[0])


def test_the_file_of_a_state_holds_lever_and_air(in_air, state, tmp_path):
    write_solid_vtu(state, tmp_path / "state.vtu")
    mesh = meshio.read(tmp_path / "state.vtu")
    region = mesh.cell_data["region"][0]
    assert set(region) == {-1, *range(7)}
    hottest = in_air.dataset([state]).max_K.item()
    assert mesh.point_data["temperature_K"].max() == pytest.approx(hottest, abs=2.0)
