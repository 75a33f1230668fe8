"""Gaussian-process regression in one dimension: a smooth curve through noisy points.

Rasmussen and Williams, "Gaussian Processes for Machine Learning", MIT Press (2006), chapters 2,
4 and 5, with the Matérn 5/2 covariance: functions with two derivatives, no more, which does not
round off a sharp bend as smoother covariances do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from hotlever.threads import one_blas_thread
from hotlever.types import Array

#: Ranges of length, amplitude and noise, for coordinates and values of the order of one.
_BOUNDS = ((0.03, 5.0), (1e-3, 20.0), (1e-6, 0.3))
#: The likelihood may have two optima: a bent curve with little noise, a smooth one with more.
_STARTS = ((0.25, 0.5, 2e-3), (0.5, 0.5, 2e-2))
#: Prior variance of the mean.
_MEAN_VARIANCE = 1.0


class SmoothCurve:
    """A curve with its uncertainty, found from noisy values by largest likelihood.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Points and values, both of the order of one.
    noise : ndarray, shape (n,)
        Standard errors of the values up to a common factor, `noise_factor`, which is found.
    start : SmoothCurve, optional
        A curve through similar values, to begin the search at.
    """

    length: float
    amplitude: float
    noise_factor: float

    @one_blas_thread
    def __init__(self, x: Array, y: Array, noise: Array, start: SmoothCurve | None = None) -> None:
        self._x, self._offset, self._noise = x, float(np.mean(y)), noise
        values = y - self._offset

        def cost(logarithms: Array) -> float:
            """Minus the logarithm of the marginal likelihood, less a constant."""
            factor = self._factorised(*np.exp(logarithms))
            return float(
                0.5 * values @ cho_solve(factor, values) + np.log(np.diag(factor[0])).sum()
            )

        starts: Sequence[tuple[float, float, float]] = _STARTS
        if start is not None:
            starts = [(start.length, start.amplitude, start.noise_factor)]
        bounds = [tuple(np.log(ends)) for ends in _BOUNDS]
        optima = [minimize(cost, np.log(one), method="L-BFGS-B", bounds=bounds) for one in starts]
        best = min(optima, key=lambda optimum: optimum.fun)
        self.length, self.amplitude, self.noise_factor = np.exp(best.x).tolist()
        self._factor = self._factorised(self.length, self.amplitude, self.noise_factor)
        self._weights = cho_solve(self._factor, values)

    def _factorised(self, length: float, amplitude: float, noise_factor: float) -> tuple:
        scaled = np.abs(self._x[:, None] - self._x) * np.sqrt(5.0) / length
        covariance = amplitude**2 * _matern(scaled) + _MEAN_VARIANCE
        covariance[np.diag_indices_from(covariance)] += (noise_factor * self._noise) ** 2 + 1e-11
        return cho_factor(covariance, lower=True)

    def _covariances(self, x: Array) -> tuple[Array, Array]:
        """Return the covariances of value and slope at some places with the values."""
        scaled = (np.asarray(x)[..., None] - self._x) * np.sqrt(5.0) / self.length
        bell = (1.0 + np.abs(scaled)) * np.exp(-np.abs(scaled))
        tilt = -(self.amplitude**2) * np.sqrt(5.0) / (3.0 * self.length) * scaled * bell
        return self.amplitude**2 * _matern(np.abs(scaled)) + _MEAN_VARIANCE, tilt

    def value(self, x: Array) -> Array:
        """Return the curve."""
        return np.asarray(self._offset + self._covariances(x)[0] @ self._weights)

    def slope(self, x: Array) -> Array:
        """Return the derivative of the curve."""
        return np.asarray(self._covariances(x)[1] @ self._weights)

    def value_stderr(self, x: float) -> float:
        """Return the standard error of the curve at a point."""
        return self._stderr(self._covariances(np.array(x))[0], self.amplitude**2 + _MEAN_VARIANCE)

    def slope_stderr(self, x: float) -> float:
        """Return the standard error of the derivative at a point."""
        prior = 5.0 / 3.0 * (self.amplitude / self.length) ** 2
        return self._stderr(self._covariances(np.array(x))[1], prior)

    def _stderr(self, k: Array, prior: float) -> float:
        return float(np.sqrt(max(prior - k @ cho_solve(self._factor, k), 0.0)))


def _matern(scaled: Array) -> Array:
    return (1.0 + scaled + scaled**2 / 3.0) * np.exp(-scaled)
