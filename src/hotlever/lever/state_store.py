"""States of a slow bias ramp kept on disk, so that an interrupted sweep goes on where it was."""

from __future__ import annotations

import hashlib
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.errors import InputError
from hotlever.files import output_folder, whole_file
from hotlever.lever.continuation import State


class StateStore:
    """A folder with one file for each bias.

    Parameters
    ----------
    folder : Path
        Parent of the store's own folder.
    facts : dict
        Everything a state depends on; another set of facts makes another store.

    Attributes
    ----------
    folder : Path
    """

    def __init__(self, folder: Path, facts: dict[str, Any]) -> None:
        content = json.dumps(facts, sort_keys=True).encode()
        self.folder = folder / f"states-{hashlib.sha256(content).hexdigest()[:32]}"

    def _path(self, bias: float) -> Path:
        return self.folder / f"bias_{bias!r}V.npz"

    def save(self, state: State, notes: list[str]) -> None:
        """Keep a state and what is to be said of it; if that fails, it is no reason to stop."""
        try:
            output_folder(self.folder)
            with whole_file(self._path(state.bias)) as temporary:
                np.savez(
                    temporary,
                    x=state.x,
                    tangent=state.tangent,
                    numbers=np.array([state.bias, state.tip, state.iterations]),
                    notes=np.array(notes, dtype=str),
                )
        except (InputError, OSError):
            return

    def load(self, bias: float) -> tuple[State, list[str]] | None:
        """Return the state at a bias, and its notes; None if there is none that can be read."""
        path = self._path(bias)
        if not path.is_file():
            return None
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
                kept, tip, iterations = stored["numbers"].tolist()
                state = State(stored["x"], stored["tangent"], kept, tip, int(iterations))
                return state, stored["notes"].tolist()
        except (OSError, ValueError, KeyError, zipfile.BadZipFile, EOFError):
            path.unlink(missing_ok=True)
            return None
