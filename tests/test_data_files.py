"""Workbooks, HDF5 and MATLAB files are read as the tables that they hold."""

from __future__ import annotations

import struct
import sys
import zipfile
from datetime import timedelta

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


@pytest.mark.parametrize("units", [[], ["V", "uA"]])
def test_a_sheet_may_have_a_row_for_each_quantity(tmp_path, units):
    bias, current = (np.linspace(0.5, 8.0, 16) * factor for factor in (1.0, 120.0))
    heads = [["V_b", "I_h"], units] if units else [["V_b (V)", "I_h (uA)"]]
    lying = [[*head, *each.tolist()] for *head, each in zip(*heads, [bias, current], strict=True)]
    path = workbook(tmp_path / "iv.xlsx", sweep=[["Lever 7"], ["R_s (kOhm)", 5.6], *lying])
    data = read_measurement(path)
    np.testing.assert_array_equal(data.bias_V, bias)
    np.testing.assert_allclose(data.current_mA, current / 1e3)
    assert data.series_resistance_ohm == 5600.0


def test_rows_that_begin_with_words_are_rows(tmp_path):
    """Below their headings, however few they are."""
    values = zip(["up", "up", "down"], [1.0, 2.0, 3.0], [0.1, 0.2, 0.3], [5.0] * 3, strict=True)
    sheet = [["branch", "V_b (V)", "I_h (mA)", "f (Hz)"], *map(list, values)]
    data = read_measurement(workbook(tmp_path / "iv.xlsx", sweep=sheet))
    assert data.bias_V.tolist() == [1.0, 2.0, 3.0]


def test_of_sweeps_side_by_side_one_question_asks_which(tmp_path):
    row, heads = [0.5, 0.1, None, 0.5, 0.2], ["V_b (V)", "I_h (mA)"]
    sheet = [["first", None, None, "second"], [*heads, None, *heads], row]
    path = workbook(tmp_path / "iv.xlsx", sweep=sheet)
    answers = r"--column 'V_b \(V\)=1' --column 'I_h \(mA\)=2' says which"
    with pytest.raises(InputError, match=f"columns 'V_b', 'I_h' stand twice; {answers}"):
        read_measurement(path)
    data = read_measurement(path, {"V_b (V)": "4", "I_h (mA)": "5"})
    assert data.current_mA.tolist() == [0.2]


@pytest.mark.parametrize("first", ["#", "# row"])
def test_headings_that_begin_with_a_number_sign_are_no_comment(tmp_path, first):
    sheet = [[first, "V_b (V)", "I_h (mA)"], [1, 0.5, 0.1], [2, 1.0, 0.2]]
    data = read_measurement(workbook(tmp_path / "iv.xlsx", sweep=sheet))
    assert data.bias_V.tolist() == [0.5, 1.0]


def test_a_formula_that_nobody_has_calculated_is_an_error(tmp_path):
    path = workbook(tmp_path / "iv.xlsx", sweep=[*rows(), ["=A4*2", 1.0]])
    with pytest.raises(InputError, match=r"cell A8: a formula without its value"):
        read_measurement(path)


def test_a_formula_with_its_value_is_a_number(tmp_path):
    path = rewritten(
        workbook(tmp_path / "iv.xlsx", sweep=[*rows(), ["=A7*2", 2e3]]),
        "xl/worksheets/sheet1.xml",
        (b"<v></v>", b"<v>16.5</v>"),
        (b"<v />", b"<v>16.5</v>"),
    )
    assert read_measurement(path).bias_V[-1] == 16.5


def rewritten(path, part, *changes):
    """Replace bytes in a part of a workbook."""
    with zipfile.ZipFile(path) as parts:
        contents = {name: parts.read(name) for name in parts.namelist()}
    for old, new in changes:
        contents[part] = contents[part].replace(old, new)
    with zipfile.ZipFile(path, "w") as parts:
        for name, content in contents.items():
            parts.writestr(name, content)
    return path


def test_styles_that_no_program_but_an_instrument_writes_are_no_matter(tmp_path):
    path = workbook(tmp_path / "iv.xlsx", sweep=rows())
    fills = (b"<fill><patternFill /></fill>", b"<fill/>")
    path = rewritten(path, "xl/styles.xml", fills, (b"<patternFill", b"<fill/><patternFill"))
    assert read_measurement(path).bias_V.tolist() == BIAS.tolist()


