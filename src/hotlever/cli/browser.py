"""``hotlever app``: the same in the browser."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import typer

from hotlever.errors import InputError, unforeseen_error
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import argument, option
from hotlever.tasks.texts import check_number

#: Where a password may stand, that would be seen by others on the command line.
_PASSWORD = "HOTLEVER_APP_PASSWORD"
_LEAST_PASSWORD = 8


@dataclass(kw_only=True)
class AppRequest:
    """Open a page in your browser in which files are dropped and sliders moved."""

    folder: Path = argument(
        Path(), metavar="[FOLDER]", help="The project: its files are those of the command line."
    )
    host: str = option("127.0.0.1", help="Address to serve at; others need --yes-share.")
    port: int = option(0, help="Port to serve at; a free one if left out.")
    yes_share: bool = option(
        False, "--yes-share", help="Let others in, who know the password that is asked for."
    )
    no_browser: bool = option(False, "--no-browser", help="Print the address only.")


def open_app(reporter: Reporter, request: AppRequest) -> None:
    """Serve a project until Ctrl-C."""
    try:
        import nicegui  # noqa: F401
    except ImportError:
        raise InputError("the app is an extra: pip install 'hotlever[app]'") from None
    from hotlever.app.project import Project
    from hotlever.app.server import LOCAL, serve

    check_number("--port", request.port, 0, 65535)
    password = None
    if request.host not in LOCAL:
        if not request.yes_share:
            raise InputError(
                f"--host {request.host}: others could reach your files; add --yes-share if they "
                "should"
            )
        password = os.environ.get(_PASSWORD) or _ask_password()
        if len(password) < _LEAST_PASSWORD:
            raise InputError(
                f"{_PASSWORD}: a password of {len(password)} characters, expected "
                f"{_LEAST_PASSWORD} or more"
            )

    def say(address: str) -> None:
        reporter.tell(f"hotlever app: {address}  (Ctrl-C ends it)")

    def failed(error: BaseException) -> None:
        reporter.fail(unforeseen_error(error, ["app", str(request.folder)]))

    serve(
        Project(request.folder),
        host=request.host,
        port=request.port,
        password=password,
        browser=not request.no_browser,
        say=say,
        failed=failed,
    )


def _ask_password() -> str:
    """Ask for a password."""
    if sys.stdin is None or not sys.stdin.isatty():
        raise InputError(f"--yes-share: expected a password in {_PASSWORD}, or a terminal")
    what = "Password for those who may come in"
    return str(typer.prompt(what, hide_input=True, confirmation_prompt=True, err=True))
