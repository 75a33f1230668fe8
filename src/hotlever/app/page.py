"""What every room has: the frame, a place to drop files, the work that runs, and the downloads."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from nicegui import events, ui

from hotlever.app.jobs import Job, command_line
from hotlever.app.project import LARGEST_FILE, safe_name
from hotlever.app.session import Session
from hotlever.app.undo import undo_button
from hotlever.errors import HotleverError

#: Rooms by their address: title and what is done there.
ROOMS = {
    "/": ("Start", "home"),
    "/lever": ("Lever", "architecture"),
    "/simulate": ("Simulate", "tune"),
    "/raman": ("Raman", "thermostat"),
    "/fit": ("Fit", "query_stats"),
    "/calibrate": ("Calibrate", "straighten"),
    "/levers": ("Levers", "table_rows"),
}
#: Seconds between two looks at the work that runs.
_LOOK_S = 0.1
_STYLE = """
.q-uploader { width: 100%; max-height: 14rem; box-shadow: none;
  border: 1.5px dashed var(--q-primary); background: transparent; }
.q-uploader__list:empty, .q-uploader__list { min-height: 0; padding: 0; }
.q-uploader__header { background: transparent; color: inherit; }
.q-uploader__title { white-space: normal; font-weight: 400; font-size: .875rem; }
.q-uploader__subtitle { display: none; }
.complaint { background: #fdecea; color: #7a1712; border-left: 4px solid #D55E00;
  padding: .5rem .75rem; border-radius: 4px; white-space: pre-wrap; overflow-wrap: anywhere; }
.remark { overflow-wrap: anywhere; }
.paper { background: white; border-radius: 6px; padding: .5rem; max-width: 100%; }
.paper img { max-width: 100%; height: auto; }
.paper.wide img { width: 100%; }
.caption { contain: inline-size; min-width: 12rem; }
.lines { white-space: pre-wrap; font-family: monospace; font-size: .8rem; overflow-x: auto; }
.number { font-size: 1.5rem; line-height: 1.2; font-variant-numeric: tabular-nums; }
.controls { width: 21rem; min-width: 19rem; flex: 0 0 auto; }
.results { flex: 1 1 30rem; min-width: 0; }
pre.command { font-size: .78rem; white-space: pre-wrap; overflow-wrap: anywhere; margin: 0;
  padding: .5rem; border-radius: 4px; background: rgba(128,128,128,.12); }
