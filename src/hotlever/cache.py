"""Computed arrays kept on disk, so that a geometry is worked out once.

A file holds the arrays of one result under a name made of everything they depend on. Files are
written whole, so two processes may write the same one; a damaged file is made anew.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import platformdirs
from numpy.typing import NDArray

from hotlever.errors import InputError
from hotlever.files import output_folder, whole_file

#: Environment variable that moves the cache; empty switches it off.
CACHE_VARIABLE = "HOTLEVER_CACHE"

Arrays = dict[str, NDArray[Any]]
T = TypeVar("T")


def cache_folder() -> Path | None:
    """Return where results are kept; None if the cache is switched off."""
    chosen = os.environ.get(CACHE_VARIABLE)
    if chosen == "":
        return None
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("hotlever"))


def cache_file(kind: str, facts: Mapping[str, Any]) -> Path | None:
    """Return the file of a result of some kind; None if the cache is switched off.

    Parameters
    ----------
    kind : str
        Names the folder.
    facts : mapping
        Everything that the result depends on: what JSON knows, and arrays.
    """
    top = cache_folder()
    if top is None:
        return None
    content = hashlib.sha256()
    for name in sorted(facts):
        fact = facts[name]
        content.update(name.encode())
        if isinstance(fact, np.ndarray):
            content.update(fact.round(9).tobytes() if fact.dtype.kind == "f" else fact.tobytes())
        else:
            content.update(json.dumps(fact, sort_keys=True).encode())
    return top / kind / f"{content.hexdigest()[:32]}.npz"


def stored(path: Path | None, make: Callable[[Arrays], T]) -> T | None:
    """Make something of a stored file's arrays.

    None if there is no file, or if it is damaged or `make` raises KeyError or ValueError for its
    content; it is then removed.
    """
    if path is None or not path.is_file():
        return None
    try:
        # opened here: np.load leaves a file it cannot read open
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return make(dict(arrays))
    except (OSError, ValueError, KeyError, IndexError, zipfile.BadZipFile, EOFError):
        path.unlink(missing_ok=True)
        return None


def store_arrays(path: Path | None, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a file; a cache that cannot be written is no reason to stop."""
    if path is None:
        return
    try:
        output_folder(path.parent)
        with whole_file(path) as temporary:
            np.savez(temporary, **dict[str, Any](arrays))
    except (InputError, OSError):
        return
