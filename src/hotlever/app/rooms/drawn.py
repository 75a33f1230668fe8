"""A probe in the room Lever: its dimensions to be changed, and its picture."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import ui

from hotlever.app.page import figure, table
from hotlever.app.rooms.results import SHOWING
from hotlever.app.session import Session
from hotlever.errors import HotleverError


class Fields:
    """The dimensions of a parametric shape, to be changed; `changed` is told name and value."""

    def __init__(self, changed: Callable[[str, float | None], Awaitable[None]]) -> None:
        self._changed = changed
        self._column = ui.column().classes("w-full gap-1")
        self._numbers: dict[str, ui.number] = {}

    def clear(self) -> None:
        """Show none: another kind of probe is open."""
        self._column.clear()
        self._numbers = {}

    def show(self, values: dict[str, tuple[float, str]]) -> None:
        """Show values with their meanings."""
        self.clear()
        with self._column:
            for name, (value, meaning) in values.items():
                number = ui.number(name, value=value, format="%.4g", step=value / 50)
                number.props(f'dense outlined suffix=µm debounce=200 aria-label="{meaning}"')
                number.classes("w-full").tooltip(meaning)
                number.on_value_change(lambda event, n=name: self._changed(n, event.value))
                self._numbers[name] = number

    def mark(self, fault: str) -> None:
        """Mark those that a line names which says what is wrong; none if nothing is."""
        words = set(re.findall(r"\w+", fault))
        for name, number in self._numbers.items():
            number.props("error hide-bottom-space") if name in words else number.props(
                remove="error"
            )


class Picture:
    """The lever from above, and what there is to know of it; `redraw` is called for another one."""

    def __init__(
        self, session: Session, chosen: dict[str, Any], redraw: Callable[[], Awaitable[None]]
    ) -> None:
        self._session, self._chosen = session, chosen

        async def switch(event: Any) -> None:
            chosen["mesh"] = event.value
            await redraw()

        chosen.setdefault("mesh", False)
        self._mesh = ui.switch("mesh", value=chosen["mesh"], on_change=switch).props("dense")
        self._mesh.tooltip("The triangles that the lever is solved on")
        self._column = ui.column().classes("w-full gap-1")
        self._latest = 0

    def clear(self) -> None:
        """Show none, nor one that is being drawn."""
        self._latest += 1
        self._column.clear()

    async def of(self, function: str, *arguments: Any) -> dict[str, Any] | None:
        """Have a probe drawn by a function of the worker.

        Returns
        -------
        dict or None
            What the worker says of it; None if another picture was asked for meanwhile.

        Raises
        ------
        HotleverError
            If it cannot be drawn. No picture is shown then: the last one is of another probe.
        """
        self._latest += 1
        turn, call = self._latest, f"{SHOWING}:{function}"
        try:
            drawn: dict[str, Any] = await self._session.quick.call(
                call, *arguments, self._chosen["mesh"]
            )
        except HotleverError:
            if turn != self._latest:
                return None
            self._column.clear()
            raise
        if turn != self._latest:
            return None
        self._column.clear()
        with self._column:
            figure(drawn["figure"], "The lever from above: regions, terminals and tip", wide=True)
            if not drawn["fault"]:
                table(("region", "part", "area"), drawn["rows"])
                if self._chosen["mesh"]:
                    triangles = f"mesh: {drawn['triangles']} triangles"
                    ui.label(triangles).classes("text-xs opacity-70")
        return drawn

    def add(self, listing: str, outlines: str) -> None:
        """Show below what a drawing holds, and the picture of all of it."""
        with self._column, ui.expansion("What the drawing holds").classes("w-full"):
            ui.label(listing).classes("lines")
            figure(outlines, "All outlines of the drawing, by layer")
