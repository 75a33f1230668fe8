"""From a file's text to its tables."""

from __future__ import annotations

import hashlib
import os
import re
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import groupby

import numpy as np

from hotlever.errors import InputError, counted, excerpt
from hotlever.files import read_bytes
from hotlever.tables.binary import lines_of_binary
from hotlever.tables.headings import (
    begins_number,
    begins_other_lines,
    below_a_header,
    header_row,
    headings_in,
    is_comment,
    is_row_of_units,
    is_underline,
    may_end_early,
    names_above,
    row_mostly_of_numbers,
    row_of_numbers,
    separator_in,
    units_beside,
    unquoted,
    with_units,
    without_marks,
)
from hotlever.tables.table import Dialect, Line, TextTable, filled_lines, is_readable
from hotlever.types import Array
from hotlever.units import NUMBER, differ, is_unit, key_and_value, name_and_unit

# --- a file of one table --------------------------------------------------------------------------


def read_table(
    path: str | os.PathLike[str],
    expected: str,
    header: bool = True,
    is_heading: Callable[[str], bool] | None = None,
    group: str | None = None,
    group_stated_by: str = "",
) -> TextTable:
    """Read a table of cells separated by tabs, semicolons, commas or, some, by blanks.

    Numbers may have decimal commas unless these separate the cells. Lines that start with ``#``
    are comments. Some binary files hold tables too (`hotlever.tables.binary`).

    Parameters
    ----------
    path : path
    expected : str
        What the file should hold, for the error if it holds nothing.
    header : bool
        Whether there must be a header row. Else a first row with a number is none.
    is_heading : callable, optional
        Whether a heading is one of those looked for, in a table of numbers. The header row is then
        looked for (`hotlever.tables.headings.header_row`): lines above it are comments, numbers
        alone have none, and lines without numbers between it and the first row are remarks. Else
        it is the first line that is no comment, and rows may be words alone.
    group : str, optional
        Of a binary file, if it has several tables.
    group_stated_by : str, optional
        How a user names it, as ``--column 'group={group}'``; left out where there is no way.

    Raises
    ------
    InputError
        If there is no such table; the text names file and line.
    """
    raw = read_bytes(path)
    lines = lines_of_binary(raw, str(path), group, group_stated_by) or filled_lines(raw, str(path))
    if is_heading is not None and lines:
        lines = below_a_header(lines)
    first = next((i for i, (_, line) in enumerate(lines) if not is_comment(line)), None)
    if first is None:
        raise InputError(f"{path}: no header row and no rows, expected {expected}")
    row = first if is_heading is None else header_row(lines, is_heading)
    start = first if row is None else row
    named = row is not None
    reader = _Reader(str(path), lines[start:], named, words=is_heading is None)
    comments = lines[:start]
    for line in lines[start + named :]:
        if is_comment(line[1]) or not reader.takes(*line):
            comments.append(line)
    names, rows = reader.names, reader.rows
    if not header and (not rows or any(map(NUMBER.fullmatch, names))):
        names, rows = [""] * len(names), [lines[start], *rows]
    if reader.skipping or not rows:
        where = f"line {reader.skipping}: another table" if reader.skipping else "no data rows"
        raise InputError(f"{path}: {where} after the header")
    if named and any(names):
        names = reader.with_units(comments)
    dialect = reader.dialect(rows)
    if row is None:
        _check_commas(rows, dialect, str(path))
    return TextTable(
        path=str(path),
        dialect=dialect,
        names=names,
        array=np.array([_numbers(line, dialect, len(names)) for _, line in rows]),
        lines=rows,
        comments=comments,
        header=lines[start][0],
        sha256=hashlib.sha256(raw).hexdigest(),
        columns=list(range(len(names))),
        remarks=reader.remarks,
    )


def _numbers(line: str, dialect: Dialect, width: int) -> Array:
    """Return the numbers of a row of some width, NaN where a cell holds something else."""
    row = dialect.row(line)
    if row is None:
        numbers = [dialect.number(cell) for cell in dialect.cells(line) or []]
        row = np.array(numbers, dtype=float)
    return row[:width] if row.size >= width else np.append(row, np.full(width - row.size, np.nan))


