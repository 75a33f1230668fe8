"""Spectrometer makers' own file formats.

``pip install hotlever[raman]`` brings the CHARISMA project's reader for ``.spc`` (MIT) and
``jcamp`` for JCAMP-DX (MIT). Each is imported when a file asks for it.
"""

from __future__ import annotations

import io
import logging
import re
import struct
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np

from hotlever.errors import InputError, excerpt
from hotlever.raman.spectrum import Spectrum, positions, sample_temperature
from hotlever.types import Array
from hotlever.units import LARGEST_NUMBER, ZERO_CELSIUS_K

logging.getLogger("spc_io").addHandler(logging.NullHandler())


def read_makers(kind: str, file: Path, raw: bytes) -> list[Spectrum]:
    """Read a file of one of the formats in `MAKERS`: every spectrum that it holds.

    Raises
    ------
    InputError
        If its library is missing, or it cannot be read.
    """
    name, read, package = MAKERS[kind]
    try:
        spectra = read(raw)
        for spectrum in spectra:
            _require_numbers(spectrum)
        if all(np.ptp(spectrum.y) == 0.0 for spectrum in spectra):
            raise ValueError("all its intensities are alike")
        return spectra
    except ImportError as error:
        raise InputError(
            f"{file}: reading {file.suffix or 'this format'} needs the package {package}; "
            "install it with: pip install 'hotlever[raman]'"
        ) from error
    except Exception as error:
        reason = excerpt(" ".join(str(error).split()), 160) or type(error).__name__
        raise InputError(f"{file}: not a readable {name} file ({reason})") from error


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

    # as far as sizes need it: flags, format, exponent, samples, spectra, and where a log begins
    header = struct.Struct("<BBxbI16xI220xI260x")
    if len(raw) < header.size:
        raise ValueError(f"{len(raw)} bytes, less than its header")
    flags, version, exponent, samples, count, log = header.unpack_from(raw)
    if version != 0x4B:
        raise ValueError(f"format {version:#04x}, expected 0x4b")
    most = 2_000  # the library sorts them anew after each
    if not 0 < count <= most:
        raise ValueError(f"{count} spectra, expected 1 to {most}")
    own_axes, one_axis, half_words = flags & 0x40, flags & 0x80, flags & 0x01
    if not own_axes:
        # an exponent of -128 is that of floating-point numbers
        width = 2 if half_words and exponent != -128 else 4
        end = header.size + count * (32 + samples * width)
        end += 4 * samples if one_axis else 0
        if end != (log or len(raw)):
            raise ValueError(f"{count} spectra of {samples} samples do not fill it")
    with redirect_stdout(io.StringIO()):  # it prints what it finds odd
        data = spc_io.SPC.from_bytes_io(io.BytesIO(raw))
    if data.xtype not in ("XARB", "XWAVEN", "XRAMANS"):
        unit = f"an axis in {data.xtype}"
        if data.xtype in ("XNMETR", "XUMETR"):
            unit = "the axis is a wavelength"
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
    if sum(int(count[:18]) for count in re.findall(r"(?i)NPOINTS\s*=\s*(\d+)", text)) > len(raw):
        raise ValueError("more NPOINTS than the file can hold")
    tables = re.findall(r"(?i)##\s*XYDATA\s*=[^\n]*([^#]*)", text)
    if any(re.search(r"(?m)^[^$\n]*[S-Zs][^%J-Rj-r\n]*[S-Zs]", part) for part in tables):
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
        # names of units that a Raman shift can have
        if not re.search(r"(?i)1/CM|CM-1|CM\^-1|RAMAN|SHIFT|ARBITRARY|^$", units):
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


