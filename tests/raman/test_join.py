"""``hotlever join``: a bias log and tip spectra become one measurement."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from hotlever.errors import InputError
from hotlever.measurement import read_measurement
from hotlever.raman.tables import join, read_bias_log


def read(*spectra):
    """A table of spectra, each a name or (name, temperature, error)."""
    rows = [(one, 500.0, 3.0) if isinstance(one, str) else one for one in spectra]
    names, temperatures, errors = zip(*rows, strict=True)
    return xr.Dataset(
        {
            "file": ("spectrum", np.array(names)),
            "temperature_K": ("spectrum", np.array(temperatures)),
            "temperature_error_K": ("spectrum", np.array(errors)),
        }
    )


def test_join_gives_the_measurement_file_by_file_column(run, examples, tmp_path):
    out = tmp_path / "data.csv"
    status, _, _ = run(
        *("join", examples / "bias-log.csv", examples / "tip"),
        *("--calibrate-from", examples / "hot-plate", "-o", out),
    )
    assert status == 0
    lines = out.read_text().splitlines()
    log = (examples / "bias-log.csv").read_text().splitlines()
    assert lines[:4] == log[:4]  # comments as they were
    assert lines[4] == "V_b (V),I_h (mA),V_r (mV),file,T_tip (K),dT_tip (K)"
    assert lines[5].startswith("1.0000,0.14338,60.12,tip_00.txt,29")
    assert all(float(line.split(",")[-1]) > 0 for line in lines[5:])
    data = read_measurement(out)
    assert data.series_resistance_ohm == 5600.0
    assert np.all(np.diff(data.tip_K) > 0)
    assert data.tip_error_K.size == 4


def test_join_by_bias_in_the_name_leaves_other_rows_empty(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("# medium: vacuum\nV_b (V),I_h (mA)\n1.0000,0.14\n5.2500,0.80\n11.0000,1.46\n")
    found = read(("tip_11V.txt", 1200.4, 9.04), "tip_5.25V.txt")
    assert join(read_bias_log(log), found).splitlines() == [
        "# medium: vacuum",
        "V_b (V),I_h (mA),T_tip (K),dT_tip (K)",
        "1.0000,0.14,,",
        "5.2500,0.80,500.0,3.0",
        "11.0000,1.46,1200.4,9.0",
    ]


def test_a_negative_bias_in_a_name_is_one(tmp_path):
    """Not in the order of the files, in which -1 comes before -2."""
    log = tmp_path / "log.csv"
    log.write_text("V_b (V),I_h (mA)\n-2.0,-0.2\n-1.0,-0.1\n1.0,0.1\n")
    found = read(
        ("tip_-1V.txt", 310.0, 1.0), ("tip_-2V.txt", 340.0, 1.0), ("tip_1V.txt", 311.0, 1.0)
    )
    rows = join(read_bias_log(log), found).splitlines()[1:]
    assert [row.split(",")[2] for row in rows] == ["340.0", "310.0", "311.0"]


def test_a_log_of_two_sweeps_names_its_columns_twice(tmp_path):
    log = tmp_path / "log.txt"
    log.write_text("V_b (V)  I_h (mA)\n1  0.14\nV_b (V)  I_h (mA)\n2  0.28\n")
    table = read_bias_log(log)
    assert (table.names, table.rows) == (["V_b (V)", "I_h (mA)"], [["1", "0.14"], ["2", "0.28"]])
    joined = join(table, read("a_1V.txt", "a_2V.txt")).splitlines()
    assert joined[1:] == ["1,0.14,500.0,3.0", "2,0.28,500.0,3.0"]


def test_join_by_order_keeps_the_files_dialect_and_replaces_old_temperatures(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("V_b (mV);T_tip (K);dT_tip (K);I_h (mA)\n1000,5;999;9;0,14\n2000,5;;;0,28\n")
    found = read("a.txt", ("b.txt", np.nan, np.nan))
    assert join(read_bias_log(log), found).splitlines() == [
        "V_b (mV);I_h (mA);T_tip (K);dT_tip (K)",
        "1000,5;0,14;500,0;3,0",
        "2000,5;0,28;;",
    ]


@pytest.mark.parametrize(
    ("text", "names", "words"),
    [
        ("", ["a.txt"], "no rows"),
        ("1,2\n3,4\n", ["a.txt"], "no bias column in '1,2'"),
        ("V_b (V),I\n1,2,3\n", ["a.txt"], "line 2: 3 cells, expected 2"),
        ("V_b (V),I\nx,2\n", ["a.txt"], "line 2: V_b: found 'x', expected a number"),
        ("V_b (V),I\n1,2\n2,3\n", ["a.txt"], "2 rows and 1 spectra"),
        ("V_b (V),I\n1,2\n2,3\n", ["a_1V.txt", "b_7V.txt"], "no row at the bias of b_7V.txt"),
        ("V_b (V),I\n1,2\n2,3\n", ["a_1V.txt", "b_1V.txt"], "two spectra at 1 V"),
        ("V_b (V),file\n1,z.txt\n", ["a.txt"], "line 2: spectrum 'z.txt' is not among those given"),
        ("V_b (V),file\n1,a.txt\n", ["p/a.txt", "q/a.txt"], "'a.txt' names 2 of them"),
        ("V_b (V),I\n,2\n--,3\n", ["a_1V.txt", "b_2V.txt"], "no row at the bias of a_1V.txt"),
        ("V_b (mA),I\n1,2\n", ["a.txt"], "line 1: V_b .mA.: unit 'mA' is not understood"),
        ('V_b (V),I\n1,"2\n', ["a.txt"], "line 2: found '1,\"2', expected quotes in pairs"),
    ],
)
def test_logs_that_cannot_be_joined(text, names, words, tmp_path):
    log = tmp_path / "log.csv"
    log.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        join(read_bias_log(log), read(*names))
    assert str(log) in str(caught.value)


def test_an_error_below_a_tenth_of_a_kelvin_is_not_written_as_none(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("V_b (V),I_h (mA)\n1,0.14\n")
    lines = join(read_bias_log(log), read(("a.txt", 295.0, 0.031))).splitlines()
    assert lines[1] == "1,0.14,295.0,0.031"
