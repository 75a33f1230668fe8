"""Bayesian optimal design: the measurements after which a quantity is known best.

About an estimate everything is taken as linear (Laplace's approximation): each unknown has a prior,
each row of data adds its share to the Fisher information, whatever value it will show, and a
quantity of gradient g has the variance gᵀ M⁻¹ g. A design that makes this least is c-optimal
(Chaloner and Verdinelli, Statistical Science 10, 273 (1995)); it is found greedily, one measurement
after the other, since a laboratory looks at the result of each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from hotlever.estimate.posterior import standard_errors
from hotlever.types import Array


@dataclass(frozen=True)
class Information:
    """The Fisher information of some unknowns.

    Attributes
    ----------
    matrix : ndarray, shape (q, q)
        That of priors and data; positive definite.

    Examples
    --------
    >>> information = Information(np.eye(2)).with_rows(np.array([[1.0, 0.0]]))
    >>> information.stderr(np.array([[1.0, 0.0], [0.0, 2.0]])).round(4).tolist()
    [0.7071, 2.0]
    """

    matrix: Array

    @property
    def covariance(self) -> Array:
        """Covariance of the unknowns, (q, q)."""
        return np.asarray(np.linalg.inv(self.matrix))

    def with_rows(self, rows: Array) -> Information:
        """Return it after data with these derivatives, over their standard errors, (n, q)."""
        return Information(self.matrix + rows.T @ rows)

    def stderr(self, gradients: Array) -> Array:
        """Return standard errors of quantities with gradients (..., q)."""
        return standard_errors(gradients, self.covariance)


@dataclass(frozen=True)
class Candidate:
    """A measurement that could be made.

    Attributes
    ----------
    kind : str
    rows : ndarray, shape (n, q)
        Derivatives of what it shows by the unknowns, over its standard errors.
    cost : float
    again : bool
        Whether it may be made several times.
    """

    kind: str
    rows: Array
    cost: float = 1.0
    again: bool = True

    def variance_after(self, covariance: Array, gradient: Array) -> float:
        """Return the variance of a quantity after the measurement (Woodbury's identity)."""
        covariances, seen = self.rows @ covariance @ gradient, self.rows @ covariance @ self.rows.T
        reduction = covariances @ np.linalg.solve(np.eye(len(seen)) + seen, covariances)
        return float(gradient @ covariance @ gradient - reduction)


def best_first(
    information: Information,
    candidates: Sequence[Candidate],
    gradient: Array,
    count: int,
    most: Mapping[str, int] | None = None,
) -> list[int]:
    """Return the numbers of the candidates to measure, best first.

    Parameters
    ----------
    information : Information
    candidates : sequence of Candidate
    gradient : ndarray, shape (q,)
        Of the quantity whose standard error is lessened, by as much as possible for its cost.
    count : int
        So many, or fewer if no more are allowed.
    most : mapping of str to int, optional
        How many of a kind are allowed; any number of a kind that is not named.
    """
    chosen: list[int] = []
    left = dict(most or {})
    while len(chosen) < count:
        covariance = information.covariance
        before = float(standard_errors(gradient, covariance))
        gains = {
            number: (before - np.sqrt(each.variance_after(covariance, gradient))) / each.cost
            for number, each in enumerate(candidates)
            if left.get(each.kind, 1) > 0 and (each.again or number not in chosen)
        }
        if not gains:
            break
        best = max(gains, key=gains.__getitem__)
        chosen.append(best)
        kind = candidates[best].kind
        left |= {kind: left[kind] - 1} if kind in left else {}
        information = information.with_rows(candidates[best].rows)
    return chosen


@dataclass(frozen=True)
class NoiseLaw:
    """Noise of an instrument: one part is the same everywhere, one in proportion to what it shows.

    Attributes
    ----------
    constant : float
        In the unit of what is shown.
    share : float
    """

    constant: float
    share: float

    @classmethod
    def of(cls, errors: Array, values: Array) -> NoiseLaw:
        """Return the law of standard errors (n,) of data that show values (n,).

        Examples
        --------
        >>> law = NoiseLaw.of(np.array([0.5, 1.3]), np.array([0.0, 120.0]))
        >>> round(law.constant, 6), round(law.share, 6)
        (0.5, 0.01)
        """
        columns = np.stack([np.ones(values.size), values**2], axis=1) / errors[:, None] ** 2
        unit = np.max(columns, axis=0)
        variances, _ = nnls(columns / np.where(unit > 0, unit, 1.0), np.ones(values.size))
        constant, share = np.sqrt(variances / np.where(unit > 0, unit, 1.0)).tolist()
        return cls(constant, share)

    def at(self, values: Array) -> Array:
        """Return the standard errors of data that show values (n,)."""
        return np.hypot(self.constant, self.share * values)
