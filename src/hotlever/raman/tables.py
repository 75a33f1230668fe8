"""Tables of numbers in text files, whoever wrote them.

No dialect is assumed: the separator and the decimal sign are those that make the most lines
of the file rows of numbers. What stands before the table is its header: ``key = value`` lines
and, last, the names of the columns.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from hotlever.errors import InputError
from hotlever.raman.lineshape import Array

SEPARATORS = ("\t", ";", ",", "|", None)  # None is any run of blanks
_SAMPLE_LINES = 40
_MIN_ROWS = 2
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_KEY_VALUE = re.compile(r"^\s*[#;%!*\"]*\s*([^=:;\t]{1,80}?)\s*(?:[=:;]|\t)+\s*(.*?)\s*$")


@dataclass(frozen=True)
class Table:
    """Numbers, the names of their columns where the file gives them, and its header.

    Attributes
    ----------
    values : (rows, columns) array
        NaN where a cell is blank.
    names : list of str
        One for each column, or empty.
    metadata : dict of str to str
    """

    values: Array
    names: list[str] = field(default_factory=list)
    metadata: dict[str, str] = field(default_factory=dict)


def decode(raw: bytes, where: str) -> str:
    """Decode UTF-8 (with or without mark), UTF-16 or, failing those, Windows' Latin-1.

    Raises
    ------
    InputError
        If the bytes are no text.

    Examples
    --------
    >>> decode("µm".encode("utf-16"), ""), decode(b"\\xb5m", "")
    ('µm', 'µm')
    """
    head = raw[:4096]
    try:
        if head.startswith((b"\xff\xfe", b"\xfe\xff")):
            return raw.decode("utf-16")
        if b"\x00" in head:
            # UTF-16 without its mark: every other byte of western text is zero
            for encoding, zeros in (("utf-16-le", head[1::2]), ("utf-16-be", head[0::2])):
                if zeros and zeros.count(0) > 0.8 * len(zeros):
                    return raw.decode(encoding)
            raise InputError(f"{where}: a binary file, expected a Raman spectrum as text")
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        pass
    control = sum(byte < 9 or 13 < byte < 32 for byte in head)
    if control > 0.02 * len(head) or head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(f"{where}: a binary file, expected a Raman spectrum as text")
    return raw.decode("cp1252", errors="replace")


def parse_table(text: str, where: str) -> Table:
    """Find the table of numbers in a text.

    Raises
    ------
    InputError
        If there is none.

    Examples
    --------
    >>> table = parse_table("#Laser (nm)=\\t532\\nshift;counts\\n1,5;10\\n2,5;20\\n3,5;30", "")
    >>> table.values.tolist(), table.names, table.metadata
    ([[1.5, 10.0], [2.5, 20.0], [3.5, 30.0]], ['shift', 'counts'], {'Laser (nm)': '532'})
    """
    lines = text.splitlines()
    filled = [i for i, line in enumerate(lines) if line.strip()]
    if not filled:
        raise InputError(f"{where}: the file is empty, expected a Raman spectrum")
    separator, comma = _dialect([lines[i] for i in filled])
    rows: dict[int, list[float]] = {}
    for i in filled:
        row = _row(lines[i], separator, comma)
        if row is not None:
            rows[i] = row
    widths = [len(row) for row in rows.values()]
    if len(rows) < _MIN_ROWS:
        raise InputError(
            f"{where}: no table of numbers found (first line: '{_short(lines[filled[0]])}'), "
            "expected Raman shift and intensity in columns"
        )
    width = max(set(widths), key=widths.count)
    block = _longest_block(filled, {i for i, row in rows.items() if len(row) == width})
    values = np.array([rows[i] for i in block])
    header = [line for line in lines[: block[0]] if line.strip()]
    names, skip = _names(header, separator, width)
    metadata = _metadata(header[: len(header) - skip])
    full = ~np.all(np.isnan(values), axis=0)
    if names:
        names = [name for name, keep in zip(names, full, strict=True) if keep]
    return Table(values[:, full], names, metadata)


def _dialect(lines: list[str]) -> tuple[str | None, bool]:
    """Separator, and whether the decimal sign is a comma: what reads most of a sample."""
    tail = lines[len(lines) // 4 :] if len(lines) > 8 else lines
    sample = tail[:: max(len(tail) // _SAMPLE_LINES, 1)]
    best: tuple[str | None, bool] = (None, False)
    best_score = (-1, 0)
    for separator in SEPARATORS:
        for comma in (False, True):
            if comma and separator == ",":
                continue
            rows = [row for line in sample if (row := _row(line, separator, comma)) is not None]
            wide = [row for row in rows if np.count_nonzero(~np.isnan(row)) >= 2]
            # two columns beat one; the first dialect in the list wins a tie
            score = (len(wide), len(rows))
            if score > best_score:
                best, best_score = (separator, comma), score
            if len(wide) == len(sample):
                return best
    return best


def _row(line: str, separator: str | None, comma: bool) -> list[float] | None:
    """The numbers of a line, NaN for blank cells, or None if it holds anything else."""
    cells = line.strip(" \r\n").split(separator) if separator else line.split()
    while cells and not cells[-1].strip(' "\t'):
        cells.pop()
    numbers = []
    for cell in cells:
        cell = cell.strip(' "\t')
        if comma:
            if "." in cell:
                return None
            cell = cell.replace(",", ".")
        try:
            numbers.append(float(cell) if cell else float("nan"))
        except ValueError:
            if cell.lower() in ("--", "-", "n/a", "na"):
                numbers.append(float("nan"))
            elif _NUMBER.fullmatch(cell):
                numbers.append(float(cell.upper().replace("D", "E")))
            else:
                return None
        else:
            if cell and not _plain(cell):
                return None
    if not any(number == number for number in numbers):
        return None
    return numbers


def _plain(cell: str) -> bool:
    """Python's float also takes '1_000' and 'infinity'; a data file means neither."""
    return "_" not in cell and (cell[-1].isdigit() or cell[-1] == "." or cell.lower() == "nan")


def _longest_block(filled: list[int], rows: set[int]) -> list[int]:
    """The longest run of rows of one width with no other filled line between them."""
    best: list[int] = []
    current: list[int] = []
    for i in filled:
        if i in rows:
            current.append(i)
            if len(current) > len(best):
                best = current
        else:
            current = []
    return best


def _names(header: list[str], separator: str | None, width: int) -> tuple[list[str], int]:
    """Column names from the last lines before the table, and how many lines they took."""
    names: list[str] = []
    used = 0
    for line in reversed(header[-2:]):
        cells = [cell.strip(' "') for cell in line.strip(" \r\n").split(separator)]
        if separator is None:
            cells = [cell for cell in re.split(r"\t+|\s{2,}", line.strip()) if cell]
            if len(cells) != width:
                cells = line.split()
        while len(cells) > width and not cells[-1]:
            cells.pop()
        single = line.lstrip().startswith("#") and "=" in line
        if len(cells) != width or single or not any(cells):
            break
        names = [
            " ".join(filter(None, pair)) for pair in zip(cells, names or [""] * width, strict=True)
        ]
        used += 1
    return names, used


def _metadata(header: list[str]) -> dict[str, str]:
    metadata: dict[str, str] = {}
    for line in header:
        match = _KEY_VALUE.match(line)
        if match:
            metadata.setdefault(match[1].strip().strip('"'), match[2].strip().strip('"').strip(";"))
    return metadata


def _short(line: str, limit: int = 40) -> str:
    line = "".join(char if char.isprintable() else " " for char in line.strip())
    return line if len(line) <= limit else line[: limit - 1] + "…"
