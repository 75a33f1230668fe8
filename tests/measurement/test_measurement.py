"""Reading measurement files."""

from __future__ import annotations

import hashlib
import os
import time
from dataclasses import replace
from threading import Thread

import numpy as np
import pytest

from hotlever import Probe, sweep
from hotlever.errors import InputError
from hotlever.estimate import read_measurement
from hotlever.measurement import Measurement, with_measured_circuit
from hotlever.measurement.data import resolution_of

PLAIN = "V_b (V),I_h (mA),V_r (mV),T_tip (K),dT_tip (K)\n1,0.1,50,,\n2,0.2,100,300,5\n"


def read(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "data.csv"
    path.write_text(text, encoding=encoding)
    return read_measurement(path)


def test_example_has_all_observables_and_its_circuit():
    from importlib.resources import as_file, files

    with as_file(files("hotlever") / "examples" / "lever-a.csv") as path:
        data = read_measurement(path)
    assert data.observables == ("current", "reader", "tip")
    assert len(data.bias_V) == 25
    assert (data.series_resistance_ohm, data.base_temperature_K) == (5600.0, 293.0)
    assert data.reader_V[0] == pytest.approx(0.06012)
    assert np.isnan(data.tip_K[0])
    assert len(data.sha256) == 64


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        "# a comment\n\nI_h [uA],V_b [mV],T_tip [degC],V_r [V],dT_tip [mK]\n"
        "100,1000,,0.05,\n200,2000,26.85,0.1,5000\n",
        "V_b (V);I_h (mA);V_r (mV);T_tip (K);dT_tip (K)\n1,0;0,1;50;;\n2,0;0,2;100;300,0;5\n",
        "V_b (V)\tI_h (µA)\tV_r (mV)\tT_tip (K)\tdT_tip (degC)\n"
        "1\t1e2\t50\t\t\n2\t200\t100\t300\t5\n",
        '"V_b (V)","I_h (A)","V_r (mV)","T_tip (K)","dT_tip (K)","time (s)"\n'
        "1,1e-4,50,nan,,0\n2,2e-4,100,300,5,1\n",
        "\ufeff" + PLAIN.replace("\n", "\r\n"),
    ],
    ids=["plain", "other units and order", "semicolons", "tabs", "extra column", "bom, crlf"],
)
def test_all_ways_to_write_the_same_data(tmp_path, text):
    data = read(tmp_path, text)
    np.testing.assert_allclose(data.bias_V, [1, 2])
    np.testing.assert_allclose(data.current_mA, [0.1, 0.2])
    np.testing.assert_allclose(data.reader_V, [0.05, 0.1])
    np.testing.assert_allclose(data.tip_K, [np.nan, 300])
    np.testing.assert_allclose(data.tip_error_K, [np.nan, 5])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("# only\n# comments\n", r"no header row"),
        ("a,b\n1,2\n", r"line 1: the header names 'a', 'b'; expected 'V_b \(V\)'"),
        ("V_b (V),time (s)\n1,2\n", r"at least one of 'I_h \(mA\)'"),
        ("V_b,I_h (mA)\n1,2\n", r"column 'V_b' has no unit, expected 'V_b \(V\)'"),
        ("V_b (V),V_b (V),I_h (mA)\n1,1,1\n", r"column 'V_b' stands twice"),
        ("V_b (V),I_h (mV)\n1,2\n", r"I_h \(mV\): unit 'mV' is not understood here.*like mA"),
        ("V_b (V),I_h (mA)\n1,x\n", r"line 2: I_h: found 'x', expected a number"),
        ("V_b (V),I_h (mA)\n,2\n", r"line 2: V_b is '', expected a bias"),
        ("V_b (V),I_h (mA)\n-1,2\n", r"line 2: V_b is '-1'"),
        ("# R_s (kV): 5\n" + PLAIN, r"line 1: R_s: unit 'kV' is not understood here"),
        ("# R_s (kOhm): many\n" + PLAIN, r"line 1: R_s: found 'many', expected a number"),
    ],
)
def test_errors_name_line_and_column(tmp_path, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


# --- settings ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("comment", "ohm", "kelvin", "medium"),
    [
        ("R_s: 10 kOhm", 10e3, None, None),
        ("R_s = 10 kOhm", 10e3, None, None),
        ("Rs (kOhm): 10", 10e3, None, None),
        ("Series resistance = 5.6 kΩ", 5600, None, None),
        ("R_s: 5.6kOhm (four wires)", 5600, None, None),
        ("R_s (kOhm): 5.6 ± 0.1,,,", 5600, None, None),
        ("base temperature: 353 K", None, 353, None),
        ("T_base (K): 353", None, 353, None),
        ("T0 = 20 °C", None, 293.15, None),
        ("T0 = 20 deg C", None, 293.15, None),
        ("R_s = 5.6 kOhm, T0 = 293 K; medium: air", 5600, 293, "air"),
        ("medium: lab air", None, None, "air"),
        ("medium = in vacuum", None, None, "vacuum"),
    ],
)
def test_settings_as_people_write_them(tmp_path, comment, ohm, kelvin, medium):
    data = read(tmp_path, f"# {comment}\nV_b (V),I_h (mA)\n1,0.01\n")
    assert data.series_resistance_ohm == (None if ohm is None else pytest.approx(ohm))
    assert data.base_temperature_K == (None if kelvin is None else pytest.approx(kelvin))
    assert (data.medium, data.notes) == (medium, ())


