"""Computed arrays kept on disk, so that a geometry is worked out once.

A file holds the arrays of one result under a name made of everything they depend on, the code
included. Files are written whole, so two processes may write the same one; a damaged file is made
anew. Those that were not used for longest go when all together become too large.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from hotlever import __version__
from hotlever.errors import HotleverError, InputError
from hotlever.files import output_folder, whole_file
from hotlever.types import T

#: Environment variable that moves the cache; empty switches it off.
CACHE_VARIABLE = "HOTLEVER_CACHE"
#: Packages whose code makes what is kept.
_MAKERS = ("tables", "materials", "probe", "air", "contact", "lever")


def cache_folder() -> Path | None:
    """Return where results are kept; None if the cache is switched off."""
    chosen = os.environ.get(CACHE_VARIABLE)
    if chosen == "":
        return None
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("hotlever"))


def cache_file(kind: str, facts: Mapping[str, Any]) -> Path | None:
    """Return the file of a result, in the folder of its kind; None if the cache is switched off.

    The facts are everything that it depends on, but the code: what JSON knows, and arrays.
    """
    top = cache_folder()
    if top is None:
        return None
    content = hashlib.sha256(_code())
    for name in sorted(facts):
        fact = facts[name]
        content.update(name.encode())
        if isinstance(fact, np.ndarray):
            content.update(fact.round(9).tobytes() if fact.dtype.kind == "f" else fact.tobytes())
        else:
            content.update(json.dumps(fact, sort_keys=True).encode())
    return top / kind / f"{content.hexdigest()[:32]}.npz"


@functools.cache
def _code() -> bytes:
    """Return a digest of the code that makes what is kept."""
    return code_digest(Path(__file__).parent)


def code_digest(package: Path) -> bytes:
    """Return a digest of the packages that make what is kept, and of the modules beside them.

    All that these import of the rest is among the modules.
    """
    content = hashlib.sha256(__version__.encode())
    inside = (file for name in _MAKERS for file in (package / name).rglob("*.py"))
    for file in sorted([*package.glob("*.py"), *inside]):
        content.update(f"{file.relative_to(package)}\n".encode())
        content.update(file.read_bytes())
    return content.digest()


def stored(path: Path | None, make: Callable[[dict[str, NDArray[Any]]], T]) -> T | None:
    """Make something of a stored file's arrays; None if there is no file.

    None, too, if it is damaged or `make` raises for its content; it is then removed.
    """
    if path is None:
        return None
    try:
        # opened here: np.load leaves a file it cannot read open
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            content = make(dict(arrays))
    except (FileNotFoundError, PermissionError):
        return None
    except Exception:
        # zip, zlib, struct, tokenize: what a damaged file raises has no end
        with suppress(OSError):
            path.unlink()
        return None
    with suppress(OSError):
        os.utime(path)
    return content


def store_arrays(path: Path | None, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a file; a cache that cannot be written is no reason to stop.

    Raises
    ------
    InputError
        As `largest_size`.
    """
    if path is None:
        return
    most = largest_size()
    with suppress(HotleverError, OSError):
        output_folder(path.parent)
        with whole_file(path) as temporary:
            np.savez(temporary, **dict[str, Any](arrays))
    size = 0
    for status, file in sorted(kept_files(path.parents[1]), key=lambda file: -file[0].st_mtime):
        size += status.st_size
        if size > most:
            with suppress(OSError):
                file.unlink()


def largest_size() -> float:
    """Return how large the cache may be (bytes).

    Raises
    ------
    InputError
        If the environment gives no number of 0 or more.
    """
    variable = "HOTLEVER_CACHE_GB"
    text = os.environ.get(variable) or "2"
    with suppress(ValueError):
        if float(text) >= 0:
            return 1e9 * float(text)
    raise InputError(f"{variable} = {text}: expected a number of gigabytes, 0 or more")


def kept_files(top: Path) -> list[tuple[os.stat_result, Path]]:
    """Return the files of a cache folder, and their sizes and times."""
    files = []
    with suppress(OSError):
        for path in top.glob("*/*.npz"):
            # a folder that the user chose may hold other files too
            if re.fullmatch(r"[0-9a-f]{32}|\.hotlever-\w+", path.stem):
                with suppress(OSError):
                    files.append((path.stat(), path))
    return files