class _Reader:
    """The rows below a header row, or of numbers alone.

    `lines` begin with the header row, or the first row if there is none.
    """

    def __init__(self, path: str, lines: list[Line], named: bool, words: bool) -> None:
        self._path, self._words = path, words
        self.rows: list[Line] = []
        self.remarks: list[Line] = []
        self.skipping = 0  # the line since which the next header row is waited for
        self._units: list[str] = []
        self._header, line = lines[0][0], unquoted(lines[0][1])
        self._named_by = line if named else None
        separator = separator_in(line)
        if not named or is_comment(line):
            # the heading may be separated in another way than the rows
            row = next(text for _, text in lines if not is_comment(text))
            self.names = headings_in(line) if named else []
            separator, width = (
                row_of_numbers(row, len(self.names) or None)
                or row_mostly_of_numbers(row)
                or (separator_in(row), len(headings_in(row)))
            )
            self.names = self.names or [""] * width
        elif separator is None:
            self.names = headings_in(line)
            separator = None if len(self.names) > 1 else ","
        else:
            self.names = self._cells(self._header, line, separator)
        self._separator = separator
        while named and len(self.names) > 1 and not self.names[-1]:
            self.names.pop()
        if named:
            self.names[0] = without_marks(self.names[0])

    def _cells(self, number: int, line: str, separator: str | None) -> list[str]:
        cells = Dialect(separator).cells(line)
        if cells is None:
            raise InputError(
                f"{self._path}: line {number}: found '{excerpt(line)}', expected quotes in pairs "
                "around a cell"
            )
        return cells

    def takes(self, number: int, line: str) -> bool:
        """Take a line as a row if it is one; return whether it has been used."""
        if self.skipping and self._separator is not None and self.names[-1] not in line:
            return False
        cells = self._cells(number, line, self._separator)
        width = len(self.names)
        while len(cells) > width and not cells[-1]:
            cells.pop()
        if cells == self.names or line == self._named_by:
            self.skipping = 0  # a further sweep
            return True
        if self.skipping or begins_other_lines(cells):
            self.skipping = self.skipping or number
            return False
        if len(cells) < width and may_end_early(self.names):
            cells += [""] * (width - len(cells))
        if not (self.rows or self._is_row(cells)) and len(cells) <= width:
            units = [cell.strip("()[]{}<> ") for cell in cells]
            if not self._units and any(map(is_unit, units)):
                self._units = units
            elif not is_underline(cells):
                self.remarks.append((number, line))
            return True
        if len(cells) != width:
            halves = self._separator == "," and len(cells) == 2 * width
            hint = "; with decimal commas, tabs or semicolons must separate the cells" * halves
            raise InputError(
                f"{self._path}: line {number}: {counted(len(cells), 'cell')}, expected {width} as "
                f"in line {self._header}{hint}"
            )
        self.rows.append((number, line))
        return True

    def _is_row(self, cells: list[str]) -> bool:
        """Whether cells below the header row are a row: any is a number, or all are no value."""
        if self._words or any(map(begins_number, cells)):
            return True
        says_something = is_underline(cells) or any(map(is_unit, cells))
        return all(map(is_readable, cells)) and not says_something

    def with_units(self, comments: list[Line]) -> list[str]:
        """Return the headings with the units that stand in a row of their own."""
        rows = [self._units]
        rows += [
            self._cells(*line, self._separator) for line in comments if is_row_of_units(line[1])
        ]
        units = next((row for row in rows if any(map(is_unit, row))), [])
        for name, unit in zip(self.names, units, strict=False):
            if (own := name_and_unit(name)[1]) is not None and differ(own, unit):
                raise InputError(
                    f"{self._path}: line {self._header}: the unit of '{excerpt(name)}' is "
                    f"'{excerpt(unit)}' in the row of units, expected the same"
                )
        names = with_units(self.names, units)
        cells = [self._cells(*line, self._separator) for line in self.rows]
        try:
            return with_units(names, units_beside(names, cells))
        except ValueError as error:
            row, unit, above = error.args
            raise InputError(
                f"{self._path}: line {self.rows[row][0]}: the unit is '{excerpt(unit)}', expected "
                f"'{excerpt(above)}' as above"
            ) from None

    def dialect(self, rows: list[Line]) -> Dialect:
        """Return how the rows are written: with decimal commas, if any number has one."""
        dialect = Dialect(self._separator, decimal_comma=True)
        cells = (cell for _, line in rows for cell in dialect.cells(line) or [])
        commas = any("," in cell and dialect.number(cell) is not None for cell in cells)
        return dialect if commas else Dialect(self._separator)


# --- numbers anywhere -----------------------------------------------------------------------------

#: Of a further table in a file; a spectrum has more.
_FEWEST_ROWS = 12


