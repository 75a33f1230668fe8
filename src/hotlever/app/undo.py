"""The list of what the app wrote into the project, each with the way back."""

from __future__ import annotations

from datetime import datetime
from functools import partial

from nicegui import ui

from hotlever.app.changes import Change
from hotlever.app.session import Session
from hotlever.errors import HotleverError

#: Changes that are listed, and files of each that are named.
_LISTED, _NAMED = 30, 4


def undo_button(session: Session) -> None:
    """Show the button that opens the list."""
    button = ui.button(icon="undo", on_click=lambda: _list(session))
    button.props('flat dense color=white aria-label="Undo"').tooltip("Undo what the app wrote")


def _list(session: Session) -> None:
    changes = session.project.changes.latest(_LISTED)
    with ui.dialog(value=True) as dialog, ui.card().classes("w-full").style("max-width: 46rem"):
        with ui.row().classes("w-full items-center no-wrap"):
            ui.label("What the app wrote").classes("text-lg text-bold col")
            close = ui.button(icon="close", on_click=dialog.close)
            close.props('flat dense aria-label="Close"')
        if changes:
            ui.label(
                "Undo makes these files what they were before, and can be undone too."
            ).classes("text-sm opacity-70")
        else:
            ui.label("Nothing yet in this folder.")
        for change in changes:
            with ui.row().classes("w-full items-center no-wrap"):
                with ui.column().classes("col gap-0"):
                    ui.label(change.what).classes("text-sm remark")
                    ui.label(_files(change)).classes("text-xs opacity-70 remark")
                button = ui.button("Undo", on_click=partial(_undo, session, change))
                button.props(f'outline dense no-caps aria-label="Undo: {_escaped(change.what)}"')
                button.classes("q-px-sm")
    dialog.on("hide", dialog.delete)


def _files(change: Change) -> str:
    """Say when a change was made, and of which files."""
    when = datetime.fromtimestamp(change.time_s).strftime("%Y-%m-%d %H:%M")
    names = [name if kept else f"{name} (new)" for name, kept in change.before.items()]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{when}: {', '.join(names[:_NAMED])}{more}"


def _escaped(text: str) -> str:
    """Return a text that may stand in a property."""
    return text.replace("\\", "/").replace('"', "'")


def _undo(session: Session, change: Change) -> None:
    try:
        session.project.changes.undo(change)
    except HotleverError as error:
        ui.notify(str(error), type="negative")
        return
    # all pages show what is in the files
    ui.navigate.reload()
