"""Workbooks, HDF5 and MATLAB files are read as the tables that they hold."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy.io import savemat

from hotlever import InputError, read_measurement
from hotlever.measurement import file_groups

BIAS = np.array([0.1, 1.0, 2.0 / 3.0, 8.25])
CURRENT = BIAS / 7e3


def workbook(path, **sheets):
    """Write sheets of rows."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


def rows(scale=1.0):
    """Return comments, headings and rows of a sheet."""
    values = zip(BIAS.tolist(), (1e6 * scale * CURRENT).tolist(), strict=True)
    return [["R_s (kOhm): 5.6"], [], ["V_b (V)", "I_h (uA)", "remark"], *map(list, values)]


# --- workbooks ------------------------------------------------------------------------------------


def test_the_sheet_of_a_workbook_with_numbers_is_a_table(tmp_path):
    path = workbook(tmp_path / "iv.xlsx", notes=[["measured on a Friday"]], sweep=rows())
    data = read_measurement(path)
    assert data.bias_V.tolist() == BIAS.tolist()
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT, rtol=1e-15)
    assert data.series_resistance_ohm == 5600.0


def test_of_several_sheets_one_is_asked_for(tmp_path):
    path = workbook(tmp_path / "iv.xlsx", up=rows(), down=rows(1.3))
    assert file_groups(path) == ["up", "down"]
    with pytest.raises(InputError, match=r"2 groups, .*'up', 'down'; .*--column 'group=up'"):
        read_measurement(path)
    data = read_measurement(path, {"group": "down"})
    np.testing.assert_allclose(data.current_mA, 1.3e3 * CURRENT, rtol=1e-15)


def test_a_formula_that_nobody_has_calculated_is_an_error(tmp_path):
    path = workbook(tmp_path / "iv.xlsx", sweep=[*rows(), ["=A4*2", 1.0]])
    with pytest.raises(InputError, match=r"'sweep', row 8, column 1: a formula without its value"):
        read_measurement(path)


def test_an_empty_cell_is_no_value(tmp_path):
    path = workbook(tmp_path / "iv.xlsx", sweep=[*rows(), [9.0, None], [10.0, "OVERFLOW"]])
    data = read_measurement(path)
    assert data.bias_V[-2:].tolist() == [9.0, 10.0]
    assert np.isnan(data.current_mA[-2:]).all()


# --- HDF5 -----------------------------------------------------------------------------------------


