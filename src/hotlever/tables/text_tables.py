"""From a file's text to its tables: the header row, its units and remarks, and the rows below.

Here belongs what instruments write above and between the numbers of a table, such as the lines
between the sweeps of a file; what the headings mean is said where the quantities are
(`hotlever.quantities.MEASURANDS`).
"""

from __future__ import annotations

import hashlib
import os
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby, zip_longest

import numpy as np

from hotlever.errors import InputError, counted, excerpt
from hotlever.files import read_bytes
from hotlever.tables.binary import lines_of_binary
from hotlever.tables.table import (
    DIALECTS,
    Dialect,
    Line,
    TextTable,
    filled_lines,
    is_readable,
    with_units,
)
from hotlever.types import Array
from hotlever.units import (
    LONGEST_NUMBER,
    NUMBER,
    differ,
    is_unit,
    key_and_value,
    name_and_unit,
    plain_minus,
)

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
        looked for (`header_row`): lines above it are comments, numbers alone have none, and lines
        without numbers between it and the first row are remarks. Else it is the first line that is
        no comment, and rows may be words alone.
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
            self.names[0] = self.names[0].lstrip(_MARKS)

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
        # LabVIEW's last column, which is for remarks, may be left out
        if len(cells) < width and self.names[-1].lower() == "comment":
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
        return with_units(names, self._units_beside(names))

    def _units_beside(self, names: Sequence[str]) -> list[str]:
        """Return the unit of each column that stands in the cells of the next one, '' for others.

        The next one's heading is ``Unit``, behind any column, or ``Source Unit`` behind
        ``Source Value``.
        """
        units = [""] * len(names)
        cells = [self._cells(*line, self._separator) for line in self.rows]
        # what Keithley writes there, in capitals or not
        of_buffers = {"volt dc": "V", "amp dc": "A", "vdc": "V", "adc": "A"}
        for index, name in enumerate(names[1:], start=1):
            of, _, word = name.casefold().rpartition(" ")
            if word not in ("unit", "units") or not names[index - 1].casefold().startswith(of):
                continue
            written = [row[index] for row in cells]
            first = written[0]
            for (number, _), unit in zip(self.rows, written, strict=True):
                if unit != first:
                    raise InputError(
                        f"{self._path}: line {number}: the unit is '{excerpt(unit)}', expected "
                        f"'{excerpt(first)}' as above"
                    )
            units[index - 1] = of_buffers.get(first.casefold(), first)
        return units

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


# --- what stands above the numbers ---------------------------------------------------------------

#: Marks of a comment, around it, and quotes.
_MARKS = ' \t"#%!'


def is_comment(line: str) -> bool:
    """Whether a line starts with the mark of a comment."""
    text = line.lstrip(' "')
    # a first cell in which a spreadsheet says that there is no value begins no comment
    no_value = (
        r"#(?:(?:N/A|DIV/0!|NUM!|VALUE!|REF!|NULL!|NAME\?)[\"\s]|"
        r"(?:N/A|NV|[A-ZÀ-Ý]{3,}(?:/0)?[!?]|#+)\"?\s*[\t;,|])"
    )
    return text.startswith("#") and not re.match(no_value, text)


def begins_number(cell: str) -> bool:
    """Whether a cell is a number or begins with one, be it one that cannot be read.

    Examples
    --------
    >>> [begins_number(cell) for cell in ("-9", "(9)", "16:20:11", "V_b", "---")]
    [True, True, True, False, False]
    """
    # behind marks, or the letters with which some meters tell their state: (1.5), ~1, CV+4.0E-01
    begin = r"[\W_]*[.,]?\d|[A-Za-z]{1,3}[+-]?\d+[.,]\d"
    return re.match(begin, plain_minus(cell[:LONGEST_NUMBER])) is not None


