"""Layouts in which a table does not stand below its header row, brought to that one."""

from __future__ import annotations

from itertools import zip_longest

from hotlever.tables.cells import DIALECTS, Dialect, Line

#: First and last heading of LabOne's lines of fields: one line for each column of a table.
_FIELDS = ("chunk", "fieldname")
#: First cell, and cells in front of the rows, of a TDS's file, whose settings stand beside them.
_BESIDE, _IN_FRONT = "record length", 3


def below_a_header(lines: list[Line]) -> list[Line]:
    """Return the lines of a file whose table has its header row above its rows.

    Lines of fields become columns, the chunks below each other; what stands beside the rows
    becomes comments above them. Other lines stay as they are. Each keeps the number of a line of
    the file.
    """
    cells = next((dialect.cells(lines[0][1]) for dialect in _separated(lines[0][1])), None) or []
    first = [cell.strip().lower() for cell in cells]
    separator = next((dialect.separator for dialect in _separated(lines[0][1])), None)
    if len(first) > 3 and (first[0], first[3]) == _FIELDS and separator is not None:
        return _columns_of_fields(lines, separator)
    if len(first) > _IN_FRONT + 1 and first[0] == _BESIDE and separator is not None:
        return _rows_beside_settings(lines, separator)
    return lines


def _separated(line: str) -> list[Dialect]:
    return [each for each in DIALECTS if each.separator is not None and each.separator in line]


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
    said: dict[str, str] = {}
    for number, line in lines:
        key, value, *cells = (cell.strip() for cell in line.split(separator))
        if key:
            said[key.lower()] = value
            comments.append((number, f"# {key}: {value}"))
        rows.append((number, separator.join(cells[_IN_FRONT - 2 :])))
    time, unit = said.get("horizontal units", ""), said.get("vertical units", "")
    names = (
        f"TIME ({time})" if time else "TIME",
        said.get("source", "CH1") + f" ({unit})" * bool(unit),
    )
    return [*comments, (lines[0][0], separator.join(names)), *rows]
