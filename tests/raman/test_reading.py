"""Files that spectrometers write, and files that are no spectra."""

from __future__ import annotations

from gzip import compress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hotlever.errors import InputError
from hotlever.raman.line_fit import fit_peak
from hotlever.raman.series import measure
from hotlever.raman.spectrum import temperature_in_metadata, temperature_in_name
from hotlever.raman.spectrum_reading import read_file, read_spectra, read_spectrum, spectrum_files
from hotlever.tables import find_tables


def rows(x, y, separator="\t", comma=False, end="\n"):
    lines = [f"{a:.3f}{separator}{b:.1f}" for a, b in zip(x, y, strict=True)]
    text = end.join(lines) + end
    return text.replace(".", ",") if comma else text


LABSPEC = (
    "#Acq. time (s)=\t30\r\n#Detector temperature (°C)=\t-70.02\r\n#Laser (nm)=\t632.8\r\n"
    "#Spectro (cm⁻¹)=\t520.003\r\n#Temperature (K)=\t345.0\r\n"
)

DIALECTS = {
    "tab": lambda x, y: rows(x, y).encode(),
    "semicolon": lambda x, y: rows(x, y, ";").encode(),
    "comma": lambda x, y: rows(x, y, ",").encode(),
    "comma and blank": lambda x, y: rows(x, y, ", ").encode(),
    "blanks": lambda x, y: ("  " + rows(x, y, "    ", end="\n  ")).encode(),
    "decimal comma, tab": lambda x, y: rows(x, y, "\t", comma=True).encode(),
    "decimal comma, semicolon": lambda x, y: rows(x, y, ";", comma=True).encode(),
    "decimal comma, blanks": lambda x, y: rows(x, y, "  ", comma=True).encode(),
    "utf-8 with mark": lambda x, y: ("Raman Shift (cm⁻¹),I\n" + rows(x, y, ",")).encode(
        "utf-8-sig"
    ),
    "utf-16": lambda x, y: ("Raman Shift (cm⁻¹)\tI\r\n" + rows(x, y, end="\r\n")).encode("utf-16"),
    "utf-16 without mark": lambda x, y: rows(x, y).encode("utf-16-le"),
    "labspec, latin-1": lambda x, y: (LABSPEC.replace("⁻¹", "-¹") + rows(x, y, end="\r\n")).encode(
        "latin-1"
    ),
    "labspec, utf-8": lambda x, y: (LABSPEC + rows(x, y, end="\r\n")).encode(),
    "vertical bars": lambda x, y: rows(x, y, " | ").encode(),
    "old mac line ends": lambda x, y: rows(x, y, end="\r").encode(),
    "wire text": lambda x, y: (
        "#Wave\t\t#Intensity\n" + rows(x[::-1], y[::-1], "\t\t", end="\n")
    ).encode(),
    "witec table": lambda x, y: ("X-Axis\tY-Axis\nrel. 1/cm\tCCD cts\n" + rows(x, y)).encode(),
    "ocean optics": lambda x, y: (
        "Data from Si.txt Node\n\nDate: Tue Oct 05 10:38:02 CEST 2021\nUser: ab\n"
        "Integration Time (sec): 1.000000E1\nNumber of Pixels in Spectrum: 304\n"
        ">>>>>Begin Spectral Data<<<<<\n" + rows(x, y) + ">>>>>End Spectral Data<<<<<\n"
    ).encode(),
    "header with units": lambda x, y: (
        "Raman shift [1/cm];Intensity [counts]\n" + rows(x, y, ";")
    ).encode(),
    "quoted": lambda x, y: (
        '"Raman shift","Intensity"\n'
        + "".join(f'"{a:.3f}","{b:.1f}"\n' for a, b in zip(x, y, strict=True))
    ).encode(),
    "running number first": lambda x, y: (
        "".join(f"{i};{a:.3f};{b:.1f}\n" for i, (a, b) in enumerate(zip(x, y, strict=True)))
    ).encode(),
    "exponents": lambda x, y: (
        "".join(f"{a:.6e} {b:.6E}\n" for a, b in zip(x, y, strict=True))
    ).encode(),
    "trailing separators and blank lines": lambda x, y: (
        rows(x, y, ";").replace("\n", ";\n\n")
    ).encode(),
    "laser and wavelength": lambda x, y: (
        "Laser wavelength: 532.0 nm\nWavelength (nm)\tCounts\n"
        + "".join(f"{1e7 / (1e7 / 532.0 - a):.7f}\t{b:.1f}\n" for a, b in zip(x, y, strict=True))
    ).encode(),
    "intensity first": lambda x, y: "".join(
        f"{b:.1f}\t{a:.3f}\n" for a, b in zip(x, y, strict=True)
    ).encode(),
    "laser above the headings": lambda x, y: (
        "Laser (nm)\t532.0\nWavelength (nm)\tCounts\n"
        + "".join(f"{1e7 / (1e7 / 532.0 - a):.7f}\t{b:.1f}\n" for a, b in zip(x, y, strict=True))
    ).encode(),
    "gzip": lambda x, y: compress(rows(x, y).encode()),
    "andor, header below": lambda x, y: (
        rows(x, y, ",") + "\n\nTemperature (C):\t-70\nModel:\tDU401\nExposure Time (secs):\t10\n"
    ).encode(),
    "witec ascii": lambda x, y: (
        "//Exported ASCII-File\r\n\r\n[Header]\r\nFileName = Tip\r\nSizeGraph = 304\r\n\r\n"
        "[Data]\r\n" + rows(x, y, end="\r\n")
    ).encode(),
    "excel": lambda x, y: (
        "sep=;\r\nVerschiebung;Intensität\r\n" + rows(x, y, ";", comma=True, end="\r\n")
    ).encode("cp1252"),
    "a comment amid": lambda x, y: rows(x, y).replace("\n", "\n# stage moved\n", 1).encode(),
    "raw, dark and fit beside": lambda x, y: (
        "shift\tDark counts\traw\tRaw-Dark\tfit\n"
        + "".join(
            f"{a:.3f}\t{900 + i % 3}\t{b + 901:.1f}\t{b:.1f}\t{b + 1:.1f}\n"
            for i, (a, b) in enumerate(zip(x, y, strict=True))
        )
    ).encode(),
    "bwtek": lambda x, y: (
        "File Version;BWRam4.11_11\nlaser_wavelength;532,02\n"
        "Pixel;Wavelength;Wavenumber;Raman Shift;Dark;Reference;Raw data #1;"
        "Dark Subtracted #1;%TR #1;\n"
        "0;   ;   ;   ;1535,0000;65535,0000;1584,5000;49,5000;0,0000;\n"
        "1;   ;   ;   ;1495,0000;65535,0000;1539,0000;44,0000;0,0000;\n"
        + "".join(
            f"{i + 2};{500 + 0.1 * i:.2f};{18000 - i:.2f};{a:.3f};1500,0000;65535,0000;"
            f"{b + 1500:.4f};{b:.4f};0,0000;\n".replace(".", ",")
            for i, (a, b) in enumerate(zip(x, y, strict=True))
        )
        + "2047;   ;   ;   ;1068,0000;65535,0000;1061,5000;-6,5000;0,0000;\n"
    ).encode(),
}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_every_dialect_gives_the_same_spectrum(dialect, silicon, tmp_path):
    x, y = silicon
    file = tmp_path / "spectrum.txt"
    file.write_bytes(DIALECTS[dialect](x, y))
    found = read_spectrum(file)
    np.testing.assert_allclose(found.x, x, atol=2e-3)
    np.testing.assert_allclose(found.y, y, atol=1e-9)


