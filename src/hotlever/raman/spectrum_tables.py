"""Tables beside spectra: temperatures of a hot plate, corrections by hand, and a bias log.

A correction says of a single spectrum where its line is, which part is fitted, or neither. A bias
log is joined with tip spectra into the measurement file that ``hotlever fit`` takes.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hotlever.errors import InputError, excerpt, unknown_name
from hotlever.quantities import THERMOMETER
from hotlever.raman.lineshape import PeakOptions
from hotlever.raman.spectrum import Spectrum, aliases, file_and_label, sample_temperature
from hotlever.tables import TextTable, read_table
from hotlever.types import Array
from hotlever.units import name_and_unit

if TYPE_CHECKING:
    import xarray as xr

#: Header of a table of corrections.
COLUMNS = ("file", "start_cm-1", "from_cm-1", "to_cm-1", "use")


def read_temperatures(path: str | os.PathLike[str]) -> dict[str, float]:
    """Read a table of temperatures: file name and temperature, in a header's K or °C.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = Path(folder) / "plate.csv"
    ...     _ = table.write_text("file,temperature (C)\\na.txt,25\\nb.txt,100\\n")
    ...     read_temperatures(table)
    {'a.txt': 298.15, 'b.txt': 373.15}
    """
    table = read_table(path, "rows of file name and temperature", header=False)
    if len(table.names) < 2:
        raise InputError(
            f"{table.where(0)}: '{excerpt(table.rows[0][0])}', expected a file name and a "
            "temperature"
        )
    # a heading such as T_C has its unit without brackets
    celsius = re.search(r"[\W_](C|celsius)\W*$", table.names[1], re.I)
    kelvin = table.values(1, "K", "temperature", unit="C" if celsius else "K")
    temperatures: dict[str, float] = {}
    for row, (cells, value) in enumerate(zip(table.rows, kelvin, strict=True)):
        temperature = sample_temperature(float(value))
        if temperature is None:
            raise InputError(f"{table.where(row)}: '{excerpt(cells[1])}' is no sample temperature")
        name = Path(cells[0]).name
        if temperatures.setdefault(name, temperature) != temperature:
            raise InputError(f"{table.where(row)}: '{excerpt(name)}' has another temperature above")
    return temperatures


# --- corrections ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class SpectrumCorrection:
    """Of one spectrum; what is left out is as for all."""

    start: float | None = None  #: the line's place, cm⁻¹, near enough for the fit to begin there
    low: float | None = None  #: the part that is fitted begins here, cm⁻¹
    high: float | None = None  #: and ends here, cm⁻¹
    use: bool = True  #: whether the spectrum is measured at all

    def of(self, options: PeakOptions) -> PeakOptions:
        """Return how the line of this spectrum is fitted, where those of all are as in `options`.

        Examples
        --------
        >>> SpectrumCorrection(start=516.0, high=540.0).of(PeakOptions()).window
        (440.0, 540.0)
        """
        low, high = options.window
        window = (low if self.low is None else self.low, high if self.high is None else self.high)
        start = options.start if self.start is None else self.start
        return replace(options, start=start, window=window)


def corrections_text(corrections: Mapping[str, SpectrumCorrection]) -> str:
    """Return the table that `read_corrections` reads.

    Examples
    --------
    >>> print(corrections_text({"tip_04.txt": SpectrumCorrection(start=516.5)}), end="")
    file,start_cm-1,from_cm-1,to_cm-1,use
    tip_04.txt,516.5,,,yes
    """
    written = io.StringIO()
    table = csv.writer(written, lineterminator="\n")
    table.writerow(COLUMNS)
    for name, correction in corrections.items():
        *numbers, use = astuple(correction)
        cells = ("" if number is None else f"{number:.10g}" for number in numbers)
        table.writerow((name, *cells, "yes" if use else "no"))
    return written.getvalue()


def read_corrections(path: str | os.PathLike[str]) -> dict[str, SpectrumCorrection]:
    """Read a table of corrections: one row for each spectrum that needs one.

    Parameters
    ----------
    path : path
        A table with the columns ``file``, ``start_cm-1``, ``from_cm-1``, ``to_cm-1`` and ``use``
        (yes or no), in any order and all but the first as far as they are needed; a cell is empty
        where nothing is said. A file may be named with some of its folders before it.

    Raises
    ------
    InputError
        If it is no such table, names a file twice, or says what no spectrum can be fitted with.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = Path(folder) / "by-hand.csv"
    ...     _ = table.write_text("file,start_cm-1,use\\ntip_04.txt,516.5,\\ntip_07.txt,,no\\n")
    ...     read_corrections(table)["tip_07.txt"].use
    False
    """
    table = read_table(path, "rows of file name and what is corrected")
    heads = [name.strip().lower().replace(" (", "_").rstrip(")") for name in table.names]
    for name, head in zip(table.names, heads, strict=True):
        if head not in COLUMNS:
            raise unknown_name("column", name, COLUMNS, table.where(-1))
    if "file" not in heads or len(set(heads)) < len(heads):
        raise InputError(
            f"{table.where(-1)}: found {excerpt(', '.join(table.names))}, expected the column file "
            f"and any of {', '.join(COLUMNS[1:])}, each once"
        )
    corrections: dict[str, SpectrumCorrection] = {}
    nothing = np.full(len(table.rows), np.nan)
    numbers = [
        table.numbers(heads.index(name), name) if name in heads else nothing
        for name in COLUMNS[1:4]
    ]
    for row, cells in enumerate(table.rows):
        name = Path(cells[heads.index("file")]).as_posix()
        if name in corrections:
            raise InputError(f"{table.where(row)}: '{excerpt(name)}' has a row above")
        at_row = (float(column[row]) for column in numbers)
        start, low, high = (None if np.isnan(value) else value for value in at_row)
        use = cells[heads.index("use")].strip().lower() if "use" in heads else ""
        if use not in ("", "yes", "no"):
            raise InputError(f"{table.where(row)}: use: found '{excerpt(use)}', expected yes or no")
        corrections[name] = SpectrumCorrection(start, low, high, use != "no")
        try:
            corrections[name].of(PeakOptions())
        except InputError as error:
            raise InputError(f"{table.where(row)}: {error}") from None
    return corrections


def of_spectrum(
    spectrum: Spectrum, corrections: Mapping[str, SpectrumCorrection]
) -> SpectrumCorrection:
    """Return what is said of a spectrum, the row with the most folders before its name first."""
    names = _names(spectrum) if corrections else []
    return next((corrections[name] for name in names if name in corrections), SpectrumCorrection())


def check_corrections(
    corrections: Mapping[str, SpectrumCorrection], spectra: Iterable[Spectrum], where: str
) -> list[str]:
    """Check that there is a spectrum for each correction.

    Parameters
    ----------
    corrections : mapping
    spectra : iterable of Spectrum
        All that there are.
    where : str
        The table's name, for the error.

    Returns
    -------
    list of str
        Corrections for folders that none of the spectra is from.

    Raises
    ------
    InputError
        If there is none; the text names the nearest one.
    """
    if not corrections:
        return []
    spectra_named = dict.fromkeys(name for spectrum in spectra for name in _names(spectrum))
    folders = {Path(name).parent for name in spectra_named}
    elsewhere = [name for name in corrections if Path(name).parent not in folders]
    for name in corrections:
        if name not in spectra_named and name not in elsewhere:
            beside = [other for other in spectra_named if Path(other).parent == Path(name).parent]
            raise unknown_name("spectrum", name, beside, where)
    return elsewhere


def _names(spectrum: Spectrum) -> list[str]:
    """By what a spectrum may be called: its name, with more or fewer folders before it."""
    folders = Path(spectrum.folder).parts
    return [Path(*folders[depth:], spectrum.name).as_posix() for depth in range(len(folders) + 1)]


# --- the bias log ---------------------------------------------------------------------------------


def read_bias_log(path: str | os.PathLike[str]) -> TextTable:
    """Read a bias log: ``#`` comments, a header row, rows of numbers.

    Raises
    ------
    InputError
        If it has no header with a bias or file column, a row does not fit the header, or a bias
        is no number.
    """
    log = read_table(path, "a header row like 'V_b (V),I_h (mA),V_r (mV)'")
    if _bias(log) is None and _file_column(log) is None:
        raise InputError(
            f"{log.where(-1)}: no bias column in '{excerpt(','.join(log.names))}', expected a "
            "header like 'V_b (V),I_h (mA),V_r (mV)'"
        )
    return log


def join(log: TextTable, spectra: xr.Dataset) -> str:
    """Measurement CSV: the log with tip temperature and error in two more columns.

    A row finds its spectrum by a ``file`` column of the log; else by the bias in the
    spectrum's name (``tip_5.25V.txt``); else by order, if there are as many of both. Columns
    of tip temperatures that the log already had are replaced. Rows without a spectrum, or
    whose spectrum gave no temperature, get empty cells.

    The error in its column is of each temperature alone. By how much all are off together, for the
    calibration, laser heating and stress, is stated as ``raman_scale``, a share of the rise, with
    what no spectrum tells (`hotlever.quantities.THERMOMETER`), unless the log says it. What of
    those does not grow with the rise counts as of each.

    Parameters
    ----------
    log : TextTable
        From `read_bias_log`.
    spectra : xarray.Dataset
        With temperatures, see `hotlever.raman.series.read_lines`.

    Raises
    ------
    InputError
        If spectra and rows cannot be brought together.
    """
    matched = _match(log, [str(name) for name in spectra.file.values])
    keep = [j for j, name in enumerate(log.names) if not re.match(r"(?i)d?T_?tip\b", name)]
    comments = [line for _, line in log.comments]
    scale = r"(?i)\W*raman_?scale\b"
    if len(keep) < len(log.names):
        comments = [line for line in comments if not re.match(scale, line)]
    errors, share = _own_and_common(spectra)
    if not any(re.match(scale, line) for line in comments):
        comments.append(f"# raman_scale: ± {100.0 * math.hypot(share, THERMOMETER):.2g} %")
    out = io.StringIO()
    for line in comments:
        out.write(line + "\n")
    writer = csv.writer(out, delimiter=log.dialect.separator or ",", lineterminator="\n")
    writer.writerow([log.names[j] for j in keep] + ["T_tip (K)", "dT_tip (K)"])
    temperature = spectra.temperature_K.values
    for cells, spectrum in zip(log.rows, matched, strict=True):
        numbers = ["", ""]
        if spectrum is not None and np.isfinite(temperature[spectrum]):
            # an error is never written as 0
            digits = ".1f" if errors[spectrum] >= 0.1 else ".2g"
            numbers = [f"{temperature[spectrum]:.1f}", f"{errors[spectrum]:{digits}}"]
            if log.dialect.decimal_comma:
                numbers = [number.replace(".", ",") for number in numbers]
        writer.writerow([cells[j] for j in keep] + numbers)
    return out.getvalue()


def _own_and_common(spectra: xr.Dataset) -> tuple[Array, float]:
    """Split errors into those (K) of each temperature and the share of the rise common to all.

    The share fits the variances in common best; what these have beyond it is added to each.
    """
    noise = spectra.temperature_noise_K.values
    common = np.maximum(spectra.temperature_error_K.values**2 - noise**2, 0.0)
    rise = (spectra.temperature_K.values - spectra.room_temperature_K) ** 2
    share = np.nansum(common * rise) / max(float(np.nansum(rise**2)), 1e-300)
    return np.sqrt(noise**2 + np.maximum(common - share * rise, 0.0)), math.sqrt(share)


def _column(log: TextTable, pattern: str) -> int | None:
    """Index of the first column whose heading begins so."""
    return next((j for j, name in enumerate(log.names) if re.match(pattern, name)), None)


def _file_column(log: TextTable) -> int | None:
    return _column(log, r"(?i)(file|spectrum|spectra)\b")


def _bias(log: TextTable) -> np.ndarray | None:
    """Bias of each row in volts, NaN where blank; None without such a column."""
    column = _column(log, r"(?i)(V_?b|bias)\b")
    if column is None:
        return None
    return log.values(column, "V", name_and_unit(log.names[column])[0], unit="V")


def _match(log: TextTable, names: list[str]) -> list[int | None]:
    """For each row of the log the index of its spectrum."""
    column = _file_column(log)
    if column is not None:
        return _by_name(log, column, names)
    bias = _bias(log)
    stated = [_bias_in_name(name) for name in names]
    if bias is not None and None not in stated:
        return _by_bias(log, bias, [value for value in stated if value is not None], names)
    if len(names) == len(log.rows):
        return list(range(len(names)))
    raise InputError(
        f"{log.path}: {len(log.rows)} rows and {len(names)} spectra; expected as many of both, a "
        "column 'file' that names the spectra, or names with the bias such as tip_5.25V.txt"
    )


def _bias_in_name(name: str) -> float | None:
    """Bias (V) that a spectrum's own name in its file states, else the file's name."""
    file, label = file_and_label(Path(name).name)
    bias = r"(?:^|[^0-9A-Za-z.,-])(-?\d+(?:[.,p]\d+)?)\s?V(?![a-zA-Z0-9])"
    match = re.search(bias, label) or re.search(bias, Path(file).stem)
    return float(match[1].replace(",", ".").replace("p", ".")) if match else None


def _by_name(log: TextTable, column: int, names: list[str]) -> list[int | None]:
    called = defaultdict[str, list[int]](list)
    for spectrum, name in enumerate(names):
        for alias in aliases(name):
            called[alias].append(spectrum)
    matched: list[int | None] = []
    for row, cells in enumerate(log.rows):
        name = Path(cells[column]).name
        spectra = called.get(name, [])
        if name and len(spectra) != 1:
            problem = f"names {len(spectra)} of them" if spectra else "is not among those given"
            raise InputError(f"{log.where(row)}: spectrum '{excerpt(cells[column])}' {problem}")
        matched.append(spectra[0] if spectra else None)
    return matched


def _by_bias(
    log: TextTable, bias: np.ndarray, stated: list[float], names: list[str]
) -> list[int | None]:
    matched: list[int | None] = [None] * bias.size
    for spectrum, (value, name) in enumerate(zip(stated, names, strict=True)):
        distance = np.abs(np.where(np.isnan(bias), np.inf, bias) - value)
        nearest = int(np.argmin(distance))
        # a name is rounded: 5.25V for 5.2500 V
        if not distance[nearest] <= 0.006 * max(abs(value), 1.0):
            raise InputError(
                f"{log.path}: no row at the bias of {name} ({value:g} V); the nearest is "
                f"{bias[nearest]:g} V"
            )
        other = matched[nearest]
        if other is not None:
            raise InputError(
                f"{log.path}: two spectra at {bias[nearest]:g} V: {names[other]} and {name}"
            )
        matched[nearest] = spectrum
    return matched