def test_errors_name_the_row_of_the_sheet(tmp_path):
    path = workbook(tmp_path / "iv.xlsx", sweep=[*rows(), [], [], ["~9", 1.0]])
    with pytest.raises(InputError, match=r"line 10: .*'~9'"):
        read_measurement(path)


def test_a_sheet_whose_cells_are_far_apart_is_refused(tmp_path):
    path = workbook(tmp_path / "iv.xlsx", sweep=rows())
    path = rewritten(path, "xl/worksheets/sheet1.xml", (b'r="B7"', b'r="XFD190000"'))
    with pytest.raises(InputError, match="190000 rows and 16384 columns, expected at most"):
        read_measurement(path)


def old_workbook(path, rows):
    """Write a sheet of an .xls file: numbers, dates and words in the records of BIFF 8."""

    def record(kind, content=b""):
        return struct.pack("<HH", kind, len(content)) + content

    def begin(kind):
        return record(0x809, struct.pack("<HHHHII", 0x600, kind, 0, 1997, 0, 0))

    cells = b""
    for row, values in enumerate(rows):
        for column, value in enumerate(values):
            # formatted as a number, or as a date that is so many days after the year 1900
            place = struct.pack("<HHH", row, column, isinstance(value, timedelta))
            if isinstance(value, timedelta):
                value /= timedelta(days=1)
            if isinstance(value, str):
                text = struct.pack("<HB", len(value), 0) + value.encode("latin-1")
                cells += record(0x204, place + text)
            else:
                cells += record(0x203, place + struct.pack("<d", value))
    name = struct.pack("<BBBB", 0, 0, 4, 0) + b"Data"
    formats = b"".join(record(0xE0, struct.pack("<HH16x", 0, number)) for number in (0, 14))
    offset = len(begin(5) + formats) + len(record(0x85, b"1234" + name)) + 4
    book = begin(5) + formats + record(0x85, struct.pack("<I", offset) + name) + record(0x0A)
    book = (book + begin(0x10) + cells + record(0x0A)).ljust(4096, b"\0")
    # a compound file: one sector of the table of sectors, one of names, then those of the book
    sectors = len(book) // 512
    header = struct.pack(
        "<8s16xHHHHH6xIIII", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", 0x3E, 3, 0xFFFE, 9, 6, 0, 1, 1, 0
    )
    header += struct.pack("<IIIII", 4096, 0xFFFFFFFE, 0, 0xFFFFFFFE, 0)
    header += struct.pack("<I", 0) + b"\xff" * 4 * 108
    follows = [0xFFFFFFFD, 0xFFFFFFFE, *range(3, 2 + sectors), 0xFFFFFFFE]
    table = struct.pack(f"<{len(follows)}I", *follows).ljust(512, b"\xff")

    def entry(name, kind, child, start, size):
        text = (name + "\0").encode("utf-16-le")
        links = struct.pack("<BBIII", kind, 1, 0xFFFFFFFF, 0xFFFFFFFF, child)
        return (text.ljust(64, b"\0") + struct.pack("<H", len(text)) + links).ljust(
            116, b"\0"
        ) + struct.pack("<IQ", start, size)

    names = entry("Root Entry", 5, 1, 0xFFFFFFFE, 0)
    names += entry("Workbook", 2, 0xFFFFFFFF, 2, len(book))
    path.write_bytes(header + table + names.ljust(512, b"\0") + book)
    return path


def test_an_old_workbook_is_read(tmp_path):
    pytest.importorskip("xlrd")
    table = [["Time", "AI", "AV", "RES"]]
    table += [[0.5 * n, i, v, "#REF"] for n, (i, v) in enumerate(zip(CURRENT, BIAS, strict=True))]
    path = old_workbook(tmp_path / "iv.xls", table)
    data = read_measurement(path, {"V_b (V)": "AV", "I_h (A)": "AI"})
    assert data.bias_V.tolist() == BIAS.tolist()
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT, rtol=1e-15)
    assert not any("'#REF'" in note for note in data.notes)


