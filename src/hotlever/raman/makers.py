"""Spectrometer makers' own file formats.

``pip install hotlever[raman]`` brings the CHARISMA project's reader for ``.spc`` (MIT) and
``jcamp`` for JCAMP-DX (MIT). Each is imported when a file asks for it.
"""

from __future__ import annotations

import io
import logging
import re
import struct
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hotlever.errors import InputError, excerpt
from hotlever.raman.spectrum import Spectrum, positions, sample_temperature
from hotlever.types import Array
from hotlever.units import LARGEST_NUMBER, ZERO_CELSIUS_K

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
    read: Callable[[bytes], list[Spectrum]]
    package: str = ""  #: an optional library that `read` imports


def read_makers(kind: str, file: Path, raw: bytes) -> list[Spectrum]:
    """Read a file of one of the formats in `MAKERS`: every spectrum that it holds.

    Raises
    ------
    InputError
        If its library is missing, or it cannot be read.
    """
    maker = MAKERS[kind]
    try:
        spectra = maker.read(raw)
        for spectrum in spectra:
            _require_numbers(spectrum)
        if all(np.ptp(spectrum.y) == 0.0 for spectrum in spectra):
            raise ValueError("all its intensities are alike")
        return spectra
    except ImportError as error:
        raise InputError(
            f"{file}: reading {file.suffix or 'this format'} needs the package {maker.package}; "
            "install it with: pip install 'hotlever[raman]'"
        ) from error
    except Exception as error:
        reason = excerpt(" ".join(str(error).split()), 160) or type(error).__name__
        raise InputError(f"{file}: not a readable {maker.name} file ({reason})") from error


def _require_numbers(spectrum: Spectrum) -> None:
    """Raise ValueError unless the axis rises or falls all the way, and all is finite."""
    x, y = spectrum.x, spectrum.y
    steps = np.diff(x)
    if len(x) != len(y):
        raise ValueError(f"{len(x)} Raman shifts and {len(y)} intensities")
    if not (np.abs(np.concatenate([x, y])) <= LARGEST_NUMBER).all():
        raise ValueError("values that are no numbers")
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        raise ValueError("its axis neither rises nor falls all the way")


def _spc(raw: bytes) -> list[Spectrum]:
    """All subfiles."""
    import spc_io

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
    coordinates = {name: np.array([getattr(part, name) for part in data], float) for name in "wz"}
    labels = positions({k: v for k, v in coordinates.items() if np.isfinite(v).all()}, len(data))
    pairs = [(np.array(part.xarray, float), np.array(part.yarray, float)) for part in data]
    return [Spectrum(x, y, label) for (x, y), label in zip(pairs, labels, strict=True)]


def _jcamp(raw: bytes) -> list[Spectrum]:
    """The blocks of a compound file, or the only one."""
    import jcamp

    text = raw.decode(errors="ignore")
    # what is stated or repeated must be about as long as the file, else memory runs out
    if sum(int(count[:18]) for count in _NPOINTS.findall(text)) > len(raw):
        raise ValueError("more NPOINTS than the file can hold")
    if any(_REPEATED_TWICE.search(part) for part in _XYDATA.findall(text)):
        raise ValueError("a repeat count without a value")
    output = io.StringIO()
    with redirect_stdout(output):
        data = jcamp.read(io.BytesIO(raw))
    if "Y-Check failed" in output.getvalue():
        raise ValueError("its lines do not follow each other as their own checks say")
    spectra = []
    for block in data.get("children") or [data]:
        x, y = np.array(block.get("x", ()), float), np.array(block.get("y", ()), float)
        if not y.size:
            continue
        units, stated = str(block.get("xunits", "")).strip(), block.get("npoints", y.size)
        if not _JCAMP_SHIFT.search(units):
            raise ValueError(f"an axis in {units[:20]}, expected a Raman shift in cm⁻¹")
        if x.size != y.size or y.size != stated:
            raise ValueError(f"{y.size} of {stated} intensities")
        spectra.append(Spectrum(x, y, str(block.get("title", ""))))
    if not spectra:
        raise ValueError("without XYDATA, expected a Raman shift in cm⁻¹ and intensity")
    return spectra


# --- Renishaw's .wdf ----------------------------------------------------------------------------

# Blocks, each of a name, a number, a size, and its content, as in Renishaw's own reader
# (renishaw-wdf, Apache-2.0), which trusts the sizes that a file states, and searches a damaged file
# without end. Here a size is compared with the file before anything is read by it.

WDF_SIGNATURE = b"WDF1"

#: Block: name, number, size in bytes with these three.
_BLOCK = struct.Struct("<4s4xQ")
#: The first block: flags, samples of a spectrum, spectra that there is room for and that were
#: measured, samples of the axis, and the laser (cm⁻¹).
_HEADER = struct.Struct("<16xQ36xIQQ8xI64xf352x")
_SEVERAL_AXES = 0b1001  # flags: several axes, or tracks with one each

#: A quantity of each spectrum: kind, unit and label, before its values.
_ORIGIN = struct.Struct("<II16s")
_PRIMARY = 0x8000_0000  # marks the kinds by which a map or a series runs
_NAMES = {3: "X", 4: "Y", 5: "Z", 9: "T", 11: "t"}
_TO_KELVIN = {10: 0.0, 21: ZERO_CELSIUS_K}  # by unit
_MOST_BLOCKS, _MOST_ORIGINS = 10_000, 100
_FILE_TIME = 24  # a unit whose values are no floating-point numbers

