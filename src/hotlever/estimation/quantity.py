"""What may be asked of an estimate: a number that a lever has, by its prediction and parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hotlever.types import Array

#: Where predictions have the tip temperature; see `hotlever.datasets.OBSERVABLES`.
TIP = 2


class Quantity(Protocol):
    """A number that follows from a lever."""

    def value(self, values: Array, parameters: Array) -> float:
        """Return it for predicted values (3, n) and the varied parameters (p,)."""
        ...

    def gradient(self, slopes: Array) -> Array:
        """Return its derivatives by the parameters, (p,), for those of the values (3, n, p)."""
        ...


@dataclass(frozen=True)
class TipTemperature:
    """The tip temperature (K) at a row of the data."""

    row: int

    def value(self, values: Array, parameters: Array) -> float:
        """See `Quantity`."""
        return float(values[TIP, self.row])

    def gradient(self, slopes: Array) -> Array:
        """See `Quantity`."""
        return np.asarray(slopes[TIP, self.row])


@dataclass(frozen=True)
class ParameterValue:
    """One of the varied parameters, by its number, in its own unit."""

    number: int

    def value(self, values: Array, parameters: Array) -> float:
        """See `Quantity`."""
        return float(parameters[self.number])

    def gradient(self, slopes: Array) -> Array:
        """See `Quantity`."""
        return np.asarray(np.arange(slopes.shape[-1]) == self.number, dtype=float)


@dataclass(frozen=True)
class Pull:
    """A further datum that pulls a quantity to a value, by an error in its unit.

    The optimum with it lies on the profile likelihood of the quantity: of all levers with its
    value there, it is the one nearest to data and priors.
    """

    quantity: Quantity
    target: float
    error: float
