"""Sweeps as files: CSV, NetCDF, VTU."""

from __future__ import annotations

import json

import meshio
import numpy as np
import pytest
import xarray as xr

from hotlever.datasets import csv_text, frame_text, labelled
from hotlever.errors import InputError
from hotlever.lever import probe_of, read_sweep, write_sweep
from hotlever.lever.dataset import circuit_of
from hotlever.lever.fields import heater_profile, mapped_fields, write_vtu
from hotlever.materials.silicon import inversion_temperature

HEADER = "bias_V,current_mA,lever_V,reader_V,tip_K,power_mW,heater_ohm,legs_ohm"


@pytest.fixture(scope="module")
def sweep(coarse):
    return coarse.sweep([1.0, 8.0])


def test_csv_has_the_columns_of_the_contract(sweep, tmp_path):
    write_sweep(sweep, tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0] == HEADER
    assert len(lines) == 3
    row = dict(zip(HEADER.split(","), map(float, lines[2].split(",")), strict=True))
    assert row["power_mW"] == pytest.approx(row["lever_V"] * row["current_mA"])
    assert row["tip_K"] == pytest.approx(sweep.tip_K.values[1], rel=1e-9)


def test_netcdf_round_trip_keeps_units_and_the_probe(sweep, coarse, tmp_path):
    write_sweep(sweep, tmp_path / "a.nc")
    back = read_sweep(tmp_path / "a.nc")
    xr.testing.assert_identical(back, sweep)
    assert probe_of(back) == coarse.probe
    for name in HEADER.split(","):
        assert back[name].dims == ("bias",)
        assert {"units", "long_name"} <= set(back[name].attrs)
    assert json.loads(back.attrs["material"])["c_kappa"] == 0.686
    assert back.attrs["software"].startswith("hotlever ")


def test_what_is_no_finite_number_is_an_empty_cell():
    columns = {"bias_V": [1.0, np.nan], "tip_K": [np.inf, 300.0]}
    assert csv_text(labelled(columns), list(columns)) == "bias_V,tip_K\n1,\n,300\n"
    assert frame_text(labelled(columns).to_dataframe(), index=False) == (
        "bias_V,tip_K\n1.0,\n,300.0\n"
    )


def test_a_damaged_file_gives_the_same_numbers_or_none(sweep, tmp_path):
    path, rng = tmp_path / "a.nc", np.random.default_rng(2)
    write_sweep(sweep, path)
    raw, numbers = path.read_bytes(), sweep.tip_K.values.tobytes()
    inside = raw.index(numbers)
    for place in [*range(inside, inside + 16), *rng.integers(len(raw), size=40).tolist()]:
        path.write_bytes(raw[:place] + bytes([raw[place] ^ 0x10]) + raw[place + 1 :])
        try:
            found = read_sweep(path)
        except InputError:
            continue
        assert not inside <= place < inside + len(numbers)
        for name in HEADER.split(","):
            np.testing.assert_array_equal(found[name].values, sweep[name].values)


def test_numbers_that_became_none_are_damage(sweep, tmp_path):
    """As where an address in a file is damaged: what stands there counts as never written."""
    path = tmp_path / "a.nc"
    write_sweep(sweep, path)
    with xr.open_dataset(path) as data:
        lost = data.load()
    lost["current_mA"][:] = np.nan
    lost.to_netcdf(path)
    with pytest.raises(InputError, match=r"a\.nc: the file is damaged"):
        read_sweep(path)


def test_what_is_no_sweep_is_refused(tmp_path):
    (tmp_path / "text.nc").write_text("hello")
    with pytest.raises(InputError, match="not a NetCDF file"):
        read_sweep(tmp_path / "text.nc")
    with pytest.raises(InputError, match="no such file"):
        read_sweep(tmp_path / "none.nc")
    xr.Dataset({"x": ("a", [1.0])}).to_netcdf(tmp_path / "other.nc")
    with pytest.raises(InputError, match="variable 'bias_V' is missing"):
        read_sweep(tmp_path / "other.nc")


@pytest.mark.parametrize("text", [None, "{", "3", 5.0])
def test_a_sweep_that_does_not_say_its_circuit_is_not_taken_for_one_in_the_usual(sweep, text):
    attributes = {name: value for name, value in sweep.attrs.items() if name != "circuit"}
    other = sweep.copy()
    other.attrs = attributes if text is None else {**attributes, "circuit": text}
    for ask in (probe_of, circuit_of):
        with pytest.raises(InputError, match=r"\[circuit\] is missing or damaged"):
            ask(other)


def test_vtu_holds_the_fields(coarse, tmp_path):
    (state,) = coarse.solve([8.3])
    [fields] = mapped_fields(coarse, [state])
    write_vtu(fields, tmp_path / "a.vtu")
    mesh = meshio.read(tmp_path / "a.vtu")
    seen = coarse.dataset([state]).isel(bias=0)
    assert mesh.point_data["temperature_K"].max() == pytest.approx(seen.max_K.item(), abs=1.0)
    assert mesh.point_data["potential_V"].max() == pytest.approx(state.lever_V)
    # the current through the middle of the centre leg: density times cross-section
    centre = mesh.points[mesh.cells_dict["triangle"]].mean(axis=1)
    leg = (np.abs(centre[:, 0] - 20) < 4) & (np.abs(centre[:, 1]) < 3.2)
    density = mesh.cell_data["current_density_mA_um2"][0][leg, 0]
    np.testing.assert_allclose(density * 6.44 * 0.4, state.current_mA, rtol=0.01)


def test_heater_profile_spans_the_heater(coarse):
    (state,) = coarse.solve([8.3])
    profile = heater_profile(state, count=41)
    material = coarse.probe.material
    assert profile.position.values[[0, -1]] == pytest.approx([-2, 2])
    middle = profile.isel(position=20)
    assert middle.temperature.item() == pytest.approx(state.tip_K)
    assert middle.doping.item() == pytest.approx(material.n_d, rel=0.02)
    assert middle.inversion_temperature.item() == pytest.approx(
        inversion_temperature(material.n_d, material.p), abs=1.5
    )
    # at the knee the middle is inverted, the ends are not (paper's Fig. 7b)
    assert profile.resistivity_slope.values[20] < 0 < profile.resistivity_slope.values[0]
