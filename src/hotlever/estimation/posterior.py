"""The posterior: what data and priors leave of a lever's parameters, and of any quantity of it.

Linearised at the optimum (Laplace's approximation) it is a covariance and what adds up to it;
sampled, it is a density. The profile of a quantity is `hotlever.estimation.profile`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.objective import Objective, Quantity, inverse_or_nan
from hotlever.probe.priors import Moved
from hotlever.types import Array

#: One unknown noise scale for each observable, or one for all.
Noise = Literal["each", "common"]

#: Degrees of freedom of what is drawn from a normal approximation: its tails must be wider than
#: those of the posterior.
_TAILS = 5.0
#: A datum that alone decides a parameter says nothing of its own noise.
_LEAST_FREE = 0.05
#: Rounds in which weights and residuals settle that follow from each other.
_WEIGHT_ROUNDS = 50


def standard_errors(slopes: Array, covariance: Array) -> Array:
    """Return standard errors of quantities with derivatives (..., p), by a covariance (p, p)."""
    return np.sqrt(np.einsum("...p,pq,...q->...", slopes, covariance, slopes))


class Posterior:
    """What is known of the varied parameters, (p,), after the data.

    Parameters
    ----------
    objective : Objective
    at : Prediction
        The optimum.
    """

    def __init__(self, objective: Objective, at: Prediction) -> None:
        self.objective, self.at = objective, at
        self._point = objective.point(at.probe)
        self._rates = objective.coordinates.rates(self._point)

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the varied parameters in their own units, (p, p); NaN if singular.

        With priors it is Laplace's. Without, noise differs between observables and along each of
        them by more than the weights know, so every datum's variance is taken from its own
        residual, enlarged by its leverage h (MacKinnon and White's HC3, J. Econometrics 29, 305
        (1985)): C = A⁻¹ Jᵀ V J A⁻¹ with A = JᵀJ and V = r² / (1 − h)².
        """
        if self.objective.informed:
            laplace = self.objective.laplace(self.at.slopes, self._point)
            return laplace * np.outer(self._rates, self._rates)
        return np.asarray(self._by_residuals @ self._by_residuals.T)

    @property
    def _by_residuals(self) -> Array:
        """How far each datum's own residual, enlarged by its leverage, moves parameters, (p, N)."""
        objective = self.objective
        residual = objective.residuals.weighted(self.at.values)
        jacobian = objective.of_data(self.at.slopes, self._point)
        inverse = inverse_or_nan(jacobian.T @ jacobian)
        if residual.size <= self._point.size:
            return np.full_like(jacobian.T, np.nan)
        leverage = np.einsum("ij,jk,ik->i", jacobian, inverse, jacobian)
        influence = inverse @ jacobian.T * (residual / np.maximum(1.0 - leverage, _LEAST_FREE))
        return np.asarray(self._rates[:, None] * influence)

    @cached_property
    def influences(self) -> dict[str, Array]:
        """How far independent errors of one standard deviation move the parameters, (p, m) each.

        By the observable of data with noise, the scale of a meter or thermometer, and the source
        of a prior: the estimate is, to first order, a weighted sum of all of them, each with an
        error of its own.
        """
        objective, prior = self.objective, self.objective.prior
        if not objective.informed:
            moved = objective.residuals.of_errors(self._by_residuals.T)
            return {name: rows.T for name, rows in moved.items()}
        influence = self._rates[:, None] * objective.laplace(self.at.slopes, self._point)
        jacobian = objective.of_data(self.at.slopes, self._point)
        by_data = objective.residuals.of_errors(jacobian)
        influences = {name: influence @ rows.T for name, rows in by_data.items()}
        by_prior, sources = objective.of_priors(self._point), np.array(prior.sources)
        for source in dict.fromkeys(prior.sources):
            influences[source] = influence @ by_prior[sources == source].T
        return influences

    @cached_property
    def shares(self) -> dict[str, Array]:
        """What adds up to the covariance, (p, p) each, independent of each other.

        By the source of each prior, and of the data as ``measurement``.
        """
        shares: dict[str, Array] = {}
        for name, columns in self.influences.items():
            source = name if name in self.objective.prior.sources else "measurement"
            shares[source] = shares.get(source, 0.0) + columns @ columns.T
        return shares

    @cached_property
    def moved(self) -> dict[str, Moved]:
        """How far the data moved parameters and scales from their own priors, by name.

        They are those of the optimum of the linearised problem. What data hardly tell is moved by
        little, and a search may end further from the optimum than that.
        """
        objective, prior = self.objective, self.objective.prior
        point, residual, jacobian = objective.linearised(self.at)
        laplace = objective.laplace(self.at.slopes, point)
        step = -laplace @ (jacobian.T @ residual) if objective.informed else np.zeros(point.size)
        values = self.at.values + self.slopes @ (self._rates * step)
        scales = objective.residuals.in_common(values, self.slopes, self.covariance)
        by = objective.of_priors(point)
        away = objective.from_priors(point) + by @ step
        left = standard_errors(by, laplace).tolist()
        rows = zip(prior.sources, away.tolist(), left, strict=True)
        return {name: Moved(size, rest) for name, size, rest in rows if name != "fit"} | scales

    @property
    def slopes(self) -> Array:
        """Derivatives of what is predicted by the varied parameters, (m, n, p)."""
        return self.at.slopes[:, :, self.objective.columns]

    def principal_steps(self, least: float = 0.0) -> list[dict[str, float]]:
        """Return changes of the parameters by one standard error, independent of each other.

        They are along the axes of the correlation, those left out whose variance is less than
        some share of a parameter's.
        """
        scale = np.sqrt(np.diag(self.covariance))
        variances, axes = np.linalg.eigh(self.covariance / np.outer(scale, scale))
        steps = (axes * np.sqrt(np.maximum(variances, 0.0)) * scale[:, None]).T
        names = self.objective.varied
        return [dict(zip(names, step.tolist(), strict=True)) for step in steps[variances >= least]]

    def changes(self, function: Callable[[Array], Array]) -> Array:
        """Return how values (m,) change by one standard error along each axis, (p, m).

        Their squares add up to the variances. The function is of the parameters `names` of the
        objective, (k,); differences are central, half a standard error either way.
        """
        names = self.objective.names
        origin, rows = self.at.probe.values(names), []
        for step in self.principal_steps():
            half = 0.5 * np.array([step.get(name, 0.0) for name in names])
            rows.append(function(origin + half) - function(origin - half))
        return np.array(rows)

    def of(self, quantity: Quantity) -> tuple[float, float]:
        """Return a quantity and its standard error, linearised."""
        value = quantity.value(self.at.values, self.at.probe.values(self.objective.varied))
        return value, float(standard_errors(quantity.gradient(self.slopes), self.covariance))

    @property
    def deviance(self) -> float:
        """Minus twice the logarithm of the probability at the optimum, up to a constant.

        With it estimates of a lever from the same data are compared, in one medium and another.
        """
        residuals = self.objective.residuals
        if not self.objective.informed:
            # the noise is unknown and in common
            weighted = residuals.weighted(self.at.values)
            return residuals.size * float(np.log(weighted @ weighted))
        return float(self.objective.squares(self.at) + residuals.errors.normalisation)


