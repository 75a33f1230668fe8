"""``hotlever app``: the same in the browser."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hotlever.errors import InputError, unforeseen_error
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import Request, argument, option
from hotlever.tasks.texts import check_number


@dataclass(kw_only=True)
class AppRequest(Request):
    """Open a page in your browser in which files are dropped and sliders moved."""

    folder: Path = argument(
        Path(), metavar="[FOLDER]", help="The project: its files are those of the command line."
    )
    port: int = option(0, help="Port to serve at; a free one if left out.")
    no_browser: bool = option(False, "--no-browser", help="Print the address only.")
    host: str | None = option(None, hidden=True)
    yes_share: bool = option(False, "--yes-share", hidden=True)


def open_app(reporter: Reporter, request: AppRequest) -> None:
    """Serve a project until Ctrl-C."""
    try:
        import nicegui  # noqa: F401
    except ImportError:
        raise InputError("the app is an extra: pip install 'hotlever[app]'") from None
    from hotlever.app.project import Project
    from hotlever.app.server import serve

    gone = "went in 3.0.0: the app is for this machine (from another, ssh -L PORT:127.0.0.1:PORT)"
    request.refuse("host", "yes_share", why=gone)
    check_number("--port", request.port, 0, 65535)

    def say(address: str) -> None:
        reporter.tell(f"hotlever app: {address}  (Ctrl-C ends it)")

    def failed(error: BaseException) -> None:
        reporter.fail(unforeseen_error(error, ["app", str(request.folder)]))

    serve(
        Project(request.folder),
        port=request.port,
        browser=not request.no_browser,
        say=say,
        failed=failed,
    )
