"""Tables in text files, whoever wrote them.

Encoding, separator, decimal sign and header row are found, not asked for; what the columns and
the lines above them mean is for the caller to know.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hotlever.cells import DIALECTS, Dialect, text_lines
from hotlever.errors import InputError, quoted, shown, unknown_name
from hotlever.files import read_bytes
from hotlever.types import Array
from hotlever.units import (
    LONGEST_NUMBER,
    NUMBER,
    conversion,
    is_unit,
    name_and_unit,
    unknown_unit,
)

#: Lines among which a header row is looked for, how near to the numbers a comment is one, and
#: characters of a heading.
_MOST_ABOVE, _NEAR, _LONGEST_HEADING = 2000, 20, 100

#: A number with a mark of thousands, or with three decimals; and a small whole number.
_GROUPED, _SMALL = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}"), re.compile(r"[+-]?[1-9]\d{0,2}")
#: First cells of what stands between the sweeps of LabVIEW and of B1500 files, up to the next
#: header row; and of a row with the units of the columns.
_BETWEEN = {"channels", "setuptitle", "labview measurement"}
_UNIT_ROWS = {"y_unit_label", "unit", "units"}
#: Marks of a comment, around it, and quotes.
_MARKS = ' \t"#%!'


@dataclass(frozen=True)
class Table:
    """A table whose first row names its columns; cells are text, as in the file."""

    path: str
    sha256: str  #: of the very bytes that were read
    #: Lines that start with ``#``, and those above the header row, with their numbers.
    comments: list[tuple[int, str]]
    #: The header row, with units that stand in a row of their own; empty if there is none.
    names: list[str]
    rows: list[list[str]]  #: each as long as `names`
    lines: list[int]  #: numbers of the header row (or the first) and of each row
    dialect: Dialect
    #: Rows without numbers between header and data, with their numbers.
    remarks: list[tuple[int, str]] = field(default_factory=list)

    def where(self, row: int) -> str:
        """Name file and line of a row (-1: the header row), to begin an error with."""
        return f"{self.path}: line {self.lines[row - len(self.rows)]}"

    def index(self, heading: str) -> int:
        """Return the index of a column by its heading, with or without unit, or by its number.

        Raises
        ------
        InputError
            If there is no such column, or several have this heading.
        """
        width = f"its number (1 to {len(self.rows[0])})"
        for names in (self.names, [name_and_unit(name)[0] for name in self.names]):
            indices = [i for i, name in enumerate(names) if name.casefold() == heading.casefold()]
            if len(indices) > 1:
                raise InputError(
                    f"{self.where(-1)}: column {quoted(heading)} stands {len(indices)} times, "
                    f"expected {width}"
                )
            if indices:
                return indices[0]
        if not heading.isdecimal() and self.names:
            names = [shown(name) for name in self.names[:9]]
            raise unknown_name("column", heading, names, self.where(-1))
        if heading.isdecimal() and len(heading) < 5 and 1 <= int(heading) <= len(self.rows[0]):
            return int(heading) - 1
        hint = " or heading" if self.names else ""
        raise InputError(f"{self.where(-1)}: no column {quoted(heading)}, expected {width}{hint}")

    def numbers(self, column: int, name: str) -> Array:
        """Return a column's numbers as they stand there, NaN where there is none.

        Raises
        ------
        InputError
            If a cell is something else, or may be of thousands; it names the quantity as `name`.
        """
        cells = [row[column] for row in self.rows]
        values = [self.dialect.number(cell) for cell in cells]
        if None in values:
            row = values.index(None)
            hint = " with a decimal comma, as elsewhere in the file" * self.dialect.decimal_comma
            raise InputError(
                f"{self.where(row)}: {name}: found '{shown(cells[row])}', expected a number{hint}"
            )
        if self.dialect.decimal_comma:
            commas = [row for row, cell in enumerate(cells) if "," in cell]
            if (
                commas
                and all(_GROUPED.fullmatch(cells[row]) for row in commas)
                and any(map(_SMALL.fullmatch, cells))
            ):
                cell = cells[commas[0]]
                raise InputError(
                    f"{self.where(commas[0])}: {name}: '{cell}' may be {cell.replace(',', '.')} "
                    f"or {cell.replace(',', '')}, expected numbers without marks of thousands"
                )
        return np.array(values, dtype=float)

    def values(self, column: int, inside: str, name: str, unit: str = "") -> Array:
        """Return a column's numbers in the unit `inside`, NaN where there is none.

        Parameters
        ----------
        column : int
        inside, name : str
            The unit wanted, and the quantity's name for errors.
        unit : str
            Of the column where its heading gives none.

        Raises
        ------
        InputError
            If a cell is something else, or the unit is not known.
        """
        heading = self.names[column] if self.names else ""
        unit = name_and_unit(heading)[1] or unit
        converted = conversion(unit, inside)
        if converted is None:
            raise unknown_unit(unit, inside, f"{self.where(-1)}: {shown(heading)}")
        return converted[0] * self.numbers(column, name) + converted[1]


def read_table(
    path: str | os.PathLike[str],
    expected: str,
    header: bool = True,
    is_heading: Callable[[str], bool] | None = None,
) -> Table:
    """Read a table of cells separated by tabs, semicolons, commas or, some, by blanks.

    Numbers may have decimal commas unless these separate the cells. Lines that start with ``#``
    are comments.

    Parameters
    ----------
    path : path
    expected : str
        What the file should hold, for the error if it holds nothing.
    header : bool
        Whether there must be a header row. Else a first row with a number is none, and blanks
        may separate cells.
    is_heading : callable, optional
        Whether a heading is one of those looked for. The header row is then the first with two of
        them, a comment if numbers follow; without such a row, the one above the first row of
        numbers. Lines above it are comments; units may stand in a row below it, and the header
        row may be repeated. Numbers alone have no header row.

    Raises
    ------
    InputError
        If there is no such table; the text names file and line.
    """
    raw = read_bytes(path)
    numbered = enumerate(text_lines(raw, str(path)), start=1)
    lines = [(number, line) for number, line in numbered if line.strip(' \t,;"\u00a0')]
    first = next((i for i, (_, line) in enumerate(lines) if not _is_comment(line)), None)
    if first is None:
        raise InputError(f"{path}: no header row and no rows, expected {expected}")
    header_row = first if is_heading is None else _header_row(lines, is_heading)
    start = first if header_row is None else header_row
    named, loose = header_row is not None, is_heading is not None
    reader = _Reader(str(path), lines[start:], named, header, loose)
    comments = lines[:start]
    for number, line in lines[start + named :]:
        if _is_comment(line) or not reader.takes(number, line):
            comments.append((number, line))
    names, rows, numbers = reader.names, reader.rows, [lines[start][0], *reader.lines]
    if not header and (not rows or any(map(NUMBER.fullmatch, names))):
        names, rows, numbers = [], [names, *rows], [numbers[0], *numbers]
    if reader.skipping or not rows:
        where = f"line {reader.skipping}: another table" if reader.skipping else "no data rows"
        raise InputError(f"{path}: {where} after the header")
    if loose:
        names = reader.with_units(comments) if named else []
    with_comma = Dialect(reader.separator, decimal_comma=True)
    comma = any("," in cell and with_comma.number(cell) is not None for row in rows for cell in row)
    return Table(
        path=str(path),
        sha256=hashlib.sha256(raw).hexdigest(),
        comments=comments,
        names=names,
        rows=rows,
        lines=numbers,
        dialect=Dialect(reader.separator, comma),
        remarks=reader.remarks,
    )


class _Reader:
    """The rows below a header row, or of numbers alone.

    `lines` begin with the header row, or the first row if there is none.
    """

    def __init__(
        self, path: str, lines: list[tuple[int, str]], named: bool, header: bool, loose: bool
    ) -> None:
        self._path, self._loose = path, loose
        self._first = "header" if header else "first row"
        self.rows: list[list[str]] = []
        self.lines: list[int] = []
        self.remarks: list[tuple[int, str]] = []
        self.skipping = 0  # the line since which the next header row is waited for
        self._units: list[str] = []
        number, line = lines[0]
        separator = next((mark for mark in "\t;," if mark in line), None)
        if not named or _is_comment(line):
            # the heading may be separated in another way than the rows
            row = next(text for _, text in lines if not _is_comment(text))
            self.names = _headings(line) if named else []
            separator, width = _row_of_numbers(row, len(self.names) or None) or (separator, 0)
            self.names = self.names or [""] * width
        elif separator is None and loose:
            self.names = _headings(line)
            separator = None if len(self.names) > 1 else ","
        else:
            separator = separator or ("," if header else None)
            self.names = self._cells(number, line, separator)
        self.separator = separator
        while named and len(self.names) > 1 and not self.names[-1]:
            self.names.pop()
        if named and loose:
            self.names[0] = self.names[0].lstrip(_MARKS)

    def _cells(self, number: int, line: str, separator: str | None) -> list[str]:
        cells = Dialect(separator).cells(line)
        if cells is None:
            raise InputError(
                f"{self._path}: line {number}: found '{shown(line)}', expected quotes in pairs "
                "around a cell"
            )
        return cells

    def takes(self, number: int, line: str) -> bool:
        """Take a line as a row if it is one; return whether it has been used."""
        if self.skipping and self.separator is not None and self.names[-1] not in line:
            return False
        cells = self._cells(number, line, self.separator)
        width = len(self.names)
        while len(cells) > width and not cells[-1]:
            cells.pop()
        if self._loose:
            if cells == self.names:
                self.skipping = 0  # a further sweep
                return True
            if self.skipping or cells[0].lower() in _BETWEEN:
                self.skipping = self.skipping or number
                return False
            if len(cells) < width and self.names[-1].lower() == "comment":
                cells += [""] * (width - len(cells))  # LabVIEW's column for remarks
            if not self.rows and len(cells) <= width and not any(map(_begins_number, cells)):
                self._remark(number, line, cells)
                return True
        if len(cells) != width:
            halves = self.separator == "," and len(cells) == 2 * width
            hint = "; with decimal commas, tabs or semicolons must separate the cells" * halves
            raise InputError(
                f"{self._path}: line {number}: {len(cells)} cells, expected {width} as in the "
                f"{self._first}{hint}"
            )
        self.lines.append(number)
        self.rows.append(cells)
        return True

    def _remark(self, number: int, line: str, cells: list[str]) -> None:
        units = [cell.strip("()[]{}<> ") for cell in cells]
        if not self._units and any(map(is_unit, units)):
            self._units = units
        else:
            self.remarks.append((number, line))

    def with_units(self, comments: list[tuple[int, str]]) -> list[str]:
        """Return the headings with the units that stand in a row of their own."""
        rows = [self._units]
        for number, line in comments:
            if line[:20].strip(_MARKS).lower().startswith(tuple(_UNIT_ROWS)):
                rows.append(self._cells(number, line, self.separator))
        units = next((row for row in rows if any(map(is_unit, row))), [])
        units += [""] * (len(self.names) - len(units))
        return [
            f"{name} ({unit})" if is_unit(unit) and name_and_unit(name)[1] is None else name
            for name, unit in zip(self.names, units, strict=False)
        ]


def _is_comment(line: str) -> bool:
    return line.lstrip(' "').startswith("#")


def _begins_number(cell: str) -> bool:
    return (cell[:1] in set("0123456789+-.,") and len(cell) > 1) or cell.isdigit()


def _row_of_numbers(line: str, width: int | None = None) -> tuple[str | None, int] | None:
    """Return separator and number of cells of a row of nothing but numbers; None if it is not."""
    if not NUMBER.match(line.lstrip('" \t;,')[:LONGEST_NUMBER]):
        return None
    for dialect in DIALECTS:
        row = dialect.row(line)
        if row is None:
            continue
        blank = width is not None and row.size > width and bool(np.isnan(row[width:]).all())
        count = width if width is not None and blank else row.size
        if count == (width or count) > 1:
            return dialect.separator, count
    return None


def _headings(line: str) -> list[str]:
    """Split a header row; one without separators between its names, not before a unit."""
    line = line.strip(_MARKS)
    separator = next((mark for mark in "\t;," if mark in line), None)
    if separator is not None and (cells := Dialect(separator).cells(line)) is not None:
        return cells
    names: list[str] = []
    for word in line.split():
        if names and (word[0] in "([{</" or names[-1].endswith("/")):
            names[-1] += f" {word}"
        else:
            names.append(word)
    return names or [""]


def _header_row(lines: list[tuple[int, str]], is_heading: Callable[[str], bool]) -> int | None:
    """Return the index of the header row, None if there are numbers only (see `read_table`)."""

    def width(index: int) -> int:
        names = _headings(lines[index][1])
        asked = [name for name in names if len(name) <= _LONGEST_HEADING]
        return len(names) if sum(map(is_heading, asked)) >= 2 else 0

    plain = [index for index, (_, line) in enumerate(lines) if not _is_comment(line)]
    named: list[int] = []
    for order, index in enumerate(plain[:_MOST_ABOVE]):
        if _row_of_numbers(lines[index][1]):
            above = range(max(plain[order - 1] + 1 if order else 0, index - _NEAR), index)
            for comment in reversed(above):
                if _row_of_numbers(lines[index][1], width(comment) or -1):
                    return comment
            break
        if count := width(index):
            cells = _headings(lines[plain[order + 1]][1]) if order + 1 < len(plain) else []
            if len(cells) == count and any(map(_begins_number, cells)):
                return index
            named.append(index)
    else:
        return (named or plain)[0]
    texts = plain[:order]
    if len(texts) > 1 and any(map(is_unit, _headings(lines[texts[-1]][1]))):
        texts.pop()
    return next(iter(named or texts[-1:]), None)