def hdf5(path, **groups):
    """Write groups of datasets with units, and attributes."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.attrs["R_s (kOhm)"] = 5.6
        for name, datasets in groups.items():
            group = file if name == "root" else file.create_group(name)
            for key, (values, unit) in datasets.items():
                group[key] = values
                group[key].attrs["units"] = unit
    return path


def sweep(scale=1.0):
    """Return datasets of a sweep."""
    return {"V_b": (BIAS, "V"), "I_h": (scale * CURRENT, "A")}


def test_datasets_are_columns_with_their_units(tmp_path):
    picture = {"camera": (np.zeros((80, 90)), ""), "counts": (np.arange(4), "1")}
    data = read_measurement(hdf5(tmp_path / "iv.h5", root=sweep() | picture))
    assert data.bias_V.tolist() == BIAS.tolist()
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT, rtol=1e-15)
    assert data.series_resistance_ohm == 5600.0


def test_groups_of_datasets_are_measurements_of_their_own(tmp_path):
    path = hdf5(tmp_path / "iv.hdf5", up=sweep(), down=sweep(1.3))
    assert file_groups(path) == ["/down", "/up"]
    with pytest.raises(InputError, match="--column 'group=/down'"):
        read_measurement(path)
    data = read_measurement(path, {"group": "/down"})
    np.testing.assert_allclose(data.current_mA, 1.3e3 * CURRENT, rtol=1e-15)
    assert data.series_resistance_ohm == 5600.0


def test_columns_of_other_lengths_are_other_tables(tmp_path):
    other = {"V_b": (BIAS[:2], "V"), "T_tip": (BIAS[:2], "K")}
    path = hdf5(tmp_path / "iv.h5", root=sweep() | {"T_stage": (np.ones(3), "K")})
    assert file_groups(path) == ["/ (4 rows)", "/ (3 rows)"]
    path = hdf5(tmp_path / "two.h5", root=sweep(), spectra=other)
    assert file_groups(path) == ["/", "/spectra"]


def test_a_dataset_exported_by_xarray_is_read(tmp_path):
    """So QCoDeS exports its own: netCDF-4, which is HDF5."""
    xr = pytest.importorskip("xarray")
    pytest.importorskip("h5py")
    columns = {"I_h": ("V_b", CURRENT, {"units": "A"})}
    data = xr.Dataset(columns, {"V_b": ("V_b", BIAS, {"units": "V"})}, {"R_s (kOhm)": 5.6})
    data.to_netcdf(tmp_path / "qcodes.nc")
    measured = read_measurement(tmp_path / "qcodes.nc")
    assert measured.bias_V.tolist() == BIAS.tolist()
    np.testing.assert_allclose(measured.current_mA, 1e3 * CURRENT, rtol=1e-15)
    assert measured.series_resistance_ohm == 5600.0


# --- MATLAB ---------------------------------------------------------------------------------------


def test_variables_are_columns(tmp_path):
    content = {"V_b": BIAS, "I_h": 1e3 * CURRENT[:, None], "operator": "Zoë", "number": 7}
    savemat(tmp_path / "iv.mat", content)
    path = tmp_path / "iv.mat"
    data = read_measurement(path, {"V_b (V)": "V_b", "I_h (mA)": "I_h"})
    assert data.bias_V.tolist() == BIAS.tolist()
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT, rtol=1e-15)


def test_structures_are_tables_and_a_matrix_is_columns(tmp_path):
    matrix = np.stack([BIAS, 1e3 * CURRENT], axis=1)
    savemat(tmp_path / "iv.mat", {"up": {"data": matrix}, "down": {"data": 1.3 * matrix}})
    path = tmp_path / "iv.mat"
    assert file_groups(path) == ["/up", "/down"]
    columns = {"group": "/up", "V_b (V)": "data 1", "I_h (mA)": "data 2"}
    data = read_measurement(path, columns)
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT, rtol=1e-15)


def test_a_matlab_file_of_version_7_3_is_read(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "iv.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("V_b", BIAS), ("I_h", 1e3 * CURRENT)):
            file[name] = values[None]
            file[name].attrs["MATLAB_class"] = b"double"
        file["operator"] = np.array([[ord(letter)] for letter in "Zoë"], dtype=np.uint16)
        file["operator"].attrs["MATLAB_class"] = b"char"
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    data = read_measurement(path, {"V_b (V)": "V_b", "I_h (mA)": "I_h"})
    assert data.bias_V.tolist() == BIAS.tolist()


# --- what cannot be read --------------------------------------------------------------------------


def test_a_damaged_file_is_one_line(tmp_path):
    whole = [
        workbook(tmp_path / "iv.xlsx", sweep=rows()),
        hdf5(tmp_path / "iv.h5", root=sweep()),
        tmp_path / "iv.mat",
    ]
    savemat(whole[2], {"V_b": BIAS, "I_h": CURRENT})
    for path in whole:
        raw = path.read_bytes()
        for end in (130, 600, len(raw) - 40):
            path.write_bytes(raw[:end])
            with pytest.raises(InputError, match=f"{path.name}: ") as error:
                read_measurement(path)
            assert "\n" not in str(error.value)


def test_a_file_without_numbers_says_so(tmp_path):
    with pytest.raises(InputError, match="holds no table of numbers"):
        read_measurement(workbook(tmp_path / "iv.xlsx", notes=[["nothing yet"]]))
    with pytest.raises(InputError, match="holds no table of numbers"):
        read_measurement(hdf5(tmp_path / "iv.h5"))


@pytest.mark.parametrize(
    ("module", "extra", "content"),
    [
        ("openpyxl", "excel", b"PK\x03\x04 xl/workbook.xml"),
        ("h5py", "hdf5", b"\x89HDF\r\n\x1a\n"),
    ],
)
def test_without_its_library_the_extra_is_named(module, extra, content, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    path = tmp_path / "iv.bin"
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"pip install 'hotlever\[{extra}\]'"):
        read_measurement(path)
