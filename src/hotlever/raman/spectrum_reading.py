"""Spectra from files and folders, in text or a maker's own format."""

from __future__ import annotations

import gzip
import io
import logging
import os
import re
import struct
import zlib
from collections.abc import Iterable
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path

import numpy as np

from hotlever.errors import InputError, excerpt
from hotlever.files import LARGEST_TEXT, read_bytes
from hotlever.raman.detector_noise import overflows, zeros
from hotlever.raman.lineshape import in_window
from hotlever.raman.spectrum import (
    Spectrum,
    names_in_file,
    positions,
    sample_temperature,
    temperature_in_metadata,
    temperature_in_name,
)
from hotlever.raman.text_layout import pick_spectra, require_line
from hotlever.tables import find_tables
from hotlever.types import Array, Progress
from hotlever.units import LARGEST_NUMBER, ZERO_CELSIUS_K
from hotlever.work import each


def read_spectrum(path: str | os.PathLike[str]) -> Spectrum:
    """Read one spectrum.

    Parameters
    ----------
    path : path
        A text table (LabSpec, BWTek, WiRE, WITec, Ocean Optics, plain columns; any common
        encoding, separator and decimal sign), ``.wdf``, or ``.spc`` or JCAMP-DX with the
        ``raman`` extra installed; as it is or packed by gzip.

    Raises
    ------
    InputError
        If the file cannot be read, is no spectrum, holds several, or does not reach 520 cm⁻¹.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "si_450K.txt"
    ...     _ = file.write_text("".join(f"{400 + i};{100 + i}\\n" for i in range(200)))
    ...     spectrum = read_spectrum(file)
    >>> spectrum.x[0].item(), spectrum.temperature
    (400.0, 450.0)
    """
    spectra = read_file(path)
    if len(spectra) > 1:
        raise InputError(f"{path}: holds {len(spectra)} spectra, expected one")
    return spectra[0]


def read_file(path: str | os.PathLike[str]) -> list[Spectrum]:
    """Read every spectrum of one file; see `read_spectrum`."""
    file = Path(path)
    raw = _unpacked(read_bytes(file), file)
    if not raw.strip():
        raise InputError(f"{file}: the file is empty, expected a Raman spectrum")
    inside = Path(file.stem) if file.suffix.lower() == ".gz" else file
    kind = _kind(inside, raw)
    refuse_labspec(file, inside.suffix.lower(), raw, is_text=not kind)
    spectra = read_makers(kind, file, raw) if kind in MAKERS else _in_text(file, raw)
    if not spectra:
        raise InputError(f"{file}: holds no spectrum")
    names = names_in_file(file.name, [spectrum.name for spectrum in spectra])
    of_file = temperature_in_name(inside.stem)
    for index, (name, spectrum) in enumerate(zip(names, spectra, strict=True)):
        empty = ~np.isfinite(spectrum.y) | overflows(np.nan_to_num(spectrum.y))
        given = np.where(empty, np.nan, spectrum.y)
        x, y = _checked(spectrum.x, given, str(file.with_name(name)))
        empty &= np.isfinite(spectrum.x)
        gaps = tuple(np.setdiff1d(spectrum.x[empty], x).tolist())
        stated = (spectrum.temperature, temperature_in_metadata(spectrum.metadata), of_file)
        temperature = next((kelvin for kelvin in stated if kelvin is not None), None)
        folder = str(file.parent)
        spectra[index] = Spectrum(x, y, name, spectrum.metadata, temperature, folder, gaps)
    return spectra


def _unpacked(raw: bytes, file: Path) -> bytes:
    """A file's content, as it was before gzip if that is what made it."""
    if not raw.startswith(b"\x1f\x8b"):
        return raw
    try:
        with gzip.open(io.BytesIO(raw)) as packed:
            content = packed.read(LARGEST_TEXT + 1)
    except (OSError, EOFError, zlib.error) as error:
        reason = "cut short" if isinstance(error, EOFError) else error
        raise InputError(f"{file}: not a readable gzip file ({reason})") from None
    if len(content) > LARGEST_TEXT:
        raise InputError(
            f"{file}: unpacked, larger than the {LARGEST_TEXT / 1e6:.3g} MB it may have"
        )
    return content


def _kind(file: Path, raw: bytes) -> str:
    """What kind of file it is, by its content, then by its name; empty for text."""
    if raw.startswith(b"WDF1"):
        return ".wdf"
    if raw.lstrip(b"\xef\xbb\xbf \r\n").upper().startswith(b"##TITLE="):
        return ".jdx"
    # some instruments write plain columns under these names
    binary = any(byte < 9 or 13 < byte < 32 for byte in raw[:2048])
    return file.suffix.lower() if binary else ""


