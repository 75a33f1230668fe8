"""Files with several spectra: each is a row of its own, and told from the others."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

import synthetic_spectra as synthetic
from hotlever.errors import InputError
from hotlever.raman.spectrum_reading import read_file
from hotlever.tables import find_tables
from spectrometer_files import wdf_bytes

TEMPERATURES = (296.0, 500.0, 800.0, 1137.0)
NO_SPIKES = synthetic.Instrument(spike_rate=0.0)


@pytest.fixture(scope="module")
def series() -> tuple[np.ndarray, np.ndarray]:
    """Four spectra on one axis: (304,) and (4, 304), rounded as files hold them."""
    rng = np.random.default_rng(2)
    spectra = [synthetic.spectrum(kelvin, rng, NO_SPIKES) for kelvin in TEMPERATURES]
    return np.round(spectra[0][0], 3), np.round([y for _, y in spectra], 1)


def columns(x, ys, heading="", separator="\t"):
    table = np.column_stack([x, *ys])
    lines = [separator.join(f"{value:.3f}" for value in row) for row in table]
    return "\n".join([heading, *lines] if heading else lines) + "\n"


def wire(
    x, ys, places=((0, 2), (1.5, 2), (3, 2), (4.5, 2)), heading="#X\t\t#Y\t\t#Wave\t\t#Intensity"
):
    lines = [heading] if heading else []
    for place, y in zip(places, ys, strict=True):
        lines += [
            "\t\t".join(f"{value:.6f}" for value in (*place, a, b))
            for a, b in zip(x[::-1], y[::-1], strict=True)
        ]
    return "\n".join(lines)


def wave_outer(x, ys):
    lines = ["#X\t#Y\t#Wave\t#Intensity"]
    lines += [f"{i}\t0\t{a}\t{ys[i][k]}" for k, a in enumerate(x) for i in range(len(ys))]
    return "\n".join(lines)


def one_after_the_other(x, ys):
    return "".join(
        f"#Laser (nm)=\t532\n#Temperature (K)=\t{kelvin}\n" + columns(x, [y])
        for kelvin, y in zip(TEMPERATURES, ys, strict=True)
    )


def rows(x, ys, corner="time_s,"):
    lines = [corner + ",".join(f"{a:.3f}" for a in x)]
    lines += [f"{10 * i}," + ",".join(f"{b:.1f}" for b in y) for i, y in enumerate(ys)]
    return "\n".join(lines)


def pairs(x, ys):
    """Each spectrum with its own axis; the last is shorter."""
    lines = ["x1;a;x2;b;x3;c;x4;d"]
    for k, a in enumerate(x):
        cells = [f"{a:.3f};{y[k]:.1f}" for y in ys]
        lines.append(";".join(cells[:3] + (["" + ";"] if k > 280 else cells[3:])))
    return "\n".join(lines)


NUMBERED = ["[0]", "[1]", "[2]", "[3]"]
BY_X = ["[X=0]", "[X=1.5]", "[X=3]", "[X=4.5]"]
LAYOUTS = {
    "columns without headings": (columns, NUMBERED),
    "columns of one name": (
        lambda x, ys: columns(x, ys, "Raman shift\tcounts\tcounts\tcounts\tcounts"),
        NUMBERED,
    ),
    "columns with headings": (
        lambda x, ys: columns(x, ys, "shift (cm-1);0 V;2,5 V;5 V;base/edge", ";"),
        ["[0 V]", "[2 5 V]", "[5 V]", "[base edge]"],
    ),
    "columns after a running number": (
        lambda x, ys: columns(np.arange(x.size), [x, *ys], ",shift,a,b,c,d", ","),
        ["[a]", "[b]", "[c]", "[d]"],
    ),
    "an axis for each": (pairs, ["[a]", "[b]", "[c]", "[d]"]),
    "WiRE map": (wire, BY_X),
    "WiRE map without heading": (lambda x, ys: wire(x, ys, heading=""), NUMBERED),
    "WiRE map of one place": (lambda x, ys: wire(x, ys, [(0, 0)] * 4), NUMBERED),
    "WiRE map by wave": (wave_outer, ["[X=0]", "[X=1]", "[X=2]", "[X=3]"]),
    "WiRE series": (
        lambda x, ys: wire(x, ys, [(0,), (60,), (120,), (180,)], "#Time\t\t#Wave\t\t#Intensity"),
        ["[Time=0]", "[Time=60]", "[Time=120]", "[Time=180]"],
    ),
    "blocks below each other": (
        lambda x, ys: "".join(columns(x, [y], "#Wave\t#Intensity") for y in ys),
        NUMBERED,
    ),
    "blocks with nothing between": (lambda x, ys: "".join(columns(x, [y]) for y in ys), NUMBERED),
    "headers and blocks": (one_after_the_other, NUMBERED),
    "LabSpec map": (lambda x, ys: rows(x, ys, ","), NUMBERED),
    "axis in the headings": (
        rows,
        ["[time_s=0]", "[time_s=10]", "[time_s=20]", "[time_s=30]"],
    ),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_spectrum_of_a_text_file_is_read(layout, series, tmp_path):
    x, ys = series
    make, labels = LAYOUTS[layout]
    file = tmp_path / "all.txt"
    file.write_text(make(x, ys))
    found = read_file(file)
    assert [one.name for one in found] == [f"all.txt{label}" for label in labels]
    for spectrum, y in zip(found, ys, strict=True):
        np.testing.assert_allclose(spectrum.x, x[: spectrum.x.size], atol=1e-9)
        np.testing.assert_allclose(spectrum.y, y[: spectrum.x.size], atol=1e-9)
        assert spectrum.x.size >= 281


def test_temperatures_are_those_of_each_spectrum(series, tmp_path):
    x, ys = series
    headings = "shift\t" + "\t".join(f"{kelvin:g} K" for kelvin in TEMPERATURES)
    for name, text in (
        ("a_20C.txt", columns(x, ys, headings)),
        ("b.txt", one_after_the_other(x, ys)),
        (
            "c.txt",
            wire(x, ys, [(t,) for t in TEMPERATURES], "#Temperature (K)\t\t#Wave\t\t#Intensity"),
        ),
    ):
        (tmp_path / name).write_text(text)
        assert [one.temperature for one in read_file(tmp_path / name)] == list(TEMPERATURES)
    (tmp_path / "d_20C.txt").write_text(columns(x, ys))
    assert [one.temperature for one in read_file(tmp_path / "d_20C.txt")] == [293.15] * 4


def test_windows_that_overlap_are_one_spectrum(series, tmp_path):
    x, (y, *_) = series
    x, y = np.r_[x[:160], x[150:] + 0.1], np.r_[y[:160], y[150:]]
    (tmp_path / "stitched.txt").write_text(columns(x, [y]))
    (found,) = read_file(tmp_path / "stitched.txt")
    assert found.x.size == x.size


def test_only_the_best_form_of_an_intensity_is_a_spectrum(series, tmp_path):
    x, (y, *_) = series
    for heading in (
        "shift;Raw;Baseline;Corrected",
        "shift;Pixel;Dark;Intensity",
        "Raman_Shift;Raw_Data;Background_Data;Processed_Data",
        "shift;x (µm);fit;y",
    ):
        others = [y + 90.0, np.random.default_rng(0).normal(90.0, 1.0, x.size)]
        (tmp_path / "a.csv").write_text(columns(x, [*others, y], heading, ";"))
        (found,) = read_file(tmp_path / "a.csv")
        np.testing.assert_allclose(found.y, y)


UNCLEAR = {
    "intensity and something": (
        lambda x, ys: columns(x, ys[:2], "shift,Intensity,P1", ","),
        "the columns beside the axis are 'Intensity', 'P1'; expected intensities alone",
    ),
    "other quantities": (
        lambda x, ys: columns(x, ys[:2], "Raman shift (cm-1),T (K),p (mbar)", ","),
        r"the columns beside the axis are 'T \(K\)', 'p \(mbar\)'",
    ),
    "another axis": (
        lambda x, ys: columns(x, ys[:2], "T (K),U (V),I (mA)", ","),
        r"the axis is 'T \(K\)', expected a Raman shift",
    ),
    "counts and their error": (
        lambda x, ys: columns(x, [ys[0], np.round(np.sqrt(ys[0]), 2)]),
        "columns 2 and 3 rise and fall as one",
    ),
    "no axis": (
        lambda x, ys: columns(np.random.default_rng(0).permutation(x), ys),
        "none of 5 columns rises or falls all the way",
    ),
    "there and back": (
        lambda x, ys: columns(np.r_[x, x[::-1]], [np.r_[ys[0], ys[2][::-1]]]),
        "none of 2 columns rises or falls all the way",
    ),
    "last one cut short": (
        lambda x, ys: wire(x, ys).rsplit("\n", 260)[0],
        r"\[X=4.5\]: the axis runs from \d+\.?\d* to 59\d",
    ),
}


@pytest.mark.parametrize("case", UNCLEAR)
def test_columns_that_are_not_clearly_spectra_are_refused(case, series, tmp_path):
    make, words = UNCLEAR[case]
    (tmp_path / "a.txt").write_text(make(*series))
    with pytest.raises(InputError, match=words) as caught:
        read_file(tmp_path / "a.txt")
    assert str(tmp_path / "a.txt") in str(caught.value)
    assert "\n" not in str(caught.value)


# --- on the command line -------------------------------------------------------------------


def table(text):
    rows = [line for line in io.StringIO(text) if not line.startswith("#")]
    return list(csv.DictReader(rows))


def test_a_map_has_a_row_for_each_spectrum_and_a_line_says_so(run, series, hot_plate, tmp_path):
    x, ys = series
    (tmp_path / "map.txt").write_text(wire(x, ys))
    (tmp_path / "map.wdf").write_bytes(wdf_bytes(x[::-1], [y[::-1] for y in ys]))
    for name, labels in (("map.txt", BY_X), ("map.wdf", NUMBERED)):
        status, out, err = run("raman", tmp_path / name, "--calibrate-from", hot_plate)
        assert status == 0
        assert f"{name}: 4 spectra in one file" in err
        assert [row["file"] for row in table(out)] == [name + label for label in labels]
        for row, kelvin in zip(table(out), TEMPERATURES, strict=True):
            error = float(row["temperature_error_K"])
            assert abs(float(row["temperature_K"]) - kelvin) < 4.0 * error < 60.0
        # the average of all four is none of them
        assert float(table(out)[3]["center_cm-1"]) < 502.0


def test_one_file_calibrates_and_one_is_joined(run, tmp_path):
    rng = np.random.default_rng(4)
    plate = [float(kelvin) for kelvin in range(295, 900, 75)]
    spectra = [synthetic.spectrum(kelvin, rng, NO_SPIKES) for kelvin in plate]
    x, ys = spectra[0][0], [y for _, y in spectra]
    headings = "shift\t" + "\t".join(f"{kelvin:g} K" for kelvin in plate)
    (tmp_path / "plate.txt").write_text(columns(x, ys, headings))
    (tmp_path / "tip.txt").write_text(columns(x, ys[::4], "shift\t0.5 V\t5.25 V\t7.5 V"))
    (tmp_path / "log.csv").write_text("V_b (V),I_h (mA)\n7.5,3\n0.5,1\n2.0,1.5\n5.25,2\n")
    status, out, err = run(
        *("join", tmp_path / "log.csv", tmp_path / "tip.txt"),
        *("--calibrate-from", tmp_path / "plate.txt"),
    )
    assert status == 0, err
    assert "calibrated from 9 spectra, 295 to 895 K" in err
    assert [row["V_b (V)"] for row in table(out)] == ["7.5", "0.5", "2.0", "5.25"]
    for row, kelvin in zip(table(out), (895.0, 295.0, None, 595.0), strict=True):
        if kelvin is None:
            assert row["T_tip (K)"] == ""
        else:
            assert abs(float(row["T_tip (K)"]) - kelvin) < 4.0 * float(row["dT_tip (K)"])
    # the same by names, and by a table of temperatures
    (tmp_path / "names.csv").write_text(
        "V_b (V),file\n7.5,tip.txt[7.5 V]\n0.5,tip[0.5 V]\n5.25,tip.txt[5.25 V]\n"
    )
    (tmp_path / "temperatures.csv").write_text(
        "file,T (K)\n" + "".join(f"plate[{kelvin:g} K],{kelvin}\n" for kelvin in plate)
    )
    status, by_name, err = run(
        *("join", tmp_path / "names.csv", tmp_path / "tip.txt"),
        *("--calibrate-from", tmp_path / "plate.txt"),
        *("--temperatures", tmp_path / "temperatures.csv"),
    )
    assert status == 0, err
    expected = {row["V_b (V)"]: row["T_tip (K)"] for row in table(out)}
    assert {row["V_b (V)"]: row["T_tip (K)"] for row in table(by_name)} == {
        bias: expected[bias] for bias in ("7.5", "0.5", "5.25")
    }


def test_headings_between_two_tabs_stand_above_numbers_between_one(series):
    text = wire(*series).replace("\t\t", "\t").replace("#X\t#Y\t#Wave\t", "#X\t\t#Y\t\t#Wave\t\t")
    tables = find_tables(text.encode(), "map.txt")
    assert {tuple(table.names) for table in tables} == {("#X", "#Y", "#Wave", "#Intensity")}