@pytest.mark.parametrize("days", [46000.5, 3e6, 9e8])
def test_what_an_old_workbook_has_formatted_as_a_date_may_be_none(tmp_path, days):
    pytest.importorskip("xlrd")
    table = [["Day", "V_b (V)", "I_h (A)"]]
    table += [[timedelta(days), v, i] for i, v in zip(CURRENT, BIAS, strict=True)]
    data = read_measurement(old_workbook(tmp_path / "iv.xls", table))
    assert data.bias_V.tolist() == BIAS.tolist()


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


def test_packed_numbers_are_unpacked(tmp_path):
    """As netCDF's conventions have it; a gap is no value."""
    h5py = pytest.importorskip("h5py")
    path = hdf5(tmp_path / "iv.nc", root=sweep())
    with h5py.File(path, "r+") as file:
        del file["I_h"]
        file["I_h"] = np.array([14, -999, 94, 1178], dtype=np.int16)
        packing = {"units": "mA", "scale_factor": 1e-3, "add_offset": 5e-4, "_FillValue": [-999]}
        file["I_h"].attrs.update(packing)
    data = read_measurement(path)
    np.testing.assert_allclose(data.current_mA, [0.0145, np.nan, 0.0945, 1.1785], rtol=1e-12)


def test_a_table_of_fields_is_one_of_its_own(tmp_path):
    """Two of the same fields, as PyTables writes them, do not take each other's place."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "iv.h5"
    with h5py.File(path, "w") as file:
        for name, scale in (("down", 1.3), ("up", 1.0)):
            pairs = list(zip(BIAS, 1e3 * scale * CURRENT, strict=True))
            file[name] = np.array(pairs, dtype=[("V_b (V)", float), ("I_h (mA)", float)])
    assert file_groups(path) == ["/down", "/up"]
    data = read_measurement(path, {"group": "/up"})
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT, rtol=1e-15)


def test_a_unit_may_be_an_array_of_one(tmp_path):
    units = {"V_b": (BIAS, [b"V"]), "I_h": (CURRENT, ["A"])}
    data = read_measurement(hdf5(tmp_path / "iv.h5", root=units))
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT, rtol=1e-15)


@pytest.mark.parametrize("lies", [False, True])
def test_the_longer_side_of_an_array_is_the_rows(tmp_path, lies):
    array = np.stack([BIAS, 1e3 * CURRENT], axis=1)
    path = hdf5(tmp_path / "iv.h5", root={"data": (array.T if lies else array, "")})
    data = read_measurement(path, {"V_b (V)": "data 1", "I_h (mA)": "data 2"})
    assert data.bias_V.tolist() == BIAS.tolist()


def test_an_array_beside_a_column_has_as_many_rows(tmp_path):
    array = np.outer(CURRENT, [1.0, 1.1, 1.2, 1.3, 1.4, 1.5])
    path = hdf5(tmp_path / "iv.h5", root={"V_b": (BIAS, "V"), "data": (array, "A")})
    data = read_measurement(path, {"I_h": "data 2"})
    np.testing.assert_allclose(data.current_mA, 1.1e3 * CURRENT, rtol=1e-15)


def test_a_name_with_another_unit_than_is_stated_is_asked_for(tmp_path):
    """Which of them is right nobody knows: a factor of a thousand would be wrong in silence."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "iv.h5", "w") as file:
        for name, unit, values in (("V_b", "V", BIAS), ("I_h_mA", "A", CURRENT)):
            file.create_dataset(name, data=values).attrs["units"] = unit
    with pytest.raises(InputError, match="'I_h_mA, A'"):
        read_measurement(tmp_path / "iv.h5")
    data = read_measurement(tmp_path / "iv.h5", {"I_h (A)": "I_h_mA, A"})
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT)


def test_an_unknown_compression_is_named(tmp_path, monkeypatch):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "iv.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("V_b", data=BIAS, compression="lzf")
    monkeypatch.setattr(h5py.h5z, "filter_avail", lambda code: False)
    with pytest.raises(InputError, match="'/V_b' is compressed by 'lzf', expected gzip"):
        read_measurement(path)


