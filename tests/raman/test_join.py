"""``hotlever join``: a bias log and tip spectra become one measurement."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from hotlever.errors import InputError
from hotlever.estimate.residuals import errors_of_scales
from hotlever.measurement import read_measurement
from hotlever.quantities import THERMOMETER
from hotlever.raman.spectrum_tables import join, read_bias_log


def read(*spectra):
    """A table of spectra, each a name or (name, temperature, error); these are independent."""
    rows = [(one, 500.0, 3.0) if isinstance(one, str) else one for one in spectra]
    names, temperatures, errors = zip(*rows, strict=True)
    return xr.Dataset(
        {
            "file": ("spectrum", np.array(names)),
            "temperature_K": ("spectrum", np.array(temperatures)),
            "temperature_error_K": ("spectrum", np.array(errors)),
            "temperature_noise_K": ("spectrum", np.array(errors)),
        },
        attrs={"room_temperature_K": 293.0},
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
    assert lines[5] == "V_b (V),I_h (mA),V_r (mV),file,T_tip (K),dT_tip (K)"
    assert lines[6].startswith("1.0000,0.14338,60.12,tip_00.txt,29")
    assert all(float(line.split(",")[-1]) > 0 for line in lines[6:])
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
        "# raman_scale: ± 1.5 %",
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
    rows = join(read_bias_log(log), found).splitlines()[2:]
    assert [row.split(",")[2] for row in rows] == ["340.0", "310.0", "311.0"]


def test_a_log_of_two_sweeps_names_its_columns_twice(tmp_path):
    log = tmp_path / "log.txt"
    log.write_text("V_b (V)  I_h (mA)\n1  0.14\nV_b (V)  I_h (mA)\n2  0.28\n")
    table = read_bias_log(log)
    assert (table.names, table.rows) == (["V_b (V)", "I_h (mA)"], [["1", "0.14"], ["2", "0.28"]])
    joined = join(table, read("a_1V.txt", "a_2V.txt")).splitlines()
    assert joined[2:] == ["1,0.14,500.0,3.0", "2,0.28,500.0,3.0"]


def test_join_by_order_keeps_the_files_dialect_and_replaces_old_temperatures(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("V_b (mV);T_tip (K);dT_tip (K);I_h (mA)\n1000,5;999;9;0,14\n2000,5;;;0,28\n")
    found = read("a.txt", ("b.txt", np.nan, np.nan))
    assert join(read_bias_log(log), found).splitlines() == [
        "# raman_scale: ± 1.5 %",
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
    assert lines[2] == "1,0.14,295.0,0.031"


RISE = np.array([10.0, 200.0, 500.0, 800.0])


def of_rises(own_K, common_K):
    """A table of spectra of these rises above 293 K."""
    found = read(*((f"{number}.txt", 293.0 + rise, 1.0) for number, rise in enumerate(RISE)))
    found["temperature_noise_K"] = "spectrum", own_K
    found["temperature_error_K"] = "spectrum", np.hypot(own_K, common_K)
    return found


def joined_measurement(folder, found, head=""):
    log, out = folder / "log.csv", folder / "joined.csv"
    log.write_text(f"{head}V_b (V),I_h (mA)\n1,0.14\n2,0.28\n3,0.4\n4,0.5\n")
    out.write_text(join(read_bias_log(log), found))
    return read_measurement(out)


def test_what_temperatures_have_in_common_is_stated_as_the_scale_and_read_back(tmp_path):
    """An error of 2 % of each rise, common to all, beside 3 K of each."""
    own = np.full(4, 3.0)
    data = joined_measurement(tmp_path, of_rises(own, 0.02 * RISE))
    np.testing.assert_allclose(data.tip_error_K, 3.0)
    assert data.raman_scale == pytest.approx(np.hypot(0.02, THERMOMETER))
    (error,) = errors_of_scales(data, ["tip"], {}, 293.0)
    np.testing.assert_allclose(error.errors, 0.025 * RISE)


def test_an_error_in_common_that_does_not_grow_with_the_rise_is_not_lost(tmp_path):
    """5 K for all, as by the laser: each stated error holds what its share of the rise does not."""
    own = np.full(4, 3.0)
    data = joined_measurement(tmp_path, of_rises(own, np.full(4, 5.0)))
    share_squared = data.raman_scale**2 - THERMOMETER**2
    total = data.tip_error_K**2 + share_squared * RISE**2
    assert np.all(total > 0.97 * (own**2 + 5.0**2))
    assert data.tip_error_K[0] == pytest.approx(np.hypot(3.0, 5.0), rel=0.02)
    assert data.tip_error_K[-1] == pytest.approx(3.0)


def test_a_log_that_states_the_scale_keeps_it_unless_it_was_joined_before(tmp_path):
    found = of_rises(np.full(4, 3.0), 0.02 * RISE)
    data = joined_measurement(tmp_path, found, "# raman_scale: ± 0.5 %\n")
    assert data.raman_scale == 0.005
    joined = (tmp_path / "joined.csv").read_text()
    (tmp_path / "again.csv").write_text(joined)
    again = join(read_bias_log(tmp_path / "again.csv"), found)
    assert again.splitlines()[0] == "# raman_scale: ± 2.5 %"
    assert again.count("raman_scale") == 1
