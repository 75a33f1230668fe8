"""A lever that is measured with a source meter, and drawn row by row, in the page Measurements."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import ClassVar

from nicegui import ui

from hotlever.app.jobs import Job, Task
from hotlever.app.pages.frame import ErrorBanner, caption, text_shown
from hotlever.app.pages.plots import RampPlots
from hotlever.app.pages.task_page import JobView, TaskPage
from hotlever.app.session import Session
from hotlever.tasks.measuring import TWIN

#: The fields: what they ask, and what stands in them at first.
_FIELDS = {
    "source": ("Source meter (VISA name, or twin to try it)", TWIN),
    "reader": ("Voltmeter at the reader (VISA name, or twin)", ""),
    "bias": ("Biases (V), and most rows", "1:11:25"),
    "settle": ("Wait at each", "10s"),
    "stay_below": ("The tip stays below", "900K"),
    "compliance": ("Most current", "5mA"),
}
_ROWS = ".csv"
_NEXT = "Take the biases that tell most, from the fourth row on (--next)"
_FIRST = (
    "Set the limits of the instrument itself first: it keeps its output on when the line breaks. "
    "Before each bias the rows so far say how hot the tip may get there."
)


class MeasureCard(TaskPage):
    """What a lever is measured with, beside what is measured; `then` is told the file of rows."""

    name = "measure"
    first: ClassVar = {name: value for name, (_, value) in _FIELDS.items()} | {"propose": False}

    def __init__(
        self, session: Session, banner: ErrorBanner, then: Callable[[str], Awaitable[None]]
    ) -> None:
        super().__init__(session, banner)
        self._then = then

    def show_fields(self) -> None:
        """Ask here how it is measured."""
        with ui.expansion("Measure with a source meter", icon="bolt").classes("w-full"):
            for name, (label, _) in _FIELDS.items():
                self.text(name, label)
            self.checkbox("propose", "Most telling biases", _NEXT)
            self._button = ui.button("Measure", icon="play_arrow", on_click=self.start)
            self._button.classes("w-full")
            caption(_FIRST).classes("remark")
            self.command()
        self.show_command()

    def show_rows(self) -> None:
        """Draw here what is measured, while it is and after."""
        with ui.column().classes("w-full gap-2") as self._all:
            JobView(self.session, self.name, self._ended, during=self._follow, stops=True)
            self._plots = RampPlots()
            self._result = ui.column().classes("w-full gap-1")
        self._all.set_visibility(bool(self.session.jobs.of(self.name)))

    def task(self) -> Task:
        """Return the task that measures, and writes the rows to a new file."""
        chosen = {name: self.chosen[name].strip() for name in _FIELDS}
        options = {**chosen, "next": self.chosen["propose"], "probe": self.probe}
        stem = self.session.project.free(f"{self.stem}-iv", _ROWS)
        return Task("measure", (), {**options, "output": f"{stem}{_ROWS}"})

    def run(self, task: Task) -> bool:
        """Measure, and show the rows."""
        self._all.set_visibility(True)
        self._result.clear()
        return super().run(task)

    def _follow(self, job: Job) -> None:
        if job.contents:
            self._plots.show(job.contents.get("rows"))

    async def _ended(self, job: Job) -> None:
        with self._result:
            text_shown(job.contents.get("result", ""))
        self.show_command()
        if self.written(job):
            await self._then(Path(job.task.written).name)