def test_labspec_map_gives_all_its_spectra(silicon, tmp_path):
    x, y = silicon
    file = tmp_path / "map.txt"
    lines = ["\t\t" + "\t".join(f"{a:.3f}" for a in x)]
    lines += [f"{i}\t5.5\t" + "\t".join(f"{b * (i + 1):.1f}" for b in y) for i in range(2)]
    file.write_text("\n".join(lines))
    first, second = read_file(file)
    assert (first.name, second.name) == ("map.txt[0]", "map.txt[1]")
    np.testing.assert_allclose(first.x, x)
    np.testing.assert_allclose(second.y, 2 * y)


def test_a_column_that_happens_to_pass_520_is_no_axis(tmp_path):
    """The virtual lab's bias sweep: V_r runs from 60 to 940 mV."""
    file = tmp_path / "lever.csv"
    file.write_text(
        "V_b (V),I_h (mA),V_r (mV)\n"
        + "".join(f"{i},{np.sin(i):.4f},{60 + 35 * i}\n" for i in range(1, 26))
    )
    with pytest.raises(InputError, match=r"lever\.csv: \d samples between 440 and 600"):
        read_spectrum(file)


def test_labspec_header_is_kept_and_its_sample_temperature_found(silicon, tmp_path):
    file = tmp_path / "a_500K.txt"
    file.write_bytes(DIALECTS["labspec, latin-1"](*silicon))
    found = read_spectrum(file)
    assert found.metadata["Laser (nm)"] == "632.8"
    assert found.metadata["Detector temperature (°C)"] == "-70.02"
    assert found.temperature == 345.0  # the header, not the name