_NANOMETRE = 3
_AXIS_UNITS = (0, 1, 2, _NANOMETRE)  # none stated, Raman shift, wavenumber


def read_wdf(raw: bytes) -> list[Spectrum]:
    """Read every spectrum of a file, with its place in a map and its temperature where stated.

    Raises
    ------
    ValueError
        If the file is cut short, its sizes contradict each other, or its axis is no Raman shift.
    """
    blocks = _blocks(raw)
    if len(raw) < _HEADER.size:
        raise ValueError(f"{len(raw)} bytes, less than its header")
    flags, samples, room, measured, axis_samples, laser = _HEADER.unpack_from(raw)
    if not (0 < measured <= room and samples):
        raise ValueError(f"{measured} of {room} spectra of {samples} samples")
    if axis_samples != samples or flags & _SEVERAL_AXES:
        raise ValueError(
            f"{axis_samples} Raman shifts and {samples} intensities, expected one axis for all"
        )
    data, axis = blocks.get(b"DATA", b""), blocks.get(b"XLST", b"")
    if len(data) < 4 * samples * room or len(axis) < 8 + 4 * samples:
        raise ValueError(f"no room for {room} spectra of {samples} samples and their axis")
    x = np.frombuffer(axis, "<f4", samples, 8).astype(float)
    (unit,) = struct.unpack_from("<4xI", axis)
    if unit not in _AXIS_UNITS:
        raise ValueError(f"an axis in unit {unit}, expected a Raman shift in cm⁻¹")
    if unit == _NANOMETRE:
        with np.errstate(divide="ignore"):
            x = laser - 1e7 / x
    y = np.frombuffer(data, "<f4", samples * measured).astype(float).reshape(measured, samples)
    coordinates, temperatures = _origins(blocks.get(b"ORGN", b""), room, measured)
    labels = positions(coordinates, measured)
    return [Spectrum(x, y[i], labels[i], temperature=temperatures[i]) for i in range(measured)]


def _blocks(raw: bytes) -> dict[bytes, bytes]:
    """Content by name, of the first block of each; ValueError if blocks do not fill the file."""
    blocks: dict[bytes, bytes] = {}
    start = count = 0
    while start < len(raw):
        count += 1
        name, size = b"", 0
        if start + _BLOCK.size <= len(raw):
            name, size = _BLOCK.unpack_from(raw, start)
        if count > _MOST_BLOCKS or not _BLOCK.size <= size <= len(raw) - start:
            raise ValueError(
                f"cut short or damaged: its blocks do not follow each other at byte {start} of "
                f"{len(raw)}"
            )
        blocks.setdefault(name, raw[start + _BLOCK.size : start + size])
        start += size
    return blocks


def _origins(
    content: bytes, room: int, measured: int
) -> tuple[dict[str, Array], list[float | None]]:
    """Where and at which temperature (K) spectra were measured, as far as the file says."""
    coordinates: dict[str, Array] = {}
    temperatures: list[float | None] = [None] * measured
    size = _ORIGIN.size + 8 * room
    for at in range(4, len(content) - size + 1, size)[:_MOST_ORIGINS]:
        kind, unit, _ = _ORIGIN.unpack_from(content, at)
        name = _NAMES.get(kind & ~_PRIMARY)
        values = np.frombuffer(content, "<f8", measured, at + _ORIGIN.size)
        if name is None or unit == _FILE_TIME or not (np.abs(values) <= LARGEST_NUMBER).all():
            continue
        if name == "T" and unit in _TO_KELVIN:
            values = values + _TO_KELVIN[unit]
            temperatures = [sample_temperature(kelvin) for kelvin in values.tolist()]
        if name == "T" or kind & _PRIMARY:
            coordinates[name] = values
    return coordinates, temperatures


# --- LabSpec ------------------------------------------------------------------------------------

#: How the XML begins in which HORIBA's LabSpec keeps a spectrum or a map, and how the names of its
#: own files end.
_LABSPEC_XML = re.compile(rb"<LSX_\w+")
_LABSPEC = {f".{kind}" for kind in ("l6s", "l6m", "l6v", "l5s", "l5m", "l5v", "ngs", "ngc")}


def refuse_labspec(file: Path, suffix: str, raw: bytes, is_text: bool) -> None:
    """Refuse LabSpec's own files and its XML, and say what to save instead.

    Raises
    ------
    InputError
        If it is one of them.
    """
    in_xml = _LABSPEC_XML.search(raw[:4096].replace(b"\0", b"")) is not None
    if in_xml or (suffix in _LABSPEC and not is_text):
        what = "LabSpec's XML" if in_xml else f"LabSpec's own format {suffix}"
        raise InputError(f"{file}: {what}, expected text: save the spectrum as .txt in LabSpec")


#: By suffix.
MAKERS = {
    ".wdf": Format("WiRE", read_wdf),
    ".spc": Format("SPC", _spc, "spc-io"),
    ".jdx": Format("JCAMP-DX", _jcamp, "jcamp"),
}