def test_a_dimension_without_values_is_no_column(tmp_path):
    """Sweeps below each other, as QCoDeS exports a loop: netCDF stores their number too."""
    xr = pytest.importorskip("xarray")
    pytest.importorskip("netCDF4")
    columns = {"I_h": (("sweep", "V_b"), np.stack([CURRENT, 1.3 * CURRENT]), {"units": "A"})}
    data = xr.Dataset(columns, {"V_b": ("V_b", BIAS, {"units": "V"})})
    data.to_netcdf(tmp_path / "qcodes.nc")
    assert file_groups(tmp_path / "qcodes.nc") == ["/"]
    measured = read_measurement(tmp_path / "qcodes.nc", {"I_h": "I_h 2"})
    np.testing.assert_allclose(measured.current_mA, 1.3e3 * CURRENT, rtol=1e-15)


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


def test_units_that_are_missing_are_one_question(tmp_path):
    savemat(tmp_path / "iv.mat", {"V_b": BIAS, "I_h": CURRENT})
    answers = r"--column 'V_b \(V\)=V_b' --column 'I_h \(mA\)=I_h'"
    with pytest.raises(InputError, match=f"2 columns without a unit.*{answers}"):
        read_measurement(tmp_path / "iv.mat")


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_cells_are_tables_and_of_columns_one(tmp_path, version):
    table, path = np.column_stack([BIAS, CURRENT]), tmp_path / "iv.mat"
    cells = {"sweeps": [table, 2.0 * table], "parts": [BIAS, CURRENT]}
    if version == "5":
        packed = {name: np.empty(2, dtype=object) for name in cells}
        for name, (first, second) in cells.items():
            packed[name][0], packed[name][1] = first, second
        savemat(path, packed)
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, both in cells.items():
                variable = file.create_dataset(name, (1, 2), dtype=h5py.ref_dtype)
                variable.attrs["MATLAB_class"] = np.bytes_("cell")
                for number, each in enumerate(both):
                    data = np.atleast_2d(each.T)
                    part = file.create_dataset(f"#refs#/{name}{number}", data=data)
                    part.attrs["MATLAB_class"] = np.bytes_("double")
                    variable[0, number] = part.ref
    assert file_groups(path) == ["/", "/sweeps(1)", "/sweeps(2)"]
    columns = {"group": "/", "V_b (V)": "parts(1)", "I_h (A)": "parts(2)"}
    assert read_measurement(path, columns).bias_V.tolist() == BIAS.tolist()
    columns = {"group": "/sweeps(2)", "V_b (V)": "1", "I_h (A)": "2"}
    assert read_measurement(path, columns).bias_V.tolist() == (2.0 * BIAS).tolist()


def test_complex_numbers_that_are_real_are_numbers(tmp_path):
    savemat(tmp_path / "iv.mat", {"V_b": BIAS, "I_h": 1e3 * CURRENT + 0j})
    data = read_measurement(tmp_path / "iv.mat", {"V_b (V)": "V_b", "I_h (mA)": "I_h"})
    np.testing.assert_allclose(data.current_mA, 1e3 * CURRENT, rtol=1e-15)


def test_what_is_no_column_is_named_where_it_is_missed(tmp_path):
    savemat(tmp_path / "iv.mat", {"V_b": BIAS, "I_h": CURRENT + 1e-6j})
    left_out = "; left out: no column of real numbers: I_h$"
    for columns in ({"V_b (V)": "V_b"}, {"V_b (V)": "V_b", "I_h (A)": "I_h"}):
        with pytest.raises(InputError, match=left_out):
            read_measurement(tmp_path / "iv.mat", columns)


def test_matlab_counts_along_columns_and_says_what_is_empty(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "iv.mat"
    square = np.outer(1e3 * CURRENT, [1.0, 1.1, 1.2, 1.3])
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("V_b", BIAS[None]), ("I_h", square.T), ("notes", np.zeros(2))):
            file[name] = values
            file[name].attrs["MATLAB_class"] = b"double"
        file["notes"].attrs["MATLAB_empty"] = 1
    data = read_measurement(path, {"V_b (V)": "V_b", "I_h (mA)": "I_h 2"})
    np.testing.assert_allclose(data.current_mA, 1.1e3 * CURRENT, rtol=1e-15)


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
        ("igor2", "igor", b"\0\5" + bytes(400)),
        ("nptdms", "tdms", b"TDSm" + bytes(24)),
    ],
)
def test_without_its_library_the_extra_is_named(module, extra, content, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    path = tmp_path / "iv.bin"
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"iv\.bin: .*'hotlever\[{extra}\]'") as error:
        read_measurement(path)
    assert "\n" not in str(error.value)
