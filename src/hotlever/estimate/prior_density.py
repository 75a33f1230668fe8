"""What is known beforehand of the parameters that are estimated, and the coordinates it gives them.

What is known is one normal density. A search moves the logarithms of what is known to a share or a
factor, for such priors are normal there, and the others as they are: without a prior data may leave
a doping open down to nothing, which is near by in the parameter itself and without end in its
logarithm.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from hotlever.materials.parameters import Parameter
from hotlever.probe import Probe
from hotlever.probe.priors import SCALES, Prior
from hotlever.probe.probe_parameters import parameters_of
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
    def of_priors(cls, priors: Mapping[str, Prior]) -> PriorDensity:
        """Return the density of priors of single parameters; those of scales are no part of it."""
        priors = {name: prior for name, prior in priors.items() if name not in SCALES}
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
            block_diag(self.whitening, other.whitening),
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


#: That of an estimate before which nothing is known.
FLAT = PriorDensity.of_priors({})


@dataclass(frozen=True)
class Coordinates:
    """A point for the values of some parameters.

    Attributes
    ----------
    parameters : tuple of Parameter
    positive : ndarray of bool, shape (p,)
        Whose logarithm is the coordinate; that of the others is the value over its scale.
    scale : ndarray, shape (p,)
    """

    parameters: tuple[Parameter, ...]
    positive: NDArray[np.bool_]
    scale: Array

    @classmethod
    def of(cls, probe: Probe, names: Sequence[str], relative: Collection[str] = ()) -> Coordinates:
        """Return the coordinates of some parameters of a probe, of which some are known so."""
        every = parameters_of(probe, anywhere=True)
        parameters = tuple(every[name] for name in names)
        positive = np.array(
            [each.lower > 0 and each.name in relative for each in parameters], dtype=bool
        )
        return cls(parameters, positive, np.array([each.scale for each in parameters]))

    def point(self, values: Array) -> Array:
        """Return the point of some values, (..., p)."""
        share = values / self.scale
        return np.where(self.positive, np.log(np.where(self.positive, share, 1.0)), share)

    def values(self, point: Array) -> Array:
        """Return the values of a point, (..., p)."""
        share = np.where(self.positive, np.exp(np.where(self.positive, point, 0.0)), point)
        return np.asarray(share * self.scale)

    def rates(self, point: Array) -> Array:
        """Return the derivatives of the values by their coordinates, (..., p)."""
        return np.where(self.positive, self.values(point), self.scale)

    @property
    def bounds(self) -> Array:
        """The points of the parameters' lower and upper bounds, (2, p)."""
        return self.point(np.array([[each.lower, each.upper] for each in self.parameters]).T)

    def room(self, point: Array) -> Array:
        """Return what changes parameters by as much as themselves, or a tenth of their scale."""
        return np.where(self.positive, 1.0, np.maximum(np.abs(point), 0.1))
