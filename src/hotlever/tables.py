"""Tables in text files, whoever wrote them: from bytes to lines, cells, numbers and units.

Encoding, separator and decimal sign are found, not asked for; what the columns and the lines above
them mean is for the caller to know.
"""

from __future__ import annotations

import csv
import hashlib
import math
import os
import re
import unicodedata
from dataclasses import dataclass

import numpy as np

from hotlever.errors import InputError
from hotlever.files import read_bytes
from hotlever.types import Array

MOST_LINES = 100_000  #: of a file, unless its reader says otherwise
LARGEST_NUMBER = 1e30  #: no quantity is larger in any unit
LONGEST_LINE = 2**17  #: characters; a spectrometer's map has some 40 000

_MISSING = {"", "nan", "-", "--", "n/a", "na"}
_NUMBER = re.compile(r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_LONGEST_NUMBER = 60  # characters

_EXPONENTS = {"": 0, "p": -12, "n": -9, "u": -6, "μ": -6, "m": -3, "k": 3, "K": 3, "M": 6, "G": 9}
_SPELLINGS = {"V": "V", "A": "A", "ohm": "ohm", "Ohm": "ohm", "OHM": "ohm", "Ω": "ohm", "K": "K"}
_UNITS = {
    prefix + spelling: (unit, exponent)
    for prefix, exponent in _EXPONENTS.items()
    for spelling, unit in _SPELLINGS.items()
}
_CELSIUS = {"°C", "degC", "C", "oC", "celsius", "Celsius"}
ZERO_CELSIUS_K = 273.15


# --- text ----------------------------------------------------------------------------------


def shown(text: str, limit: int = 40) -> str:
    """Shorten a text, and leave out what does not print, to quote it in an error."""
    text = "".join(mark if mark.isprintable() else " " for mark in text[: 2 * limit].strip())
    return text if len(text) <= limit else text[: limit - 1] + "…"


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
    marked = head.startswith((b"\xff\xfe", b"\xfe\xff"))
    encoding = "utf-16" if marked else "utf-8-sig"
    if b"\x00" in head and not marked:
        # UTF-16 without its mark: every other byte of western text is zero
        zeros = {"utf-16-le": head[1::2], "utf-16-be": head[0::2]}
        encoding = next((e for e, part in zeros.items() if part.count(0) > 0.8 * len(part)), "")
    try:
        if encoding:
            return raw.decode(encoding)
    except UnicodeDecodeError:
        control = sum(byte < 9 or 13 < byte < 32 for byte in head)
        if not marked and control <= 0.02 * len(head):
            return raw.removeprefix(b"\xef\xbb\xbf").decode("cp1252", errors="replace")
    raise InputError(f"{where}: a binary file, not a text file")


def text_lines(raw: bytes, where: str, most: int = MOST_LINES) -> list[str]:
    """Decode a file's content, and split it into at most as many lines.

    Raises
    ------
    InputError
        If it is no text, or has too many lines or too long a line.
    """
    lines = decode(raw, where).splitlines()
    if len(lines) > most:
        raise InputError(f"{where}: {len(lines)} lines, expected at most {most}")
    for number, line in enumerate(lines, start=1):
        if len(line) > LONGEST_LINE:
            raise InputError(
                f"{where}: line {number}: {len(line)} characters, expected at most {LONGEST_LINE}"
            )
    return lines


def cells_of(line: str, separator: str | None) -> list[str]:
    """Cells of a line (between any blanks without a separator); csv.Error if quotes do not end."""
    if separator is None:
        return [cell.strip('"') for cell in line.split()]
    if '"' in line:
        quoted = csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True)
        return [cell.strip() for cell in next(quoted)]
    return [cell.strip() for cell in line.split(separator)]


def number(cell: str, decimal_comma: bool = False) -> float | None:
    """Return a cell's number: NaN where it says that there is none, None if it is something else.

    Examples
    --------
    >>> number("1.5e3"), number("1,5", decimal_comma=True), number("--"), number("1_000")
    (1500.0, 1.5, nan, None)
    """
    if len(cell) <= _LONGEST_NUMBER and _NUMBER.fullmatch(cell):
        sign, other = (",", ".") if decimal_comma else (".", ",")
        if other in cell:
            return None
        value = float(cell.replace(sign, ".").lower().replace("d", "e"))
        return value if abs(value) <= LARGEST_NUMBER else None
    return math.nan if cell.lower() in _MISSING else None


# --- names, settings and units -------------------------------------------------------------


def name_and_unit(heading: str) -> tuple[str, str | None]:
    """Split a heading such as ``V_b (V)`` or ``I_h [mA]``; None where it gives no unit.

    Examples
    --------
    >>> name_and_unit("V_b (V)"), name_and_unit("file")
    (('V_b', 'V'), ('file', None))
    """
    bracket = re.search(r"[(\[]", heading)
    if bracket is None or heading[-1:] not in (")", "]"):
        return heading.strip(), None
    return heading[: bracket.start()].strip(), heading[bracket.end() : -1].strip()


def key_and_value(line: str) -> tuple[str, str]:
    """Split a line such as ``# medium: air``; the value is empty where there is none.

    Examples
    --------
    >>> key_and_value("# R_s (kOhm) = 5.6"), key_and_value("#Laser (nm)=\\t532;")
    (('R_s (kOhm)', '5.6'), ('Laser (nm)', '532'))
    """
    key, *value = re.split(r"[=:;\t]", line.strip().lstrip('#;%!*" '), maxsplit=1)
    return key.strip(' "'), value[0].strip(' =:;,\t"') if value else ""


