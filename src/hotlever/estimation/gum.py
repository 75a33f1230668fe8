"""Uncertainty budgets after the GUM (JCGM 100:2008)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import stdtrit

from hotlever.types import Array


@dataclass(frozen=True)
class InputQuantity:
    """A row of a budget.

    Attributes
    ----------
    quantity : str
    estimate : float
    unit : str
    u : float
        Standard uncertainty, in the unit.
    type : {"A", "B"}
        Evaluated from a series of observations, or by other means.
    distribution : str
    sensitivity : float
        Derivative of the measurand by the quantity.
    dof : float
        Degrees of freedom; infinite if the uncertainty is taken as exact, NaN if it is not known
        how many it has.
    """

    quantity: str
    estimate: float
    unit: str
    u: float
    type: Literal["A", "B"]
    distribution: str
    sensitivity: float
    dof: float = math.inf

    @property
    def contribution(self) -> float:
        """What it adds to the standard uncertainty of the measurand (JCGM 100, 5.1.3)."""
        return abs(self.sensitivity) * self.u


@dataclass(frozen=True)
class Budget:
    """The law of propagation of uncertainty for one measurand.

    Attributes
    ----------
    inputs : tuple of InputQuantity
    correlation : ndarray, shape (n, n), optional
        Of the inputs, which are independent if it is left out.
    """

    inputs: tuple[InputQuantity, ...]
    correlation: Array | None = None

    @property
    def _parts(self) -> Array:
        return np.array([row.sensitivity * row.u for row in self.inputs])

    def covariance(self, other: Budget) -> float:
        """Return that with a measurand of the same inputs (JCGM 100, H.2.3)."""
        if self.correlation is None:
            return float(self._parts @ other._parts)
        return float(self._parts @ self.correlation @ other._parts)

    @property
    def u(self) -> float:
        """The combined standard uncertainty (JCGM 100, Eqs. 10 and 16)."""
        return math.sqrt(self.covariance(self))

    @property
    def dof(self) -> float:
        """Effective degrees of freedom after Welch and Satterthwaite (JCGM 100, Eq. G.2b).

        NaN for inputs that are correlated, of which the equation does not hold, and where those of
        an input are not known.
        """
        if self.correlation is not None:
            return math.nan
        terms = sum(row.contribution**4 / row.dof for row in self.inputs)
        return self.u**4 / terms if terms else math.inf

    def coverage_factor(self, probability: float = 0.95) -> float:
        """Return k for a coverage probability, from Student's t.

        Degrees of freedom are cut off to a whole number (JCGM 100, G.4.1); where none are known
        the distribution is taken as normal.
        """
        dof = math.inf if math.isnan(self.dof) else self.dof
        whole = max(1.0, math.floor(dof)) if math.isfinite(dof) else dof
        return float(stdtrit(whole, 0.5 * (1.0 + probability)))

    def expanded(self, probability: float = 0.95) -> float:
        """Return the expanded uncertainty."""
        return self.coverage_factor(probability) * self.u
