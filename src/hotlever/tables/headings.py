"""What stands above the numbers of a table: its header row, its units, and remarks.

Here belongs what instruments write there, such as the lines between the sweeps of a file; what the
headings mean is said where the quantities are (`hotlever.quantities.MEASURANDS`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from itertools import groupby, zip_longest

import numpy as np

from hotlever.tables.table import DIALECTS, Dialect, Line, is_readable
from hotlever.units import (
    LONGEST_NUMBER,
    heading_with,
    is_unit,
    is_unit_of,
    plain_minus,
)

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


def may_end_early(names: Sequence[str]) -> bool:
    """Whether rows may lack the last column, which is one for remarks as LabVIEW's."""
    return names[-1].lower() == "comment"


def is_row_of_units(line: str) -> bool:
    """Whether a comment says that it has the units of the columns."""
    first = line[:20].strip(_MARKS).lower()
    return first.startswith(("y_unit_label", "vertical units", "unit"))


def without_marks(name: str) -> str:
    """Return the first heading of a row without what marks the row as a comment."""
    return name.lstrip(_MARKS)


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


def units_beside(names: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the unit of each column that stands in the cells of the next one, '' for others.

    The next one's heading is ``Unit``, behind any column, or ``Source Unit`` behind
    ``Source Value``.

    Raises
    ------
    ValueError
        With a row's index and the units there and above, if they differ.
    """
    units = [""] * len(names)
    # what Keithley writes there, in capitals or not
    of_buffers = {"volt dc": "V", "amp dc": "A", "vdc": "V", "adc": "A"}
    for index, name in enumerate(names[1:], start=1):
        of, _, word = name.casefold().rpartition(" ")
        if word in ("unit", "units") and names[index - 1].casefold().startswith(of):
            written = [row[index] for row in rows]
            other = next((row for row, cell in enumerate(written) if cell != written[0]), None)
            if other is not None:
                raise ValueError(other, written[other], written[0])
            units[index - 1] = of_buffers.get(written[0].casefold(), written[0])
    return units


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
