"""Work spread over processes: one interface for those of this machine and those of a cluster."""

from __future__ import annotations

import logging
import multiprocessing
import os
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from itertools import starmap
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from hotlever import __version__
from hotlever.cache import CACHE_VARIABLE, cache_folder
from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.files import read_text
from hotlever.types import Progress, T

if TYPE_CHECKING:
    from distributed import Client

#: Processes that this one starts if nothing else is said: one for each processor it may use.
PROCESSORS = (
    len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
)


@dataclass(frozen=True)
class Patience:
    """How long is waited for processes.

    Attributes
    ----------
    start_s : float
        Seconds that a process may take to start.
    task_s : float
        Seconds that a task may take. A process that takes longer has been stopped, or waits for
        something that does not come; it is ended.
    look_s : float
        Seconds between two looks at whether there are workers.
    without_workers_s : float
        Seconds for which there may be none while there is work.
    scheduler_s : float
        Seconds that a scheduler, and then its first worker, may take to be there.
    answer_s : float
        Seconds that a scheduler may take to say who its workers are.
    """

    start_s: float = 120.0
    task_s: float = 1800.0
    look_s: float = 5.0
    without_workers_s: float = 30.0
    scheduler_s: float = 10.0
    answer_s: float = 30.0


class WorkerDiedError(Exception):
    """A worker died, or took too long, while it had a task."""


class Executor(Protocol):
    """What does tasks, here or elsewhere."""

    patience: Patience

    def count(self) -> int:
        """Return how many tasks are done at a time; raise ComputationError if all is lost."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Send a task; its future raises WorkerDiedError if whoever had it died."""


def run_all(
    executor: Executor, function: Callable[..., T], tasks: Iterable[tuple[Any, ...]]
) -> Iterator[tuple[int, T | HotleverError]]:
    """Apply a function to each of many arguments; give number and result as each is done.

    A task whose worker dies is tried again alone, when the others are done, since another one may
    have been the cause; if its worker dies again it gives an error, as one that raises does.

    Raises
    ------
    ComputationError
        If the workers are lost.
    """
    arguments, suspects = list(tasks), list[int]()
    for number, result in _as_completed(executor, function, arguments, range(len(arguments))):
        if isinstance(result, WorkerDiedError):
            suspects.append(number)
        else:
            yield number, result
    for suspect in suspects:
        for number, result in _as_completed(executor, function, arguments, [suspect]):
            if isinstance(result, WorkerDiedError):
                yield (
                    number,
                    ComputationError("every process that tried it died; too little memory?"),
                )
            else:
                yield number, result


def _as_completed(
    executor: Executor, function: Callable[..., Any], arguments: list[Any], numbers: Iterable[int]
) -> Iterator[tuple[int, Any]]:
    """Give the number and the result of each task, or the error in its place, as it is done."""
    patience = executor.patience
    running = {executor.submit(function, *arguments[number]): number for number in numbers}
    last_seen = time.monotonic()
    while running:
        if executor.count():
            last_seen = time.monotonic()
        elif time.monotonic() > last_seen + patience.without_workers_s:
            raise ComputationError(
                "the scheduler has no workers left; what was done until then is written"
            )
        for future in wait(running, patience.look_s, return_when="FIRST_COMPLETED").done:
            number = running.pop(future)
            try:
                yield number, future.result()
            except WorkerDiedError as error:
                yield number, error
            except HotleverError:
                raise
            except Exception as error:
                yield number, _as_sent(error)


def _as_sent(error: Exception) -> ComputationError:
    """Return what can be sent of an error that nobody foresaw: its type and words."""
    return ComputationError(f"{type(error).__name__}: {error}")


def guarded(function: Callable[..., Any], *arguments: Any) -> Any:
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
        return _as_sent(error)


@contextmanager
def local_processes(processes: int) -> Iterator[Callable[..., list[Any]]]:
    """Start local processes that do tasks, and raise what these raise; one would be this one.

    What is given applies a function to each of many arguments, tells how many are done, and returns
    the results.

    Raises
    ------
    ComputationError
        If they cannot be started, or die again and again.
    """
    with nullcontext() if processes == 1 else local_executor(processes) as executor:

        def run(
            function: Callable[..., Any],
            tasks: list[tuple[Any, ...]],
            progress: Progress | None = None,
        ) -> list[Any]:
            tell, results = progress or (lambda done, total: None), {}
            tell(0, len(tasks))
            here = enumerate(starmap(function, tasks))
            for number, result in here if executor is None else run_all(executor, function, tasks):
                if isinstance(result, HotleverError):
                    raise result
                results[number] = result
                tell(len(results), len(tasks))
            return [results[number] for number in range(len(tasks))]

        yield run


