"""What is known beforehand of the parameters that are estimated, as one normal density."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.probe.priors import Prior
from hotlever.types import Array


@dataclass(frozen=True)
class PriorDensity:
    """A normal density of several parameters or their logarithms: priors, or an earlier estimate.

    Attributes
    ----------
    names : tuple of str
    values : ndarray, shape (p,)
    relative : ndarray of bool, shape (p,)
        Whose logarithm is normal; the others may be of either sign.
    whitening : ndarray, shape (p, p)
        Makes uncorrelated standard deviations of distances from the values.
    sources : tuple of str
        What each of these (p,) deviations is known from: a prior, by its parameter, or ``fit``.
    """

    names: tuple[str, ...]
    values: Array
    relative: NDArray[np.bool_]
    whitening: Array
    sources: tuple[str, ...]

    @classmethod
    def independent(cls, priors: Mapping[str, Prior]) -> PriorDensity:
        """Return the density of priors of single parameters."""
        spreads = np.array([prior.spread for prior in priors.values()])
        return cls(
            tuple(priors),
            np.array([prior.value for prior in priors.values()]),
            np.array([prior.relative for prior in priors.values()], dtype=bool),
            np.diag(1.0 / spreads),
            tuple(priors),
        )

    @classmethod
    def of_estimate(
        cls, names: Sequence[str], values: Array, covariance: Array, relative: NDArray[np.bool_]
    ) -> PriorDensity:
        """Return what an estimate leaves, with its covariance (p, p) in the parameters' units."""
        unit = np.where(relative, values, 1.0)
        factor = np.linalg.cholesky(covariance / np.outer(unit, unit))
        whitening = np.asarray(np.linalg.inv(factor))
        return cls(tuple(names), values, relative, whitening, ("fit",) * len(names))

    def beside(self, other: PriorDensity) -> PriorDensity:
        """Return the density of these and of other parameters, independent of each other."""
        return PriorDensity(
            self.names + other.names,
            np.append(self.values, other.values),
            np.append(self.relative, other.relative),
            np.block(
                [
                    [self.whitening, np.zeros((len(self.names), len(other.names)))],
                    [np.zeros((len(other.names), len(self.names))), other.whitening],
                ]
            ),
            self.sources + other.sources,
        )

    def deviations(self, values: Array) -> Array:
        """Return how far values are from the density's, in uncorrelated standard deviations."""
        ratio = np.where(self.relative, values, 1.0) / np.where(self.relative, self.values, 1.0)
        away = np.where(self.relative, np.log(ratio), values - self.values)
        return np.asarray(self.whitening @ away)

    def slopes(self, values: Array) -> Array:
        """Return the derivatives of `deviations` by the values, (p, p)."""
        return np.asarray(self.whitening / np.where(self.relative, values, 1.0))
