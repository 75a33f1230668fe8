"""The server of the app: who may talk to it, its pages, its start and its end."""

from __future__ import annotations

import asyncio
import logging
import secrets
import socket
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from nicegui import app, background_tasks, ui

from hotlever.app.access import Access
from hotlever.app.pages.calibrate import CalibratePage
from hotlever.app.pages.contact import ContactPage
from hotlever.app.pages.design import DesignPage
from hotlever.app.pages.fit import FitPage
from hotlever.app.pages.lever import LeverPage
from hotlever.app.pages.levers import LeversPage
from hotlever.app.pages.materials import MaterialsPage
from hotlever.app.pages.raman import RamanPage
from hotlever.app.pages.reader import ReaderPage
from hotlever.app.pages.simulate import SimulatePage
from hotlever.app.pages.start import StartPage, serve_pictures
from hotlever.app.project import LARGEST_FILE, Project
from hotlever.app.session import Session
from hotlever.errors import InputError
from hotlever.memory import give_back

#: Seconds after which the memory of pages that were closed is given back, again and again.
_GIVE_BACK_S = 20.0
#: Seconds after which what was chosen is kept, if it has changed.
_KEEP_S = 1.0
#: Messages kept for a page whose connection was lost, pictures of the map among them; with more it
#: is opened anew.
_MESSAGES = 100
#: Seconds after which a page is shown with what it has by then.
_SOON_S = 1.0
#: Seconds that a busy machine may take to build a page; an error is shown then in its place.
_LATE_S = 60.0
LOCAL = ("127.0.0.1", "localhost", "::1")
_PAGES = (
    *(StartPage, LeverPage, SimulatePage, ContactPage, ReaderPage, DesignPage),
    *(MaterialsPage, RamanPage, FitPage, CalibratePage, LeversPage),
)


@dataclass(frozen=True)
class Served:
    """Where the app is served, and to whom.

    Attributes
    ----------
    host : str
    port : int
        0 takes one that is free.
    password : str or None
        Asked for in place of the token in the address, when others may come.
    """

    host: str = "127.0.0.1"
    port: int = 0
    password: str | None = None


def serve(
    project: Project,
    served: Served,
    browser: bool,
    say: Callable[[str], None],
    failed: Callable[[BaseException], None],
) -> None:
    """Serve a project until Ctrl-C.

    `say` is told the address, `failed` what nobody foresaw.

    Raises
    ------
    InputError
        If the port is taken.
    """
    port = _free(served)
    token = secrets.token_urlsafe(24)
    shown = f"[{served.host}]" if ":" in served.host else served.host
    ticket = "" if served.password else f"?token={token}"
    hosts = {served.host, *(LOCAL if served.host in LOCAL else ())}
    if served.host in ("0.0.0.0", "::"):
        name = socket.gethostname()
        hosts |= {*LOCAL, name.lower(), socket.getfqdn().lower(), *_addresses(name)}
        shown = name
    address = f"http://{shown}:{port}/{ticket}"
    session = Session(project)
    app.on_startup(session.start)
    app.on_startup(lambda: say(address))
    app.on_startup(lambda: app.timer(_GIVE_BACK_S, give_back))
    app.on_startup(lambda: app.timer(_KEEP_S, session.keep))
    app.on_shutdown(session.keep)
    # told in one line, and kept in a file, as by any command
    logging.getLogger("nicegui").setLevel(logging.CRITICAL + 1)
    app.on_exception(failed)
    add_pages(session)
    limits: Any = {"password": served.password, "largest": LARGEST_FILE}
    app.add_middleware(Access, token=token, hosts=hosts, **limits)
    ui.run(
        host=served.host,
        port=port,
        title="hotlever",
        favicon="🌡",
        dark=False,
        reload=False,
        show=f"/{ticket}" if browser else False,
        show_welcome_message=False,
        reconnect_timeout=30.0,
        message_history_length=_MESSAGES,
    )


def add_pages(session: Session) -> None:
    """Make all pages."""
    serve_pictures()
    for kind in _PAGES:
        ui.page(f"/{kind.name}", response_timeout=_LATE_S)(_page(session, kind.fill))


def _page(session: Session, fill: Callable[[Session], Awaitable[None]]) -> Any:
    async def page() -> None:
        client = ui.context.client

        async def filled() -> None:
            session.keep()  # what led here, as a step of its own
            try:
                with client:
                    await fill(session)
                session.settle()
            except RuntimeError:
                # a page that was closed before it was filled has lost its elements
                if not client.is_deleted:
                    raise

        # what waits for a busy process comes later: a page that is late is none
        task = background_tasks.create(filled(), name="page")
        await asyncio.wait({task}, timeout=_SOON_S)

    return page


def _free(served: Served) -> int:
    """Return the port to serve at."""
    family = socket.AF_INET6 if ":" in served.host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((served.host, served.port))
            return int(probe.getsockname()[1])
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"--host {served.host} --port {served.port}: cannot be served at ({reason})"
        ) from None


def _addresses(name: str) -> set[str]:
    try:
        return {str(address[0]) for *_, address in socket.getaddrinfo(name, None)}
    except OSError:
        return set()
