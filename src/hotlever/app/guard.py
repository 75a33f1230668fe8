"""Who may talk to the app: this user's browser, by a token that becomes a cookie, or a password."""

from __future__ import annotations

import asyncio
import hmac
import secrets
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

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


class Guard:
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
        headers = {name.lower(): value for name, value in scope["headers"]}
        refused = self._refused(scope, headers)
        if refused is None:
            out = send if scope["type"] == "websocket" else _with_headers(send)
            await self._app(scope, self._limited(receive), out)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 4403})
        else:
            await self._answer(scope, receive, _with_headers(send), refused)

    def _refused(self, scope: Any, headers: dict[bytes, bytes]) -> tuple[int, str] | None:
        """Return status and reason for refusing a request."""
        host = headers.get(b"host", b"").decode("latin-1")
        if _name(host) not in self._hosts:
            return 421, "This is not the address that `hotlever app` printed."
        origin = headers.get(b"origin", b"").decode("latin-1")
        if origin and urlsplit(origin).netloc != host:
            return 403, "Another page may not use this one."
        length = headers.get(b"content-length", b"0")
        if not length.isdigit() or int(length) > self._largest:
            return 413, f"A file may have {self._largest // 2**20} MB at most."
        if self._is_known(headers.get(b"cookie", b"").decode("latin-1")):
            return None
        return 401, _REFUSED

    def _is_known(self, text: str) -> bool:
        try:
            cookie = SimpleCookie(text).get(self._cookie)
        except CookieError:
            return False
        return cookie is not None and _same(cookie.value, self._token)

    async def _answer(self, scope: Any, receive: Any, send: Any, refused: tuple[int, str]) -> None:
        """Give the cookie to whoever has the token or the password; refuse others."""
        status, text = refused
        if status == 401:
            query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
            if self._password is None:
                if _same(query.get("token", [""])[0], self._token):
                    await self._let_in(scope, send)
                    return
            elif scope["method"] == "POST" and scope["path"] == "/enter":
                form = parse_qs((await _body(receive)).decode("utf-8", "replace"))
                async with self._one_by_one:  # nobody tries many
                    if _same(form.get("password", [""])[0], self._password):
                        await self._let_in({**scope, "path": "/"}, send)
                        return
                    await asyncio.sleep(_WRONG_S)
                await _respond(send, 401, _ASK % "That was not it.", b"text/html; charset=utf-8")
                return
            else:
                page = _ASK % "Somebody shares this app with you, with a password."
                await _respond(send, 401, page, b"text/html; charset=utf-8")
                return
        await _respond(send, status, text)

    async def _let_in(self, scope: Any, send: Any) -> None:
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict"
        path = scope["path"] if scope["path"].startswith("/") else "/"
        headers = [
            (b"set-cookie", cookie.encode()),
            # with Strict a redirect from elsewhere would not carry the cookie: a page of ours does
            (b"content-type", b"text/html; charset=utf-8"),
        ]
        page = f'<!doctype html><meta http-equiv="refresh" content="0;url={_escaped(path)}">'
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": page.encode()})

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


def _name(host: str) -> str:
    """Return the name of a host without its port."""
    return (urlsplit(f"//{host}").hostname or "").lower()


def _same(given: str, expected: str) -> bool:
    return hmac.compare_digest(given.encode(), expected.encode())


def _escaped(path: str) -> str:
    from urllib.parse import quote

    # two slashes would name another host
    return "/" + quote(path.lstrip("/"))


def _with_headers(send: Any) -> Any:
    async def sent(message: Any) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", []), *_HEADERS]}
        await send(message)

    return sent


async def _body(receive: Any) -> bytes:
    content = b""
    while len(content) <= _PASSWORD_FORM:
        message = await receive()
        content += message.get("body", b"")
        if not message.get("more_body"):
            return content
    return b""


async def _respond(
    send: Any, status: int, text: str, kind: bytes = b"text/plain; charset=utf-8"
) -> None:
    headers = [(b"content-type", kind)]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": text.encode()})
