"""One BLAS thread where matrices are small.

The dense products and solves here have some hundred rows: a second BLAS thread gains nothing,
and on a busy machine threads that wait for each other can cost a factor of ten. Work is spread
over processes instead.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")

#: Variables that keep the linear algebra of a new process on one thread.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@functools.cache
def _controller() -> ThreadpoolController:
    # made at the first call, when numpy and scipy have loaded their libraries
    return ThreadpoolController()


def one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Make a function run with one BLAS thread; the caller's setting comes back after it."""

    @functools.wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with _controller().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited


@contextmanager
def single_threaded_children() -> Iterator[None]:
    """Let processes started meanwhile do their linear algebra on one thread."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