def read_wdf(raw: bytes) -> list[Spectrum]:
    """Read every spectrum of a file, with its place in a map and its temperature where stated.

    Raises
    ------
    ValueError
        If the file is cut short, its sizes contradict each other, or its axis is no Raman shift.
    """
    blocks = _blocks(raw)
    # the first block: flags, samples of a spectrum, spectra that there is room for and that were
    # measured, samples of the axis, and the laser (cm⁻¹)
    header = struct.Struct("<16xQ36xIQQ8xI64xf352x")
    if len(raw) < header.size:
        raise ValueError(f"{len(raw)} bytes, less than its header")
    flags, samples, room, measured, axis_samples, laser = header.unpack_from(raw)
    if not (0 < measured <= room and samples):
        raise ValueError(f"{measured} of {room} spectra of {samples} samples")
    # by its flags it has several axes, or tracks with one each
    if axis_samples != samples or flags & 0b1001:
        raise ValueError(
            f"{axis_samples} Raman shifts and {samples} intensities, expected one axis for all"
        )
    data, axis = blocks.get(b"DATA", b""), blocks.get(b"XLST", b"")
    if len(data) < 4 * samples * room or len(axis) < 8 + 4 * samples:
        raise ValueError(f"no room for {room} spectra of {samples} samples and their axis")
    x = np.frombuffer(axis, "<f4", samples, 8).astype(float)
    (unit,) = struct.unpack_from("<4xI", axis)
    nanometre = 3
    # none stated, Raman shift, wavenumber
    if unit not in (0, 1, 2, nanometre):
        raise ValueError(f"an axis in unit {unit}, expected a Raman shift in cm⁻¹")
    if unit == nanometre:
        with np.errstate(divide="ignore"):
            x = laser - 1e7 / x
    y = np.frombuffer(data, "<f4", samples * measured).astype(float).reshape(measured, samples)
    coordinates, temperatures = _origins(blocks.get(b"ORGN", b""), room, measured)
    labels = positions(coordinates, measured)
    return [Spectrum(x, y[i], labels[i], temperature=temperatures[i]) for i in range(measured)]


def _blocks(raw: bytes) -> dict[bytes, bytes]:
    """Content by name, of the first block of each; ValueError if blocks do not fill the file."""
    blocks: dict[bytes, bytes] = {}
    head = struct.Struct("<4s4xQ")  # name, number, size in bytes with these three
    start = count = 0
    while start < len(raw):
        count += 1
        name, size = b"", 0
        if start + head.size <= len(raw):
            name, size = head.unpack_from(raw, start)
        if count > 10_000 or not head.size <= size <= len(raw) - start:
            raise ValueError(
                f"cut short or damaged: its blocks do not follow each other at byte {start} of "
                f"{len(raw)}"
            )
        blocks.setdefault(name, raw[start + head.size : start + size])
        start += size
    return blocks


def _origins(
    content: bytes, room: int, measured: int
) -> tuple[dict[str, Array], list[float | None]]:
    """Where and at which temperature (K) spectra were measured, as far as the file says."""
    coordinates: dict[str, Array] = {}
    temperatures: list[float | None] = [None] * measured
    names = {3: "X", 4: "Y", 5: "Z", 9: "T", 11: "t"}
    kelvin_at_zero = {10: 0.0, 21: ZERO_CELSIUS_K}  # by unit
    head = struct.Struct("<II16s")  # kind, unit and label, before the values
    size = head.size + 8 * room
    for at in range(4, len(content) - size + 1, size)[:100]:
        kind, unit, _ = head.unpack_from(content, at)
        primary = kind & 0x8000_0000  # marks the kinds by which a map or a series runs
        name = names.get(kind - primary)
        values = np.frombuffer(content, "<f8", measured, at + head.size)
        # times (24) are no floating-point numbers
        if name is None or unit == 24 or not (np.abs(values) <= LARGEST_NUMBER).all():
            continue
        if name == "T" and unit in kelvin_at_zero:
            values = values + kelvin_at_zero[unit]
            temperatures = [sample_temperature(kelvin) for kelvin in values.tolist()]
        if name == "T" or primary:
            coordinates[name] = values
    return coordinates, temperatures


# --- LabSpec ------------------------------------------------------------------------------------


def refuse_labspec(file: Path, suffix: str, raw: bytes, is_text: bool) -> None:
    """Refuse LabSpec's own files and its XML, and say what to save instead.

    Raises
    ------
    InputError
        If it is one of them.
    """
    in_xml = re.search(rb"<LSX_\w+", raw[:4096].replace(b"\0", b"")) is not None
    own = suffix[1:] in ("l6s", "l6m", "l6v", "l5s", "l5m", "l5v", "ngs", "ngc")
    if in_xml or (own and not is_text):
        what = "LabSpec's XML" if in_xml else f"LabSpec's own format {suffix}"
        raise InputError(f"{file}: {what}, expected text: save the spectrum as .txt in LabSpec")


#: By suffix: a maker's format, what reads it, and the optional library that this imports.
MAKERS = {
    ".wdf": ("WiRE", read_wdf, ""),
    ".spc": ("SPC", _spc, "spc-io"),
    ".jdx": ("JCAMP-DX", _jcamp, "jcamp"),
}
