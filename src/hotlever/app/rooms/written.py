"""What the commands of a room write on request, and how that is given."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable

from nicegui import ui

from hotlever.app.jobs import Job
from hotlever.app.page import hand_over
from hotlever.app.rooms.results import SHOWING
from hotlever.app.rooms.room import Room

KINDS = {
    "CSV": "the table",
    "NetCDF": "the table with units and all that is known",
    "SVG": "the figure",
    "PNG": "the figure",
    "PDF": "the figure",
    "VTU": "the fields, for ParaView",
}
_TABLES = {"CSV": "csv", "NetCDF": "nc"}


def outputs(stem: str, kind: str) -> list[str]:
    """Return the options that have a command write something, whose name stands last.

    Examples
    --------
    >>> outputs("a", "PDF"), outputs("a", "VTU")
    (['-o', 'a.csv', '--plot', 'a.pdf'], ['--fields', 'a.fields'])
    """
    if kind == "VTU":
        return ["--fields", f"{stem}.fields"]
    if kind in _TABLES:
        return ["-o", f"{stem}.{_TABLES[kind]}"]
    return ["-o", f"{stem}.csv", "--plot", f"{stem}.{kind.lower()}"]


class WritingRoom(Room):
    """A room whose command writes what is asked for."""

    @abstractmethod
    def writing(self, kind: str) -> list[str]:
        """Return the command that writes something of `KINDS`."""

    def arguments(self) -> list[str]:
        """Return the command that writes the table."""
        return self.writing("CSV")

    def ask(self, kind: str) -> None:
        """Have something written, to be given."""
        self.run(self.writing(kind))

    def buttons(self, asked: Callable[[str], None]) -> None:
        """Show a button for each that can be written."""
        with ui.row().classes("items-center"):
            for kind, meaning in KINDS.items():
                ui.button(kind, on_click=lambda _, to=kind: asked(to)).props(
                    "outline dense no-caps"
                ).classes("q-px-sm").tooltip(meaning)

    def written(self, job: Job) -> bool:
        """Return whether a job has written what was asked for, be it in part."""
        return self.session.project.stamp(job.arguments[-1]) >= job.began

    async def give(self, job: Job) -> None:
        """Give what was written, several files as one."""
        if not self.written(job):
            return
        path = self.session.project.path(job.arguments[-1])
        if path.is_dir():
            new = [one for one in path.iterdir() if one.stat().st_mtime >= job.began]
            if len(new) > 1:
                call = f"{SHOWING}:packed"
                await hand_over(self.session.full.call(call, sorted(new)), f"{path.name}.zip")
                return
            path = new[0]
        ui.download.file(path)
