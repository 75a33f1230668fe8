"""Work spread over processes by Dask: local ones, or those of a cluster's scheduler."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from itertools import islice, starmap
from typing import Any, TypeVar

import dask
import numpy as np
from distributed import CancelledError, Client, KilledWorker, LocalCluster, Security, wait
from distributed.diagnostics.plugin import WorkerPlugin

from hotlever import __version__
from hotlever.cache import CACHE_VARIABLE, cache_folder
from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.files import read_text
from hotlever.types import Progress

T = TypeVar("T")
# Number and arguments.
Task = tuple[int, tuple[Any, ...]]
Share = Callable[[Any], Any]
# Applies a function to each of many arguments, telling how many are done; gives the results.
Run = Callable[..., list[Any]]

#: Tasks at the scheduler for each worker: one at work, one to go on with. The others wait here.
_AHEAD = 2
#: Seconds that a scheduler, and then its first worker, may take to answer.
_PATIENCE_S = 10
#: Seconds for which a scheduler may be without workers while there is work.
_WITHOUT_WORKERS_S = 30
#: Seconds that a scheduler may take to say who its workers are.
_ANSWER_S = 30
#: Seconds after which a local worker that gives no sign of life is started again.
_SILENT_S = 20
#: Seconds between two looks at the workers.
_LOOK_S = 5.0
#: Variables that keep the linear algebra of a new process on one thread.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
#: Those that Dask gives levels of their own.
_LOGGERS = ("distributed", "distributed.client")
_KILLED = ComputationError("every process that tried it died; too little memory?")
#: Dask's settings of TLS, and the variables of the environment that set them.
_CREDENTIALS = {
    "ca-file": "DASK_DISTRIBUTED__COMM__TLS__CA_FILE",
    "client.cert": "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT",
    "client.key": "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY",
}
_LOST = "the scheduler is lost; what was done until then is written"


def run_all(
    client: Client, function: Callable[..., T], tasks: Iterable[tuple[Any, ...]]
) -> Iterator[tuple[int, T | HotleverError]]:
    """Apply a function to each of many arguments; give number and result as each is done.

    Only a few tasks for each worker are sent ahead. A task whose worker dies goes to another one.
    If that dies as well the task is tried again alone, since another one may have been the cause;
    if its workers still die it gives an error, as one that raises does.

    Raises
    ------
    ComputationError
        If the workers are lost.
    """
    waiting: Iterator[Task] = enumerate(tasks)
    suspects: list[Task] = []
    running: dict[Any, Task] = {}
    last_seen, alone = time.monotonic(), False
    while True:
        if threads := _threads(client):
            last_seen = time.monotonic()
        elif running and time.monotonic() > last_seen + _WITHOUT_WORKERS_S:
            raise ComputationError(
                "the scheduler has no workers left; what was done until then is written"
            )
        ahead = 1 if alone else max(1, _AHEAD * threads)
        for task in islice(waiting, max(0, ahead - len(running))):
            running[client.submit(guarded, function, task[1], pure=False)] = task
        if not running:
            if alone or not suspects:
                return
            waiting, alone = iter(suspects), True
            continue
        with client.as_current(), suppress(TimeoutError, CancelledError):
            wait(list(running), _LOOK_S, return_when="FIRST_COMPLETED")
        for future in [future for future in running if future.done()]:
            task, result = running.pop(future), _result(future)
            if result is _KILLED and not alone:
                suspects.append(task)
            else:
                yield task[0], result


@contextmanager
def local_processes(processes: int) -> Iterator[tuple[Run, Share]]:
    """Start local processes that do tasks, and raise what these raise; one would be this one.

    The second thing given shares what is large between tasks: it is sent to each process once.

    Raises
    ------
    ComputationError
        If they cannot be started, or die again and again.
    """
    with nullcontext() if processes == 1 else local_client(processes) as client:

        def run(
            function: Callable[..., Any],
            tasks: list[tuple[Any, ...]],
            progress: Progress | None = None,
        ) -> list[Any]:
            tell, results = progress or (lambda done, total: None), {}
            tell(0, len(tasks))
            here = enumerate(starmap(function, tasks))
            for number, result in here if client is None else run_all(client, function, tasks):
                if isinstance(result, HotleverError):
                    raise result
                results[number] = result
                tell(len(results), len(tasks))
            return [results[number] for number in range(len(tasks))]

        share = (lambda value: value) if client is None else partial(client.scatter, broadcast=True)
        yield run, share


def _threads(client: Client) -> int:
    """Return how many tasks the workers can do at a time."""
    try:
        if client.status != "running":
            raise ConnectionError
        found = client.sync(client.scheduler.ncores, callback_timeout=_ANSWER_S)
    except (OSError, TimeoutError) as error:
        raise ComputationError(_LOST) from error
    return sum(found.values())


def _result(future: Any) -> Any:
    try:
        return future.result()
    except CancelledError as error:
        raise ComputationError(_LOST) from error
    except KilledWorker:
        return _KILLED
    except Exception as error:
        return ComputationError(f"{type(error).__name__}: {error}")


def guarded(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Call a function in a worker; an error is returned, as one that can be sent.

    What some carry along is large, or cannot be sent.
    """
    try:
        return function(*arguments)
    except InputError as error:
        return InputError(str(error))
    except HotleverError as error:
        return ComputationError(str(error))
    except Exception as error:
        return ComputationError(f"{type(error).__name__}: {error}")


