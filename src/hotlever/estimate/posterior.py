"""The posterior: what data and priors leave of a lever's parameters, and of any quantity of it.

Linearised at the optimum (Laplace's approximation) it is a covariance and what adds up to it;
sampled, it is a density (`hotlever.estimate.sampling`). A tip temperature is profiled as the
parameters of a fit are (`hotlever.estimate.uncertainty`): it is moved by a further datum, and the
lever is estimated anew.

A quantity is curved beyond first order in the errors of data and priors. Errors that move an
estimate by δ, if everything is linear, move it to the x at which the residuals r have changed by as
much as δ would change them along all directions that parameters can take:
(JᵀJ)⁻¹ Jᵀ (r(x) − r(0)) = δ. To second order x = δ − ½ (JᵀJ)⁻¹ Jᵀ r″[δ, δ], and the quantity
changes by g x + ½ xᵀ H x. Along the axis where that bends most it is solved instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import optimize
from scipy.interpolate import PchipInterpolator

from hotlever.errors import HotleverError
from hotlever.estimate.experiment import TIP, Experiment, Prediction
from hotlever.estimate.objective import (
    EstimatedQuantity,
    Objective,
    Penalty,
    Subproblem,
    inverse_or_nan,
)
from hotlever.estimate.surrogate import Surrogate
from hotlever.materials.departures import departure_of
from hotlever.materials.parameters import is_of_material, own_name
from hotlever.probe.priors import PriorShift
from hotlever.text import BAND
from hotlever.types import Array, Index

#: By which source of error a parameter counts that is not the lever's own.
OF_THE_MEASUREMENT = {
    **dict.fromkeys(
        ("series_resistance_ohm", "bridge_upper_ohm", "bridge_lower_ohm", "bridge_offset_V"),
        "electronics",
    ),
    "gas_conductivity": "air",
    "surface_gap_um": "air",
    "base_temperature_K": "base temperature",
    "chip_K_per_mW": "base temperature",
    "interface_K_per_mW": "contact",
}


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
        # a row at whose bias there is no state tells that the lever is colder, and not by how much
        slopes = np.where(at.without_state[:, None], 0.0, at.slopes)
        self.objective, self.at = objective, replace(at, slopes=slopes)
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
    def leverage(self) -> Array:
        """Which share of each datum's noise the parameters have taken up, (observables, n)."""
        return self.objective.leverage(self.at.slopes, self._point)

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
        free = np.maximum(1.0 - leverage, objective.residuals.numerics.noise.least_free)
        influence = inverse @ jacobian.T * (residual / free)
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
            by_data = objective.residuals.of_errors(self._by_residuals.T)
            return {name: rows.T for name, rows in by_data.items()}
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

    def errors_by_source(self, slopes: Array) -> dict[str, Array]:
        """Return standard errors by source, by derivatives by the varied parameters (..., p).

        Independent of each other, they add up to what the posterior says.
        """
        errors: dict[str, Array] = {}
        for name, share in self.shares.items():
            own = "material" if is_of_material(name) else "geometry"
            own = own if departure_of(own_name(name)) is None else "laws"
            source = name if name in ("measurement", "fit") else OF_THE_MEASUREMENT.get(name, own)
            errors[source] = np.hypot(errors.get(source, 0.0), standard_errors(slopes, share))
        return errors

    @cached_property
    def shifts(self) -> dict[str, PriorShift]:
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
        return {name: PriorShift(size, rest) for name, size, rest in rows if name != "fit"} | scales

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

    def of(self, quantity: EstimatedQuantity) -> tuple[float, float]:
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


