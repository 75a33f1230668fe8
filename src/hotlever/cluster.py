"""Work spread over the workers of a cluster, by its Dask scheduler."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from typing import Any

import dask
from distributed import CancelledError, Client, KilledWorker

from hotlever import __version__
from hotlever.errors import ComputationError, InputError
from hotlever.files import read_text
from hotlever.processes import Patience, WorkerDiedError, guarded


class ClusterExecutor:
    """The workers that a scheduler has."""

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
        If nothing answers at the address, or a worker has another version or none.
    """
    where = f"--scheduler {address}"
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
