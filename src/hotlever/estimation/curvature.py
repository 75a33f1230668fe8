"""A quantity of an estimated lever beyond first order in the errors of data and priors.

Errors that move an estimate by δ, if everything is linear, move it to the x at which the residuals
r have changed by as much as δ would change them along all directions that parameters can take:
(JᵀJ)⁻¹ Jᵀ (r(x) − r(0)) = δ. To second order x = δ − ½ (JᵀJ)⁻¹ Jᵀ r″[δ, δ], and a quantity
changes by g x + ½ xᵀ H x. Along the axis where that bends most it is solved instead.
"""

from __future__ import annotations

import numpy as np
from scipy import optimize
from scipy.interpolate import PchipInterpolator

from hotlever.estimation.objective import Subproblem
from hotlever.estimation.posterior import Posterior
from hotlever.estimation.surrogate import Surrogate
from hotlever.types import Array

#: Standard errors on either side over which derivatives are compared.
_STEP = 0.5
#: Standard errors at which the most bent axis is solved, and how bent it must be: its second
#: derivative as a share of the quantity's standard error.
_SOLVED_AT, _BENT = (1.25, 2.5), 0.1


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
        if np.abs(bent).max() > _BENT * np.linalg.norm(self._gradient):
            self._along = self._solved_along(self._bent_axis)

    def axes_of(self, influences: Array) -> Array:
        """Return how far influences on the parameters, (p, m), move an estimate along the axes."""
        return np.asarray(np.linalg.solve(self._axes, influences))

    def changes(self, errors: Array) -> Array:
        """Return by how much errors (n, p) change the quantity, (n,)."""
        changes = self._to_second_order(errors)
        if self._along is None:
            return changes
        far = errors @ self._bent_axis
        within = np.clip(far, self._along.x[0], self._along.x[-1])
        solved = self._along(within) + self._along(within, 1) * (far - within)
        # the axis is one of the curvature's own, so that it has no part in the others
        return changes + solved - self._to_second_order(np.outer(far, self._bent_axis))

    def _to_second_order(self, errors: Array) -> Array:
        bent = np.einsum("ni,ni->n", errors @ self._curvature, errors)
        return np.asarray(errors @ self._gradient + 0.5 * bent)

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
        for step in _STEP * self._steps.T:
            (after, risen), (before, fallen) = (
                self._derivatives(self._near.origin + way * step) for way in (1.0, -1.0)
            )
            rows.append((risen - fallen - by_residuals @ (after - before)) / (2.0 * _STEP))
        return 0.5 * (np.array(rows) + np.transpose(rows))

    def _solved_along(self, axis: Array) -> PchipInterpolator:
        """Return how the quantity changes along an axis, as far as levers were solved for."""
        near, objective = self._near, self._near.objective
        low, high = objective.bounds
        at_rest, changes = near.residual(near.origin), {0.0: 0.0}
        value = self._value(near.origin)
        for way in (-1.0, 1.0):
            point = near.origin
            for size in _SOLVED_AT:
                moved = way * size * axis
                point = optimize.least_squares(
                    lambda point, to=moved: self._inverse @ (near.residual(point) - at_rest) - to,
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
        return float(self._surrogate.shown(parameters)[self._observable, 0])
