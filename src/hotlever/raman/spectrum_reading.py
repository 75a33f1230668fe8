"""Spectra from files and folders, in text or a maker's own format."""

from __future__ import annotations

import gzip
import io
import os
import re
import zlib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from hotlever.errors import InputError
from hotlever.files import LARGEST_TEXT, read_bytes
from hotlever.raman.detector_noise import overflows, zeros
from hotlever.raman.lineshape import in_window
from hotlever.raman.makers import MAKERS, read_makers, refuse_labspec
from hotlever.raman.spectrum import (
    Spectrum,
    names_in_file,
    temperature_in_metadata,
    temperature_in_name,
)
from hotlever.raman.text_layout import pick_spectra, require_line
from hotlever.tables import find_tables
from hotlever.types import Array, Progress
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
