"""Names of types that stand in many places."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]
# Of any type, which a function gives as it takes it.
T = TypeVar("T")
# Told the steps done and their number.
Progress = Callable[[int, int], None]


class LinearSolver(Protocol):
    """A factorised matrix."""

    def solve(self, right_hand_side: Array, transposed: bool = False) -> Array:
        """Solve for one right-hand side (n,) or several (n, k), or with the transposed matrix."""
        ...