def test_repeated_axis_values_are_averaged(tmp_path):
    file = tmp_path / "twice.txt"
    file.write_text("".join(f"{500 + i // 2} {i}\n" for i in range(100)))
    found = read_spectrum(file)
    assert np.all(np.diff(found.x) > 0)
    np.testing.assert_array_equal(found.y[:3], [0.5, 2.5, 4.5])


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    separator=st.sampled_from(["\t", ";", " ", "   ", "\t\t"]),
    comma=st.booleans(),
    end=st.sampled_from(["\n", "\r\n"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"]),
    header=st.lists(
        st.text(st.characters(codec="latin-1", categories=("L", "N", "Zs")), max_size=12),
        max_size=4,
    ),
    descending=st.booleans(),
    start=st.floats(-100.0, 500.0),
    step=st.floats(0.01, 5.0),
    seed=st.integers(0, 2**31),
)
def test_any_table_of_two_columns_is_read_back(
    separator, comma, end, encoding, header, descending, start, step, seed
):
    count = int((540.0 - start) / step) + 10
    count = min(max(count, 30), 500)
    x = np.round(540.0 - step * np.arange(count)[::-1], 3)
    y = np.round(np.random.default_rng(seed).uniform(-50.0, 1e5, count), 2)
    order = slice(None, None, -1) if descending else slice(None)
    lines = [f"#{key}=\tx{key}" for key in header if key.strip()]
    lines += [f"{a:.3f}{separator}{b:.2f}" for a, b in zip(x[order], y[order], strict=True)]
    text = end.join(lines)
    if comma:
        text = text.replace(".", ",")
    (table,) = find_tables(text.encode(encoding), "f")
    np.testing.assert_allclose(table.array[order], np.stack([x, y], axis=1), atol=1e-9)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(raw=st.binary(max_size=400))
def test_no_bytes_end_in_anything_but_a_spectrum_or_one_line(raw, tmp_path_factory):
    file = tmp_path_factory.getbasetemp() / "any.txt"
    file.write_bytes(raw)
    message = ""
    try:
        read_file(file)
    except InputError as error:
        message = str(error)
    assert "\n" not in message
    assert not message or str(file) in message


BAD = {
    "empty": (b"", "the file is empty"),
    "blank": (b" \n\r\n", "the file is empty"),
    "binary": (bytes(range(256)) * 20, "a binary file"),
    "picture": (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + bytes(99), "a binary file"),
    "prose": (b"Dear all,\nhere is no spectrum.\nYours\n", "no table of numbers"),
    "page": (b"<html><body><p>404</p></body></html>", "an XML or HTML file"),
    "one column": ("\n".join(map(str, range(400, 600))).encode(), "one column"),
    "bias log": (
        b"V_b (V),I_h (mA)\n" + b"".join(b"%d.5,0.%d\n" % (i, i) for i in range(1, 40)),
        "the axis runs from 1.5 to 39.5",
    ),
    "short of the line": (
        b"".join(b"%d %d\n" % (i, i) for i in range(600, 900)),
        "the axis runs from 600 to 899",
    ),
    "few rows": (b"500 1\n510 2\n520 3\n530 4\n", "4 samples between 440 and 600"),
    "wavelength without laser": (
        b"Wavelength (nm),Counts\n" + b"".join(b"%d,%d\n" % (i, i % 7) for i in range(500, 600)),
        "does not name the laser",
    ),
    "flat": (b"".join(b"%d 7\n" % i for i in range(450, 600)), "no column of intensities"),
    "truncated wdf": (b"WDF1" + bytes(40), "not a readable WiRE file"),
    "decimal commas between commas": (
        b"".join(b"%d,%02d,%d,%02d\n" % (i // 2, 50 * (i % 2), i % 7, i % 100) for i in range(900)),
        "decimal commas between commas",
    ),
    "two tables": (
        b"".join(b"%d %d\n" % (i, i % 7) for i in range(450, 600))
        + b"".join(b"%d %d %d\n" % (i, i % 7, i % 5) for i in range(450, 600)),
        "150 rows of 2 numbers and 150 of 3",
    ),
    "gzip of nothing": (compress(b""), "the file is empty"),
    "gzip cut short": (compress(b"500 1\n" * 99)[:-9], "not a readable gzip file .cut short"),
    "million lines": (b"520 1\n" * 1_000_000, "1000000 lines, expected at most 600000"),
    "one line": (b"1 " * 100_000, "line 1: 200000 characters"),
    "huge jcamp": (
        b"##TITLE=a\n##NPOINTS=1000000000\n##FIRSTX=0\n##LASTX=9\n##XYDATA=(X++(Y..Y))\n0 1\n",
        "more NPOINTS than the file can hold",
    ),
    "jcamp bomb": (
        b"##TITLE=a\n##XYDATA=(X++(Y..Y))\n440J1" + b"1Z" * 50_000 + b"\n##END=\n",
        "a repeat count without a value",
    ),
}


@pytest.mark.parametrize("kind", BAD)
def test_what_is_no_spectrum_gets_one_clear_line(kind, tmp_path):
    content, words = BAD[kind]
    file = tmp_path / "file.txt"
    file.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        read_spectrum(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file_and_folder_without_spectra(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_spectrum(tmp_path / "none.txt")
    with pytest.raises(InputError, match="no such file or folder"):
        read_spectra([tmp_path / "none"])
    with pytest.raises(InputError, match="holds no spectrum file"):
        read_spectra([tmp_path])
    (tmp_path / "notes.txt").write_text("nothing here")
    with pytest.raises(InputError, match=r"none of 1 files is a spectrum.*notes\.txt"):
        read_spectra([tmp_path])


def test_folder_is_read_in_natural_order_and_passes_over_other_files(silicon, tmp_path):
    for number in (10, 9, 1):
        (tmp_path / f"tip_{number}.txt").write_bytes(DIALECTS["tab"](*silicon))
    (tmp_path / "log.txt").write_text("V\n1\n")
    (tmp_path / ".hidden").write_text("x")
    skipped: list[str] = []
    names = [spectrum.name for spectrum in read_spectra([tmp_path], skipped)]
    assert names == ["tip_1.txt", "tip_9.txt", "tip_10.txt"]
    assert len(skipped) == 1
    assert "log.txt" in skipped[0]
    assert next(file.name for file, _ in spectrum_files([tmp_path])) == "log.txt"


@pytest.mark.parametrize(
    ("stem", "kelvin"),
    [
        ("si_450K", 450.0),
        ("25C", 298.15),
        ("Si 300 K", 300.0),
        ("T=627,5K_a", 627.5),
        ("si100_T450K_2", 450.0),
        ("run3_-20C", 253.15),
        ("x50_532nm_10mW", None),
        ("Probe_100_60000msx2", None),
        ("100C0", None),
        ("99999K", None),
    ],
)
def test_temperature_in_a_file_name(stem, kelvin):
    assert temperature_in_name(stem) == kelvin


@pytest.mark.parametrize(
    ("key", "value", "kelvin"),
    [
        ("Temperature (K)", "295.0", 295.0),
        ("Temperature (°C)", "25", 298.15),
        ("Sample temperature [C]", "100,5", 373.65),
        ("Temperature", "450 K", 450.0),
        ("Temperature", "0", None),
        ("Detector temperature (°C)", "-75", None),
        ("Temperature (C)", "-70", None),  # Andor's detector
        ("Stage temperature (C)", "-70", 203.15),
        ("Temperature (K)", "77", 77.0),
        ("T (K)", "abc", None),
    ],
)
def test_temperature_in_a_header(key, value, kelvin):
    assert temperature_in_metadata({key: value}) == kelvin


def test_text_under_a_makers_suffix_is_read_as_text(silicon, tmp_path):
    file = tmp_path / "si.spc"
    file.write_bytes(DIALECTS["tab"](*silicon))
    np.testing.assert_allclose(read_spectrum(file).y, silicon[1])


# --- real files ----------------------------------------------------------------------------


def test_real_files_are_read_and_hold_a_line(real_spectra: list[Path]):
    expected = {"FMNT-M_BW532": 1800, "FMNT-M_Ho785": 1000, "labram": 1010}
    spectra = read_spectra(real_spectra)
    assert len(spectra) == len(expected)
    for spectrum, (start, samples) in zip(spectra, sorted(expected.items()), strict=True):
        assert spectrum.name.startswith(start)
        assert spectrum.x.size >= samples
        peak = fit_peak(spectrum.x, spectrum.y)
        # calibration of these instruments is good to a few wavenumbers
        assert abs(peak.centre - 520.5) < max(3.0, 3.0 * peak.centre_stderr)


def test_bwtek_dark_subtracted_column_and_raman_shift_are_chosen(real_spectra: list[Path]):
    found = read_spectrum(real_spectra[0])
    at = np.searchsorted(found.x, 451.10)
    assert found.x[at] == pytest.approx(451.10)
    assert found.y[at] == pytest.approx(2446.5)


def test_saturated_real_spectrum_is_flagged(real_spectra: list[Path]):
    spectrum = read_spectrum(real_spectra[2])
    peak = fit_peak(spectrum.x, spectrum.y)
    assert "saturated" in peak.flags
    assert spectrum.metadata["Instrument"] == "LabRAM HR Evol"
    assert spectrum.temperature is None  # "Temperature= 0" has no unit


@pytest.mark.parametrize("word", ["OVERFLOW", "NaN", "9.91E37", "", "#N/A"])
def test_a_line_whose_top_has_no_values_is_saturated(tmp_path, word):
    x = np.arange(440.0, 600.0, 0.6)
    y = np.random.default_rng(3).poisson(200.0 + 5000.0 / (1.0 + ((x - 520.7) / 1.6) ** 2))
    for name, gaps in {"top": y > 3500, "flank": np.abs(x - 525.0) < 0.4}.items():
        cells = [word if gap else str(count) for gap, count in zip(gaps, y.tolist(), strict=True)]
        lines = (f"{place:.3f},{cell}" for place, cell in zip(x, cells, strict=True))
        (tmp_path / f"{name}.csv").write_text("\n".join(lines))
    flank, top = measure(read_spectra([tmp_path]))
    assert "saturated" in top.flags
    assert "saturated" not in flank.flags
    assert top.peak.clipped == pytest.approx((x[y > 3500][0], x[y > 3500][-1]), abs=1e-3)
    assert abs(top.peak.centre - 520.7) < 3.0 * top.peak.centre_stderr < 1.0
    # the flanks alone say less of the centre
    assert top.peak.centre_stderr > flank.peak.centre_stderr


def test_zeros_at_the_top_of_a_line_are_what_a_detector_writes_beyond_its_range(tmp_path):
    """They were left out as a cosmic ray is, and the line stood as if it were whole."""
    x = np.arange(440.0, 600.0, 0.6)
    y = np.random.default_rng(3).poisson(5.0 + 5000.0 / (1.0 + ((x - 520.7) / 1.6) ** 2))
    counts = np.where(y > 3500, 0, y)
    (tmp_path / "top.csv").write_text(
        "\n".join(f"{place:.3f},{count}" for place, count in zip(x, counts, strict=True))
    )
    (line,) = measure(read_spectra([tmp_path]))
    assert "saturated" in line.flags
    assert "cosmic-ray" not in line.flags
    assert line.peak.clipped == pytest.approx((x[y > 3500][0], x[y > 3500][-1]), abs=1e-3)
    assert abs(line.peak.centre - 520.7) < 3.0 * line.peak.centre_stderr < 1.0
