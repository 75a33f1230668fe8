"""A Raman spectrum and the files it comes from."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hotlever.errors import InputError
from hotlever.raman.columns import pick_spectra, require_line
from hotlever.raman.lineshape import Array
from hotlever.raman.peak import MIN_SAMPLES, WINDOW
from hotlever.raman.stated import temperature_in_metadata, temperature_in_name
from hotlever.raman.tables import decode, parse_table
from hotlever.raman.vendor import VENDOR_READERS, Parts

LARGEST_FILE = 64 * 2**20
"""Bytes; no spectrometer writes a spectrum this long."""

SKIPPED_SUFFIXES = {".md", ".json", ".toml", ".yaml", ".yml", ".py", ".ipynb", ".html", ".pdf"}
SKIPPED_SUFFIXES |= {".png", ".jpg", ".jpeg", ".svg", ".tif", ".tiff", ".bmp", ".log", ".zip"}


@dataclass(frozen=True)
class Spectrum:
    """Intensity against Raman shift.

    Attributes
    ----------
    x : (n,) array
        Raman shift, cm⁻¹, strictly ascending.
    y : (n,) array
        Intensity, counts (or in proportion to them less a constant).
    name : str
        The file, with a number where it holds several spectra.
    metadata : dict of str to str
        What the file's header says.
    temperature : float or None
        Sample temperature (K) by the header or the file's name.
    folder : str
        Where the file is.
    """

    x: Array
    y: Array
    name: str = ""
    metadata: dict[str, str] = field(default_factory=dict)
    temperature: float | None = None
    folder: str = ""


def read_spectrum(path: str | os.PathLike[str]) -> Spectrum:
    """Read one spectrum.

    Parameters
    ----------
    path : path
        A text table (LabSpec, BWTek, WiRE, WITec, Ocean Optics, plain columns; any common
        encoding, separator and decimal sign), or ``.wdf``, ``.spc`` or JCAMP-DX with the
        ``raman`` extra installed.

    Returns
    -------
    Spectrum

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
    found = read_file(path)
    if len(found) > 1:
        raise InputError(f"{path}: holds {len(found)} spectra, expected one")
    return found[0]


def read_file(path: str | os.PathLike[str]) -> list[Spectrum]:
    """Read every spectrum of one file; see `read_spectrum`."""
    file = Path(path)
    raw = _bytes(file)
    if not raw.strip():
        raise InputError(f"{file}: the file is empty, expected a Raman spectrum")
    temperature = temperature_in_name(file.stem)
    reader = _vendor_reader(file, raw)
    metadata: dict[str, str] = {}
    if reader is not None:
        parts = reader(file, raw)
    else:
        table = parse_table(decode(raw, str(file)), str(file))
        parts, metadata = pick_spectra(table, str(file)), table.metadata
        stated = temperature_in_metadata(metadata)
        temperature = stated if stated is not None else temperature
    names = [file.name] if len(parts) == 1 else [f"{file.name}[{i}]" for i in range(len(parts))]
    return [
        _checked(x, y, file.with_name(name), metadata, temperature)
        for name, (x, y) in zip(names, parts, strict=True)
    ]


def _vendor_reader(file: Path, raw: bytes) -> Callable[[Path, bytes], Parts] | None:
    """The library that reads this file, or None for text; the content tells, then the name."""
    if raw.startswith(b"WDF1"):
        return VENDOR_READERS[".wdf"]
    if raw.lstrip(b"\xef\xbb\xbf \r\n").upper().startswith(b"##TITLE="):
        return VENDOR_READERS[".jdx"]
    # some instruments write plain columns under these names
    return None if _looks_like_text(raw) else VENDOR_READERS.get(file.suffix.lower())


def _looks_like_text(raw: bytes) -> bool:
    return not any(byte < 9 or 13 < byte < 32 for byte in raw[:2048])


