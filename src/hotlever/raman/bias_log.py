"""Join a bias log with tip spectra into the measurement file that ``hotlever fit`` takes."""

from __future__ import annotations

import csv
import io
import os
import re
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hotlever.errors import InputError, shown
from hotlever.raman.spectrum import aliases, file_and_label
from hotlever.tables import TextTable, read_table
from hotlever.units import name_and_unit

if TYPE_CHECKING:
    import xarray as xr

TEMPERATURE, ERROR = "T_tip (K)", "dT_tip (K)"
_BIAS = re.compile(r"(V_?b|bias)\b", re.I)
_FILE = re.compile(r"(file|spectrum|spectra)\b", re.I)
_OLD = re.compile(r"d?T_?tip\b", re.I)
_IN_NAME = re.compile(r"(?:^|[^0-9A-Za-z.,-])(\d+(?:[.,p]\d+)?)\s?V(?![a-zA-Z0-9])")


def read_bias_log(path: str | os.PathLike[str]) -> TextTable:
    """Read a bias log: ``#`` comments, a header row, rows of numbers.

    Raises
    ------
    InputError
        If it has no header with a bias or file column, a row does not fit the header, or a bias
        is no number.
    """
    log = read_table(path, "a header row like 'V_b (V),I_h (mA),V_r (mV)'")
    if _bias(log) is None and _column(log, _FILE) is None:
        raise InputError(
            f"{log.where(-1)}: no bias column in '{shown(','.join(log.names))}', expected a header "
            "like 'V_b (V),I_h (mA),V_r (mV)'"
        )
    return log


def join(log: TextTable, spectra: xr.Dataset) -> str:
    """Measurement CSV: the log with tip temperature and error in two more columns.

    A row finds its spectrum by a ``file`` column of the log; else by the bias in the
    spectrum's name (``tip_5.25V.txt``); else by order, if there are as many of both. Columns
    of tip temperatures that the log already had are replaced. Rows without a spectrum, or
    whose spectrum gave no temperature, get empty cells.

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
    keep = [j for j, name in enumerate(log.names) if not _OLD.match(name)]
    out = io.StringIO()
    for _, line in log.comments:
        out.write(line + "\n")
    writer = csv.writer(out, delimiter=log.dialect.separator or ",", lineterminator="\n")
    writer.writerow([log.names[j] for j in keep] + [TEMPERATURE, ERROR])
    temperature, error = spectra.temperature_K.values, spectra.temperature_error_K.values
    for cells, spectrum in zip(log.rows, matched, strict=True):
        numbers = ["", ""]
        if spectrum is not None and np.isfinite(temperature[spectrum]):
            # an error is never written as 0
            digits = ".1f" if error[spectrum] >= 0.1 else ".2g"
            numbers = [f"{temperature[spectrum]:.1f}", f"{error[spectrum]:{digits}}"]
            if log.dialect.decimal_comma:
                numbers = [number.replace(".", ",") for number in numbers]
        writer.writerow([cells[j] for j in keep] + numbers)
    return out.getvalue()


def _column(log: TextTable, pattern: re.Pattern[str]) -> int | None:
    """Index of the first column whose heading begins so."""
    return next((j for j, name in enumerate(log.names) if pattern.match(name)), None)


def _bias(log: TextTable) -> np.ndarray | None:
    """Bias of each row in volts, NaN where blank; None without such a column."""
    column = _column(log, _BIAS)
    if column is None:
        return None
    return log.values(column, "V", name_and_unit(log.names[column])[0], unit="V")


def _match(log: TextTable, names: list[str]) -> list[int | None]:
    """For each row of the log the index of its spectrum."""
    column = _column(log, _FILE)
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
    match = _IN_NAME.search(label) or _IN_NAME.search(Path(file).stem)
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
            raise InputError(f"{log.where(row)}: spectrum '{shown(cells[column])}' {problem}")
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
