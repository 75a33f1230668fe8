"""The reduced lever: the same equations on few modes and points."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from experiments import reduced_experiment
from hotlever.cache import CACHE_VARIABLE, store_arrays, stored
from hotlever.estimate import Measurement, fit
from hotlever.lever import Lever
from hotlever.lever.branch import Reach, branch_end
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced_lever import ReducedLever, cached_reduction
from hotlever.lever.response_surface import ParameterDomain
from hotlever.probe import Probe
from hotlever.quantities import observables_of

BIAS = np.linspace(0.0, 11.0, 12)


def predicted(reduced, lever, material, bias=BIAS):
    """What the reduced lever alone shows, and its derivatives."""
    model = reduced_experiment(lever, reduced, bias)
    return model.predict(lever.with_material(material).probe)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("medium", ["vacuum", "air"])
def test_it_follows_the_full_lever_in_its_domain(request, medium, seed):
    """benchmarks/reduced.py states the accuracy over the whole domain, on the default mesh."""
    names = ("coarse", "reduced") if medium == "vacuum" else ("in_air", "reduced_in_air")
    lever, reduced = map(request.getfixturevalue, names)
    rng = np.random.default_rng(seed)
    domain = ParameterDomain.of(lever.probe)
    material = domain.probe(lever.probe, rng.random(len(domain.names))).material
    material = material.with_(c_kappa=rng.uniform(0.6, 0.76))
    full = lever.with_material(material).sweep(BIAS, sensitivities=seed == 0)
    found = predicted(reduced, lever, material)
    np.testing.assert_allclose(found.values[:2], observables_of(full)[:2], rtol=5e-5, atol=1e-12)
    np.testing.assert_allclose(found.values[2], full.tip_K, rtol=0, atol=0.05)
    if seed == 0:
        slopes = full.sensitivity.values
        largest = np.abs(slopes).max(axis=1, keepdims=True)
        np.testing.assert_allclose(found.slopes / largest, slopes / largest, atol=1e-2)


@pytest.mark.parametrize("seed", range(2))
def test_at_the_few_points_alone_it_is_nearly_as_good(coarse, reduced, seed):
    domain = ParameterDomain.of(coarse.probe)
    shares = np.random.default_rng(seed).random(len(domain.names))
    full = coarse.with_probe(domain.probe(coarse.probe, shares))
    branch = reduced.branch(full.probe, Reach(full.circuit, BIAS[-1]))
    u = branch.read(full.circuit, BIAS).u
    sweep = full.sweep(BIAS)
    np.testing.assert_allclose(
        branch.electrical_outputs(u)["current_mA"], sweep.current_mA, rtol=1e-3
    )
    np.testing.assert_allclose(branch.base_temperature_K + u**2, sweep.tip_K, rtol=0, atol=0.5)
    assert branch.knee.tip_K == pytest.approx(full.branch_past_knee().knee.tip_K, abs=0.5)


def test_corrected_by_the_full_lever_it_is_exact_to_first_order(coarse, reduced):
    """Beside the domain, where it is wrong by more than it should be."""
    shares = np.array([1.3, 0.5, -0.2, 1.2, 0.5])
    material = ParameterDomain.of(coarse.probe).probe(coarse.probe, shares).material
    model, probe = (
        reduced_experiment(coarse, reduced, BIAS),
        coarse.with_material(material).probe,
    )
    first = model.predict(probe)
    exact = observables_of(coarse.with_material(material).sweep(BIAS))
    better = model.confirmed(first)
    again = better.predict(probe, first)
    size = np.abs(exact).max(axis=1, keepdims=True)
    before, after = (np.abs(one.values - exact) / size for one in (first, again))
    # it has no bridge
    assert np.nanmax(after) < 0.3 * np.nanmax(before)
    # nothing of this has changed the model that was corrected
    np.testing.assert_array_equal(model.predict(probe).values, first.values)
    near = probe.with_(n_d=material.n_d * 1.01)
    exact_nearby = observables_of(coarse.with_probe(near).sweep(BIAS))
    away = np.abs(better.predict(near).values - exact_nearby) / size
    assert np.nanmax(away) < 0.5 * np.nanmax(before)


def test_few_points_with_positive_weights_integrate_the_area(coarse, reduced):
    assert 100 < reduced.points.size < coarse.space.weights.size / 2
    assert (reduced.hyper_reduced.weights > 0).all()
    assert len(set(reduced.points.tolist())) == reduced.points.size


def test_full_states_are_expanded_and_found_again(coarse, reduced):
    states = coarse.branch(900.0).x[:, 4:8]
    coordinates = reduced.space.coordinates(states)
    back = reduced.space.expanded(coordinates)
    hot = coarse.space.is_temperature
    assert np.abs(back - states)[hot].max() < 0.05
    assert np.abs(back - states)[~hot].max() < 1e-3
    np.testing.assert_allclose(reduced.space.coordinates(back), coordinates, atol=1e-9)


@pytest.mark.slow
def test_a_fit_of_data_taken_in_air_finds_the_material(in_air):
    truth = in_air.probe.material.with_(n_d=5.2e17, c_kappa=0.66, delta=0.7)
    data = in_air.with_material(truth).sweep(BIAS)
    rng = np.random.default_rng(1)
    exact = Measurement.of_sweep(data)
    noisy = {
        "current_mA": exact.current_mA + rng.normal(0, 2e-4, BIAS.size),
        "reader_V": exact.reader_V + rng.normal(0, 2e-4, BIAS.size),
        "tip_K": exact.tip_K + rng.normal(0, 2.0, BIAS.size),
    }
    measured = Measurement(**{**vars(exact), **noisy})
    vacuum = in_air.probe.in_medium("vacuum")
    result = fit(measured, vacuum)
    assert result.probe.surroundings.medium == "air"
    assert "medium: the data file's air is used, not the probe's vacuum" in result.notes
    for name in ("c_kappa", "n_d", "delta"):
        fitted = result.parameters[name]
        assert abs(fitted.value - getattr(truth, name)) < 4 * fitted.stderr
        assert fitted.stderr < 0.1 * fitted.value


# --- the cache ----------------------------------------------------------------------------------


def test_a_geometry_is_reduced_once(coarse, reduced, cache, monkeypatch):
    def never(*_):
        raise AssertionError("reduced again")

    monkeypatch.setattr("hotlever.lever.reduced_lever.reduce", never)
    again = cached_reduction(coarse)
    np.testing.assert_array_equal(again.points, reduced.points)
    np.testing.assert_array_equal(again.space.modes, reduced.space.modes)


@pytest.mark.parametrize("damage", [b"", b"not a zip file", None], ids=["empty", "text", "cut"])
def test_a_damaged_file_is_made_anew(coarse, reduced, tmp_path, monkeypatch, damage):
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    monkeypatch.setattr("hotlever.lever.reduced_lever.reduce", lambda *_: reduced)
    cached_reduction(coarse)
    (file,) = (tmp_path / "reduced").iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2] if damage is None else damage)
    np.testing.assert_array_equal(cached_reduction(coarse).points, reduced.points)
    assert file.read_bytes() == whole


def test_the_cache_can_be_switched_off_or_be_unwritable(coarse, reduced, tmp_path, monkeypatch):
    monkeypatch.setattr("hotlever.lever.reduced_lever.reduce", lambda *_: reduced)
    monkeypatch.setenv(CACHE_VARIABLE, "")
    assert cached_reduction(coarse) is reduced
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "file" / "below"))
    assert cached_reduction(coarse) is reduced


def test_other_geometries_have_other_files(coarse, reduced, tmp_path, monkeypatch):
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    monkeypatch.setattr("hotlever.lever.reduced_lever.reduce", lambda *_: reduced)
    cached_reduction(coarse)
    wider = Lever(coarse.probe.with_(gap_um=3.3), COARSE)
    cached_reduction(wider)
    warmer = coarse.with_probe(coarse.probe.with_(base_temperature_K=300.0))
    cached_reduction(warmer)
    assert len(list((tmp_path / "reduced").iterdir())) == 3


def write_many_times(arguments):
    folder, count = arguments
    lever = Lever(Probe.reference(), COARSE)
    path, domain = folder / "one.npz", ParameterDomain.of(lever.probe)
    space = None
    for _ in range(count):
        found = stored(path, lambda a: ReducedLever.from_arrays(lever, domain, a))
        space = found or space
        if space is not None:
            store_arrays(path, space.arrays())
    return space is not None


def test_two_processes_may_write_the_same_file(coarse, reduced, tmp_path):
    store_arrays(tmp_path / "one.npz", reduced.arrays())
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert all(pool.map(write_many_times, [(tmp_path, 8)] * 2))
    domain = ParameterDomain.of(coarse.probe)
    loaded = stored(
        tmp_path / "one.npz",
        lambda a: ReducedLever.from_arrays(coarse, domain, a),
    )
    assert loaded is not None
    assert [path.name for path in tmp_path.iterdir()] == ["one.npz"]


def test_where_a_reduced_lever_ends_is_not_said_of_the_lever(coarse, reduced):
    """The reference probe melts at 13.2 V; the reduced lever was made for less."""
    circuit = coarse.circuit
    branch = reduced.branch(coarse.probe, Reach(circuit, 13.0))
    reading = branch.read(circuit, np.array([13.0]))
    assert np.isnan(reading.u).all()
    text = str(branch_end(branch, reading))
    assert text.startswith("the reduced lever ends at a bias of 12.2")
    assert "no steady state" not in text
    # nor is it where a branch was not followed further
    short = coarse.with_probe(coarse.probe).branch(1000.0)
    assert "no steady state" not in str(branch_end(short, short.read(circuit, np.array([13.0]))))
