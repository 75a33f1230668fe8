"""Spectrometer makers' own file formats, read by optional libraries.

``pip install hotlever[raman]`` brings Renishaw's own reader for ``.wdf`` (Apache-2.0), the
CHARISMA project's for ``.spc`` (MIT) and ``jcamp`` for JCAMP-DX (MIT). Each is imported when a
file asks for it.
"""

from __future__ import annotations

import importlib
import io
import re
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.errors import InputError
from hotlever.types import Array

_MOST_BLOCKS = 10_000
_NPOINTS = re.compile(r"NPOINTS\s*=\s*(\d+)", re.I)
_XYDATA = re.compile(r"##\s*XYDATA\s*=[^\n]*([^#]*)", re.I)
_REPEATED_TWICE = re.compile(r"^[^$\n]*[S-Zs][^%J-Rj-r\n]*[S-Zs]", re.M)


def read_vendor(kind: str, file: Path, raw: bytes) -> list[tuple[Array, Array]]:
    """Read a file of one of the `KINDS`: Raman shift (cm⁻¹) and intensity of each spectrum.

    Raises
    ------
    InputError
        If its library is missing, or does not read it.
    """
    name, module, package, read = KINDS[kind]
    try:
        library = importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"{file}: reading {file.suffix or 'this format'} needs the package {package}; "
            "install it with: pip install 'hotlever[raman]'"
        ) from error
    try:
        pairs = read(library, raw)
        return [(np.array(x, dtype=float), np.array(y, dtype=float)) for x, y in pairs]
    except Exception as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(f"{file}: not a readable {name} file ({reason})") from error


def _wdf(wdf: Any, raw: bytes) -> list[tuple[Any, Any]]:
    """One spectrum, or one for each point of a map or series."""
    _require_wdf_blocks(raw)
    data = wdf.Wdf()
    data.open_fd(io.BytesIO(raw))
    if 4 * data.hdr.ncollected * max(data.hdr.npoints, 1) > len(raw):
        raise ValueError(f"{data.hdr.ncollected} spectra of {data.hdr.npoints} samples")
    axis = data.xlist()
    x = np.array(axis, dtype=float)
    if axis.units is wdf.WdfDataUnit.Nanometre:
        x = data.hdr.laser_wavenumber - 1e7 / x
    return [(x, data[i]) for i in range(data.hdr.ncollected)]


def _require_wdf_blocks(raw: bytes) -> None:
    """Raise ValueError if the file's blocks are not a short chain: a search would not end."""
    place = 0
    for _ in range(_MOST_BLOCKS):
        if place + 16 > len(raw):
            return
        size = int.from_bytes(raw[place + 8 : place + 16], "little")
        if size < 16:
            break
        place += size
    raise ValueError("its blocks do not follow each other")


def _spc(spc_io: Any, raw: bytes) -> list[tuple[Any, Any]]:
    """All subfiles."""
    data = spc_io.SPC.from_bytes_io(io.BytesIO(raw))
    if data.xtype in ("XNMETR", "XUMETR"):
        raise ValueError("the axis is a wavelength, expected a Raman shift in cm⁻¹")
    return [(part.xarray, part.yarray) for part in data]


def _jcamp(jcamp: Any, raw: bytes) -> list[tuple[Any, Any]]:
    text = raw.decode(errors="ignore")
    # what is stated or repeated must be about as long as the file, else memory runs out
    if sum(int(count[:18]) for count in _NPOINTS.findall(text)) > len(raw):
        raise ValueError("more NPOINTS than the file can hold")
    if any(_REPEATED_TWICE.search(part) for part in _XYDATA.findall(text)):
        raise ValueError("a repeat count without a value")
    with redirect_stdout(io.StringIO()):  # it prints what it finds odd
        data = jcamp.read(io.BytesIO(raw))
    blocks = data.get("children") or [data]
    pairs = [(block.get("x", ()), block.get("y", ())) for block in blocks]
    if not (found := [(x, y) for x, y in pairs if len(x) == len(y) > 0]):
        raise ValueError("without XYDATA, expected a Raman shift in cm⁻¹ and intensity")
    return found


#: By suffix: the format, the module that reads it, its package, and how.
KINDS = {
    ".wdf": ("WiRE", "wdf", "renishaw-wdf", _wdf),
    ".spc": ("SPC", "spc_io", "spc-io", _spc),
    ".jdx": ("JCAMP-DX", "jcamp", "jcamp", _jcamp),
}
