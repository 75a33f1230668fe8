"""The server of the app: who may talk to it, its pages, its start and its end."""

from __future__ import annotations

import asyncio
import hmac
import logging
import secrets
import socket
from collections.abc import Awaitable, Callable
from typing import Any
from urllib.parse import quote, urlsplit

from fastapi.requests import HTTPConnection
from fastapi.responses import HTMLResponse, PlainTextResponse, Response
from nicegui import app, background_tasks, ui

from hotlever.app.pages.contact_page import ContactPage
from hotlever.app.pages.lever_page import LeverPage
from hotlever.app.pages.measurements import MeasurementsPage
from hotlever.app.pages.raman_page import RamanPage
from hotlever.app.pages.reader_page import ReaderPage
from hotlever.app.pages.simulate import SimulatePage
from hotlever.app.pages.start import StartPage, serve_pictures
from hotlever.app.project import LARGEST_FILE, Project
from hotlever.app.session import Session
from hotlever.errors import InputError
from hotlever.work import give_back


def serve(
    project: Project,
    *,
    port: int,
    browser: bool,
    say: Callable[[str], None],
    failed: Callable[[BaseException], None],
) -> None:
    """Serve a project to this machine until Ctrl-C.

    Parameters
    ----------
    project : Project
    port : int
        0 takes one that is free.
    browser : bool
        Whether the address is opened.
    say, failed : callable
        Told the address, and what nobody foresaw.

    Raises
    ------
    InputError
        If the port is taken.
    """
    host = "127.0.0.1"
    port = _free(host, port)
    token = secrets.token_urlsafe(24)
    address = f"http://{host}:{port}/?token={token}"
    session = Session(project)
    app.on_startup(session.start)
    app.on_startup(lambda: say(address))
    # pages that were closed leave memory behind
    app.on_startup(lambda: app.timer(20.0, give_back))
    # told in one line, and kept in a file, as by any command
    logging.getLogger("nicegui").setLevel(logging.CRITICAL + 1)
    app.on_exception(failed)
    add_pages(session)
    app.add_middleware(Access, token=token, largest=LARGEST_FILE)
    # kept for a page whose connection was lost, pictures of the map among them; with more it is
    # opened anew
    ui.run(
        host=host,
        port=port,
        title="hotlever",
        favicon="🌡",
        dark=False,
        reload=False,
        show=f"/?token={token}" if browser else False,
        show_welcome_message=False,
        reconnect_timeout=30.0,
        message_history_length=100,
    )


def add_pages(session: Session) -> None:
    """Make all pages."""
    serve_pictures()
    live = SimulatePage, ContactPage, ReaderPage
    for kind in (StartPage, LeverPage, *live, RamanPage, MeasurementsPage):
        # a busy machine may take long to build a page; an error is shown then in its place
        ui.page(f"/{kind.name}", response_timeout=60.0)(_page(session, kind.fill))


def _page(session: Session, fill: Callable[[Session], Awaitable[None]]) -> Any:
    async def page() -> None:
        client = ui.context.client

        async def filled() -> None:
            try:
                with client:
                    await fill(session)
            except RuntimeError:
                # a page that was closed before it was filled has lost its elements
                if not client.is_deleted:
                    raise

        # what waits for a busy process comes later: a page that is late is none
        task = background_tasks.create(filled(), name="page")
        await asyncio.wait({task}, timeout=1.0)

    return page


def _free(host: str, port: int) -> int:
    """Return the port to serve at."""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
            return int(probe.getsockname()[1])
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"--port {port}: cannot be served at ({reason})") from None


class Access:
    """An ASGI application around the app, which lets through whom it knows.

    Parameters
    ----------
    app : ASGI application
    token : str
        In the address that is printed; a cookie afterwards.
    largest : int
        Bytes that a file may have.
    """

    def __init__(self, app: Any, token: str, largest: int) -> None:
        self._app, self._token, self._largest = app, token, largest
        # ports of one machine share their cookies: another app has another name
        self._cookie = f"hotlever-{secrets.token_hex(4)}"

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Answer a request, or let it through."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        answer = self._answer(HTTPConnection(scope))
        if scope["type"] == "http":
            await (answer or self._app)(scope, receive, _with_headers(send))
        elif answer is None:
            await self._app(scope, receive, send)
        else:
            await receive()
            await send({"type": "websocket.close", "code": 4403})

    def _answer(self, request: HTTPConnection) -> Response | None:
        """Return the answer to a request that is not let through."""
        host = request.headers.get("host", "")
        # against pages elsewhere that make a browser ask for another name
        if (urlsplit(f"//{host}").hostname or "").lower() not in ("127.0.0.1", "localhost"):
            return PlainTextResponse("This is not the address that `hotlever app` printed.", 421)
        origin = request.headers.get("origin", "")
        if origin and urlsplit(origin).netloc != host:
            return PlainTextResponse("Another page may not use this one.", 403)
        if "transfer-encoding" in request.headers:
            return PlainTextResponse("A request must say how long it is.", 411)
        length = request.headers.get("content-length", "0")
        # beside its file a form has some text
        if not length.isdigit() or int(length) > self._largest + 2**16:
            megabytes = self._largest // 2**20
            return PlainTextResponse(f"A file may have {megabytes} MB at most.", 413)
        if _same(request.cookies.get(self._cookie, ""), self._token):
            return None
        if _same(request.query_params.get("token", ""), self._token):
            return self._let_in(request.scope["path"])
        return PlainTextResponse(
            "This page needs the whole address that `hotlever app` printed, its token included. "
            "Please open that one.",
            401,
        )

    def _let_in(self, path: str) -> Response:
        # with Strict a redirect from elsewhere would not carry the cookie: a page of ours does;
        # two slashes would name another host
        way = "/" + quote(path.lstrip("/"))
        page = f'<!doctype html><meta http-equiv="refresh" content="0;url={way}">'
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict"
        return HTMLResponse(page, headers={"set-cookie": cookie})


def _same(secret: str, expected: str) -> bool:
    return hmac.compare_digest(secret.encode(), expected.encode())


def _with_headers(send: Any) -> Any:
    # a page may load and talk to this server, nothing else; NiceGUI's Vue compiles templates
    policy = (
        b"default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
        b"style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
        b"connect-src 'self' ws: wss:; object-src 'none'; frame-ancestors 'none'; base-uri 'self'; "
        b"form-action 'self'"
    )
    headers = (
        (b"content-security-policy", policy),
        (b"x-content-type-options", b"nosniff"),
        (b"referrer-policy", b"no-referrer"),
        (b"cross-origin-resource-policy", b"same-origin"),
    )

    async def sent(message: Any) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", []), *headers]}
        await send(message)

    return sent
