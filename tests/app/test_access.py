"""Who may talk to the app."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from hotlever.app.server import Access

TOKEN, LARGEST = "t0ken", 1000


def ask(
    path: str = "/",
    query: str = "",
    *,
    gate: Access | None = None,
    body: bytes = b"",
    method: str = "GET",
    kind: str = "http",
    **headers: str,
) -> tuple[int, dict[str, str], bytes]:
    """Send a request to an app behind `Access` that answers 200 with what it was sent."""

    async def app(scope: Any, receive: Any, send: Any) -> None:
        got = b""
        while (message := await receive())["type"] == "http.request":
            got += message.get("body", b"")
            if not message.get("more_body"):
                break
        status = 200 if message["type"] == "http.request" else 499
        await send({"type": "http.response.start", "status": status, "headers": []})
        await send({"type": "http.response.body", "body": got})

    sent: list[Any] = []
    parts = [body[i : i + 300] for i in range(0, len(body), 300)] or [b""]

    async def receive() -> Any:
        part = parts.pop(0)
        return {"type": "http.request", "body": part, "more_body": bool(parts)}

    async def send(message: Any) -> None:
        sent.append(message)

    gate = gate or Access(app, TOKEN, LARGEST)
    gate._app = app
    all_headers = {"host": "127.0.0.1:80", **headers}
    scope = {
        "type": kind,
        "method": method,
        "path": path,
        "query_string": query.encode(),
        "headers": [(n.replace("_", "-").encode(), v.encode()) for n, v in all_headers.items()],
    }
    asyncio.run(gate(scope, receive, send))
    if kind == "websocket":
        return sent[0].get("code", 0), {}, b""
    head = {name.decode(): value.decode() for name, value in sent[0]["headers"]}
    return sent[0]["status"], head, sent[1]["body"]


def gate() -> Access:
    return Access(None, TOKEN, LARGEST)


def test_without_the_token_nothing_is_answered():
    assert ask()[0] == 401
    assert ask(query="token=wrong")[0] == 401
    assert ask("/_nicegui/anything")[0] == 401
    assert ask(kind="websocket")[0] == 4403


def test_the_token_becomes_a_cookie_that_opens_every_page():
    same = gate()
    status, head, page = ask("/fit", f"token={TOKEN}", gate=same)
    assert status == 200
    assert b"url=/fit" in page
    cookie = head["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    status, head, _ = ask("/fit", gate=same, cookie=cookie.split(";")[0])
    assert status == 200
    assert "default-src 'self'" in head["content-security-policy"]
    assert ask("/fit", gate=same, cookie=cookie.split("=")[0] + "=other")[0] == 401


def test_the_way_on_leads_to_no_other_host():
    _, _, page = ask('//evil.com/"><script>', f"token={TOKEN}")
    assert b'url=/evil.com/%22%3E%3Cscript%3E"' in page


def test_other_names_and_pages_elsewhere_are_refused():
    same = gate()
    cookie = ask("/", f"token={TOKEN}", gate=same)[1]["set-cookie"].split(";")[0]
    assert ask(gate=same, cookie=cookie, host="evil.com")[0] == 421
    assert ask(gate=same, cookie=cookie, origin="http://evil.com")[0] == 403
    assert ask(gate=same, cookie=cookie, origin="http://127.0.0.1:81")[0] == 403
    assert ask(gate=same, cookie=cookie, origin="http://127.0.0.1:80")[0] == 200


@pytest.mark.parametrize("length", ["999999999", "-1", "x"])
def test_a_request_that_says_it_is_too_large_is_refused(length):
    assert ask(content_length=length)[0] == 413


def test_a_request_that_does_not_say_how_long_it_is_is_refused():
    assert ask(transfer_encoding="chunked", body=b"1")[0] == 411
