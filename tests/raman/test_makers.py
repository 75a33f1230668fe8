"""Spectrometer makers' own formats."""

from __future__ import annotations

import io
import struct
import sys

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.raman.spectrum_reading import read_file, read_spectrum
from spectrometer_files import jcamp_bytes, spc_bytes, wdf_bytes


def test_wire_file_with_two_spectra(silicon, tmp_path):
    x, y = silicon
    file = tmp_path / "map.wdf"
    file.write_bytes(wdf_bytes(x[::-1], [y[::-1], 2 * y[::-1]]))
    first, second = read_file(file)
    assert first.name == "map.wdf[0]"
    np.testing.assert_allclose(first.x, x, rtol=1e-6)
    np.testing.assert_allclose(second.y, 2 * y, rtol=1e-6)
    with pytest.raises(InputError, match="holds 2 spectra"):
        read_spectrum(file)


def test_wire_map_has_its_places_and_temperatures(silicon, tmp_path):
    x, y = silicon
    file = tmp_path / "stage.wdf"
    x_um, y_um, celsius = (3, 5, [0.0, 1.5]), (4, 5, [2.0, 2.0]), (9, 21, [25.0, 100.0])
    file.write_bytes(wdf_bytes(x, [y, y], origins=[x_um, y_um, celsius]))
    assert [one.name for one in read_file(file)] == [
        "stage.wdf[X=0 T=298.15]",
        "stage.wdf[X=1.5 T=373.15]",
    ]
    assert [one.temperature for one in read_file(file)] == [298.15, 373.15]


def test_wire_file_reads_as_by_renishaws_own_reader(silicon, tmp_path):
    peer = pytest.importorskip("wdf", reason="needs renishaw-wdf")
    x, y = silicon
    raw = wdf_bytes(x, [y, 3 * y, y + 5.0], origins=[(3, 5, [0.0, 1.0, 2.0])])
    (tmp_path / "a.wdf").write_bytes(raw)
    theirs = peer.Wdf()
    theirs.open_fd(io.BytesIO(raw))
    ours = read_file(tmp_path / "a.wdf")
    assert len(ours) == len(theirs) == 3
    for place, spectrum in enumerate(ours):
        np.testing.assert_array_equal(spectrum.x, theirs.xlist())
        np.testing.assert_array_equal(spectrum.y, theirs[place])
    assert [one.name for one in ours] == [
        f"a.wdf[X={value:g}]" for value in theirs.origins[peer.WdfDataType.Spatial_X][:]
    ]


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (8, 0, "blocks do not follow each other"),
        (60, 0xFFFF, "65535 samples|not a readable WiRE file"),
        (60, 256, "304 Raman shifts and 256 intensities"),
        (72, 0xFFFFFFFF, "spectra of|not a readable WiRE file"),
    ],
)
def test_damaged_wire_files_are_refused_at_once(silicon, tmp_path, place, value, words):
    raw = bytearray(wdf_bytes(*silicon[:1], [silicon[1]]))
    struct.pack_into("<I", raw, place, value)
    (tmp_path / "a.wdf").write_bytes(raw)
    with pytest.raises(InputError, match=words):
        read_file(tmp_path / "a.wdf")


def test_wire_file_on_a_wavelength_axis(silicon, tmp_path):
    x, y = silicon
    laser = 1e7 / 532.0
    file = tmp_path / "nm.wdf"
    file.write_bytes(wdf_bytes(1e7 / (laser - x), [y], units=3, laser=laser))
    # the axis is stored in single precision
    np.testing.assert_allclose(read_spectrum(file).x, x, atol=5e-3)


@pytest.mark.parametrize("log", [b"", b"Laser=532\r\nTemperature=295\r\n\x00"])
def test_spc_file(silicon, tmp_path, log):
    pytest.importorskip("spc_io", reason="needs the raman extra")
    x, y = silicon
    file = tmp_path / "si.spc"
    file.write_bytes(spc_bytes(x, y, log=log))
    found = read_spectrum(file)
    np.testing.assert_allclose(found.x, x, rtol=1e-6)
    np.testing.assert_allclose(found.y, y, rtol=1e-6)
    file.write_bytes(spc_bytes(x, y, units=3))
    with pytest.raises(InputError, match=r"si\.spc.*the axis is a wavelength"):
        read_spectrum(file)


def test_jcamp_file(silicon, tmp_path):
    pytest.importorskip("jcamp", reason="needs the raman extra")
    x, y = silicon
    file = tmp_path / "si.jdx"
    file.write_bytes(jcamp_bytes(x, y))
    found = read_spectrum(file)
    np.testing.assert_allclose(found.x, x)
    np.testing.assert_allclose(found.y, y)
    file.write_bytes(jcamp_bytes(x, y, units="NANOMETERS"))
    with pytest.raises(InputError, match=r"si\.jdx.*an axis in NANOMETERS, expected a Raman shift"):
        read_spectrum(file)


def test_linked_jcamp_blocks_are_spectra_by_their_titles(silicon, tmp_path):
    pytest.importorskip("jcamp", reason="needs the raman extra")
    x, y = silicon
    blocks = [
        jcamp_bytes(x, scale * y).replace(b"TITLE=Si", f"TITLE=tip {scale} V".encode())
        for scale in (1, 2)
    ]
    file = tmp_path / "a.jdx"
    file.write_bytes(
        b"##TITLE=both\n##DATA TYPE=LINK\n##BLOCKS=2\n" + b"".join(blocks) + b"##END=\n"
    )
    first, second = read_file(file)
    assert (first.name, second.name) == ("a.jdx[tip 1 V]", "a.jdx[tip 2 V]")
    np.testing.assert_allclose(second.y, 2 * first.y)


@pytest.mark.parametrize(
    ("name", "content", "package"),
    [
        ("a.spc", b"\x00\x4b" + bytes(600), "spc-io"),
        ("a.jdx", b"##TITLE=Si\n##END=\n", "jcamp"),
    ],
)
def test_missing_library_is_named_with_the_way_to_get_it(
    name, content, package, tmp_path, monkeypatch
):
    for module in ("spc_io", "jcamp"):
        monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=rf"{package}.*hotlever\[raman\]"):
        read_spectrum(tmp_path / name)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_labspecs_xml_is_named_with_what_to_save_instead(tmp_path, encoding):
    # rows of numbers in XML are pieces of one array: fifteen of each line were spectra
    x = np.linspace(600.0, 440.0, 300)
    lines = "\n".join(" ".join(f"{v:.6g}" for v in row) for row in x.reshape(-1, 15))
    text = (
        f'<?xml version="1.0"?>\n<LSX_Data>\n<LSX_Row Index="0">\n{lines}\n</LSX_Row>\n</LSX_Data>'
    )
    path = tmp_path / "tip.xml"
    path.write_bytes(text.encode(encoding))
    with pytest.raises(InputError, match=r"tip\.xml: LabSpec's XML, .* save the spectrum as \.txt"):
        read_file(path)
    own = tmp_path / "tip.l6s"
    own.write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match=r"tip\.l6s: LabSpec's own format \.l6s, expected text"):
        read_file(own)


def test_other_markup_is_no_table(tmp_path):
    path = tmp_path / "tip.xml"
    lines = "\n".join(f"{v} {v * v}" for v in range(400, 700))
    path.write_text(f"<?xml version='1.0'?>\n<spectrum>\n{lines}\n</spectrum>\n")
    with pytest.raises(InputError, match=r"tip\.xml: an XML or HTML file, expected a table"):
        read_file(path)
