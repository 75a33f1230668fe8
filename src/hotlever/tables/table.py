"""A table in a text file: named columns, rows of cells, and what is said of them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hotlever.errors import InputError, quoted, shown, unknown_name
from hotlever.tables.cells import Dialect, Line
from hotlever.types import Array
from hotlever.units import conversion, key_and_value, name_and_unit, unknown_unit

#: A number with a mark of thousands, or with three decimals; and a small whole number.
_GROUPED, _SMALL = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}"), re.compile(r"[+-]?[1-9]\d{0,2}")


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
        said = [key_and_value(line) for _, line in self.comments]
        return {key: value for key, value in reversed(said) if value}

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
            names = [shown(name) for name in self.names[:9]]
            raise unknown_name("column", heading, names, self.where(-1))
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
                    f"{self.where(row)}: {name}: found '{shown(cell)}', expected a number"
                    f"{hint * self.dialect.decimal_comma}"
                )
        if self.dialect.decimal_comma:
            cells = [row[column] for row in self.rows]
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
        return values

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
            raise unknown_unit(unit, inside, f"{self.where(-1)}: {shown(heading)}")
        return converted[0] * self.numbers(column, name) + converted[1]