class CurvedQuantity:
    """How a predicted quantity changes with the errors of an estimate.

    Levers are taken from the surrogates of the optimum. Errors are counted along axes, (p,), in
    which those that the posterior leaves are independent and of unit variance.

    Parameters
    ----------
    posterior : Posterior
    surrogate : Surrogate
        Of the estimated lever, in one row.
    observable : int
        Place of the quantity among its values.

    Raises
    ------
    ComputationError
        If a lever half a standard error away has no such states.
    """

    def __init__(self, posterior: Posterior, surrogate: Surrogate, observable: int) -> None:
        objective = posterior.objective
        self._near, self._surrogate = Subproblem(objective, posterior.at), surrogate
        self._parameters = posterior.at.probe.values(objective.names)
        self._observable = observable
        self._axes = np.linalg.cholesky(posterior.covariance)
        self._steps = self._axes / objective.coordinates.rates(self._near.origin)[:, None]
        jacobian, self._gradient = self._derivatives(self._near.origin)
        self._inverse = np.linalg.pinv(jacobian)
        self._curvature = self._second_derivatives()
        bent, axes = np.linalg.eigh(self._curvature)
        self._bent_axis = axes[:, np.argmax(np.abs(bent))]
        self._along: PchipInterpolator | None = None
        # if its second derivative is no small share of the standard error
        if np.abs(bent).max() > 0.1 * np.linalg.norm(self._gradient):
            self._along = self._solved_along(self._bent_axis)

    def axes_of(self, influences: Array) -> Array:
        """Return how far influences on the parameters, (p, m), move an estimate along the axes."""
        return np.asarray(np.linalg.solve(self._axes, influences))

    def changes(self, errors: Array) -> Array:
        """Return by how much errors (n, p) change the quantity, (n,)."""
        bent = np.einsum("ni,ni->n", errors @ self._curvature, errors)
        changes = np.asarray(errors @ self._gradient + 0.5 * bent)
        if self._along is None:
            return changes
        far = errors @ self._bent_axis
        within = np.clip(far, self._along.x[0], self._along.x[-1])
        solved = self._along(within) + self._along(within, 1) * (far - within)
        # the axis is one of the curvature's own, so that it has no part in the others
        slope, bend = self._bent_axis @ self._gradient, self._bent_axis @ self._curvature
        return changes + solved - far * (slope + 0.5 * far * (bend @ self._bent_axis))

    def _derivatives(self, point: Array) -> tuple[Array, Array]:
        """Return those of the residuals, (N, p), and of the quantity, (p,), along the axes."""
        objective = self._near.objective
        _, slopes = self._surrogate.predict(objective.among(self._parameters, point))
        gradient = slopes[self._observable, 0, objective.columns]
        gradient = gradient * objective.coordinates.rates(point)
        return self._near.jacobian(point) @ self._steps, gradient @ self._steps

    def _second_derivatives(self) -> Array:
        """Return those of the quantity by errors, (p, p)."""
        by_residuals, rows = self._gradient @ self._inverse, []
        size = 0.5  # standard errors on either side over which derivatives are compared
        for step in size * self._steps.T:
            (after, risen), (before, fallen) = (
                self._derivatives(self._near.origin + way * step) for way in (1.0, -1.0)
            )
            rows.append((risen - fallen - by_residuals @ (after - before)) / (2.0 * size))
        return 0.5 * (np.array(rows) + np.transpose(rows))

    def _solved_along(self, axis: Array) -> PchipInterpolator:
        """Return how the quantity changes along an axis, as far as levers were solved for."""
        near, objective = self._near, self._near.objective
        low, high = objective.bounds
        at_rest, changes = near.residual(near.origin), {0.0: 0.0}
        value = self._value(near.origin)
        for way in (-1.0, 1.0):
            point = near.origin
            for size in (1.25, 2.5):  # standard errors
                target = way * size * axis
                point = optimize.least_squares(
                    lambda point, to=target: self._inverse @ (near.residual(point) - at_rest) - to,
                    point,
                    lambda point: self._inverse @ near.jacobian(point),
                    (low, high),
                    x_scale="jac",
                    ftol=1e-6,
                    max_nfev=50,
                ).x
                changes[way * size] = self._value(point) - value
        return PchipInterpolator(*np.transpose(sorted(changes.items())))

    def _value(self, point: Array) -> float:
        parameters = self._near.objective.among(self._parameters, point)
        return float(self._surrogate.values_at(parameters)[self._observable, 0])


# --- the profile of a tip temperature -------------------------------------------------------------


@dataclass(frozen=True)
class ErrorProfile:
    """Standard errors of the tip temperature on either side, as multiples of the linearised one.

    Attributes
    ----------
    tip_K : ndarray, shape (k,)
        Rising.
    below, above : ndarray, shape (k,)
    """

    tip_K: Array
    below: Array
    above: Array

    @property
    def linear(self) -> bool:
        """Whether the linearised error is right within a quarter everywhere."""
        return bool(np.abs(np.log([self.below, self.above])).max() < np.log(1.25))

    def credible_interval(
        self, tip_K: Array, stderr_K: Array, other_K: Array
    ) -> tuple[Array, Array]:
        """Return what 95 % of the tip temperatures lie between (K).

        The profile is that of the linearised error `stderr_K`; an `other_K` is the same either way.
        """
        below, above = (np.interp(tip_K, self.tip_K, side) for side in (self.below, self.above))
        low, high = (BAND * np.hypot(side * stderr_K, other_K) for side in (below, above))
        return tip_K - low, tip_K + high


