"""`hotlever measure`: rows in a file as they come, and one line for what cannot be done."""

from __future__ import annotations

import re

import pytest

from hotlever.estimate import read_calibration
from hotlever.measurement import read_measurement

pytest.importorskip("pyvisa")
pytestmark = pytest.mark.usefixtures("coarse_meshes")

TWIN = ("measure", "--source", "twin:3", "--settle", "0s", "--laws", "paper")


def test_a_twin_is_measured_and_calibrated(run, tmp_path):
    words = ("--reader", "twin", "--bias", "1.5:5:3", "--stay-below", "500K")
    status, out, err = run(*TWIN, *words, "-o", "iv.csv", "--calibration", "cal.json")
    assert status == 0
    assert "3 rows in iv.csv: " in out
    assert "below" in err
    data = read_measurement(tmp_path / "iv.csv")
    assert data.observables == ("current", "reader")
    assert (data.bias_V.size, data.medium) == (3, "vacuum")
    text = (tmp_path / "iv.csv").read_text()
    assert text.index("# source: KEITHLEY") < text.index("V_b (V),I_h (mA),V_r (V)")
    last = read_calibration(tmp_path / "cal.json").table.isel(bias=-1)
    told = float(re.search(r"the tip is at (\d+) K", out)[1])
    assert told == pytest.approx(float(last.tip_K), abs=0.1 * float(last.tip_stderr_K))
    assert 350.0 < told < 500.0


def test_without_a_row_there_is_no_file_and_it_says_why(run, tmp_path):
    words = ("--bias", "1:5:3", "--stay-below", "293.5K", "-o", "iv.csv")
    status, _, err = run(*TWIN, *words, "--calibration", "cal.json")
    assert status == 1
    assert "iv.csv: not written, since no row was taken: beyond 0 V the tip might be" in err
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ((), "Missing option '--source'"),
        (("--source", "twin"), "Missing option '-o'"),
        (("--source", "twin:x", "-o", "a.csv"), "--source: found 'twin:x'"),
        (("--source", "COM", "-o", "a.csv"), "COM: is no VISA resource name"),
        (("--source", "twin", "--reader", "GPIB0::16::INSTR", "-o", "a.csv"), "at a twin"),
        (("--source", "twin", "--stay-below", "knees", "-o", "a.csv"), "--stay-below"),
        (("--source", "twin", "--settle", "10", "-o", "a.csv"), "--settle"),
        (("--source", "twin", "--compliance", "1A", "-o", "a.csv"), "--compliance"),
        (("--source", "twin", "--bias", "0:5:6", "-o", "a.csv"), "biases that rise"),
        (("--source", "twin", "--medium", "water", "-o", "a.csv"), "water"),
        (("--source", "twin", "-o", "mine.csv"), "mine.csv: exists"),
        (("--source", "twin", "-o", "a.txt"), ".csv"),
    ],
)
def test_bad_input_is_a_line_and_no_file(refused, words, found, tmp_path):
    (tmp_path / "mine.csv").write_text("mine")
    assert found in refused("measure", *words, below_notes=True)
    assert (tmp_path / "mine.csv").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["mine.csv"]
