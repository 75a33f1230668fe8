"""Limits that tests set to what might never end, and signals that end it."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import psutil


def as_in_a_terminal(command: list[str], ignored: str = "") -> list[str]:
    """Return a command that signals end even where these tests run in the background.

    They are set in the new process, which then becomes the command: a function that is run between
    fork and exec may wait for a lock that another thread had. One signal may be ignored instead.
    """
    prepare = (
        "import os, signal, sys\n"
        "for name in 'SIGINT', 'SIGTERM', 'SIGHUP':\n"
        "    ignored = name == sys.argv[1]\n"
        "    signal.signal(getattr(signal, name), signal.SIG_IGN if ignored else signal.SIG_DFL)\n"
        "os.execvp(sys.argv[2], sys.argv[2:])"
    )
    return [sys.executable, "-I", "-S", "-c", prepare, ignored or "-", *command]


def processes_below(
    process: psutil.Process | None = None, word: str = "spawn_main"
) -> list[psutil.Process]:
    """Return what a process, or this one, has started, directly or not, by a word of its command.

    What has ended is none, whether or not somebody has waited for it; by default the word is that
    of processes that are started by spawn.
    """
    with suppress(psutil.NoSuchProcess):
        every = (process or psutil.Process()).children(recursive=True)
        return [one for one in every if any(word in part for part in _command_of(one))]
    return []


def _command_of(process: psutil.Process) -> list[str]:
    with suppress(psutil.NoSuchProcess):
        return process.cmdline()
    return []


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Fail what takes longer, even if it would never end."""

    def stop(*_: object) -> None:
        raise AssertionError(f"took more than {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
