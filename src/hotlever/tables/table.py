"""Text as instruments write it: from bytes to lines and cells, and a table of these.

A table has named columns, rows of cells, and what is said of them.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from hotlever.errors import InputError, excerpt, quoted, unknown_name
from hotlever.types import Array
from hotlever.units import (
    LARGEST_NUMBER,
    LONGEST_NUMBER,
    NUMBER,
    conversion,
    heading_with,
    is_unit,
    is_unit_of,
    key_and_value,
    name_and_unit,
    plain_minus,
    unknown_unit,
)

#: Lines of a file, unless its reader says otherwise.
MOST_LINES = 200_000
# A line of a file, and its number.
Line = tuple[int, str]

#: Cells that say that there is no value, in small letters and without a sign: of databases and
#: programs; of meters, recorders and oscilloscopes beyond their range; and of open inputs.
_NO_VALUE = {
    *("", "nan", "n/a", "na", "null", "none", "nil", "missing", "invalid"),
    *("inf", "infinity", "infinite", "∞", "overflow", "overflw", "ovrflw", "ovflw", "ovfl", "ovf"),
    *("overload", "ovld", "ovl", "ol", "o.l", "o.l.", "overrange", "over range", "over", "o.r."),
    *("o.f.", "underflow", "underrange", "under range", "under", "burnout", "burn out"),
}
#: Blanks within a number, which separate no cells.
_FIXED_BLANKS = "\u00a0\u2007\u202f"


def decode(raw: bytes, where: str) -> str:
    """Decode UTF-8 (with or without mark), UTF-16, UTF-32 or, failing those, Windows' Latin-1.

    Marks of an encoding are left out wherever files were joined.

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
    marked = head.startswith((b"\xff\xfe", b"\xfe\xff"))
    encoding = "utf-16" if marked else "utf-8"
    if head.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        encoding = "utf-32"
    elif b"\x00" in head and not marked:
        # UTF-16 without its mark: every other byte of western text is zero
        zeros = {"utf-16-le": head[1::2], "utf-16-be": head[0::2]}
        encoding = next((e for e, part in zeros.items() if part.count(0) > 0.8 * len(part)), "")
    try:
        if encoding:
            return raw.decode(encoding).replace("\ufeff", "")
    except UnicodeDecodeError:
        control = sum(byte < 9 or 13 < byte < 32 for byte in head)
        if not marked and control <= 0.02 * len(head):
            return raw.removeprefix(b"\xef\xbb\xbf").decode("cp1252", errors="replace")
    raise InputError(f"{where}: a binary file, not a text file")


def text_lines(raw: bytes, where: str, most: int = MOST_LINES, longest: int = 2**17) -> list[str]:
    """Decode a file's content, and split it into at most as many lines.

    A spectrometer's map has lines of some 40 000 characters.

    Raises
    ------
    InputError
        If it is no text or markup, or has too many lines or too long a line.
    """
    # packed (.xlsx, .ods) or of old (.xls)
    if raw.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):
        raise InputError(
            f"{where}: a workbook such as Excel's, expected .xlsx, .xls or a table in text: save "
            "the sheet as CSV"
        )
    text = decode(raw, where)
    if re.match(r"(?i)\s*<(?:\?xml|!doctype|!--|html|head|body|table|lsx_)\b", text):
        # numbers among its tags are parts of arrays, or settings
        raise InputError(f"{where}: an XML or HTML file, expected a table in text, such as CSV")
    lines = text.splitlines()
    if len(lines) > most:
        raise InputError(f"{where}: {len(lines)} lines, expected at most {most}")
    for number, line in enumerate(lines, start=1):
        if len(line) > longest:
            raise InputError(
                f"{where}: line {number}: {len(line)} characters, expected at most {longest}"
            )
    return lines


def filled_lines(raw: bytes, where: str, most: int = MOST_LINES) -> list[Line]:
    """Return the lines of `text_lines` that hold more than separators, with their numbers.

    DOS ends a file with the mark 0x1a.
    """
    numbered = enumerate(text_lines(raw, where, most), start=1)
    empty = ' \t,;"\u00a0\x1a'
    return [(number, line) for number, line in numbered if line.strip(empty).strip()]


