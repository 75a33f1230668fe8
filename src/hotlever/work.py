"""Work that takes long: told step by step, in one BLAS thread, its memory given back."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
from typing import ParamSpec

from threadpoolctl import ThreadpoolController

from hotlever.types import Progress, T

P = ParamSpec("P")


def each(items: Collection[T], progress: Progress | None) -> Iterator[T]:
    """Give items one after the other, and tell how many are done."""
    for done, item in enumerate(items, start=1):
        yield item
        if progress is not None:
            progress(done, len(items))


def one_blas_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Make a function run with one BLAS thread; the caller's setting comes back after it.

    The dense products and solves here have some hundred rows: a second BLAS thread gains nothing,
    and on a busy machine threads that wait for each other can cost a factor of ten. Work is spread
    over processes instead.
    """

    @functools.wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> T:
        with _controller().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited


@functools.cache
def _controller() -> ThreadpoolController:
    # made at the first call, when numpy and scipy have loaded their libraries
    return ThreadpoolController()


def give_back(block_bytes: int = 2**20, top_bytes: int = 2**26) -> None:
    """Return freed memory to the system, where its C library can.

    The GNU library keeps what sparse factorisations of many sizes have used: after some twenty
    fits of different levers a process had 3 GB, of which 0.2 were in use.

    Parameters
    ----------
    block_bytes : int
        From this size on blocks go back as soon as they are freed, from now on. By itself the
        library comes to keep them up to 32 MB, in pieces between others that are still in use: a
        search in air had 2.1 GB, of which 0.4 were in use.
    top_bytes : int
        So much stays at the end of what smaller blocks are taken from, for the next ones: what goes
        back is cleared by the system when it is taken again, which cost a tenth of a fit.
    """
    # not found: AttributeError; no library of that kind: TypeError or OSError
    with suppress(AttributeError, OSError, TypeError):
        library = ctypes.CDLL(None)
        # -3 is M_MMAP_THRESHOLD in the library's malloc.h, and -1 M_TRIM_THRESHOLD
        library.mallopt(-3, block_bytes)
        library.mallopt(-1, top_bytes)
        library.malloc_trim(0)
