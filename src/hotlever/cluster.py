"""Work spread over processes through a Dask scheduler: local ones, or a cluster's.

Local processes are started by spawn, with one BLAS thread each, and are started again when they
die; what they were doing is done again. A script that asks for them needs
``if __name__ == "__main__"``.
"""

from __future__ import annotations

import logging
import signal
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import dask
import numpy as np
from distributed import CancelledError, Client, KilledWorker, LocalCluster, as_completed
from distributed.diagnostics.plugin import WorkerPlugin

from hotlever import __version__
from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.threads import single_threaded_children

T = TypeVar("T")

#: Tasks at the scheduler for each worker: one at work, one to go on with. The others wait here.
_AHEAD = 2
#: How long a scheduler, and then its first worker, may take to answer.
_PATIENCE_S = 10
#: Those that Dask gives levels of their own.
_LOGGERS = ("distributed", "distributed.client")


class _Quiet(WorkerPlugin):
    """What a local worker does when it starts, and when it starts again."""

    def setup(self, worker: Any) -> None:
        _silence()
        # Ctrl-C reaches all processes of a terminal; the one that started the workers ends them
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        # freeing a large block once teaches glibc to keep the memory of intermediate arrays
        np.empty(2_000_000)


@contextmanager
def local_client(processes: int) -> Iterator[Client]:
    """Start local worker processes; they end with the block.

    Raises
    ------
    ComputationError
        If they cannot be started.
    """
    settings = {
        "distributed.worker.multiprocessing-method": "spawn",
        # the default hands every freed array back to the system, to ask for it again
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
        # Dask watches its workers many times a second, at the cost of their work
        "distributed.worker.profile.enabled": False,
        "distributed.admin.tick.interval": "1s",
        "distributed.admin.system-monitor.interval": "5s",
    }
    with (
        dask.config.set(settings),
        single_threaded_children(),
        tempfile.TemporaryDirectory(prefix="hotlever-", ignore_cleanup_errors=True) as folder,
    ):
        try:
            cluster = LocalCluster(
                n_workers=processes,
                threads_per_worker=1,
                # None would mean the usual port, with a warning where that is taken
                dashboard_address="127.0.0.1:0",
                scheduler_kwargs={"dashboard": False},
                silence_logs=logging.CRITICAL,
                local_directory=folder,
            )
        except (RuntimeError, OSError) as error:
            raise ComputationError(
                "the worker processes could not be started; is there enough memory, and does a "
                'script that starts them have `if __name__ == "__main__"`?'
            ) from error
        with cluster, Client(cluster, set_as_default=False) as client:
            client.register_plugin(_Quiet())
            yield client


@contextmanager
def remote_client(address: str) -> Iterator[Client]:
    """Connect to a running scheduler, whose workers must have the same version of hotlever.

    Raises
    ------
    InputError
        If nothing answers at the address, or a worker has another version or none.
    """
    where = f"--scheduler {address}"
    levels = _silence()
    try:
        with _connected(address, where) as client:
            yield client
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


@contextmanager
def _connected(address: str, where: str) -> Iterator[Client]:
    try:
        client = Client(address, timeout=_PATIENCE_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(
            f"{where}: no scheduler answers there, expected one like tcp://HOST:8786"
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE_S)
        except TimeoutError as error:
            raise InputError(f"{where}: the scheduler has no workers") from error
        versions = client.run(_version, on_error="return")
        for worker, found in versions.items():
            if found != __version__:
                found = found if isinstance(found, str) else "missing"
                raise InputError(
                    f"{where}: at worker {worker} hotlever is {found}, expected {__version__}"
                )
        yield client


def _silence() -> dict[str, int]:
    """Keep Dask's logs from standard error; return the levels they had."""
    levels = {name: logging.getLogger(name).level for name in _LOGGERS}
    for name in levels:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    return levels


def _version() -> str:
    from hotlever import __version__ as version

    return version


def run_all(
    client: Client, function: Callable[..., T], tasks: Iterable[tuple[Any, ...]]
) -> Iterator[tuple[int, T | HotleverError]]:
    """Apply a function to each of many arguments; give number and result as each is done.

    Only a few tasks for each worker are sent ahead. A task whose worker dies goes to another one;
    a task that kills several workers gives an error, as one that raises does.

    Raises
    ------
    ComputationError
        If the scheduler is lost.
    """
    waiting = enumerate(tasks)
    running: dict[Any, int] = {}
    done = as_completed(loop=client.loop)
    exhausted = False
    while True:
        try:
            threads = sum(client.nthreads().values())
        except (OSError, TimeoutError) as error:
            raise ComputationError(
                "the scheduler is lost; what was done until then is written"
            ) from error
        while not exhausted and len(running) < max(1, _AHEAD * threads):
            number, arguments = next(waiting, (-1, ()))
            if number < 0:
                exhausted = True
                break
            future = client.submit(_guarded, function, arguments, pure=False)
            running[future] = number
            done.add(future)
        if not running:
            return
        future = next(done)
        number = running.pop(future)
        try:
            yield number, future.result()
        except CancelledError as error:
            raise ComputationError(
                "the scheduler is lost; what was done until then is written"
            ) from error
        except KilledWorker:
            yield number, ComputationError("every process that tried it died; too little memory?")
        except Exception as error:
            yield number, ComputationError(f"{type(error).__name__}: {error}")


def _guarded(function: Callable[..., T], arguments: tuple[Any, ...]) -> T | HotleverError:
    """Call a function, in a worker; errors made for users come back as plain ones.

    What some carry along is large, or cannot be sent.
    """
    try:
        return function(*arguments)
    except HotleverError as error:
        kind = InputError if isinstance(error, InputError) else ComputationError
        return kind(str(error))
