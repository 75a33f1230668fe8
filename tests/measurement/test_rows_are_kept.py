"""What instruments and people put beside plain numbers costs no row without a word."""

from __future__ import annotations

import re

import numpy as np
import pytest

from hotlever import InputError, read_measurement
from table_files import KINDS, REFUSED, RIGHT, WRONG, no_values, outcome, signs

TABLES = {table.name: table for kind in KINDS for table in kind()}
#: Those of which nothing is unclear.
CLEAR = [
    *(table.name for table in no_values() if table.bias is not None),
    *(table.name for table in signs() if table.name.startswith("minus")),
    *("dates, headerless", "dates below a comment", "dates, no first value", "Fortran's exponents"),
    *("words first, headerless", "Keithley's buffer, headerless", "B1500, lines of data alone"),
    *("decimal commas, no first value", "underlined headings", "Markdown", "end of a DOS file"),
    *(f"thousands with {mark}" for mark in ("apostrophes", "narrow blanks")),
    *("TDMS, two groups, one told", "TDMS, an overflow", "UTF-32", "two files joined, with marks"),
]
#: Cells that cannot be read, as an error names them.
CELLS = {
    "negative in parentheses": r"line 2: V_b: found '\(10\)', expected a number",
    "negative in parentheses, headerless": r"line 1: V_b: found '\(10\)', expected a number",
    "negative an apostrophe before": "line 2: V_b: found ''-10', expected a number",
    "negative as formulas, headerless": "line 1: V_b: found '=-10', expected a number",
    "limits in the first row": "line 2: V_b: found '~0.4', expected a number",
    "HP 4145, status before the first row": r"line 2: V_b: found 'CV\+4.0E-01', expected a number",
    "units in cells, headerless": "line 1: V_b: found '0.40 V', expected a number",
    "an unknown word first, and a flag": "line 1: V_b: found 'ERR', expected a number",
    "a word that nobody knows": "line 1: I_h: found 'COMPL', expected a number",
    "dates, headerless, a short row": "line 10: 2 cells, expected 3 as in line 1",
}


@pytest.mark.parametrize("name", TABLES)
def test_no_row_is_lost_or_wrong_without_a_word(tmp_path, name):
    how, said = outcome(TABLES[name], tmp_path)
    assert how != WRONG, said
    assert how == RIGHT or name not in CLEAR, said
    assert "\n" not in said


@pytest.mark.parametrize("name", CELLS)
def test_what_looks_like_a_number_and_is_none_is_named(tmp_path, name):
    how, said = outcome(TABLES[name], tmp_path)
    assert how == REFUSED
    assert re.search(CELLS[name], said), said


def test_a_first_row_without_a_value_is_a_row(tmp_path):
    path = tmp_path / "iv.csv"
    path.write_text("0.25,9.91E+37\n0.5,7.2e-05\n0.75,0.000108\n")
    data = read_measurement(path, {"V_b (V)": "1", "I_h (A)": "2"})
    assert data.bias_V.tolist() == [0.25, 0.5, 0.75]
    np.testing.assert_allclose(data.current_mA, [np.nan, 0.072, 0.108])
    assert any("line 1: I_h is written as missing" in note for note in data.notes)


def test_headings_that_count_channels_are_headings(tmp_path):
    path = tmp_path / "iv.csv"
    path.write_text("x-axis,1,2\nsecond,Volt,mA\n0,1.0,0.14\n1,2.0,0.28\n")
    data = read_measurement(path, {"V_b": "1", "I_h": "2"})
    assert data.bias_V.tolist() == [1.0, 2.0]


def test_a_remark_below_the_header_is_noted(tmp_path):
    path = tmp_path / "iv.csv"
    path.write_text("V_b (V),I_h (mA)\nlever 7,up\n1.0,0.14\n2.0,0.28\n")
    data = read_measurement(path)
    assert data.bias_V.tolist() == [1.0, 2.0]
    assert any("line 2: 'lever 7,up' is taken for a comment" in note for note in data.notes)


def test_settings_may_be_negative_by_any_minus_sign(tmp_path):
    path = tmp_path / "iv.csv"
    path.write_text("# base temperature (°C): −10\nV_b (V),I_h (mA)\n1,0.14\n")
    assert read_measurement(path).base_temperature_K == pytest.approx(263.15)