# --- processes of this machine --------------------------------------------------------------------


@contextmanager
def local_executor(processes: int, patience: Patience | None = None) -> Iterator[LocalExecutor]:
    """Start local worker processes with one BLAS thread each; they end with the block.

    They are started by spawn: a script that calls this needs ``if __name__ == "__main__"``. Nobody
    else can reach them, for they listen to their pipes alone.

    Raises
    ------
    ComputationError
        If they cannot be started.
    """
    environment = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    with ExitStack() as stack:
        if cache_folder() is None:
            # the processes share what they make even if the user's cache is switched off
            environment[CACHE_VARIABLE] = stack.enter_context(_folder_of_this_process())
        executor = LocalExecutor(processes, environment, patience or Patience())
        stack.callback(executor.end)
        executor.start()
        yield executor


class LocalExecutor:
    """Processes of this machine, each a pool of its own.

    A pool of several gives up all tasks when one process dies, and does not say whose it was.

    Parameters
    ----------
    processes : int
        How many.
    environment : dict of str to str
        Variables that are set in each.
    patience : Patience
    """

    def __init__(self, processes: int, environment: dict[str, str], patience: Patience) -> None:
        self.patience = patience
        self._count, self._environment = processes, environment
        self._threads = ThreadPoolExecutor(processes)
        self._idle: queue.SimpleQueue[ProcessPoolExecutor] = queue.SimpleQueue()
        self._pools: list[ProcessPoolExecutor] = []
        self._lock = threading.Lock()
        self._ended = False

    def count(self) -> int:
        """Return how many tasks are done at a time."""
        return self._count

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Send a task; its future raises WorkerDiedError if the process that had it died."""
        return self._threads.submit(self._do, function, arguments)

    def start(self) -> None:
        """Start the processes and wait for them.

        Raises
        ------
        ComputationError
            If they cannot be started.
        """
        try:
            for _ in range(self._count):
                self._idle.put(self._new_pool())
            started = [pool.submit(int) for pool in self._pools]
            for future in started:
                future.result(self.patience.start_s)
        except (BrokenExecutor, TimeoutError, RuntimeError, OSError) as error:
            raise ComputationError(
                "the worker processes could not be started; is there enough memory, and does a "
                'script that starts them have `if __name__ == "__main__"`?'
            ) from error

    def end(self) -> None:
        """End the processes, whatever they do."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        with self._lock:
            self._ended = True
            for pool in self._pools:
                _kill(pool)
        self._threads.shutdown()

    def _do(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        """Send a task to an idle process and wait for its result."""
        task = pickle.dumps((function, arguments))
        pool = self._idle.get()
        try:
            # a new process has the time to start before that for its task begins
            pool.submit(int).result(self.patience.start_s)
            return pool.submit(_call, task).result(self.patience.task_s)
        except (BrokenExecutor, TimeoutError) as error:
            # not while all are ended: two threads would close the same pipe
            with self._lock:
                _kill(pool)
            pool = self._new_pool()
            raise WorkerDiedError from error
        finally:
            self._idle.put(pool)

    def _new_pool(self) -> ProcessPoolExecutor:
        with self._lock:
            if self._ended:
                raise WorkerDiedError
            pool = ProcessPoolExecutor(
                1, multiprocessing.get_context("spawn"), _begin, (self._environment,)
            )
            self._pools.append(pool)
            # Ctrl-C, which reaches all processes of a terminal, is left to this one
            with _without_interrupts():
                pool.submit(int)
            return pool


def _kill(pool: ProcessPoolExecutor) -> None:
    """End the process of a pool, whatever it does."""
    # the method for it, `kill_workers`, came with Python 3.14
    for process in list((pool._processes or {}).values()):
        process.kill()
    pool.shutdown(cancel_futures=True)


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
def _without_interrupts() -> Iterator[None]:
    """Start processes that do not hear Ctrl-C."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(environment: dict[str, str]) -> None:
    """Prepare a new process, which ends with the one that started it, however that ends."""
    os.environ.update(environment)
    # freeing a large block once teaches glibc to keep the memory of intermediate arrays
    np.empty(2_000_000)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _call(task: bytes) -> Any:
    """Do a task in a process; what cannot be read of it is an error of its own, not a death."""
    try:
        function, arguments = pickle.loads(task)
    except (AttributeError, ImportError) as error:
        # a class of a notebook, say
        return InputError(f"{error}: expected it in a module that can be imported")
    return guarded(function, *arguments)


# --- workers of a cluster -------------------------------------------------------------------------


class ClusterExecutor:
    """The workers that a Dask scheduler has."""

    patience = Patience()

    def __init__(self, client: Client) -> None:
        self._client = client

    def count(self) -> int:
        """Return how many tasks the workers can do at a time.

        Raises
        ------
        ComputationError
            If the scheduler does not answer.
        """
        try:
            if self._client.status != "running":
                raise ConnectionError
            threads = self._client.sync(
                self._client.scheduler.ncores, callback_timeout=self.patience.answer_s
            )
        except (OSError, TimeoutError) as error:
            raise _lost() from error
        return sum(threads.values())

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Send a task; its future raises WorkerDiedError if the workers that had it died."""
        result: Future[Any] = Future()
        task = self._client.submit(guarded, function, *arguments, pure=False)
        # the task is kept by its callback until it is done
        task.add_done_callback(partial(_hand_on, result=result))
        return result


def _lost() -> ComputationError:
    return ComputationError("the scheduler is lost; what was done until then is written")


def _hand_on(task: Any, result: Future[Any]) -> None:
    """Give a task's result, or why there is none, to the future that stands for it."""
    from distributed import CancelledError, KilledWorker

    try:
        result.set_result(task.result())
    except CancelledError:
        result.set_exception(_lost())
    except KilledWorker:
        result.set_exception(WorkerDiedError())
    except Exception as error:
        result.set_exception(error)


@contextmanager
def cluster_executor(address: str) -> Iterator[ClusterExecutor]:
    """Connect to a running scheduler, whose workers must have the same version of hotlever.

    Raises
    ------
    InputError
        If nothing answers at the address, a worker has another version or none, or Dask, which is
        an extra, is not installed.
    """
    where = f"--scheduler {address}"
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InputError(
            f"{where}: Dask is not installed, expected pip install 'hotlever[cluster]'"
        ) from None
    # Dask's logs are kept from standard error
    loggers = "distributed", "distributed.client"  # each has a level of its own
    levels = {name: logging.getLogger(name).level for name in loggers}
    for name in levels:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        with _connected(address, where) as client:
            yield ClusterExecutor(client)
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


def _check_credentials(where: str) -> None:
    """Check that Dask's settings name the files with which TLS is spoken.

    Raises
    ------
    InputError
        If they name none, or one that cannot be read.
    """
    import dask

    # Dask's settings of TLS, and the variables of the environment that set them
    credentials = {
        "ca-file": "DASK_DISTRIBUTED__COMM__TLS__CA_FILE",
        "client.cert": "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT",
        "client.key": "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY",
    }
    for setting, variable in credentials.items():
        path = dask.config.get(f"distributed.comm.tls.{setting}", None)
        if not path:
            raise InputError(
                f"{where}: no credentials for TLS, expected the names of their files in "
                f"{', '.join(credentials.values())}; {variable} is not set"
            )
        read_text(path)


@contextmanager
def _connected(address: str, where: str) -> Iterator[Client]:
    from distributed import Client

    patience = ClusterExecutor.patience
    if address.startswith("tls://"):
        _check_credentials(where)
    try:
        client = Client(address, timeout=patience.scheduler_s, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(
            f"{where}: no scheduler answers there, expected one like tls://HOST:8786"
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=patience.scheduler_s)
        except TimeoutError as error:
            raise InputError(f"{where}: the scheduler has no workers") from error
        versions = client.run(_version, on_error="return")
        for worker, version in versions.items():
            if version != __version__:
                version = version if isinstance(version, str) else "missing"
                raise InputError(
                    f"{where}: at worker {worker} hotlever is {version}, expected {__version__}"
                )
        yield client


def _version() -> str:
    return __version__
