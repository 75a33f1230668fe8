"""Uncertainty budgets after the GUM (JCGM 100:2008), and their check after JCGM 101:2008."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, WrapValidator
from scipy.special import stdtrit

from hotlever.records import Number
from hotlever.types import Array, Index

#: Trials of a block, and the most of all blocks (JCGM 101, 7.9.4 and 7.2.1).
_BLOCK, _MOST_TRIALS = 10_000, 1_000_000
#: Ends of an interval are settled within this share of the tolerance that a budget is judged by
#: (JCGM 101, 8.2).
_SETTLED = 0.2

# Infinite where a file has none.
_Dof = Annotated[
    float,
    Field(gt=0),
    WrapValidator(lambda dof, check: math.inf if dof is None else check(dof)),
]


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
        Degrees of freedom; infinite (in files: none) if the uncertainty is taken as exact, NaN if
        it is not known how many it has.
    """

    quantity: str
    estimate: Number
    unit: str
    u: Annotated[float, Field(ge=0)]
    type: Literal["A", "B"]
    distribution: str
    sensitivity: Number
    dof: _Dof = math.inf

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

    def largest_first(self) -> Budget:
        """Return the same with the largest contributions first."""
        return self.part(np.argsort([-row.contribution for row in self.inputs], kind="stable"))

    def part(self, numbers: Index) -> Budget:
        """Return what some of the inputs, by their numbers, contribute."""
        inputs = tuple(self.inputs[number] for number in numbers)
        correlation = self.correlation
        return Budget(
            inputs, None if correlation is None else correlation[np.ix_(numbers, numbers)]
        )

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

    @property
    def tolerance(self) -> float:
        """Half a unit of the first significant digit of u (JCGM 101, 7.9.2); NaN without one.

        The digit is that of u before it is rounded, so that 9.6 does not count as 10.

        Examples
        --------
        >>> row = InputQuantity("x", 0.0, "K", 17.0, "B", "normal", 1.0)
        >>> Budget((row,)).tolerance
        5.0
        """
        positive = self.u > 0.0
        return 0.5 * 10.0 ** math.floor(math.log10(self.u)) if positive else math.nan


# --- Monte Carlo --------------------------------------------------------------------------------


@dataclass(frozen=True)
class CoverageInterval:
    """What the Monte Carlo method says of a measurand.

    Attributes
    ----------
    trials : int
    low, high : float
        The probabilistically symmetric coverage interval.
    """

    trials: int
    low: float
    high: float

    def agrees(self, other: tuple[float, float], tolerance: float) -> bool:
        """Whether both ends are those of another interval within a tolerance (JCGM 101, 8.1)."""
        ends = abs(self.low - other[0]), abs(self.high - other[1])
        return all(end <= tolerance for end in ends)

    def united(self, other: CoverageInterval) -> CoverageInterval:
        """Return the interval that holds this one and another."""
        low, high = min(self.low, other.low), max(self.high, other.high)
        return CoverageInterval(self.trials + other.trials, low, high)


def propagate(
    draw: Callable[[int], Array], tolerance: float, probability: float = 0.95
) -> CoverageInterval:
    """Propagate distributions by as many trials as it takes (JCGM 101, 7.9.4).

    Parameters
    ----------
    draw : callable
        Return so many independent values of the measurand, (n,).
    tolerance : float
        By which a budget will be judged: blocks are added until two standard deviations of the
        mean of both ends are within a fifth of it.
    probability : float
        Of coverage.
    """
    tails = 0.5 * (1.0 - probability), 0.5 * (1.0 + probability)
    blocks = [draw(_BLOCK)]
    ends = [np.quantile(blocks[0], tails)]
    while len(blocks) * _BLOCK < _MOST_TRIALS:
        blocks.append(draw(_BLOCK))
        ends.append(np.quantile(blocks[-1], tails))
        spread = 2.0 * np.std(ends, axis=0, ddof=1).max() / math.sqrt(len(ends))
        if not spread > _SETTLED * tolerance:
            break
    low, high = np.quantile(np.concatenate(blocks), tails).tolist()
    return CoverageInterval(len(blocks) * _BLOCK, low, high)
