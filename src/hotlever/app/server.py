"""The server of the app: who may talk to it, its pages, its start and its end."""

from __future__ import annotations

import asyncio
import hmac
import logging
import secrets
import socket
from collections.abc import Awaitable, Callable
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

from fastapi.requests import HTTPConnection, Request
from fastapi.responses import HTMLResponse, PlainTextResponse, Response
from nicegui import app, background_tasks, ui

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
#: What a page may load and talk to: this server, nothing else. NiceGUI's Vue compiles templates.
_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "connect-src 'self' ws: wss:; object-src 'none'; frame-ancestors 'none'; base-uri 'self'; "
    "form-action 'self'"
)
_HEADERS = (
    (b"content-security-policy", _POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
#: Bytes that the rest of a form takes beside its file, and those of the form of a password.
_FORM, _PASSWORD_FORM = 2**16, 4096
#: Seconds that a wrong password takes to be refused.
_WRONG_S = 1.0

_REFUSED = (
    "This page needs the whole address that `hotlever app` printed, its token included. "
    "Please open that one."
)
_ASK = """<!doctype html><html lang="en"><meta charset="utf-8"><title>hotlever</title>
<style>body{font:16px sans-serif;margin:4em auto;max-width:24em}</style>
<h1>hotlever</h1><p>%s</p><form method="post" action="/enter">
<label>Password <input type="password" name="password" autofocus></label>
<button>Open</button></form></html>"""


def serve(
    project: Project,
    *,
    host: str,
    port: int,
    password: str | None,
    browser: bool,
    say: Callable[[str], None],
    failed: Callable[[BaseException], None],
) -> None:
    """Serve a project until Ctrl-C.

    Parameters
    ----------
    project : Project
    host : str
    port : int
        0 takes one that is free.
    password : str or None
        Asked for in place of the token in the address, when others may come.
    browser : bool
        Whether the address is opened.
    say, failed : callable
        Told the address, and what nobody foresaw.

    Raises
    ------
    InputError
        If the port is taken.
    """
    port = _free(host, port)
    token = secrets.token_urlsafe(24)
    url_host = f"[{host}]" if ":" in host else host
    ticket = "" if password else f"?token={token}"
    hosts = {host, *(LOCAL if host in LOCAL else ())}
    if host in ("0.0.0.0", "::"):
        name = socket.gethostname()
        hosts |= {*LOCAL, name.lower(), socket.getfqdn().lower(), *_addresses(name)}
        url_host = name
    address = f"http://{url_host}:{port}/{ticket}"
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
    limits: Any = {"password": password, "largest": LARGEST_FILE}
    app.add_middleware(Access, token=token, hosts=hosts, **limits)
    ui.run(
        host=host,
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


def _free(host: str, port: int) -> int:
    """Return the port to serve at."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
            return int(probe.getsockname()[1])
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"--host {host} --port {port}: cannot be served at ({reason})") from None


def _addresses(name: str) -> set[str]:
    try:
        return {str(address[0]) for *_, address in socket.getaddrinfo(name, None)}
    except OSError:
        return set()


class Access:
    """An ASGI application around the app, which lets through whom it knows.

    Parameters
    ----------
    app : ASGI application
    token : str
        In the address that is printed; a cookie afterwards.
    hosts : set of str
        Names of this server, against pages elsewhere that make a browser ask for another name.
    password : str, optional
        Asked for in place of the token.
    largest : int
        Bytes that a request may have.
    """

    def __init__(
        self, app: Any, token: str, hosts: set[str], password: str | None, largest: int
    ) -> None:
        self._app, self._token, self._hosts = app, token, hosts
        self._password, self._largest = password, largest + _FORM
        self._one_by_one = asyncio.Lock()
        # ports of one machine share their cookies: another app has another name
        self._cookie = f"hotlever-{secrets.token_hex(4)}"

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Answer a request, or let it through."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        refused = self._refused(HTTPConnection(scope))
        if scope["type"] == "websocket":
            if refused is None:
                await self._app(scope, receive, send)
            else:
                await receive()
                await send({"type": "websocket.close", "code": 4403})
            return
        send = _with_headers(send)
        if refused is None:
            await self._app(scope, self._limited(receive), send)
        else:
            if refused.status_code == 401:
                refused = await self._introduced(Request(scope, receive)) or refused
            await refused(scope, receive, send)

    def _refused(self, request: HTTPConnection) -> Response | None:
        """Return the answer to a request that is refused."""
        host = request.headers.get("host", "")
        if (urlsplit(f"//{host}").hostname or "").lower() not in self._hosts:
            return PlainTextResponse("This is not the address that `hotlever app` printed.", 421)
        origin = request.headers.get("origin", "")
        if origin and urlsplit(origin).netloc != host:
            return PlainTextResponse("Another page may not use this one.", 403)
        length = request.headers.get("content-length", "0")
        if not length.isdigit() or int(length) > self._largest:
            megabytes = self._largest // 2**20
            return PlainTextResponse(f"A file may have {megabytes} MB at most.", 413)
        if _same(request.cookies.get(self._cookie, ""), self._token):
            return None
        if self._password is None:
            return PlainTextResponse(_REFUSED, 401)
        return HTMLResponse(_ASK % "Somebody shares this app with you, with a password.", 401)

    async def _introduced(self, request: Request) -> Response | None:
        """Return the answer to who brings the token or a password."""
        if self._password is None:
            is_token = _same(request.query_params.get("token", ""), self._token)
            return self._let_in(request.scope["path"]) if is_token else None
        if (request.method, request.scope["path"]) != ("POST", "/enter"):
            return None
        content = b""
        async for part in request.stream():
            content += part
            if len(content) > _PASSWORD_FORM:
                break
        password = parse_qs(content.decode("utf-8", "replace")).get("password", [""])[0]
        async with self._one_by_one:  # nobody tries many
            if _same(password, self._password):
                return self._let_in("/")
            await asyncio.sleep(_WRONG_S)
        return HTMLResponse(_ASK % "That was not it.", 401)

    def _let_in(self, path: str) -> Response:
        # with Strict a redirect from elsewhere would not carry the cookie: a page of ours does;
        # two slashes would name another host
        way = "/" + quote(path.lstrip("/"))
        page = f'<!doctype html><meta http-equiv="refresh" content="0;url={way}">'
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict"
        return HTMLResponse(page, headers={"set-cookie": cookie})

    def _limited(self, receive: Any) -> Any:
        """Count what comes in, for requests that do not say how much it will be."""
        seen = 0

        async def counted() -> Any:
            nonlocal seen
            message = await receive()
            if message["type"] == "http.request":
                seen += len(message.get("body", b""))
                if seen > self._largest:
                    return {"type": "http.disconnect"}
            return message

        return counted


def _same(secret: str, expected: str) -> bool:
    return hmac.compare_digest(secret.encode(), expected.encode())


def _with_headers(send: Any) -> Any:
    async def sent(message: Any) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", []), *_HEADERS]}
        await send(message)

    return sent
