"""Linear maps from the unknowns of a lever to fields at points, and back to the weak equations."""

from __future__ import annotations

from typing import Any

import numpy as np

from hotlever.types import Array, Index


class LinearMap:
    """From unknowns to a field and its slopes at the quadrature points, and back.

    Parameters
    ----------
    matrix : matrix, shape (kinds × points, columns)
        Sparse or dense; first the values (where there are any), then the slope along each axis.
    kinds : int
    columns : slice
        The unknowns that matter.
    """

    def __init__(self, matrix: Any, kinds: int, columns: slice = slice(None)) -> None:
        self.matrix, self.kinds, self.columns = matrix, kinds, columns
        self._transposed = matrix.T.tocsr() if hasattr(matrix, "tocsr") else matrix.T
        self._of_values: Any = None

    def among(self, points: Index) -> LinearMap:
        """Return the same dense map to some of the points."""
        rows = self.matrix.reshape(self.kinds, -1, self.matrix.shape[1])[:, points]
        return LinearMap(rows.reshape(-1, rows.shape[2]), self.kinds, self.columns)

    def integrands(self, samples: Array) -> Array:
        """Return what a dense map integrates to test samples (kinds, points), (columns, points).

        Given may be the first of the kinds alone.
        """
        rows = self.matrix.reshape(self.kinds, samples.shape[1], -1)[: len(samples)]
        return np.asarray(np.einsum("dqm,dq->mq", rows, samples))

    def at_points(self, x: Array) -> Array:
        """Return the samples (kinds, points, ...) of states (size + 1, ...)."""
        chosen = x[self.columns]
        samples = np.asarray(self.matrix @ chosen.reshape(len(chosen), -1))
        return samples.reshape(self.kinds, -1, *x.shape[1:])

    def tested(self, samples: Array) -> Array:
        """Return what weighted samples (kinds, points, ...) do to each unknown (columns, ...)."""
        rows = self._transposed.shape[1]
        tested = np.asarray(self._transposed @ samples.reshape(rows, -1))
        return tested.reshape(-1, *samples.shape[2:])

    def values_tested(self, samples: Array) -> Array:
        """Return the same of weighted samples of the value alone, (points, ...)."""
        if self._of_values is None:
            self._of_values = self._transposed[:, : len(samples)]
        tested = np.asarray(self._of_values @ samples.reshape(len(samples), -1))
        return tested.reshape(-1, *samples.shape[1:])
