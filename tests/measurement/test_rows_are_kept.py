"""What instruments and people put beside plain numbers costs no row without a word."""

from __future__ import annotations

import re

import numpy as np
import pytest

from hotlever import InputError, read_measurement
from odd_tables import KINDS, REFUSED, RIGHT, WRONG, no_values, outcome, signs

TABLES = {table.name: table for kind in KINDS for table in kind()}
#: Those of which nothing is unclear.
CLEAR = [
    *(table.name for table in no_values() if table.bias is not None),
    *(table.name for table in signs() if table.name.startswith("minus")),
    *("dates, headerless", "dates below a comment", "dates, no first value", "Fortran's exponents"),
    *("words first, headerless", "Keithley's buffer, headerless", "B1500, lines of data alone"),
    *("decimal commas, no first value", "underlined headings", "Markdown", "end of a DOS file"),
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
    "thousands with narrow blanks": "line 1: I_h: found '52 598.4', expected a number",
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


def test_a_file_that_is_no_table_is_refused(tmp_path):
    path = tmp_path / "iv.csv"
    path.write_text("<?xml version='1.0'?>\n<a>1,2</a>\n")
    with pytest.raises(InputError, match="an XML or HTML file, expected a table in text"):
        read_measurement(path)