def _bytes(file: Path) -> bytes:
    try:
        if file.is_dir():
            raise InputError(f"{file}: is a folder, expected a file with a Raman spectrum")
        size = file.stat().st_size
        if size > LARGEST_FILE:
            raise InputError(
                f"{file}: {size / 2**20:.0f} MB, expected a spectrum "
                f"(at most {LARGEST_FILE // 2**20} MB)"
            )
        return file.read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"{file}: no such file") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{file}: cannot be read ({reason})") from error


def spectrum_files(paths: Iterable[str | os.PathLike[str]]) -> list[tuple[Path, bool]]:
    """List files, folders opened, in natural order; the flag is True for one from a folder.

    Raises
    ------
    InputError
        If a path does not exist or a folder holds no file that could be a spectrum.
    """
    listed: list[tuple[Path, bool]] = []
    for path in map(Path, paths):
        if not path.is_dir():
            if not path.exists():
                raise InputError(f"{path}: no such file or folder")
            listed.append((path, False))
            continue
        try:
            inside = [
                file
                for file in path.iterdir()
                if file.is_file()
                and not file.name.startswith((".", "~"))
                and file.suffix.lower() not in SKIPPED_SUFFIXES
                and file.stem.upper() not in ("README", "LICENSE", "LICENCE")
            ]
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror})") from error
        if not inside:
            raise InputError(f"{path}: the folder holds no spectrum file")
        listed += [(file, True) for file in sorted(inside, key=natural_key)]
    return listed


def natural_key(path: Path) -> list[tuple[int, int, str]]:
    """Sort key that puts ``tip_2`` before ``tip_10``.

    Examples
    --------
    >>> [p.name for p in sorted([Path("a10"), Path("a9")], key=natural_key)]
    ['a9', 'a10']
    """
    parts = re.split(r"([0-9]+)", path.name.lower())
    return [(1, int(part), "") if part.isdigit() else (0, 0, part) for part in parts]


def read_spectra(
    paths: Iterable[str | os.PathLike[str]], skipped: list[str] | None = None
) -> list[Spectrum]:
    """Read files and folders of spectra, folders in natural order.

    Parameters
    ----------
    paths : iterable of path
        A file named here must be a spectrum; what a folder holds beside spectra is passed over.
    skipped : list of str, optional
        Receives one line for each file passed over.

    Raises
    ------
    InputError
        As `read_file`, or if nothing is left.
    """
    return [spectrum for found in iter_spectra(paths, skipped) for spectrum in found]


def iter_spectra(
    paths: Iterable[str | os.PathLike[str]], skipped: list[str] | None = None
) -> Iterator[list[Spectrum]]:
    """As `read_spectra`, one file at a time."""
    any_read = False
    last: InputError | None = None
    files = spectrum_files(paths)
    for file, from_folder in files:
        try:
            found = read_file(file)
        except InputError as error:
            if not from_folder:
                raise
            last = error
            if skipped is not None:
                skipped.append(str(error))
            continue
        any_read = True
        yield found
    if last is not None and not any_read:
        raise InputError(f"none of {len(files)} files is a spectrum; the last one: {last}")


def _checked(
    x: Array,
    y: Array,
    where: Path,
    metadata: dict[str, str],
    temperature: float | None,
) -> Spectrum:
    """Sort, merge repeated axis values, and make sure there is a silicon line to look for."""
    good = np.isfinite(x) & np.isfinite(y)
    x, y = np.asarray(x, dtype=float)[good], np.asarray(y, dtype=float)[good]
    require_line(x, str(where))
    unique, inverse, counts = np.unique(x, return_inverse=True, return_counts=True)
    y = np.bincount(inverse, weights=y) / counts
    inside = int(np.count_nonzero((unique >= WINDOW[0]) & (unique <= WINDOW[1])))
    if inside < MIN_SAMPLES:
        raise InputError(
            f"{where}: {inside} samples between {WINDOW[0]:g} and {WINDOW[1]:g} cm⁻¹, expected at "
            f"least {MIN_SAMPLES} around silicon's line"
        )
    return Spectrum(unique, y, where.name, metadata, temperature, str(where.parent))