.nicegui-content { padding: .75rem 1rem; }
a:focus-visible, button:focus-visible { outline: 2px solid #E69F00; outline-offset: 2px; }
"""


@contextmanager
def framed(session: Session, address: str) -> Iterator[Complaint]:
    """Give the page of a room, with the way to the others above it, and its line for errors."""
    title, _ = ROOMS[address]
    ui.page_title(f"{title} · hotlever")
    ui.add_css(_STYLE)
    ui.colors(primary="#0072B2", negative="#D55E00", positive="#009E73", warning="#E69F00")
    dark = ui.dark_mode(session.chosen.get("dark", False))

    def switch() -> None:
        dark.value = session.chosen["dark"] = not dark.value

    with ui.header().classes("items-center q-py-xs no-wrap").props("role=banner"):
        ui.label("hotlever").classes("text-bold text-lg q-mr-md")
        with ui.element("nav").classes("row no-wrap").props('aria-label="Rooms"'):
            for other, (name, icon) in ROOMS.items():
                here = other == address
                link = ui.button(name, icon=icon, on_click=lambda _, to=other: ui.navigate.to(to))
                link.props(f"flat dense no-caps color=white {'aria-current=page' if here else ''}")
                link.classes("q-px-sm" + (" bg-white/25" if here else ""))
        ui.space()
        ui.label(str(session.project.folder)).classes("text-xs ellipsis gt-sm")
        undo_button(session)
        ui.button(icon="contrast", on_click=switch).props(
            'flat dense color=white aria-label="Light or dark"'
        )
    if session.remark:
        remark = session.remark.replace(f"{session.project.folder}/", "")
        ui.label(remark).classes("text-sm remark w-full").props("role=status")
        session.remark = ""
    yield Complaint(str(session.project.folder))


class Complaint:
    """The line in which a room says what is wrong; empty and hidden while nothing is.

    Files of the project's folder are named without it.
    """

    def __init__(self, folder: str) -> None:
        self._folder = folder
        self._label = ui.label().classes("complaint w-full").props("role=alert")
        self.clear()

    def clear(self) -> None:
        """Say nothing."""
        self.say("")

    def say(self, text: str) -> None:
        """Say what is wrong."""
        self._label.set_text(text.replace(f"{self._folder}/", ""))
        self._label.set_visibility(bool(text))

    @contextmanager
    def caught(self) -> Iterator[None]:
        """Say what goes wrong in the block."""
        self.clear()
        try:
            yield
        except HotleverError as error:
            self.say(str(error))


@contextmanager
def two_columns() -> Iterator[tuple[ui.column, ui.column]]:
    """Give a narrow column for what is set and a wide one for what comes out."""
    with ui.row().classes("w-full items-start"):
        left = ui.column().classes("controls gap-3")
        right = ui.column().classes("results gap-3")
        yield left, right


def drop_zone(
    session: Session,
    complaint: Complaint,
    label: str,
    then: Callable[[list[str]], Awaitable[None]],
    folder: str = "",
) -> ui.upload:
    """Show where files are dropped; they are kept in the project, then handed on by name."""

    async def taken(event: events.MultiUploadEventArguments) -> None:
        with complaint.caught():
            names = []
            with session.project.changes.recorded(f"dropped {_several(event.files)}"):
                for file in event.files:
                    names.append(session.project.take(file.name, await file.read(), folder))
            await then(names)

    zone = ui.upload(
        multiple=True,
        auto_upload=True,
        label=label,
        max_file_size=LARGEST_FILE,
        on_multi_upload=taken,
        on_rejected=lambda: complaint.say(
            f"a file may have {LARGEST_FILE // 2**20} MB at most: this one was not taken"
        ),
    ).props(f'flat bordered aria-label="{label}"')
    # others may be on their way
    zone.on("uploaded", lambda: zone.run_method("removeUploadedFiles"), args=[])
    return zone


def _several(files: Sequence[Any]) -> str:
    more = f" and {len(files) - 1} more" if len(files) > 1 else ""
    return f"{safe_name(files[0].name)}{more}" if files else ""


async def asked(question: str, yes: str, no: str) -> bool:
    """Ask something, and wait for the answer; whoever closes the question says no."""
    with ui.dialog() as dialog, ui.card():
        ui.label(question).classes("remark")
        with ui.row().classes("w-full justify-end"):
            ui.button(no, on_click=lambda: dialog.submit(False)).props("no-caps autofocus")
            ui.button(yes, on_click=lambda: dialog.submit(True)).props("outline no-caps")
    answer = bool(await dialog)
    dialog.delete()
    return answer


async def hand_over(made: Awaitable[bytes], name: str) -> None:
    """Give a file when it is made, be the button that asked for it gone by then."""
    client = ui.context.client
    content = await made
    with client:
        ui.download.content(content, name)


class Work:
    """The command that runs in a room, or ran last: progress, notes, its line, and cancelling.

    Parameters
    ----------
    session : Session
    room : str
    then : callable
        Called with the job when it has ended while the page is open.
    during : callable, optional
        Called with the job whenever there is something new of it.
    notes : bool
        Whether what the command notes is shown here, and not with its result.
    """

    def __init__(
        self,
        session: Session,
        room: str,
        then: Callable[[Job], Awaitable[None]],
        *,
        during: Callable[[Job], None] | None = None,
        notes: bool = True,
    ) -> None:
        self._session, self._room, self._then, self._during = session, room, then, during
        self._seen: tuple[int, int] = (0, -1)
        self._hidden: Job | None = None
        with ui.column().classes("w-full gap-1") as self._all:
            with ui.row().classes("w-full items-center no-wrap") as self._running:
                self._bar = ui.linear_progress(show_value=False, size="10px").props("rounded")
                self._text = ui.label().classes("text-xs no-wrap").props("aria-live=polite")
                ui.button("Cancel", on_click=self._cancel).props("dense outline color=negative")
            self._message = ui.label().classes("complaint w-full").props("role=alert")
            self._notes = ui.column().classes("w-full gap-0 text-sm remark")
            self._notes.set_visibility(notes)
        ended = self._job is not None and self._job.standing != "running"
        self._told = id(self._job) if ended else 0
        self._look()
        ui.timer(_LOOK_S, self._tell)

    @property
    def _job(self) -> Job | None:
        return self._session.jobs.by_room.get(self._room)

    def hide(self) -> None:
        """Show nothing more of a command that has ended: something else is shown now."""
        if self._job is not None and self._job.standing != "running":
            self._hidden = self._job
            self._look()

    async def _cancel(self) -> None:
        await self._session.jobs.cancel(self._room)
        self._look()

    async def _tell(self) -> None:
        self._look()
        job = self._job
        if job is not None and job.standing != "running" and self._told != id(job):
            self._told = id(job)
            await self._then(job)

    def _look(self) -> None:
        job = self._job
        self._all.set_visibility(job is not None and job is not self._hidden)
        if job is None:
            return
        running = job.standing == "running"
        self._running.set_visibility(running)
        if running:
            self._bar.props(remove="indeterminate") if job.share else self._bar.props(
                "indeterminate"
            )
            self._bar.set_value(job.share or 0.0)
            left = job.left_s
            more = "" if left is None else f", some {max(1.0, left):.0f} s left"
            self._text.set_text(f"{job.label or 'starting'}{more}")
        if self._seen == (id(job), job.version):
            return
        self._seen = (id(job), job.version)
        words = "cancelled: nothing was written" if job.standing == "cancelled" else job.message
        self._message.set_text("" if running else words)
        self._message.set_visibility(not running and bool(words))
        self._notes.clear()
        with self._notes:
            for text in job.notes:
                ui.label(f"• {text}")
        if self._during is not None:
            self._during(job)


def command_shown(arguments: list[str], folder: str) -> None:
    """Show the command line that does the same, to be copied."""
    _lines_shown(command_line(arguments), "Copy the command line")
    ui.label(f"The same on the command line, in {folder}").classes("text-xs opacity-70")


def python_shown(lines: str) -> None:
    """Show the lines of Python that do the same, to be copied."""
    _lines_shown(lines, "Copy the lines of Python")
    ui.label("The same in Python").classes("text-xs opacity-70")


def _lines_shown(lines: str, copy: str) -> None:
    with ui.row().classes("w-full items-start no-wrap gap-1"):
        with ui.element("pre").classes("command col"):
            ui.label(lines)
        ui.button(icon="content_copy", on_click=lambda: ui.clipboard.write(lines)).props(
            f'flat dense aria-label="{copy}"'
        )


def number_shown(key: str, title: str, value: str = "…") -> ui.label:
    """Show a number with its title; return the label of the number."""
    with ui.column().classes("gap-0"):
        ui.label(title).classes("text-xs opacity-70")
        return ui.label(value).classes("number").props(f'data-number="{key}"')


def figure(content: str, alt: str, *, wide: bool = False) -> None:
    """Show an SVG figure: as an image it may hold texts from files, but no script of them runs."""
    source = f"data:image/svg+xml;base64,{b64encode(content.encode()).decode('ascii')}"
    with ui.element("div").classes("paper wide w-full" if wide else "paper"):
        image = ui.element("img")
        image.props["src"], image.props["alt"] = source, alt


def table(columns: Sequence[str], rows: Sequence[Sequence[Any]], **kept: Any) -> ui.table:
    """Show rows of texts; cells are escaped by the browser's own table."""
    names = [str(place) for place in range(len(columns))]
    head = [
        {"name": name, "label": label, "field": name, "align": "left"}
        for name, label in zip(names, columns, strict=True)
    ]
    body = [{"id": number, **dict(zip(names, row, strict=True))} for number, row in enumerate(rows)]
    return (
        ui.table(columns=head, rows=body, row_key="id", **kept)
        .classes("w-full")
        .props("dense flat bordered")
    )