def number(cell: str, decimal_comma: bool = False) -> float | None:
    """Return a cell's number: NaN where it says that there is none, None if it is something else.

    Examples
    --------
    >>> number("−1.5e3"), number("1,5", decimal_comma=True), number("OVERFLOW"), number("1_000")
    (-1500.0, 1.5, nan, None)
    """
    cell = plain_minus(cell[: LONGEST_NUMBER + 1])
    if len(cell) > LONGEST_NUMBER:
        return None
    if NUMBER.fullmatch(cell):
        value = float(cell.replace(",", ".").lower().replace("d", "e"))
        # SCPI instruments write so for "not a number" and for infinity, and a B1500 for no value
        if abs(value) in (9.91e37, 9.9e37, 1.99999e101):
            return math.nan
        if ("." if decimal_comma else ",") in cell:
            return None
        return value if abs(value) <= LARGEST_NUMBER else None
    word = cell.lstrip("+-").casefold()
    return math.nan if _says_no_value(word) else None


def _says_no_value(word: str) -> bool:
    """Whether a cell, in small letters and without a sign, says that there is no value."""
    # marks in place of digits, the names of C's libraries for numbers that are none, and errors of
    # spreadsheets in any language
    marks = r"\*{2,}|#{2,}|nan\(\w*\)|1\.#[a-z]+\d*|#(?:n/a|nv|ref|[^\W\d]+(?:/0)?[!?])"
    return word in _NO_VALUE or re.fullmatch(marks, word) is not None


def is_readable(cell: str) -> bool:
    """Whether a cell is a number, with either decimal sign, or says that there is none."""
    return number(cell) is not None or number(cell, decimal_comma=True) is not None


