"""Files of spectrometers' makers, made for the tests."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np


def wdf_bytes(
    x: np.ndarray,
    spectra: list[np.ndarray],
    units: int = 1,
    laser: float = 0.0,
    origins: Sequence[tuple[int, int, Sequence[float]]] = (),
) -> bytes:
    """A WiRE file as Renishaw's reader expects it: header, data, axis, and origins.

    An origin is a kind, a unit, and a value for each spectrum.
    """
    header = struct.pack(
        "<IIQQ16s12xIIIQQIIII24s4HIIQQIf48x32s160s48x32x32x",
        *(0x31464457, 1, 512, 0, b"", 1, 0, x.size, len(spectra), len(spectra), 1, 1, x.size, 0),
        *(b"test", 1, 0, 0, 0, 1, 1, 0, 0, 0, laser, b"", b""),
    )
    data = np.concatenate(spectra).astype("<f4").tobytes()
    axis = struct.pack("<II", 1, units) + x.astype("<f4").tobytes()
    places = struct.pack("<I", len(origins))
    for kind, unit, values in origins:
        places += struct.pack(f"<II16s{len(values)}d", 0x80000000 | kind, unit, b"", *values)
    return (
        header
        + struct.pack("<4sIQ", b"DATA", 0, 16 + len(data))
        + data
        + struct.pack("<4sIQ", b"XLST", 0, 16 + len(axis))
        + axis
        + (struct.pack("<4sIQ", b"ORGN", 0, 16 + len(places)) + places if origins else b"")
    )


def spc_bytes(x: np.ndarray, y: np.ndarray, units: int = 13, log: bytes = b"") -> bytes:
    """A GRAMS file (new format, least significant byte first): shared axis, one spectrum."""
    end_of_data = 512 + 4 * x.size + 32 + 4 * y.size
    header = struct.pack(
        "<BBBbIddIBBBBI9s9sH8f130s30sIIBBHf48sfIfB187s",
        *(0x80, 0x4B, 9, -128, x.size, x[0], x[-1], 1, units, 4, 0, 0, 0, b"", b"", 0),
        *([0.0] * 8),
        *(b"", b"", end_of_data if log else 0, 0, 0, 0, 0, 0.0, b"", 0.0, 0, 0.0, 0, b""),
    )
    subheader = struct.pack("<BbHfffIIf4s", 0, -128, 0, 0.0, 0.0, 0.0, y.size, 0, 0.0, b"")
    data = header + x.astype("<f4").tobytes() + subheader + y.astype("<f4").tobytes()
    if log:
        data += struct.pack("<5I44s", 64 + len(log), 4096, 64, 0, 0, b"") + log
    return data


def jcamp_bytes(x: np.ndarray, y: np.ndarray, units: str = "1/CM") -> bytes:
    """A JCAMP-DX file with pairs of numbers."""
    points = "\n".join(f"{a:.3f}, {b:.1f}" for a, b in zip(x, y, strict=True))
    return (
        "##TITLE=Si\n##JCAMP-DX=4.24\n##DATA TYPE=RAMAN SPECTRUM\n"
        f"##XUNITS={units}\n##YUNITS=COUNTS\n##XFACTOR=1\n##YFACTOR=1\n##NPOINTS={x.size}\n"
        f"##XYPOINTS=(XY..XY)\n{points}\n##END=\n"
    ).encode()
