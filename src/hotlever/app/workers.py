"""Processes that work for the app: started by spawn, told by messages, ended at any time."""

from __future__ import annotations

import asyncio
import atexit
import multiprocessing
import os
import signal
import threading
import weakref
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from hotlever.app import child
from hotlever.errors import HotleverError

#: Number of what a process says of no call.
_ANY = 0
#: Seconds that a process has to end by itself, tidying up, before it is killed.
_TIDY_S = 0.6
#: Events while a call runs: ("said", line), ("progress", label, done, total), ("shown", what, it).
Heard = Callable[[tuple[Any, ...]], None]

_alive: weakref.WeakSet[Worker] = weakref.WeakSet()


class WorkerLostError(HotleverError):
    """The process died, or was ended, before it had an answer."""


class Worker:
    """A process that answers calls one after the other."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=child.serve, args=(theirs,), name="hotlever")
        self._process.start()
        theirs.close()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._answer: asyncio.Future[Any] | None = None
        self._heard: Heard | None = None
        self._number = 0
        self._turn = asyncio.Lock()
        self.lost = False
        _alive.add(self)
        threading.Thread(target=self._read, daemon=True).start()

    @property
    def pid(self) -> int:
        """Number of the process."""
        return int(self._process.pid or 0)

    async def call(self, function: str, *arguments: Any, heard: Heard | None = None) -> Any:
        """Call ``module:function`` of the process, and wait for its turn and answer.

        Raises
        ------
        HotleverError
            As the function says.
        WorkerLostError
            If the process died.
        """
        async with self._turn:
            self._loop = asyncio.get_running_loop()
            self._answer, self._heard = self._loop.create_future(), heard
            self._number += 1
            try:
                if self.lost:
                    raise OSError
                self._connection.send((self._number, function, arguments))
                return await self._answer
            except OSError:
                raise WorkerLostError(_LOST) from None
            finally:
                self._answer = self._heard = None

    def _read(self) -> None:
        """Hand messages of the process to the loop that waits for them."""
        while True:
            try:
                message = self._connection.recv()
            except (EOFError, OSError):
                self.lost = True
                message = (_ANY, "lost")
            if self._loop is not None:
                with suppress(RuntimeError):  # the loop is closed
                    self._loop.call_soon_threadsafe(self._take, message)
            if self.lost:
                return

    def _take(self, message: tuple[Any, ...]) -> None:
        answer = self._answer
        if answer is None or answer.done():
            return
        number, kind, *content = message
        if number not in (_ANY, self._number):
            return  # of a call that nobody waits for any more
        if kind == "done":
            answer.set_result(content[0])
        elif kind == "failed":
            answer.set_exception(HotleverError(content[0]))
        elif kind == "lost":
            answer.set_exception(WorkerLostError(_LOST))
        elif self._heard is not None:
            self._heard((kind, *content))

    async def end(self) -> None:
        """End the process and all that it started."""
        self._signal(signal.SIGTERM)
        for _ in range(int(_TIDY_S / 0.05)):
            if not self._process.is_alive():
                break
            await asyncio.sleep(0.05)
        self.kill()

    def kill(self) -> None:
        """End it now."""
        self._signal(getattr(signal, "SIGKILL", signal.SIGTERM))

    def _signal(self, number: int) -> None:
        with suppress(OSError):
            if hasattr(os, "killpg"):
                os.killpg(self.pid, number)
        with suppress(OSError, AttributeError, ValueError):
            os.kill(self.pid, number)


_LOST = (
    "the process that worked on this died (too little memory?); what was written before is there, "
    "please try again"
)


class Desk:
    """A worker that is always there: one that died is replaced at the next call."""

    def __init__(self) -> None:
        self._worker = Worker()

    async def call(self, function: str, *arguments: Any, heard: Heard | None = None) -> Any:
        """Call a function; see `Worker.call`."""
        if self._worker.lost:
            self._worker = Worker()
        return await self._worker.call(function, *arguments, heard=heard)


@atexit.register
def _end_all() -> None:
    # registered after multiprocessing's own, which would wait for them, and so called before it
    for worker in list(_alive):
        worker.kill()
