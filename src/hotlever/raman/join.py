"""Join a bias log with tip spectra into the measurement file that ``hotlever fit`` takes."""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hotlever.errors import InputError
from hotlever.raman.series import Row
from hotlever.raman.tables import decode

TEMPERATURE, ERROR = "T_tip (K)", "dT_tip (K)"
_BIAS = re.compile(r"^\s*\"?(V_?b|bias)\b", re.I)
_BIAS_UNIT = re.compile(r"[(\[]\s*(m|k|µ|u)?V\s*[)\]]")
_FILE = re.compile(r"^\s*\"?(file|spectrum|spectra)\b", re.I)
_OLD = re.compile(r"^\s*\"?d?T_?tip\b", re.I)
_IN_NAME = re.compile(r"(?:^|[^0-9A-Za-z.,-])(\d+(?:[.,p]\d+)?)\s?V(?![a-zA-Z0-9])")
_SCALE = {None: 1.0, "m": 1e-3, "k": 1e3, "µ": 1e-6, "u": 1e-6}


@dataclass(frozen=True)
class BiasLog:
    """A bias log as it stands in the file: cells are text and stay so.

    Attributes
    ----------
    comments : list of str
        ``#`` lines, in order.
    names : list of str
        Column headers.
    rows : list of list of str
    separator : str
    decimal_comma : bool
    """

    comments: list[str]
    names: list[str]
    rows: list[list[str]]
    separator: str
    decimal_comma: bool

    def column(self, pattern: re.Pattern[str]) -> int | None:
        """Index of the first column whose header matches."""
        return next((j for j, name in enumerate(self.names) if pattern.search(name)), None)

    def bias(self) -> np.ndarray | None:
        """Bias of each row in volts, NaN where blank; None without such a column."""
        at = self.column(_BIAS)
        if at is None:
            return None
        unit = _BIAS_UNIT.search(self.names[at])
        scale = _SCALE[unit[1]] if unit else 1.0
        return np.array([_number(row[at]) * scale for row in self.rows])


def read_bias_log(path: str | os.PathLike[str]) -> BiasLog:
    """Read a bias log: ``#`` comments, a header row, rows of numbers.

    Raises
    ------
    InputError
        If it has no header with a bias column, or a row does not fit the header.
    """
    try:
        text = decode(Path(path).read_bytes(), str(path))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    lines = text.splitlines()
    comments = [line for line in lines if line.lstrip().startswith("#")]
    body = [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(body) < 2:
        raise InputError(f"{path}: no rows, expected a header row and one row for each bias")
    separator = max("\t;,", key=lambda mark: body[0][1].count(mark))
    decimal_comma = separator != "," and any("," in line for _, line in body[1:])
    parsed = list(csv.reader([line for _, line in body], delimiter=separator))
    names = [name.strip() for name in parsed[0]]
    log = BiasLog(comments, names, [], separator, decimal_comma)
    if log.column(_BIAS) is None and log.column(_FILE) is None:
        raise InputError(
            f"{path}: line {body[0][0]}: no bias column in '{body[0][1].strip()[:60]}', expected "
            "a header like 'V_b (V),I_h (mA),V_r (mV)'"
        )
    for (number, line), cells in zip(body[1:], parsed[1:], strict=True):
        cells = [cell.strip() for cell in cells]
        while len(cells) > len(names) and not cells[-1]:
            cells.pop()
        cells += [""] * (len(names) - len(cells))
        if len(cells) > len(names):
            raise InputError(
                f"{path}: line {number}: {len(cells)} cells in '{line.strip()[:60]}', expected "
                f"{len(names)} as in the header"
            )
        at = log.column(_BIAS)
        if at is not None and cells[at] and math.isnan(_number(cells[at])):
            raise InputError(f"{path}: line {number}: bias '{cells[at][:40]}', expected a number")
        log.rows.append(cells)
    return log


def join(log: BiasLog, spectra: Sequence[Row], where: str = "bias log") -> str:
    """Measurement CSV: the log with tip temperature and error in two more columns.

    A row finds its spectrum by a ``file`` column of the log; else by the bias in the
    spectrum's name (``tip_5.25V.txt``); else by order, if there are as many of both. Columns
    of tip temperatures that the log already had are replaced. Rows without a spectrum, or
    whose spectrum gave no temperature, get empty cells.

    Parameters
    ----------
    log : BiasLog
    spectra : sequence of Row
        With temperatures, see `hotlever.raman.series.read_lines`.
    where : str
        Name of the log, for error messages.

    Raises
    ------
    InputError
        If spectra and rows cannot be brought together.
    """
    matched = _match(log, spectra, where)
    keep = [j for j, name in enumerate(log.names) if not _OLD.search(name)]
    out = io.StringIO()
    for line in log.comments:
        out.write(line + "\n")
    writer = csv.writer(out, delimiter=log.separator, lineterminator="\n")
    writer.writerow([log.names[j] for j in keep] + [TEMPERATURE, ERROR])
    for cells, found in zip(log.rows, matched, strict=True):
        numbers = ["", ""]
        if found is not None and math.isfinite(found.temperature):
            numbers = [f"{found.temperature:.1f}", f"{found.error:.1f}"]
            if log.decimal_comma:
                numbers = [number.replace(".", ",") for number in numbers]
        writer.writerow([cells[j] for j in keep] + numbers)
    return out.getvalue()


def _match(log: BiasLog, spectra: Sequence[Row], where: str) -> list[Row | None]:
    at = log.column(_FILE)
    if at is not None:
        by_name = {Path(row.file).name: row for row in spectra}
        by_stem = {Path(name).stem: row for name, row in by_name.items()}
        found = []
        for cells in log.rows:
            name = Path(cells[at]).name
            if name and name not in by_name and name not in by_stem:
                raise InputError(f"{where}: spectrum '{cells[at]}' is not among those given")
            found.append(by_name.get(name, by_stem.get(name)) if name else None)
        return found
    bias = log.bias()
    stated = [_bias_in_name(row.file) for row in spectra]
    if bias is not None and all(value is not None for value in stated):
        return _by_bias(bias, stated, spectra, where)
    if len(spectra) == len(log.rows):
        return list(spectra)
    raise InputError(
        f"{where}: {len(log.rows)} rows and {len(spectra)} spectra; expected as many of both, a "
        "column 'file' that names the spectra, or names with the bias such as tip_5.25V.txt"
    )


def _by_bias(
    bias: np.ndarray, stated: Sequence[float | None], spectra: Sequence[Row], where: str
) -> list[Row | None]:
    matched: list[Row | None] = [None] * bias.size
    for value, row in zip(stated, spectra, strict=True):
        assert value is not None
        distance = np.abs(bias - value)
        nearest = int(np.nanargmin(distance))
        # a name is rounded: 5.25V for 5.2500 V
        if not distance[nearest] <= 0.006 * max(abs(value), 1.0):
            raise InputError(
                f"{where}: no row at the bias of {row.file} ({value:g} V); the nearest is "
                f"{bias[nearest]:g} V"
            )
        if matched[nearest] is not None:
            raise InputError(
                f"{where}: two spectra at {bias[nearest]:g} V: {matched[nearest].file} and "  # type: ignore[union-attr]
                f"{row.file}"
            )
        matched[nearest] = row
    return matched


def _bias_in_name(name: str) -> float | None:
    match = _IN_NAME.search(Path(name).stem)
    return float(match[1].replace(",", ".").replace("p", ".")) if match else None


def _number(cell: str) -> float:
    try:
        return float(cell.replace(",", ".")) if cell else math.nan
    except ValueError:
        return math.nan