@pytest.mark.parametrize(
    ("header", "cells", "right"),
    [
        ("V_b (V);I_h (µA)", "8,5;1.065,03", 1.06503),
        ("V_b (V);I_h (µA)", "8,5;1\u202f065,03", 1.06503),
        ("V_b (V);I_h (µA)", "8,5;1\u00a0065,03", 1.06503),
        ("V_b (V);I_h (uA)", "8.5;1’065.03", 1.06503),
        ("V_b (V);I_h (nA)", "8.5;1'065'030", 1.06503),
        ("V_b (V)\tI_h (µA)", "8.5\t1,065.03", 1.06503),
    ],
)
def test_marks_of_thousands_that_are_nothing_else_are_read(tmp_path, header, cells, right):
    comma = "," in cells.replace("1,065", "")
    path = tmp_path / "iv.csv"
    separator = "\t" if "\t" in cells else ";"
    first = f"2.5{separator}365.25".replace(".", "," if comma else ".")
    path.write_text("\n".join([header, first, cells]), encoding="utf-8")
    data = read_measurement(path)
    assert data.bias_V.tolist() == [2.5, 8.5]
    assert data.current_mA[1] == pytest.approx(right, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "rows", "numbers"),
    [("1,0.143,2,0.285,3,0.421", 1, 6), ("1 2 3 4 5\n.1 .2 .3 .4 .5", 2, 5)],
)
def test_a_table_that_lies_on_its_side_is_refused(tmp_path, text, rows, numbers):
    path = tmp_path / "iv.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=f"{rows} rows? of {numbers} numbers .* columns swapped"):
        read_measurement(path, {"V_b (V)": "1", "I_h (mA)": "2"})


@pytest.mark.parametrize("first", ["1e;1e", "COMPL;0x1F"])
def test_a_header_row_of_which_nobody_knows_a_word_is_named(tmp_path, first):
    path = tmp_path / "iv.csv"
    path.write_text(f"{first}\n1;0.143\n2;0.285\n")
    data = read_measurement(path, {"V_b (V)": "1", "I_h (mA)": "2"})
    assert any("line 1: '" in note and "taken for the header row" in note for note in data.notes)
    path.write_text("U;I (mA)\n1;0.143\n2;0.285\n")
    assert not read_measurement(path, {"V_b (V)": "1", "I_h (mA)": "2"}).notes


def test_of_three_rows_above_the_numbers_the_first_is_the_header(tmp_path):
    path = tmp_path / "origin.dat"
    path.write_text("Voltage\tCurrent\tReader\nV\tmA\tmV\nBias\tHeater\tReader\n1\t0.143\t60\n")
    data = read_measurement(path)
    assert (data.bias_V[0], data.current_mA[0], data.reader_V[0]) == (1.0, 0.143, 0.06)
    assert any("line 3: 'Bias Heater Reader' is taken for a comment" in n for n in data.notes)


def test_a_resistance_that_may_be_in_thousands_is_refused(tmp_path):
    path = tmp_path / "iv.csv"
    path.write_text("# R_s (Ohm): 5.600\nV_b (V);I_h (mA)\n1,0;0,143\n")
    with pytest.raises(InputError, match=r"found '5\.600', expected a number without marks of th"):
        read_measurement(path)
    path.write_text("# R_s (Ohm): 5.600\nV_b (V),I_h (mA)\n1.0,0.143\n")
    assert read_measurement(path).series_resistance_ohm == 5.6


def test_a_pressure_with_its_gas_sets_the_medium(tmp_path):
    path = tmp_path / "iv.csv"
    path.write_text("# pressure: 750 Torr air\nV_b (V),I_h (mA)\n1.0,0.143\n")
    data = read_measurement(path)
    assert data.medium == "air"
    assert data.pressure_mbar == pytest.approx(999.9, abs=0.1)


def test_a_workbook_is_named(tmp_path):
    path = tmp_path / "iv.xlsx"
    path.write_bytes(b"PK\x03\x04" + bytes(range(256)))
    with pytest.raises(InputError, match=r"a workbook such as Excel's, .* save the sheet as CSV"):
        read_measurement(path)


@pytest.mark.parametrize("separator", ["\t", ","])
def test_a_row_of_units_has_that_of_the_time_too(tmp_path, separator):
    path = tmp_path / "pulse.txt"
    rows = ["Time\tV_b\tI_h", "ms\tV\tmA", "0.01\t5\t0.7", "0.02\t5\t0.69"]
    path.write_text("\n".join(rows).replace("\t", separator))
    data = read_measurement(path)
    np.testing.assert_allclose(data.time_us, [10.0, 20.0])
    assert data.current_mA.tolist() == [0.7, 0.69]


def test_a_row_with_a_word_where_others_count_is_named(tmp_path):
    path = tmp_path / "iv.csv"
    path.write_text("Step,V_b (V),I_h (mA)\n1,1,0.143\n2,2,0.285\nTotal,3,0.428\n")
    (note,) = read_measurement(path).notes
    assert note.startswith(f"{path}: line 4: 'Total' stands where other rows have a number")


def test_headings_in_quotes_between_blanks(tmp_path):
    path = tmp_path / "from-r.txt"
    path.write_text('"V_b (V)" "I_h (mA)"\n1 0.143\n2 0.285\n')
    assert read_measurement(path).current_mA.tolist() == [0.143, 0.285]
