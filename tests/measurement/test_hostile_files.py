"""Measurement files that are unclear, damaged or meant to harm: one line each, at once."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_lab_files import AMPS, B1500, BIAS, CURRENT, FILES, LVM, SEGMENT, lab, rows, write

from hotlever.errors import InputError
from hotlever.estimate import read_measurement

IV = "V_b (V),I_h (mA)\n"
NUMBERED = {"V_b (V)": "1", "I_h (mA)": "2"}
WITH_TABS = "V_b (V)\tI_h (µA)\n"
ADVERSARIAL = [
    *(" ", "\t", "(", "[", "a (", "=", ":", "#", '"', "R_s ", "1", "1,", "k", "°", "base ", "/"),
    *("1e", "10^", "x10", "V ", "V_b,", "I/", "in ", "mbar ", "1 mbar; ", "µ", "_", "- ", "air "),
    *("medium: ", "Channels\t", "DataName, ", "V_b (V),I_h (mA),", "5 Ohm, "),
]

#: What is refused, and the words of the line.
REFUSED = {
    "thousands": lab(WITH_TABS + "1\t143\n2\t285\n8\t1,041\n"),
    "thousands with commas": lab(IV + "1,143.4\n8,1,041.5\n"),
    "thousands with blanks": lab("V_b (V);I_h (µA)\n1;143,4\n8;1 041,5\n"),
    "decimal commas between commas": lab(IV + "1,0,0,1434\n2,0,0,2849\n"),
    "two decimal signs": lab("V_b (V);I_h (mA)\n1,0;0.14\n2,0;0.28\n"),
    "no units": lab("V_b,I_h\n1,0.14\n"),
    "another unit": lab("V_b (V),I_h (mW)\n1,0.14\n"),
    "a unit to evaluate": lab("V_b (V),I_h (9**9**9**9)\n1,0.14\n"),
    "voltage of what": lab("Voltage (V),Gate (V),Current (A)\n" + rows(BIAS, BIAS, AMPS)),
    "two currents": lab("V_b (V),Current (mA),I (mA)\n" + rows(BIAS, CURRENT, CURRENT)),
    "numbers alone": lab(rows(BIAS, CURRENT)),
    "lever voltage alone": lab("# R_s: 5.6 kOhm\nV_l (V),T_tip (K)\n1,300\n"),
    "lever voltage without R_s": lab("V_l (V),I_h (mA)\n1,0.14\n"),
    "lever voltage with a hole": lab("# R_s: 5.6 kOhm\nV_l (V),I_h (mA)\n1,0.14\n2,\n"),
    "voltages disagree": lab(
        "# R_s: 56 kOhm\nV_b (V),V_l (V),I_h (mA)\n1,0.2,0.143\n2,0.4,0.285\n"
    ),
    "no such resistor": lab("V_b (V),V_l (V),I_h (nA)\n1,0.2,20\n2,0.4,40\n"),
    "no such lever": lab("# R_s: 0 ohm\nV_l (V),I_h (nA)\n3,1\n2,2\n4,3\n"),
    "two settings in one": lab("# R_s (kOhm): 5 R_s (kOhm): 5.6\n" + IV + "1,0.14\n"),
    "signs disagree": lab(IV + "-2,0.2849\n-1,0.1434\n1,0.1434\n2,0.2849\n"),
    "text among numbers": lab(IV + "1,0.14\noverflow,0.28\n"),
    "a row too short": lab(IV + "1,0.14\n2\n"),
    "another table below": lab(B1500 + "DataValue, 1, 1e-4, 0.06\n" + B1500.replace("Ih", "Ix")),
    "a segment cut off": lab(LVM + SEGMENT + "0\t1\t1e-4\n" + SEGMENT[:80]),
    "header twice, changed": lab(IV + "1,0.14\nV_b (V),I_h (uA)\n2,285\n"),
    "quotes": lab(IV + '1,"0.14\n2,0.28\n'),
    "an infinite current alone": lab(IV + "1,inf\n"),
    "a current too large": lab(IV + "1,9.8e37\n"),
    "a word below the header": lab("SMU 1,SMU 2\n0.5,COMPL\n1,0.14\n", columns=NUMBERED),
    "a word in the first row": lab("0.5,COMPL\n1,0.14\n", columns=NUMBERED),
    "a negative number in parentheses": lab(IV + "(1),(0.14)\n1,0.14\n"),
    "other units in a row of units": lab(IV + "V,A\n1,0.14\n"),
    "thousands that may be decimals": lab("V_b (mV);I_h (nA)\n1000;143,400\n2000;284,900\n"),
    "decimal commas between commas alone": lab("1,00,0,143\n2,00,0,284\n", columns=NUMBERED),
    "a page": lab("<table>\n<tr><td>1</td><td>0.14</td></tr>\n"),
    "empty": lab(""),
    "blank": lab("\n \t\n;;\n"),
    "no rows": lab(IV),
    "a picture": ("\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00\x00\x01", "latin-1", None),
    "helium": lab("# medium: He, 1 bar\n" + IV + "1,0.14\n"),
    "a rough vacuum": lab("# vacuum, 20 mbar\n" + IV + "1,0.14\n"),
    "a pressure of nothing": lab("# pressure: 100 mbar\n" + IV + "1,0.14\n"),
    "no such column": lab(IV + "1,0.14\n", columns={"V_r (mV)": "Reader"}),
    "no such number": lab(IV + "1,0.14\n", columns={"V_r (mV)": "3"}),
    "a heading of two": lab("V,V,I\n1,1,0.1\n", columns={"V_b (V)": "V", "I_h (mA)": "I"}),
    "told another unit": lab(IV + "1,0.14\n", columns={"I_h (A)": "I_h (mA)"}),
    "told a wrong unit": lab(IV + "1,0.14\n", columns={"I_h (V)": "I_h (mA)"}),
    "told another quantity": lab(IV + "1,0.14\n", columns={"I_x (A)": "I_h (mA)"}),
}
WORDS = {
    "thousands": "line 4: I_h: '1,041' may be 1.041 or 1041, expected numbers without marks of",
    "thousands with commas": "line 3: 3 cells, expected 2 as in line 1",
    "thousands with blanks": "line 3: I_h: found '1 041,5', expected a number",
    "decimal commas between commas": "line 2: 4 cells, expected 2 .*tabs or semicolons must",
    "two decimal signs": "line 2: I_h: found '0.14', expected a number with a decimal comma",
    "no units": r"line 1: 2 columns without a unit.*--column 'V_b \(V\)=V_b' ",
    "another unit": "line 1: I_h .*: unit 'mW' is not understood here, expected one like mA",
    "a unit to evaluate": r"unit '9\*\*9\*\*9\*\*9' is not understood",
    "voltage of what": r"line 1: the header names 'Voltage \(V\)', .*--column 'V_b \(V\)=Voltage",
    "two currents": "line 1: column 'I_h' stands twice; --column",
    "numbers alone": r"line 1: numbers without a header row.*--column 'V_b \(V\)=1'",
    "lever voltage alone": r"line 2: the header names .* or 'V_l \(V\)' and 'I_h \(mA\)'",
    "lever voltage without R_s": r"V_l without R_s, .*expected a line like '# R_s \(kOhm\): 5.6'",
    "lever voltage with a hole": "line 4: I_h is '', expected a number, since V_b follows from V_l",
    "voltages disagree": "V_b - V_l is 5.* kOhm times I_h, expected R_s = 5.6e.04 ohm",
    "no such resistor": "V_b - V_l over I_h: series_resistance_ohm = 40000000: expected at most",
    "no such lever": "the resistance that V_l over I_h asks for: series_resistance_ohm = ",
    "two settings in one": "line 1: R_s: found '5 R_s .kOhm.: 5.6', expected a number",
    "signs disagree": "line 2: V_b is '-2' and I_h is '0.2849', expected the same sign",
    "text among numbers": "line 3: V_b is 'overflow', expected a bias",
    "a row too short": "line 3: 1 cell, expected 2 as in line 1",
    "another table below": "line 12: another table after the header",
    "a segment cut off": "line 26: another table after the header",
    "header twice, changed": r"line 3: V_b: found 'V_b \(V\)', expected a number",
    "quotes": "line 2: found '1,\"0.14', expected quotes in pairs",
    "an infinite current alone": "no values in any of the columns",
    "a current too large": "line 2: I_h: found '9.8e37', expected a number",
    "a word below the header": "line 2: I_h: found 'COMPL', expected a number",
    "a word in the first row": "line 1: I_h: found 'COMPL', expected a number",
    "a negative number in parentheses": r"line 2: V_b: found '\(1\)', expected a number",
    "other units in a row of units": r"line 1: the unit of 'I_h \(mA\)' is 'A' in the row of units",
    "thousands that may be decimals": "line 2: I_h: '143,400' may be 143.400 or 143400, expected",
    "decimal commas between commas alone": "decimal commas between commas .line '1,00,0,143'",
    "a page": "an XML or HTML file, expected a table in text",
    "empty": "no header row and no rows",
    "blank": "no header row and no rows",
    "no rows": "no data rows after the header",
    "a picture": "a binary file, not a text file",
    "helium": "line 1: medium is 'He, 1 bar', expected vacuum, air or nitrogen",
    "a rough vacuum": "line 1: the pressure is 20 mbar and this is no vacuum",
    "a pressure of nothing": "line 1: the pressure is 100 mbar and no gas is named",
    "no such column": "line 1: unknown column 'Reader'",
    "no such number": r"line 1: no column '3', expected its number \(1 to 2\) or heading",
    "a heading of two": r"line 1: column 'V' stands 2 times, expected its number \(1 to 3\)",
    "told another unit": r"line 1: column 'I_h \(mA\)': its unit is mA, expected A as --column",
    "told a wrong unit": "I_h: unit 'V' is not understood here, expected one like mA",
    "told another quantity": "unknown quantity 'I_x': did you mean",
}  # fmt: skip


def refused(path, columns=None):
    """The line by which a file is refused; empty if it is read."""
    try:
        read_measurement(path, columns)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_unclear_is_one_line(tmp_path, name):
    text, encoding, columns = REFUSED[name]
    with pytest.raises(InputError, match=WORDS[name]) as caught:
        read_measurement(write(tmp_path, text, encoding), columns)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message.replace(str(tmp_path), "")) < 350


@pytest.mark.parametrize("part", ADVERSARIAL)
def test_no_text_takes_long(tmp_path, part):
    long = (part * 50_000)[:50_000]
    began = time.process_time()
    for text in (f"# {long}\n{IV}1,0.1\n", f"{long}\n{IV}1,0.1\n", f"{IV}1,{long}\n", f"{long}\n"):
        assert len(refused(write(tmp_path, text))) < 900  # either outcome is fine
    assert time.process_time() - began < 10  # backtracking takes much longer


def test_many_lines_above_a_header_are_read_at_once(tmp_path):
    began = time.process_time()
    path = write(tmp_path, "# R_s is 5 Ohm\n" * 50_000 + IV + "1,0.1\n")
    assert len(read_measurement(path).notes) == 21
    with pytest.raises(InputError):
        read_measurement(write(tmp_path, "Channels\tV_b (V)\n" * 50_000))
    assert time.process_time() - began < 30  # not a pass for every line


@given(
    st.sampled_from(sorted(FILES)),
    st.lists(
        st.tuples(st.integers(0, 2000), st.integers(0, 30), st.binary(max_size=12)), max_size=3
    ),
)
def test_a_damaged_file_is_read_or_refused_in_one_line(tmp_path_factory, name, cuts):
    text, encoding, columns = FILES[name]
    raw = text.encode(encoding)
    for place, length, put in cuts:
        raw = raw[:place] + put + raw[place + length :]
    path = tmp_path_factory.getbasetemp() / "damaged.csv"
    path.write_bytes(raw)
    if message := refused(path, columns):
        assert "damaged.csv" in message
        assert "\n" not in message
        return
    data = read_measurement(path, columns)
    assert np.all(data.bias_V >= 0)
    for observable in data.observables:
        assert not np.isinf(data.observable(observable)).any()
        assert not np.any(data.observable(observable, error=True) <= 0)
