"""The columns of a measurement file as they are, and which of them will be used."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

from hotlever.errors import InputError, shown
from hotlever.measurement.columns import find_columns, measured_table, quantity_of
from hotlever.units import name_and_unit

#: Cells of a column that are shown, and columns.
_CELLS, _MOST = 3, 60


@dataclass(frozen=True)
class FileColumn:
    """One column of a file.

    Attributes
    ----------
    heading, unit : str
        As they stand in the file; empty where there is none.
    name : str
        By which ``--column`` finds it: its heading, or its number where that is not its alone.
    cells : tuple of str
        The first ones.
    symbol : str
        The quantity that it is used as; empty if it is not used.
    """

    heading: str
    unit: str
    name: str
    cells: tuple[str, ...]
    symbol: str


def file_columns(
    path: str | os.PathLike[str], columns: Mapping[str, str] | None = None, *, driven: bool = False
) -> list[FileColumn]:
    """Return the columns of a measurement file, which may lack what a measurement needs.

    Parameters
    ----------
    path : path
    columns : mapping of str to str, optional
        See `read_measurement`.
    driven : bool
        Whether a wave form is given, so that no column of the bias is needed.

    Raises
    ------
    InputError
        If the file holds no table.
    """
    assigned = dict(columns or {})
    table = measured_table(path, assigned)
    symbols = dict[int, str]()
    try:
        used = find_columns(table, assigned, driven=driven)
        symbols = {column.index: symbol for symbol, column in used.items()}
    except InputError:
        # what is missing or stands twice is for the user to say
        symbols = {i: quantity_of(name) or "" for i, name in enumerate(table.names)}
        for told, heading in assigned.items():
            with suppress(InputError):
                symbols[table.index(heading)] = quantity_of(told, assigned=True) or ""
    headings = [name.casefold() for name in table.names]
    shown_columns = []
    for index, heading in enumerate(table.names[:_MOST]):
        is_alone = bool(heading) and headings.count(heading.casefold()) == 1 and "=" not in heading
        cells = tuple(shown(row[index]) for row in table.rows[:_CELLS])
        name = heading if is_alone and not heading.isdecimal() else str(index + 1)
        unit = name_and_unit(heading)[1] or ""
        shown_columns.append(FileColumn(heading, unit, name, cells, symbols.get(index, "")))
    return shown_columns
