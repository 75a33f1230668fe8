"""Cut, overwritten and flipped files end in spectra or in one line, at once."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from gzip import compress

import numpy as np
import pytest

from hotlever.errors import InputError
from hotlever.raman.series import measure
from hotlever.raman.spectrum import Spectrum
from hotlever.raman.spectrum_reading import read_file
from limits import time_limit
from spectrometer_files import jcamp_bytes, spc_bytes, wdf_bytes

LIMIT_S = 5.0  # of a machine with other work to do; it takes some 10 ms
LIBRARIES = {".spc": "spc_io", ".jdx": "jcamp"}
KINDS = [".wdf", ".spc", "log.spc", ".jdx", ".txt", ".txt.gz"]


@pytest.fixture
def whole(silicon) -> Callable[[str], bytes]:
    """A file of each kind as it should be."""

    def make(kind: str) -> bytes:
        pytest.importorskip(LIBRARIES.get(kind[-4:], "numpy"), reason="needs the raman extra")
        x, y = silicon
        text = "".join(f"{a:.3f}\t{b:.1f}\n" for a, b in zip(x, y, strict=True)).encode()
        places = [(3, 5, [0.0, 1.0]), (9, 10, [300.0, 400.0])]
        return {
            ".wdf": wdf_bytes(x[::-1], [y[::-1], 2 * y[::-1]], origins=places),
            ".spc": spc_bytes(x, y),
            "log.spc": spc_bytes(x, y, log=b"Laser=532\r\nTemperature=295\r\n\x00"),
            ".jdx": jcamp_bytes(x, y),
            ".txt": text,
            ".txt.gz": compress(text, mtime=0),
        }[kind]

    return make


def spectra_or_line(raw: bytes, kind: str, tmp_path) -> list[Spectrum] | str:
    """What reading and fitting comes to, in time; anything but an InputError fails the test."""
    file = tmp_path / f"a{kind}"
    file.write_bytes(raw)
    spectra, line = [], ""
    with time_limit(LIMIT_S):
        try:
            spectra = read_file(file)
            measure(spectra)
        except InputError as error:
            line = str(error)
    assert line.isprintable()
    assert len(line) < 400 + len(str(file))
    return line or spectra


@pytest.mark.parametrize("kind", [".wdf", ".spc", ".jdx", ".txt.gz"])
def test_a_file_cut_short_anywhere_is_refused(kind, whole, tmp_path):
    raw = whole(kind)
    rng = np.random.default_rng(1)
    cuts = {0, 1, 4, 15, 16, 17, 511, 512, 513, 528, *rng.integers(2, len(raw) - 10, 60).tolist()}
    for cut in cuts:
        assert isinstance(spectra_or_line(raw[:cut], kind, tmp_path), str), cut


@pytest.mark.parametrize("kind", [".wdf", ".spc"])
def test_a_file_that_goes_on_as_zeros_is_refused(kind, whole, tmp_path):
    raw = whole(kind)
    rng = np.random.default_rng(2)
    for cut in {0, 4, 8, 16, 512, 520, 528, *rng.integers(1, len(raw) - 64, 60).tolist()}:
        zeros = raw[:cut] + bytes(len(raw) - cut)
        assert isinstance(spectra_or_line(zeros, kind, tmp_path), str), cut
    assert isinstance(spectra_or_line(raw + bytes(4096), kind, tmp_path), str)


@pytest.mark.parametrize("kind", KINDS)
def test_flipped_overwritten_and_missing_bytes_end_in_spectra_or_a_line(kind, whole, tmp_path):
    raw = whole(kind)
    rng = np.random.default_rng(zlib.crc32(kind.encode()))
    for _ in range(60):
        damaged = bytearray(raw)
        place, size = int(rng.integers(len(raw))), int(rng.choice([1, 4, 64, 512]))
        # headers are short, and damage there does the most
        place = place % 600 if rng.random() < 0.5 else place
        how = rng.integers(5)
        if how == 0:
            damaged[place] ^= 1 << int(rng.integers(8))
        elif how == 1:
            damaged[place : place + size] = b"\xff" * len(damaged[place : place + size])
        elif how == 2:
            damaged[place : place + size] = bytes(len(damaged[place : place + size]))
        elif how == 3:
            del damaged[place : place + size]
        else:
            damaged[place:place] = rng.bytes(size)
        found = spectra_or_line(bytes(damaged), kind, tmp_path)
        if not isinstance(found, str):
            assert all(np.isfinite([one.x, one.y]).all() for one in found)


@pytest.mark.parametrize("value", [0, 1, 2, 255, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF])
@pytest.mark.parametrize(
    ("kind", "places"),
    [(".wdf", (8, 12, 16, 60, 64, 68, 72, 76, 88, 520, 524)), ("log.spc", (0, 4, 24, 248, 512))],
)
def test_every_size_in_a_header_is_doubted(kind, places, value, whole, tmp_path):
    for place in places:
        raw = bytearray(whole(kind))
        struct.pack_into("<I", raw, place, value)
        spectra_or_line(bytes(raw), kind, tmp_path)


def test_a_million_empty_blocks_or_spectra_take_no_time(whole, tmp_path):
    x = np.linspace(440.0, 600.0, 20)
    head = wdf_bytes(x, [x])[:512]
    blocks = head + struct.pack("<4sIQ", b"NONE", 0, 16) * 1_000_000
    assert "its blocks do not follow" in spectra_or_line(blocks, ".wdf", tmp_path)
    many = bytearray(whole(".spc") + bytes(4_000_000))
    struct.pack_into("<I", many, 4, 0)
    struct.pack_into("<I", many, 24, 100_000)
    assert "100000 spectra, expected" in spectra_or_line(bytes(many), ".spc", tmp_path)


def test_gzip_that_grows_beyond_any_file_is_refused(tmp_path):
    raw = compress(b"520 1\n" * 15_000_000, compresslevel=1)
    assert "unpacked, larger than the 67.1 MB" in spectra_or_line(raw, ".txt.gz", tmp_path)


def test_gzip_of_several_parts_is_read_as_one(whole, tmp_path):
    raw = whole(".txt")
    (found,) = spectra_or_line(compress(raw[:3001]) + compress(raw[3001:]), ".txt.gz", tmp_path)
    (expected,) = spectra_or_line(raw, ".txt", tmp_path)
    np.testing.assert_array_equal(found.y, expected.y)


def test_zeros_in_place_of_samples_are_found(silicon, whole, tmp_path):
    x, y = silicon
    gap = y.copy()
    gap[100:180] = 0.0
    for raw, kind in (
        (wdf_bytes(x, [gap]), ".wdf"),
        ("".join(f"{a} {b}\n" for a, b in zip(x, gap, strict=True)).encode(), ".txt"),
    ):
        assert "492.7 to 534.333 cm⁻¹ are zero" in spectra_or_line(raw, kind, tmp_path)
    # a background that was taken off and cut at zero is none
    cut = np.maximum(y - np.median(y), 0.0)
    assert len(spectra_or_line(wdf_bytes(x, [cut]), ".wdf", tmp_path)) == 1
