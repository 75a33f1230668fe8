"""What the rooms Fit and Calibrate begin with: a measurement, dropped or chosen, and understood."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import ui

from hotlever.app.page import Complaint, drop_zone, figure, table
from hotlever.app.rooms.results import SHOWING
from hotlever.app.session import Session
from hotlever.errors import HotleverError

REFERENCE = "reference probe"
_DROP = "Drop a measurement here (bias, current and what else there is), or press +"


class Measured:
    """The measurement of a room, and what was understood of it.

    Parameters
    ----------
    session : Session
    complaint : Complaint
    chosen : dict
        What was chosen in the room: ``data``, ``columns``, ``probe``.
    then : callable
        Called with what was understood, or None, whenever another file is taken.
    """

    def __init__(
        self,
        session: Session,
        complaint: Complaint,
        chosen: dict[str, Any],
        then: Callable[[dict[str, Any] | None], Awaitable[None]],
    ) -> None:
        self._session, self._complaint, self.chosen = session, complaint, chosen
        self._then = then

    def controls(self) -> None:
        """Show where a measurement is dropped or chosen."""
        drop_zone(self._session, self._complaint, _DROP, self._dropped)
        names = self._session.project.data
        if self.chosen.get("data") not in names:
            self.chosen["data"] = names[0] if names else None
        self._select = ui.select(
            names, label="Measurement", value=self.chosen["data"], on_change=self._picked
        )
        self._select.classes("w-full").props("dense outlined")
        if not names:
            ui.button("Try the example", icon="science", on_click=self._example).props(
                "outline no-caps dense"
            )
        with ui.expansion("Columns with other names").classes("w-full").props("dense"):
            ui.textarea(
                value="\n".join(self.chosen.get("columns", [])),
                placeholder="I_h (uA)=Current",
                on_change=self._columns,
            ).props('dense outlined autogrow aria-label="Which column is which, one on a line"')
            ui.label("One on a line: QUANTITY (UNIT)=NAME of the column, or its number.").classes(
                "text-xs opacity-70"
            )

    def probe_choice(self, label: str = "Probe") -> None:
        """Show which probe it is a measurement of."""
        names = {"": REFERENCE} | {name: name for name in self._session.project.probes}
        value = self.chosen.get("probe") or ""

        async def pick(event: Any) -> None:
            self.chosen["probe"] = event.value or None
            await self.read()

        select = ui.select(
            names, label=label, value=value if value in names else "", on_change=pick
        )
        select.classes("w-full").props("dense outlined")

    def shown(self) -> None:
        """Show what was understood, filled by `read`."""
        self._table = ui.column().classes("w-full gap-2")

    async def _dropped(self, names: list[str]) -> None:
        self._select.set_options(self._session.project.data)
        self._select.set_value(names[-1])
        if self.chosen.get("data") == names[-1]:
            await self.read()

    async def _example(self) -> None:
        with self._complaint.caught():
            await self._dropped([self._session.project.take_example("lever-a.csv")])

    async def _picked(self, event: Any) -> None:
        self.chosen["data"] = event.value
        await self.read()

    async def _columns(self, event: Any) -> None:
        lines = (line.strip() for line in (event.value or "").splitlines())
        self.chosen["columns"] = [line for line in lines if line]
        await self.read()

    async def read(self) -> None:
        """Read the measurement, and show what was understood."""
        self._table.clear()
        self._complaint.clear()
        found, name = None, self.chosen.get("data")
        if name is not None:
            call, folder = f"{SHOWING}:understood", self._session.project.folder
            columns, probe = self.chosen.get("columns", []), self.chosen.get("probe")
            try:
                found = await self._session.full.call(call, folder, name, columns, probe)
            except HotleverError as error:
                self._complaint.say(str(error))
        if found is not None:
            with self._table:
                self._show(found)
        await self._then(found)

    def _show(self, found: dict[str, Any]) -> None:
        opened = ui.expansion("What was understood", value=True).classes("w-full")
        opened.props("dense header-class=text-bold")
        with opened, ui.row().classes("w-full items-start no-wrap"):
            with ui.column().classes("col"):
                head, *rows = found["rows"]
                table(head, rows)
                for note in found["notes"]:
                    ui.label(f"• {note}").classes("text-sm remark")
            with ui.column().classes("w-80"):
                figure(found["figure"], "The measured I-V curve")