def _in_text(file: Path, raw: bytes) -> list[Spectrum]:
    """Spectra of a text file; a table of numbers beside them may be something else."""
    spectra: list[Spectrum] = []
    errors: list[tuple[int, InputError]] = []
    for table in find_tables(raw, str(file)):
        try:
            in_table = pick_spectra(table)
        except InputError as error:
            errors.append((len(table.lines), error))
            continue
        spectra += [replace(spectrum, metadata=table.settings) for spectrum in in_table]
    if not spectra and errors:
        raise max(errors, key=lambda entry: entry[0])[1]
    return spectra


def _checked(x: Array, y: Array, where: str) -> tuple[Array, Array]:
    """Sort, merge repeated axis values, and make sure there is a silicon line to look for."""
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    require_line(x, where)
    x, inverse, counts = np.unique(x, return_inverse=True, return_counts=True)
    y = np.bincount(inverse, weights=y) / counts
    inside = in_window(x, f"{where}: ")
    if (gap := zeros(y[inside])) is not None:
        low, high = x[inside][[gap.start, gap.stop - 1]]
        raise InputError(
            f"{where}: the intensities from {low:g} to {high:g} cm⁻¹ are zero beside others that "
            "are not: a damaged or padded file? Expected a spectrum without gaps"
        )
    return x, y


def spectrum_files(paths: Iterable[str | os.PathLike[str]]) -> list[tuple[Path, bool]]:
    """List files, folders opened, in natural order; the flag is True for one from a folder.

    Raises
    ------
    InputError
        If a path does not exist or a folder holds no file that could be a spectrum.
    """
    others = {".md", ".json", ".toml", ".yaml", ".yml", ".py", ".ipynb", ".html", ".pdf", ".log"}
    others |= {".png", ".jpg", ".jpeg", ".svg", ".tif", ".tiff", ".bmp", ".zip"}
    listed: list[tuple[Path, bool]] = []
    for path in map(Path, paths):
        # unlike a Path's methods these do not raise on a name that is too long
        if not os.path.isdir(path):
            if not os.path.exists(path):
                raise InputError(f"{path}: no such file or folder")
            listed.append((path, False))
            continue
        try:
            inside = [
                file
                for file in path.iterdir()
                if not file.is_dir()
                and not file.name.startswith((".", "~"))
                and file.suffix.lower() not in others
                and file.stem.upper() not in ("README", "LICENSE", "LICENCE")
            ]
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror})") from error
        if not inside:
            raise InputError(f"{path}: the folder holds no spectrum file")
        listed += [(file, True) for file in sorted(inside, key=_natural_key)]
    return listed


def _natural_key(path: Path) -> list[str | int]:
    """Sort key that puts ``tip_2`` before ``tip_10``."""
    parts = re.split(r"([0-9]+)", path.name.lower())
    return [int(part) if index % 2 else part for index, part in enumerate(parts)]


def read_spectra(
    paths: Iterable[str | os.PathLike[str]],
    skipped: list[str] | None = None,
    progress: Progress | None = None,
) -> list[Spectrum]:
    """Read files and folders of spectra, folders in natural order.

    Parameters
    ----------
    paths : iterable of path
        A file named here must be a spectrum; what a folder holds beside spectra is passed over.
    skipped : list of str, optional
        Receives one line for each file passed over.
    progress : callable, optional
        Called with (files done, files in all).

    Raises
    ------
    InputError
        As `read_file`, or if nothing is left.
    """
    files = spectrum_files(paths)
    spectra: list[Spectrum] = []
    skipped = [] if skipped is None else skipped
    for file, from_folder in each(files, progress):
        try:
            if from_folder and not file.is_file():
                raise InputError(f"{file}: is a pipe or a device")
            spectra += read_file(file)
        except InputError as error:
            if not from_folder:
                raise
            skipped.append(str(error))
    if not spectra:
        raise InputError(f"none of {len(files)} files is a spectrum; the last: {skipped[-1]}")
    return spectra


# --- makers' own formats ------------------------------------------------------------------------

# ``pip install hotlever[raman]`` brings the CHARISMA project's reader for ``.spc`` (MIT) and
# ``jcamp`` for JCAMP-DX (MIT). Each is imported when a file asks for it.


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

    logging.getLogger("spc_io").addHandler(logging.NullHandler())
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


#: By suffix: a maker's format, what reads it, and the optional library that this imports.
MAKERS = {
    ".wdf": ("WiRE", read_wdf, ""),
    ".spc": ("SPC", _spc, "spc-io"),
    ".jdx": ("JCAMP-DX", _jcamp, "jcamp"),
}
