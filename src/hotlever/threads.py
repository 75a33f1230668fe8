"""One BLAS thread where matrices are small.

The dense products and solves here have some hundred rows: a second BLAS thread gains nothing,
and on a busy machine threads that wait for each other can cost a factor of ten. Work is spread
over processes instead.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec

from threadpoolctl import ThreadpoolController

from hotlever.types import T

P = ParamSpec("P")


@functools.cache
def _controller() -> ThreadpoolController:
    # made at the first call, when numpy and scipy have loaded their libraries
    return ThreadpoolController()


def one_blas_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Make a function run with one BLAS thread; the caller's setting comes back after it."""

    @functools.wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> T:
        with _controller().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
