"""Uncertainty budgets after the GUM (JCGM 100:2008), and their check after JCGM 101:2008.

The rows of that of a temperature at one bias are what the standard errors by source of a table sum
up, one by one: noise of each observable, scales, priors, and what the model leaves out. They are
independent of each other, but for the parameters that a fit to other data has left. Whether a
linear budget holds is told by the Monte Carlo method.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, WrapValidator
from scipy.special import stdtrit

from hotlever.errors import ComputationError
from hotlever.estimate.experiment import TIP
from hotlever.estimate.objective import PriorDensity
from hotlever.estimate.options import BudgetOf
from hotlever.estimate.posterior import CurvedQuantity
from hotlever.estimate.search import Solution
from hotlever.estimate.surrogate import Rows
from hotlever.estimate.tip_table import TipTable
from hotlever.materials.departures import DEPARTURES, departure_of
from hotlever.materials.parameters import own_name
from hotlever.probe.parts import ProbeParts
from hotlever.probe.priors import SCALES
from hotlever.probe.probe_parameters import parameters_of
from hotlever.quantities import FITTED, OBSERVABLES
from hotlever.records import Number
from hotlever.text import BAND
from hotlever.types import Array, Index
from hotlever.work import one_blas_thread

# --- budgets of any quantity ----------------------------------------------------------------------


@dataclass(frozen=True)
class InputQuantity:
    """A row of a budget.

    Attributes
    ----------
    quantity : str
    estimate : float
        What was estimated.
    unit : str
    u : float
        Standard uncertainty, in the unit: of what was known beforehand, where that is stated.
    type : {"A", "B"}
        Evaluated from a series of observations, or by other means.
    distribution : str
    sensitivity : float
        Derivative of the measurand by the quantity.
    dof : float
        Degrees of freedom; infinite (in files: none) if the uncertainty is taken as exact, NaN if
        it is not known how many it has.
    prior : float, optional
        What was known beforehand, in the unit; None of what has no such value, and in files of
        versions 1 and 2, in which it stands as the estimate.
    """

    quantity: str
    estimate: Number
    unit: str
    u: Annotated[float, Field(ge=0)]
    type: Literal["A", "B"]
    distribution: str
    sensitivity: Number
    # infinite where a file has none
    dof: Annotated[
        float,
        Field(gt=0),
        WrapValidator(lambda dof, check: math.inf if dof is None else check(dof)),
    ] = math.inf
    prior: Number | None = None

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
    draw: Callable[[int], Array],
    tolerance: float,
    probability: float = 0.95,
    block: int = 10_000,
    most: int = 1_000_000,
) -> CoverageInterval:
    """Propagate distributions by as many trials as it takes (JCGM 101, 7.9.4).

    Parameters
    ----------
    draw : callable
        Return so many independent values of the measurand, (n,).
    tolerance : float
        By which a budget will be judged: blocks are added until two standard deviations of the
        mean of both ends are within a fifth of it (8.2).
    probability : float
        Of coverage.
    block, most : int
        Trials of a block, and the most of all blocks (7.2.1).
    """
    tails = 0.5 * (1.0 - probability), 0.5 * (1.0 + probability)
    blocks = [draw(block)]
    ends = [np.quantile(blocks[0], tails)]
    while len(blocks) * block < most:
        blocks.append(draw(block))
        ends.append(np.quantile(blocks[-1], tails))
        spread = 2.0 * np.std(ends, axis=0, ddof=1).max() / math.sqrt(len(ends))
        if not spread > 0.2 * tolerance:
            break
    low, high = np.quantile(np.concatenate(blocks), tails).tolist()
    return CoverageInterval(len(blocks) * block, low, high)


# --- that of a temperature ------------------------------------------------------------------------


def correction(quantity: str, u: float) -> InputQuantity:
    """Return the row of a correction of a temperature (K) that is zero with an error."""
    return InputQuantity(quantity, 0.0, "K", u, "B", "normal", 1.0)


@dataclass(frozen=True)
class TemperatureBudget:
    """The uncertainty budget of a temperature, and whether it may be linear.

    Attributes
    ----------
    budget : Budget
        In K.
    bias_V : float
    estimate_K : float
    limits_K : (float, float)
        What 95 % of the temperatures lie between as the table says: the errors say no more, where
        levers that are hotter and colder, or samples of the posterior, do not tell otherwise.
    of : {"tip", "apex"}
    monte_carlo : CoverageInterval, optional
        Of 95 %, in K; NaN if levers so near by have no states, or none as hot as its upper end or
        that of the budget was solved. None in files without one.
    """

    budget: Budget
    bias_V: float
    estimate_K: float
    limits_K: tuple[float, float]
    of: BudgetOf = "tip"
    monte_carlo: CoverageInterval | None = None

    @property
    def measurand(self) -> str:
        """What it is of, in words."""
        kind = "apex temperature in contact" if self.of == "apex" else "tip temperature"
        return f"{kind} at a bias of {self.bias_V:.4g} V"

    @property
    def linear(self) -> bool | None:
        """Whether the linear budget holds (JCGM 101, 8.1); None if that is not known.

        Both the Monte Carlo method and the limits must be where it says within half a unit of the
        first significant digit of u.
        """
        if self.monte_carlo is None:
            return None
        tolerance = self.budget.tolerance
        of_table = CoverageInterval(0, *self.limits_K)
        linearised = self._about(BAND * self.budget.u)
        return self.monte_carlo.agrees(self.interval_K, tolerance) and of_table.agrees(
            linearised, tolerance
        )

    @property
    def interval_K(self) -> tuple[float, float]:
        """Estimate minus and plus the expanded uncertainty for 95 %."""
        return self._about(self.budget.expanded())

    def _about(self, away_K: float) -> tuple[float, float]:
        return self.estimate_K - away_K, self.estimate_K + away_K

    def in_either(
        self, other: TemperatureBudget, choice_K: float, limits_K: tuple[float, float]
    ) -> TemperatureBudget:
        """Return the budget of a lever that may be in another medium as well.

        The choice adds an error, and the limits hold both.
        """
        inputs = (*self.budget.inputs, correction("medium", choice_K))
        correlation = self.budget.correlation
        if correlation is not None:
            correlation = np.pad(correlation, (0, 1))
            correlation[-1, -1] = 1.0
        own, others = self.monte_carlo, other.monte_carlo
        united = None if own is None or others is None else own.united(others)
        return replace(
            self, budget=Budget(inputs, correlation), limits_K=limits_K, monte_carlo=united
        )


def limits_of(row: TipTable, of: BudgetOf) -> tuple[float, float]:
    """Return what 95 % of a temperature lie between (K), by a row of a table.

    Those of an apex are as much further away on one side than its errors say as the tip's.
    """
    limits = row["tip_low_K"].item(), row["tip_high_K"].item()
    if of == "tip":
        return limits
    value, share = row["apex_K"].item(), (row["apex_stderr_K"] / row["tip_stderr_K"]).item()
    low, high = (value + share * (limit - row["tip_K"].item()) for limit in limits)
    return low, high


@one_blas_thread
def budget_of_estimate(solution: Solution, row: TipTable, of: BudgetOf) -> TemperatureBudget:
    """Return the budget of a temperature in a row of the table of an estimated lever.

    Parameters
    ----------
    solution : Solution
    row : TipTable
        One, with the standard errors beside those of the parameters.
    of : {"tip", "apex"}
    """
    bias_V = row["bias_V"].item()
    errors_K = row.budgets["apex_budget_K" if of == "apex" else "budget_K"]
    model = {name: errors_K[name].item() for name in ("model", "jump") if name in errors_K}
    residuals, objective, priors = solution.residuals, solution.objective, solution.priors
    predicted = solution.predicted(np.array([bias_V]))
    observable = list(FITTED).index(of)
    # a ramp of levers like it may not have jumped yet, where it is known that this one has
    surrogate = predicted.surrogate.reading(Rows(predicted.surrogate.rows.bias_V, predicted.values))
    slopes = predicted.slopes[observable, 0, objective.columns]
    contributions = {name: slopes @ by for name, by in solution.posterior.influences.items()}
    u = residuals.noise(solution.prediction.values).tolist()
    dof = residuals.errors.degrees_of_freedom(solution.posterior.leverage).tolist()
    rows = []
    for name, size, free in zip(residuals.observables, u, dof, strict=True):
        sensitivity = float(np.linalg.norm(contributions.pop(name))) / size
        kind: Literal["A", "B"] = "A" if np.isfinite(free) else "B"
        noise, unit = f"noise of {name}", FITTED[name].unit
        rows.append(InputQuantity(noise, 0.0, unit, size, kind, "normal", sensitivity, free))
    units = {name: each.unit for name, each in parameters_of(solution.probe, anywhere=True).items()}
    units |= dict.fromkeys(SCALES, "1")
    by_fit = contributions.pop("fit", None)
    for law, parts in _by_law(contributions).items():
        # a row for a law, whatever its coefficients are called
        departure, start = DEPARTURES[own_name(law)], law.removesuffix(own_name(law))
        spread = departure.spread_hot * priors[next(iter(parts))].spread
        sensitivity = float(np.linalg.norm([*parts.values()])) / spread
        found = departure.hot(
            solution.probe.values([start + own for own in departure.names]).tolist()
        )
        rows.append(
            InputQuantity(f"law.{law}", found, "1", spread, "B", "normal", sensitivity, prior=0.0)
        )
    for name, by in contributions.items():
        use = priors[name]
        sensitivity = by.item() / use.spread
        rows.append(
            InputQuantity(
                quantity=name,
                estimate=use.posterior_value,
                unit=units[name],
                u=use.spread,
                type="B",
                distribution=use.distribution,
                sensitivity=sensitivity,
                prior=use.value,
            )
        )
    rows += [correction(name, error) for name, error in model.items()]
    correlation = None
    if by_fit is not None:
        of_fit, among = _rows_of_fit(solution.probe, objective.prior, by_fit, units)
        correlation = np.eye(len(rows) + len(of_fit))
        correlation[len(rows) :, len(rows) :] = among
        rows += of_fit
    budget = Budget(tuple(rows), correlation)
    value, other = float(predicted.values[observable, 0]), float(np.linalg.norm([*model.values()]))
    temperature_budget = TemperatureBudget(budget, bias_V, value, limits_of(row, of), of)
    if not budget.u > 0.0:
        return temperature_budget
    free = dict(zip(residuals.observables, dof, strict=True))
    failed = CoverageInterval(0, np.nan, np.nan)
    try:
        curved = CurvedQuantity(solution.posterior, surrogate, observable)
    except (ComputationError, np.linalg.LinAlgError):
        return replace(temperature_budget, monte_carlo=failed)
    random = np.random.default_rng(0)
    errors = _drawing_errors(random, curved, solution.posterior.influences, free)

    def draw(count: int) -> Array:
        return value + curved.changes(errors(count)) + other * random.normal(size=count)

    interval = propagate(draw, budget.tolerance)
    # of what is hotter no lever was solved, and it may melt
    ended = predicted.values[: len(OBSERVABLES)].copy()
    ended[TIP] = surrogate.branch.hottest_K
    hottest = surrogate.contact.added(ended, solution.probe.values(objective.names))[observable, 0]
    beyond = max(interval.high, temperature_budget.interval_K[1]) > hottest
    return replace(temperature_budget, monte_carlo=failed if beyond else interval)


def _by_law(contributions: dict[str, Array]) -> dict[str, dict[str, float]]:
    """Take out the contributions of coefficients, and return them by law and coefficient.

    A law of a named material has the material's name before its own.
    """
    laws: dict[str, dict[str, float]] = {}
    for name in list(contributions):
        if (departing := departure_of(own_name(name))) is not None:
            law = name.removesuffix(own_name(name)) + departing[0].law
            laws.setdefault(law, {})[name] = contributions.pop(name).item()
    return laws


def _rows_of_fit(
    probe: ProbeParts, prior: PriorDensity, by_fit: Array, units: Mapping[str, str]
) -> tuple[list[InputQuantity], Array]:
    """Return the parameters that a fit to other data has left as rows, and their correlation.

    By how uncorrelated deviations of that fit move the temperature, (m,).
    """
    numbers = [number for number, source in enumerate(prior.sources) if source == "fit"]
    whitening = prior.whitening[np.ix_(numbers, numbers)]
    relative, values = prior.relative[numbers], prior.values[numbers]
    unit = np.where(relative, values, 1.0)
    covariance = np.linalg.inv(whitening.T @ whitening)
    spread = np.sqrt(np.diag(covariance))
    names = [prior.names[number] for number in numbers]
    distributions = np.where(relative, "log-normal", "normal").tolist()
    errors, sensitivities = (spread * unit).tolist(), (by_fit @ whitening / unit).tolist()
    found = probe.values(names).tolist()
    columns = zip(names, found, errors, distributions, sensitivities, values.tolist(), strict=True)
    rows = [
        InputQuantity(
            f"{name} of the fit", value, units[name], u, "B", distribution, sensitivity, prior=known
        )
        for name, value, u, distribution, sensitivity, known in columns
    ]
    return rows, covariance / np.outer(spread, spread)


def _drawing_errors(
    random: np.random.Generator,
    curved: CurvedQuantity,
    influences: Mapping[str, Array],
    dof: Mapping[str, float],
) -> Callable[[int], Array]:
    """Return what draws so many errors of an estimate along the axes of a quantity, (n, p).

    What is of Type A has the tails of a Student's t of its degrees of freedom (JCGM 101, 6.4.9):
    all data of an observable share their scatter.
    """
    projections = [
        (curved.axes_of(influences[name]), free) for name, free in dof.items() if np.isfinite(free)
    ]
    shares = [(projection @ projection.T, free) for projection, free in projections]
    axes = np.eye(len(next(iter(influences.values()))))
    rest = axes - sum(share for share, _ in shares)
    roots = [(_root(share), free) for share, free in [*shares, (rest, np.inf)]]

    def draw(count: int) -> Array:
        errors = np.zeros((count, len(axes)))
        for root, free in roots:
            normal = random.normal(size=errors.shape) @ root
            if np.isfinite(free):
                normal *= np.sqrt(free / random.chisquare(free, size=(count, 1)))
            errors += normal
        return errors

    return draw


def _root(covariance: Array) -> Array:
    """Return the symmetric root of a covariance, of which rounding may have left less than none."""
    variances, axes = np.linalg.eigh(covariance)
    return np.asarray((axes * np.sqrt(np.maximum(variances, 0.0))) @ axes.T)
