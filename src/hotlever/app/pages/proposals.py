"""What to measure next, asked beside a calibration: a table, how far is safe, and a figure."""

from __future__ import annotations

from nicegui import ui

from hotlever.app.jobs import Task
from hotlever.app.pages.frame import ErrorBanner, figure, lines_shown, small_button, table
from hotlever.app.session import Session
from hotlever.materials.parameters import sentence

#: What can be told: where the error counts, and what the tip is to stay below.
_TOLD = {"at_K": ("Sure at", "hottest measured"), "stay_below_K": ("Stay below", "melting")}


class Proposals:
    """A card in the element that is open, of a calibration file."""

    def __init__(self, session: Session, banner: ErrorBanner, name: str) -> None:
        self._session, self._banner, self._name = session, banner, name
        self._asked = session.choices("asked")
        with ui.card().classes("w-full").props("flat bordered"):
            with ui.row().classes("items-center"):
                self._fields = {key: self._field(key) for key in _TOLD}
                small_button("What to measure next", self.show, icon="add_location_alt")
            self._shown = ui.column().classes("w-full gap-2").props("data-proposals")

    def _field(self, key: str) -> ui.number:
        title, empty = _TOLD[key]
        field = ui.number(title, value=self._asked.get(key)).classes("w-44")
        return field.props(f'suffix=K clearable stack-label placeholder="{empty}"')

    async def show(self) -> None:
        """Ask, and show the answer."""
        told = {key: field.value for key, field in self._fields.items()}
        for key, value in told.items():
            self._asked.pop(key, None)
            if value is not None:
                self._asked[key] = value
        self._shown.clear()
        with self._shown:
            ui.spinner(size="lg").props('aria-label="Being computed"')
        answer = None
        with self._banner.caught():
            asked = self._name, told["at_K"], told["stay_below_K"]
            answer = await self._session.ask("full", "showing:proposed", *asked)
        self._shown.clear()
        if answer is None:
            return
        options = {"at": told["at_K"], "stay_below": told["stay_below_K"]}
        kelvins = {name: f"{value:g}K" for name, value in options.items() if value is not None}
        with self._shown:
            ui.label(sentence(answer["now"]))
            head, *rows = answer["rows"]
            table(head, rows)
            for remark in answer["remarks"]:
                ui.label(sentence(remark)).classes("text-sm remark")
            figure(answer["figure"], "Error by temperature now and then; tip temperature by bias")
            line = Task("next", (self._name,), kelvins).line
            lines_shown(line, "command line", "The same on the command line")