# --- on this machine ----------------------------------------------------------------------------


class _LocalWorker(WorkerPlugin):
    """What a local worker does when it starts, and when it starts again."""

    def setup(self, worker: Any) -> None:
        _silence()
        # freeing a large block once teaches glibc to keep the memory of intermediate arrays
        np.empty(2_000_000)


@contextmanager
def local_client(processes: int) -> Iterator[Client]:
    """Start local worker processes with one BLAS thread each; they end with the block.

    They are started by spawn: a script that calls this needs ``if __name__ == "__main__"``. Their
    ports ask for credentials that are made for each block and never leave the memory of its
    processes. One that dies or is stopped is started again, and what it was doing is done again.

    Raises
    ------
    ComputationError
        If they cannot be started.
    """
    settings: dict[str, Any] = {
        "distributed.worker.multiprocessing-method": "spawn",
        # nothing but the encrypted connections answers
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
        "distributed.scheduler.allowed-failures": 1,
        "distributed.scheduler.worker-ttl": f"{_SILENT_S}s",
        # the default hands every freed array back to the system, to ask for it again
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
        # Dask watches its workers many times a second, at the cost of their work
        "distributed.worker.profile.enabled": False,
        "distributed.admin.tick.interval": "1s",
        "distributed.admin.system-monitor.interval": "5s",
    }
    security = Security.temporary()
    with (
        _folder_of_this_process() as folder,
        dask.config.set({**settings, "temporary-directory": folder}),
        _environment(folder),
    ):
        try:
            with _without_interrupts():
                cluster = LocalCluster(
                    n_workers=processes,
                    threads_per_worker=1,
                    security=security,
                    # None would mean the usual port, with a warning where that is taken
                    dashboard_address="127.0.0.1:0",
                    scheduler_kwargs={"dashboard": False},
                    silence_logs=logging.CRITICAL,
                )
        except (RuntimeError, OSError) as error:
            raise ComputationError(
                "the worker processes could not be started; is there enough memory, and does a "
                'script that starts them have `if __name__ == "__main__"`?'
            ) from error
        with cluster, Client(cluster, security=security, set_as_default=False) as client:
            client.register_plugin(_LocalWorker())
            yield client


@contextmanager
def _folder_of_this_process() -> Iterator[str]:
    """Make a temporary folder that is removed even if this process is killed."""
    folder = tempfile.mkdtemp(prefix="hotlever-")
    # our end of its standard input closes however we end
    remover = "import shutil, sys; sys.stdin.read(); shutil.rmtree(sys.argv[1], True)"
    command = [sys.executable, "-I", "-S", "-c", remover, folder]
    with subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True):
        yield folder


@contextmanager
def _environment(folder: str) -> Iterator[None]:
    """Give workers one BLAS thread, and a cache to share even if the user's is switched off."""
    changes = dict.fromkeys(_THREADS, "1")
    if cache_folder() is None:
        changes[CACHE_VARIABLE] = folder
    before = {name: os.environ[name] for name in changes if name in os.environ}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name in changes:
            os.environ.pop(name, None)
        os.environ.update(before)


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Start threads and processes that Ctrl-C, which reaches all of a terminal, leaves to us."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# --- on a cluster ---------------------------------------------------------------------------------


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


def is_open(address: str) -> bool:
    """Whether anybody on the network who finds a scheduler may use it, and its workers.

    Examples
    --------
    >>> [is_open(one) for one in ("tcp://node7:8786", "tls://node7:8786", "tcp://127.0.0.1:8786")]
    [True, False, False]
    """
    scheme, _, rest = address.rpartition("://")
    host = rest.rpartition(":")[0].strip("[]")
    return scheme != "tls" and not (host in ("localhost", "::1") or host.startswith("127."))


def _check_credentials(where: str) -> None:
    """Check that Dask's settings name the files with which TLS is spoken.

    Raises
    ------
    InputError
        If they name none, or one that cannot be read.
    """
    for setting, variable in _CREDENTIALS.items():
        path = dask.config.get(f"distributed.comm.tls.{setting}", None)
        if not path:
            raise InputError(
                f"{where}: no credentials for TLS, expected the names of their files in "
                f"{', '.join(_CREDENTIALS.values())}; {variable} is not set"
            )
        read_text(path)


@contextmanager
def _connected(address: str, where: str) -> Iterator[Client]:
    if address.startswith("tls://"):
        _check_credentials(where)
    try:
        client = Client(address, timeout=_PATIENCE_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(
            f"{where}: no scheduler answers there, expected one like tls://HOST:8786"
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
    return __version__
