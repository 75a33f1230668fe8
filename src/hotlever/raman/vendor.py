"""Spectrometer makers' own file formats, read by optional libraries.

``pip install hotlever[raman]`` brings Renishaw's own reader for ``.wdf`` (Apache-2.0), the
CHARISMA project's for ``.spc`` (MIT) and ``jcamp`` for JCAMP-DX (MIT). Each is imported when a
file asks for it.
"""

from __future__ import annotations

import importlib
import io
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np

from hotlever.errors import InputError
from hotlever.raman.lineshape import Array

Parts = list[tuple[Array, Array]]

_NOT_A_SHIFT = "expected a Raman shift in cm⁻¹"


def _library(module: str, package: str, file: Path) -> ModuleType:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"{file}: reading {file.suffix or 'this format'} needs the package {package}; "
            "install it with: pip install 'hotlever[raman]'"
        ) from error


def read_wdf(file: Path, raw: bytes) -> Parts:
    """Read a Renishaw WiRE file: one spectrum, or one for each point of a map or series."""
    wdf = _library("wdf", "renishaw-wdf", file)
    try:
        data = wdf.Wdf()
        data.open_fd(io.BytesIO(raw))
        axis = data.xlist()
        x = np.array(axis, dtype=float)
        if axis.units is wdf.WdfDataUnit.Nanometre:
            x = data.hdr.laser_wavenumber - 1e7 / x
        return [(x, np.array(data[i], dtype=float)) for i in range(data.hdr.ncollected)]
    except Exception as error:
        raise InputError(f"{file}: not a readable WiRE file ({_reason(error)})") from error


def read_spc(file: Path, raw: bytes) -> Parts:
    """Read a Thermo Galactic (GRAMS) file; all its subfiles."""
    spc_io = _library("spc_io", "spc-io", file)
    try:
        data = spc_io.SPC.from_bytes_io(io.BytesIO(raw))
        if data.xtype in ("XNMETR", "XUMETR"):
            raise ValueError(f"the axis is a wavelength, {_NOT_A_SHIFT}")
        return [
            (np.array(part.xarray, dtype=float), np.array(part.yarray, dtype=float))
            for part in data
        ]
    except Exception as error:
        raise InputError(f"{file}: not a readable SPC file ({_reason(error)})") from error


def read_jcamp(file: Path, raw: bytes) -> Parts:
    """Read a JCAMP-DX file."""
    jcamp = _library("jcamp", "jcamp", file)
    try:
        data = jcamp.read(io.BytesIO(raw))
    except Exception as error:
        raise InputError(f"{file}: not a readable JCAMP-DX file ({_reason(error)})") from error
    blocks = data.get("children") or [data]
    parts = [
        (np.array(block["x"], dtype=float), np.array(block["y"], dtype=float))
        for block in blocks
        if len(block.get("x", ())) and len(block["x"]) == len(block.get("y", ()))
    ]
    if not parts:
        raise InputError(f"{file}: JCAMP-DX without XYDATA, {_NOT_A_SHIFT} and intensity")
    return parts


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__


VENDOR_READERS: dict[str, Callable[[Path, bytes], Parts]] = {
    ".wdf": read_wdf,
    ".spc": read_spc,
    ".jdx": read_jcamp,
}
