"""The command line: runs a command; however it ends, one line says how, and the exit status.

The commands are those of `hotlever.tasks`. Nothing heavy is imported above `main`, so that Ctrl-C
is answered from the start.
"""

from __future__ import annotations

import atexit
import gc
import io
import os
import signal
import sys
import threading
import warnings
from contextlib import suppress
from types import FrameType
from typing import NoReturn

from hotlever.cli import output
from hotlever.cli.output import fail, give
from hotlever.errors import HotleverError, unforeseen_error

#: Signals to end that have come: a compiled module that is stopped while it is imported says
#: something else.
_received: list[int] = []


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the command line; exit status 0 done, 1 not finished, 2 the input is at fault."""
    # what modules consist of stays, some 200 000 objects: looking at it again and again takes a
    # tenth of a sweep
    gc.set_threshold(300_000)
    if arguments is None:
        arguments = sys.argv[1:]
        # solves run in one thread of BLAS, see `hotlever.work`: others would wait for work, busily,
        # which takes a tenth of a sweep's processor time while modules are imported
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        # else Python looks through all there is once more as it ends: a fifth of a sweep
        atexit.register(gc.freeze)
        _keep_to_ourselves()
        sys.unraisablehook = _stop_again
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        # nohup, for one, has a command ignore a signal
        usual = (signal.SIG_DFL, signal.default_int_handler)
        if number is not None and signal.getsignal(number) in usual:
            signal.signal(number, _stop)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # a terminal in Latin-1 has no κ, and a file name need not be text
            stream.reconfigure(errors="backslashreplace")
    try:
        status = _run(arguments or ["--help"])
    except BaseException as error:
        status, message = _ended(error, arguments)
        fail(message)
    sys.exit(status)


class Stopped(KeyboardInterrupt):
    """A signal has come that ends a command.

    Of a type of its own: where a plain KeyboardInterrupt passes through `exec`, as of a module of
    dataclasses that is imported, Python ends itself by a signal in place of the exit status.
    """


def _stop(number: int, _: FrameType | None) -> NoReturn:
    _received.append(number)
    raise Stopped


def _stop_again(ignored: sys.UnraisableHookArgs) -> None:
    """Stop what was stopped where Python lets no exception out: in a destructor, or as it imports.

    The signal comes again, by another thread, when we are out of there.
    """
    if isinstance(ignored.exc_value, Stopped):
        again = threading.Timer(0.01, os.kill, (os.getpid(), _received[-1]))
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(ignored)


def _keep_to_ourselves() -> None:
    """Keep what libraries print out of the results, and their warnings to those who develop."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    with suppress(OSError, AttributeError):
        results = os.dup(1)
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 1)
        sys.stdout = os.fdopen(results, "w", encoding=sys.stdout.encoding)


def _run(arguments: list[str]) -> int:
    from hotlever.app import open_app
    from hotlever.tasks.commands import COMMANDS, run_command

    try:
        return run_command(arguments, output, {**COMMANDS, "app": open_app})
    finally:
        give()


def _ended(error: BaseException, arguments: list[str]) -> tuple[int, str]:
    """Return exit status and message for what ended a command."""
    if isinstance(error, HotleverError):
        return error.exit_status, str(error)
    if isinstance(error, KeyboardInterrupt) or (_received and not isinstance(error, SystemExit)):
        return 1, "stopped by the user"
    if isinstance(error, BrokenPipeError):
        # the reader of our standard output has gone (`| head`): nothing left to say to it
        return 1, ""
    if isinstance(error, SystemExit):
        return error.code if isinstance(error.code, int) else 1, ""
    return 1, unforeseen_error(error, arguments)