def is_like_a_number(cell: str) -> bool:
    """Whether a cell is a number, a date or a time and nothing else, or says that there is none.

    Examples
    --------
    >>> [is_like_a_number(cell) for cell in ("~0.4 mA", "OVERFLOW", "2W (ohm)", "V_b")]
    [True, True, False, False]
    """
    if is_readable(cell):
        return True
    alike = (
        r"[\W_]*(?:[A-Za-z]{1,3}(?=[+-]?\d+[.,]))?[+-]?[.,]?\d"
        r"(?:[\d\s.,:/'’+-]|[eEdDT](?=[+-]?\d))*(?P<unit>.*?)[\W_]*"
    )
    match = re.fullmatch(alike, plain_minus(cell[:LONGEST_NUMBER]))
    unit = match["unit"] if match else "?"
    return not unit or unit in set("yzafpnuµμmkMGT") or is_unit(unit)


def separator_in(line: str) -> str | None:
    """Return the first mark that separates cells, of those that no name contains."""
    return next((mark for mark in "\t;," if mark in line), None)


def row_of_numbers(line: str, width: int | None = None) -> tuple[str | None, int] | None:
    """Return separator and number of cells of a row of nothing but numbers; None if it is not.

    Some may say that there is no value.
    """
    for dialect in DIALECTS:
        if dialect.separator is None and "\t" in line.strip():
            continue  # blanks between tabs stand within a cell
        row = dialect.row(line)
        if row is None:
            continue
        blank = width is not None and row.size > width and bool(np.isnan(row[width:]).all())
        count = width if width is not None and blank else row.size
        if count == (width or count) > 1:
            return dialect.separator, count
    return None


def row_mostly_of_numbers(line: str) -> tuple[str | None, int] | None:
    """Return separator and number of cells of a row at least half of which is like numbers.

    Its first cell is no word, which would be what a line says of a column or a setting. None if
    it is no such row.
    """
    for separator in ("\t", ";", ",", "|", None):
        cells = Dialect(separator).cells(line) or []
        filled = [cell for cell in cells if cell]
        if len(filled) < 2 or not (begins_number(filled[0]) or is_readable(filled[0])):
            continue
        alike = sum(map(is_like_a_number, filled))
        if 2 * alike >= len(filled) and any(map(begins_number, filled)):
            return separator, len(cells)
    return None


def is_underline(cells: Sequence[str]) -> bool:
    """Whether a line merely underlines the headings above it."""
    return all(re.fullmatch(r"[\s:=+|-]*", cell) for cell in cells)


def headings_in(line: str) -> list[str]:
    """Split a header row; one without separators between its names, not before a unit.

    Examples
    --------
    >>> headings_in("# V_b (V), I_h (mA)"), headings_in("V_b (V)  I_h / mA")
    (['V_b (V)', 'I_h (mA)'], ['V_b (V)', 'I_h / mA'])
    """
    separator = separator_in(line.strip(_MARKS))
    text = unquoted(line.strip(_MARKS.replace('"', "")))
    if separator is not None and (cells := Dialect(separator).cells(text)) is not None:
        return [cells[0].strip(_MARKS), *cells[1:]]
    names: list[str] = []
    if re.fullmatch(r'\s*"[^"]*"(?:\s+"[^"]*")+\s*', line):
        return [name.strip(' "') for name in re.findall('"[^"]*"', line)]
    for word in line.strip(_MARKS).split():
        if names and (word[0] in "([{</" or names[-1].endswith("/")):
            names[-1] += f" {word}"
        else:
            names.append(word)
    return names or [""]


