"""The reduced lever: the same equations on few modes and points."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from taylor import remainder_orders

from hotlever.cache import CACHE_VARIABLE, store_arrays, stored
from hotlever.errors import ComputationError
from hotlever.lever import Lever
from hotlever.lever.continuation import BranchFollower
from hotlever.lever.equations import LeverEquations
from hotlever.lever.reduced import ReducedSpace
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.lever.reduction import BOX, material_in_box
from hotlever.probe import MeshOptions, Probe

BIAS = np.linspace(1.0, 11.0, 13)


@pytest.fixture(scope="module")
def space(coarse):
    return cached_reduction(coarse)


def observed(equations, bias=BIAS):
    states = list(BranchFollower(equations).ramp(bias.tolist()))
    return states, np.array([equations.measured(state.x) for state in states]).T


@pytest.mark.parametrize("seed", range(6))
def test_reduced_lever_follows_the_full_one_in_its_box(coarse, space, seed):
    rng = np.random.default_rng(seed)
    material = material_in_box(coarse.probe.material, rng.random(len(BOX)))
    material = material.with_(c_kappa=rng.uniform(0.6, 0.76))
    full = coarse.with_material(material).sweep(BIAS)
    _, (current, reader, tip) = observed(LeverEquations(space, coarse.probe.circuit, material))
    # benchmarks/reduced.py states the accuracy over the whole box, on the default mesh
    np.testing.assert_allclose(current, full.current_mA, rtol=1e-4)
    np.testing.assert_allclose(reader, full.reader_V, rtol=2e-4)
    np.testing.assert_allclose(tip, full.tip_K, rtol=0, atol=0.1)


def test_few_points_with_positive_weights_integrate_the_area(coarse, space):
    weights = coarse.space.operators.weights
    assert 100 < space.few_points.points.size < weights.size / 3
    assert (space.few_points.weights > 0).all()
    assert len(set(space.few_points.points.tolist())) == space.few_points.points.size


def test_expanded_states_nearly_solve_the_full_equations(coarse, space):
    states, _ = observed(LeverEquations(space, coarse.probe.circuit, coarse.probe.material))
    polished = coarse.polish(space.expanded(state.x) for state in states)
    for state, exact in zip(states, polished.states, strict=True):
        assert exact.bias == state.bias
        guess = space.expanded(state.x)
        temperatures = coarse.space.is_temperature()
        assert np.abs((exact.x - guess)[temperatures]).max() < 0.5
        assert np.abs((exact.x - guess)[~temperatures]).max() < 2e-3


def test_reduced_jacobian_passes_a_taylor_test(coarse, space):
    equations = LeverEquations(space, coarse.probe.circuit, coarse.probe.material)
    x = observed(equations, np.array([8.4]))[0][0].x
    orders = remainder_orders(equations, x, seed=0, steps=(0.2, 0.1, 0.05))
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


def test_reduced_sensitivities_are_those_of_the_full_lever(coarse, space):
    equations = LeverEquations(space, coarse.probe.circuit, coarse.probe.material)
    states, _ = observed(equations, np.array([4.0, 7.5, 10.0]))
    reduced = np.stack([equations.sensitivities(state.x) for state in states], axis=1)
    full = coarse.sweep([4.0, 7.5, 10.0], sensitivities=True).sensitivity.values
    largest = np.abs(full).max(axis=1, keepdims=True)
    np.testing.assert_allclose(reduced / largest, full / largest, atol=5e-3)


def test_reduced_lever_passes_folds_like_the_full_one(coarse, space):
    circuit = coarse.probe.circuit.with_(series_resistance_ohm=0.0)
    follower = BranchFollower(LeverEquations(space, circuit, coarse.probe.material))
    for _ in follower.follow_arc(lambda _: not follower.folds):
        pass
    knee = coarse.knee()
    assert follower.folds[0].bias == pytest.approx(knee.lever_V.item(), rel=1e-4)
    assert follower.folds[0].tip == pytest.approx(knee.tip_K.item(), abs=1.0)


def test_another_base_temperature_is_refused(coarse, space):
    circuit = coarse.probe.circuit.with_(base_temperature_K=300.0)
    with pytest.raises(ComputationError, match="base temperature of 293 K, not 300 K"):
        LeverEquations(space, circuit, coarse.probe.material).start()


def test_a_lever_without_reader_reduces_too():
    lever = Lever(Probe.u_shape(), MeshOptions(refinement=0.4))
    equations = LeverEquations(cached_reduction(lever), lever.probe.circuit, lever.probe.material)
    _, (current, reader, tip) = observed(equations)
    full = lever.sweep(BIAS)
    assert np.isnan(reader).all()
    np.testing.assert_allclose(current, full.current_mA, rtol=2e-4)
    np.testing.assert_allclose(tip, full.tip_K, rtol=0, atol=0.2)


# --- the cache ----------------------------------------------------------------------------------


def test_a_geometry_is_reduced_once(coarse, space, cache, monkeypatch):
    def never(*_):
        raise AssertionError("reduced again")

    monkeypatch.setattr("hotlever.lever.reduced_cache.reduce", never)
    again = cached_reduction(coarse)
    np.testing.assert_array_equal(again.few_points.points, space.few_points.points)
    np.testing.assert_array_equal(again.basis, space.basis)


@pytest.mark.parametrize("damage", [b"", b"not a zip file", None], ids=["empty", "text", "cut"])
def test_a_damaged_file_is_made_anew(coarse, space, tmp_path, monkeypatch, damage):
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    monkeypatch.setattr("hotlever.lever.reduced_cache.reduce", lambda *_: space)
    cached_reduction(coarse)
    (file,) = (tmp_path / "reduced").iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2] if damage is None else damage)
    np.testing.assert_array_equal(
        cached_reduction(coarse).few_points.points, space.few_points.points
    )
    assert file.read_bytes() == whole


def test_the_cache_can_be_switched_off_or_be_unwritable(coarse, space, tmp_path, monkeypatch):
    monkeypatch.setattr("hotlever.lever.reduced_cache.reduce", lambda *_: space)
    monkeypatch.setenv(CACHE_VARIABLE, "")
    assert cached_reduction(coarse) is space
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "file" / "below"))
    assert cached_reduction(coarse) is space


def test_other_geometries_have_other_files(coarse, space, tmp_path, monkeypatch):
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    monkeypatch.setattr("hotlever.lever.reduced_cache.reduce", lambda *_: space)
    cached_reduction(coarse)
    wider = Lever(coarse.probe.with_values({"gap_um": 3.3}), MeshOptions(refinement=0.4))
    cached_reduction(wider)
    warmer = Lever(coarse.probe.with_values({"base_temperature_K": 300.0}), space=coarse.space)
    cached_reduction(warmer)
    assert len(list((tmp_path / "reduced").iterdir())) == 3


def write_many_times(arguments):
    folder, count = arguments
    lever = Lever(Probe.reference(), MeshOptions(refinement=0.4))
    path = folder / "one.npz"
    space = None
    for _ in range(count):
        space = stored(path, lambda a: ReducedSpace.from_arrays(lever, a)) or space
        if space is not None:
            store_arrays(path, space.arrays())
    return space is not None


def test_two_processes_may_write_the_same_file(coarse, space, tmp_path):
    store_arrays(tmp_path / "one.npz", space.arrays())
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert all(pool.map(write_many_times, [(tmp_path, 20)] * 2))
    loaded = stored(tmp_path / "one.npz", lambda a: ReducedSpace.from_arrays(coarse, a))
    assert loaded is not None
    assert [path.name for path in tmp_path.iterdir()] == ["one.npz"]
