"""The block of numbers in a spectrum's text file, and what stands above it.

No dialect is assumed: the separator and the decimal sign are those that make the most lines of the
file rows of numbers.
"""

from __future__ import annotations

import csv
import re
from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from hotlever.cells import cells_of, number
from hotlever.errors import InputError, shown
from hotlever.types import Array
from hotlever.units import LARGEST_NUMBER, key_and_value

MOST_NUMBERS = 10_000_000

# The separator (None is any run of blanks), and whether the decimal sign is a comma.
Dialect = tuple[str | None, bool]
_DIALECTS: list[Dialect] = [
    (separator, comma)
    for separator in ("\t", ";", ",", "|", None)
    for comma in (False, True)
    if (separator, comma) != (",", True)
]
_SAMPLE_LINES = 40
_PLAIN = re.compile(r"[-+.0-9eE\s;,|]*", re.ASCII)


@dataclass(frozen=True)
class Block:
    """Numbers (rows, columns), NaN where a cell is blank, and what the file says of them.

    ``names`` has one for each column, empty where the file gives none; ``metadata`` are the
    header's ``key = value`` lines.
    """

    values: Array
    names: list[str]
    metadata: dict[str, str]


def find_block(lines: list[str], where: str) -> Block:
    """Find the longest block of numbers, or raise InputError.

    Examples
    --------
    >>> text = "#Laser (nm)=\\t532\\nshift;counts\\n1,5;10\\n2,5;20\\n3,5;30"
    >>> block = find_block(text.splitlines(), "")
    >>> block.values.tolist(), block.names, block.metadata
    ([[1.5, 10.0], [2.5, 20.0], [3.5, 30.0]], ['shift', 'counts'], {'Laser (nm)': '532'})
    """
    lines = [line for line in lines if line.strip()]
    if not lines:
        raise InputError(f"{where}: the file is empty, expected a table of numbers")
    dialect = _dialect(lines)
    rows: list[Array | None] = []
    size = 0
    for line in lines:
        rows.append(row := _row(line, *dialect))
        size += 0 if row is None else row.size
        if size > MOST_NUMBERS:
            raise InputError(f"{where}: more than {MOST_NUMBERS} numbers, expected fewer")
    widths = [row.size for row in rows if row is not None]
    if len(widths) < 2:
        raise InputError(
            f"{where}: no table of numbers found (first line: '{shown(lines[0])}'), expected "
            "columns of numbers"
        )
    width = max(set(widths), key=widths.count)
    # the longest run of rows of one width with nothing else between them
    runs = groupby(enumerate(rows), key=lambda one: one[1] is not None and one[1].size == width)
    run = max((list(run) for fits, run in runs if fits), key=len)
    values = np.array([row for _, row in run])
    above = lines[: run[0][0]]
    names, used = _names(above, dialect[0], width)
    header = [key_and_value(line) for line in above[: len(above) - used]]
    full = ~np.all(np.isnan(values), axis=0)
    return Block(
        values[:, full],
        [name for name, keep in zip(names, full, strict=True) if keep],
        {key: value for key, value in reversed(header) if value},
    )


def _dialect(lines: list[str]) -> Dialect:
    """What makes the most of a sample rows of numbers; two columns beat one."""
    tail = lines[len(lines) // 4 :] if len(lines) > 8 else lines
    sample = tail[:: max(len(tail) // _SAMPLE_LINES, 1)]

    def fit(dialect: Dialect) -> tuple[int, int]:
        rows = [row for line in sample if (row := _row(line, *dialect)) is not None]
        wide = [row for row in rows if np.count_nonzero(~np.isnan(row)) >= 2]
        return len(wide), len(rows)

    return max(_DIALECTS, key=fit)


def _row(line: str, separator: str | None, comma: bool) -> Array | None:
    """The numbers of a line, NaN for blank cells, or None if it holds anything else."""
    plain = _PLAIN.fullmatch(line) and not (comma and "." in line)
    if plain and comma:
        line, comma = line.replace(",", "."), False
    try:
        cells = cells_of(line.strip(" "), separator)
    except csv.Error:
        return None
    while cells and not cells[-1]:
        cells.pop()
    # nearly every line has nothing but numbers, and maps have millions
    if cells and plain:
        with suppress(ValueError):
            row = np.array(list(map(float, cells)))
            return row if np.abs(row).max() <= LARGEST_NUMBER else None
    values = [number(cell, comma) for cell in cells]
    row = np.array(values, dtype=float)
    return None if None in values or np.isnan(row).all() else row


def _names(above: list[str], separator: str | None, width: int) -> tuple[list[str], int]:
    """Column names from the last lines above the block, and how many lines they took."""
    names = [""] * width
    used = 0
    for line in reversed(above[-2:]):
        cells = [cell.strip(' "') for cell in line.strip(" ").split(separator)]
        if separator is None:
            wide = [cell for cell in re.split(r"\t+|\s{2,}", line.strip()) if cell]
            cells = wide if len(wide) == width else cells
        while len(cells) > width and not cells[-1]:
            cells.pop()
        setting = line.lstrip().startswith("#") and "=" in line
        if len(cells) != width or setting or not any(cells):
            break
        names = [f"{cell} {name}".strip() for cell, name in zip(cells, names, strict=True)]
        used += 1
    return names, used
