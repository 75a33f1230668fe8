"""Spectrometer makers' own file formats.

``pip install hotlever[raman]`` brings the CHARISMA project's reader for ``.spc`` (MIT) and
``jcamp`` for JCAMP-DX (MIT). Each is imported when a file asks for it.
"""

from __future__ import annotations

import importlib
import io
import logging
import re
import struct
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.errors import InputError, shown
from hotlever.raman.part import Part, positions
from hotlever.raman.wdf import read_wdf
from hotlever.units import LARGEST_NUMBER

_NPOINTS = re.compile(r"NPOINTS\s*=\s*(\d+)", re.I)
_XYDATA = re.compile(r"##\s*XYDATA\s*=[^\n]*([^#]*)", re.I)
_REPEATED_TWICE = re.compile(r"^[^$\n]*[S-Zs][^%J-Rj-r\n]*[S-Zs]", re.M)
#: JCAMP-DX's names of units that a Raman shift can have.
_JCAMP_SHIFT = re.compile(r"1/CM|CM-1|CM\^-1|RAMAN|SHIFT|ARBITRARY|^$", re.I)

#: SPC's header as far as sizes need it: flags, format, exponent, samples, spectra, and where a log
#: begins.
_SPC = struct.Struct("<BBxbI16xI220xI260x")
_SPC_SUBHEADER, _SPC_FORMAT, _SPC_FLOATS = 32, 0x4B, -128
_SPC_AXIS, _SPC_OWN_AXES, _SPC_HALF_WORDS = 0x80, 0x40, 0x01  # flags
_SPC_MOST = 2_000  # spectra; the library sorts them anew after each
_SPC_NM = ("XNMETR", "XUMETR")
_SPC_SHIFT = ("XARB", "XWAVEN", "XRAMANS")

logging.getLogger("spc_io").addHandler(logging.NullHandler())


@dataclass(frozen=True)
class Format:
    """A maker's format, and who reads it."""

    name: str
    read: Callable[[bytes, Any], list[Part]]
    module: str = ""  #: of an optional library, handed to `read`
    package: str = ""  #: that it comes in


def read_vendor(kind: str, file: Path, raw: bytes) -> list[Part]:
    """Read a file of one of the formats in `READERS`: every spectrum that it holds.

    Raises
    ------
    InputError
        If its library is missing, or it cannot be read.
    """
    maker = READERS[kind]
    try:
        library = importlib.import_module(maker.module) if maker.module else None
    except ImportError as error:
        raise InputError(
            f"{file}: reading {file.suffix or 'this format'} needs the package {maker.package}; "
            "install it with: pip install 'hotlever[raman]'"
        ) from error
    try:
        parts = maker.read(raw, library)
        for part in parts:
            _require_numbers(part)
        if all(np.ptp(part.y) == 0.0 for part in parts):
            raise ValueError("all its intensities are alike")
        return parts
    except Exception as error:
        reason = shown(" ".join(str(error).split()), 160) or type(error).__name__
        raise InputError(f"{file}: not a readable {maker.name} file ({reason})") from error


def _require_numbers(part: Part) -> None:
    """Raise ValueError unless the axis rises or falls all the way, and all is finite."""
    steps = np.diff(part.x)
    if len(part.x) != len(part.y):
        raise ValueError(f"{len(part.x)} Raman shifts and {len(part.y)} intensities")
    if not (np.abs(np.concatenate([part.x, part.y])) <= LARGEST_NUMBER).all():
        raise ValueError("values that are no numbers")
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        raise ValueError("its axis neither rises nor falls all the way")


def _spc(raw: bytes, spc_io: Any) -> list[Part]:
    """All subfiles."""
    if len(raw) < _SPC.size:
        raise ValueError(f"{len(raw)} bytes, less than its header")
    flags, version, exponent, samples, count, log = _SPC.unpack_from(raw)
    if version != _SPC_FORMAT:
        raise ValueError(f"format {version:#04x}, expected {_SPC_FORMAT:#04x}")
    if not 0 < count <= _SPC_MOST:
        raise ValueError(f"{count} spectra, expected 1 to {_SPC_MOST}")
    if not flags & _SPC_OWN_AXES:
        half = flags & _SPC_HALF_WORDS and exponent != _SPC_FLOATS
        end = _SPC.size + count * (_SPC_SUBHEADER + samples * (2 if half else 4))
        end += 4 * samples if flags & _SPC_AXIS else 0
        if end != (log or len(raw)):
            raise ValueError(f"{count} spectra of {samples} samples do not fill it")
    with redirect_stdout(io.StringIO()):  # it prints what it finds odd
        data = spc_io.SPC.from_bytes_io(io.BytesIO(raw))
    if data.xtype not in _SPC_SHIFT:
        unit = "the axis is a wavelength" if data.xtype in _SPC_NM else f"an axis in {data.xtype}"
        raise ValueError(f"{unit}, expected a Raman shift in cm⁻¹")
    places = {name: np.array([getattr(part, name) for part in data], float) for name in "wz"}
    labels = positions({k: v for k, v in places.items() if np.isfinite(v).all()}, len(data))
    pairs = [(np.array(part.xarray, float), np.array(part.yarray, float)) for part in data]
    return [Part(x, y, label) for (x, y), label in zip(pairs, labels, strict=True)]


def _jcamp(raw: bytes, jcamp: Any) -> list[Part]:
    """The blocks of a compound file, or the only one."""
    text = raw.decode(errors="ignore")
    # what is stated or repeated must be about as long as the file, else memory runs out
    if sum(int(count[:18]) for count in _NPOINTS.findall(text)) > len(raw):
        raise ValueError("more NPOINTS than the file can hold")
    if any(_REPEATED_TWICE.search(part) for part in _XYDATA.findall(text)):
        raise ValueError("a repeat count without a value")
    said = io.StringIO()
    with redirect_stdout(said):
        data = jcamp.read(io.BytesIO(raw))
    if "Y-Check failed" in said.getvalue():
        raise ValueError("its lines do not follow each other as their own checks say")
    parts = []
    for block in data.get("children") or [data]:
        x, y = np.array(block.get("x", ()), float), np.array(block.get("y", ()), float)
        if not y.size:
            continue
        units, stated = str(block.get("xunits", "")).strip(), block.get("npoints", y.size)
        if not _JCAMP_SHIFT.search(units):
            raise ValueError(f"an axis in {units[:20]}, expected a Raman shift in cm⁻¹")
        if x.size != y.size or y.size != stated:
            raise ValueError(f"{y.size} of {stated} intensities")
        parts.append(Part(x, y, str(block.get("title", ""))))
    if not parts:
        raise ValueError("without XYDATA, expected a Raman shift in cm⁻¹ and intensity")
    return parts


#: By suffix.
READERS = {
    ".wdf": Format("WiRE", lambda raw, _: read_wdf(raw)),
    ".spc": Format("SPC", _spc, "spc_io", "spc-io"),
    ".jdx": Format("JCAMP-DX", _jcamp, "jcamp", "jcamp"),
}
