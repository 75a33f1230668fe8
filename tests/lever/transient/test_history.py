"""Levers in time: published numbers, the state at rest, where the heat goes, how it ends."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from hotlever import Lever, Probe
from hotlever.errors import HistoryEndError, InputError
from hotlever.lever import probe_of
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import pulse, ramp, simulate, sine, step, write_history
from hotlever.lever.transient.history import TIME_COLUMNS
from of_materials import metal_film_probe, metal_film_sections


def imbalance(data: xr.Dataset) -> float:
    """Heat that is neither stored nor lost, over all that was supplied."""
    stored = data.stored_nJ + data.air_stored_nJ
    stored_and_lost = stored - float(stored[0]) + data.lost_nJ
    return float(np.abs(data.supplied_nJ - stored_and_lost).max() / np.abs(data.supplied_nJ).max())


@pytest.fixture(scope="module")
def golden(lever):
    return simulate(lever, step(4.0), at=[0.1, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0])


def test_a_step_is_that_of_an_independent_trial(golden):
    """Another code on two other meshes, with errors of 0.2 K and 1e-4 mA."""
    tip = [296.9, 300.8, 303.0, 307.6, 313.3, 321.3, 331.9, 335.7, 336.3]
    current = [0.5774, 0.5769, 0.5766, 0.5759, 0.5750, 0.5738, 0.5720, 0.5714, 0.5713]
    np.testing.assert_allclose(golden.tip_K, tip, rtol=0, atol=0.2)
    np.testing.assert_allclose(golden.current_mA, current, rtol=0, atol=2e-4)


def test_a_step_to_the_knee_takes_long(lever):
    """The same trial, to three digits; and IDA on our mesh (benchmarks/history.py ida), to five."""
    found = simulate(lever, step(8.268), at=[5.0, 10.0, 100.0, 200.0], tolerance_K=0.01)
    np.testing.assert_allclose(found.tip_K, [365.0, 397.0, 714.0, 864.0], rtol=4e-3)
    np.testing.assert_allclose(found.tip_K, [364.735, 397.552, 715.883, 865.889], atol=0.05)


def test_a_step_to_the_knee_ends_in_the_state_at_rest(coarse):
    found = simulate(coarse, step(8.268), at=[20000.0], tolerance_K=1e-3)
    (rest,) = coarse.solve([8.268])
    assert found.tip_K.item() - 293.0 == pytest.approx(rest.tip_K - 293.0, rel=1e-6)
    assert found.current_mA.item() == pytest.approx(rest.current_mA, rel=1e-6)
    assert found.reader_V.item() == pytest.approx(rest.reader_V, rel=1e-6)


@pytest.mark.parametrize(
    "waveform",
    [
        pulse(10.0, 5.0, 20.0, 3),
        ramp(8.0, 50.0),
        sine(3.0, 0.5, 20e3),
        sine(0.0, 4.0, 20e3),
    ],
    ids=lambda waveform: waveform.text,
)
def test_heat_that_is_supplied_is_stored_or_lost(coarse, waveform):
    data = simulate(coarse, waveform, 100.0)
    assert imbalance(data) < 1e-6
    # what is stored is what the temperatures say, and no other time is reported twice
    assert float(data.stored_nJ.min()) > -1e-9
    assert (np.diff(data.time) > 0).all()
    assert float(np.abs(data.power_mW - data.lever_V * data.current_mA).max()) < 1e-12


@pytest.mark.parametrize("resistance", [0.0, 100.0, 1e5])
def test_the_bias_drives_the_current_through_any_resistor(coarse, resistance):
    lever = coarse.with_probe(coarse.probe.with_(series_resistance_ohm=resistance))
    data = simulate(lever, pulse(1.5, 5.0), 20.0)
    bias = lever.circuit.bias(data.lever_V, data.current_mA)
    np.testing.assert_allclose(bias, data.bias_V, atol=1e-5)
    assert imbalance(data) < 1e-6
    assert data.sizes["time"] > 10  # resolved, however weak


@pytest.fixture(scope="module", params=["air", "tip", "u-shape"])
def other(request, in_air):
    if request.param == "air":
        return in_air
    probe = Probe.reference()
    if request.param == "tip":
        return Lever(probe.with_(**{"tip.height_um": 0.5}), COARSE)
    return Lever(Probe.u_shape(), COARSE)


def test_every_lever_can_be_followed(other):
    # the air far away takes a tenth of a second to get warm
    data = simulate(other, step(3.0), 3000.0 if other.medium == "vacuum" else 3e5)
    (rest,) = other.solve([3.0])
    assert data.tip_K.values[-1] == pytest.approx(rest.tip_K, abs=1e-3)
    assert imbalance(data) < 1e-6
    assert (np.diff(data.tip_K) > -1e-6).all()
    assert bool((data.air_stored_nJ > 0).any()) == (other.medium == "air")
    assert not data.notes


def test_between_the_steps_it_is_as_accurate(coarse):
    times = np.geomspace(0.01, 300.0, 40)
    rough, fine = (simulate(coarse, step(6.0), at=times, tolerance_K=tol) for tol in (0.1, 1e-3))
    np.testing.assert_allclose(rough.tip_K, fine.tip_K, atol=0.1)
    np.testing.assert_allclose(rough.current_mA, fine.current_mA, rtol=1e-4)
    np.testing.assert_allclose(rough.stored_nJ, fine.stored_nJ, rtol=1e-3, atol=1e-3)


def test_after_a_pulse_nothing_flows(coarse):
    data = simulate(coarse, pulse(5.0, 1.0), at=[0.5, 1.5, 3.0])
    assert data.tip_K.values[-1] > 294.0
    for name in ("current_mA", "lever_V", "reader_V", "power_mW"):
        assert data[name].values[0] > 0.01
        assert not data[name].values[1:].any(), name


def test_the_other_polarity_heats_alike(coarse):
    there, back = (simulate(coarse, step(bias), at=[10.0]) for bias in (5.0, -5.0))
    assert back.tip_K.item() == pytest.approx(there.tip_K.item(), abs=1e-6)
    assert back.current_mA.item() == pytest.approx(-there.current_mA.item(), rel=1e-9)


def test_a_lever_without_resistor_runs_away_beyond_its_fold(coarse):
    lever = coarse.with_probe(coarse.probe.with_(series_resistance_ohm=0.0))
    fold = lever.knee().lever_V.item()
    below = simulate(lever, step(0.99 * fold), 3000.0)
    assert float(below.max_K.max()) < 950.0
    with pytest.raises(HistoryEndError, match="silicon melts after") as ended:
        simulate(lever, step(1.03 * fold), 3000.0)
    data = ended.value.partial
    assert data.max_K.values[-1] == pytest.approx(1687.0, abs=0.1)
    assert data.time.values[-1] == ended.value.time_reached
    assert "1300 K" in data.attrs["notes"]
    assert imbalance(data) < 1e-4


def test_times_asked_for_are_those_returned(coarse):
    data = simulate(coarse, pulse(8.0, 5.0), at=[7.0, 0.0, 5.0])
    assert data.time.values.tolist() == [0.0, 5.0, 7.0]
    # at the end of the pulse it is still on
    assert data.bias_V.values.tolist() == [8.0, 8.0, 0.0]
    seen = []
    simulate(
        coarse, pulse(8.0, 5.0), at=[5.0, 7.0], callback=lambda t, state: seen.append((t, state))
    )
    assert [t for t, _ in seen] == [5.0, 7.0]
    for row, (_, state) in enumerate(seen, start=1):
        assert state.tip_K == pytest.approx(float(data.tip_K[row]), abs=1e-9)
        assert state.bias_V == pytest.approx(float(data.bias_V[row]), abs=1e-3)


@pytest.mark.parametrize(
    "wrong",
    [
        {"until": -1.0},
        {"until": np.nan},
        {"at": [-1.0, 2.0]},
        {"at": [0.0]},
        {"at": []},
        {"until": 1.0, "at": [2.0]},
        {"tolerance_K": 0.0},
    ],
    ids=str,
)
def test_times_that_make_no_sense_are_refused(coarse, wrong):
    with pytest.raises(InputError, match="found"):
        simulate(coarse, step(1.0), **wrong)


def test_a_history_is_written_and_read_again(golden, tmp_path):
    write_history(golden, tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0] == "time_us,bias_V,current_mA,lever_V,reader_V,tip_K,power_mW"
    assert len(lines) == 10
    write_history(golden, tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc") as found:
        xr.testing.assert_equal(found.load(), golden)
        assert probe_of(found) == Probe.reference()
        assert found.attrs["waveform"] == "step to 4 V"
        assert all("units" in found[name].attrs for name in (*TIME_COLUMNS, "lost_nJ", "time"))
    with pytest.raises(InputError, match=r"\.csv or \.nc"):
        write_history(golden, tmp_path / "a.txt")


def test_a_lever_of_a_metal_film_on_a_dielectric_has_the_heat_of_both():
    lever = Lever(metal_film_probe(), COARSE)
    found = simulate(lever, step(0.5), at=[1.0, 1e5], tolerance_K=1e-3)
    # over some thousand time constants
    assert imbalance(found) < 1e-5
    (rest,) = lever.solve([0.5])
    assert found.tip_K.values[-1] - 293.0 == pytest.approx(rest.tip_K - 293.0, rel=1e-5)
    # 0.4 µm of nitride and, on it, 0.05 µm of palladium
    density, by_T = lever.equations.laws.heat_density(np.full((len(lever.space.weights), 1), 294.0))
    assert {0.4 * 2.1e-3, 0.4 * 2.1e-3 + 0.05 * 2.93e-3} == set(by_T.ravel().round(9))
    np.testing.assert_allclose(density, by_T)


def test_a_material_without_a_heat_capacity_cannot_be_followed():
    film = {"kind": "metal-film", "resistivity": 2e-5, "tcr": 2e-3}
    materials = {**metal_film_sections()["materials"], "film": film}
    lever = Lever(metal_film_probe(materials=materials), COARSE)
    with pytest.raises(InputError, match="a metal-film without heat_capacity"):
        simulate(lever, step(1.0), at=[1.0])
