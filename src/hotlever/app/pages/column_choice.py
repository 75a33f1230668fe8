"""Which column of a measurement file is which: shown, and told."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from hotlever.app.pages.frame import caption
from hotlever.measurement import FileColumn
from hotlever.measurement.columns import GROUP, UNUSED, quantity_of
from hotlever.quantities import MEASURANDS
from hotlever.units import name_and_unit

#: Units that are offered for a column whose heading has none.
_UNITS = {
    "V": ("V", "mV", "uV"),
    "mA": ("A", "mA", "uA", "nA"),
    "K": ("K", "degC"),
    "us": ("s", "ms", "us", "ns"),
}


class ColumnPicker:
    """Which column is which; `tell` is told the words of ``--column`` for those that are picked.

    Of a binary file of several groups that whose columns they are is picked first.

    Fields stay while the file is read anew: the next one may be open meanwhile.
    """

    def __init__(self, tell: Callable[[list[str]], Any]) -> None:
        self._tell = tell
        #: What was told, a quantity and perhaps its unit, by the column.
        self._assignments: dict[str, str] = {}
        self._group: str | None = None
        self._columns: dict[str, FileColumn] = {}
        self._fields: dict[str, tuple[ui.select, ui.select]] = {}
        opened = ui.expansion("Columns of the file").props("header-class=text-bold")
        with opened as self._opened:
            self._groups = ui.select([], label="Group of the file").classes("w-64")
            self._groups.on_value_change(lambda event: self._pick_group(event.value))
            caption("The first values of each, and what it is used as.")
            self._rows = ui.column().classes("w-full gap-1")

    def show(
        self,
        columns: list[FileColumn],
        assignments: list[str],
        is_understood: bool,
        groups: list[str],
    ) -> None:
        """Show the columns of a file; they are open where the file is not understood."""
        parts = [text.partition("=") for text in assignments]
        self._assignments = {
            name.strip(): quantity for quantity, _, name in parts if quantity.strip() != GROUP
        }
        self._group = next((name for quantity, _, name in parts if quantity.strip() == GROUP), None)
        self._groups.set_visibility(len(groups) > 1)
        self._groups.set_options(groups, value=self._group if self._group in groups else None)
        self._opened.set_visibility(bool(columns) or len(groups) > 1)
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
                assigned_unit = self._unit_of(column.name)
                units = [
                    *_UNITS[MEASURANDS[column.symbol].typed_unit],
                    *filter(None, [assigned_unit]),
                ]
                unit.set_options(list(dict.fromkeys(units)), value=assigned_unit)

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

    def _unit_of(self, name: str) -> str | None:
        """Return the unit that was told of a column."""
        return name_and_unit(self._assignments.get(name, ""))[1]

    def _pick(self, name: str, symbol: str, unit: str | None = None) -> Any:
        """Tell what a column is, and nothing else of it, nor of that quantity."""
        column = self._columns[name]
        if symbol == column.symbol and unit is None:
            return None  # nobody picked it
        # a unit is not guessed: the reader asks for one
        own = f"{symbol} ({unit})" if unit else symbol
        if not symbol and (
            quantity_of(column.heading) is not None or name not in self._assignments
        ):
            # what was only told to be used is taken back; what the file itself says is not
            own = UNUSED
        # at once: the next may be picked before the file is read with this
        self._assignments = {
            heading: quantity
            for heading, quantity in self._assignments.items()
            if heading != name and quantity_of(quantity, assigned=True) != symbol
        } | ({name: own} if own else {})
        group = [f"{GROUP}={self._group}"] if self._group is not None else []
        assigned = [f"{quantity}={heading}" for heading, quantity in self._assignments.items()]
        return self._tell([*group, *assigned])

    def _pick_group(self, group: str | None) -> Any:
        """Tell which group is picked; another one may have other columns."""
        is_new = group is not None and group != self._group
        return self._tell([f"{GROUP}={group}"]) if is_new else None

    def _pick_unit(self, name: str, unit: str | None) -> Any:
        is_new = unit is not None and unit != self._unit_of(name)
        return self._pick(name, self._columns[name].symbol, unit) if is_new else None
