"""Processes that work for the app: started by spawn, told by messages, ended at any time.

`Worker` is the app's side of one. `serve` runs in the process, which works in the folder of the
project as a terminal does, and calls functions of this package one after the other; each is given a
`Report` first, by which it tells of its progress.
"""

from __future__ import annotations

import asyncio
import atexit
import gc
import io
import multiprocessing
import os
import queue
import signal
import sys
import threading
import weakref
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NoReturn

from hotlever.errors import HotleverError, unforeseen_error
from hotlever.types import Progress
from hotlever.work import give_back

#: Hears what a call tells: of which kind it is, and what.
Heard = Callable[[str, Any], None]

_alive: weakref.WeakSet[Worker] = weakref.WeakSet()


class Worker:
    """A process that answers calls one after the other; one that died is replaced at the next.

    Parameters
    ----------
    folder : path
        Where it works.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._turn = asyncio.Lock()
        self._answer: asyncio.Future[Any] | None = None
        self._heard: Heard | None = None
        self._number = 0
        _alive.add(self)
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs, self._folder), name="hotlever")
        self._process.start()
        theirs.close()
        self.lost = False
        self._loop: asyncio.AbstractEventLoop | None = None
        threading.Thread(target=self._read, args=(self._connection,), daemon=True).start()

    async def call(
        self, function: Callable[..., Any], *arguments: Any, heard: Heard | None = None
    ) -> Any:
        """Call a function in the process, and wait for its turn and answer.

        Parameters
        ----------
        function : callable
            Of a module. Given a `Report`, by which it tells of its progress, and the arguments.
        *arguments
        heard : callable, optional
            Told what it tells.

        Raises
        ------
        HotleverError
            As the function says, or if the process died, or was ended, before it had an answer.
        """
        async with self._turn:
            if self.lost:
                self._start()
            self._loop = asyncio.get_running_loop()
            self._answer, self._heard = self._loop.create_future(), heard
            self._number += 1
            try:
                self._connection.send((self._number, function, arguments))
                return await self._answer
            except OSError:
                raise _lost() from None
            finally:
                self._answer = self._heard = None

    def _read(self, connection: Connection) -> None:
        """Hand messages of the process to the loop that waits for them."""
        lost = False
        while not lost:
            try:
                message = connection.recv()
            except (EOFError, OSError):
                lost = self.lost = True
                message = (0, "lost", None)
            if self._loop is not None:
                with suppress(RuntimeError):  # the loop is closed
                    self._loop.call_soon_threadsafe(self._take, *message)

    def _take(self, number: int, kind: str, content: Any) -> None:
        # 0 is of no call
        if self._answer is None or self._answer.done() or number not in (0, self._number):
            return  # of a call that nobody waits for any more
        if kind == "done":
            self._answer.set_result(content)
        elif kind == "failed":
            self._answer.set_exception(HotleverError(content))
        elif kind == "lost":
            self._answer.set_exception(_lost())
        elif self._heard is not None:
            self._heard(kind, content)

    def interrupt(self) -> None:
        """Have the call that it answers end, as by Ctrl-C."""
        with suppress(OSError):
            os.kill(int(self._process.pid or 0), signal.SIGTERM)

    async def end(self) -> None:
        """End the process and all that it started."""
        self._signal(signal.SIGTERM)
        # it may end by itself, tidying up, before it is killed
        for _ in range(12):
            if not self._process.is_alive():
                break
            await asyncio.sleep(0.05)
        self.kill()

    def kill(self) -> None:
        """End it now."""
        self._signal(getattr(signal, "SIGKILL", signal.SIGTERM))

    def _signal(self, number: int) -> None:
        pid = int(self._process.pid or 0)
        with suppress(OSError, AttributeError):
            os.killpg(pid, number)
        with suppress(OSError, ValueError):
            os.kill(pid, number)


def _lost() -> HotleverError:
    return HotleverError(
        "the process that worked on this died (too little memory?); what was written before is "
        "there, please try again"
    )


@atexit.register
def _end_all() -> None:
    # registered after multiprocessing's own, which would wait for them, and so called before it
    for worker in list(_alive):
        worker.kill()


# --- in the process -------------------------------------------------------------------------------


class Report:
    """Tells the app of a call: a `hotlever.tasks.arguments.Reporter`.

    Attributes
    ----------
    number : int
        Of the call. Who asked may be gone, and somebody else wait for the next answer.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection, self.number = connection, 0

    def send(self, kind: str, content: Any) -> None:
        """Send something of what is worked on, or the answer."""
        self._connection.send((self.number, kind, content))

    def give(self, result: str) -> None:
        """Send the result as text."""
        self.send("result", result)

    def tell(self, text: str) -> None:
        """Leave out what is said on the way: the page shows how far the work is."""

    def note(self, *texts: str) -> None:
        """Send what should be known beside the result."""
        for text in texts:
            self.send("note", text)

    def fail(self, message: str) -> None:
        """Send what went wrong with a part of the work."""
        self.send("failure", message)

    def tell_table(self, rows: Sequence[Sequence[str]]) -> None:
        """Send rows of cells."""
        self.send("table", [list(row) for row in rows])

    def show(self, what: str, content: Any) -> None:
        """Send what can be drawn."""
        self.send(what, content)

    def progress(self, label: str) -> AbstractContextManager[Progress]:
        """Give what sends how far a part of the work is."""
        return nullcontext(partial(self._progressed, label))

    def progress_bars(self, *labels: str) -> AbstractContextManager[tuple[Progress, ...]]:
        """Give the same for several parts."""
        return nullcontext(tuple(partial(self._progressed, label) for label in labels))

    def _progressed(self, label: str, done: int, total: int) -> None:
        self.send("progress", (label, int(done), int(total)))


