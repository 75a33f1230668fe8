"""What the pages Fit and Calibrate have in common: a measurement, and a result.

A measurement is dropped or chosen; a file is made of it, whose page is shown.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app.jobs import Job
from hotlever.app.pages.frame import (
    FIGURE_FILES,
    PAGES,
    ErrorBanner,
    caption,
    drop_zone,
    figure,
    flat_button,
    hand_over,
    small_button,
    table,
    text_shown,
    two_columns,
)
from hotlever.app.pages.page import Page, Work
from hotlever.app.pages.plots import MeasuredPlots
from hotlever.app.project import DATA, EXAMPLES
from hotlever.app.session import Session
from hotlever.errors import HotleverError, InputError
from hotlever.measurement import FileColumn
from hotlever.measurement.columns import GROUP, UNUSED, quantity_of
from hotlever.quantities import MEASURANDS
from hotlever.units import name_and_unit

#: What is shown where there is no measurement.
_EXAMPLE = "lever-a.csv"
_UNDERSTOOD, _OF_EXAMPLE = "What was understood", f"An example, {_EXAMPLE}, and what it holds"
#: Units that are offered for a column whose heading has none.
_UNITS = {
    "V": ("V", "mV", "uV"),
    "mA": ("A", "mA", "uA", "nA"),
    "K": ("K", "degC"),
    "us": ("s", "ms", "us", "ns"),
}
_DROP = "Drop a measurement here (bias, current and what else there is), or press +"


class MeasuredPage(Page):
    """A page that begins with a measurement, makes a file of it, and shows that."""

    #: What is made: its kind, what its name ends with, and the folder of those of many levers.
    kind: ClassVar[str]
    ending: ClassVar[str]
    folder: ClassVar[str]
    #: What its task takes of what can be told of a file, see `Session.metadata_of`.
    tellable: tuple[str, ...] = ("columns",)

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        #: Observables that the measurement has.
        self.observables: list[str] = []
        self._reads = self._shows = 0
        self._read_of: tuple[str | None, str | None] | None = None
        with two_columns() as (left, right):
            with left:
                drop_zone(session, banner, _DROP, self._dropped)
                self._try = small_button("Try the example", self._example, icon="science")
                self._select = self.choice("data", "Measurement", self._offered, None)
                self.options()
                title, icon = PAGES[self.name]
                self._button = ui.button(title, icon=icon, on_click=self.start)
                # until there is something understood
                self._button.classes("w-full").disable()
            with right:
                Work(session, self.name, self._ended, during=self._follow, notes=False)
                self._result = ui.column().classes("w-full gap-2")
                self._columns = ColumnPicker(partial(self.tell, "columns"))
                opened = ui.expansion(_UNDERSTOOD, value=True)
                self._understood = opened.props("header-class=text-bold")
                with self._understood, ui.column().classes("w-full gap-2"):
                    self._plots = MeasuredPlots()
                    self._rows = ui.column().classes("w-full gap-2")
                self._understood.set_visibility(False)
                self.command()

    async def open(self) -> None:
        """Read the measurement that was chosen last, or the latest of the folder."""
        if self.chosen["data"] is None:
            names = self.session.project.data
            latest = await self.session.ask("full", "showing:measurements", names, 1)
            if latest and self.chosen["data"] is None:
                self._select.set_value(latest[0])  # which reads it
                return
        await self.read()

    # --- for the page to say ----------------------------------------------------------------------

    def options(self) -> None:
        """Show what else can be chosen."""

    def understood(self) -> None:
        """Follow what was understood of a measurement."""

    async def show(self, name: str) -> None:
        """Show a result above its page."""

    @property
    def stem(self) -> str:
        """What names of files begin with."""
        return Path(self.chosen["data"]).stem

    @property
    def output(self) -> str:
        """The file that is made."""
        return f"{self.stem}{self.ending}"

    # --- the measurement --------------------------------------------------------------------------

    @property
    def _offered(self) -> dict[str, str]:
        return {"": "none yet"} | {name: name for name in self.session.project.data}

    async def _dropped(self, names: list[str]) -> None:
        self._select.set_options(self._offered)
        if names[-1] not in self._select.options:
            raise InputError(f"{names[-1]}: no measurement by its name, expected {', '.join(DATA)}")
        if self.chosen["data"] == names[-1]:
            await self.read()
        self._select.set_value(names[-1])

    async def _example(self) -> None:
        with self.banner.caught():
            await self._dropped([self.session.project.take_example(_EXAMPLE)])

    @property
    def metadata(self) -> dict[str, Any]:
        """What was told of this measurement, on whatever page; see `Session.metadata_of`."""
        return self.session.metadata_of(self.chosen["data"])

    def tell(self, key: str, value: Any) -> Awaitable[None] | None:
        """Keep what was typed of a measurement, unless it is what is shown for another one."""
        if value == self.metadata[key]:
            return None
        self.metadata[key] = value
        return self.read()

    def show_metadata(self) -> None:
        """Show what was told of the measurement that is chosen."""

    def changed(self) -> Awaitable[None] | None:
        """Read the measurement anew if another one, or another probe, was chosen."""
        if (self.chosen["data"], self.chosen.get("probe")) == self._read_of:
            self.show_command()
            return None
        self.show_metadata()
        return self.read()

    async def read(self) -> None:
        """Read the measurement, and show what was understood, and what was made of it before."""
        self._reads += 1
        turn, understood, name = self._reads, None, self.chosen["data"]
        columns: list[FileColumn] = []
        groups: list[str] = []
        self._read_of = name, self.chosen.get("probe")
        self.banner.clear()
        metadata = {key: self.metadata[key] for key in self.tellable}
        metadata["probe"] = self.chosen.get("probe")
        if name is not None:
            with suppress(HotleverError):
                groups = await self.session.ask("full", "showing:groups", name)
                columns = await self.session.ask("full", "showing:columns", name, metadata)
        try:
            file = name or str(EXAMPLES / _EXAMPLE)
            understood = await self.session.ask("full", "showing:understood", file, metadata)
        except HotleverError as error:
            if turn == self._reads:
                self.banner.say(str(error))
        if turn != self._reads:  # something else has been chosen meanwhile
            return
        self._columns.show(columns, self.metadata["columns"], understood is not None, groups)
        self._show_understood(understood)
        if job := self.session.jobs.by_page.get(self.name):
            self._follow(job)
        self._try.set_visibility(name is None)
        self._understood.props(f'label="{_UNDERSTOOD if name else _OF_EXAMPLE}"')
        self._button.set_enabled(understood is not None and name is not None)
        self.understood()
        self.show_command()
        await self._show_result()

    def _show_understood(self, understood: dict[str, Any] | None) -> None:
        self.observables = understood["observables"] if understood else []
        self._understood.set_visibility(understood is not None)
        self._rows.clear()
        if understood is None:
            return
        self._plots.measured(understood["data"], self.observables)
        with self._rows:
            head, *rows = understood["rows"]
            table(head, rows)
            for note in understood["notes"]:
                ui.label(f"• {note}").classes("text-sm remark")

    # --- what is made of it -----------------------------------------------------------------------

    def start(self) -> bool:
        """Have the task done; what it replaces is not shown any more."""
        started = super().start()
        if started:
            self._result.clear()
        return started

    def _follow(self, job: Job) -> None:
        """Draw how near to the data the lever is that is being fitted, or was."""
        curve = job.contents.get("curve")
        if curve and self.observables and job.task.files == (self.chosen["data"],):
            self._plots.approach(curve)

    async def _ended(self, job: Job) -> None:
        await self._show_result()

    async def _show_result(self) -> None:
        self._shows += 1
        turn, project = self._shows, self.session.project
        self._result.clear()
        if not self.chosen["data"] or self.session.jobs.running(self.name):
            return
        # of this measurement alone, or one among many levers
        names = self.output, f"{self.folder}/{self.stem}.json"
        name = next((name for name in names if project.stamp(name)), None)
        if name is None:
            return
        with self._result:
            await self.show(name)
            if turn == self._shows:
                await _ResultBlocks(self, name).show()


class _ResultBlocks:
    """The page of a result, a fit or a calibration, in the element that is open."""

    def __init__(self, page: MeasuredPage, name: str) -> None:
        self._page, self._name = page, name

    async def show(self) -> None:
        """Show it as it is drawn."""
        container = ui.row().classes("w-full gap-3 items-start")
        waiting = ui.spinner(size="lg").props('aria-label="Being drawn"')

        def hear(kind: str, block: dict[str, Any]) -> None:
            if kind == "block" and not container.is_deleted:
                with container:
                    self._show_block(block)

        with self._page.banner.caught():
            request = "showing:page", self._page.kind, self._name
            await self._page.session.ask("full", *request, heard=hear)
        if not waiting.is_deleted:
            waiting.delete()

    def _show_block(self, block: dict[str, Any]) -> None:
        if block["kind"] == "heading":
            ui.label(block["text"]).classes("w-full text-lg text-bold")
        elif block["kind"] == "text":
            text_shown(block["text"])
        elif block["kind"] == "table":
            table(block["columns"], block["rows"])
            caption(block["caption"]).classes("w-full")
        else:
            with ui.column().classes("gap-0"):
                figure(block["figure"], block["caption"])
                with ui.row().classes("items-center w-full no-wrap"):
                    caption(block["caption"]).classes("remark caption col")
                    for suffix in FIGURE_FILES:
                        give = partial(self._give_figure, block["name"], suffix)
                        label = f"{block['name']} as {suffix[1:].upper()}"
                        flat_button(suffix[1:].upper(), give, label=label).props("size=sm")

    async def _give_figure(self, figure_name: str, suffix: str) -> None:
        with self._page.banner.caught():
            arguments = self._page.kind, self._name, figure_name, suffix
            drawn = self._page.session.ask("full", "showing:drawn", *arguments)
            await hand_over(drawn, f"{Path(self._name).name.split('.')[0]}-{figure_name}{suffix}")


class ColumnPicker:
    """Which column is which; `tell` is told the words of ``--column`` for those that are picked.

    Of a TDMS file of several groups that whose columns they are is picked first.

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