def header_row(lines: Sequence[Line], is_heading: Callable[[str], bool]) -> int | None:
    """Return the index of the header row among the lines of a file; None for numbers alone.

    It is the first line with two headings, a comment if numbers follow; without such a line, the
    one above the first row of numbers, but for a row of units. A row that is mostly of numbers is
    none, be they such that cannot be read.
    """

    def width(index: int) -> int:
        names = headings_in(lines[index][1])
        short_names = [name for name in names if len(name) <= 100]
        return len(names) if sum(map(is_heading, short_names)) >= 2 else 0

    plain = [index for index, (_, line) in enumerate(lines) if not is_comment(line)]
    named: list[int] = []

    def is_row(order: int) -> bool:
        line = lines[plain[order]][1]
        if row_of_numbers(line):
            return True
        # one such line alone may be a remark
        mostly = row_mostly_of_numbers(line)
        below = [lines[index][1] for index in plain[order + 1 : order + 2]]
        return mostly is not None and all(
            mostly in (row_of_numbers(next_line), row_mostly_of_numbers(next_line))
            for next_line in below
        )

    for order, index in enumerate(plain[:2000]):
        if is_row(order):
            # a comment near to the numbers
            above = range(max(plain[order - 1] + 1 if order else 0, index - 20), index)
            for comment in reversed(above):
                mostly = row_mostly_of_numbers(lines[index][1])
                count = width(comment) or -1
                if row_of_numbers(lines[index][1], count) or (mostly and mostly[1] == count):
                    return comment
            # rows above it with a word in place of a number
            while order and _has_a_number(headings_in(lines[plain[order - 1]][1])):
                order -= 1
            break
        if count := width(index):
            cells = headings_in(lines[plain[order + 1]][1]) if order + 1 < len(plain) else []
            if len(cells) == count and any(map(begins_number, cells)):
                return _of_three(lines, index, named)
            named.append(index)
    else:
        return named[0] if named else _above_the_rows(lines, plain)
    texts = plain[:order]
    if len(texts) > 1 and any(map(is_unit, headings_in(lines[texts[-1]][1]))):
        texts.pop()
    return next(iter(named or texts[-1:]), None)


def _of_three(lines: Sequence[Line], index: int, named: Sequence[int]) -> int:
    """Return the index of the header row, be it the first of three rows above the numbers.

    Origin writes long names, units and comments, of which the last may seem to be headings too.
    """
    if not named or index - named[-1] != 2:
        return index
    names, units, comments = (headings_in(line) for _, line in lines[named[-1] : index + 1])
    has_units = len(names) == len(units) == len(comments) and all(map(is_unit, filter(None, units)))
    return named[-1] if has_units else index


def _has_a_number(cells: Sequence[str]) -> bool:
    """Whether cells have a number that counts no columns, or say that there is no value."""
    filled = [cell for cell in cells if cell and not is_unit(cell)]
    readable = [cell for cell in filled if is_readable(cell) and not cell.isdecimal()]
    return len(cells) > 1 and bool(readable) and not is_underline(cells)


def _above_the_rows(lines: Sequence[Line], plain: Sequence[int]) -> int | None:
    """Return the index of the line above the longest run of as many cells, with a number each.

    None if there is no line above it without a number, or the run begins with the first line of
    all, unless that has words and counts columns.
    """
    rows = [headings_in(lines[index][1]) for index in plain[:2000]]
    widths = [len(row) if len(row) > 1 and any(map(begins_number, row)) else 0 for row in rows]
    ends, longest, start = 0, 0, 0
    for width, run in groupby(widths):
        count = len(list(run))
        if width and count > longest:
            longest, start = count, ends
        ends += count
    above = start - 1
    # a row of another width is no header
    while above >= 0 and any(map(begins_number, rows[above])):
        above -= 1
    if above > 0 and any(map(is_unit, rows[above])):
        above -= 1
    counts = [cell.isdecimal() for cell in rows[0] if begins_number(cell)]
    names_columns = not begins_number(rows[0][0]) and all(counts)
    return plain[above] if above >= 0 else plain[0] if names_columns else None


def unquoted(line: str) -> str:
    """Return a line without quotes that stand around all its cells together.

    Examples
    --------
    >>> unquoted('"DCV[V];Flag"'), unquoted('"DCV[V]";"Flag"')
    ('DCV[V];Flag', '"DCV[V]";"Flag"')
    """
    text = line.strip()
    around = len(text) > 1 and text[0] == text[-1] == '"' and text.count('"') == 2
    return text[1:-1] if around else line


