"""Files as instruments write them are read as they are, or ask one question."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever import InputError, read_measurement
from hotlever.probe import Circuit
from hotlever.tables.text_tables import below_a_header
from table_files import STYLES, understood

FILES = {f"{file.style}, {file.name}": file for style in STYLES for file in style()}
#: Everything that a file of such a name says is enough to read it.
CLEAR = (
    *("Keithley, preamble, the source by name", "Keithley, 2460, units in words"),
    *("Keithley, defbuffer", "Keithley, current sourced"),
    *("LabVIEW, tabs", "LabVIEW, semicolons", "LabVIEW, units below", "lvm, times for each"),
    *("lvm, decimal commas", "B1500, own names", "Rohde & Schwarz, supply"),
    *("QCoDeS, Labber, gnuplot", "QCoDeS, Labber, Labber, own names"),
)
ASKED = ("LabVIEW, two voltages", "LabVIEW, two currents", "lvm, untitled", "B1500, defaults")

HEADER = "Index,Reading,Unit,Value,Unit\n"


def read(tmp_path, text, columns=None, circuit=None):
    path = tmp_path / "data.csv"
    path.write_text(text, encoding="utf-8")
    return read_measurement(path, columns, circuit)


@pytest.mark.parametrize("name", FILES)
def test_each_file_is_read_or_asks_one_question(tmp_path, name):
    how, message = understood(FILES[name], tmp_path)
    assert how in ("read", "asked"), message
    assert how == "read" or name not in CLEAR, message
    assert how == "asked" or name not in ASKED, message


def test_the_unit_of_a_buffer_is_that_of_its_rows(tmp_path):
    data = read(tmp_path, HEADER + "1,0.001,A,2,V\n2,0.002,A,3,V\n")
    np.testing.assert_allclose(data.current_mA, [1.0, 2.0])
    np.testing.assert_allclose(data.bias_V, [2.0, 3.0])
    (note,) = [note for note in data.notes if "only voltage" in note]
    assert "'Value (V)' is the only voltage and counts as the bias" in note
    assert "--column 'V_l (V)=Value (V)'" in note


def test_a_buffer_whose_unit_changes_is_refused(tmp_path):
    with pytest.raises(InputError, match="line 3: the unit is 'V', expected 'A' as above"):
        read(tmp_path, HEADER + "1,0.001,A,2,V\n2,0.002,V,3,V\n")


def test_a_unit_of_something_else_is_no_unit_of_the_column_before_it(tmp_path):
    data = read(tmp_path, "V_b (V),I_h (mA),test unit\n1,0.1,A\n2,0.2,mA\n")
    np.testing.assert_allclose(data.current_mA, [0.1, 0.2])


def test_the_units_of_an_lvm_file_are_those_of_its_channels(tmp_path):
    # each channel has times of its own, and the units stand side by side
    names = ("V_l", "V_r", "V_b", "I_h")
    header = "\t".join(f"X_Value\t{name}" for name in names)
    units = "Y_Unit_Label\tV\tmV\tV\tmA"
    text = f"Channels\t4\n{units}\n***End_of_Header***\n{header}\n0\t1\t0\t5\t0\t6.6\t0\t1\n"
    data = read(tmp_path, text)
    assert data.reader_V == pytest.approx(0.005)
    assert data.bias_V == pytest.approx(6.6)


@pytest.mark.parametrize(
    "header",
    ["Voltage (V),Gate (V),Current (mA)", "Voltage (V),Spannung (V),Current (mA)"],
)
def test_of_two_voltages_neither_is_taken(tmp_path, header):
    with pytest.raises(InputError, match="--column 'V_b"):
        read(tmp_path, f"{header}\n1,2,0.1\n2,3,0.2\n")


def test_a_voltage_that_the_resistor_would_eat_is_asked_for(tmp_path):
    text = "Spannung (V);Strom (mA)\n1;0,5\n2;0,9\n"
    assert read(tmp_path, text).bias_V.tolist() == [1.0, 2.0]
    with pytest.raises(InputError, match="is V_b the lever's own voltage, not the bias"):
        read(tmp_path, text, circuit=Circuit(series_resistance_ohm=5600.0))


def test_twenty_unused_columns_are_one_line(tmp_path):
    names = ",".join(f"flag {i}" for i in range(20))
    data = read(tmp_path, f"V_b (V),I_h (mA),{names}\n1,0.1{',0' * 20}\n")
    (note,) = data.unused
    assert "columns 'flag 0', 'flag 1', " in note
    assert "and 14 more are not used" in note


def test_fields_that_are_lines_become_columns():
    head = (1, "chunk;timestamp;size;fieldname")
    lines = [head, (2, "0;7;2;grid;1;2;nan"), (3, "0;7;2;x;3;4;nan"), (4, "1;8;1;grid;5")]
    lines += [(5, "1;8;1;x;6")]
    table = [line for _, line in below_a_header(lines)]
    assert table == ["grid;x", "1;3", "2;4", "grid;x", "5;6"]
    other = [(1, "V_b;I_h"), (2, "1;2")]
    assert below_a_header(other) == other
