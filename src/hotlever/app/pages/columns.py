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
    """Which column is which; `tell` is told the words of ``--column`` for those that are picked."""

    def __init__(self, tell: Callable[[list[str]], Any]) -> None:
        self._tell = tell
        self._told: list[str] = []
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
        self._rows.clear()
        with self._rows:
            for column in columns:
                self._row(column)

    def _row(self, column: FileColumn) -> None:
        head = column.heading or f"column {column.name}"
        with ui.row().classes("w-full items-center gap-2"):
            with ui.column().classes("gap-0 col min-w-40"):
                ui.label(head).classes("text-sm text-bold remark")
                caption(", ".join(cell or "–" for cell in column.cells)).classes("remark")
            options = {"": "not used"} | {
                symbol: f"{symbol}: {'time' if symbol == 't' else measurand.meaning}"
                for symbol, measurand in MEASURANDS.items()
            }
            picked = ui.select(options, value=column.symbol).classes("w-64")
            picked.props(f'aria-label="Column {column.name} is"')
            picked.on_value_change(lambda event: self._pick(column, event.value))
            if column.symbol and not column.unit:
                units = list(_UNITS[MEASURANDS[column.symbol].unit])
                unit = ui.select(units, label="in", value=self._unit_of(column, units)).classes(
                    "w-24"
                )
                unit.props(f'aria-label="Unit of column {column.name}"')
                unit.on_value_change(lambda e: self._pick(column, column.symbol, e.value))

    def _unit_of(self, column: FileColumn, units: list[str]) -> str | None:
        """Return the unit that was told of a column, which is offered then."""
        for text in self._told:
            quantity, _, name = text.partition("=")
            if name.strip() == column.name and "(" in quantity:
                told = quantity.partition("(")[2].rstrip(") ")
                units += [told] if told not in units else []
                return told
        return None

    def _pick(self, column: FileColumn, symbol: str, unit: str | None = None) -> Any:
        """Tell what a column is, and nothing else of it, nor of that quantity."""
        others = [text for text in self._told if not self._is_of(text, column.name, symbol)]
        if not symbol:
            # what was only told to be used is taken back; what the file itself says is not
            was_told = len(others) < len(self._told)
            by_itself = quantity_of(column.heading) is not None or not was_told
            return self._tell([*others, *([f"{UNUSED}={column.name}"] if by_itself else [])])
        # a unit is not guessed: the reader asks for one
        inside = f" ({unit})" if unit else ""
        return self._tell([*others, f"{symbol}{inside}={column.name}"])

    @staticmethod
    def _is_of(text: str, name: str, symbol: str) -> bool:
        quantity, _, heading = text.partition("=")
        return heading.strip() == name or quantity_of(quantity, assigned=True) == symbol