def quantity(text: str) -> tuple[float | None, str]:
    """Split ``5.6 kOhm`` into number and what follows; None if no number begins the text.

    Examples
    --------
    >>> quantity("5,6e3 Ohm"), quantity("20°C"), quantity("many")
    ((5600.0, ' Ohm'), (20.0, '°C'), (None, 'many'))
    """
    found = _NUMBER.match(text[:_LONGEST_NUMBER])
    if found is None:
        return None, text
    return number(found[0].replace(",", ".")), text[found.end() :]


def conversion(unit: str, inside: str, difference: bool = False) -> tuple[float, float] | None:
    """Return factor and offset that turn a value in one unit into another's; None if they differ.

    Units are V, A, ohm or K with an SI prefix, or degrees Celsius. Differences of temperatures
    have the same zero on any scale.

    Examples
    --------
    >>> conversion("µA", "mA"), conversion("°C", "K"), conversion("degC", "K", difference=True)
    ((0.001, 0.0), (1.0, 273.15), (1.0, 0.0))
    """
    # one spelling for the two signs of micro, of ohm, and for the compact degree
    known = unicodedata.normalize("NFKC", unit[:20]).replace(" ", "") if len(unit) < 20 else ""
    wanted, ours = _UNITS[inside]
    if known in _CELSIUS and wanted == "K":
        return 10.0**-ours, 0.0 if difference else ZERO_CELSIUS_K * 10.0**-ours
    measured, theirs = _UNITS.get(known, ("", 0))
    return (10.0 ** (theirs - ours), 0.0) if measured == wanted else None


def unknown_unit(unit: str, inside: str, where: str) -> InputError:
    """Return the error for a unit that `conversion` does not know."""
    return InputError(
        f"{where}: unit '{shown(unit)}' is not understood here, expected one like {inside}"
    )


# --- a table with a header row -------------------------------------------------------------


@dataclass(frozen=True)
class Table:
    """A table whose first row names its columns; cells are text, as in the file."""

    path: str
    sha256: str  #: of the very bytes that were read
    comments: list[tuple[int, str]]  #: the lines that start with ``#``, with their numbers
    names: list[str]  #: the header row; empty if the table was read without one
    rows: list[list[str]]  #: each as long as `names`
    lines: list[int]  #: numbers of the header row, if there is one, and of each row
    separator: str | None  #: None is any run of blanks
    decimal_comma: bool

    def where(self, row: int) -> str:
        """Name file and line of a row (-1: the header row), to begin an error with."""
        return f"{self.path}: line {self.lines[row - len(self.rows)]}"

    def values(
        self, column: int, inside: str, name: str, unit: str = "", difference: bool = False
    ) -> Array:
        """Return a column's numbers, NaN where there is none.

        Parameters
        ----------
        column : int
        inside, name : str
            The unit wanted, and the quantity's name for errors.
        unit : str
            Of the column where its heading gives none.
        difference : bool
            See `conversion`.

        Raises
        ------
        InputError
            If a cell is something else, or the unit is not known.
        """
        heading = self.names[column] if self.names else ""
        unit = name_and_unit(heading)[1] or unit
        converted = conversion(unit, inside, difference)
        if converted is None:
            raise unknown_unit(unit, inside, f"{self.where(-1)}: {shown(heading)}")
        values = [number(cells[column], self.decimal_comma) for cells in self.rows]
        if None in values:
            row = values.index(None)
            hint = " with a decimal comma, as elsewhere in the file" * self.decimal_comma
            raise InputError(
                f"{self.where(row)}: {name}: found '{shown(self.rows[row][column])}', expected a "
                f"number{hint}"
            )
        return converted[0] * np.array(values, dtype=float) + converted[1]


def read_table(path: str | os.PathLike[str], expected: str, header: bool = True) -> Table:
    """Read a table of cells separated by tabs, semicolons or commas.

    With tabs and semicolons numbers may have decimal commas. Lines that start with ``#`` are
    comments.

    Parameters
    ----------
    path : path
    expected : str
        What the file should hold, for the error if it holds nothing.
    header : bool
        Whether there must be a header row. Else a first row with a number is none, and blanks
        may separate cells.

    Raises
    ------
    InputError
        If there is no such table; the text names file and line.
    """
    raw = read_bytes(path)
    comments: list[tuple[int, str]] = []
    lines: list[int] = []
    rows: list[list[str]] = []
    separator = None
    for place, line in enumerate(text_lines(raw, str(path)), start=1):
        if line.lstrip(' "').startswith("#"):
            comments.append((place, line))
            continue
        if not line.strip(' \t,;"'):
            continue
        if not rows:
            separator = next((mark for mark in "\t;," if mark in line), "," if header else None)
        try:
            cells = cells_of(line, separator)
        except csv.Error:
            raise InputError(
                f"{path}: line {place}: found '{shown(line)}', expected quotes in pairs around a "
                "cell"
            ) from None
        while len(cells) > (len(rows[0]) if rows else 0) and not cells[-1]:
            cells.pop()
        if rows and len(cells) != len(rows[0]):
            raise InputError(
                f"{path}: line {place}: {len(cells)} cells, expected {len(rows[0])} as in the "
                f"{'header' if header else 'first row'}"
            )
        lines.append(place)
        rows.append(cells)
    if not rows:
        raise InputError(f"{path}: no header row and no rows, expected {expected}")
    bare = not header and (len(rows) == 1 or any(map(_NUMBER.fullmatch, rows[0])))
    names = [] if bare else rows.pop(0)
    if not rows:
        raise InputError(f"{path}: no data rows after the header")
    comma = separator != "," and any(
        "," in cell and number(cell, True) is not None for cells in rows for cell in cells
    )
    sha256 = hashlib.sha256(raw).hexdigest()
    return Table(str(path), sha256, comments, names, rows, lines, separator, comma)
