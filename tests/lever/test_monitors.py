"""Temperature and potential where a probe's monitors are, in sweeps and in time, and in files."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from hotlever.errors import InputError
from hotlever.lever import Lever, probe_of, read_sweep, write_sweep
from hotlever.lever.fields import mapped_fields
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import pulse, simulate, write_history
from hotlever.lever.transient.reduced import reduced_in_time
from hotlever.probe import Probe
from of_materials import metal_film_probe

#: On the centre leg, across all legs, and the reader.
SPOT, ACROSS = {"point_um": [40.0, 1.0]}, {"line_um": [[20.0, -8.0], [20.0, 8.0]], "points": 5}
MONITORS = {"spot": SPOT, "across": ACROSS, "sensor": {"region": "reader"}}


@pytest.fixture(scope="module")
def monitored(coarse):
    return coarse.with_probe(coarse.probe.with_monitors(**MONITORS))


def test_a_sweep_shows_what_solved_states_do(monitored):
    bias = [0.0, 3.3, 7.1, 8.1]
    sweep, solved = monitored.sweep(bias), monitored.dataset(monitored.solve(bias))
    for name in ("spot", "across", "sensor"):
        np.testing.assert_allclose(sweep[f"{name}_K"], solved[f"{name}_K"], atol=0.02)
        np.testing.assert_allclose(sweep[f"{name}_V"], solved[f"{name}_V"], atol=1e-4)
    # between the legs there is no lever
    assert np.isnan(sweep.across_K).any(axis=0).values.tolist() == [False, True, False, True, False]
    assert (sweep.isel(bias=0).spot_K, sweep.isel(bias=0).spot_V) == (293.0, 0.0)
    assert sweep.across_K.sel(bias=8.1, across=8.0).item() == sweep.across_K.values[3, 2]
    assert sweep.sensor_K.attrs == {"units": "K", "long_name": "temperature mean over reader"}


def test_fields_that_are_written_are_those_monitored(coarse):
    lever = Lever(metal_film_probe(), COARSE)
    (state,) = lever.solve([0.5])
    [fields] = mapped_fields(lever, [state])
    number = {"metal": np.flatnonzero(np.isfinite(fields.potential))[7]}
    number["bare"] = np.flatnonzero(np.isnan(fields.potential))[5]
    # in the middle of a small triangle, away from borders
    monitors, expected = {}, {}
    for name, corner in number.items():
        (triangle,) = np.flatnonzero((fields.triangles == corner).any(axis=1))[:1]
        places = fields.points[fields.triangles[triangle]]
        monitors[name] = {"point_um": (0.999 * fields.points[corner] + 0.001 * places.mean(axis=0))}
        expected[name] = fields.temperature[corner], fields.potential[corner]
    monitors = {name: {"point_um": at["point_um"].tolist()} for name, at in monitors.items()}
    data = lever.with_probe(lever.probe.with_monitors(**monitors)).dataset([state])
    for name, (T, V) in expected.items():
        assert data[f"{name}_K"].item() == pytest.approx(T, abs=0.05)
        assert data[f"{name}_V"].item() == pytest.approx(V, abs=1e-4, nan_ok=True)


def test_a_pulse_shows_what_its_states_do(monitored):
    states = []
    at = [0.3, 2.0, 2.5, 9.0]
    history = simulate(monitored, pulse(9.0, 2.0), at=at, callback=lambda _, s: states.append(s))
    solved = monitored.dataset(states)
    for name in ("spot_K", "across_K", "sensor_K", "spot_V"):
        np.testing.assert_allclose(history[name], solved[name], atol=1e-6)
    assert history.across_K.dims == ("time", "across")


def test_a_lever_on_modes_shows_what_the_full_one_does(monitored):
    states, train, at = [], pulse(7.0, 1.0, 4.0, 2), np.linspace(0.2, 8.0, 40)
    full = simulate(monitored, train, at=at, callback=lambda _, s: states.append(s.x))
    on_modes = simulate(reduced_in_time(monitored, np.hstack(states)), train, at=at)
    for name in ("spot_K", "across_K", "sensor_K"):
        np.testing.assert_allclose(on_modes[name], full[name], atol=0.05)
    np.testing.assert_allclose(on_modes.spot_V, full.spot_V, atol=1e-3)


def test_files_have_the_columns_and_give_the_monitors_back(monitored, tmp_path):
    sweep = monitored.sweep([4.0])
    write_sweep(sweep, tmp_path / "a.csv")
    heads, row = (line.split(",")[8:] for line in (tmp_path / "a.csv").read_text().split())
    line = [f"across.{point}_{unit}" for unit in "KV" for point in range(5)]
    assert heads == ["spot_K", "spot_V", *line, "sensor_K", "sensor_V"]
    assert row[3] == ""
    assert float(row[2]) == pytest.approx(sweep.across_K.values[0, 0])
    write_sweep(sweep, tmp_path / "a.nc")
    read = read_sweep(tmp_path / "a.nc")
    assert probe_of(read) == monitored.probe
    xr.testing.assert_identical(read.across_K, sweep.across_K)
    history = simulate(monitored, pulse(9.0, 2.0), at=[1.0])
    write_history(history, tmp_path / "history.csv")
    assert (tmp_path / "history.csv").read_text().split()[0].split(",")[7:] == heads


def test_a_probe_file_states_them(tmp_path, coarse):
    path = tmp_path / "probe.toml"
    coarse.probe.with_monitors(**MONITORS).to_file(path)
    assert "[monitor.spot]\npoint_um = [40.0, 1.0]" in path.read_text(encoding="utf-8")
    again = Probe.from_file(path)
    assert list(again.monitors) == ["spot", "across", "sensor"]
    assert again.with_(n_d=4e17).monitors == again.monitors
    # other monitors, the same states
    assert coarse.with_probe(again).equations is coarse.equations


@pytest.mark.parametrize(
    ("monitor", "message"),
    [
        ({"point_um": [60, 1]}, r"\(60, 1\) µm lies off the lever.*the nearest is \(54.4, 1\)"),
        ({"line_um": [[1, 0], [20, 4]]}, r"\(20, 4\) µm .*the nearest is \(20, 3.22\)"),
        ({"region": "heatr"}, "did you mean 'heater'"),
        ({"poin_um": [1, 0]}, "did you mean 'point_um'"),
        ({"region": "heater", "points": 3}, "points go with line_um"),
        ({"region": "heater", "point_um": [1, 0]}, "expected one of point_um, line_um and region"),
        ({"point_um": [1]}, "point_um"),
    ],
)
def test_what_is_at_fault_is_told_in_a_line(monitor, message):
    with pytest.raises(InputError, match=message) as error:
        Probe.reference().with_monitors(here=monitor)
    assert str(error.value).startswith("monitors: here: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["tip", "reader", "a b", "time"])
def test_names_must_be_their_own(name):
    with pytest.raises(InputError, match=f"'{name}'"):
        Probe.reference().with_monitors(**{name: {"region": "heater"}})
