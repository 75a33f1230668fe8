"""A drifting zero: instruments whose reading at nothing moves while a lever is measured.

The zero of I_h and of V_r is a straight line over the order of the rows, which is that of time. It
enters linearly, so for every trial of the parameters the best one follows at once (variable
projection, Golub and Pereyra, Inverse Problems 19, R1 (2003)).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hotlever.types import Array

#: Observables that have a zero, with the unit it is given in.
ZEROED = {"current": "mA", "reader": "V"}
#: A zero is worth a note beyond this many standard errors.
_NOTICED = 7.0


class Drift:
    """Straight lines over the rows of some observables.

    Those of `ZEROED` get a line; `present`, (k, n), says which data there are. Weights, by which
    residuals are multiplied, have the same shape.
    """

    def __init__(self, observables: Sequence[str], present: NDArray[np.bool_]) -> None:
        self._present, self._names = present, tuple(observables)
        order = np.linspace(-1.0, 1.0, present.shape[1])
        self._columns = np.zeros((*present.shape, 2 * len(self._names)))
        for place, name in enumerate(self._names):
            if name in ZEROED:
                self._columns[place, :, 2 * place] = 1.0
                self._columns[place, :, 2 * place + 1] = order
        kept = np.any(self._columns, axis=(0, 1))
        self._columns = self._columns[:, :, kept]

    def line(self, difference: Array, weights: Array) -> Array:
        """Return the lines that fit a difference (data minus prediction) best, shape (k, n)."""
        matrix = (weights[..., None] * self._columns)[self._present]
        target = (weights * difference)[self._present]
        return np.asarray(self._columns @ np.linalg.lstsq(matrix, target)[0])

    def removed(self, matrix: Array, weights: Array) -> Array:
        """Return the columns of a weighted matrix, (N, m), without what lines could take up."""
        basis = np.linalg.qr((weights[..., None] * self._columns)[self._present])[0]
        return np.asarray(matrix - basis @ (basis.T @ matrix))

    def noticed(self, residual: Array, jacobian: Array, weights: Array) -> list[str]:
        """Say which observables have a zero that stands out of the scatter.

        By the weighted residual (data minus prediction, N) at the optimum without lines, and by
        what the parameters could take up instead, (N, m).
        """
        columns = (weights[..., None] * self._columns)[self._present]
        basis = np.linalg.qr(jacobian)[0]
        columns = columns - basis @ (basis.T @ columns)
        try:
            inverse = np.linalg.inv(columns.T @ columns)
        except np.linalg.LinAlgError:
            return []
        sizes = inverse @ (columns.T @ residual)
        rest = residual - columns @ sizes
        # each datum's own variance, as in the covariance of the parameters
        influence = inverse @ columns.T * rest
        errors = np.sqrt((influence**2).sum(axis=1))
        out = np.abs(sizes) > _NOTICED * errors
        return self.in_words(self._columns @ sizes, np.any(self._columns, axis=1) @ out)

    def in_words(self, line: Array, which: NDArray[np.bool_] | None = None) -> list[str]:
        """Describe lines from `line`; some of them, if not all."""
        which = np.any(self._columns, axis=(1, 2)) if which is None else which
        return [
            f"{name}: the zero goes from {first:+.3g} to {last:+.3g} {ZEROED[name]} along the file"
            for name, first, last, asked in zip(
                self._names, *line[:, [0, -1]].T, which, strict=True
            )
            if asked
        ]