@pytest.mark.parametrize(
    "comment",
    [
        *("R_s 10 kOhm", "R_s (kOhm) 10", "R_s: 5600", "R_s: 5.6k", "R_s: nan ohm", "R = 5 kOhm"),
        *("R_s: 10,000 Ohm", "R_s (kOhm): 5600 Ohm"),
        *("base temprature (K): 300", "base temperature is 300 K", "T0 = 12:30", "T_base: 68 F"),
        *("medium air", "medium:", "gas: on", "pressure: low", "p = 2.65", "293 K"),
        *("bias resistor: 10k", "resistance 10", "stage temperature = 353", "temp: 80", "T: 353"),
        *("gas_conductivity: 0.5", "surface_gap_um = 3", "surroundings.accommodation = 0.9"),
        *("R_s: 5.6 kOhm + 20 Ohm", "chip_K_per_mW: 2"),
    ],
)
def test_what_looks_like_a_setting_and_is_not_clear_is_noted(tmp_path, comment):
    data = read(tmp_path, f"# {comment}\n{PLAIN}")
    assert (data.series_resistance_ohm, data.base_temperature_K, data.medium) == (None,) * 3
    (note,) = data.notes
    assert f"data.csv: line 1: '# {comment}' is not understood and not used" in note


@pytest.mark.parametrize(
    "comment", ["lever C", "chip: 3", "2024-05-01 12:30", "laser: 532 nm", "RS-232"]
)
def test_other_comments_are_no_matter(tmp_path, comment):
    assert read(tmp_path, f"# {comment}\n{PLAIN}").notes == ()


@pytest.mark.parametrize(
    ("comment", "message"),
    [
        (
            "R_s = -5 ohm",
            "line 1: R_s: series_resistance_ohm = -5: .* at least 0",
        ),
        ("R_s: 10 GOhm", "line 1: R_s: .* = 1.*: .* at most 1e[+]07"),
        ("R_s (ohm): 10,000", "line 1: R_s: found '10,000', expected a number"),
        ("R_s (kOhm): 5.6x", "line 1: R_s: found '5.6x', expected a number"),
        ("R_s (mA^1000000): 5", "unit 'mA\\^1000000' is not understood"),
        ("T_base (K): 77", "line 1: T_base: .* = 77: .* at least 250"),
        ("R_s: 1 kOhm\n# R_s: 2 kOhm", "line 2: series_resistance_ohm is 2000.0, but 1000.0"),
        ("medium: air\n# medium: vacuum", "line 2: medium is vacuum, but air further up"),
        ("medium: helium", "line 1: medium is 'helium', expected vacuum, air or nitrogen"),
        ("medium: no air", "line 1: medium is 'no air', expected vacuum, air or nitrogen"),
        ("medium: forming gas, 5 % H2", "line 1: medium is 'forming gas, 5 % H2', expected vacuum"),
        ("gas: argon", "line 1: medium is 'argon'"),
        ("100 mbar He", "line 1: medium is '100 mbar He'"),
        ("pressure (mbar): 100", "line 1: the pressure is 100 mbar and no gas is named"),
        ("medium: vacuum, 10 mbar", "line 1: the pressure is 10 mbar and this is no vacuum"),
        ("medium: air, 1,013 mbar", "line 1: found '1,013 mbar', expected no mark of thousands"),
        ("medium: air, -5 mbar", "line 1: pressure: found -5 mbar"),
        ("pressure (K): 5", "line 1: pressure: unit 'K' is not understood here"),
        ("raman_scale: 3 K", "line 1: raman_scale = '3 K', expected a value and its spread"),
        ("raman_scale: ± 3 K", "line 1: raman_scale = '± 3 K', expected a value and its spread"),
        ("raman_scale = ± 80 %", "line 1: raman_scale = '± 80 %', expected a share such as"),
    ],
)
def test_impossible_settings_are_refused(tmp_path, comment, message):
    with pytest.raises(InputError, match=message):
        read(tmp_path, f"# {comment}\n{PLAIN}")


