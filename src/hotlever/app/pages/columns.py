"""The columns of a measurement file: a preview, and what each of them is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from hotlever.app.pages.frame import caption
from hotlever.measurands import MEASURANDS
from hotlever.measurement import FileColumn
from hotlever.measurement.columns import UNUSED, quantity_of

#: Units that are offered for a column whose heading has none.
_UNITS = {"V": ("V", "mV", "uV"), "mA": ("A", "mA", "uA", "nA"), "K": ("K", "degC")}
_UNITS |= {"us": ("s", "ms", "us", "ns")}


class ColumnPicker:
    """Which column is which; `tell` is told the words of ``--column`` for those that are picked.

    Fields stay while the file is read anew: the next one may be open meanwhile.
    """

    def __init__(self, tell: Callable[[list[str]], Any]) -> None:
        self._tell = tell
        self._told: list[str] = []
        self._columns: dict[str, FileColumn] = {}
        self._fields: dict[str, tuple[ui.select, ui.select]] = {}
        opened = ui.expansion("Columns of the file").props("header-class=text-bold")
        with opened as self._opened:
            caption("The first values of each, and what it is used as.")
            self._rows = ui.column().classes("w-full gap-1")

    def show(self, columns: list[FileColumn], told: list[str], is_understood: bool) -> None:
        """Show the columns of a file; they are open where the file is not understood."""
        self._told = told
        self._opened.set_visibility(bool(columns))
        if not is_understood:
            self._opened.set_value(True)
        before = [(column.name, column.heading, column.cells) for column in self._columns.values()]
        self._columns = {column.name: column for column in columns}
        if before != [(column.name, column.heading, column.cells) for column in columns]:
            self._rows.clear()
            with self._rows:
                self._fields = {column.name: self._row(column) for column in columns}
        for column in columns:
            picked, unit = self._fields[column.name]
            picked.set_value(column.symbol)
            has_unit = bool(column.symbol and not column.unit)
            unit.set_visibility(has_unit)
            if has_unit:
                units = list(_UNITS[MEASURANDS[column.symbol].unit])
                unit.set_options(units, value=self._unit_of(column, units))

    def _row(self, column: FileColumn) -> tuple[ui.select, ui.select]:
        """Show a column; return the fields of what it is, and of its unit."""
        name = column.name
        head = column.heading or f"column {name}"
        with ui.row().classes("w-full items-center gap-2"):
            with ui.column().classes("gap-0 col min-w-40"):
                ui.label(head).classes("text-sm text-bold remark")
                caption(", ".join(cell or "–" for cell in column.cells)).classes("remark")
            options = {"": "not used"} | {
                symbol: f"{symbol}: {'time' if symbol == 't' else measurand.meaning}"
                for symbol, measurand in MEASURANDS.items()
            }
            picked = ui.select(options, value=column.symbol).classes("w-64")
            picked.props(f'aria-label="Column {name} is"')
            picked.on_value_change(lambda event: self._pick(name, event.value))
            unit = ui.select([], label="in").classes("w-24")
            unit.props(f'aria-label="Unit of column {name}"')
            unit.on_value_change(lambda event: self._pick_unit(name, event.value))
        return picked, unit

    def _unit_of(self, column: FileColumn, units: list[str]) -> str | None:
        """Return the unit that was told of a column, which is offered then."""
        for text in self._told:
            quantity, _, name = text.partition("=")
            if name.strip() == column.name and "(" in quantity:
                told = quantity.partition("(")[2].rstrip(") ")
                units += [told] if told not in units else []
                return told
        return None

    def _pick(self, name: str, symbol: str, unit: str | None = None) -> Any:
        """Tell what a column is, and nothing else of it, nor of that quantity."""
        column = self._columns[name]
        if symbol == column.symbol and unit is None:
            return None  # nobody picked it
        others = [text for text in self._told if not self._is_of(text, name, symbol)]
        inside = f" ({unit})" if unit else ""  # a unit is not guessed: the reader asks for one
        own = [f"{symbol}{inside}={name}"]
        if not symbol:
            # what was only told to be used is taken back; what the file itself says is not
            was_told = len(others) < len(self._told)
            by_itself = quantity_of(column.heading) is not None or not was_told
            own = [f"{UNUSED}={name}"] if by_itself else []
        # at once: the next may be picked before the file is read with this
        self._told = [*others, *own]
        return self._tell(self._told)

    def _pick_unit(self, name: str, unit: str | None) -> Any:
        column = self._columns[name]
        is_new = unit is not None and unit != self._unit_of(column, [])
        return self._pick(name, column.symbol, unit) if is_new else None

    @staticmethod
    def _is_of(text: str, name: str, symbol: str) -> bool:
        quantity, _, heading = text.partition("=")
        return heading.strip() == name or quantity_of(quantity, assigned=True) == symbol
