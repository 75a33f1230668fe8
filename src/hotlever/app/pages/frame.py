"""What every page has: the frame with the way to the others, its error banner, places for files."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from nicegui import events, ui

from hotlever.app import showing
from hotlever.app.project import LARGEST_FILE
from hotlever.app.session import Session
from hotlever.errors import HotleverError

#: Pages by their names: title and icon.
PAGES = {
    "": ("Start", "home"),
    "lever": ("Lever", "architecture"),
    "simulate": ("Simulate", "tune"),
    "contact": ("Contact", "south"),
    "reader": ("Reader", "height"),
    "raman": ("Raman", "thermostat"),
    "measurements": ("Measurements", "query_stats"),
}


def look_alike() -> None:
    """Have all elements of a kind look alike."""
    ui.button.default_props("no-caps")
    for field in (ui.input, ui.number, ui.select):
        field.default_props("dense outlined")
    ui.expansion.default_props("dense").default_classes("w-full")
    ui.toggle.default_props("no-caps dense unelevated")
    for box in (ui.checkbox, ui.switch):
        box.default_props("dense")


@contextmanager
def framed(session: Session, page: str) -> Iterator[ErrorBanner]:
    """Give a page, with the way to the others above it, and its error banner."""
    title, _ = PAGES[page]
    look_alike()
    ui.page_title(f"{title} · hotlever")
    ui.add_css(Path(__file__).with_name("style.css"))
    ui.colors(primary="#0072B2")
    dark = ui.dark_mode(session.dark)

    def switch() -> None:
        dark.value = session.dark = not dark.value

    with ui.header().classes("items-center q-py-xs no-wrap").props("role=banner"):
        with flat_button(title, None, icon="menu", label=f"Pages: {title}") as menu, ui.menu():
            for other, (name, _) in PAGES.items():
                ui.menu_item(name, partial(ui.navigate.to, f"/{other}"))
        menu.props("color=white").classes("lt-md")
        ui.label("hotlever").classes("text-bold text-lg q-mr-md gt-sm")
        with ui.element("nav").classes("row no-wrap shrink-0 gt-sm").props('aria-label="Pages"'):
            for other, (name, icon) in PAGES.items():
                here = other == page
                link = ui.button(name, icon=icon, on_click=partial(ui.navigate.to, f"/{other}"))
                link.props(f"flat dense color=white {'aria-current=page' if here else ''}")
                link.classes("q-px-sm" + (" bg-black/25" if here else ""))
        ui.space()
        ui.label(str(session.project.folder)).classes("text-xs ellipsis gt-md")
        contrast = flat_button("", switch, icon="contrast", label="Light or dark")
        contrast.props("color=white").tooltip("Light or dark")
    yield ErrorBanner(str(session.project.folder))


class ErrorBanner:
    """The line in which a page says what is wrong; empty and hidden while nothing is.

    Files of the project's folder are named without it.
    """

    def __init__(self, folder: str) -> None:
        self._folder = folder
        self._label = ui.label().classes("banner w-full").props("role=alert")
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
def two_columns(style: str = "") -> Iterator[tuple[ui.column, ui.column]]:
    """Give a narrow column for what is set and a wide one for what comes out; see style.css."""
    with ui.row().classes(f"w-full items-start {style}"):
        left = ui.column().classes("controls gap-3")
        right = ui.column().classes("results gap-3")
        yield left, right


# --- files ----------------------------------------------------------------------------------------


def drop_zone(
    session: Session,
    banner: ErrorBanner,
    label: str,
    then: Callable[[list[str]], Awaitable[None]],
    folder: str = "",
) -> ui.upload:
    """Show where files are dropped; they are kept in the project, then handed on by name."""

    async def take(event: events.MultiUploadEventArguments) -> None:
        with banner.caught():
            names = [
                session.project.take(file.name, await file.read(), folder) for file in event.files
            ]
            await then(names)

    # the web server remembers its last 4096 routes, of which a drop zone is one: what it holds of
    # a page goes when the page is closed
    takers = [take]
    ui.context.client.on_delete(takers.clear)

    async def handle_upload(event: events.MultiUploadEventArguments) -> None:
        for taker in takers:
            await taker(event)

    zone = ui.upload(
        multiple=True,
        auto_upload=True,
        label=label,
        max_file_size=LARGEST_FILE,
        on_multi_upload=handle_upload,
        on_rejected=lambda: banner.say(
            f"a file may have {LARGEST_FILE // 2**20} MB at most: this one was not taken"
        ),
    ).props(f'flat bordered aria-label="{label}"')
    # others may be on their way
    zone.on("uploaded", lambda: zone.run_method("removeUploadedFiles"), args=[])
    return zone


async def say_refused(
    session: Session, banner: ErrorBanner, names: list[str], *, spectra: bool
) -> None:
    """Say which of some files are no measurements, or no spectra; they stay in the folder."""
    lines = await session.ask("full", showing.refused, names, spectra)
    named = 5
    more = f"\nand {len(lines) - named} more such files" if len(lines) > named else ""
    banner.say("\n".join(lines[:named]) + more)


async def hand_over(pending_content: Awaitable[bytes], name: str) -> None:
    """Give a file when it is made, be the button that asked for it gone by then."""
    client = ui.context.client
    content = await pending_content
    with client:
        ui.download.content(content, name)


def download_button(session: Session, name: str, label: str) -> None:
    """Offer a file of the project, if it is there."""
    if session.project.stamp(name):
        path = session.project.path(name)
        small_button(label, lambda: ui.download.file(path), icon="download")


# --- elements -------------------------------------------------------------------------------------


def small_button(text: str, click: Any, icon: str | None = None, label: str = "") -> ui.button:
    """Show a small button with a frame; `label` is what it says to who cannot see it."""
    button = ui.button(text, icon=icon, on_click=click).props("outline dense").classes("q-px-sm")
    return button.props(f'aria-label="{_attribute(label)}"') if label else button


def flat_button(text: str, click: Any, icon: str | None = None, label: str = "") -> ui.button:
    """Show a small button without a frame."""
    button = ui.button(text, icon=icon, on_click=click).props("flat dense")
    return button.props(f'aria-label="{_attribute(label)}"') if label else button


def _attribute(text: str) -> str:
    """Return a text that may stand in a property."""
    return text.replace("\\", "/").replace('"', "'")


def caption(text: str) -> ui.label:
    """Show a line in small print."""
    return ui.label(text).classes("text-xs opacity-70")


def lines_shown(lines: str, kind: str, what: str) -> None:
    """Show a command line, or lines of Python, to be copied; with what they do."""
    with ui.row().classes("w-full items-start no-wrap gap-1"):
        with ui.element("pre").classes("command col"):
            ui.label(lines)
        copy = partial(ui.clipboard.write, lines)
        flat_button("", copy, icon="content_copy", label=f"Copy the {kind}")
    caption(what).classes("remark")


def text_shown(text: str) -> None:
    """Show a text as one would on a terminal: its tables scroll, other lines are broken."""
    lines = filter(str.strip, text.split("\n"))
    for is_table, part in groupby(lines, lambda line: "  " in line.strip()):
        for paragraph in ["\n".join(part)] if is_table else part:
            ui.label(paragraph).classes(f"w-full {'lines tabular' if is_table else 'remark'}")


def number_shown(key: str, title: str, value: str = "…") -> ui.label:
    """Show a number with its title; return the label of the number."""
    with ui.column().classes("gap-0"):
        caption(title)
        return ui.label(value).classes("number").props(f'data-number="{key}"')


def figure(content: str | bytes, alt: str, *, wide: bool = False) -> None:
    """Show an SVG figure or a GIF: an image may hold texts from files, but no script of it runs."""
    kind, data = ("gif", content) if isinstance(content, bytes) else ("svg+xml", content.encode())
    source = f"data:image/{kind};base64,{b64encode(data).decode('ascii')}"
    with ui.element("div").classes("paper wide w-full" if wide else "paper"):
        image = ui.element("img")
        image.props["src"], image.props["alt"] = source, alt


def table(
    columns: Sequence[str],
    rows: Sequence[Sequence[Any]],
    chosen: Callable[[str], Any] | None = None,
    **options: Any,
) -> ui.table:
    """Show rows of texts; cells are escaped by the browser's own table.

    The first of each is a button if something is to follow when a row is `chosen` by it.
    """
    names = [str(number) for number in range(len(columns))]
    head = [
        {"name": name, "label": label, "field": name, "align": "left"}
        for name, label in zip(names, columns, strict=True)
    ]
    body = [{"id": number, **dict(zip(names, row, strict=True))} for number, row in enumerate(rows)]
    element = ui.table(columns=head, rows=body, row_key="id", **options)
    if chosen is not None:
        element.add_slot(
            "body-cell-0",
            '<q-td :props="props"><q-btn flat dense no-caps color="primary" :label="props.value" '
            "@click=\"$parent.$emit('chosen', props.value)\" /></q-td>",
        )
        element.on("chosen", lambda event: chosen(event.args))
    return element.classes("w-full").props("dense flat bordered")


# --- dialogs --------------------------------------------------------------------------------------


@contextmanager
def opened_dialog(title: str, width: str) -> Iterator[tuple[ui.dialog, ui.row]]:
    """Open a dialog with a title and a way out of it; give it, and the row of its title.

    It goes when it is closed; when its tab is closed first, it has gone with that.
    """
    dialog = ui.dialog(value=True).props(f'aria-label="{_attribute(title)}"')
    with dialog, ui.card().classes("w-full").style(f"max-width: {width}"):
        with ui.row().classes("w-full items-center no-wrap"):
            ui.label(title).classes("text-lg text-bold col")
            buttons = ui.row()
            flat_button("", dialog.close, icon="close", label="Close")
        yield dialog, buttons
    dialog.on("hide", lambda: None if dialog.is_deleted else dialog.delete())
