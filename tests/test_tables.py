"""Reading tables: whatever a file holds, it is read or refused at once and in one line."""

from __future__ import annotations

import time

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.tables import find_tables, read_table
from hotlever.tables.table import number, text_lines
from hotlever.units import conversion

ADVERSARIAL = [" ", "\t", "(", "[", "a (", "=", ":", "#", '"', "R_s ", "1", "1,", "k", "°", "base "]


def table(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, "a header row")


@pytest.mark.parametrize(
    ("cell", "value"),
    [
        *(("1", 1.0), ("-1.5e3", -1500.0), ("+.5", 0.5), ("1D3", 1000.0), ("5.", 5.0)),
        *(("−1.5e3", -1500.0), ("–0.5", -0.5), ("5e−3", 0.005), ("－2", -2.0), ("âˆ’2", -2.0)),
    ],
)
def test_numbers_as_instruments_write_them(cell, value):
    assert number(cell) == value
    assert number(cell.replace(".", ","), decimal_comma=True) == value


@pytest.mark.parametrize(
    "cell",
    [
        *("", "nan", "NaN", "-", "--", "n/a", "---", "—", "NULL", "None", "inf", "-Inf", "∞"),
        *(
            "OVERFLOW",
            "+OVER",
            "OL",
            "O.L",
            "BURNOUT",
            "+++++",
            "*****",
            "#####",
            "#N/A",
            "#DIV/0!",
        ),
        *(
            "#WERT!",
            "#NV",
            "1.#QNAN",
            "-1.#IND",
            "-nan(ind)",
            "9.91E37",
            "+9.910000E+37",
            "-9.9E37",
        ),
        "199.999E+99",
    ],
)
def test_a_cell_may_say_that_there_is_no_number(cell):
    value = number(cell)
    assert value is not None
    assert value != value


@pytest.mark.parametrize(
    "cell",
    ["ERR", "1e999", "1e31", "1_000", "0x10", "1,5", "1.2.3", "１", "1 000", "=1+1", "9" * 99],
)
def test_what_is_no_number_is_not_taken_for_one(cell):
    assert number(cell) is None


@pytest.mark.parametrize(
    ("unit", "inside", "factor"),
    [
        *(("µV", "V", 1e-6), ("μV", "V", 1e-6), ("uV", "V", 1e-6), ("nA", "mA", 1e-6)),
        *(("kOhm", "ohm", 1e3), ("kΩ", "ohm", 1e3), ("KΩ", "ohm", 1e3), ("MΩ", "ohm", 1e6)),
        *(("ohm", "ohm", 1.0), ("K", "K", 1.0), ("mK", "K", 1e-3), ("A", "mA", 1e3)),
    ],
)
def test_units_with_si_prefixes(unit, inside, factor):
    assert conversion(unit, inside) == (factor, 0.0)


@pytest.mark.parametrize("unit", ["°C", "degC", "deg C", "C", "ºC", "℃"])
def test_degrees_celsius_have_an_offset_unless_they_are_differences(unit):
    assert conversion(unit, "K") == (1.0, 273.15)
    assert conversion(unit, "K", difference=True) == (1.0, 0.0)


@pytest.mark.parametrize(
    "unit",
    [
        *("", "%", "mV", "mA^1000000", "9**9**9**9", "mA*mA", "mA/1", "m" * 10_000, "(" * 10_000),
        "__import__('os').getcwd()",
    ],
)
def test_other_units_are_unknown_and_nothing_is_evaluated(unit):
    assert conversion(unit, "mA") is None