def profile_of_tip(
    posterior: Posterior,
    experiment: Experiment,
    *,
    distance: float = 2.0,
    most_solved: int = 3,
    closeness: float = 0.3,
    least_rise: float = 0.25,
    narrowest: float = 0.6,
) -> ErrorProfile:
    """Move the tip temperature of an estimate with priors away from its optimum.

    On either side the lever is solved whose tip is moved away where it is hottest; what is near it
    serves the other biases. What the optimum tells of levers so far away does not hold where
    parameters make up for each other along a bent valley. Where no such lever is found the
    linearised error is kept, and where nothing that is unknown moves the tip there is none.

    Parameters
    ----------
    posterior : Posterior
    experiment : Experiment
    distance : float
        How far the tip temperature is moved, in standard errors.
    most_solved : int
        Levers that are solved on each side at most.
    closeness : float
        One is near enough if the moved estimate is no further from it than this share of the way
        from the optimum: where levers were solved on until the sum of squares was known within 0.4,
        the standard error changed by 3 % at most.
    least_rise : float
        A rise of the sum of squares below which a side is open.
    narrowest : float
        No side is narrower than this share of the linearised error. Near a fold the search for a
        moved lever may end short of the nearest one, and its sum of squares rises by too much: one
        of 200 levers of which little is known was eleven of its errors off, on a side of a seventh.
    """
    objective, at, rows = posterior.objective, posterior.at, hotter_rows(posterior.at)
    least = objective.squares(at)
    tips = {number: EstimatedQuantity("tip", int(row)) for number, row in enumerate(rows)}
    moving = {number: tip for number, tip in tips.items() if posterior.of(tip)[1] > 0.0}
    sides = np.ones((2, rows.size))
    for side, way in enumerate((-1.0, 1.0) if moving else ()):
        away = way * distance
        penalised = [objective.penalised(_penalty(posterior, tip, away)) for tip in moving.values()]
        near = _solved_near(penalised[-1], posterior, experiment, most_solved, closeness)
        if near is None:
            continue
        for pulled, (number, tip) in zip(penalised, moving.items(), strict=True):
            there, _ = near.of(pulled).minimum()
            value, stderr = posterior.of(tip)
            moved = abs(tip.value(near.values_at(there), there) - value)
            rise = max(near.squares(there) - least, least_rise)
            sides[side, number] = max(moved / (stderr * np.sqrt(rise)), narrowest)
    return ErrorProfile(at.values[TIP, rows], *sides)


def _solved_near(
    penalised: Objective,
    posterior: Posterior,
    experiment: Experiment,
    most: int,
    closeness: float,
) -> Subproblem | None:
    """Solve the lever that a pulled objective leads to, and return what is near it.

    It is moved again from there until that moves it little; None if that does not end. No trial is
    rejected, as a search would: what is near a lever that lies too far off knows the way back. But
    where the second does not move it half as little as the first, both lead to each other.
    """
    objective, at = posterior.objective, posterior.at
    optimum = objective.point(at.probe)
    # lengths in standard errors of the parameters
    errors = np.sqrt(np.diag(posterior.covariance)) / objective.coordinates.rates(optimum)
    near, last = Subproblem(objective, at), float("inf")
    for count in range(most + 1):
        there, _ = near.of(penalised).minimum()
        step_length = float(np.linalg.norm((there - near.origin) / errors))
        moved = np.linalg.norm((near.origin - optimum) / errors)
        if count and step_length < closeness * moved:
            return near
        if count > 1 and step_length > 0.5 * last:
            return None
        last = step_length
        if count < most:
            try:
                solved = experiment.predict(objective.at(near.at.probe, there), near.at)
            except HotleverError:  # it melts below the highest bias, or cannot be drawn
                return None
            near = Subproblem(objective, solved)
    return None


def _penalty(posterior: Posterior, tip: EstimatedQuantity, away: float) -> Penalty:
    """Return a datum that moves an estimate by so many standard errors, if everything is linear.

    It is twice as far away, with the error that the tip is known by: the estimate moves half way.
    """
    value, stderr = posterior.of(tip)
    return Penalty(tip, value + 2.0 * away * stderr, stderr)


def hotter_rows(at: Prediction, count: int = 3) -> Index:
    """Return the rows of the data at which limits are looked for, the hottest last."""
    order = np.argsort(at.values[TIP])
    return order[np.linspace(order.size / 2, order.size - 1, count).astype(int)]
