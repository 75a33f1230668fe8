"""What an estimate makes small: data, priors and a penalty, as residuals of what is varied.

What is known beforehand is one normal density. A search moves the logarithms of what is known to a
share or a factor, for such priors are normal there, and the others as they are: without a prior
data may leave a doping open down to nothing, which is near by in the parameter itself and without
end in its logarithm. Near a lever that was solved residuals follow from its surrogate, and a search
steps by them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import optimize
from scipy.linalg import block_diag

from hotlever.errors import ComputationError, InputError
from hotlever.estimate.experiment import TIP, Prediction
from hotlever.estimate.residuals import Residuals
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


# --- data and priors ------------------------------------------------------------------------------


@dataclass(frozen=True)
class EstimatedQuantity:
    """A number that follows from a lever.

    Attributes
    ----------
    kind : {"tip", "parameter"}
        The tip temperature (K) at a row of the data, or a varied parameter in its own unit.
    number : int
        Of the row, or of the parameter.
    """

    kind: Literal["tip", "parameter"]
    number: int

    def value(self, values: Array, parameters: Array) -> float:
        """Return it for predicted values (m, n) and the varied parameters (p,)."""
        return float(values[TIP, self.number] if self.kind == "tip" else parameters[self.number])

    def gradient(self, slopes: Array) -> Array:
        """Return its derivatives by the parameters, (p,), for those of the values (m, n, p)."""
        if self.kind == "tip":
            return np.asarray(slopes[TIP, self.number])
        return np.asarray(np.arange(slopes.shape[-1]) == self.number, dtype=float)


@dataclass(frozen=True)
class Penalty:
    """A further datum: a quantity has a value, within an error in its unit.

    The optimum with it lies on the profile likelihood of the quantity: of all levers with its
    value there, it is the one nearest to data and priors.
    """

    quantity: EstimatedQuantity
    target: float
    error: float


class Objective:
    """Weighted residuals of data and priors, by the coordinates of the parameters that are varied.

    Parameters
    ----------
    residuals : Residuals
    probe : Probe
        Whose parameters are varied, (p,) of them.
    names : sequence of str
        Parameters of the derivatives of predictions.
    varied : list of str
        Those of them that are varied.
    prior : PriorDensity
        Of some of these; unless it is flat residuals count standard deviations.

    Attributes
    ----------
    columns : list of int
        Places of the varied parameters among the names.
    coordinates : Coordinates
        Of the varied parameters: a point, (p,), stands for their values.
    bounds : ndarray, shape (2, p)
        Of the points.
    """

    def __init__(
        self,
        residuals: Residuals,
        probe: Probe,
        names: Sequence[str],
        varied: list[str],
        prior: PriorDensity = FLAT,
    ) -> None:
        self.residuals, self.names, self.varied, self.prior = residuals, tuple(names), varied, prior
        self.columns = [self.names.index(name) for name in varied]
        self._of_prior = [varied.index(name) for name in prior.names]
        logarithms = np.array(prior.names, dtype=str)[prior.relative]
        self.coordinates = Coordinates.of(probe, varied, logarithms.tolist())
        self.bounds = self.coordinates.bounds
        self._penalty: Penalty | None = None

    @property
    def informed(self) -> bool:
        """Whether there are priors."""
        return bool(self.prior.names)

    def penalised(self, penalty: Penalty) -> Objective:
        """Return the same with a further datum."""
        other = copy(self)
        other._penalty = penalty
        return other

    # --- parameters and points --------------------------------------------------------------------

    def point(self, probe: Probe) -> Array:
        """Return the point of a probe."""
        return self.coordinates.point(probe.values(self.varied))

    def at(self, probe: Probe, point: Array) -> Probe:
        """Return a probe with the values of a point.

        Raises
        ------
        InputError
            If no such lever can be drawn.
        """
        values = self.coordinates.values(point).tolist()
        candidate = probe.replace(dict(zip(self.varied, values, strict=True)))
        try:
            candidate.shape.check()
        except ValueError as error:
            raise InputError(f"probe: {error}") from None
        return candidate

    def among(self, parameters: Array, point: Array) -> Array:
        """Return the parameters `names` of a lever, (k,), with the values of a point."""
        candidate = parameters.copy()
        candidate[self.columns] = self.coordinates.values(point)
        return candidate

    # --- residuals --------------------------------------------------------------------------------

    def residual(self, values: Array, point: Array) -> Array:
        """Return the residuals of data and priors, for predicted values (m, n)."""
        parts = [self.residuals.weighted(values), self.from_priors(point)]
        if self._penalty is not None:
            penalty, parameters = self._penalty, self.coordinates.values(point)
            away = penalty.quantity.value(values, parameters) - penalty.target
            parts.append(np.array([away / penalty.error]))
        return np.concatenate(parts)

    def unsolved(self, point: Array) -> Array:
        """Return residuals of a lever that has no states: far beyond any real ones."""
        scaled = 10.0  # so that a search turns back
        data = np.full(self.residuals.size, scaled)
        penalty = [] if self._penalty is None else [scaled]
        return np.concatenate([data, self.from_priors(point), penalty])

    def jacobian(self, slopes: Array, point: Array) -> Array:
        """Return their derivatives by the coordinates, for predicted slopes (m, n, k)."""
        rows = [self.of_data(slopes, point), self.of_priors(point)]
        if self._penalty is not None:
            by = self._penalty.quantity.gradient(slopes[:, :, self.columns])
            rows.append(by[None] * self.coordinates.rates(point) / self._penalty.error)
        return np.concatenate(rows)

    def squares(self, at: Prediction) -> float:
        """Return the sum of squares of the residuals of data and priors."""
        residual = self.residual(at.values, self.point(at.probe))
        return float(residual @ residual)

    def linearised(self, at: Prediction) -> tuple[Array, Array, Array]:
        """Return the point of a prediction, the residuals there, and their Jacobian."""
        point = self.point(at.probe)
        return point, self.residual(at.values, point), self.jacobian(at.slopes, point)

    def of_data(self, slopes: Array, point: Array) -> Array:
        """Return the derivatives of the weighted differences by the coordinates."""
        rates = self.coordinates.rates(point)
        return self.residuals.jacobian(slopes[:, :, self.columns] * rates)

    def from_priors(self, point: Array) -> Array:
        """Return how far parameters are from their priors, in standard deviations."""
        return self.prior.deviations(self.coordinates.values(point)[self._of_prior])

    def of_priors(self, point: Array) -> Array:
        """Return the derivatives of `from_priors` by the coordinates."""
        values = self.coordinates.values(point)[self._of_prior]
        rows = np.zeros((values.size, point.size))
        rows[:, self._of_prior] = self.prior.slopes(values)
        return np.asarray(rows * self.coordinates.rates(point))

    def decrement(self, at: Prediction) -> float:
        """Return by how much Gauss and Newton's step would lower the sum of squares.

        Parameters at their bounds, beyond which it leads, stay there.
        """
        point, residual, jacobian = self.linearised(at)
        low, high = self.bounds
        margin = 1e-5 * (high - low)
        free = np.ones(point.size, dtype=bool)
        for _ in range(point.size):
            step = np.zeros(point.size)
            step[free] = np.linalg.lstsq(jacobian[:, free], -residual)[0]
            held = ((point <= low + margin) & (step < 0)) | ((point >= high - margin) & (step > 0))
            if not (held & free).any():
                break
            free &= ~held
        return float(residual @ residual - np.sum((residual + jacobian @ step) ** 2))

    def common_noise_covariance(self, at: Prediction) -> Array:
        """Return the covariance (p, p) of the parameters if all residuals had the same noise.

        That is the paper's assumption. NaN if it cannot be estimated.
        """
        point, residual, jacobian = self.linearised(at)
        free = residual.size - point.size
        if free <= 0:
            return np.full((point.size, point.size), np.nan)
        rates = self.coordinates.rates(point)
        variance = residual @ residual / free * np.outer(rates, rates)
        return np.asarray(inverse_or_nan(jacobian.T @ jacobian) * variance)

    def laplace(self, slopes: Array, point: Array) -> Array:
        """Return the covariance of the coordinates that data and priors leave, linearised, (p, p).

        NaN if they leave some of them open.
        """
        jacobian = self.jacobian(slopes, point)
        return inverse_or_nan(jacobian.T @ jacobian)

    def leverage(self, slopes: Array, point: Array) -> Array:
        """Return which share of each datum's noise a fit takes up, (observables, n)."""
        return self.residuals.leverage(self.of_data(slopes, point), self.laplace(slopes, point))

    def log_volume(self, point: Array) -> float:
        """Return the logarithm of the volume that a unit of the coordinates has.

        It is of what the densities of the parameters are stated by: values, or logarithms.
        """
        rates, values = self.coordinates.rates(point), self.coordinates.values(point)
        logarithmic = np.zeros(point.size, dtype=bool)
        logarithmic[self._of_prior] = self.prior.relative
        return float(np.sum(np.log(np.where(logarithmic, rates / values, rates))))


