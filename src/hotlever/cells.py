"""Text as instruments write it: from bytes to lines, cells and numbers."""

from __future__ import annotations

import csv
import math

from hotlever.errors import InputError
from hotlever.units import LARGEST_NUMBER, LONGEST_NUMBER, NUMBER

MOST_LINES = 200_000  #: of a file, unless its reader says otherwise
LONGEST_LINE = 2**17  #: characters; a spectrometer's map has some 40 000

_MISSING = {"", "nan", "-", "--", "n/a", "na"}
#: What SCPI instruments write for "not a number".
_NOT_A_NUMBER = 9.91e37


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
    if len(cell) <= LONGEST_NUMBER and NUMBER.fullmatch(cell):
        sign, other = (",", ".") if decimal_comma else (".", ",")
        if other in cell:
            return None
        value = float(cell.replace(sign, ".").lower().replace("d", "e"))
        if value == _NOT_A_NUMBER:
            return math.nan
        return value if abs(value) <= LARGEST_NUMBER else None
    return math.nan if cell.lower() in _MISSING else None
