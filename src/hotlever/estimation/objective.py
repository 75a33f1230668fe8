"""What a fit makes small: data and priors as residuals of the parameters that it varies."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import TYPE_CHECKING

import numpy as np

from hotlever.estimation.coordinates import Coordinates
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.prior_density import PriorDensity
from hotlever.estimation.quantity import Pull
from hotlever.estimation.residuals import Residuals
from hotlever.probe import Probe
from hotlever.types import Array

if TYPE_CHECKING:
    from hotlever.estimation.result import Fit

#: Scaled residual given to trial parameters for which the lever has no state, so that a search
#: turns back.
_UNSOLVED = 10.0


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
    prior : PriorDensity, optional
        Of some of these; with it residuals count standard deviations.

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
        prior: PriorDensity | None = None,
    ) -> None:
        self.residuals, self.names, self.varied, self.prior = residuals, tuple(names), varied, prior
        self.columns = [self.names.index(name) for name in varied]
        logarithms: list[str] = []
        self._of_prior: list[int] = []
        if prior is not None:
            self._of_prior = [varied.index(name) for name in prior.names]
            logarithms = np.array(prior.names)[prior.relative].tolist()
        self.coordinates = Coordinates.of(probe, varied, logarithms)
        self.bounds = self.coordinates.bounds
        self._pull: Pull | None = None

    @classmethod
    def of_fit(cls, fit: Fit, names: Sequence[str]) -> Objective:
        """Return what a fit has made small, by derivatives by some parameters."""
        prior = PriorDensity.independent(fit.known_before) if fit.known_before else None
        return cls(fit.residuals(), fit.probe, names, fit.names, prior)

    @property
    def informed(self) -> bool:
        """Whether there are priors."""
        return self.prior is not None

    def pulled(self, pull: Pull) -> Objective:
        """Return the same with a further datum."""
        other = copy(self)
        other._pull = pull
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
        return probe.replace(dict(zip(self.varied, values, strict=True)))

    def among(self, parameters: Array, point: Array) -> Array:
        """Return the parameters `names` of a lever, (k,), with the values of a point."""
        moved = parameters.copy()
        moved[self.columns] = self.coordinates.values(point)
        return moved

    # --- residuals --------------------------------------------------------------------------------

    def residual(self, values: Array, point: Array) -> Array:
        """Return the residuals of data and priors, for predicted values (3, n)."""
        parts = [self.residuals.weighted(values), self.from_priors(point)]
        if self._pull is not None:
            pull, parameters = self._pull, self.coordinates.values(point)
            parts.append(np.array([pull.quantity.value(values, parameters) - pull.target]))
            parts[-1] /= pull.error
        return np.concatenate(parts)

    def unsolved(self, point: Array) -> Array:
        """Return residuals of a lever that has no states: far beyond any real ones."""
        data = np.full(self.residuals.size, _UNSOLVED)
        pull = np.full(0 if self._pull is None else 1, _UNSOLVED)
        return np.concatenate([data, self.from_priors(point), pull])

    def jacobian(self, slopes: Array, point: Array) -> Array:
        """Return their derivatives by the coordinates, for predicted slopes (3, n, k)."""
        rows = [self.of_data(slopes, point), self.of_priors(point)]
        if self._pull is not None:
            by = self._pull.quantity.gradient(slopes[:, :, self.columns])
            rows.append(by[None] * self.coordinates.rates(point) / self._pull.error)
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
        if self.prior is None:
            return np.empty(0)
        return self.prior.deviations(self.coordinates.values(point)[self._of_prior])

    def of_priors(self, point: Array) -> Array:
        """Return the derivatives of `from_priors` by the coordinates."""
        if self.prior is None:
            return np.empty((0, point.size))
        values = self.coordinates.values(point)[self._of_prior]
        rows = np.zeros((values.size, point.size))
        rows[:, self._of_prior] = self.prior.slopes(values)
        return np.asarray(rows * self.coordinates.rates(point))

    # --- what follows at a point ------------------------------------------------------------------

    def laplace(self, slopes: Array, point: Array) -> Array:
        """Return the covariance of the coordinates that data and priors leave, linearised, (p, p).

        NaN if they leave some of them open.
        """
        jacobian = self.jacobian(slopes, point)
        return inverse_or_nan(jacobian.T @ jacobian)

    def leverage(self, slopes: Array, point: Array) -> Array:
        """Return which share of each datum's noise a fit takes up, (observables, n)."""
        jacobian = self.of_data(slopes, point)
        leverage = np.zeros(self.residuals.data.shape)
        leverage[self.residuals.present] = np.einsum(
            "ij,jk,ik->i", jacobian, self.laplace(slopes, point), jacobian
        )
        return leverage

    def log_volume(self, point: Array) -> float:
        """Return the logarithm of the volume that a unit of the coordinates has.

        It is of what the densities of the parameters are stated by: values, or logarithms.
        """
        rates, values = self.coordinates.rates(point), self.coordinates.values(point)
        logarithmic = np.zeros(point.size, dtype=bool)
        if self.prior is not None:
            logarithmic[self._of_prior] = self.prior.relative
        return float(np.sum(np.log(np.where(logarithmic, rates / values, rates))))


def inverse_or_nan(matrix: Array) -> Array:
    """Return the inverse of a matrix; NaN if it is singular."""
    try:
        return np.asarray(np.linalg.inv(matrix), dtype=float)
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)
