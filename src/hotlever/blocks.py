"""The blocks of numbers in a spectrum's text file, and what stands above them.

No dialect is assumed: the separator and the decimal sign are those that make the most lines of the
file rows of numbers.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from hotlever.cells import DIALECTS, Dialect
from hotlever.errors import InputError, shown
from hotlever.types import Array
from hotlever.units import key_and_value

#: Of a file; a map of 500 spectra below each other has half a million lines.
MOST_LINES, MOST_NUMBERS = 600_000, 10_000_000


_SAMPLE_LINES = 40
_RIVAL = 0.25  # part of the rows that may be of another width
_MOST_GAPS = 0.1  # of rows; where more have no number, the file means something else
_SPLIT = re.compile(r",0\d+(,|$)")  # a decimal comma's digits, taken for a cell
_FEWEST_ROWS = 12  # of a further block; a spectrum has more


@dataclass(frozen=True)
class Block:
    """Numbers (rows, columns), NaN where a cell is blank, and what the file says of them.

    ``names`` has one for each column, empty where the file gives none; ``metadata`` are the
    header's ``key = value`` lines.
    """

    values: Array
    names: list[str]
    metadata: dict[str, str]


def find_blocks(lines: list[str], where: str) -> list[Block]:
    """Find the blocks of numbers that have the commonest number of columns.

    A block goes on beyond lines that say nothing, such as a comment; what has a header of its own
    is another block, to which the first header applies too where its own says nothing else.

    Raises
    ------
    InputError
        If there is none, or there are too many numbers.

    Examples
    --------
    >>> text = "#Laser (nm)=\\t532\\nshift;counts\\n1,5;10\\n2,5;20\\n3,5;30"
    >>> (block,) = find_blocks(text.splitlines(), "")
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
        rows.append(row := dialect.row(line))
        size += 0 if row is None else row.size
        if size > MOST_NUMBERS:
            raise InputError(f"{where}: more than {MOST_NUMBERS} numbers, expected fewer")
    split = [line for line in lines if "." not in line and _SPLIT.search(line)]
    if dialect.separator == "," and len(split) > 1:
        raise InputError(
            f"{where}: decimal commas between commas (line '{shown(split[0])}'), expected decimal "
            "points or another separator"
        )
    widths = Counter(row.size for row in rows if row is not None)
    if widths.total() < 2:
        raise InputError(
            f"{where}: no table of numbers found (first line: '{shown(lines[0])}'), expected "
            "columns of numbers"
        )
    width, count = widths.most_common(1)[0]
    for other, rivals in widths.items():
        if other != width > 1 < other and rivals > max(_FEWEST_ROWS, _RIVAL * count):
            raise InputError(
                f"{where}: {count} rows of {width} numbers and {rivals} of {other}, expected rows "
                "of as many cells"
            )
    width = _to_one_width(lines, rows, width, dialect, where)
    return list(_blocks(lines, rows, width, dialect))


def _to_one_width(
    lines: list[str], rows: list[Array | None], width: int, dialect: Dialect, where: str
) -> int:
    """Bring the rows to the width of most of them, less columns that are blank to the right.

    Rows of another width become None. Between two rows a line of as many cells, of which the first
    is a number, is a row with gaps: it has an overflow or an error code in a cell.
    """
    full = np.array([row for row in rows if row is not None and row.size == width])
    width = int(np.flatnonzero(~np.isnan(full).all(axis=0)).max()) + 1
    for index, row in enumerate(rows):
        if row is not None:
            fits = row.size >= width and bool(np.isnan(row[width:]).all())
            rows[index] = row[:width] if fits else None
    inside = [index for index, row in enumerate(rows) if row is not None]
    odd = ""
    count = 0
    for index in range(inside[0], inside[-1]):
        if rows[index] is None:
            cells = dialect.cells(lines[index]) or []
            numbers = [dialect.number(cell) for cell in cells] if len(cells) == width else [None]
            if numbers[0] is not None and not np.isnan(numbers[0]):
                rows[index] = np.array(numbers, dtype=float)
                odd, count = odd or cells[numbers.index(None)], count + 1
    if count > max(_FEWEST_ROWS, _MOST_GAPS * len(inside)):
        raise InputError(
            f"{where}: {count} rows of {len(inside) + count} have a cell that is no number, the "
            f"first '{shown(odd)}'; expected numbers"
        )
    return width


def _blocks(
    lines: list[str], rows: list[Array | None], width: int, dialect: Dialect
) -> Iterator[Block]:
    """Blocks in their order, of the longest and those that could be spectra too."""
    runs = [
        list(run) for fits, run in groupby(range(len(rows)), lambda i: rows[i] is not None) if fits
    ]
    fewest = min(_FEWEST_ROWS, max(map(len, runs)))
    blocks: list[tuple[list[int], list[str], dict[str, str]]] = []
    end = 0
    for run in runs:
        above = lines[end : run[0]]
        names, used = _names(above, dialect, width)
        header = [key_and_value(line) for line in above[: len(above) - used]]
        metadata = {key: value for key, value in reversed(header) if value}
        end = run[-1] + 1
        if blocks and not (any(names) or metadata):
            blocks[-1][0].extend(run)
        else:
            blocks.append((run, names, metadata))
    first = blocks[0]
    for run, names, metadata in blocks:
        if len(run) < fewest:
            continue
        values = np.array([rows[index] for index in run])
        names = names if any(names) else first[1]
        full = ~np.all(np.isnan(values), axis=0)
        yield Block(
            values[:, full],
            [name for name, keep in zip(names, full, strict=True) if keep],
            {**first[2], **metadata},
        )


def _dialect(lines: list[str]) -> Dialect:
    """What makes the most of a sample rows of numbers; two columns beat one."""
    tail = lines[len(lines) // 4 :] if len(lines) > 8 else lines
    sample = tail[:: max(len(tail) // _SAMPLE_LINES, 1)]

    def fit(dialect: Dialect) -> tuple[int, int]:
        rows = [row for line in sample if (row := dialect.row(line)) is not None]
        return sum(int(np.count_nonzero(~np.isnan(row)) >= 2) for row in rows), len(rows)

    best = max(DIALECTS, key=fit)
    grouped = [replace(dialect, grouped=True) for dialect in DIALECTS]
    # 1,234 is a number with a decimal comma before it is one in the thousands
    return replace(best, grouped=True) if fit(best)[0] else max(grouped, key=fit)


def _names(above: list[str], dialect: Dialect, width: int) -> tuple[list[str], int]:
    """Column names from the last lines above the block, and how many lines they took."""
    names = [""] * width
    used = 0
    for line in reversed(above[-2:]):
        cells = [cell.strip(' "') for cell in line.strip(" ").split(dialect.separator)]
        if dialect.separator is None:
            wide = [cell for cell in re.split(r"\t+|\s{2,}", line.strip()) if cell]
            cells = wide if len(wide) == width else cells
        while len(cells) > width and not cells[-1]:
            cells.pop()
        setting = line.lstrip().startswith("#") and "=" in line
        numbers = [dialect.number(cell) for cell in cells]
        # 'Laser (nm)  532' is no heading, while a map's headings, or temperatures, are numbers
        setting = setting or (numbers[-1:] != [None] and (len(cells) == 2 or used > 0))
        if len(cells) != width or setting or not any(cells):
            break
        names = [f"{cell} {name}".strip() for cell, name in zip(cells, names, strict=True)]
        used += 1
    return names, used
