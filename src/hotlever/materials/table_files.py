"""Laws of materials in files: two columns, the temperature and a property, with their units."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.errors import InputError, counted, quoted
from hotlever.materials.parameters import STATED
from hotlever.materials.stated import Table
from hotlever.tables import read_table
from hotlever.text import with_unit
from hotlever.units import name_and_unit, product_conversion, unknown_unit

#: Endings of names of files that hold a table.
_FILE = re.compile(r".+\.(csv|tsv|txt|dat)", re.IGNORECASE)


def read_law(path: str | Path, name: str, called: str | None = None) -> Table:
    """Read a law of a property from a file of two columns.

    The first is the temperature (K or °C), the second the property, in any unit of its kind; a
    header row says which. Falling temperatures are turned round.

    Parameters
    ----------
    path : path
    name : str
        ``resistivity``, ``kappa``, ``heat_capacity``, ``seebeck`` or ``emissivity``.
    called : str, optional
        What the table says it is from, in place of the file's name.

    Raises
    ------
    InputError
        If the file holds no such table; the text names file and line.
    """
    unit = STATED[name][0]
    table = read_table(path, f"a header row like 'T (K),{name} ({unit})' and rows of numbers")
    if len(table.names) != 2:
        raise InputError(
            f"{table.where(-1)}: {counted(len(table.names), 'column')}, expected two, temperature "
            f"and {name}"
        )
    units = [name_and_unit(heading)[1] for heading in table.names]
    if units[0] is None or (units[1] is None and unit != "1"):
        heading = table.names[0 if units[0] is None else 1]
        raise InputError(
            f"{table.where(-1)}: column {quoted(heading)} has no unit, expected a header row like "
            f"'T (K),{name} ({unit})'"
        )
    T = table.values(0, "K", "temperature")
    factor = product_conversion(units[1] or "1", unit)
    if factor is None:
        raise unknown_unit(units[1] or "", unit, f"{table.where(-1)}: {table.names[1]}")
    values = factor * table.numbers(1, name)
    empty = np.isnan(T + values)
    if empty.any():
        row = int(empty.argmax())
        raise InputError(f"{table.where(row)}: a cell is empty, expected a number in each")
    low, high = STATED[name][1]
    wrong = ~((values >= low) & (values <= high))
    if wrong.any():
        row = int(wrong.argmax())
        raise InputError(
            f"{table.where(row)}: {name} is {with_unit(f'{values[row]:.4g}', unit)}, expected "
            f"{low:g} to {high:g}"
        )
    if T.size > 1 and T[0] > T[-1]:
        T, values = T[::-1], values[::-1]
    try:
        return Table(T.tolist(), values.tolist(), called or Path(path).name)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def with_tables(values: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return a section of a material with the tables that it names files of.

    Parameters
    ----------
    values : mapping
        In which a property may be the name of a file that ends in .csv, .tsv, .txt or .dat.
    folder : path, optional
        What names of files are relative to.

    Raises
    ------
    InputError
        If a file holds no table of the property.
    """
    read = dict(values)
    for name, value in values.items():
        if name in STATED and isinstance(value, str) and _FILE.fullmatch(value.strip()):
            try:
                read[name] = read_law((folder or Path()) / value, name, value)
            except InputError as error:
                raise InputError(f"{name}: {error}") from None
    return read
