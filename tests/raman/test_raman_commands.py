"""``hotlever raman`` and ``hotlever join`` as a user meets them."""

from __future__ import annotations

import csv
import io
import os
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

import synthetic_spectra as synthetic
from hotlever.figures import raman_figures as figures
from hotlever.raman.series import (
    DIGITS,
    calibrate_from,
    measure,
    read_lines,
    to_csv,
)
from hotlever.raman.spectrum import Spectrum
from hotlever.raman.spectrum_reading import read_spectra
from hotlever.raman.thermometer import Thermometer, published_raman_calibration
from hotlever.tasks.commands import spread_option

HEADER = (
    "file,center_cm-1,center_stderr_cm-1,fwhm_cm-1,shift_cm-1,temperature_K,"
    "temperature_error_K,flags"
)


def table(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_peaks_without_calibration_leave_temperatures_empty(run, examples):
    status, out, err = run("raman", examples / "tip")
    assert status == 0
    assert err == ""
    assert out.splitlines()[0] == HEADER
    rows = table(out)
    assert [row["file"] for row in rows] == [f"tip_{i:02d}.txt" for i in (0, 4, 8, 11)]
    for row in rows:
        assert 495.0 < float(row["center_cm-1"]) < 523.0
        assert row["shift_cm-1"] == row["temperature_K"] == row["temperature_error_K"] == ""


def test_calibrated_from_a_folder_and_again_from_the_saved_calibration(run, examples, tmp_path):
    cal, figure, table_file = tmp_path / "cal.json", tmp_path / "f.png", tmp_path / "t.csv"
    status, out, err = run(
        *("raman", examples / "tip", "--calibrate-from", examples / "hot-plate"),
        *("--save-calibration", cal, "--plot", figure, "-o", table_file),
    )
    assert (status, out) == (0, "")
    assert "calibrated from 7 spectra, 295 to 895 K" in err
    assert figure.read_bytes().startswith(b"\x89PNG")
    rows = table(table_file.read_text())
    temperatures = [float(row["temperature_K"]) for row in rows]
    assert temperatures == sorted(temperatures)
    assert abs(temperatures[0] - 295.0) < 10.0
    assert "extrapolated" in rows[-1]["flags"]
    status, out, _ = run("raman", examples / "tip", "--calibration", cal)
    assert status == 0
    assert out == table_file.read_text()


def test_both_laws_and_the_order_of_words(run, examples):
    plate = sorted((examples / "hot-plate").iterdir())
    _, one, _ = run("raman", "--calibrate-from", examples / "hot-plate", examples / "tip")
    _, two, _ = run("raman", examples / "tip", "--calibrate-from", *plate)
    _, three, err = run(
        "raman", examples / "tip", "--law", "linear", "--calibrate-from", examples / "hot-plate"
    )
    assert one == two
    assert float(table(three)[-1]["temperature_K"]) > float(table(one)[-1]["temperature_K"]) + 40
    assert "the shift is not linear" in err


def test_published_laws_with_a_reference(run, examples):
    reference = examples / "hot-plate" / "si100_00.txt"
    status, out, _ = run(
        *("raman", examples / "tip", "--calibration", "published", "--reference", reference),
        *("--law", "linear", "--stress", "20", "--laser-power", "0.1"),
        *("--thermal-resistance", "215"),
    )
    assert status == 0
    rows = table(out)
    for row in rows:
        expected = 293.0 + 5.0 - 41.1 * float(row["shift_cm-1"])
        assert float(row["temperature_K"]) == pytest.approx(expected, abs=0.05)


def test_a_table_of_spectra_is_a_dataset_with_units_and_what_the_csv_holds(
    run, examples, hot_plate
):
    found, _ = calibrate_from(read_spectra([hot_plate]))
    x = np.arange(440.0, 600.0, 0.5)
    noise = np.random.default_rng(0).poisson(100.0, x.size).astype(float)
    lines = measure([*read_spectra([examples / "tip"]), Spectrum(x, noise, "none.txt")])
    dataset = read_lines(lines, Thermometer(found))
    assert dataset.sizes == {"spectrum": 5}
    assert {name: dataset[name].attrs["units"] for name in DIGITS} == {
        name: "K" if name.endswith("_K") else "cm-1" for name in DIGITS
    }
    rows = table(to_csv(dataset))
    for name, digits in DIGITS.items():
        cells = [float(row[name.replace("_per_cm", "_cm-1")] or "nan") for row in rows]
        np.testing.assert_allclose(cells, dataset[name], atol=0.51 * 10.0**-digits)
    assert [row["file"] for row in rows] == dataset.file.values.tolist()
    assert [row["flags"] for row in rows] == dataset.flags.values.tolist()
    assert dataset.flags.values[-1] == "no-line"
    assert np.isnan(dataset.temperature_K.values[-1])


def test_single_spectrum_and_lineless_spectrum(run, refused, tmp_path):
    x = np.arange(440.0, 600.0, 0.5)
    noise = np.random.default_rng(0).poisson(100.0, x.size)
    rows = "".join(f"{a} {b}\n" for a, b in zip(x, noise, strict=True))
    (tmp_path / "a_none.txt").write_text(rows)
    assert "no silicon line in this spectrum" in refused("raman", tmp_path, below_notes=True)
    xs, ys = synthetic.spectrum(300.0, np.random.default_rng(1))
    line = "".join(f"{a:.3f} {b:.1f}\n" for a, b in zip(xs, ys, strict=True))
    (tmp_path / "b_si.txt").write_text(line)
    status, out, err = run("raman", tmp_path)
    assert status == 0
    assert table(out)[0]["flags"] == "no-line"
    assert table(out)[0]["center_cm-1"] == ""
    assert "a_none.txt: no silicon line" in err
    status, _, _ = run("raman", tmp_path / "b_si.txt", "--plot", tmp_path / "one.svg")
    assert status == 0
    assert "cm⁻¹" in (tmp_path / "one.svg").read_text()


def test_spectra_come_through_a_pipe_and_a_pipe_in_a_folder_is_passed_over(run, examples, tmp_path):
    pipe = tmp_path / "folder" / "pipe.txt"
    pipe.parent.mkdir()
    os.mkfifo(pipe)
    source = examples / "tip" / "tip_00.txt"
    writer = Thread(target=lambda: pipe.write_bytes(source.read_bytes()))
    writer.start()
    _, piped, _ = run("raman", pipe)
    writer.join()
    (tmp_path / "folder" / "tip_00.txt").write_bytes(source.read_bytes())
    status, out, err = run("raman", tmp_path / "folder")
    assert status == 0
    assert "pipe.txt: is a pipe or a device" in err
    assert out == piped.replace("pipe.txt", "tip_00.txt")


def test_equal_names_in_two_folders_are_told_apart(run, examples, tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        source = examples / "tip" / "tip_00.txt"
        (tmp_path / folder / "si.txt").write_bytes(source.read_bytes())
    _, out, _ = run("raman", tmp_path / "a", tmp_path / "b")
    assert [row["file"] for row in table(out)] == [
        str(tmp_path / folder / "si.txt") for folder in ("a", "b")
    ]


BAD = {
    "no such file": (["raman", "none.txt"], "none.txt: no such file or folder"),
    "empty folder": (["raman", "empty"], "empty: the folder holds no spectrum file"),
    "not a spectrum": (["raman", "log.csv"], "log.csv: the axis runs from 1 to 30"),
    "two calibrations": (
        ["raman", "tip", "--calibration", "c.json", "--calibrate-from", "plate"],
        "--calibration and --calibrate-from: expected only one of them",
    ),
    "broken calibration": (["raman", "tip", "--calibration", "log.csv"], "not valid JSON"),
    "law": (["raman", "tip", "--law", "quadratic"], "unknown law 'quadratic'"),
    "shape": (["raman", "tip", "--shape", "gauss"], "unknown line shape 'gauss'"),
    "resolution": (
        ["raman", "tip", "--shape", "voigt", "--resolution", "-3"],
        "found -3, expected a width",
    ),
    "published without reference": (
        ["raman", "tip", "--calibration", "published"],
        "give --reference",
    ),
    "reference without calibration": (
        ["raman", "tip", "--reference", "tip"],
        "--reference: needs --calibration",
    ),
    "laser without resistance": (["raman", "tip", "--laser-power", "1"], "belong together"),
    "laser": (
        ["raman", "tip", "--laser-power", "1e300", "--thermal-resistance", "1"],
        "laser power: found 1e+300, expected 0 to 1000 mW",
    ),
    "thermal resistance": (
        ["raman", "tip", "--laser-power", "1", "--thermal-resistance", "nan"],
        "thermal resistance: found nan, expected 0 to 100000 K/mW",
    ),
    "stress": (
        ["raman", "tip", "--stress", "1e300", "--calibrate-from", "plate"],
        "stress: found 1e+300, expected 0 to 10000 MPa",
    ),
    "stress without calibration": (["raman", "tip", "--stress", "5"], "--stress: needs --calib"),
    "device": (["raman", "/dev/zero"], "/dev/zero: is a device, expected a file"),
    "device as calibration": (["raman", "tip", "--calibration", "/dev/zero"], "is a device"),
    "device as table": (
        ["raman", "tip", "--calibrate-from", "plate", "--temperatures", "/dev/zero"],
        "is a device",
    ),
    "device as log": (["join", "/dev/zero", "tip", "--calibrate-from", "plate"], "is a device"),
    "long name": (["raman", "x" * 5000], "no such file or folder"),
    "table without series": (["raman", "tip", "--temperatures", "t.csv"], "--calibrate-from"),
    "nothing to save": (["raman", "tip", "--save-calibration", "c.json"], "no calibration"),
    "no temperatures": (
        ["raman", "tip", "--calibrate-from", "tip"],
        "no temperature in its header or name",
    ),
    "figure format": (["raman", "tip", "--plot", "f.doc"], "unknown file type '.doc'"),
    "spectrum as output": (["raman", "tip/tip_00.txt", "-o", "tip/tip_00.txt"], "is an input"),
    "log as output": (["join", "log.csv", "tip", "-o", "log.csv"], "is an input"),
    "temperatures as output": (
        ["raman", "tip", "--calibrate-from", "plate", "--temperatures", "log.csv", "-o", "log.csv"],
        "is an input",
    ),
    "table of another type": (["raman", "tip", "-o", "a.svg"], "'.svg', expected .csv"),
    "calibration of another type": (
        ["raman", "tip", "--calibrate-from", "plate", "--save-calibration", "cal.csv"],
        "'.csv', expected .json",
    ),
    "output folder": (["raman", "tip", "-o", "none/t.csv"], "the folder none does not exist"),
    "output is a folder": (["raman", "tip", "-o", "empty"], "is a folder"),
    "no spectra": (["raman"], "FILE_OR_DIR"),
    "unknown option": (["raman", "tip", "--lawn", "linear"], "--law"),
    "join without temperatures": (["join", "log.csv", "tip"], "give --calibration"),
    "join without log": (["join", "none.csv", "tip"], "none.csv: no such file"),
    "join of unequal numbers": (
        ["join", "log.csv", "tip", "--calibrate-from", "plate"],
        "30 rows and 4 spectra",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_status_2_and_no_file(case, refused, examples, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("empty").mkdir()
    Path("tip").symlink_to(examples / "tip")
    Path("plate").symlink_to(examples / "hot-plate")
    Path("log.csv").write_text("V_b (V),I_h (mA)\n" + "".join(f"{i},0.1\n" for i in range(1, 31)))
    before = sorted(path.name for path in tmp_path.iterdir())
    arguments, words = BAD[case]
    assert words in refused(*arguments, below_notes=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_command_line_of_several_files():
    takes = {"--from", "-o", "--law"}
    for words, expected in (
        ("tip --from a b --law linear", "tip --from a --from b --law linear"),
        ("--from a b tip", "--from a b tip"),
        ("--from a b -o out tip", "--from a --from b -o out tip"),
        ("--law linear --from a tip", "--law linear --from a tip"),
        ("tip --from=a b", "tip --from a --from b"),
        ("tip --from a --from b c", "tip --from a --from b --from c"),
        ("tip --from", "tip --from"),
    ):
        assert spread_option(words.split(), "--from", takes) == expected.split()


# --- figures -----------------------------------------------------------------


def test_figure_holds_spectra_calibration_and_residuals(hot_plate):
    found, lines = calibrate_from(read_spectra([hot_plate]))
    table = read_lines(lines, Thermometer(found))
    figure = figures.thermometry(lines, table, found, lines)
    stack, upper, lower = figure.axes
    labels = [text.get_text() for text in stack.texts]
    assert stack.get_legend().get_title().get_text() == "9 of 25 spectra"
    assert labels[0] == "295 K"
    assert labels[-1] == "895 K"
    assert len(labels) == 9
    assert upper.get_ylabel() == "temperature (K)"
    assert lower.get_ylabel() == "law − hot plate (K)"
    drawn = {line.get_label().split(" (")[0]: line for line in lower.lines}
    np.testing.assert_allclose(drawn["line"].get_ydata(), found.residuals()["linear_K"])
    np.testing.assert_allclose(drawn["anharmonic"].get_ydata(), found.residuals()["anharmonic_K"])


def test_figure_without_calibration_or_without_series(examples):
    lines = measure(read_spectra([examples / "tip"]))
    bare = figures.thermometry(lines, read_lines(lines, None))
    assert [text.get_text() for text in bare.axes[0].texts] == [
        line.spectrum.name for line in lines
    ]
    law = published_raman_calibration()
    table = read_lines(lines, Thermometer(law, reference=522.39))
    assert len(figures.thermometry(lines, table, law).axes) == 3


def test_spectra_colder_than_the_room_are_drawn_with_their_law(examples):
    """They were beyond the end of the axis, and the law ended before them."""
    lines = measure(read_spectra([examples / "tip"])[:1])
    # a line at 522.4 cm⁻¹ that is shifted by 1.9 cm⁻¹ to the other side
    table = read_lines(lines, Thermometer(published_raman_calibration(), reference=520.5))
    assert table.temperature_K.item() < 250.0
    _, axes, _ = figures.thermometry(lines, table, published_raman_calibration()).axes
    cold = table.shift_per_cm.item()
    assert max(axes.get_xlim()) > cold
    assert axes.get_lines()[0].get_xdata().max() > cold - 0.1
