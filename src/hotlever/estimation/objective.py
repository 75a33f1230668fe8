"""What an estimate makes small: data, priors and a penalty, as residuals of what is varied."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hotlever.errors import InputError
from hotlever.estimation.experiment import TIP, Prediction
from hotlever.estimation.prior_density import FLAT, Coordinates, PriorDensity
from hotlever.estimation.residuals import Residuals
from hotlever.probe import Probe
from hotlever.types import Array

#: Share of the range between its bounds within which a parameter is at one of them.
_AT_BOUND = 1e-5


class Quantity(Protocol):
    """A number that follows from a lever."""

    def value(self, values: Array, parameters: Array) -> float:
        """Return it for predicted values (m, n) and the varied parameters (p,)."""
        ...

    def gradient(self, slopes: Array) -> Array:
        """Return its derivatives by the parameters, (p,), for those of the values (m, n, p)."""
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
class Penalty:
    """A further datum: a quantity has a value, within an error in its unit.

    The optimum with it lies on the profile likelihood of the quantity: of all levers with its
    value there, it is the one nearest to data and priors.
    """

    quantity: Quantity
    target: float
    error: float


#: Scaled residual given to trial parameters for which the lever has no state, so that a search
#: turns back.
_UNSOLVED = 10.0
#: A symmetric matrix of unit diagonal with a smaller eigenvalue is singular but for rounding.
_SINGULAR = 1e-12


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

    def values(self, probe: Probe) -> Array:
        """Return the varied parameters of a probe in their own units."""
        return probe.values(self.varied)

    def point(self, probe: Probe) -> Array:
        """Return the point of a probe."""
        return self.coordinates.point(self.values(probe))

    def at(self, probe: Probe, point: Array) -> Probe:
        """Return a probe with the values of a point.

        Raises
        ------
        InputError
            If no such lever can be drawn.
        """
        values = self.coordinates.values(point).tolist()
        moved = probe.replace(dict(zip(self.varied, values, strict=True)))
        try:
            moved.shape.check()
        except ValueError as error:
            raise InputError(f"probe: {error}") from None
        return moved

    def among(self, parameters: Array, point: Array) -> Array:
        """Return the parameters `names` of a lever, (k,), with the values of a point."""
        moved = parameters.copy()
        moved[self.columns] = self.coordinates.values(point)
        return moved

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
        data = np.full(self.residuals.size, _UNSOLVED)
        penalty = np.full(0 if self._penalty is None else 1, _UNSOLVED)
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
        margin = _AT_BOUND * (high - low)
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

    # --- what follows at a point ------------------------------------------------------------------

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


def inverse_or_nan(matrix: Array) -> Array:
    """Return the inverse of a symmetric matrix; NaN if it is singular but for rounding errors."""
    scale = np.sqrt(np.diag(matrix))
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = matrix / np.outer(scale, scale)
    if not np.isfinite(unit).all() or np.linalg.eigvalsh(unit)[0] < _SINGULAR:
        return np.full_like(matrix, np.nan)
    return np.asarray(np.linalg.inv(matrix), dtype=float)
