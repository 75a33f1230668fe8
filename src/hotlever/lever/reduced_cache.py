"""Reduced levers on disk, so that a geometry is reduced once.

A file holds modes, lift and quadrature rule of one geometry, under a name made of everything they
depend on: layout, mesh, base temperature, options and version. Files are written whole, so two
processes may write the same one; a damaged file is made anew.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs

from hotlever import __version__
from hotlever.errors import InputError
from hotlever.files import output_folder, whole_file
from hotlever.lever.lever import Lever
from hotlever.lever.reduced import ReducedSpace, ReductionOptions, reduce

#: Environment variable that moves the cache; empty switches it off.
CACHE_VARIABLE = "HOTLEVER_CACHE"
_ARRAYS = ("basis", "count", "lift", "points", "weights")


def cached_reduction(
    lever: Lever,
    options: ReductionOptions | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ReducedSpace:
    """Return the reduced space of a lever's geometry, from the cache or made and cached.

    Parameters
    ----------
    lever : Lever
    options : ReductionOptions, optional
    progress : callable, optional
        Called while a space is made, with parameter sets done and their number.
    """
    options = options or ReductionOptions()
    folder = cache_folder()
    if folder is None:
        return reduce(lever, options, progress)
    path = folder / f"{_key(lever, options)}.npz"
    space = _load(lever, path)
    if space is None:
        space = reduce(lever, options, progress)
        _save(space, path)
    return space


def cache_folder() -> Path | None:
    """Return where reduced levers are kept; None if the cache is switched off."""
    chosen = os.environ.get(CACHE_VARIABLE)
    if chosen == "":
        return None
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("hotlever")) / "reduced"


def _key(lever: Lever, options: ReductionOptions) -> str:
    mesh = lever.space.mesh.elements
    content = hashlib.sha256()
    facts = {
        "version": __version__,
        "shape": lever.probe.shape.model_dump(),
        "tip": lever.probe.tip and lever.probe.tip.model_dump(),
        "base_temperature_K": lever.probe.circuit.base_temperature_K,
        "n_hd": lever.probe.material.n_hd,
        "options": asdict(options),
    }
    content.update(json.dumps(facts, sort_keys=True).encode())
    content.update(np.round(mesh.p, 9).tobytes() + mesh.t.tobytes())
    content.update(lever.space.operators.positions.round(9).tobytes())
    return content.hexdigest()[:32]


def _save(space: ReducedSpace, path: Path) -> None:
    """Write a space; a cache that cannot be written is no reason to stop."""
    try:
        output_folder(path.parent)
        with whole_file(path) as temporary:
            np.savez(temporary, **dict[str, Any](zip(_ARRAYS, space.arrays(), strict=True)))
    except (InputError, OSError):
        return


def _load(lever: Lever, path: Path) -> ReducedSpace | None:
    """Read a space; None if there is none, or its file is damaged (which is then removed)."""
    if not path.is_file():
        return None
    try:
        # opened here: np.load leaves a file it cannot read open
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays = [stored[name] for name in _ARRAYS]
        return ReducedSpace.from_arrays(lever, *arrays)
    except (OSError, ValueError, KeyError, IndexError, zipfile.BadZipFile, EOFError):
        path.unlink(missing_ok=True)
        return None
