"""Freed memory that goes back to the system."""

from __future__ import annotations

import ctypes
from contextlib import suppress

#: The number of a parameter of the GNU library's `mallopt`, in its ``malloc.h``.
_M_MMAP_THRESHOLD = -3


def give_back(block_bytes: int = 2**20) -> None:
    """Return freed memory to the system, where its C library can.

    The GNU library keeps what sparse factorisations of many sizes have used: after some twenty
    fits of different levers a process had 3 GB, of which 0.2 were in use.

    Parameters
    ----------
    block_bytes : int
        From this size on blocks go back as soon as they are freed, from now on. By itself the
        library comes to keep them up to 32 MB, in pieces between others that are still in use: a
        search in air had 2.1 GB, of which 0.4 were in use.
    """
    # not found: AttributeError; no library of that kind: TypeError or OSError
    with suppress(AttributeError, OSError, TypeError):
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, block_bytes)
        library.malloc_trim(0)