def test_quoted_cells_hold_separators(tmp_path):
    found = table(tmp_path, '"V_b (V)";"a;b"\n1,5;"x ""y"";z"\n')
    assert found.names == ["V_b (V)", "a;b"]
    assert found.rows == [["1,5", 'x "y";z']]
    assert found.values(0, "V", "V_b").tolist() == [1.5]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('a,b\n1,2\n1,"2\n3,4\n', r"line 3: found '1,\"2', expected quotes in pairs"),
        ('a,b\n"1"x,2\n', r"line 2: found '\"1\"x,2', expected quotes in pairs"),
        ("a,b\n1\n", "line 2: 1 cell, expected 2 as in line 1"),
        ("a;b\n1,5;2\n1.5;3\n", "line 3: a: found '1.5', expected a number with a decimal comma"),
        ("a\n" * 200_001, "200001 lines, expected at most 200000"),
        ("a," * 80_000, "line 1: 160000 characters, expected at most 131072"),
    ],
)
def test_broken_tables_are_one_line_that_names_theirs(tmp_path, text, message):
    with pytest.raises(InputError, match=message) as caught:
        table(tmp_path, text).values(0, "V", "a", unit="V")
    assert "table.csv" in str(caught.value)
    assert len(str(caught.value)) < 250


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"])
def test_any_common_encoding_is_read(tmp_path, encoding):
    found = table(tmp_path, "I_h (µA);°\r\n1,5;2\r\n".encode(encoding))
    assert found.names == ["I_h (µA)", "°"]
    assert found.values(0, "A", "I_h").tolist() == [1.5e-6]


def test_a_mark_of_utf_8_is_left_out_where_the_rest_is_not_utf_8(tmp_path):
    found = table(tmp_path, b"\xef\xbb\xbfa,b (\xb5V)\n1,2\n")
    assert found.names == ["a", "b (µV)"]


def test_every_line_keeps_its_number(tmp_path):
    found = table(tmp_path, "# one\n\na,b\n1,2\n # two\n3,4\n")
    assert found.comments == [(1, "# one"), (5, " # two")]
    assert [found.where(row).split(": ")[1] for row in (-1, 0, 1)] == ["line 3", "line 4", "line 6"]


@pytest.mark.parametrize("line", ["\x1f", " \x1f ", "\u2003", ",;\t", '"'])
def test_a_line_that_holds_nothing_is_no_row(tmp_path, line):
    found = table(tmp_path, f"{line}\na,b\n{line}\n1,2\n")
    assert (found.names, found.rows, found.where(0)) == (
        *(["a", "b"], [["1", "2"]]),
        f"{found.path}: line 4",
    )
    with pytest.raises(InputError, match="no header row and no rows"):
        table(tmp_path, line)
    with pytest.raises(InputError, match="the file is empty"):
        find_tables(line.encode(), "f")


@pytest.mark.parametrize("part", ADVERSARIAL)
def test_no_line_takes_long_to_read(tmp_path, part):
    line = (part * 100_000)[:100_000]
    began = time.process_time()
    for text in (f"# {line}x\na,b\n1,2\n", f"{line}\n1,2\n", f"a,b\n1,{line}\n"):
        message = ""
        try:
            table(tmp_path, text).values(0, "V", "a", unit="V")
        except InputError as error:
            message = str(error)
        assert len(message) < 250
    find_tables(f"{line}x\nTemperature (K)={line}x\n1 2\n3 4".encode(), "")
    assert time.process_time() - began < 30  # backtracking takes hours


def test_a_map_of_millions_of_numbers_is_read_and_more_are_refused():
    lines = ["\t".join(["1234.5"] * 2000)] * 100
    raw = "\n".join(lines).encode()
    assert find_tables(raw, "map")[0].array.shape == (100, 2000)
    with pytest.raises(InputError, match="map: more than 100000 numbers"):
        find_tables(raw, "map", most_numbers=100_000)


def test_a_huge_number_is_no_number_there_either():
    (table_of_numbers,) = find_tables(b"1 2\n3 4\n5 1e300\n6 7", "")
    np.testing.assert_array_equal(table_of_numbers.array, [[1, 2], [3, 4], [5, np.nan], [6, 7]])


def test_binary_content_is_refused():
    with pytest.raises(InputError, match="a binary file"):
        text_lines(bytes(range(256)) * 9, "x")
