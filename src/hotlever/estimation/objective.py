"""What a fit makes small: data and priors as residuals of the parameters that it varies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from hotlever.estimation.coordinates import Coordinates
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.residuals import Residuals
from hotlever.probe import Probe
from hotlever.probe.priors import JointPrior, Moved, Prior
from hotlever.types import Array

#: A datum that alone decides a parameter says nothing of its own noise.
_LEAST_FREE = 0.05
#: Scaled residual given to trial parameters for which the lever has no state, so that a search
#: turns back.
_UNSOLVED = 10.0


@dataclass(frozen=True)
class Pull:
    """A further datum that pulls the tip temperature of a row to a value, by an error (K)."""

    row: int
    tip_K: float
    error_K: float


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
    priors : mapping of str to Prior, optional
    joint : JointPrior, optional

    Attributes
    ----------
    informed : bool
        Whether there are priors; then residuals count standard deviations.
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
        priors: Mapping[str, Prior] | None = None,
        joint: JointPrior | None = None,
    ) -> None:
        self.residuals, self.names, self.varied = residuals, tuple(names), varied
        self.columns = [self.names.index(name) for name in varied]
        self._priors = {varied.index(name): prior for name, prior in (priors or {}).items()}
        self._joint, self.informed = joint, bool(priors) or joint is not None
        self._of_joint = [] if joint is None else [varied.index(name) for name in joint.names]
        relative = {name for name, prior in (priors or {}).items() if prior.relative}
        if joint is not None:
            known = zip(joint.names, joint.relative, strict=True)
            relative |= {name for name, is_relative in known if is_relative}
        self.coordinates = Coordinates.of(probe, varied, relative)
        self.bounds = self.coordinates.bounds
        self._pull: Pull | None = None

    def pulled(self, pull: Pull) -> Objective:
        """Return the same with a further datum."""
        other = copy(self)
        other._pull = pull
        return other

    def values(self, probe: Probe) -> Array:
        """Return the varied parameters of a probe in their own units."""
        return probe.at(self.varied)

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
        return probe.moved(dict(zip(self.varied, values, strict=True)))

    def rates(self, probe: Probe) -> Array:
        """Return the derivatives of the varied parameters by their coordinates, (p,)."""
        return self.coordinates.rates(self.point(probe))

    def residual(self, values: Array, point: Array) -> Array:
        """Return the residuals of data and priors, for predicted values (3, n)."""
        residual = np.concatenate([self.residuals.weighted(values), self.from_priors(point)])
        if self._pull is None:
            return residual
        away = values[2, self._pull.row] - self._pull.tip_K
        return np.append(residual, away / self._pull.error_K)

    def unsolved(self, point: Array) -> Array:
        """Return residuals of a lever that has no states: far beyond any real ones."""
        data = np.full(self.residuals.size, _UNSOLVED)
        pull = np.full(0 if self._pull is None else 1, _UNSOLVED)
        return np.concatenate([data, self.from_priors(point), pull])

    def jacobian(self, slopes: Array, point: Array) -> Array:
        """Return their derivatives by the coordinates, for predicted slopes (3, n, k)."""
        jacobian = np.concatenate([self.of_data(slopes, point), self.of_priors(point)])
        if self._pull is None:
            return jacobian
        by = slopes[2, self._pull.row, self.columns] * self.coordinates.rates(point)
        return np.vstack([jacobian, by / self._pull.error_K])

    def squares(self, at: Prediction) -> float:
        """Return the sum of squares of the weighted residuals and of the distance from priors."""
        residual = self.residual(at.values, self.point(at.probe))
        return float(residual @ residual)

    def used_up(self, probe: Probe, slopes: Array) -> Array:
        """Return which share of each datum's noise a fit with priors uses up, (observables, n)."""
        jacobian = self.of_data(slopes, self.point(probe))
        leverage = np.zeros(self.residuals.data.shape)
        leverage[self.residuals.present] = np.einsum(
            "ij,jk,ik->i", jacobian, self._posterior(probe, slopes), jacobian
        )
        return leverage

    def _posterior(self, probe: Probe, slopes: Array) -> Array:
        """Return the covariance of the coordinates that data and priors leave."""
        jacobian = self.jacobian(slopes, self.point(probe))
        return inverse_or_nan(jacobian.T @ jacobian)

    def covariance(self, at: Prediction) -> Array:
        """Return the covariance of the varied parameters in their own units; NaN if singular.

        With priors it is that of the posterior, linearised. Without, noise differs between
        observables and along each of them by more than the weights know, so every datum's variance
        is taken from its own residual, enlarged by its leverage h (MacKinnon and White's HC3,
        J. Econometrics 29, 305 (1985)): C = A⁻¹ Jᵀ V J A⁻¹ with A = JᵀJ and V = r² / (1 − h)².
        """
        residual, rates = self.residuals.weighted(at.values), self.rates(at.probe)
        jacobian = self.of_data(at.slopes, self.point(at.probe))
        if self.informed:
            return self._posterior(at.probe, at.slopes) * np.outer(rates, rates)
        inverse = inverse_or_nan(jacobian.T @ jacobian)
        if residual.size <= rates.size:
            return np.full_like(inverse, np.nan)
        leverage = np.einsum("ij,jk,ik->i", jacobian, inverse, jacobian)
        influence = inverse @ jacobian.T * (residual / np.maximum(1.0 - leverage, _LEAST_FREE))
        return np.asarray(influence @ influence.T * np.outer(rates, rates))

    def shares(self, at: Prediction) -> dict[str, Array]:
        """Return what adds up to the covariance that priors and data leave.

        By the name of each prior, and of the data as ``measurement``: the estimate is, to first
        order, a weighted sum of all of them, each with an error of its own.
        """
        if not self.informed:
            return {"measurement": self.covariance(at)}
        jacobian = self.of_data(at.slopes, self.point(at.probe))
        prior = self.of_priors(self.point(at.probe))
        names = [*(self.varied[place] for place in self._priors), *["fit"] * len(self._of_joint)]
        left = self._posterior(at.probe, at.slopes) * self.rates(at.probe)[:, None]
        found = {"measurement": left @ (jacobian.T @ jacobian) @ left.T}
        for name, row in zip(names, prior, strict=True):
            found[name] = found.get(name, 0.0) + np.outer(left @ row, left @ row)
        return found

    def moved(self, at: Prediction) -> dict[str, Moved]:
        """Return how far a prediction is from the priors of single parameters."""
        point = self.point(at.probe)
        own = slice(len(self._priors))
        size, by = self.from_priors(point)[own], self.of_priors(point)[own]
        left = np.sqrt(np.einsum("ij,jk,ik->i", by, self._posterior(at.probe, at.slopes), by))
        names = [self.varied[place] for place in self._priors]
        return dict(zip(names, map(Moved, size.tolist(), left.tolist()), strict=True))

    def from_priors(self, point: Array) -> Array:
        """Return how far parameters are from their priors, in standard deviations."""
        values = self.coordinates.values(point)
        own = [prior.deviation(values[place]) for place, prior in self._priors.items()]
        if self._joint is not None:
            own = [*own, *self._joint.deviations(values[self._of_joint])]
        return np.array(own)

    def of_priors(self, point: Array) -> Array:
        """Return the derivatives of `from_priors` by the coordinates."""
        rows, values = np.zeros((len(self._priors), point.size)), self.coordinates.values(point)
        rates = self.coordinates.rates(point)
        for row, (place, prior) in zip(rows, self._priors.items(), strict=True):
            row[place] = prior.slope(values[place]) * rates[place]
        if self._joint is not None:
            joint = np.zeros((len(self._of_joint), point.size))
            joint[:, self._of_joint] = self._joint.slopes(values[self._of_joint])
            rows = np.concatenate([rows, joint * rates])
        return rows

    def log_volume(self, point: Array) -> float:
        """Return the logarithm of the volume that a unit of the coordinates has.

        It is of what the densities of the parameters are stated by: values, or logarithms.
        """
        by_logarithm = {place for place, prior in self._priors.items() if prior.relative}
        if self._joint is not None:
            by_logarithm |= {
                place
                for place, relative in zip(self._of_joint, self._joint.relative, strict=True)
                if relative
            }
        rates, values = self.coordinates.rates(point), self.coordinates.values(point)
        of_logarithm = np.isin(np.arange(point.size), list(by_logarithm))
        return float(np.sum(np.log(np.where(of_logarithm, rates / values, rates))))

    def of_data(self, slopes: Array, point: Array) -> Array:
        """Return the derivatives of the weighted residuals by the coordinates."""
        rates = self.coordinates.rates(point)
        return self.residuals.jacobian(slopes[:, :, self.columns] * rates)


def inside(point: Array, low: Array, high: Array) -> Array:
    """Return where a search begins that must begin within its bounds."""
    margin = 1e-6 * (high - low)
    return np.clip(point, low + margin, high - margin)


def inverse_or_nan(matrix: Array) -> Array:
    """Return the inverse of a matrix; NaN if it is singular."""
    try:
        return np.asarray(np.linalg.inv(matrix), dtype=float)
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)