@dataclass(frozen=True)
class Dialect:
    """How lines are cells and cells numbers."""

    separator: str | None  #: None is any run of blanks
    decimal_comma: bool = False
    grouped: bool = False  #: whether the other sign may stand between thousands

    @classmethod
    def of(cls, lines: Sequence[Line]) -> Dialect:
        """Return what makes the most of a sample of lines rows of numbers; two columns beat one."""
        tail = lines[len(lines) // 4 :] if len(lines) > 8 else lines
        sample = [line for _, line in tail[:: max(len(tail) // 40, 1)]]

        def fit(dialect: Dialect) -> tuple[int, int]:
            rows = [row for line in sample if (row := dialect.row(line)) is not None]
            return sum(int(np.count_nonzero(~np.isnan(row)) >= 2) for row in rows), len(rows)

        best = max(DIALECTS, key=fit)
        grouped = [replace(dialect, grouped=True) for dialect in DIALECTS]
        # 1,234 is a number with a decimal comma before it is one in the thousands
        return replace(best, grouped=True) if fit(best)[0] else max(grouped, key=fit)

    def cells(self, line: str) -> list[str] | None:
        """Return a line's cells, None if quotes do not end."""
        line = line.strip(" ")
        if self.separator is None:
            # an exponent belongs to the number before it
            line = re.sub(r"(?<=\d) +(?=E[-+]\d)", "", line) if "E" in line else line
            blanks = rf"[^\S{_FIXED_BLANKS}]+"
            return [cell.strip('"') for cell in re.split(blanks, line.strip())]
        if '"' not in line:
            return [cell.strip() for cell in line.split(self.separator)]
        quotes = csv.reader([line], delimiter=self.separator, skipinitialspace=True, strict=True)
        try:
            return [cell.strip() for cell in next(quotes)]
        except csv.Error:
            return None

    def number(self, cell: str) -> float | None:
        """Return a cell's number as `number` does, or with marks of thousands.

        These must be grouped, or nothing else: ``1.041,5`` with a decimal comma, and ``1’041``.

        Examples
        --------
        >>> german = Dialect(";", decimal_comma=True)
        >>> german.number("1.041,5"), german.number("1\u202f041,5"), german.number("1.041")
        (1041.5, 1041.5, None)
        """
        value = number(cell, self.decimal_comma)
        if value is not None:
            return value
        cell = plain_minus(cell)
        sign, other = (",", ".") if self.decimal_comma else (".", ",")
        # before a decimal sign the other sign is a mark of thousands, and the others always are
        marks = rf"((['’{_FIXED_BLANKS}]\d{{3}})+([{sign}]\d*)?|([{other}]\d{{3}})+[{sign}]\d*)"
        if self.grouped:
            marks = rf"([{other}'’\s]\d{{3}})+([{sign}]\d*)?"
        if not re.fullmatch(rf"[+-]?[1-9]\d{{0,2}}{marks}", cell[:LONGEST_NUMBER]):
            return None
        return number(re.sub(rf"[^\d{sign}+-]", "", cell), self.decimal_comma)

    def row(self, line: str) -> Array | None:
        """Return the numbers of a line, NaN for blank cells, None if it holds anything else."""
        # nearly every line has nothing but numbers, and maps have millions
        if not line.strip("-+.0123456789eE \t;,|") and not (self.decimal_comma and "." in line):
            cells = (line.replace(",", ".") if self.decimal_comma else line).split(self.separator)
            for read in (float, _number_or_blank):
                with suppress(ValueError):
                    row = np.array(list(map(read, cells)))
                    # fmax leaves NaN out; what is larger may say that there is no value
                    if np.fmax.reduce(np.abs(row)) <= LARGEST_NUMBER:
                        return row
                    break
        values: list[float] = []
        for cell in self.cells(line) or []:
            value = self.number(cell)
            if value is None:
                return None
            values.append(value)
        row = np.array(values)
        return None if np.isnan(row).all() else row


def _number_or_blank(cell: str) -> float:
    return float(cell) if cell.strip() else math.nan


#: In the order in which they are tried.
DIALECTS = [
    Dialect(separator, decimal_comma)
    for separator in ("\t", ";", ",", "|", None)
    for decimal_comma in (False, True)
    if (separator, decimal_comma) != (",", True)
]


@dataclass(frozen=True)
class TextTable:
    """Rows of as many cells, and what the file says of them.

    Attributes
    ----------
    path : str
    dialect : Dialect
    names : list of str
        Of the columns, with units that stand in a row of their own; empty where there is none.
    array : ndarray, shape (rows, columns)
        All cells as numbers, NaN where one is blank or something else.
    lines : list of tuple
        The rows as they stand in the file, with the numbers of their lines.
    comments, remarks : list of tuple
        Other lines with their numbers: comments and what stands above the header row, nearest
        tables first; and rows without numbers between header and data.
    header : int
        Number of the line of the header row, of the first row if there is none.
    columns : sequence of int
        Which cells of a row are columns: those that are not blank all the way, or all.
    sha256 : str
        Of the bytes that were read.
    """

    path: str
    dialect: Dialect
    names: list[str]
    array: Array
    lines: list[Line]
    comments: list[Line]
    header: int
    sha256: str
    columns: list[int]
    remarks: list[Line] = field(default_factory=list)

    @cached_property
    def rows(self) -> list[list[str]]:
        """The cells as text."""
        lines = (self.dialect.cells(line) or [] for _, line in self.lines)
        return [
            [cells[column] if column < len(cells) else "" for column in self.columns]
            for cells in lines
        ]

    @property
    def is_named(self) -> bool:
        """Whether it has a header row."""
        return any(self.names)

    @property
    def settings(self) -> dict[str, str]:
        """What its comments say in the form ``key = value``; of two, the first counts."""
        pairs = [key_and_value(line) for _, line in self.comments]
        return {key: value for key, value in reversed(pairs) if value}

    @property
    def without(self) -> str:
        """What of a binary file is no column, and why, to end an error with."""
        mark = "# left out, "
        parts = [line.removeprefix(mark) for _, line in self.comments if line.startswith(mark)]
        return f"; left out: {excerpt('; '.join(parts), 160)}" if parts else ""

    def where(self, row: int) -> str:
        """Name file and line of a row (-1: the header row), to begin an error with."""
        return f"{self.path}: line {self.header if row < 0 else self.lines[row][0]}"

    def index(self, heading: str) -> int:
        """Return the index of a column by its heading, with or without unit, or by its number.

        Raises
        ------
        InputError
            If there is no such column, or several have this heading.
        """
        width = f"its number (1 to {len(self.names)})"
        for names in (self.names, [name_and_unit(name)[0] for name in self.names]):
            indices = [i for i, name in enumerate(names) if name.casefold() == heading.casefold()]
            if len(indices) > 1:
                raise InputError(
                    f"{self.where(-1)}: column {quoted(heading)} stands {len(indices)} times, "
                    f"expected {width}"
                )
            if indices:
                return indices[0]
        if not heading.isdecimal() and self.is_named:
            names = [excerpt(name) for name in self.names[:9]]
            unknown = unknown_name("column", heading, names, self.where(-1))
            raise InputError(f"{unknown}{self.without}")
        if heading.isdecimal() and len(heading) < 5 and 1 <= int(heading) <= len(self.names):
            return int(heading) - 1
        hint = " or heading" if self.is_named else ""
        raise InputError(f"{self.where(-1)}: no column {quoted(heading)}, expected {width}{hint}")

    def numbers(self, column: int, name: str) -> Array:
        """Return a column's numbers as they stand there, NaN where there is none.

        Raises
        ------
        InputError
            If a cell is something else, or may be of thousands; it names the quantity as `name`.
        """
        values = self.array[:, column]
        for row in np.flatnonzero(np.isnan(values)).tolist():
            cell = self.rows[row][column]
            if self.dialect.number(cell) is None:
                hint = " with a decimal comma, as elsewhere in the file"
                raise InputError(
                    f"{self.where(row)}: {name}: found '{excerpt(cell)}', expected a number"
                    f"{hint * self.dialect.decimal_comma}"
                )
        if self.dialect.decimal_comma:
            cells = [plain_minus(row[column]) for row in self.rows]
            commas = [row for row, cell in enumerate(cells) if "," in cell]
            # numbers of three decimals all the way have no whole ones beside them
            if (
                commas
                and all(_is_grouped(cells[row]) for row in commas)
                and (
                    any(re.fullmatch(r"[+-]?[1-9]\d{0,2}", cell) for cell in cells)
                    or self._may_have_thousands
                )
            ):
                cell = cells[commas[0]]
                raise InputError(
                    f"{self.where(commas[0])}: {name}: '{cell}' may be {cell.replace(',', '.')} "
                    f"or {cell.replace(',', '')}, expected numbers without marks of thousands"
                )
        return values

    @cached_property
    def _may_have_thousands(self) -> bool:
        """Whether commas may be marks of thousands, since there are whole numbers and no others."""
        cells = [plain_minus(cell) for row in self.rows for cell in row]
        commas = [cell for cell in cells if "," in cell and self.dialect.number(cell) is not None]
        whole = any(re.fullmatch(r"[+-]?\d+", cell) for cell in cells)
        return all(map(_is_grouped, commas)) and whole

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
        heading = self.names[column]
        unit = name_and_unit(heading)[1] or unit
        converted = conversion(unit, inside)
        if converted is None:
            raise unknown_unit(unit, inside, f"{self.where(-1)}: {excerpt(heading)}")
        return converted[0] * self.numbers(column, name) + converted[1]


def _is_grouped(cell: str) -> bool:
    """Whether a cell is a number with a mark of thousands, or with three decimals."""
    return re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}", cell) is not None


def with_units(names: Sequence[str], units: Sequence[str]) -> list[str]:
    """Return headings with units that stand in a row of their own.

    Examples
    --------
    >>> with_units(["V_b", "I_h (mA)", "note"], ["V", "mA"])
    ['V_b (V)', 'I_h (mA)', 'note']
    """
    times = "X_Value"  # LabVIEW's, which may stand before each channel
    if list(names).count(times) > 1 and any(map(is_unit, units[2:3])):
        # units of the channels alone, where each has times of its own
        of_channels = iter(units[1:])
        units = ["" if name == times else next(of_channels, "") for name in names]
    units = [*units, *[""] * (len(names) - len(units))]
    return [
        heading_with(name, unit) if is_unit_of(name, unit) else name
        for name, unit in zip(names, units, strict=False)
    ]
