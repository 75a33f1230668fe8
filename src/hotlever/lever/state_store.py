"""States of a slow bias ramp kept on disk, so that an interrupted sweep goes on where it was."""

from __future__ import annotations

from typing import Any

import numpy as np

from hotlever.cache import cache_file, store_arrays, stored
from hotlever.lever.continuation import State


class StateStore:
    """The states of one lever in the cache, one file for each bias.

    Parameters
    ----------
    facts : dict
        Everything a state depends on but the bias; see `hotlever.cache.cache_file`.
    """

    def __init__(self, facts: dict[str, Any]) -> None:
        self._facts = facts

    def save(self, state: State, notes: list[str]) -> None:
        """Keep a state and what is to be said of it."""
        arrays = {
            "x": state.x,
            "tangent": state.tangent,
            "numbers": np.array([state.bias, state.tip, state.iterations]),
            "notes": np.array(notes, dtype=str),
        }
        store_arrays(self._file(state.bias), arrays)

    def load(self, bias: float) -> tuple[State, list[str]] | None:
        """Return the state at a bias, and its notes; None if there is none that can be read."""

        def read(arrays: dict[str, Any]) -> tuple[State, list[str]]:
            kept, tip, iterations = arrays["numbers"].tolist()
            state = State(arrays["x"], arrays["tangent"], kept, tip, int(iterations))
            return state, arrays["notes"].tolist()

        return stored(self._file(bias), read)

    def _file(self, bias: float) -> Any:
        return cache_file("states", {**self._facts, "bias_V": bias})
