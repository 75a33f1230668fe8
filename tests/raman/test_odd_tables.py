"""Tables with cells, numbers and axes that are easily misread."""

from __future__ import annotations

from gzip import compress

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.raman.line_fit import fit_peak
from hotlever.raman.lineshape import NoSiliconLine
from hotlever.raman.spectrum_reading import read_spectrum


def columns(x, y):
    return "".join(f"{a:.3f}\t{b:.1f}\n" for a, b in zip(x, y, strict=True))


@pytest.mark.parametrize(
    ("mark", "sign", "encoding"),
    [(".", ",", "cp1252"), (",", ".", "utf-8"), ("\u202f", ",", "utf-8"), ("'", ".", "utf-8")],
)
def test_marks_between_thousands_are_no_decimal_signs(mark, sign, encoding, silicon, tmp_path):
    x, y = silicon
    lines = ["Verschiebung;Intensität"]
    for a, b in zip(x, y, strict=True):
        shift, counts = f"{a:.3f}".replace(".", sign), f"{100 * b:,.1f}"
        counts = counts.replace(",", "_").replace(".", sign).replace("_", mark)
        lines.append(f"{shift};{counts}")
    file = tmp_path / "si.csv"
    file.write_bytes("\r\n".join(lines).encode(encoding))
    found = read_spectrum(file)
    np.testing.assert_allclose(found.x, x)
    np.testing.assert_allclose(found.y, 100 * y)


def test_cells_without_a_number_are_gaps_as_long_as_they_are_few(silicon, tmp_path):
    x, y = silicon
    file = tmp_path / "si.txt"
    codes = ["NaN", "OVER", "1.#QNAN", "-inf", "", "#NUM!"]
    cells = [codes[i % 6] if i % 20 == 0 else f"{b:.1f}" for i, b in enumerate(y)]
    lines = [f"{a:.3f}\t{cell}" for a, cell in zip(x, cells, strict=True)]
    file.write_text("shift\tcounts\n" + "\n".join(lines))
    keep = np.arange(x.size) % 20 > 0
    found = read_spectrum(file)
    np.testing.assert_allclose(found.x, x[keep])
    np.testing.assert_allclose(found.y, y[keep])
    lines[1::5] = [f"{line} cts" for line in lines[1::5]]
    file.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"\d+ rows of 304 have a cell that is no number.* cts'"):
        read_spectrum(file)


def test_packed_files_keep_kind_and_temperature(silicon, tmp_path):
    file = tmp_path / "si_450K.txt.gz"
    file.write_bytes(compress(columns(*silicon).encode()))
    assert read_spectrum(file).temperature == 450.0
    file = tmp_path / "si.wdf.gz"
    file.write_bytes(compress(bytes(5000)))
    with pytest.raises(InputError, match="not a readable WiRE file"):
        read_spectrum(file)


def test_a_wavelength_that_looks_like_a_shift_holds_no_line(silicon, tmp_path):
    """By a laser of 514.5 nm, silicon's line is at 528.6 nm, where a hot line could be in cm⁻¹."""
    x, y = silicon
    nm = 1e7 / (1e7 / 514.5 - np.r_[np.arange(-600.0, 440.0, 0.527), x])
    (tmp_path / "nm.txt").write_text(columns(nm, np.r_[np.full(nm.size - y.size, y[0]), y]))
    found = read_spectrum(tmp_path / "nm.txt")
    with pytest.raises(NoSiliconLine):
        fit_peak(found.x, found.y)
