"""What runs in a worker process: functions called from the app, one after the other.

A function is given a `Report` first, by which it tells its progress, then its arguments.
"""

from __future__ import annotations

import gc
import importlib
import io
import os
import queue
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

from hotlever.errors import HotleverError
from hotlever.memory import give_back
from hotlever.types import Progress

#: Seconds without a call after which a process gives back the memory that its last calls freed.
_REST_S = 1.0
#: Modules that a process imports before it is asked for anything, so that it then answers at once.
_READY = (
    *("hotlever.cli.commands", "hotlever.estimation", "hotlever.calibration"),
    *("hotlever.figures", "hotlever.lever", "hotlever.report.fit_pages", "hotlever.raman"),
)


class Report:
    """Tells the app how far the work is; a `Listener` of commands."""

    def __init__(self, connection: _Numbered) -> None:
        self._connection = connection

    def told(self, line: str) -> None:
        """Tell a line."""
        self._connection.send(("said", line))

    def shown(self, what: str, content: Any) -> None:
        """Tell what can be drawn."""
        self._connection.send(("shown", what, content))

    def send(self, kind: str, content: Any) -> None:
        """Send something of what is worked on, ahead of the answer."""
        self._connection.send((kind, content))

    def progressed(self, label: str, done: int, total: int) -> None:
        """Tell how many steps are done."""
        self._connection.send(("progress", label, int(done), int(total)))

    def progress(self, label: str) -> Progress:
        """Return what library functions take as their ``progress``."""
        return partial(self.progressed, label)


class _Numbered:
    """Sends messages with the number of the call that they belong to.

    Who asked may be gone, and somebody else wait for the next answer.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection, self.number = connection, 0

    def send(self, message: tuple[Any, ...]) -> None:
        """Send a message."""
        self._connection.send((self.number, *message))


#: A call: its number, the function, and its arguments.
_Call = tuple[int, str, tuple[Any, ...]]


def serve(connection: Connection) -> None:
    """Answer calls until the app is gone."""
    _quiet()
    calls: queue.Queue[_Call] = queue.Queue()
    threading.Thread(target=_listen, args=(connection, calls), daemon=True).start()
    for name in _READY:
        importlib.import_module(name)
    answers = _Numbered(connection)
    report = Report(answers)
    report.told("ready")
    while True:
        answers.number, name, arguments = _next(calls)
        try:
            answers.send(("done", _function(name)(report, *arguments)))
        except HotleverError as error:
            answers.send(("failed", str(error)))
        except MemoryError:
            answers.send(("failed", "there is too little memory for this"))
        except Exception as error:
            answers.send(("failed", f"internal error: {type(error).__name__}: {error}"))


def _next(calls: queue.Queue[_Call]) -> _Call:
    """Wait for a call; give memory back while there is none."""
    with suppress(queue.Empty):
        return calls.get(timeout=_REST_S)
    gc.collect()
    give_back()
    return calls.get()


def _function(name: str) -> Callable[..., Any]:
    module, _, function = name.partition(":")
    found: Callable[..., Any] = getattr(importlib.import_module(module), function)
    return found


def _quiet() -> None:
    """Print nothing, stop when the app says so, and lead a group that can be stopped together."""
    with suppress(OSError, AttributeError):
        os.setsid()
    # Ctrl-C is for the app, which ends its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1):
        os.dup2(nowhere, number)
    sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), errors="backslashreplace")


def _listen(connection: Connection, calls: queue.Queue[_Call]) -> None:
    try:
        while True:
            calls.put(connection.recv())
    except (EOFError, OSError):
        # the app is gone
        with suppress(OSError, AttributeError):
            os.killpg(os.getpgid(0), signal.SIGTERM)
        os._exit(0)