def serve(connection: Connection, folder: Path) -> None:
    """Answer calls in a folder until the app is gone, or says that this ends."""
    _quiet()
    os.chdir(folder)
    calls: queue.Queue[Any] = queue.Queue()
    threading.Thread(target=_listen, args=(connection, calls), daemon=True).start()
    with suppress(KeyboardInterrupt):
        _import_all()
        report = Report(connection)
        while True:
            _answer(report, *_next(calls))


def _import_all() -> None:
    """Import what commands import when they are called, so that the first is done at once."""
    from hotlever import estimate, figures, lever, raman  # noqa: F401
    from hotlever.estimate import many  # noqa: F401
    from hotlever.lever import fields, set_points, transient  # noqa: F401
    from hotlever.report import result_pages  # noqa: F401


def _answer(
    report: Report, number: int, function: Callable[..., Any], arguments: tuple[Any, ...]
) -> None:
    report.number = number
    try:
        report.send("done", function(report, *arguments))
    except HotleverError as error:
        report.send("failed", str(error))
    except MemoryError:
        report.send("failed", "there is too little memory for this")
    except Exception as error:
        report.send(
            "failed", unforeseen_error(error, ["app", f"{function.__module__}.{function.__name__}"])
        )


def _next(calls: queue.Queue[Any]) -> Any:
    """Wait for a number, a function and its arguments; give memory back while there are none."""
    with suppress(queue.Empty):
        return calls.get(timeout=1.0)
    gc.collect()
    give_back()
    return calls.get()


def _quiet() -> None:
    """Print nothing, stop when the app says so, and lead a group that can be stopped together."""
    with suppress(OSError, AttributeError):
        os.setsid()
    # Ctrl-C is for the app, which ends its workers; what is being written is tidied up then
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _stop)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1):
        os.dup2(nowhere, number)
    sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), errors="backslashreplace")


def _stop(*_: Any) -> NoReturn:
    raise KeyboardInterrupt


def _listen(connection: Connection, calls: queue.Queue[Any]) -> None:
    try:
        while True:
            calls.put(connection.recv())
    except (EOFError, OSError):
        # the app is gone
        with suppress(OSError, AttributeError):
            os.killpg(os.getpgid(0), signal.SIGTERM)
        os._exit(0)
