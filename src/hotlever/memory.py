"""Freed memory that goes back to the system."""

from __future__ import annotations

import ctypes
from contextlib import suppress


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
