"""The same in the browser: ``hotlever app`` serves a page to one user on their own machine.

Nothing is computed here. Commands run in processes of their own, exactly as the command line runs
them; what a slider moves is read from a lever in another process (`live`). `project` is the folder
that both share with the command line, and the record of all that was done: what a page writes is a
new file in it. `pages` is what is shown.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from hotlever.errors import InputError, unforeseen_error
from hotlever.tasks.arguments import Reporter, refuse
from hotlever.tasks.parsing import check_number


def open_app(
    reporter: Reporter,
    folder: Path = Path(),
    *,
    port: int = 0,
    no_browser: bool = False,
    host: Annotated[str | None, Option(hidden=True)] = None,
    yes_share: Annotated[bool, Option("--yes-share", hidden=True)] = False,
) -> None:
    """Open a page in your browser in which files are dropped and sliders moved.

    Parameters
    ----------
    folder : [FOLDER]
        The project: its files are those of the command line.
    port
        Port to serve at; a free one if left out.
    no_browser
        Print the address only.
    """
    try:
        import nicegui  # noqa: F401
    except ImportError:
        raise InputError("the app is an extra: pip install 'hotlever[app]'") from None
    from hotlever.app.project import Project
    from hotlever.app.server import serve

    gone = "went in 3.0.0: the app is for this machine (from another, ssh -L PORT:127.0.0.1:PORT)"
    refuse(gone, host=host, yes_share=yes_share)
    check_number("--port", port, 0, 65535)

    def say(address: str) -> None:
        reporter.tell(f"hotlever app: {address}  (Ctrl-C ends it)")

    def failed(error: BaseException) -> None:
        reporter.fail(unforeseen_error(error, ["app", str(folder)]))

    serve(Project(folder), port=port, browser=not no_browser, say=say, failed=failed)