def find_tables(
    raw: bytes, path: str, most_lines: int = 600_000, most_numbers: int = 10_000_000
) -> list[TextTable]:
    """Find the tables of numbers that have the commonest number of columns.

    A table goes on beyond lines that say nothing, such as a comment; what has a header of its own
    is another one, to which the first header applies too where its own says nothing else. A map of
    500 spectra below each other has half a million lines.

    Raises
    ------
    InputError
        If there is none, or there are too many numbers.

    Examples
    --------
    >>> text = "#Laser (nm)=\\t532\\nshift;counts\\n1,5;10\\n2,5;20\\n3,5;30"
    >>> (table,) = find_tables(text.encode(), "")
    >>> table.array.tolist(), table.names, table.settings
    ([[1.5, 10.0], [2.5, 20.0], [3.5, 30.0]], ['shift', 'counts'], {'Laser (nm)': '532'})
    """
    lines = filled_lines(raw, path, most_lines)
    if not lines:
        raise InputError(f"{path}: the file is empty, expected a table of numbers")
    dialect = Dialect.of(lines)
    rows: list[Array | None] = []
    size = 0
    for _, line in lines:
        rows.append(row := dialect.row(line))
        size += 0 if row is None else row.size
        if size > most_numbers:
            raise InputError(f"{path}: more than {most_numbers} numbers, expected fewer")
    _check_commas(lines, dialect, path)
    widths = Counter(row.size for row in rows if row is not None)
    if widths.total() < 2:
        raise InputError(
            f"{path}: no table of numbers found (first line: '{excerpt(lines[0][1])}'), expected "
            "columns of numbers"
        )
    width, count = widths.most_common(1)[0]
    for other, rivals in widths.items():
        if other != width > 1 < other and rivals > max(_FEWEST_ROWS, 0.25 * count):
            raise InputError(
                f"{path}: {count} rows of {width} numbers and {rivals} of {other}, expected rows "
                "of as many cells"
            )
    width = _to_one_width(lines, rows, width, dialect, path)
    sha256 = hashlib.sha256(raw).hexdigest()
    tables = []
    for run, names, comments in _parts(lines, rows, width, dialect):
        array = np.array([rows[index] for index in run], dtype=float)
        columns = np.flatnonzero(~np.isnan(array).all(axis=0)).tolist()
        tables.append(
            TextTable(
                path=path,
                dialect=dialect,
                names=[names[column] for column in columns],
                array=array[:, columns],
                lines=[lines[index] for index in run],
                comments=comments,
                header=lines[run[0]][0],
                sha256=sha256,
                columns=columns,
            )
        )
    return tables


def _check_commas(lines: list[Line], dialect: Dialect, path: str) -> None:
    """Refuse decimal commas between cells that commas separate: the cells are halves of numbers."""
    # its digits, taken for a cell
    split = [line for _, line in lines if "." not in line and re.search(r",0\d+(,|$)", line)]
    if dialect.separator == "," and len(split) > 1:
        raise InputError(
            f"{path}: decimal commas between commas (line '{excerpt(split[0])}'), expected decimal "
            "points or another separator"
        )


def _to_one_width(
    lines: list[Line], rows: list[Array | None], width: int, dialect: Dialect, path: str
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
    odd, count = "", 0
    for index in range(inside[0], inside[-1]):
        if rows[index] is None:
            cells = dialect.cells(lines[index][1]) or []
            numbers = [dialect.number(cell) for cell in cells] if len(cells) == width else [None]
            if numbers[0] is not None and not np.isnan(numbers[0]):
                rows[index] = np.array(numbers, dtype=float)
                odd, count = odd or cells[numbers.index(None)], count + 1
    # where more have no number, the file means something else
    if count > max(_FEWEST_ROWS, 0.1 * len(inside)):
        raise InputError(
            f"{path}: {count} rows of {len(inside) + count} have a cell that is no number, the "
            f"first '{excerpt(odd)}'; expected numbers"
        )
    return width


def _parts(
    lines: list[Line], rows: list[Array | None], width: int, dialect: Dialect
) -> Iterator[tuple[list[int], list[str], list[Line]]]:
    """Give the rows, names and comments of each table: the longest, and what could be one too."""
    fits = [row is not None for row in rows]
    runs = [list(run) for fitting, run in groupby(range(len(rows)), fits.__getitem__) if fitting]
    fewest = min(_FEWEST_ROWS, max(map(len, runs)))
    parts: list[tuple[list[int], list[str], list[Line]]] = []
    end = 0
    for run in runs:
        above = lines[end : run[0]]
        names, used = names_above(above, dialect, width)
        comments = above[: len(above) - used]
        end = run[-1] + 1
        says_nothing = not any(names) and not any(key_and_value(line)[1] for _, line in comments)
        if parts and says_nothing:
            parts[-1][0].extend(run)
        else:
            parts.append((run, names, comments))
    _, first_names, first_comments = parts[0]
    for run, names, comments in parts:
        if len(run) >= fewest:
            # the nearest comments first
            more = [] if comments is first_comments else first_comments
            yield run, names if any(names) else first_names, [*comments, *more]
