"""What a search moves: logarithms of what is known to a share or a factor, the others as they are.

Such priors are normal distributions of logarithms. Without a prior data may leave a doping open
down to nothing, which is near by in the parameter itself and without end in its logarithm.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.materials.parameters import Parameter
from hotlever.probe import Probe
from hotlever.probe.parameters import parameters_of
from hotlever.types import Array


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