def test_the_scale_of_a_thermometer_is_read_and_said(tmp_path):
    data = read(tmp_path, f"# base temperature (K): 293\n# Raman scale = ± 1.2 %\n{PLAIN}")
    assert data.raman_scale == pytest.approx(0.012)
    assert ("raman_scale", "0.012 of the rise", "line 2") in data.understood
    assert data.notes == ()
    assert read(tmp_path, PLAIN).raman_scale is None


# --- notes, and data that no lever can show ------------------------------------------------


def test_a_column_like_a_known_one_is_named_with_what_it_may_be(tmp_path):
    data = read(tmp_path, "V_b (V),I_h (mA),T spot (K),U (mV),time (s)\n1,0.1,300,50,0\n")
    assert [note.split(": ", 1)[1] for note in data.unused] == [
        "columns 'T spot (K)', 'U (mV)', 'time (s)' are not used; if one is T_tip, say "
        "--column 'T_tip=T spot (K)'; if one is V_r, say --column 'V_r=U (mV)'"
    ]


def test_written_nan_is_noted_and_empty_cells_are_not(tmp_path):
    data = read(tmp_path, "V_b (V),I_h (mA),V_r (mV)\n1,0.1,\n2,nan,NaN\n3,0.3,n/a\n")
    assert [note.split(": ", 1)[1] for note in data.notes] == [
        "line 3: I_h is written as missing",
        "line 3: V_r is written as missing, and in 1 more rows",
    ]
    assert np.isnan(data.current_mA[1])


def test_a_thousand_notes_are_cut_short(tmp_path):
    unclear = "# R_s: 5.6\n" * 1000
    data = read(tmp_path, f"{unclear}V_b (V),I_h (mA)\n1,0.1\n")
    assert len(data.notes) == 21
    assert data.notes[-1].endswith("980 more such notes")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("I_h (mA)\n1,-0.1\n2,-0.2\n", "largest I_h: found -0.1 mA, .*is the sign wrong"),
        ("I_h (mA)\n1,0\n2,0\n", "the largest I_h: found 0 mA"),
        ("I_h (A)\n1,2\n", "the largest I_h: found 2000 mA, expected 1e-09 to 1000 mA"),
        ("I_h (pA)\n1,0.1\n", "the largest I_h: found 1e-10 mA"),
        ("I_h (mA)\n2000,1\n", "the largest V_b: found 2000 V, expected 0.001 to 1000 V"),
        ("V_r (kV)\n1,2\n", "the largest V_r: found 2000 V"),
        ("T_tip (K)\n1,300\n2,0\n", "line 3: T_tip is '0', expected a temperature above 0 K"),
        ("T_tip (°C)\n1,-300\n", "line 2: T_tip is '-300', expected a temperature above 0 K"),
        ("T_tip (kK)\n1,300\n", "the largest T_tip: found 300000 K"),
        (
            "T_tip (K),dT_tip (K)\n1,300,5\n2,300,0\n",
            "line 3: dT_tip is '0', expected a standard e",
        ),
        ("T_tip (K),dT_tip (K)\n1,300,1e-300\n", "line 2: dT_tip is '1e-300', expected a standard"),
        ("I_h (mA),dI_h (mA)\n1,0.1,-1\n", "line 2: dI_h is '-1', .* or an empty cell"),
        ("V_r (mV),dV_r (kV)\n1,50,2\n", "line 2: dV_r is '2', .* up to 1000 V"),
    ],
)
def test_data_that_no_lever_can_show_are_refused(tmp_path, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, f"V_b (V),{text}")
    assert "data.csv" in str(caught.value)


