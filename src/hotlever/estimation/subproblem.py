"""The objective near a lever that was solved, from its surrogate: what a search steps by."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from copy import copy

import numpy as np
from scipy import optimize

from hotlever.errors import ComputationError
from hotlever.estimation.experiment import Prediction
from hotlever.estimation.objective import Objective
from hotlever.types import Array

#: Relative change of the sum of squares at which a minimum is found; without priors squares count
#: no standard deviations, so that next to nothing may be left.
_GAIN, _PRECISE_GAIN = 1e-5, 1e-10
#: Share of the range between its bounds by which a search must begin inside of them.
_INSIDE = 1e-6


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

    def shown(self, point: Array) -> Array:
        """Return the values of `predict` alone: a sampler asks for thousands."""
        values = self._surrogate.shown(self.objective.among(self._parameters, point))
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
        if start is None or not self._has_states(start):
            start = self.origin
        margin = _INSIDE * (high - low)
        solution = optimize.least_squares(
            self.residual,
            np.clip(start, low + margin, high - margin),
            self.jacobian,
            (low, high),
            x_scale="jac",
            ftol=_GAIN if self.objective.informed else _PRECISE_GAIN,
            xtol=1e-10,
            gtol=None,
            max_nfev=100,
        )
        return solution.x, 2.0 * float(solution.cost)

    def _has_states(self, point: Array) -> bool:
        try:
            self.predict(point)
        except ComputationError:
            return False
        return True