@dataclass(frozen=True)
class Gaussian:
    """A normal approximation of a density of d quantities.

    What is drawn from it has its middle and shape, but the wide tails of a Student's t.
    """

    mean: Array
    covariance: Array

    def wide_draws(self, count: int, random: Any) -> Array:
        """Draw points, shape (count, d)."""
        normal = random.normal(size=(count, self.mean.size))
        stretch = np.sqrt(_TAILS / random.chisquare(_TAILS, size=(count, 1)))
        return np.asarray(self.mean + stretch * (normal @ np.linalg.cholesky(self.covariance).T))

    def wide_log_density(self, points: Array) -> Array:
        """Return the logarithm of the density of such draws, up to a constant."""
        away = points - self.mean
        lengths = np.einsum("ij,jk,ik->i", away, np.linalg.inv(self.covariance), away)
        return np.asarray(-0.5 * (_TAILS + self.mean.size) * np.log1p(lengths / _TAILS))


class PosteriorDensity:
    """The density of the coordinates, for a sampler.

    The likelihood takes weighted residuals as normal. Without priors their noise is unknown, with
    the prior 1/σ, and integrated out exactly: a group of n residuals with the sum of squares Q
    contributes Q^(−n/2). With priors residuals count standard deviations, and contribute
    exp(−Q/2). A parameter without a prior is uniform within its bounds.

    Parameters
    ----------
    objective : Objective
    at : Prediction
        About which it is approximated.
    shown : callable
        Return the observables (m, n) at a point; picklable, if it is sampled in processes.
    noise : {"each", "common"}
        What shares a noise scale: an observable, or all.
    """

    def __init__(
        self,
        objective: Objective,
        at: Prediction,
        shown: Callable[[Array], Array],
        noise: Noise = "each",
    ) -> None:
        self.objective, self.optimum = objective, objective.point(at.probe)
        self._shown = shown
        self._residual = objective.residuals.weighted(at.values)
        self._jacobian = objective.of_data(at.slopes, self.optimum)
        # the data that share a noise scale
        self._group = np.nonzero(objective.residuals.present)[0] * (noise == "each")
        self._counts = np.bincount(self._group)

    def log_probability(self, point: Array) -> float:
        """Return the logarithm of the density, up to a constant; −∞ where there is no lever."""
        low, high = self.objective.bounds
        if np.any(point <= low) or np.any(point >= high):
            return -math.inf
        try:
            residual = self.objective.residuals.weighted(self._shown(point))
        except ComputationError:
            return -math.inf
        unlikely = float(residual @ residual)
        if not self.objective.informed:
            unlikely = float(self._counts @ np.log(self._squares(residual)))
        from_priors = self.objective.from_priors(point)
        return -0.5 * float(unlikely + from_priors @ from_priors) + self.objective.log_volume(point)

    @property
    def approximation(self) -> Gaussian:
        """What it is if the model is linear in the coordinates: a normal density.

        Without priors the weights follow from the residuals and the residuals from the weights; a
        few dozen rounds settle both.
        """
        objective, (low, high) = self.objective, self.objective.bounds
        residual, jacobian = self._residual, self._jacobian
        of_priors = objective.of_priors(self.optimum)
        pull = of_priors.T @ objective.from_priors(self.optimum)
        uniform = np.where(of_priors.any(axis=0), 0.0, 12.0 / (high - low) ** 2)
        prior = np.diag(uniform) + of_priors.T @ of_priors
        step, weights = np.zeros(self.optimum.size), np.ones(residual.size)
        for _ in range(1 if objective.informed else _WEIGHT_ROUNDS):
            if not objective.informed:
                squares = self._squares(residual + jacobian @ step)
                weights = (self._counts / squares)[self._group]
            covariance = np.linalg.inv(jacobian.T @ (weights[:, None] * jacobian) + prior)
            step = -covariance @ (jacobian.T @ (weights * residual) + pull)
        margin = 1e-3 * (high - low)
        mean = np.clip(self.optimum + step, low + margin, high - margin)
        return Gaussian(mean, np.asarray(covariance, dtype=float))

    def _squares(self, residual: Array) -> Array:
        """Return the sum of squares of each group; never zero, for its logarithm."""
        return np.maximum(np.bincount(self._group, residual**2), np.finfo(float).tiny)