def begins_other_lines(cells: Sequence[str]) -> bool:
    """Whether a line begins what stands between two sweeps of a file, up to the next header row.

    So do first cells of LabVIEW's and of a B1500's files.
    """
    return cells[0].lower() in ("channels", "setuptitle", "labview measurement")


def is_row_of_units(line: str) -> bool:
    """Whether a comment says that it has the units of the columns."""
    first = line[:20].strip(_MARKS).lower()
    return first.startswith(("y_unit_label", "vertical units", "unit"))


def names_above(above: Sequence[Line], dialect: Dialect, width: int) -> tuple[list[str], int]:
    """Return names of columns from the last lines above numbers, and how many lines they took.

    Of two such lines the lower one may hold units: each name is that above, then that below.
    """
    names = [""] * width
    used = 0
    for _, line in reversed(above[-2:]):
        cells = [cell.strip(' "') for cell in line.strip(" ").split(dialect.separator)]
        if dialect.separator is None:
            wide = [cell for cell in re.split(r"\t+|\s{2,}", line.strip()) if cell]
            cells = wide if len(wide) == width else cells
        elif dialect.separator == "\t" and len(cells) != width:
            # WiRE writes two tabs between its headings, and one between the numbers
            wide = [cell.strip(' "') for cell in re.split(r"\t+", line.strip())]
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


# --- tables that do not stand below their header row --------------------------------------------


def below_a_header(lines: list[Line]) -> list[Line]:
    """Return the lines of a file whose table has its header row above its rows.

    Lines of fields become columns, the chunks below each other; what stands beside the rows
    becomes comments above them. Other lines stay as they are. Each keeps the number of a line of
    the file.
    """
    first_line = lines[0][1]
    dialects = (each for each in DIALECTS if each.separator and each.separator in first_line)
    dialect = next(dialects, None)
    if dialect is None or dialect.separator is None:
        return lines
    first = [cell.strip().lower() for cell in dialect.cells(first_line) or []]
    # LabOne's lines of fields: one for each column
    if len(first) > 3 and (first[0], first[3]) == ("chunk", "fieldname"):
        return _columns_of_fields(lines, dialect.separator)
    # a TDS's file, whose settings stand beside the rows
    if len(first) > 4 and first[0] == "record length":
        return _rows_beside_settings(lines, dialect.separator)
    return lines


def _columns_of_fields(lines: list[Line], separator: str) -> list[Line]:
    chunks: dict[str, list[tuple[int, list[str]]]] = {}
    for number, line in lines[1:]:
        cells = [cell.strip() for cell in line.split(separator)]
        if len(cells) > 4:
            chunks.setdefault(cells[0], []).append((number, cells[3:]))
    table: list[Line] = []
    for chunk in chunks.values():
        number = chunk[0][0]
        columns = [cells for _, cells in chunk]
        for row in zip_longest(*columns, fillvalue=""):
            # points that are still to come are none in each field
            if any(cell.lower() not in ("", "nan") for cell in row):
                table.append((number, separator.join(row)))
    return table or lines


def _rows_beside_settings(lines: list[Line], separator: str) -> list[Line]:
    comments: list[Line] = []
    rows: list[Line] = []
    settings: dict[str, str] = {}
    for number, line in lines:
        key, value, *cells = (cell.strip() for cell in line.split(separator))
        if key:
            settings[key.lower()] = value
            comments.append((number, f"# {key}: {value}"))
        rows.append((number, separator.join(cells[1:])))
    time, unit = settings.get("horizontal units", ""), settings.get("vertical units", "")
    names = (
        f"TIME ({time})" if time else "TIME",
        settings.get("source", "CH1") + f" ({unit})" * bool(unit),
    )
    return [*comments, (lines[0][0], separator.join(names)), *rows]
