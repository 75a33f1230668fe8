"""``hotlever app`` on the command line: what it refuses before it serves."""

from __future__ import annotations

import socket
from collections.abc import Callable

import pytest

Run = Callable[..., tuple[int, str, str]]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--host", "0.0.0.0"], "--host: went in 3.0.0"),
        (["--yes-share"], "--yes-share: went in 3.0.0"),
        (["--port", "70000"], "from 0 to 65535"),
        (["file"], "expected a folder"),
        (["--no-brwser"], "No such option"),
    ],
)
def test_it_says_why_it_does_not_start(refused, arguments, message):
    with open("file", "w"):
        pass
    assert message in refused("app", *arguments)


def test_a_port_that_is_taken_is_a_line(refused):
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        line = refused("app", "--port", str(listener.getsockname()[1]))
    assert "cannot be served at" in line
