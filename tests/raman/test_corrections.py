"""Lines corrected by hand: where the fit begins, what is fitted, and what is left out."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.raman import PeakOptions, SpectrumCorrection, fit_peak, lineshape, read_corrections
from hotlever.raman.spectrum_tables import corrections_text

X = np.arange(440.0, 600.0, 0.5)
HEAD = "file,start_cm-1,from_cm-1,to_cm-1,use\n"


def two_lines(other=489.0):
    """The line at 512 cm⁻¹ beside a stronger one, of a lamp."""
    lines = 400.0 * lineshape.line(X, 512.0, 5.0)[0] + 900.0 * lineshape.line(X, other, 3.0)[0]
    return np.random.default_rng(3).poisson(100.0 + lines).astype(float)


def rows(text):
    return {row["file"]: row for row in csv.DictReader(io.StringIO(text))}


def test_a_start_leads_to_the_weaker_line():
    y = two_lines()
    assert abs(fit_peak(X, y).centre - 489.0) < 0.5
    by_hand = SpectrumCorrection(start=511.0, low=500.0, high=560.0).of(PeakOptions())
    peak = fit_peak(X, y, by_hand)
    assert abs(peak.centre - 512.0) < 4 * peak.centre_stderr < 0.5


def test_a_narrow_line_that_looks_like_a_cosmic_ray_is_one_if_that_is_said():
    x = np.arange(440.0, 600.0, 0.8)
    line = 200.0 * lineshape.line(x, 516.3, 1.0)[0]
    y = np.random.default_rng(4).poisson(100.0 + line).astype(float)
    with pytest.raises(InputError, match="no silicon line"):
        fit_peak(x, y)
    assert abs(fit_peak(x, y, PeakOptions(start=517.0)).centre - 516.3) < 0.2


def test_a_correction_changes_its_row_alone_and_is_flagged(run, examples, tmp_path):
    table = tmp_path / "by-hand.csv"
    table.write_text(f"{HEAD}tip/tip_04.txt,516.5,490,545,\ntip_08.txt,,,,no\n")
    command = ("raman", examples / "tip", "--calibrate-from", examples / "hot-plate")
    plain, by_hand = (rows(run(*command, *more)[1]) for more in ((), ("--corrections", table)))
    for name in ("tip_00.txt", "tip_11.txt"):
        assert by_hand[name] == plain[name]
    assert by_hand["tip_04.txt"]["flags"] == "by-hand"
    assert by_hand["tip_08.txt"]["flags"] == "left-out"
    assert by_hand["tip_08.txt"]["center_cm-1"] == by_hand["tip_08.txt"]["temperature_K"] == ""
    before, after = (float(one["tip_04.txt"]["temperature_K"]) for one in (plain, by_hand))
    error = float(by_hand["tip_04.txt"]["temperature_error_K"])
    assert 0.0 < abs(after - before) < error


def test_a_hot_plate_spectrum_left_out_is_not_calibrated_from(run, examples, tmp_path):
    table = tmp_path / "by-hand.csv"
    table.write_text("use,file\nno,hot-plate/si100_08.txt\n")
    command = ("raman", examples / "tip", "--corrections", table)
    status, _, err = run(*command, "--calibrate-from", examples / "hot-plate")
    assert status == 0
    assert "calibrated from 6 spectra" in err
    # of a folder that is not read: no mistake, but said
    status, _, err = run(*command)
    assert status == 0
    assert err == f"note: {table}: passed over hot-plate/si100_08.txt, of no folder read here\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"{HEAD}tip_40.txt,516,,,\n", "unknown spectrum 'tip_40.txt': did you mean 'tip_04.txt'?"),
        ("file,strat\ntip_04.txt,516\n", "line 1: unknown column 'strat': did you mean"),
        ("start_cm-1,use\n516,yes\n", "line 1: found start_cm-1, use, expected the column file"),
        (f"{HEAD}tip_04.txt,x,,,\n", "line 2: start_cm-1: found 'x', expected a number"),
        (f"{HEAD}tip_04.txt,,,,maybe\n", "line 2: use: found 'maybe', expected yes or no"),
        (f"{HEAD}tip_04.txt,700,,,\n", "line 2: start: found 700 cm⁻¹, expected a place between"),
        (f"{HEAD}tip_04.txt,,530,520,\n", "line 2: window: found 530 to 520 cm⁻¹"),
        (f"{HEAD}tip_04.txt,,518,521,\n", "tip_04.txt: 5 samples between 518 and 521 cm⁻¹"),
        (f"{HEAD}tip_04.txt,,,,\ntip_04.txt,,,,\n", "line 3: 'tip_04.txt' has a row above"),
        (f"{HEAD}tip_04.txt,,,,no\n", "leaves out every spectrum"),
    ],
)
def test_what_cannot_be_is_a_line(refused, examples, tmp_path, text, message):
    table = tmp_path / "by-hand.csv"
    table.write_text(text)
    spectrum = examples / "tip" / "tip_04.txt"
    assert message in refused("raman", spectrum, "--corrections", table)


def test_a_table_that_is_written_is_read(tmp_path):
    corrections = {
        "tip/a, b.txt": SpectrumCorrection(start=516.25, low=490.0),
        'map.txt[X=1 "Y"=2]': SpectrumCorrection(use=False),
    }
    table = tmp_path / "by-hand.csv"
    table.write_text(corrections_text(corrections))
    assert read_corrections(table) == corrections