def test_currents_in_another_unit_than_the_header_says(tmp_path):
    with pytest.raises(InputError, match=r"line 3: V_b = 2 V and I_h = 200 mA leave -1\.12e\+03 V"):
        read(tmp_path, "# R_s (kOhm): 5.6\nV_b (V),I_h (mA)\n2,200\n")


def test_what_a_lever_can_hardly_show_is_noted(tmp_path):
    text = "# base temperature (K): 293\nV_b (V),I_h (mA),T_tip (K),dT_tip (K)\n0,-0.001,,\n"
    assert read(tmp_path, text + "2,0.2,280,\n3,0.3,270,9\n").notes == ()
    notes = read(tmp_path, text + "2,0.2,27,\n3,-0.2,28,\n").notes
    assert [note.split(": ", 1)[1] for note in notes] == [
        "line 5: I_h is negative",
        "line 4: T_tip is below the base temperature (293 K), perhaps in another unit, and in 1 "
        "more rows",
    ]


# --- files ---------------------------------------------------------------------------------


def test_what_was_hashed_is_what_was_read_even_from_a_pipe(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = Thread(target=lambda: pipe.write_text(PLAIN))
    writer.start()
    data = read_measurement(pipe)
    writer.join()
    assert data.sha256 == hashlib.sha256(PLAIN.encode()).hexdigest()
    np.testing.assert_array_equal(data.bias_V, [1, 2])


def test_twenty_thousand_rows_are_quick_and_a_million_are_refused(tmp_path):
    began = time.process_time()
    assert read(tmp_path, PLAIN + "3,0.3,150,300,5\n" * 20_000).bias_V.size == 20_002
    with pytest.raises(InputError, match="1000003 lines, expected at most 200000"):
        read(tmp_path, PLAIN + "3,0.3,150,300,5\n" * 1_000_000)
    assert time.process_time() - began < 30  # not a pass for every row


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"V_b (V)": "V_b", "I_h (mA)": "V_r"}, "its unit is mV, expected mA as --column says"),
        ({"V_b (V)": "V_b", "I_h (mA)": "V_b"}, "is V_b and I_h, expected one of them"),
    ],
)
def test_a_column_is_not_told_to_be_what_it_is_not(tmp_path, columns, message):
    path = tmp_path / "data.csv"
    path.write_text("V_b (V),I_h (mA),V_r (mV)\n1,0.1,60\n2,0.2,120\n")
    with pytest.raises(InputError, match=message):
        read_measurement(path, columns)


def test_a_medium_that_nobody_says_is_noted():
    data = Measurement.of_sweep(sweep(Probe.reference(), [1.0, 2.0]))
    unsaid = replace(data, medium=None)
    (note,) = with_measured_circuit(Probe.reference(), unsaid)[1]
    assert note.startswith("medium: vacuum is assumed")
    assert with_measured_circuit(Probe.reference(), data)[1] == []
    assert with_measured_circuit(Probe.reference(), unsaid, "vacuum")[1] == []
    stated = Probe.reference().in_medium("vacuum")
    assert with_measured_circuit(stated, unsaid)[1] == []


@pytest.mark.parametrize(
    ("values", "step"),
    [
        ([0.0, 0.1, 0.1, 0.3, 0.7], 0.1),
        ([-0.2, 0.2, 0.2, np.nan, 0.4], 0.2),
        ([0.1, 0.2, 0.3], 0.0),  # a resistor in equal steps
        ([0.1, 0.1, 0.231, 0.4], 0.0),
        ([0.1, 0.1], 0.0),
    ],
)
def test_a_resolution_is_a_step_of_which_all_values_are_multiples(values, step):
    assert resolution_of(np.array(values)) == pytest.approx(step)
