"""Work spread over processes: those of this machine, each at the end of a pipe."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from itertools import islice, starmap
from multiprocessing.connection import Connection
from pickle import PicklingError
from typing import Any, Protocol, TypeVar

import numpy as np

from hotlever.cache import CACHE_VARIABLE, cache_folder
from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.types import Progress

T = TypeVar("T")
# Number and arguments.
Task = tuple[int, tuple[Any, ...]]
Share = Callable[[Any], Any]
# Applies a function to each of many arguments, telling how many are done; gives the results.
Run = Callable[..., list[Any]]

#: Processes that this one starts if nothing else is said: one for each processor it may use.
PROCESSORS = (
    len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
)
#: Tasks sent to each worker: one at work, one to go on with. The others wait here.
_AHEAD = 2
#: Seconds for which there may be no workers while there is work.
_WITHOUT_WORKERS_S = 30
#: Seconds between two looks at the workers.
_LOOK_S = 5.0
#: Seconds that a process may take to start, and those after which one that gives no sign of life
#: is started again.
_START_S, _SILENT_S = 120.0, 20.0
#: Seconds between two signs of life.
_SIGN_S = 1.0
#: What a worker says: that it lives; that it is done with what it was sent, or has started.
_ALIVE, _DONE = "alive", "done"
#: Variables that keep the linear algebra of a new process on one thread.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class WorkerDiedError(Exception):
    """A worker died or was silent while it had a task."""


class Workers(Protocol):
    """Processes that do tasks, here or elsewhere."""

    def count(self) -> int:
        """Return how many tasks are done at a time; raise ComputationError if all is lost."""

    def submit(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Future[Any]:
        """Send a task; its future raises WorkerDiedError if whoever had it died."""


def run_all(
    workers: Workers, function: Callable[..., T], tasks: Iterable[tuple[Any, ...]]
) -> Iterator[tuple[int, T | HotleverError]]:
    """Apply a function to each of many arguments; give number and result as each is done.

    Only a few tasks for each worker are sent ahead. A task whose worker dies is tried again alone,
    since another one may have been the cause; if its worker dies again it gives an error, as one
    that raises does.

    Raises
    ------
    ComputationError
        If the workers are lost.
    """
    waiting: Iterator[Task] = enumerate(tasks)
    suspects: list[Task] = []
    running: dict[Future[Any], Task] = {}
    last_seen, alone = time.monotonic(), False
    while True:
        if count := workers.count():
            last_seen = time.monotonic()
        elif running and time.monotonic() > last_seen + _WITHOUT_WORKERS_S:
            raise ComputationError(
                "the scheduler has no workers left; what was done until then is written"
            )
        ahead = 1 if alone else max(1, _AHEAD * count)
        for task in islice(waiting, max(0, ahead - len(running))):
            running[workers.submit(function, task[1])] = task
        if not running:
            if alone or not suspects:
                return
            waiting, alone = iter(suspects), True
            continue
        for future in wait(running, _LOOK_S, return_when="FIRST_COMPLETED").done:
            task = running.pop(future)
            try:
                result = future.result()
            except WorkerDiedError:
                if not alone:
                    suspects.append(task)
                    continue
                result = ComputationError("every process that tried it died; too little memory?")
            except HotleverError:
                raise
            except Exception as error:
                result = _as_sent(error)
            yield task[0], result


def _as_sent(error: Exception) -> ComputationError:
    """Return what can be sent of an error that nobody foresaw: its type and words."""
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
        return _as_sent(error)


@contextmanager
def local_processes(processes: int) -> Iterator[tuple[Run, Share]]:
    """Start local processes that do tasks, and raise what these raise; one would be this one.

    The second thing given shares what is large between tasks: it is sent to each process once.

    Raises
    ------
    ComputationError
        If they cannot be started, or die again and again.
    """
    with nullcontext() if processes == 1 else local_workers(processes) as workers:

        def run(
            function: Callable[..., Any],
            tasks: list[tuple[Any, ...]],
            progress: Progress | None = None,
        ) -> list[Any]:
            tell, results = progress or (lambda done, total: None), {}
            tell(0, len(tasks))
            here = enumerate(starmap(function, tasks))
            for number, result in here if workers is None else run_all(workers, function, tasks):
                if isinstance(result, HotleverError):
                    raise result
                results[number] = result
                tell(len(results), len(tasks))
            return [results[number] for number in range(len(tasks))]

        yield run, (lambda value: value) if workers is None else workers.share


# --- this side of the pipes -----------------------------------------------------------------------


@contextmanager
def local_workers(processes: int) -> Iterator[LocalWorkers]:
    """Start local worker processes with one BLAS thread each; they end with the block.

    They are started by spawn: a script that calls this needs ``if __name__ == "__main__"``. Nobody
    else can reach them, for they listen to their pipes alone. One that dies or is stopped is
    started again.

    Raises
    ------
    ComputationError
        If they cannot be started.
    """
    environment = dict.fromkeys(_THREADS, "1")
    with ExitStack() as stack:
        if cache_folder() is None:
            # the processes share what they make even if the user's cache is switched off
            environment[CACHE_VARIABLE] = stack.enter_context(_folder_of_this_process())
        workers = LocalWorkers(processes, environment)
        stack.callback(workers.end)
        workers.start()
        yield workers


class LocalWorkers:
    """Processes of this machine; a thread of this one waits for each of them."""

    def __init__(self, processes: int, environment: dict[str, str]) -> None:
        self._count, self._environment = processes, environment
        self._threads = ThreadPoolExecutor(processes)
        self._own = threading.local()
        self._lock = threading.Lock()
        self._processes: list[_Process] = []
        self._shared: list[Any] = []
        self._ended = False

    def count(self) -> int:
        """Return how many tasks are done at a time."""
        return self._count

    def submit(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Future[Any]:
        """Send a task; its future raises WorkerDiedError if the process that had it died."""
        return self._threads.submit(self._done, function, arguments)

    def share(self, value: Any) -> Any:
        """Return what stands for a value in the arguments of tasks."""
        self._shared.append(value)
        return _Shared(len(self._shared) - 1)

    def start(self) -> None:
        """Start the processes and wait for them.

        Raises
        ------
        ComputationError
            If they cannot be started.
        """
        started = [self._threads.submit(self._process) for _ in range(self._count)]
        try:
            for future in started:
                future.result()
        except (WorkerDiedError, RuntimeError, OSError) as error:
            raise ComputationError(
                "the worker processes could not be started; is there enough memory, and does a "
                'script that starts them have `if __name__ == "__main__"`?'
            ) from error

    def end(self) -> None:
        """End the processes, whatever they do."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        with self._lock:
            self._ended = True
            for process in self._processes:
                process.kill()
        self._threads.shutdown()

    def _done(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        try:
            return self._process().do(function, arguments, self._shared)
        except WorkerDiedError:
            self._own.process = None
            raise

    def _process(self) -> _Process:
        """Return the process of this thread, started if there is none."""
        process: _Process | None = getattr(self._own, "process", None)
        if process is None:
            with self._lock:
                if self._ended:
                    raise WorkerDiedError
                process = _Process(self._environment)
                self._processes.append(process)
            process.answer(_START_S)
            self._own.process = process
        return process


class _Process:
    """A worker process, at the other end of a pipe."""

    def __init__(self, environment: dict[str, str]) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(theirs, environment))
        with _without_interrupts(), theirs:
            self._process.start()
        self._has: set[int] = set()

    def do(
        self, function: Callable[..., Any], arguments: tuple[Any, ...], shared: list[Any]
    ) -> Any:
        """Send a task, with those shared values that were not sent before; return its result."""
        numbers = {argument.number for argument in arguments if isinstance(argument, _Shared)}
        new = {number: shared[number] for number in numbers - self._has}
        with self._watched(_SILENT_S):
            self._pipe.send((function, arguments, new))
        self._has |= numbers
        return self.answer(_SILENT_S)

    def answer(self, patience_s: float) -> Any:
        """Wait for a result as long as there are signs of life."""
        while True:
            with self._watched(patience_s):
                sign, result = self._pipe.recv()
            if sign == _DONE:
                return result

    def kill(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.join()

    @contextmanager
    def _watched(self, patience_s: float) -> Iterator[None]:
        """Kill the process if it does not go along in time: a stopped one reads nothing."""
        watch = threading.Timer(patience_s, self._process.kill)
        watch.daemon = True
        watch.start()
        try:
            yield
        except (EOFError, OSError) as error:
            self.kill()
            raise WorkerDiedError from error
        finally:
            watch.cancel()


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
    """Start processes that Ctrl-C, which reaches all of a terminal, leaves to us."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# --- the other side -------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Shared:
    """Stands in a task for a value that was sent before."""

    number: int


def _work(pipe: Connection, environment: dict[str, str]) -> None:
    """Do the tasks that come through a pipe, until nobody is at its other end."""
    os.environ.update(environment)
    # freeing a large block once teaches glibc to keep the memory of intermediate arrays
    np.empty(2_000_000)
    lock, shared = threading.Lock(), dict[int, Any]()

    def send(sign: str, result: Any = None) -> None:
        with lock:
            pipe.send((sign, result))

    def live() -> None:
        while True:
            try:
                send(_ALIVE)
            except OSError:
                # whoever waits for the result is gone, and with it the reason to work
                os._exit(1)
            time.sleep(_SIGN_S)

    threading.Thread(target=live, daemon=True).start()
    with suppress(EOFError, OSError):
        send(_DONE)
        while True:
            try:
                function, arguments, new = pipe.recv()
            except (AttributeError, ImportError) as error:
                # a class of a notebook, say
                send(_DONE, InputError(f"{error}: expected it in a module that can be imported"))
                return
            shared.update(new)
            values = (shared[a.number] if isinstance(a, _Shared) else a for a in arguments)
            result = guarded(function, tuple(values))
            try:
                send(_DONE, result)
            except (TypeError, ValueError, AttributeError, PicklingError) as error:
                send(_DONE, _as_sent(error))