class Subproblem:
    """Residuals and their derivatives by points near a prediction, from its surrogate.

    Other predictions say how values bend on the way to them: by what they differ there from what
    is expected, growing as the square of the distance. Distances are measured by what data and
    priors tell, so that those along the narrow valleys that a search follows are kept apart from
    those across (Schnabel and Frank, SIAM J. Numer. Anal. 21, 815 (1984)).

    Parameters
    ----------
    objective : Objective
    at : Prediction
    others : sequence of Prediction
    least : float
        Standard deviations from which on the others count: what nearer ones differ by would be
        carried too far by those who look far away.
    """

    def __init__(
        self,
        objective: Objective,
        at: Prediction,
        others: Sequence[Prediction] = (),
        least: float = 0.0,
    ) -> None:
        self.objective, self.at = objective, at
        self.origin = objective.point(at.probe)
        self._surrogate, self._parameters = at.surrogate, at.probe.values(objective.names)
        self._bends: list[tuple[Array, Array]] = []
        self._latest: tuple[Array, tuple[Array, Array]] | None = None
        jacobian = objective.jacobian(at.slopes, self.origin)
        for other in others:
            away = objective.point(other.probe) - self.origin
            along = jacobian.T @ (jacobian @ away)
            size = float(along @ away)
            with suppress(ComputationError):
                missed = other.values - self._predicted(self.origin + away)[0]
                # the product with this direction is 1 at the other prediction
                if size > least**2:
                    self._bends.append((along / size, missed))

    def of(self, objective: Objective) -> Subproblem:
        """Return the same levers, compared with the data by another objective."""
        other = copy(self)
        other.objective = objective
        return other

    def predict(self, point: Array) -> tuple[Array, Array]:
        """Return the observables (m, n), and their derivatives by all parameters (m, n, k).

        Raises
        ------
        ComputationError
            If the lever has no such states.
        """
        # asked for twice, for the residuals and their derivatives
        if self._latest is None or not np.array_equal(self._latest[0], point):
            self._latest = point.copy(), self._predicted(point)
        return self._latest[1]

    def _predicted(self, point: Array) -> tuple[Array, Array]:
        objective = self.objective
        values, slopes = self._surrogate.predict(objective.among(self._parameters, point))
        for along, missed in self._bends:
            way = float(along @ (point - self.origin))
            values = values + missed * way**2
            slopes[:, :, objective.columns] += missed[:, :, None] * (
                2.0 * way * along / objective.coordinates.rates(point)
            )
        return values, slopes

    def values_at(self, point: Array) -> Array:
        """Return the values of `predict` alone: a sampler asks for thousands."""
        values = self._surrogate.values_at(self.objective.among(self._parameters, point))
        for along, missed in self._bends:
            values = values + missed * float(along @ (point - self.origin)) ** 2
        return values

    def residual(self, point: Array) -> Array:
        """Return the residuals of data and priors; large ones if the lever has no such states."""
        try:
            return self.objective.residual(self.predict(point)[0], point)
        except ComputationError:
            return self.objective.unsolved(point)

    def jacobian(self, point: Array) -> Array:
        """Return their derivatives by the coordinates."""
        return self.objective.jacobian(self.predict(point)[1], point)

    def squares(self, point: Array) -> float:
        """Return the sum of squares of the residuals."""
        residual = self.residual(point)
        return float(residual @ residual)

    def minimum(
        self, start: Array | None = None, region: Array | None = None
    ) -> tuple[Array, float]:
        """Return the point of least squares, and these.

        Parameters
        ----------
        start : ndarray, shape (p,), optional
            Where the search begins; at the lever that was solved by default, or if there are no
            states.
        region : ndarray, shape (p,), optional
            How far it may go from that lever; by default to the bounds.
        """
        low, high = self.objective.bounds
        if region is not None:
            low = np.maximum(low, self.origin - region)
            high = np.minimum(high, self.origin + region)
        begin = self.origin
        if start is not None:
            with suppress(ComputationError):  # where there are no states, none begins
                self.predict(start)
                begin = start
        # a search must begin inside
        margin = 1e-6 * (high - low)
        solution = optimize.least_squares(
            self.residual,
            np.clip(begin, low + margin, high - margin),
            self.jacobian,
            (low, high),
            x_scale="jac",
            # without priors squares count no standard deviations: next to nothing may be left
            ftol=1e-5 if self.objective.informed else 1e-10,
            xtol=1e-10,
            gtol=None,
            max_nfev=100,
        )
        return solution.x, 2.0 * float(solution.cost)


def inverse_or_nan(matrix: Array) -> Array:
    """Return the inverse of a symmetric matrix; NaN if it is singular but for rounding errors."""
    scale = np.sqrt(np.diag(matrix))
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = matrix / np.outer(scale, scale)
    # singular but for rounding
    if not np.isfinite(unit).all() or np.linalg.eigvalsh(unit)[0] < 1e-12:
        return np.full_like(matrix, np.nan)
    return np.asarray(np.linalg.inv(matrix), dtype=float)
