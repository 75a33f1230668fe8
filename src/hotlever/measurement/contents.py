"""A measurement file while it is read: rows and settings, and how one is refused or noted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hotlever.datasets import COLUMNS
from hotlever.errors import InputError, shown
from hotlever.measurement.columns import Column
from hotlever.measurement.data import LEVER, TIME
from hotlever.measurement.settings import Settings
from hotlever.tables import Table
from hotlever.types import Array


@dataclass
class Contents:
    """Rows and settings of a file, which `bias` and `histories` complete.

    Attributes
    ----------
    table : Table
    columns : dict of str to Column
        By symbol: the quantities that the file gives.
    settings : Settings
    notes : list of str
        What of the file was not used or not understood, and what looks wrong in it.
    values : dict of str to ndarray, shape (n,)
        Every quantity by its symbol, in the unit inside; NaN where nothing is known.
    origin : dict of str to str
        The column of a quantity, or what it follows from.

    Raises
    ------
    InputError
        If a cell is no number.
    """

    table: Table
    columns: dict[str, Column]
    settings: Settings
    notes: list[str]
    values: dict[str, Array] = field(init=False)
    origin: dict[str, str] = field(init=False)

    def __post_init__(self) -> None:
        self.origin = {symbol: column.origin for symbol, column in self.columns.items()}
        self.values = dict.fromkeys(COLUMNS, np.full(len(self.table.rows), np.nan))
        for symbol, column in self.columns.items():
            self.values[symbol] = column.values(self.table)
            if symbol not in ("V_b", LEVER, TIME):
                filled = np.array([bool(row[column.place]) for row in self.table.rows])
                missing = np.isnan(self.values[symbol]) & filled
                self.note_rows(missing, f"{symbol} is written as missing")

    def cell(self, symbol: str, row: int) -> str:
        """Return a cell as it stands in the file, to quote it."""
        return shown(self.table.rows[row][self.columns[symbol].place])

    def refuse(self, rows: NDArray[np.bool_], expected: str, *symbols: str) -> None:
        """Refuse the first of some rows, (n,) of bool, for what its cells of `symbols` hold.

        Raises
        ------
        InputError
            If there is one; the text says what was `expected`.
        """
        if rows.any():
            row = int(np.argmax(rows))
            cells = " and ".join(f"{symbol} is '{self.cell(symbol, row)}'" for symbol in symbols)
            raise InputError(f"{self.table.where(row)}: {cells}, expected {expected}")

    def note(self, text: str) -> None:
        """Note what concerns the whole file."""
        self.notes.append(f"{self.table.path}: {text}")

    def note_rows(self, rows: NDArray[np.bool_], text: str) -> None:
        """Note what is odd about some rows, (n,) of bool, if there are any."""
        if rows.any():
            others = f", and in {rows.sum() - 1} more rows" if rows.sum() > 1 else ""
            self.notes.append(f"{self.table.where(int(np.argmax(rows)))}: {text}{others}")
